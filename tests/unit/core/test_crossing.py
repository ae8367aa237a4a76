import numpy as np
import pytest

from proofroll.core.crossing import first_rise, stays_negative


def functions(times):
    """A crest of height 1e-3 within the step, one just below zero, and a function far below."""
    crest = 1 - 40 * (times - 0.37) ** 2
    return np.stack([crest - 0.999, crest - 1.001, np.cos(3 * times) - 2], axis=1)


def test_a_rise_within_a_step_is_never_taken_for_none():
    """A function that rises and falls within a step is not called negative; one far below zero is."""
    crest, _, far = stays_negative(functions, 0.0, 1.0)
    assert not crest
    assert far
    assert first_rise(lambda t: functions(t)[:, 0], 0.0, 1.0) == pytest.approx(0.37 - 0.005)
    assert first_rise(lambda t: functions(t)[:, 1], 0.0, 1.0) is None


@pytest.mark.parametrize("frequency", np.linspace(0.1, 12, 60))
def test_an_oscillation_is_left_to_more_points(frequency):
    """An oscillation of up to two periods a step, many times what an integrator resolves, is never called negative."""
    for phase in np.linspace(0, 6, 25):
        times = np.linspace(0, 1, 1001)
        rises = (np.sin(frequency * times + phase) > 0.5).any()
        stays = stays_negative(lambda t, at=phase: np.sin(frequency * t + at)[:, None] - 0.5, 0.0, 1.0)
        assert not (rises and stays)
