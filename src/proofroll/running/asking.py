"""What engines say of themselves and of cases, each asked in a worker process."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from proofroll.core.engine_abilities import Term
from proofroll.core.errors import ProofrollError
from proofroll.core.plugins import parse_engine
from proofroll.running.case import Case, EngineDescription, EngineFacts
from proofroll.running.process import WorkerDied
from proofroll.running.worker_pool import Workers

_START_UP_SECONDS = 60.0


def describe(engine: str, workers: Workers | None = None) -> EngineDescription:
    """What an engine is, provides and has as presets; asked in a process of its own.

    Raises:
        InputError, Missing, WorkerDied: it cannot be asked.
    """
    with lent_workers(workers) as lent, lent.lend(engine) as worker:
        told = worker.request({"do": "describe", "engine": engine}, _START_UP_SECONDS)
    return EngineDescription(**{**told, "terms": [Term(**term) for term in told["terms"]]})


def described(engines: Iterable[str], workers: Workers | None = None) -> dict[str, EngineDescription | ProofrollError]:
    """What each engine tells of itself, or why it cannot be asked; their processes start together."""
    names = list(dict.fromkeys(engines))

    def ask(name: str, lent: Workers) -> EngineDescription | ProofrollError:
        try:
            return describe(name, lent)
        except ProofrollError as error:
            return error

    with lent_workers(workers) as lent, ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return dict(zip(names, pool.map(lambda name: ask(name, lent), names), strict=True))


def resolve(
    engines: Sequence[tuple[str, Mapping[str, Any]]],
    workers: Workers | None = None,
    requires: Collection[str] = (),
) -> list[EngineFacts | ProofrollError]:
    """Complete settings for engines with options, each or the reason why not, in the order given.

    Args:
        engines: names and options.
        workers: processes in which they are asked.
        requires: by the scene, which decides the formulation where none is given.
    """
    found: list[EngineFacts | ProofrollError] = [ProofrollError("not asked")] * len(engines)

    def ask(name: str, lent: Workers) -> None:
        for index, (other, options) in enumerate(engines):
            if other != name:
                continue
            request = {"do": "resolve", "engine": name, "options": dict(options), "requires": sorted(requires)}
            try:
                worker = lent.take(name)
            except ProofrollError as error:  # another interpreter that does not serve
                found[index] = error
                continue
            try:
                found[index] = EngineFacts(**worker.request(request, _START_UP_SECONDS))
            except WorkerDied as error:
                found[index] = error
                worker.close()
                continue
            except ProofrollError as error:
                found[index] = error
            except BaseException:
                worker.close()
                raise
            lent.keep(name, worker)

    # Most of it is the start of the processes and the import of the engines.
    with lent_workers(workers) as lent, ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(lambda name: ask(name, lent), dict.fromkeys(name for name, _ in engines)))
    return found


def resolve_with_truth(
    engines: Sequence[tuple[str, Mapping[str, Any]]],
    workers: Workers | None = None,
    requires: Collection[str] = (),
) -> tuple[list[EngineFacts | ProofrollError], EngineFacts]:
    """As :func:`resolve`, and what the truth says of itself.

    Raises:
        ProofrollError: the truth cannot be asked.
    """
    *found, truth = resolve([*engines, ("truth", {})], workers, requires)
    if not isinstance(truth, EngineFacts):
        raise truth
    return found, truth


def prepare(engine: str, workers: Workers) -> None:
    """Starts an engine's process and lets it import what a run needs, while the caller has other things to do.

    What is wrong with the engine is left to whoever asks it next.
    """
    with contextlib.suppress(ProofrollError), workers.lend(parse_engine(engine).name) as worker:
        worker.request({"do": "resolve", "engine": parse_engine(engine).name, "options": {}}, _START_UP_SECONDS)
        if parse_engine(engine).name == "truth":
            importing = {"function": "proofroll.files.trajectory_file:import_xarray", "arguments": {}}
            worker.request({"do": "call", **importing}, _START_UP_SECONDS)


def programs(cases: Sequence[Case], workers: Workers | None = None) -> list[tuple[str | None, str]]:
    """Engines' programs for cases (:class:`proofroll.core.engine_abilities.Reproduces`), each or None and why not."""
    found: list[tuple[str | None, str]] = []
    with lent_workers(workers) as lent:
        for case in cases:
            try:
                with lent.lend(case.engine.name) as worker:
                    request = {"do": "reproduce", "case": dataclasses.asdict(case)}
                    answer = worker.request(request, _START_UP_SECONDS)
                found.append((answer["program"], answer["message"]))
            except ProofrollError as error:
                found.append((None, str(error)))
    return found


@contextlib.contextmanager
def lent_workers(workers: Workers | None) -> Iterator[Workers]:
    """The workers that are given, or some that end with the block."""
    if workers is not None:
        yield workers
        return
    own = Workers()
    try:
        yield own
    finally:
        own.close()
