"""Default comparison of a scene that has no comparison file."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from proofroll.core.bounds import require_bounds
from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.engine_abilities import OwnOptions, offered
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.multi_element import represents
from proofroll.core.observable import Role
from proofroll.core.plugins import EngineSpec, engine_names, parse_engine, require_engine
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.core.verdict import Verdict
from proofroll.files.scene_file import SceneFile, load_scene, read_scene_file
from proofroll.files.scene_sources import OPTIONS, options_of, parts_of, source_of
from proofroll.running.case import EngineDescription, EngineFacts
from proofroll.running.engine_questions import describe_each, resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.process import processor_seconds

_UNTIL, _FIRST, _SAMPLES = 1.0, 2.0, 50  # default length [s], longest length [s], number of samples
_STEP = 4e-3  # s: sampling intervals are multiples of it, so that a ladder of steps down to 1e-3 s divides them
BUDGET = 60.0  # default processor time of all runs [s]
_CLOSE = "close"
OWN_OPTIONS = "the file's own options"  # beginning of the claim of the row that a file's options make
_BECAUSE = "no file states expectations of this scene"


def default_comparison(
    name: str,
    parameters: Mapping[str, Any],
    workers: Workers | None = None,
    budget: float | None = BUDGET,
    engines: Sequence[str] = (),
    until: float | None = None,
    every: float | None = None,
) -> Comparison:
    """Comparison of every able formulation of every installed engine with the truth of a scene; it makes no claims.

    It is a first look: if the scene lasts longer, it has the first 2 s only.

    Args:
        name: of the scene.
        parameters: of the scene, if not its defaults.
        workers: pool for the questions to engines; None: new workers.
        budget: processor time of all runs [s]; None: no limit.
        engines: as :func:`asked_rows` has them; empty: all. No other is imported.
        until: last time [s]; None: the scene's duration, at most 2 s.
        every: sampling interval [s]; None: about a fiftieth of that.

    Raises:
        InputError: there is no such scene or engine, a value makes no sense, or no engine is installed.
    """
    begin = processor_seconds()
    file, scene = read_scene_file(name), load_scene(name, **parameters)
    if until is not None:
        time_grid(until, until or 1.0)  # raises for a time that makes no sense
        require_bounds("until", until, above=0)
    rows = asked_rows(scene, file, workers, engines, _CLOSE)
    own_rows, own_unfit = ([], {}) if engines else _own_rows(name, scene, workers)
    steps = [float(parse_engine(row.engine).options.get("dt", 0.0)) for row in own_rows]
    duration = min(file.duration or _UNTIL, _FIRST) if until is None else until
    usual = times_of(replace(file, duration=duration), max(steps, default=0.0))
    until, every = usual[0] if until is None else until, usual[1] if every is None else every
    time_grid(until, every)
    rest = f" (the first {until:g} s of {file.duration:g})" if file.duration and until < file.duration - every else ""
    if not rows:
        raise InputError("engine", None, "none is installed here that can be asked; pip install 'proofroll[all]'")
    described = {} if engines else describe_each(engine_names(), workers)
    return Comparison(
        name=scene.name,
        title=file.title + rest,
        question=f"Which engines agree with the truth? {file.reason}".strip(),
        scene=name,
        until=until,
        every=every,
        vary={key: [scene.parameters[key]] for key in parameters},
        bands={_CLOSE: Band("one per cent is visible to the eye: a first look", bounds(scene, every))},
        rows=[*own_rows, *rows],
        budget=budget,
        spent=processor_seconds() - begin,
        absent={name: str(answer) for name, answer in described.items() if isinstance(answer, Missing)},
        unfit={
            name: _unfit(scene, answer)
            for name, answer in described.items()
            if not isinstance(answer, Missing) and not any(parse_engine(row.engine).name == name for row in rows)
        }
        | own_unfit,
    )


_SAID = 3  # most missing capabilities that are named


def _unfit(scene: Scene, engine: EngineDescription | ProofrollError) -> str:
    """Reason why no formulation of an engine can represent a scene: what the nearest one lacks, or its error."""
    if isinstance(engine, ProofrollError):
        return str(engine)
    lacking = [sorted(scene.requires - set(capabilities)) for capabilities in engine.provides.values()]
    least = min(lacking, key=len, default=[])
    if not least:
        return (
            "its formulations are for other scenes" if len(scene.elements) == 1 else "it has none of all its elements"
        )
    more = f" and {len(least) - _SAID} more" if len(least) > _SAID else ""
    return f"lacks {', '.join(least[:_SAID])}{more}"


def asked_rows(
    scene: Scene, file: SceneFile, workers: Workers | None, engines: Sequence[str], tolerance: str
) -> list[Row]:
    """Rows without claims of engines that a user asks for by name or ``name[key=value,…]``.

    An engine without settings has a row for each formulation that can represent the scene. If none can, or the engine
    is not installed, it has one row, whose run says why. If no engine can, all that are installed have such a row.

    Args:
        scene: the scene.
        file: of the scene.
        workers: pool for the questions to engines; None: new workers.
        engines: engines of the user; empty: all that are installed and can represent the scene.
        tolerance: name of the rows' band.

    Raises:
        InputError: there is no such engine.
    """
    texts: list[str] = []
    specs = [parse_engine(text) for text in dict.fromkeys(engines)]
    for spec in specs:
        require_engine(spec.name)
    for facts in resolve([(spec.name, spec.options) for spec in specs if spec.options], workers):
        if isinstance(facts, InputError):  # a setting that does not exist
            raise facts
    for spec in specs:
        texts += [str(spec)] if spec.options else able(scene, workers, names=[spec.name]) or [spec.name]
    texts = texts if engines else able(scene, workers) or [engine.name for engine in _installed(workers)]
    return [Row(text, tolerance, list(Verdict), because=_BECAUSE) for text in _stepped(texts, file.dt, workers)]


def own_engine(file: Path, scene: Scene, workers: Workers | None) -> tuple[OwnOptions, str]:
    """Options of a person's own model, and the engine with them, in its first formulation that represents a scene.

    Raises:
        InputError: the file has no options that can be compared, or no formulation represents the scene.
    """
    if not file.is_file():
        raise InputError("--like", file, "there is no such file")
    if (own_options := options_of(file)) is None:
        endings = " or ".join(f"*.{point.name}" for point in announced(OPTIONS))
        raise InputError("--like", file, f"give the path of your own model or program of an engine, {endings}")
    formulations = able(scene, workers, names=[own_options.engine])
    if not formulations:
        raise InputError("--like", file, f"no formulation of {own_options.engine} represents {scene.name}")
    preset = {**parse_engine(formulations[0]).options, "preset": "default"}
    (usual,) = resolve([(own_options.engine, preset)], workers)
    defaults = usual.settings if isinstance(usual, EngineFacts) else {}
    touches = own_options.of_contacts.keys() <= defaults.keys()
    taken = {**preset, **own_options.settings, **(own_options.of_contacts if touches else {})}
    unusual = {key: value for key, value in taken.items() if key in preset or str(defaults.get(key, value)) != value}
    others = [*(own_options.others_of_contacts if touches else []), *own_options.others]
    return replace(own_options, others=others), str(EngineSpec(own_options.engine, unusual))


def _own_rows(name: str, scene: Scene, workers: Workers | None) -> tuple[list[Row], dict[str, str]]:
    """Row of the engine's options in the file of a scene, if its format has any; or the reason why there is none."""
    if source_of(name) is None:
        return [], {}
    file = Path(parts_of(name)[0])
    try:
        if options_of(file) is None:
            return [], {}
        own_options, engine = own_engine(file, scene, workers)
    except InputError as error:
        return [], {OWN_OPTIONS: error.advice}
    but = f", but for {', '.join(own_options.others)}" if own_options.others else ""
    return [Row(engine, _CLOSE, list(Verdict), because=_BECAUSE, short=f"{OWN_OPTIONS}{but}")], {}


