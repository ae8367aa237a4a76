"""Content of ``proofroll run``, and its lines on the terminal."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from proofroll.core.columns import SMALLEST, UNCERTAIN
from proofroll.core.diagnosis.scene_diagnosis import Diagnosis, diagnose_scene
from proofroll.core.events import Event, events_of
from proofroll.core.number_format import number
from proofroll.files.json_data import OPTIONAL
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read_columns
from proofroll.report.labels import precision_words, settings_text
from proofroll.running.case import Case, Result

_EVENTS = 8  # most events on the terminal; the JSON document has all


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
        trajectory, plot: files that were written.
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


def run_content(case: Case, result: Result, trajectory: Path) -> RunContent:
    """Content of a case and its result; ``trajectory``: path of its stored trajectory."""
    scene = load_scene(case.scene, asks=case.asks, **case.parameters)
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
        build_seconds=result.build_seconds,
        versions=result.versions,
        certificate=result.certificate,
        diagnosis=causes,
    )
    if result.trajectory is None:
        return content
    columns = read_columns(trajectory)
    curves = {key: item for key, item in columns.variables.items() if item.dims == ("time",) and key != "time"}
    turned = {key: item for key, item in columns.variables.items() if case.asks and item.dims == ("time", "wxyz")}
    for key, item in turned.items():
        curves |= {f"{key}.{part}": item._replace(values=item.values[:, i]) for i, part in enumerate("wxyz")}
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
    )


def _event_text(event: Event) -> str:
    """Text of an event: kind, name of its place if any, time and half width of its bracket."""
    bar = number(0.5 * (event.time_high - event.time_low), 1)
    name = f" of {event.name}" if event.name else ""
    return f"{event.kind.replace('_', '-')}{name} at {event.time:.9g} ± {bar} s"


def run_lines(content: RunContent) -> list[Any]:
    """Lines and tables about a run for the terminal, printed by rich."""
    from rich.table import Column, Table
    from rich.text import Text

    settings = ", ".join(filter(None, (settings_text(content.settings), *precision_words(content.precision))))
    lines: list[Any] = [Text(f"{content.scene} in {content.engine}" + (f" ({settings})" if settings else ""))]
    lines.append(Text(f"{content.status}: {content.message}"))
    lines += [Text(f"  {cause.sentence}") for cause in content.diagnosis]
    if not content.final:
        return lines
    bars = content.error_bars or {}
    of_bars = [Column("error bar", justify="right")] if bars else []
    table = Table("at the end", Column("value", justify="right"), "unit", *of_bars, box=None, pad_edge=False)
    shown = {name: value for name, value in content.final.items() if name not in content.absent}
    for name, value in shown.items():
        bar = [f"{bars[name]:.1e}" if name in bars else ""] if bars else []
        table.add_row(name, f"{value:.12g}", content.units[name], *bar)
    lines.append(table)
    for told in (content.absent, content.uncertain or {}):
        for reason in dict.fromkeys(told.values()):
            lines.append(Text(f"{reason}: {', '.join(name for name, why in told.items() if why == reason)}"))
    for name, value in (content.smallest or {}).items():
        lines.append(Text(f"smallest {name} on the way: {value:.6g} {content.units.get(name, '')}".rstrip()))
    if content.events:
        events = ", ".join(_event_text(event) for event in content.events[:_EVENTS])
        more = len(content.events) - _EVENTS
        lines.append(Text(f"events: {events}{f' and {more} more' if more > 0 else ''}"))
    before = "" if content.build_seconds is None else f", after {number(content.build_seconds)} s before the first step"
    lines.append(Text(f"{content.wall_seconds:.3g} s of wall time{before}"))
    for what, file in (("trajectory", content.trajectory), ("plot", content.plot)):
        if file:
            lines.append(Text(f"The {what} is in {file}."))
    return lines
