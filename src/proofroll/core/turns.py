"""Turns of angles: an engine gives orientations, in which a whole turn does not show, so that samples count the turns.

The rates of two samples predict how far an angle goes between them. Where samples lie so far apart that the prediction
may be half a turn off, samples between them count; where there are none, the number of turns is not known.
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

# Intervals between samples, in parts of a natural time: over a double pendulum and a chain of ten rods the prediction
# is then 0.4 rad off at most, over an eighth of it up to three.
PART = 1 / 40
# Turns are sure where the prediction is off by no more than this part of a turn; at a half the next turn begins.
_SURE = 0.25
# Of the longest interval between samples: up to here it is left to their rates to tell.
_FARTHEST = 2.0
# Samples for turns cost no run more than what it costs by itself: they are as many as a run has where nobody says how
# often it is sampled, in a short run a thousand, and never more than this.
_FEW, _MOST = 1_000, 100_000


def samples_between(scene: Scene, times: FloatArray, step: float | None = None) -> FloatArray:
    """Times between those of the samples [s] at which turns have to be counted, each a whole number of steps.

    ``step``: the engine's [s]; None: it has none. Empty where samples are near enough, or the scene has no angles.
    """
    intervals = [element.turn_interval for element in scene.elements if isinstance(element, CountsTurns)]
    known = [interval for interval in intervals if interval is not None]
    if not known or len(times) < 2:
        return np.zeros(0)
    until = float(times[-1])
    longest = max(min(known), min(EVERY, until / _FEW), until / _MOST)
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
    """Attributes that say why counted turns of an angle are uncertain; empty if they are sure.

    Args:
        time: [s], shape (time,).
        angle: counted in turns, shape (time,), in the unit of the period.
        rate: likewise, per second.
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
    other: FloatArray | None, values: FloatArray, name: str, datasets: Iterable[xr.Dataset]
) -> FloatArray | None:
    """The values of an observable without what is no engine's: an angle on the turns of another run of the same.

    Only where the samples of one of the runs do not tell them (``UNCERTAIN``). None: nothing is left, as of the energy
    of a spring that turns wind up.
    """
    said = [run[name].attrs for run in datasets if name in run and UNCERTAIN in run[name].attrs]
    if not said or other is None or values.shape != other.shape:
        return values
    if PERIOD not in said[0]:
        return None
    period = float(said[0][PERIOD])
    return np.asarray(values + period * np.round((other - values) / period))