def times_of(file: SceneFile, own_step: float = 0.0) -> tuple[float, float]:
    """Last time and sampling interval of a first comparison of a scene [s], at steps of ``own_step`` if ten fit."""
    duration, step = file.duration or _UNTIL, file.every or _STEP
    if own_step:
        steps = [Fraction(length).limit_denominator(10**9) for length in (step, own_step)]
        parts = math.lcm(*(length.denominator for length in steps))
        common = math.lcm(*(int(length * parts) for length in steps)) / parts
        step = common if common <= duration / 10 else step
    every = step * max(1, round(duration / _SAMPLES / step))
    return every * max(1, int(duration / every + 1e-9)), every


def _stepped(engines: Sequence[str], dt: float | None, workers: Workers | None) -> list[str]:
    """The engines, each with the step that the scene's file recommends if its own is longer and no option gives it."""
    if dt is None:
        return [*engines]
    specs = [parse_engine(engine) for engine in engines]
    resolved = resolve([(spec.name, spec.options) for spec in specs], workers)
    return [
        str(replace(spec, options={**spec.options, "dt": f"{dt:.15g}"}))
        if isinstance(facts, EngineFacts) and "dt" not in spec.options and facts.step is not None and facts.step > dt
        else engine
        for engine, spec, facts in zip(engines, specs, resolved, strict=True)
    ]


def bounds(scene: Scene, every: float) -> dict[str, Tolerance]:
    """Tolerances: one per cent of each motion, or a thousandth of its unit if it has no size of its own.

    Watched reactions have one per cent, watched times of events the sampling interval ``every`` [s].
    """
    watched = {key: item for key, item in scene.observables.items() if item.watched}
    all_of = {key: item for key, item in scene.observables.items() if item.role is Role.MOTION}
    moves = {key: item for key, item in all_of.items() if item.headline}
    moves = moves or {scene.deciding: scene.observable(scene.deciding)}
    moves |= {key: item for key, item in all_of.items() if item.watched or item.asked_as in scene.asks}
    moves |= {key: item for key, item in watched.items() if item.role is Role.REACTION}
    tolerances = {
        key: Tolerance(0.01, True) if item.floor is not None else Tolerance(1e-3, False, item.unit)
        for key, item in moves.items()
    }
    events = [key for key, item in watched.items() if item.role is Role.EVENT]
    return tolerances | dict.fromkeys(events, Tolerance(every, False, "s"))


def able(
    scene: Scene, workers: Workers | None = None, *, preferred: bool = False, names: Sequence[str] | None = None
) -> list[str]:
    """Formulations of installed engines that can represent the scene, as files write them.

    Args:
        scene: the scene.
        workers: pool for the questions to engines; None: new workers.
        preferred: True for one formulation per engine.
        names: of the engines that are asked; None: all.
    """
    formulations = []
    for engine in _installed(workers, names):
        fitting = [
            name
            for name in engine.provides
            if represents(scene, name, engine.provides) and offered(name, scene.requires, engine.made_for)
        ]
        formulations += [f"{engine.name}[formulation={name}]" for name in fitting[: 1 if preferred else None]]
    return formulations


def _installed(workers: Workers | None, names: Sequence[str] | None = None) -> list[EngineDescription]:
    """Descriptions of the installed engines, or of those among ``names``."""
    described = describe_each(engine_names() if names is None else names, workers)
    return [item for item in described.values() if isinstance(item, EngineDescription)]
