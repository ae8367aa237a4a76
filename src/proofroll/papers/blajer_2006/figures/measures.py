"""Measures: single numbers that characterise a curve, to compare sentences of an article with a run."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing

from proofroll.core.arrays import FloatArray

# Least swing that counts as an oscillation, as a part of the range; smaller ones are noise of an engine.
_PROMINENCE = 0.1
_FREQUENCY_BAND = (0.8, 1.25)  # around the estimate from the extremes, which has an error of a few per cent


def _turns(values: FloatArray) -> np.typing.NDArray[np.intp]:
    """Indices of local maxima and minima, in the order of time."""
    from scipy.signal import find_peaks  # half a second, which every report would pay

    prominence = _PROMINENCE * float(np.ptp(values))
    return np.sort(np.concatenate([find_peaks(sign * values, prominence=prominence)[0] for sign in (1, -1)]))


def extremes(values: FloatArray) -> FloatArray:
    """Values of the curve's inner maxima and minima in the order of time, shape (k,), interpolated by parabolas."""
    turns = _turns(values)
    left, peak, right = values[turns - 1], values[turns], values[turns + 1]
    bend = left - 2 * peak + right
    return np.asarray(peak - np.divide((right - left) ** 2, 8 * bend, out=np.zeros_like(peak), where=bend != 0))


def sinusoid(times: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Angular frequency [rad/s] and misfit [1] of the best sinusoid about a constant level.

    The misfit is the root mean square of the residual over the amplitude. Level, sine and cosine are linear and are
    eliminated; the frequency is searched near the one estimated from the extremes.
    """
    from scipy.optimize import minimize_scalar

    turns = _turns(values)
    if turns.size < 2:
        return float("nan"), float("nan")

    def fitted(frequency: float) -> tuple[float, float]:
        basis = np.stack([np.ones_like(times), np.cos(frequency * times), np.sin(frequency * times)], axis=1)
        part, *_ = np.linalg.lstsq(basis, values, rcond=None)
        left = values - basis @ part
        return float(np.sqrt(np.mean(left**2))), float(np.hypot(part[1], part[2]))

    guess = np.pi * (turns.size - 1) / (times[turns[-1]] - times[turns[0]])
    low, high = (factor * guess for factor in _FREQUENCY_BAND)
    # The misfit has other minima a fringe away, so the search starts from the best of a grid finer than that.
    grid = np.linspace(low, high, 8 * turns.size)
    best, step = float(min(grid, key=lambda w: fitted(w)[0])), float(grid[1] - grid[0])
    optimum = minimize_scalar(
        lambda w: fitted(w)[0], bounds=(best - step, best + step), options={"xatol": 1e-10 * guess}
    )
    left, amplitude = fitted(float(optimum.x))
    return float(optimum.x), left / amplitude


def _halves(of: Callable[[FloatArray], float], values: FloatArray) -> tuple[float, float]:
    """A function's value for the first half of the curve, and for the second."""
    return float(of(values[: values.size // 2])), float(of(values[values.size // 2 :]))


def _first_extreme(values: FloatArray) -> float:
    turning_points = extremes(values)
    return float(turning_points[0]) if turning_points.size else float("nan")


def _centred(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes and mean levels of swings, shape (k - 2,) each, k the number of extremes.

    Each inner extreme is compared with the mean of its two neighbours. So a linear drift of the level does not change
    the amplitudes, and a linear growth of the amplitude does not change the levels.
    """
    turning_points = extremes(values)
    outer, inner = (turning_points[:-2] + turning_points[2:]) / 2, turning_points[1:-1]
    return np.abs(inner - outer) / 2, (inner + outer) / 2


def _least_growth(values: FloatArray) -> float:
    amplitudes, _levels = _centred(values)
    return float(np.min(amplitudes[1:] / amplitudes[:-1])) if amplitudes.size > 1 else float("nan")


def _largest_step(values: FloatArray) -> float:
    _amplitudes, levels = _centred(values)
    return float(np.max(np.diff(levels))) if levels.size > 1 else float("nan")


def _change(values: FloatArray) -> float:
    earlier, later = _halves(np.mean, values)
    return later - earlier


def _growth_of_range(values: FloatArray) -> float:
    earlier, later = _halves(np.ptp, values)
    return later / earlier


@dataclass(frozen=True)
class Measure:
    """A measure of a curve.

    Attributes:
        value: function of times [s] and values, each of shape (time,).
        unit: unit of the measure; None: that of the curve.
        definition: definition for a reader; empty: the name says enough.
    """

    value: Callable[[FloatArray, FloatArray], float]
    unit: str | None = None
    definition: str = ""


def _of_values(value: Callable[[FloatArray], float], unit: str | None = None, definition: str = "") -> Measure:
    """Measure that depends on the values only, not on their times."""
    return Measure(lambda _, values: float(value(values)), unit, definition)


MEASURES: Mapping[str, Measure] = {
    "maximum": _of_values(np.max),
    "minimum": _of_values(np.min),
    "mean": _of_values(np.mean),
    "last": _of_values(lambda values: values[-1]),
    "variation": _of_values(lambda values: np.ptp(values) / abs(np.mean(values)), "1"),
    "half_range": _of_values(
        lambda values: np.ptp(values) / 2, definition="the amplitude is half of maximum less minimum"
    ),
    "first_extreme": _of_values(_first_extreme),
    "misfit_of_sinusoid": Measure(
        lambda times, values: sinusoid(times, values)[1],
        "1",
        "root mean square of what is left; the amplitude is that of the best sinusoid",
    ),
    "angular_frequency": Measure(lambda times, values: sinusoid(times, values)[0], "rad/s"),
    # The smallest ratio of an amplitude to the one before it.
    "least_growth_of_amplitude": _of_values(
        _least_growth,
        "1",
        "the amplitude of a swing is half the distance of a turning point from the mean of its two neighbours",
    ),
    # The largest rise of the level about which it swings, from a swing to the next.
    "largest_step_of_mean_level": _of_values(
        _largest_step,
        definition="the level of a swing lies in the middle between a turning point and the mean of its two neighbours",
    ),
    "change_of_mean": _of_values(_change),  # mean of the second half less that of the first
    "growth_of_range": _of_values(_growth_of_range, "1"),  # range of the second half over that of the first
}


def measured(measure: str, times: FloatArray, values: FloatArray) -> float:
    """Value of a measure for a curve; NaN if the curve has too few oscillations or is not finite."""
    if not values.size or not np.all(np.isfinite(values)):
        return float("nan")
    with np.errstate(divide="ignore", invalid="ignore"):
        return MEASURES[measure].value(times, values)
