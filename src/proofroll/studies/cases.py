"""Makes all cases: those of studies, and that of a single run on the command line."""

import math
import threading
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import parse_engine
from proofroll.core.scene import Scene
from proofroll.core.time_grid import sampling_interval
from proofroll.files.scene_file import load_scene, read_scene_file
from proofroll.running.case import Case, EngineFacts
from proofroll.running.engine_questions import on_scene, resolve
from proofroll.running.idle_workers import Workers

_USUAL = 2.0  # s


def length_of(scene: str, until: float | None) -> float:
    """Length of a run [s]; by default 2 s, or the ``duration`` of the scene's file if it is shorter."""
    return min(_USUAL, read_scene_file(scene).duration or _USUAL) if until is None else until


def require_length(until: float) -> None:
    """Raises InputError unless the length of a study's runs [s] is positive and finite."""
    if not 0 < until < math.inf:
        raise InputError("until", until, "give a positive, finite time in s")


def case_of(
    name: str, scene: Scene, names: Iterable[str], engine: EngineFacts, until: float, every: float, **others: Any
) -> Case:
    """Case of any study.

    Args:
        name: of the scene.
        scene: loaded with its questions and parameters.
        names: names of the parameters that were given.
        engine: with complete settings.
        until: last time [s].
        every: sampling interval [s].
        **others: further fields of :class:`proofroll.running.case.Case`.
    """
    parameters = {parameter: scene.parameters[parameter] for parameter in names}
    return Case(
        scene=name,
        parameters=parameters,
        scene_digest=scene.digest,
        engine=engine,
        until=until,
        every=every,
        asks=scene.asks,
        **others,
    )


def scene_of_run(scene: str, parameters: Mapping[str, object], asks: Sequence[str] = ()) -> Scene:
    """Scene of one run on the command line; arguments as of :func:`single_case`.

    Raises:
        InputError: there is no such scene or parameter, or one has a value that makes no sense.
    """
    if "asks" in parameters:
        raise InputError("asks", parameters["asks"], "this is no parameter; ask for it with --ask")
    try:
        return load_scene(scene, asks=asks, **parameters)  # type: ignore[arg-type]  # text is checked there
    except InputError as error:
        raise InputError("--ask", error.value, error.advice) if error.field == "asks" else error from None


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
    loaded: Scene | None = None,
) -> Case:
    """Case of one run on the command line, which is not stored.

    Args:
        scene: name or path.
        parameters: values of parameters, as text or numbers.
        engine: ``name`` or ``name[key=value,…]``.
        until: last time [s]; None: :func:`length_of`.
        every: sampling interval [s]; None: :func:`proofroll.core.time_grid.sampling_interval`.
        time_limit: wall time of the run [s].
        asks: results wanted besides the motion.
        workers: pool of the worker that is asked for the settings, so that it can also run the case; None: a new one.
        loaded: the scene with these parameters, if it was loaded before.

    Raises:
        InputError, Missing: an argument names something unknown or makes no sense.
    """
    if not 0 < time_limit <= threading.TIMEOUT_MAX:
        raise InputError("time_limit", time_limit, "give a positive, finite time in s")
    spec = parse_engine(engine)
    loaded = loaded or scene_of_run(scene, parameters, asks)
    facts = resolve([(spec.name, spec.options)], workers, loaded.requires, stored=False)[0]
    if isinstance(facts, ProofrollError):
        raise facts
    facts = on_scene(facts, loaded, workers) if facts.name == "truth" else facts
    until, every = length_of(scene, until), sampling_interval(facts.step) if every is None else every
    return case_of(scene, loaded, parameters, facts, until, every, time_limit=time_limit, turns=True)
