"""Distances of runs from a reference by steps, the largest up to a few times: of places, and of attitudes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import HORIZON
from proofroll.core.number_format import error, number
from proofroll.report.labels import names
from proofroll.running.case import Status
from proofroll.studies.answer.judged_run import errors_of

if TYPE_CHECKING:
    from proofroll.report.comparison.records import ReportedRow, ReportedRun
    from proofroll.studies.comparison.outcome import Run
    from proofroll.studies.judging.reference import Reference

# Times [s] up to which distances are told, and the observables: places of the bodies, and their quaternions.
_TOLD, _PLACES, _ATTITUDES = (0.1, 0.3, 1.0), "p_WB", "attitudes"


@dataclass(frozen=True)
class DistanceLine:
    """Largest distances of a row from the reference up to each time; None: it has no sample there.

    Attributes:
        row: its number.
        places: of any body's origin [m].
        turns: angle by which any body's attitude is off [rad].
    """

    row: int
    places: list[float | None]
    turns: list[float | None]


@dataclass(frozen=True)
class Distances:
    """Distances of all rows at a point whose truth is a reference by steps.

    Attributes:
        point: of the parameters.
        times: up to which they are told [s], within the reference's horizon.
        places: error bars of the reference up to these times, of places [m].
        turns: of attitudes [rad].
        horizon: how far the reference tells the motion, a clause; empty: that is not known.
        lines: of the rows with a run.
    """

    point: str
    times: list[float]
    places: list[float]
    turns: list[float]
    horizon: str
    lines: list[DistanceLine]


def distances_of(point: str, reference: Reference | None, runs: Mapping[int, Run]) -> Distances | None:
    """Distances of runs from a reference by steps; None: the truth of the point is another one, or tells no places.

    Args:
        point: of the parameters.
        reference: its truth, if there is one.
        runs: row number -> run with a trajectory.
    """
    if reference is None or not reference.by_steps or not reference.curves.keys() >= {_PLACES, _ATTITUDES}:
        return None
    sampled = reference.dataset["time"].to_numpy()
    told = [time for time in _TOLD if time <= sampled[-1]]
    told += [float(sampled[-1])] if len(told) < len(_TOLD) and sampled[-1] not in told else []
    ends = (np.searchsorted(sampled, told, side="right") - 1).tolist()
    times = sampled[ends].tolist()
    lines = []
    for row, run in runs.items():
        assert run.trajectory is not None  # by the caller
        whole = run.result.status is Status.DONE
        growth = errors_of(run.trajectory.dataset, reference, whole=whole)[1]
        if growth.keys() >= {_PLACES, _ATTITUDES}:
            lines.append(DistanceLine(row, *(_at(growth[name], ends, name) for name in (_PLACES, _ATTITUDES))))
    return Distances(
        point=point,
        times=times,
        places=[reference.bar_until(_PLACES, time) for time in times],
        turns=[_angle(reference.bar_until(_ATTITUDES, time)) for time in times],
        horizon=str(reference.dataset.attrs.get(HORIZON, "")),
        lines=lines,
    )


def _at(growth: FloatArray, ends: list[int], name: str) -> list[float | None]:
    """Growth of a distance at some samples; of quaternions the angle."""
    found = [float(growth[end]) if end < len(growth) else None for end in ends]
    return found if name == _PLACES else [None if value is None else _angle(value) for value in found]


def _angle(distance: float) -> float:
    """Angle between two orientations whose quaternions have this distance [rad]."""
    return 4 * math.asin(min(1.0, distance / 2))


def distance_cells(item: Distances, rows: Sequence[ReportedRow], runs: Sequence[ReportedRun]) -> Iterator[list[str]]:
    """Name, distances in mm and rad up to each time, and cost in s/s of each row; the reference's bars come first."""
    yield ["known to", *map(_cell, item.places, item.turns), ""]
    costs = {run.row: run.rough_cost if run.seconds_per_second is None else run.seconds_per_second for run in runs}
    of_rows = names(rows)
    for line in item.lines:
        yield [of_rows[line.row], *map(_cell, line.places, line.turns), number(costs.get(line.row))]


def _cell(place: float | None, turn: float | None) -> str:
    """A distance in mm and an angle in rad."""
    return "–" if place is None else f"{error(1e3 * place)} {error(turn)}"
