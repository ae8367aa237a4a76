"""Change of a curve by an event that comes up to one step late, as in engines whose events fall on ends of steps.

Steps of a ladder share many of their ends, so an event may be as late in each of its runs: these then differ by less
than each is off, and their differences say nothing of that.
"""

from collections.abc import Sequence

import numpy as np

from proofroll.core.arrays import FloatArray

# Samples on each side of an event through which a parabola is laid.
_SIDE = 3


def beside_events(times: FloatArray, curve: FloatArray, events: Sequence[float], late: float) -> float:
    """Largest error of a curve whose events are each late by a given time.

    At an event a curve jumps in its value, slope or curvature (places, velocities and forces where friction switches);
    a sample in between is off by the jump itself, and what follows by what the jumps make of the delay until the end.

    Args:
        times: of the curve [s], shape (time,).
        curve: shape (time, …).
        events: when they happened [s].
        late: by how much each may be [s].
    """
    error = 0.0
    for event in events:
        index = int(np.searchsorted(times, event))
        sides = slice(max(index - _SIDE, 0), index), slice(index, index + _SIDE)
        if min(len(times[side]) for side in sides) < _SIDE:
            continue
        before, after = (_taylor(times[side] - event, curve[side]) for side in sides)
        value, slope, bend = np.max(np.abs(after - before), axis=1)
        error += late * float(slope + bend * (times[-1] - event))
        if np.any(np.abs(times - event) <= late):
            error += float(value)
    return error


def _taylor(t: FloatArray, values: FloatArray) -> FloatArray:
    """Value, slope and curvature at t = 0 of the parabola through three samples, shape (3, components)."""
    made = np.linalg.solve(t[:, None] ** np.arange(_SIDE), values.reshape(_SIDE, -1))
    return np.asarray(made * [[1.0], [1.0], [2.0]])
