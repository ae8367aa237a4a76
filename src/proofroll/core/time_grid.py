"""The times at which a run is sampled."""

from collections.abc import Iterable
from numbers import Real

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import InputError

# Default sampling interval [s].
EVERY = 0.01
# Latest time of a sample [s], 31 years: no motion can be followed so far.
LATEST = 1e9
# Most samples of a run.
MOST_SAMPLES = 10_000_000
# Multiples of it modulo 1 spread most evenly over an interval, and are far from simple fractions.
_GOLDEN = (5**0.5 - 1) / 2
# Most samples off the grid, and fewest intervals for each: few, as an adaptive step ends at each.
_OFF_GRID, _INTERVALS = 8, 4
# They lie at multiples of this part of an interval if the step allows, so that most engines share their times.
_PARTS = 10


def sampling_interval(step: float | None) -> float:
    """Default sampling interval [s]: the multiple of the step nearest to :data:`EVERY`; without a step EVERY."""
    if step is None or abs(EVERY / step - round(EVERY / step)) <= 1e-6 * EVERY / step:
        return EVERY
    return max(1, round(EVERY / step)) * step


def whole_intervals(until: float, every: float) -> int:
    """Number of whole intervals in a length [s], but for round-off."""
    return int(np.floor(until / every * (1 + 1e-12) + 1e-9))


def time_grid(until: float, every: float) -> FloatArray:
    """Sample times 0, every, 2 every, … and ``until`` [s].

    Raises:
        InputError: ``until`` is negative, or ``every`` is not positive.
    """
    for name, value in (("until", until), ("every", every)):
        if not isinstance(value, Real):
            raise InputError(name, value, "give a number in s")
    if not 0 <= until <= LATEST:
        raise InputError("until", until, f"give a finite time in s that is not negative, at most {LATEST:g} s")
    if not np.isfinite(every) or every <= 0:
        raise InputError("every", every, "give a positive, finite interval in s")
    if until / every > MOST_SAMPLES:
        raise InputError("every", every, f"more than {MOST_SAMPLES} samples until {until:g} s; sample less often")
    times = np.arange(whole_intervals(until, every) + 1, dtype=np.float64) * every
    if until - times[-1] > 1e-9 * max(every, until):
        times = np.append(times, until)
    else:
        times[-1] = until
    return np.asarray(times, dtype=np.float64)


def require_whole_steps(times: FloatArray, step: float | None) -> None:
    """Raises InputError if a fixed step does not divide the sampling intervals, all equal but for the last.

    Args:
        times: of the samples [s].
        step: fixed step [s]; None: the engine adapts its steps.
    """
    if step is None or len(times) < 2:
        return
    (first, second), (start, end) = times[:2].tolist(), times[-2:].tolist()
    whole_steps(first, second, step)
    try:
        whole_steps(start, end, step)
    except InputError:
        near = start + round((end - start) / step) * step
        advice = f"no whole number of steps of {step:g} s leads there; end at {near:.9g} s"
        raise InputError("until", end, advice) from None


def off_grid(times: FloatArray, step: float | None) -> FloatArray:
    """A few times [s] between those of the grid, at different parts of their intervals and after whole steps.

    There an error shows that vanishes periodically at the times of the grid.

    Args:
        times: the grid [s].
        step: fixed step of the engine [s]; None: it has none.
    """
    between: list[float] = []
    count = min(_OFF_GRID, (len(times) - 1) // _INTERVALS)
    for index in np.unique(np.linspace(0, len(times) - 2, count + 2)[1:-1].astype(int)).tolist():
        start, length = times[index], times[index + 1] - times[index]
        steps = _PARTS if step is None else round(length / step)
        if steps < 2 or (step is not None and abs(steps * step - length) > 1e-6 * step):
            continue
        parts = next((parts for parts in range(_PARTS, 1, -1) if steps % parts == 0), steps)
        part = min(max(round((index + 1) * _GOLDEN % 1 * parts), 1), parts - 1)
        between.append(start + length * (part / parts))
    return np.asarray(between, dtype=np.float64)


def off_grids(times: FloatArray, steps: Iterable[float | None]) -> tuple[float, ...]:
    """Times of :func:`off_grid` [s] for engines with these steps [s], together."""
    return tuple(sorted({t for step in set(steps) for t in off_grid(times, step).tolist()}))
