"""The one place that makes cases: of any study, and of one run as the command line asks for it."""

import threading
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import parse_engine
from proofroll.core.scene import Scene
from proofroll.core.time_grid import sampling_interval
from proofroll.files.scene_file import load_scene, read_scene_file
from proofroll.running.asking import resolve
from proofroll.running.case import Case, EngineFacts
from proofroll.running.worker_pool import Workers

_USUAL = 2.0  # s


def usual_length(scene: str) -> float:
    """Length of a run where none is given: 2 s, or the ``duration`` of the scene's file where that is shorter [s]."""
    return min(_USUAL, read_scene_file(scene).duration or _USUAL)


def case_of(
    name: str, scene: Scene, given: Iterable[str], engine: EngineFacts, until: float, every: float, **others: Any
) -> Case:
    """A case of any study, on a scene that was loaded with what it is asked and with the parameters ``given``.

    Times are those of :class:`proofroll.running.case.Case` [s], ``others`` its fields that have defaults.
    """
    parameters = {parameter: scene.parameters[parameter] for parameter in given}
    return Case(name, parameters, scene.digest, engine, until, every, asks=scene.asks, **others)


def single_case(
    scene: str,
    parameters: Mapping[str, object],
    engine: str,
    *,
    until: float | None,
    every: float | None,
    time_limit: float,
    asks: Sequence[str] = (),
    workers: Workers | None = None,
) -> Case:
    """The case of one run.

    Without ``until`` its length is the :func:`usual_length`.
    Without an interval ``every`` between samples it is that of :func:`proofroll.core.time_grid.sampling_interval`.
    The engine is asked in one of ``workers``, if they are given: the run can then go on in the same process.

    Raises:
        InputError, Missing: something that was given does not exist or makes no sense.
    """
    if not 0 < time_limit <= threading.TIMEOUT_MAX:
        raise InputError("time_limit", time_limit, "give a positive, finite time in s")
    if "asks" in parameters:
        raise InputError("asks", parameters["asks"], "this is no parameter; ask for it with --ask")
    spec = parse_engine(engine)
    try:
        loaded = load_scene(scene, asks=asks, **parameters)  # type: ignore[arg-type]  # text is checked there
    except InputError as error:
        raise InputError("--ask", error.value, error.advice) if error.field == "asks" else error from None
    facts = resolve([(spec.name, spec.options)], workers, loaded.requires)[0]
    if isinstance(facts, ProofrollError):
        raise facts
    if until is None:
        until = usual_length(scene)
    if every is None:
        every = sampling_interval(facts.step)
    return case_of(scene, loaded, parameters, facts, until, every, time_limit=time_limit, turns=True)
