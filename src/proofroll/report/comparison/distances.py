"""Distances of runs from a reference by steps, the largest up to a few times: of places, and of attitudes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.dataset import HORIZON
from proofroll.core.number_format import error, number
from proofroll.report.labels import names
from proofroll.running.case import Status
from proofroll.studies.answer.judged_run import errors_of

if TYPE_CHECKING:
    from proofroll.report.comparison.records import ReportedRow, ReportedRun
    from proofroll.studies.comparison.outcome import Run
    from proofroll.studies.judging.reference import Reference

_TOLD, _PLACES = (0.1, 0.3, 1.0), "p_WB"  # times up to which distances are told [s], and places of the bodies
_ROUND_OFF = 1e-9  # rad: what turns by less is told as turning by nothing


@dataclass(frozen=True)
class DistanceLine:
    """Largest distances up to each time; None: the run ended before.

    Attributes:
        row: number of the run's row; None: these are the error bars of the reference.
        places: of any body's origin [m].
        turns: angle by which any body's attitude is off [rad].
    """

    row: int | None
    places: list[float | None]
    turns: list[float | None]


@dataclass(frozen=True)
class Distances:
    """Distances at a ``point`` up to ``times`` [s] within the ``horizon`` in words of its reference by steps."""

    point: str
    times: list[float]
    horizon: str
    lines: list[DistanceLine]


def distances_of(point: str, reference: Reference | None, runs: Mapping[int, Run]) -> Distances | None:
    """Distances of ``runs`` with trajectories, by row, from a reference by steps; None: the truth is another one."""
    if reference is None or not reference.by_steps:
        return None
    variables, curves = reference.dataset.variables, reference.curves
    observed = [_PLACES, *(name for name in curves if name in variables and variables[name].dims[-1:] == ("wxyz",))][:2]
    if not curves.keys() >= set(observed) or len(observed) == 1:
        return None
    sampled = reference.dataset["time"].to_numpy()
    told = [time for time in _TOLD if time <= sampled[-1]]
    told += [float(sampled[-1])] if len(told) < len(_TOLD) and sampled[-1] not in told else []
    ends = (np.searchsorted(sampled, told, side="right") - 1).tolist()
    bars = [[reference.bar_until(name, sampled[end]) for end in ends] for name in observed]
    lines = [DistanceLine(None, [*bars[0]], [*map(_angle, bars[1])])]
    for row, run in runs.items():
        assert run.trajectory is not None  # by the caller
        growth = errors_of(run.trajectory.dataset, reference, whole=run.result.status is Status.DONE)[1]
        if growth.keys() >= set(observed):
            far = ([*growth[name].tolist(), *[None] * len(sampled)] for name in observed)
            places, apart = ([distances[end] for end in ends] for distances in far)
            lines.append(DistanceLine(row, places, [None if item is None else _angle(item) for item in apart]))
    return Distances(point, sampled[ends].tolist(), str(reference.dataset.attrs.get(HORIZON, "")), lines)


def _angle(distance: float) -> float:
    """Angle between two orientations whose quaternions have this distance [rad]."""
    return 4 * math.asin(min(1.0, distance / 2))


def distance_cells(item: Distances, rows: Sequence[ReportedRow], runs: Sequence[ReportedRun]) -> Iterator[list[str]]:
    """Name, distances in mm and rad up to each time, and cost in s/s of each row; the reference's bars come first."""
    there = [run for run in runs if run.point == item.point]
    costs = {run.row: run.rough_cost if run.seconds_per_second is None else run.seconds_per_second for run in there}
    for line in item.lines:
        turns = [None if turn is None else turn * (turn > _ROUND_OFF) for turn in line.turns]
        pairs = zip(line.places, turns, strict=True)
        cells = ["–" if place is None else f"{error(1e3 * place)} {error(turn)}" for place, turn in pairs]
        name, cost = ("known to", "") if line.row is None else (names(rows)[line.row], number(costs.get(line.row)))
        yield [name, *cells, cost]
