"""Content of ``proofroll run``, and its lines on the terminal."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from proofroll.core.columns import SMALLEST, UNCERTAIN, Columns, Variable
from proofroll.core.dataset import ended_early
from proofroll.core.diagnosis.scene_diagnosis import Diagnosis, diagnose_scene
from proofroll.core.events import Event, events_of
from proofroll.core.number_format import number
from proofroll.core.quantity import powers_of
from proofroll.files.json_data import OPTIONAL
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read_columns
from proofroll.report.labels import precision_words, settings_text
from proofroll.running.case import Case, Result

_FORCES = ("N", "N m")
_FEW = 3  # most forces and moments that are shown without being asked for
_FEW_BODIES = 6  # most bodies whose places are shown where no point is tracked
_DIGITS = 12
_ROUND_OFF = 1e-14  # of the largest value of a dimension
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
        ends: time from which the truth is not known [s]; samples from there on are missing; None: none is.
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
    ends: float | None = field(default=None, metadata=OPTIONAL)


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
        ends=end[0] if end else None,
    )


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
    bar = number(0.5 * (event.time_high - event.time_low), 1)
    name = f" of {event.name}" if event.name else ""
    return f"{event.kind.replace('_', '-')}{name} at {event.time:.9g} ± {bar} s"


def value_text(value: float, bar: float | None, size: float) -> str:
    """Text of a value with at most twelve digits: no digit below its error bar, and 0 for round-off.

    Args:
        value: to be written.
        bar: error bar; None: it is not known.
        size: largest value of the same dimension.
    """
    if not math.isfinite(value):
        return "–"
    if abs(value) <= max(bar or 0.0, _ROUND_OFF * size):
        return "0"
    digits = _DIGITS
    if bar:
        digits = min(_DIGITS, math.floor(math.log10(abs(value))) - math.ceil(math.log10(bar)) + 1)
    return f"{value:.{max(digits, 1)}g}"


def _dimension(unit: str) -> frozenset[tuple[str, float]]:
    """Powers of base units; equal for a moment and an energy."""
    return frozenset(powers_of(unit).items())


def _place(unit: str) -> int:
    """Place of a variable in the table by its unit: places and angles, velocities, the rest, forces and moments."""
    order = {"s": 0, "m": 1, "rad": 1, "m/s": 2, "rad/s": 2}
    return 4 if unit in _FORCES else order.get(unit, 3)


def _hidden_forces(content: RunContent) -> list[str]:
    """Forces and moments, which are shown on request if they are more than a few."""
    forces = [name for name, unit in content.units.items() if unit in _FORCES]
    return forces if len(forces) > _FEW else []


def _value_table(content: RunContent, hidden: Collection[str]) -> Any:
    """Table of the last values: positions first, then velocities, energies and residuals, then forces."""
    from rich.table import Column, Table

    bars = content.error_bars or {}
    of_bars = [Column("error bar", justify="right")] if bars else []
    table = Table("at the end", Column("value", justify="right"), "unit", *of_bars, box=None, pad_edge=False)
    sizes: dict[frozenset[tuple[str, float]], float] = {}
    for name, value in content.final.items():
        if math.isfinite(value):
            dimension = _dimension(content.units[name])
            sizes[dimension] = max(sizes.get(dimension, 0.0 if dimension else 1.0), abs(value))
    shown = [name for name in content.final if name not in content.absent and name not in hidden]
    for name in sorted(shown, key=lambda item: _place(content.units[item])):
        value, unit = content.final[name], content.units[name]
        bar = bars.get(name) if math.isfinite(value) else None
        texts = [f"{bar:.1e}" if bar is not None else ""] if bars else []
        table.add_row(name, value_text(value, bar, sizes.get(_dimension(unit), 0.0)), unit, *texts)
    return table


def run_lines(content: RunContent, *, forces: bool = True) -> list[Any]:
    """Lines and tables about a run for the terminal, printed by rich; ``forces``: more than a few are shown, too."""
    from rich.text import Text

    settings = ", ".join(filter(None, (settings_text(content.settings), *precision_words(content.precision))))
    lines: list[Any] = [Text(f"{content.scene} in {content.engine}" + (f" ({settings})" if settings else ""))]
    lines.append(Text(f"{content.status}: {content.message}"))
    lines += [Text(f"  {cause.sentence}") for cause in content.diagnosis]
    if not content.final:
        return lines
    hidden = [] if forces else _hidden_forces(content)
    lines.append(_value_table(content, hidden))
    if hidden:
        lines.append(Text(f"{len(hidden)} forces and moments are not shown; --forces shows them"))
    for told in (content.absent, content.uncertain or {}):
        for reason in dict.fromkeys(why for name, why in told.items() if name not in hidden):
            names = [name for name, why in told.items() if why == reason and name not in hidden]
            lines.append(Text(f"{reason}: {', '.join(names)}"))
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
