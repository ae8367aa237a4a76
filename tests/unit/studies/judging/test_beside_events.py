"""Errors of a curve whose events come a step late or early."""

import numpy as np
import pytest

from proofroll.studies.judging.reference import beside_events

TIMES = np.linspace(0.0, 1.0, 101)
EVENT, STEP = 0.5005, 1e-3  # a step early it is before the sample at 0.5 s


def test_a_step_beside_a_rebound_is_the_jump_of_the_velocity_and_its_part_of_the_path() -> None:
    """A rebound at 1 m/s that comes 1 ms early is wrong by 2 m/s at a sample, and by 2 mm on the way."""
    for at, jump in ((EVENT, 2.0), (EVENT + 4 * STEP, 0.0)):  # further from the samples a step reaches none
        speed, path = np.where(at > TIMES, -1.0, 1.0), np.abs(TIMES - at)
        early, displaced = np.where(at - STEP > TIMES, -1.0, 1.0), np.abs(TIMES - at + STEP)
        assert np.max(np.abs(early - speed)) == jump
        assert beside_events(TIMES, speed, [at], STEP) == pytest.approx(jump, abs=1e-9)
        assert np.max(np.abs(displaced - path)) <= beside_events(TIMES, path, [at], STEP) <= 3 * STEP
