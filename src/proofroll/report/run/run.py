"""Content of ``proofroll run``, and its lines on the terminal."""

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from proofroll.core.bounces import Bounce, bounces_of
from proofroll.core.columns import SMALLEST, UNCERTAIN, Columns, Variable
from proofroll.core.dataset import ended_early
from proofroll.core.diagnosis.scene_diagnosis import Diagnosis, diagnose_scene
from proofroll.core.element_abilities import TellsBounces, WatchesRuns, step_bound
from proofroll.core.events import IMPACTS, Event, events_of
from proofroll.core.number_format import number, with_bar
from proofroll.core.scene import Scene
from proofroll.files.json_data import OPTIONAL
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read_columns
from proofroll.report.labels import engine_words, omitted_lines, precision_words, preset_name, settings_text, step
from proofroll.report.run.last_values import FORCES, bounce_table, short_names, value_table
from proofroll.running.case import Case, Result, Status
from proofroll.studies.judging.reference import quiet

_FEW = 3  # most forces and moments that are shown without being asked for
_FEW_BODIES = 6  # most bodies whose places are shown where no point is tracked
_VELOCITIES = ("m/s", "rad/s")
_BUILD = 1.0  # time before the first step that is told [s]
_EVENTS = 8  # most events on the terminal; --events and --json have all


@dataclass(frozen=True)
class RunContent:
    """Content of a run.

    Attributes:
        parameters: every parameter of the scene with its value, defaults included.
        asks: results asked for besides the motion.
        precision: precision in which the engine computes, single or double.
        build_seconds: time before the first step, compilation included [s]; None: nothing was built.
        until, every: last time and sampling interval [s].
        final: variable -> value at the last sample; empty without samples.
        units: variable -> unit of ``final``.
        absent: variable without a value -> reason.
        uncertain: variable whose value may be wrong, not by the engine's fault -> reason.
        smallest: variable -> least value of the run, for variables where it matters, like a normal force.
        error_bars: of the truth, by variable.
        trajectory, plot, event_table: files that were written.
        bounces: energy and height of each impact; without error bars they are those of samples beside the impacts.
        step_bound: clause on the longest stable step and on that of the run; None: nothing bounds it.
        omitted: clauses on what the file describes and the run leaves out; None: nothing.
        quiet: sentence on a run in which nothing moves, or nothing touches; None: something does.
        ends: time from which the truth is not known [s]; samples from there on are missing; None: none is.
        processor_seconds: of the engine or the truth, which other processes do not lengthen [s]; None: unknown.
    """

    scene: str
    parameters: dict[str, float]
    asks: list[str]
    engine: str
    settings: dict[str, Any]
    precision: str
    status: str
    message: str
    until: float
    every: float
    wall_seconds: float
    build_seconds: float | None
    versions: dict[str, str]
    certificate: list[dict[str, Any]]
    diagnosis: list[Diagnosis]
    final: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    absent: dict[str, str] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    smallest: dict[str, float] | None = field(default=None, metadata=OPTIONAL)
    error_bars: dict[str, float] | None = field(default=None, metadata=OPTIONAL)
    uncertain: dict[str, str] | None = field(default=None, metadata=OPTIONAL)
    trajectory: str | None = field(default=None, metadata=OPTIONAL)
    plot: str | None = field(default=None, metadata=OPTIONAL)
    event_table: str | None = field(default=None, metadata=OPTIONAL)
    bounces: list[Bounce] | None = field(default=None, metadata=OPTIONAL)
    ends: float | None = field(default=None, metadata=OPTIONAL)
    processor_seconds: float | None = field(default=None, metadata=OPTIONAL)
    step_bound: str | None = field(default=None, metadata=OPTIONAL)
    omitted: list[str] | None = field(default=None, metadata=OPTIONAL)
    quiet: str | None = field(default=None, metadata=OPTIONAL)


