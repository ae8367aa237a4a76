"""The curves that the page draws: the truth, what each engine adds to it, and both error bars; rounded and thinned."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import scales
from proofroll.core.observable import Observable, Role
from proofroll.files.netcdf import read, read_some
from proofroll.files.scene_file import load_scene
from proofroll.report.kinds import kind_of
from proofroll.report.labels import symbol, unit
from proofroll.studies.outcome import Outcome, Run
from proofroll.studies.planning import point_name

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.running.store import Store

Curves = dict[str, FloatArray]

# Drawn besides the surface's coordinates. A reaction at time 0 belongs to the certificate, not to the curve.
# More points than this are not seen in a figure 500 pixels wide.
MOST_POINTS = 400
# Digits of a curve, and of its difference from the truth: enough for a figure, and small in the file.
CURVE_DIGITS, DIFFERENCE_DIGITS = 6, 3

_DRAWN = (Role.MOTION, Role.REACTION)


def point_curves(outcome: Outcome, store: Store) -> list[dict[str, Any]]:
    """The curves of a comparison, one entry for each point of the parameters.

    Each entry has ``point``, ``time`` [s] and ``observables``: name, unit, the truth's error bar and values, and for
    each engine the number of its row and its *difference* from the truth. Where it was judged, ``tolerance``; where
    the judgement has a limit of small steps, ``limit``: its distance from the truth, the uncertainty of that, and the
    observed order or None.
    """
    entries = []
    for name, case in outcome.truths.items():
        path = store.trajectory(case)
        if not path.is_file():
            continue
        truth = read(path)
        scene = load_scene(outcome.comparison.scene, **case.parameters)
        sizes = scales(scene, truth)
        kind = kind_of(scene)
        further = {item.name: item for item in kind.curves(scene, truth)} if kind is not None else {}
        known = scene.observables | further
        drawn = {key: item for key, item in known.items() if item.role in _DRAWN and _curve(truth, key)}
        engines = _engines(outcome, store, name, list(drawn))
        entries.append(
            {
                "point": name,
                "time": rounded(truth["time"].to_numpy(), CURVE_DIGITS),
                "observables": [
                    _observable(item, key, truth, engines, sizes.get(key, 1.0)) for key, item in drawn.items()
                ],
            }
        )
    return entries


def rounded(values: FloatArray, digits: int) -> list[float | None]:
    """Numbers with so many significant digits; None where one is not finite."""
    return [float(f"{value:.{digits - 1}e}") if math.isfinite(value) else None for value in values.tolist()]


def kept(curves: list[FloatArray], most: int = MOST_POINTS) -> np.typing.NDArray[np.intp]:
    """Indices of the samples that are drawn: of each stretch the first, the last, the lowest and the highest.

    These four draw the same pixels as all samples do (M4: Jugel et al. 2014). MinMaxLTTB, which chooses among the
    lowest and the highest by the area they span, loses the largest error of one rough curve in four.

    Args:
        curves: of equal length; one that is not finite somewhere has there neither a lowest nor a highest sample.
        most: samples of each curve, a multiple of 4.
    """
    from tsdownsample import M4Downsampler

    length = curves[0].size
    if length <= most:
        return np.arange(length)
    return np.unique(np.concatenate([M4Downsampler().downsample(np.ascontiguousarray(c), n_out=most) for c in curves]))


def _engines(outcome: Outcome, store: Store, point: str, drawn: list[str]) -> list[tuple[int, Run, Curves]]:
    """Row number, run and curves of every run at a point that has a trajectory."""
    numbers: dict[int, int] = {}
    found = []
    for run in outcome.runs:
        number = numbers.setdefault(id(run.row), len(numbers))
        if point_name(run.parameters) == point and _has_trajectory(run, store):
            assert run.case is not None  # it has a trajectory
            found.append((number, run, read_some(store.trajectory(run.case), drawn)))
    return found


def _curve(truth: xr.Dataset, name: str) -> bool:
    """Whether a variable is one curve over time; those of several, such as all reactions, are judged and not drawn."""
    return name in truth and truth[name].dims == ("time",)


def _has_trajectory(run: Run, store: Store) -> bool:
    return run.case is not None and run.result.trajectory is not None and store.trajectory(run.case).is_file()


def _observable(
    item: Observable, name: str, truth: xr.Dataset, engines: list[tuple[int, Run, Curves]], scale: float
) -> dict[str, Any]:
    first = 1 if item.role == Role.REACTION else 0
    true = truth[name].to_numpy()
    curves = []
    for row, run, said in engines:
        if name not in said:
            continue
        values = np.full(true.shape, np.nan)  # a run that ended early has fewer samples
        ended = min(values.size, said[name].size)
        values[first:ended] = said[name][first:ended]
        with np.errstate(invalid="ignore", over="ignore"):
            difference = values - true
        at = kept([values, np.abs(difference)])
        curve: dict[str, Any] = {"row": row, "difference": rounded(difference[at], DIFFERENCE_DIGITS)}
        curve |= _bars(run, name)
        if at.size < true.size:
            curve["at"] = at.tolist()
        curves.append(curve)
    return {
        "name": name,
        "symbol": symbol(name),
        "meaning": truth[name].attrs.get("long_name", name),
        "unit": unit(truth[name].attrs["units"]),
        "scale": float(f"{scale:.3g}"),
        "error_bar": float(f"{truth[name].attrs.get('error_bar', 0.0):.3g}"),
        "truth": rounded(true, CURVE_DIGITS),
        "engines": curves,
    }


def _bars(run: Run, name: str) -> dict[str, Any]:
    """What the judgement of a curve says besides its error, in the observable's unit."""
    judged = next((judgement for judgement in run.judgements if judgement.observable == name), None)
    if judged is None:
        return {}
    found: dict[str, Any] = {"tolerance": float(f"{judged.tolerance:.4g}")}
    if judged.limit_error is not None and judged.limit_error_bar is not None:
        limit = np.array([judged.limit_error, judged.limit_error_bar, judged.order or np.nan])
        found["limit"] = rounded(limit, DIFFERENCE_DIGITS)
    return found
