"""Questions to engines, each answered in a worker process: descriptions, settings, programs."""

import contextlib
import dataclasses
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from proofroll.core.engine_abilities import Steps, Term, stepped
from proofroll.core.errors import ProofrollError, Refused
from proofroll.core.limits import HELLO_TIME_LIMIT, PROGRAM_TIME_LIMIT
from proofroll.core.plugins import KNOWN_TITLES, engine_names, parse_engine, plain_name
from proofroll.core.scene import Scene
from proofroll.core.truth import needs_steps
from proofroll.running.case import Case, EngineDescription, EngineFacts, Status
from proofroll.running.idle_workers import Workers
from proofroll.running.process import WorkerDied

# Engines that have not answered yet, for displays of progress.
waited_for: list[str] = []


@contextlib.contextmanager
def _waiting_for(engine: str) -> Iterator[None]:
    waited_for.append(engine)
    try:
        yield
    finally:
        waited_for.remove(engine)


def _ask(engine: str, request: Mapping[str, Any], workers: Workers, seconds: float) -> dict[str, Any]:
    """Answer of an engine to one request; an engine that once did not answer in time is not asked again."""
    if engine in workers.silent:
        raise workers.silent[engine]
    limit = min(seconds, workers.patience)
    try:
        with _waiting_for(engine), workers.lend(engine) as worker:
            return worker.request(request, limit)
    except WorkerDied as error:
        if error.status is not Status.TIMEOUT:
            raise
        told = str(error) if engine in str(error) else f"{engine}: {error}"
        workers.silent[engine] = WorkerDied(error.status, told)
        raise workers.silent[engine] from None


def _answers(
    requests: Sequence[tuple[str, Mapping[str, Any]]], workers: Workers | None, seconds: float = HELLO_TIME_LIMIT
) -> list[dict[str, Any] | ProofrollError]:
    """Answers of engines to requests, or errors, in the order of the requests; engines start and answer in parallel."""
    answers: dict[int, dict[str, Any] | ProofrollError] = {}

    def ask(engine: str, lent: Workers) -> None:
        for index, (name, request) in enumerate(requests):
            if name != engine:
                continue
            try:
                answers[index] = _ask(engine, request, lent, seconds)
            except ProofrollError as error:
                answers[index] = error

    # Most of the time goes into starting processes and importing engines.
    with lent_workers(workers) as lent, ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(lambda engine: ask(engine, lent), dict.fromkeys(name for name, _ in requests)))
    return [answers[index] for index in range(len(requests))]


def describe(engine: str, workers: Workers | None = None) -> EngineDescription:
    """Description of an engine with its capabilities and presets, asked in a process of its own.

    Raises:
        InputError, Missing, WorkerDied: the engine cannot be asked.
    """
    description = describe_each([engine], workers)[engine]
    if isinstance(description, ProofrollError):
        raise description
    return description


def describe_each(
    engines: Iterable[str], workers: Workers | None = None
) -> dict[str, EngineDescription | ProofrollError]:
    """Description of each engine, or the error that prevented it."""
    names = list(dict.fromkeys(engines))
    descriptions: dict[str, EngineDescription | ProofrollError] = {}
    for name, answer in zip(
        names, _answers([(n, {"do": "describe", "engine": n}) for n in names], workers), strict=True
    ):
        if isinstance(answer, ProofrollError):
            descriptions[name] = answer
        else:
            terms = [Term(**term) for term in answer["terms"]]
            references = {key: Steps(**claim) for key, claim in answer["references"].items()}
            descriptions[name] = EngineDescription(**{**answer, "terms": terms, "references": references})
    return descriptions