def run_content(case: Case, result: Result, trajectory: Path, loaded: Scene | None = None) -> RunContent:
    """Content of a case and its result; ``trajectory``: path of its stored trajectory, ``loaded``: the case's scene."""
    scene = loaded or load_scene(case.scene, asks=case.asks, **case.parameters)
    causes = diagnose_scene(scene, result.certificate) if result.trajectory is None and result.certificate else []
    content = RunContent(
        scene=case.scene,
        parameters=dict(scene.parameters),
        asks=list(scene.asks),
        engine=case.engine.name,
        settings=case.engine.settings,
        precision=case.engine.precision,
        status=result.status.value,
        message=result.message,
        until=case.until,
        every=case.every,
        wall_seconds=result.wall_seconds,
        processor_seconds=result.processor.get("truth" if case.engine.name == "truth" else "advance"),
        build_seconds=result.build_seconds,
        versions=result.versions,
        certificate=result.certificate,
        diagnosis=causes,
        omitted=list(scene.omitted) or None,
        step_bound=step_bound(scene.elements, [] if case.engine.step is None else [case.engine.step]) or None,
    )
    if result.trajectory is None:
        return content
    columns = read_columns(trajectory)
    curves = {key: item for key, item in columns.variables.items() if item.dims == ("time",) and key != "time"}
    turned = {key: item for key, item in columns.variables.items() if case.asks and item.dims == ("time", "wxyz")}
    for key, item in turned.items():
        curves |= {f"{key}.{part}": item._replace(values=item.values[:, i]) for i, part in enumerate("wxyz")}
    curves = _places(columns, curves) | curves
    end = ended_early(columns)
    least = {key: value for key, value in columns.attrs.items() if key.startswith(SMALLEST)}
    smallest = {key.removeprefix(SMALLEST): float(value) for key, value in least.items()}
    return replace(
        content,
        final={"time": float(columns["time"].values[-1])} | {name: float(c.values[-1]) for name, c in curves.items()},
        units={"time": "s"} | {name: curve.attrs["units"] for name, curve in curves.items()},
        absent={name: str(curve.attrs["absent"]) for name, curve in curves.items() if "absent" in curve.attrs},
        uncertain={name: str(c.attrs[UNCERTAIN]) for name, c in curves.items() if UNCERTAIN in c.attrs} or None,
        events=events_of(columns),
        smallest=smallest or None,
        error_bars={name: float(c.attrs["error_bar"]) for name, c in curves.items() if "error_bar" in c.attrs} or None,
        bounces=_bounces(scene, columns) or None,
        ends=end[0] if end else None,
        quiet=quiet(scene, columns.variables, events_of(columns)) or None,
    )


def _bounces(scene: Scene, columns: Columns) -> list[Bounce]:
    """Energy and height of each impact of a scene with one element."""
    stored, watches = bounces_of(columns), [element for element in scene.elements if isinstance(element, WatchesRuns)]
    if stored is not None or len(scene.elements) != 1 or "event_kind" not in columns or not watches:
        return stored or []
    watch = watches[0].watch(())
    return list(watch.bounces(columns)) if isinstance(watch, TellsBounces) else []


def _places(columns: Columns, curves: Mapping[str, Variable]) -> dict[str, Variable]:
    """Places of the frames of a few bodies, where no point is tracked: ``<body>.x|y|z`` -> along time [m]."""
    places = columns.variables.get("p_WB")
    tracked = any(name.endswith(".x") and item.attrs.get("units") == "m" for name, item in curves.items())
    if tracked or places is None or "body" not in columns.variables:
        return {}
    bodies = [str(name) for name in columns["body"].values]
    if len(bodies) > _FEW_BODIES:
        return {}
    return {
        f"{body}.{letter}": places._replace(dims=("time",), values=places.values[:, i, axis])
        for i, body in enumerate(bodies)
        for axis, letter in enumerate("xyz")
    }


def _event_text(event: Event) -> str:
    """Text of an event: kind, name of its place if any, time and half width of its bracket."""
    time, bar = with_bar(event.time, max(event.time_high - event.time, event.time - event.time_low), 1)
    name = f" of {event.name}" if event.name else ""
    return f"{event.kind.replace('_', '-')}{name} at {time} ± {bar} s"


def _ended_words(content: RunContent, engine: str) -> str:
    """Sentence on the end of a run: who reached what time, how fast, and the time before the first step."""
    settings = content.settings
    words = engine_words(content.engine, settings.get("formulation"), engine), preset_name(settings.get("preset"))
    resolution = [name for name in ("dt", "rtol") if settings.get(name) is not None][:1]
    steps = [step(name, settings[name]) for name in resolution]
    title = ", ".join(filter(None, (*words, *precision_words(content.precision), *steps)))
    seconds = min(content.wall_seconds, content.processor_seconds or math.inf)
    if content.status != Status.DONE or content.engine == "truth":
        return f"{title}: {content.message}; {number(seconds)} s of computing"
    speed = f" ({number(content.until / seconds)}× real time)" if seconds else ""
    before = content.build_seconds or 0.0
    build = f", after {number(before)} s before the first step" if before > _BUILD else ""
    return f"{title} reached {content.until:g} s in {number(seconds)} s{speed}{build}."


