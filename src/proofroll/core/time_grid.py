"""The times at which a run is sampled."""

from __future__ import annotations

from numbers import Real

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError

# How far apart samples are where nobody says it [s].
EVERY = 0.01


def sampling_interval(step: float | None) -> float:
    """Interval between samples where nobody gives one: :data:`EVERY`, or the nearest whole number of steps [s]."""
    if step is None or abs(EVERY / step - round(EVERY / step)) <= 1e-6 * EVERY / step:
        return EVERY
    return max(1, round(EVERY / step)) * step


def time_grid(until: float, every: float) -> FloatArray:
    """Sample times 0, every, 2 every, … and ``until`` [s].

    Raises:
        InputError: ``until`` is negative, or ``every`` is not positive.
    """
    for name, value in (("until", until), ("every", every)):
        if not isinstance(value, Real):
            raise InputError(name, value, "give a number in s")
    if not np.isfinite(until) or until < 0:
        raise InputError("until", until, "give a finite time in s that is not negative")
    if not np.isfinite(every) or every <= 0:
        raise InputError("every", every, "give a positive, finite interval in s")
    if until / every > 1e7:
        raise InputError("every", every, f"that is more than ten million samples until {until:g} s; sample less often")
    count = int(np.floor(until / every * (1 + 1e-12) + 1e-9))
    times = np.arange(count + 1, dtype=np.float64) * every
    if until - times[-1] > 1e-9 * max(every, until):
        times = np.append(times, until)
    else:
        times[-1] = until
    return np.asarray(times, dtype=np.float64)