def resolve(
    engines: Sequence[tuple[str, Mapping[str, Any]]],
    workers: Workers | None = None,
    requires: Collection[str] = (),
    *,
    stored: bool = True,
) -> list[EngineFacts | ProofrollError]:
    """Complete settings and facts for engines with options, or an error for each, in the order given.

    Without a given formulation, what the scene ``requires`` decides it; ``stored``: False for runs that are not stored.
    """
    common = {"do": "resolve", "requires": sorted(requires), "stored": stored}
    requests = [(name, {**common, "engine": name, "options": dict(options)}) for name, options in engines]
    answers = _answers(requests, workers)
    facts = [answer if isinstance(answer, ProofrollError) else EngineFacts(**answer) for answer in answers]
    KNOWN_TITLES.update({plain_name(item.name): item.title for item in facts if isinstance(item, EngineFacts)})
    return facts


def resolve_with_truth(
    engines: Sequence[tuple[str, Mapping[str, Any]]], workers: Workers | None = None, requires: Collection[str] = ()
) -> tuple[list[EngineFacts | ProofrollError], EngineFacts]:
    """Facts of engines as by :func:`resolve`, and of the truth. Raises ProofrollError if the truth cannot be asked."""
    *facts, truth = resolve([*engines, ("truth", {})], workers, requires)
    if not isinstance(truth, EngineFacts):
        raise truth
    return facts, truth


def on_scene(truth: EngineFacts, scene: Scene, workers: Workers | None = None) -> EngineFacts:
    """Facts of the truth for a scene: of a reference by steps with the engines that it takes, as they are now."""
    if not needs_steps(scene):
        return truth
    described = describe_each(engine_names(), workers)
    descriptions = [item for item in described.values() if isinstance(item, EngineDescription)]
    declared = {item.name: (item.references, item.provides) for item in descriptions}
    names = stepped(declared, scene.requires)
    specs = [parse_engine(name) for name in names]
    facts = resolve([(spec.name, spec.options) for spec in specs], workers)
    steps: dict[str, str] = {}
    for name, item in zip(names, facts, strict=True):
        if not isinstance(item, EngineFacts):
            break  # a witness is no reference where that cannot be asked
        steps[name] = f"{item.version} {item.code}"
    return dataclasses.replace(truth, steps=steps)


def prepare(engine: str, workers: Workers) -> None:
    """Starts an engine's process and imports what a run needs, so that the next request need not wait.

    An error of the engine is left to the next request.
    """
    with contextlib.suppress(ProofrollError):
        name = parse_engine(engine).name
        _ask(name, {"do": "resolve", "engine": name, "options": {}, "stored": False}, workers, HELLO_TIME_LIMIT)
        if name == "truth":
            importing = {"function": "proofroll.files.trajectory_file:import_xarray", "arguments": {}}
            _ask(name, {"do": "call", **importing}, workers, HELLO_TIME_LIMIT)


def programs(cases: Sequence[Case], workers: Workers | None = None) -> list[tuple[str | None, str]]:
    """Programs that show the engines' behaviour in these cases (:class:`proofroll.core.engine_abilities.Reproduces`).

    Returns:
        For each case the text, or None and the reason.
    """
    answers = _answers([_to_write(case, "reproducer") for case in cases], workers)
    return [(None, str(a)) if isinstance(a, ProofrollError) else (a.get("text"), a.get("message", "")) for a in answers]


def model_file(case: Case) -> str:
    """Text of the model file of a case, in the engine's own format.

    Raises:
        Refused: the engine writes no model files, or none of this scene.
    """
    (answer,) = _answers([_to_write(case, "model_file")], None, PROGRAM_TIME_LIMIT)
    if isinstance(answer, ProofrollError):
        raise answer
    if "text" not in answer:
        raise Refused(f"{case.engine.name}: {answer['message']}")
    return str(answer["text"])


def _to_write(case: Case, what: str) -> tuple[str, dict[str, Any]]:
    return case.engine.name, {"do": "write", "case": dataclasses.asdict(case), "what": what}


@contextlib.contextmanager
def lent_workers(workers: Workers | None) -> Iterator[Workers]:
    """Context manager that gives the workers passed in, or new ones that it closes at its end."""
    if workers is not None:
        yield workers
        return
    new_workers = Workers()
    try:
        yield new_workers
    finally:
        new_workers.close()