def _hidden_forces(content: RunContent) -> list[str]:
    """Forces and moments, which are shown on request if they are more than a few."""
    forces = [name for name, unit in content.units.items() if unit in FORCES]
    return forces if len(forces) > _FEW else []


def event_csv(content: RunContent) -> str:
    """Events of a run as CSV: time and bracket, kind, name; of impacts energies beside them and the next apex."""
    header = ["time [s]", "low [s]", "high [s]", "kind", "name", "energy_before [J]", "energy_after [J]", "height [m]"]
    bounces = {(item.time, item.name): item for item in reversed(content.bounces or [])}
    rows: list[list[Any]] = [header]
    for event in content.events:
        row: list[Any] = [event.time, event.time_low, event.time_high, event.kind, event.name]
        bounce = bounces.get((event.time, event.name)) if event.kind in IMPACTS else None
        values = () if bounce is None else (bounce.energy_before, bounce.energy_after, bounce.height)
        row += [value if math.isfinite(value) else "" for value in values] or [""] * 3
        rows.append(row)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def run_lines(
    content: RunContent, *, engine: str = "", forces: bool = True, everything: bool = False, checked: str = ""
) -> list[Any]:
    """Lines and tables about a run for the terminal, printed by rich.

    Args:
        content: of the run.
        engine: title of the engine; empty: the engine is loaded for it.
        forces: True to show more than a few forces, too.
        everything: True to show forces, velocities, settings and all digits.
        checked: command that holds the run against the truth; empty: there is none.
    """
    from rich.text import Text

    lines: list[Any] = [Text(_ended_words(content, engine))]
    lines += [Text(content.step_bound)] if content.step_bound else []
    lines += [Text(words) for words in (*omitted_lines(content.omitted or []), *filter(None, [content.quiet]))]
    lines += [Text(f"  {cause.sentence}") for cause in content.diagnosis]
    if not content.final:
        return lines
    hidden = [] if forces or everything else _hidden_forces(content)
    moving = [] if everything else [name for name, of in content.units.items() if of in _VELOCITIES]
    named = {*content.absent, *hidden, *moving, *([] if everything else ["time"])}
    shown = [name for name in content.final if name not in named]
    least = {f"smallest {name}": value for name, value in (content.smallest or {}).items()}
    units = content.units | {f"smallest {name}": content.units.get(name, "1") for name in content.smallest or {}}
    bars = content.error_bars or {}
    last = content.final.get("time", content.until)
    ended = None if last >= content.until - content.every / 2 else last
    table = value_table(
        content.final | least, units, bars, [*shown, *least], all_digits=everything or bool(bars), ended=ended
    )
    lines += ["", table, ""]
    if hidden:
        lines.append(Text(f"{len(hidden)} forces and moments: --forces"))
    for told in (content.absent, content.uncertain or {}):
        for reason in dict.fromkeys(why for name, why in told.items() if name not in hidden):
            names = [name for name, why in told.items() if why == reason and name not in hidden]
            lines.append(Text(f"{reason}: {', '.join(short_names(names))}"))
    if content.events:
        events = ", ".join(_event_text(event) for event in content.events[:_EVENTS])
        more = len(content.events) - _EVENTS
        lines.append(Text(f"events: {events}{f' and {more} more: --events FILE.csv' if more > 0 else ''}"))
    if content.bounces:
        table, note = bounce_table(content.bounces)
        lines += [table, Text(note)] if note else [table]
    if everything:
        settings = ", ".join(filter(None, (settings_text(content.settings), *precision_words(content.precision))))
        lines += [Text(f"settings: {settings}")] if settings else []
    elif moving:
        lines.append(Text("velocities, settings, all digits: --all"))
    lines += [Text(f"is it right? {checked}")] if checked and content.status == Status.DONE else []
    files = ("trajectory", content.trajectory), ("table of events", content.event_table), ("plot", content.plot)
    for what, file in files:
        if file:
            lines.append(Text(f"The {what} is in {file}."))
    return lines
