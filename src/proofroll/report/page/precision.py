"""Work–precision pictures of a study: error against cost of every run."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from proofroll.core.verdict import SEVERITY, Verdict
from proofroll.report.labels import step, symbol
from proofroll.report.long_table import TableLine
from proofroll.report.page.candidates import held_tolerances, largest

# Least number of points of a picture; fewer are no more than a table.
_FEWEST = 2
_UNJUDGED = {Verdict.ILL_POSED, Verdict.NOT_JUDGED}


class PrecisionPoint(NamedTuple):
    """One step of a curve, over all points of its study at which it was run.

    Attributes:
        step: for a person.
        cost: wall seconds per simulated second at the slowest point.
        clean: True if clean runs measured the cost.
        verdict: the worst; empty: a step of a ladder, which has no verdict.
        errors: largest error of each quantity of the picture, relative to its size; None: not reported; 1e300: not
            finite.
        held: the smallest tolerance that the run holds without luck
            (:func:`proofroll.report.page.candidates.held_tolerances`), in place of each error.
    """

    step: str
    cost: float
    clean: bool
    verdict: str
    errors: list[float | None]
    held: list[float | None]


@dataclass(frozen=True)
class PrecisionCurve:
    """A setting with its steps, the coarsest first; ``own``: it solves equations derived for the scene."""

    engine: str
    formulation: str
    name: str
    own: bool
    points: list[PrecisionPoint]


@dataclass(frozen=True)
class WorkPrecision:
    """Curves of a study, and the names of the quantities whose errors they show."""

    quantities: list[str]
    curves: list[PrecisionCurve]


def work_precision(lines: Iterable[TableLine]) -> WorkPrecision | None:
    """Pictures of one study from its lines of the long table; None: too few of its runs were timed and judged."""
    judged = [line for line in lines if line.verdict not in _UNJUDGED]
    named = list(dict.fromkeys(line.quantity for line in judged if line.scale))
    groups = [role for role in ("motion", "reaction") if any(line.role == role and line.scale for line in judged)]
    bounds = held_tolerances(judged)
    curves: dict[tuple[str, str, str, str], list[TableLine]] = {}
    for line in judged:
        curves.setdefault((line.engine, line.formulation, line.setting, line.resolution), []).append(line)
    drawn = [_curve(curve_lines, groups, named, bounds) for curve_lines in curves.values()]
    drawn = [curve for curve in drawn if curve.points]
    if sum(len(curve.points) for curve in drawn) < _FEWEST:
        return None
    titles = {"motion": "motion (largest of all coordinates)", "reaction": "forces (largest of all reactions)"}
    return WorkPrecision([*(titles[role] for role in groups), *map(symbol, named)], drawn)


def _curve(
    lines: Sequence[TableLine], groups: Sequence[str], named: Sequence[str], bounds: dict[TableLine, float]
) -> PrecisionCurve:
    row_line = lines[0]
    steps = sorted({line.step for line in lines}, key=lambda value: -(value or 0.0))
    points = [_point([line for line in lines if line.step == value], groups, named, bounds) for value in steps]
    name = " ".join(filter(None, (row_line.formulation, row_line.setting))) or row_line.engine
    kept = [point for point in points if point is not None and any(item is not None for item in point.errors)]
    return PrecisionCurve(
        engine=row_line.engine, formulation=row_line.formulation, name=name, own=row_line.own_equations, points=kept
    )


def _point(
    lines: Sequence[TableLine], groups: Sequence[str], named: Sequence[str], bounds: dict[TableLine, float]
) -> PrecisionPoint | None:
    costs = [line.cost for line in lines if line.cost is not None]
    if len(costs) < len(lines) or any(line.status != "done" for line in lines):
        return None
    errors_of_lines = {line: line.relative for line in lines}
    errors, held = (
        [
            *(largest(lines, role, sizes) for role in groups),
            *(max((sizes[line] for line in lines if line.quantity == name), default=None) for name in named),
        ]
        for sizes in (errors_of_lines, bounds)
    )
    verdicts = [Verdict(line.verdict) for line in lines if line.verdict in SEVERITY]
    return PrecisionPoint(
        step=step(lines[0].resolution or None, lines[0].step),
        cost=_short(max(costs)),
        clean=all(line.clean for line in lines),
        verdict=max(verdicts, key=SEVERITY.index, default=""),
        errors=_shown(errors),
        held=_shown(held),
    )


def _shown(sizes: Sequence[float | None]) -> list[float | None]:
    return [None if size is None else _short(size) if math.isfinite(size) else 1e300 for size in sizes]


def _short(value: float) -> float:
    return float(f"{value:.3g}")
