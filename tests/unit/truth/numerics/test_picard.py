"""Collocation solved by Picard's iteration, on equations with known solutions."""

import numpy as np
import pytest

from proofroll.core.errors import Diverged
from proofroll.truth.numerics.picard import PicardSteps


def turning(states: np.ndarray) -> np.ndarray:
    """Rates of a point that turns at 1 rad/s."""
    return np.stack([-states[1], states[0]])


def test_a_turning_point_stays_on_its_circle() -> None:
    """Over a turn the end of each step and states within it are exact to round-off, in few steps."""
    steps, time, state, count = PicardSteps(turning), 0.0, np.array([1.0, 0.0]), 0
    while time < 2 * np.pi:
        end, last, inside = steps.step(time, state, 2 * np.pi)
        within = np.linspace(time, end, 7)
        assert inside(within) == pytest.approx(np.stack([np.cos(within), np.sin(within)]), abs=3e-15)
        time, state, count = end, last, count + 1
    assert time == 2 * np.pi
    assert state == pytest.approx([1.0, 0.0], abs=3e-15)
    assert count < 15


def test_a_step_before_a_pole_gets_shorter_and_a_broken_right_side_has_none() -> None:
    """Where a solution grows to infinity steps shrink towards its pole; rates that are no numbers have no step."""
    steps, time, state = PicardSteps(lambda y: y**2), 0.0, np.array([1.0])
    for _ in range(12):
        time, state, _ = steps.step(time, state, 2.0)
    assert time < 1.0
    assert state[0] == pytest.approx(1 / (1 - time), rel=1e-9)
    with pytest.raises(Diverged, match="fell to nothing at t = 1"):
        PicardSteps(lambda y: y * np.nan).step(1.0, np.array([1.0]), 2.0)


def test_round_off_of_the_rates_does_not_shorten_steps() -> None:
    """Rates with noise of 3e-15 of the scale, as of a slow slip, take as few steps as without, to their accuracy."""
    state, time, count = np.array([1.0, 0.0]), 0.0, 0
    steps = PicardSteps(lambda states: turning(states) + 3e-15 * np.sin(1e17 * states))
    while time < 2 * np.pi:
        time, state, _ = steps.step(time, state, 2 * np.pi)
        count += 1
    assert state == pytest.approx([1.0, 0.0], abs=3e-14)
    assert count < 15
