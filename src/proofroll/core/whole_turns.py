"""Counts whole turns of angles over the samples of a run, since an orientation does not show them.

The rates of two samples predict the change of an angle between them. Where the prediction may be wrong by half a turn,
because samples are far apart, further samples between them are needed; without these the number of turns is unknown.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import PERIOD, UNCERTAIN
from proofroll.core.element_abilities import CountsTurns
from proofroll.core.scene import Scene
from proofroll.core.time_grid import EVERY

if TYPE_CHECKING:
    import xarray as xr

# Longest sampling interval to count turns, in natural times. For a double pendulum and a chain of ten rods the
# prediction is then wrong by 0.4 rad at most, but by up to 3 rad with an interval of an eighth.
PART = 1 / 40
# Turns are certain if the prediction is wrong by at most this part of a turn; at a half the count would be wrong.
_SURE = 0.25
# Up to this multiple of the longest interval, the rates of the samples decide if the count is certain.
_FARTHEST = 2.0
# Samples to count turns must not dominate the cost of a run: their interval is at least EVERY (in a short run a
# thousandth of the run), and there are never more than _MOST.
_FEW, _MOST = 1_000, 100_000


def samples_between(scene: Scene, times: FloatArray, step: float | None = None) -> FloatArray:
    """Times between the samples [s] at which turns have to be counted, each after a whole number of steps.

    Args:
        scene: of the run.
        times: of the samples [s].
        step: fixed step of the engine [s]; None: it has none.

    Returns:
        Empty if the samples are close enough or the scene has no such angles.
    """
    intervals = [element.turn_interval for element in scene.elements if isinstance(element, CountsTurns)]
    limits = [interval for interval in intervals if interval is not None]
    if not limits or len(times) < 2:
        return np.zeros(0)
    until = float(times[-1])
    longest = max(min(limits), min(EVERY, until / _FEW), until / _MOST)
    stretches: list[FloatArray] = []
    for start, length in zip(times[:-1], np.diff(times), strict=True):
        count = int(np.ceil(length / longest * (1 - 1e-9)))
        if count < 2:
            continue
        if step is None:
            stretches.append(start + length * np.arange(1, count) / count)
            continue
        steps = round(length / step)
        if abs(steps * step - length) <= 1e-6 * step:
            some = max(1, int(longest / step * (1 + 1e-9)))
            stretches.append(start + step * np.arange(some, steps, some))
    return np.concatenate([np.zeros(0), *stretches])


def doubt(
    time: FloatArray, angle: FloatArray, rate: FloatArray, period: float, interval: float | None
) -> dict[str, Any]:
    """Attributes that say why the counted turns of an angle are uncertain; empty if they are certain.

    Args:
        time: [s], shape (time,).
        angle: with counted turns, shape (time,), in the unit of the period.
        rate: its rate, in that unit per second, shape (time,).
        period: a turn.
        interval: longest between two samples over which turns are counted [s] (:class:`CountsTurns`).
    """
    if len(time) < 2:
        return {}
    apart = float(np.max(np.diff(time)))
    if interval is not None and apart > _FARTHEST * interval * (1 + 1e-9):  # times on a grid are rounded
        why = f"turns show in samples that are {interval:.2g} s apart or less, and these are {apart:.3g} s apart"
        return {UNCERTAIN: why, PERIOD: period}
    off = np.abs(np.diff(time) * (rate[1:] + rate[:-1]) / 2 - np.diff(angle)) / period
    worst = int(np.argmax(off))
    if off[worst] <= _SURE:
        return {}
    why = f"turns are not sure from {time[worst]:.6g} s on, where the rate does not fit; sample more often"
    return {UNCERTAIN: why, PERIOD: period}


def on_turns_of(
    rival: FloatArray | None, values: FloatArray, name: str, datasets: Iterable[xr.Dataset]
) -> FloatArray | None:
    """Values of an observable, shifted by whole periods towards another run's if the turns of a run are uncertain.

    Runs that cannot count turns mark the variable with the attribute ``UNCERTAIN``.

    Args:
        rival: values of the other run, or None.
        values: of this run, to be shifted.
        name: of the observable.
        datasets: both runs.

    Returns:
        None if the observable depends on turns without being periodic, so that no comparison is possible (the energy of
            a spring that turns wind up).
    """
    attributes = [run.variables[name].attrs for run in datasets if name in run.variables]
    marked = [attrs for attrs in attributes if UNCERTAIN in attrs]
    if not marked or rival is None or values.shape != rival.shape:
        return values
    if PERIOD not in marked[0]:
        return None
    period = float(marked[0][PERIOD])
    return np.asarray(values + period * np.round((rival - values) / period))
