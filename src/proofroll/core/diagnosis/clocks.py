"""Errors of reported times: a constant shift, or a factor on all times.

The reports are compared with a spline through the samples of the truth. The first and last samples, for which the
spline would have to be extrapolated, are left out.
"""

import numpy as np

from proofroll.core.arrays import FloatArray, known_difference
from proofroll.core.diagnosis.fitting import least_squares_parameter

_SPLINE = 5
# Fewest samples that determine a shift; from _MANY on the degree of the spline is left out at each end, else _END.
_FEWEST, _MANY, _END = 9, 18, 2
_SHIFTS = 6
# Delays that are tried where any up to a farthest one is looked for.
_TRIED = 401
# Rates of a clock that are looked for, each within this relative error; all but the first are of known mistakes, up to
# the relative error of a fit.
_RATES, _PACE, _FIT = (1.0, 0.5, 2.0, 0.25, 4.0), 0.25, 1e-3


def _comparable(time: FloatArray, reported: FloatArray, true: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Components of both arrays that are finite in all samples, each of shape (time, components).

    None if there are too few samples or no such component.
    """
    if len(time) < _FEWEST:
        return None
    flat, exact = reported.reshape(len(time), -1), true.reshape(len(time), -1)
    finite = np.isfinite(flat).all(0) & np.isfinite(exact).all(0)
    return (flat[:, finite], exact[:, finite]) if finite.any() else None


def best_delay(
    time: FloatArray, reported: FloatArray, true: FloatArray, farthest: float | None = None
) -> tuple[float, float, float] | None:
    """Delay of the reported values [s], and the largest difference before and after correction.

    Args:
        time: of the samples [s], shape (time,).
        reported: values of the run, shape (time, …).
        true: values of the truth at the same times.
        farthest: longest delay that is looked for [s]; before time 0 the motion then stands at its start. By default
            the time of the first samples, which are left out.

    Returns:
        None if there are too few samples.
    """
    from scipy.interpolate import make_interp_spline

    comparable = _comparable(time, reported, true)
    if comparable is None:
        return None
    flat, exact = comparable
    end = _SPLINE if len(time) >= _MANY else _END
    inner = slice(end, -end)
    flat, curve = flat[inner], make_interp_spline(time, exact, k=_SPLINE)
    rate, reach = curve.derivative(), float(time[end] - time[0])

    def left(delay: float) -> FloatArray:
        moments = time[inner] - delay
        valid_mask = (moments <= time[-1]) & ((moments >= time[0]) | (time[0] == 0))
        return np.where(valid_mask[:, None], flat - curve(np.clip(moments, time[0], time[-1])), np.nan)

    begin = 0.0
    if farthest is not None:
        tried = np.linspace(-farthest, farthest, _TRIED)
        begin, reach = float(min(tried, key=lambda delay: float(np.nanmean(left(delay) ** 2)))), farthest
    delay = begin
    for _ in range(_SHIFTS):
        moments = time[inner] - delay
        slope = rate(np.clip(moments, time[0], time[-1])) * ((time[0] <= moments) & (moments <= time[-1]))[:, None]
        square = float(np.sum(slope**2))
        if not square:
            return None
        delay -= float(np.nansum(left(delay) * slope)) / square
        delay = float(np.clip(delay, -reach, reach))
    return delay, known_difference(flat, exact[inner]), float(np.nanmax(np.abs(left(delay))))


def best_clock_factor(time: FloatArray, reported: FloatArray, true: FloatArray) -> tuple[float, float, float] | None:
    """Factor of the engine's clock, and the largest difference before and after correction.

    None if there are too few samples.
    """
    from scipy.interpolate import make_interp_spline

    comparable = _comparable(time, reported, true)
    if comparable is None:
        return None
    since = time - time[0]
    curve, fits = make_interp_spline(since, comparable[1], k=_SPLINE), list[tuple[float, float, float]]()
    for rate in _RATES:
        inner = since <= since[-1] / max(1.0, rate * (1 + _PACE))  # where the truth is known at the clock's time
        if np.sum(inner) < _FEWEST and rate != 1:
            continue
        flat, known = comparable[0][inner], comparable[1][inner]

        def left(faster: float, since: FloatArray = rate * since[inner], flat: FloatArray = flat) -> FloatArray:
            return np.asarray(flat - curve(since * (1 + float(np.clip(faster, -_PACE, _PACE))))).ravel()

        faster = float(np.clip(least_squares_parameter(left, 0.0, 1.0), -_PACE, _PACE))
        difference = float(np.max(np.abs(flat - known)))
        fits.append((rate * (1 + faster), difference, float(np.max(np.abs(left(faster))))))
    return min(fits, key=lambda fit: fit[2] / (fit[1] or 1.0))


def mistaken_rate(rate: float) -> bool:
    """True if the rate of a clock [1] is that of a known mistake: half, twice, a quarter, four times."""
    return any(abs(rate - mistake) <= _FIT * mistake for mistake in _RATES[1:])


def in_steps(delay: float, step: float | None) -> float:
    """Size of a time shift in steps; infinite if there is no step."""
    return abs(delay) / step if step else np.inf


def delay_text(delay: float, step: float | None) -> str:
    """Text of a time shift; in steps if it is half a step, one or two."""
    word = "late" if delay > 0 else "early"
    if step:
        steps = abs(delay) / step
        for number, words in ((0.5, "half a step"), (1.0, "one step"), (2.0, "two steps")):
            if abs(steps - number) <= 0.05 * number:
                return f"{words} ({abs(delay):.3g} s) {word}"
    return f"{abs(delay):.3g} s {word}"
