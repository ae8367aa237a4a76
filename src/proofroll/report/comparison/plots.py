"""Curves of a comparison's page: the truth, the difference of each engine from it, error bars; rounded and thinned."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing

from proofroll.core.arrays import FloatArray
from proofroll.core.observable import Observable, Role
from proofroll.files.json_data import OPTIONAL
from proofroll.report.comparison.summary import runs_at
from proofroll.report.kinds import kind_of
from proofroll.report.labels import symbol, unit
from proofroll.studies.comparison.outcome import Outcome, Run
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference

if TYPE_CHECKING:
    import xarray as xr

# More points cannot be seen in a figure 500 pixels wide.
MOST_POINTS = 400
# Digits of a curve and of its difference from the truth: enough for a figure, and few bytes.
CURVE_DIGITS, DIFFERENCE_DIGITS = 6, 3

# Roles of the observables that are drawn; a reaction at time 0 belongs to the certificate, not to the curve.
_DRAWN = (Role.MOTION, Role.REACTION)


@dataclass(frozen=True)
class EngineCurve:
    """Difference of one engine from the truth.

    Attributes:
        row: number of its row.
        difference: from the truth, None where it is not finite.
        tolerance: of its judgement, or None.
        limit: [distance of the limit of small steps from the truth, its uncertainty, observed order]; None without a
            ladder.
        at: indices of the samples drawn, unless all are.
    """

    row: int
    difference: list[float | None]
    tolerance: float | None = field(metadata=OPTIONAL)
    limit: list[float | None] | None = field(metadata=OPTIONAL)
    at: list[int] | None = field(metadata=OPTIONAL)


@dataclass(frozen=True)
class Mark:
    """A named event on a curve; ``row``: of its run, -1: of the truth; ``time``: None if unknown."""

    row: int
    time: float | None
    name: str


@dataclass(frozen=True)
class Bound:
    """A named value that a curve must not cross."""

    name: str
    value: float


@dataclass(frozen=True)
class ObservableCurves:
    """Truth of an observable with its error bar, and the difference of each engine from it."""

    name: str
    symbol: str
    meaning: str
    unit: str
    scale: float
    error_bar: float
    truth: list[float | None]
    engines: list[EngineCurve]
    marks: list[Mark] | None = field(default=None, metadata=OPTIONAL)
    bounds: list[Bound] | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True)
class PointCurves:
    """Curves at one point of the parameters; ``time`` [s]."""

    point: str
    time: list[float | None]
    observables: list[ObservableCurves]


def point_curves(outcome: Outcome) -> list[PointCurves]:
    """Curves of a comparison, one entry for each point of the parameters."""
    entries = []
    for name, point in outcome.points.items():
        if point.reference is None or name in outcome.laws_alone:
            continue
        scene, truth = point.scene, point.reference.dataset
        kind = kind_of(scene)
        further = {item.name: item for item in kind.curves(scene, truth)} if kind is not None else {}
        observables = scene.observables | further
        curves = {key for key in observables if key in truth and truth[key].dims == ("time",)}
        drawn = {key: item for key, item in observables.items() if item.role in _DRAWN and key in curves}
        engines = [(row, run, motion.dataset) for row, run, motion in runs_at(outcome, name)]
        entries.append(
            PointCurves(
                name,
                rounded(truth["time"].to_numpy(), CURVE_DIGITS),
                [_observable(item, key, point.reference, engines) for key, item in drawn.items()],
            )
        )
    return entries


def rounded(values: FloatArray, digits: int) -> list[float | None]:
    """Numbers rounded to ``digits`` significant digits; None where one is not finite."""
    return [float(f"{value:.{digits - 1}e}") if math.isfinite(value) else None for value in values.tolist()]


def kept(curves: list[FloatArray], most: int = MOST_POINTS) -> np.typing.NDArray[np.intp]:
    """Indices of the samples to draw: in each section the first, the last, the lowest and the highest.

    These four draw the same pixels as all samples do (M4: Jugel et al. 2014). MinMaxLTTB, which chooses among the
    lowest and the highest by the area they span, loses the largest error of one rough curve in four.

    Args:
        curves: of equal length; where one is not finite, it adds no lowest or highest sample.
        most: samples of each curve, a multiple of 4.
    """
    from tsdownsample import M4Downsampler

    length = curves[0].size
    if length <= most:
        return np.arange(length)
    return np.unique(np.concatenate([M4Downsampler().downsample(np.ascontiguousarray(c), n_out=most) for c in curves]))


def _observable(
    item: Observable, name: str, reference: Reference, engines: list[tuple[int, Run, xr.Dataset]]
) -> ObservableCurves:
    begin = 1 if item.role == Role.REACTION else 0
    truth = reference.dataset
    true = truth[name].to_numpy()
    curves = []
    for row, run, motion in engines:
        if name not in motion:
            continue
        values_of_run = motion[name].to_numpy()[: true.size]  # a run that ended early has fewer samples
        compared = run_values.on_true_turns(reference, name, values_of_run, motion)
        if compared is None:
            continue
        values = np.full(true.shape, np.nan)
        values[begin : values_of_run.size] = compared[begin:]
        with np.errstate(invalid="ignore", over="ignore"):
            difference = values - true
        indices = kept([values, np.abs(difference)])
        shown = indices.tolist() if indices.size < true.size else None
        curves.append(EngineCurve(row, rounded(difference[indices], DIFFERENCE_DIGITS), *_bars(run, name), shown))
    return ObservableCurves(
        name=name,
        symbol=symbol(name),
        meaning=truth[name].attrs.get("long_name", name),
        unit=unit(truth[name].attrs["units"]),
        scale=float(f"{reference.sizes.get(name, 1.0):.3g}"),
        error_bar=float(f"{truth[name].attrs.get('error_bar', 0.0):.3g}"),
        truth=rounded(true, CURVE_DIGITS),
        engines=curves,
    )


def _bars(run: Run, name: str) -> tuple[float | None, list[float | None] | None]:
    """Tolerance and limit of the judgement of a curve, in the observable's unit; None without one."""
    judged = next((judgement for judgement in run.judgements if judgement.observable == name), None)
    if judged is None:
        return None, None
    tolerance = float(f"{judged.tolerance:.4g}")
    if judged.limit_error is None or judged.limit_error_bar is None:
        return tolerance, None
    limit = np.array([judged.limit_error, judged.limit_error_bar, judged.order or np.nan])
    return tolerance, rounded(limit, DIFFERENCE_DIGITS)
