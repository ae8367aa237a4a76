"""Error of a curve whose events come up to one step late, as in engines with events at the ends of steps only.

The steps of a ladder share many of their ends. So all its runs may be late alike: they differ from each other by less
than each differs from the truth, and their differences do not show this error.
"""

from collections.abc import Sequence

import numpy as np

from proofroll.core.arrays import FloatArray

# Samples on each side of an event through which a parabola is laid.
_SIDE = 3


def beside_events(times: FloatArray, curve: FloatArray, events: Sequence[float], late: float) -> float:
    """Largest error of a curve if each of its events is late by a given time.

    At an event a curve jumps in value, slope or curvature (position, velocity, force where friction switches). A sample
    between the true event and the late one is wrong by the jump of the value. Later samples are wrong by what the jumps
    of slope and curvature make of the delay.

    Args:
        times: times of the curve [s], shape (time,).
        curve: values, shape (time, …).
        events: times of the events [s].
        late: largest delay of an event [s].
    """
    error = 0.0
    for event in events:
        index = int(np.searchsorted(times, event))
        sides = slice(max(index - _SIDE, 0), index), slice(index, index + _SIDE)
        if min(len(times[side]) for side in sides) < _SIDE:
            continue
        earlier_part, later_part = (_taylor(times[side] - event, curve[side]) for side in sides)
        value, slope, bend = np.max(np.abs(later_part - earlier_part), axis=1)
        error += late * float(slope + bend * (times[-1] - event))
        if np.any(np.abs(times - event) <= late):
            error += float(value)
    return error


def _taylor(t: FloatArray, values: FloatArray) -> FloatArray:
    """Value, slope and curvature at t = 0 of the parabola through three samples, shape (3, components)."""
    made = np.linalg.solve(t[:, None] ** np.arange(_SIDE), values.reshape(_SIDE, -1))
    return np.asarray(made * [[1.0], [1.0], [2.0]])
