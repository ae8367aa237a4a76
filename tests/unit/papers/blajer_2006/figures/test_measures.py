"""Numbers that sum up a curve."""

from __future__ import annotations

import math

import numpy as np
import pytest

from proofroll.papers.blajer_2006.figures.measures import extremes, measured, sinusoid

T = np.linspace(0.0, 3.0, 3001)
FREQUENCY = 10.69


def wave(level: float = 0.0, growth: float = 0.0, drift: float = 0.0) -> np.ndarray:
    """A cosine about a level that drifts, with an amplitude that grows."""
    return level + drift * T + (1 + growth * T) * np.cos(FREQUENCY * T)


@pytest.mark.drill
def test_a_sinusoid_is_recognised() -> None:
    """A cosine about any level leaves nothing and tells its frequency; with a second frequency it leaves just that."""
    frequency, misfit = sinusoid(T, wave(level=-5.0))
    assert frequency == pytest.approx(FREQUENCY, rel=1e-6)
    assert misfit < 1e-6
    few = T[:900]  # just beyond three half periods
    assert sinusoid(few, np.cos(FREQUENCY * few))[0] == pytest.approx(FREQUENCY, rel=1e-6)
    _, misfit = sinusoid(T, wave() + 0.01 * np.cos(5.3 * FREQUENCY * T))
    assert misfit == pytest.approx(0.01 / math.sqrt(2), rel=0.1)


def test_growth_and_drift_are_told_apart() -> None:
    """A falling level is not taken for a growing amplitude, nor a growing amplitude for a level that moves."""
    falling, growing = wave(drift=-0.2), wave(growth=0.2)
    assert measured("least_growth_of_amplitude", T, falling) == pytest.approx(1.0, abs=2e-3)
    assert measured("largest_step_of_mean_level", T, falling) == pytest.approx(-0.2 * math.pi / FREQUENCY, rel=0.02)
    assert measured("least_growth_of_amplitude", T, growing) > 1.01
    assert measured("largest_step_of_mean_level", T, growing) == pytest.approx(0.0, abs=2e-3)
    assert measured("least_growth_of_amplitude", T, wave(growth=-0.1)) < 1


def test_extremes_lie_between_samples_and_noise_makes_none() -> None:
    """Extremes are as high as the curve even where no sample is, and ripples of a per cent add none."""
    coarse = np.linspace(0.0, 2.8, 57)
    found = extremes(np.cos(FREQUENCY * coarse))  # without the one at time 0
    assert np.abs(found) == pytest.approx(np.ones(9), abs=2e-3)
    ripple = 0.01 * np.cos(90 * FREQUENCY * T)
    assert extremes(wave() + ripple).size == extremes(wave()).size


@pytest.mark.parametrize(
    ("measure", "expected"),
    [
        ("maximum", 4.0),
        ("minimum", 1.0),
        ("mean", 2.5),
        ("last", 4.0),
        ("variation", 3 / 2.5),
        ("half_range", 1.5),
        ("change_of_mean", 2.0),
        ("growth_of_range", 1.0),
    ],
)
def test_plain_measures(measure: str, expected: float) -> None:
    """Each is what its name says."""
    assert measured(measure, T[:4], np.array([1.0, 2.0, 3.0, 4.0])) == pytest.approx(expected)


def test_what_cannot_be_measured_is_nan() -> None:
    """Without oscillations there is no amplitude, and a curve that is not finite has no measure."""
    assert math.isnan(measured("least_growth_of_amplitude", T, T))
    assert math.isnan(measured("misfit_of_sinusoid", T, T))
    assert math.isnan(measured("first_extreme", T, T))
    assert math.isnan(measured("maximum", T[:2], np.array([1.0, np.nan])))
