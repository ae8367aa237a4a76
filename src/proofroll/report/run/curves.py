"""Curves of a run over time, beside the truth's where there is one, as panels of a page."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import scales
from proofroll.core.number_format import number, spaced
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.whole_turns import on_turns_of

if TYPE_CHECKING:
    import xarray as xr

# Curves beside a truth; more would hide the ones that are off the most.
MOST = 4
# Least error relative to the size of all quantities of its unit that is told; less is round-off.
_LEAST = 1e-12
# Points of a curve: the lowest and the highest of each of so many intervals, so that no peak is lost.
_INTERVALS = 200
# Size of a panel in units of its drawing, and the part of it above and below the curve.
_WIDTH, _HEIGHT, _ROOM = 1000.0, 100.0, 0.06


@dataclass(frozen=True)
class CurvePanel:
    """Panel of a page.

    Attributes:
        title: the quantity with its unit, and how far it is off.
        low, high: texts of the least and largest value that is drawn.
        run, true: places of both curves in a drawing of 1000 by 100; ``true`` is empty without a truth.
    """

    title: str
    low: str
    high: str
    run: str
    true: str = ""


def names_of_curves(dataset: xr.Dataset) -> list[str]:
    """Names of the variables with one number for each time and a unit, without those that are never finite."""
    return [str(name) for name, item in dataset.data_vars.items() if item.dims == ("time",) and _is_number(item)]


def _is_number(item: xr.DataArray) -> bool:
    if "units" not in item.attrs or not np.issubdtype(item.dtype, np.number):
        return False
    return bool(np.any(np.isfinite(item.to_numpy())))


def curves_alone(dataset: xr.Dataset) -> list[CurvePanel]:
    """Every curve of a run without a truth beside it."""
    times = dataset["time"].to_numpy()
    return [
        _panel(f"{name} [{dataset[name].attrs['units']}]", times, dataset[name].to_numpy())
        for name in names_of_curves(dataset)
    ]


def curves_beside_truth(scene: Scene, run: xr.Dataset, true: xr.Dataset) -> list[CurvePanel]:
    """The curves of a run that are furthest off for their size, at first one of each unit, with the truth's.

    Args:
        scene: of both.
        run: its times are the first of the truth's.
        true: the truth.
    """
    times = run["time"].to_numpy()
    values, true_values = _series(scene, run), _series(scene, true)
    units = {name: str(true[name].attrs["units"]) if name in true else "m" for name in true_values}
    sizes: dict[str, float] = defaultdict(float)
    for name, size in scales(scene, true).items():
        sizes[scene.observables[name].unit] = max(sizes[scene.observables[name].unit], size)
    of_forces = {item.unit for item in scene.observables.values() if item.role == Role.REACTION}
    panels: list[tuple[float, str, CurvePanel]] = []
    for name, rival in true_values.items():
        mine = on_turns_of(rival[: len(times)], values[name], name, (true, run)) if name in values else None
        unit = units[name]
        first = int(unit in of_forces)  # an engine that steps has no force before its first step
        if mine is None or mine.shape != times.shape or not np.any(np.isfinite(mine[first:])):
            continue
        mine, true_part = mine[first:], rival[first : len(times)]
        off = np.abs(mine - true_part)
        worst = int(np.argmax(np.where(np.isfinite(off), off, -1.0)))
        relative = float(off[worst]) / (sizes[unit] or float(np.nanmax(np.abs(true_part))) or 1.0)
        title = f"{name} [{unit}]"
        if relative > _LEAST:
            title += f": at most {number(float(off[worst]))}{spaced(unit)} off, at {times[first + worst]:.4g} s"
        panels.append((relative, unit, _panel(title, times[first:], mine, true_part)))
    panels.sort(key=lambda panel: -panel[0])
    of_unit = [unit for _, unit, _ in panels]
    order = sorted(range(len(panels)), key=lambda place: of_unit[place] in of_unit[:place])
    return [panels[place][2] for place in order[:MOST]]


def _series(scene: Scene, run: xr.Dataset) -> dict[str, FloatArray]:
    """Motion and forces of a run with one number for each time, and the places of bodies by component."""
    residuals = {name for name, item in scene.observables.items() if item.role == Role.RESIDUAL}
    series = {name: run[name].to_numpy() for name in names_of_curves(run) if name not in residuals}
    if "p_WB" in run:
        places = run["p_WB"]
        for body in places["body"].to_numpy():
            series |= {f"{body}.{axis}": places.sel(body=body, xyz=axis).to_numpy() for axis in "xyz"}
    return series


def _panel(title: str, times: FloatArray, run: FloatArray, true: FloatArray | None = None) -> CurvePanel:
    """Panel with one curve or two."""
    both = run if true is None else np.concatenate([run, true])
    low, high = float(np.nanmin(both)), float(np.nanmax(both))
    room = _ROOM * (high - low) or 0.5 * (abs(high) or 1.0)
    bottom, top = low - room, high + room

    def line(values: FloatArray) -> str:
        shown = _peaks(values)
        x = _WIDTH * (times[shown] - times[0]) / ((times[-1] - times[0]) or 1.0)
        y = _HEIGHT * (top - values[shown]) / (top - bottom)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))

    return CurvePanel(
        title=title, low=number(low, 3), high=number(high, 3), run=line(run), true="" if true is None else line(true)
    )


def _peaks(values: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Places to draw: of each interval the lowest and the highest finite value, the first and the last place."""
    finite = np.flatnonzero(np.isfinite(values))
    if len(finite) <= 2 * _INTERVALS:
        return finite
    parts = np.array_split(finite, _INTERVALS)
    places = {int(part[pick(values[part])]) for part in parts for pick in (np.argmin, np.argmax)}
    return np.array(sorted(places | {int(finite[0]), int(finite[-1])}), dtype=np.int64)
