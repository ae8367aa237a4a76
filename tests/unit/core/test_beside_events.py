"""Events that end with steps, on ladders whose steps share their ends."""

from __future__ import annotations

import numpy as np
import pytest
from flat_judging import judged_curve

from proofroll.core.beside_events import beside_events
from proofroll.core.convergence import richardson
from proofroll.core.verdict import LimitResult

T = np.linspace(0, 1, 51)
BRAKE, ROLLS = 3.0, 5 / 7
SPEEDS = np.linspace(1.0, 2.0, 20).tolist()


def slides(speed: float, until: float) -> np.ndarray:
    """Way of a ball that friction brakes until some time, and that rolls on [m]."""
    braked = np.minimum(T, until)
    return np.asarray(speed * T - BRAKE * braked * (T - braked / 2))


def end(speed: float, step: float = 0.0) -> float:
    """When the slip ends [s], or the step in which it does."""
    exact = speed * (1 - ROLLS) / BRAKE
    return float(np.ceil(exact / step) * step) if step else exact


@pytest.mark.parametrize("late", [1e-4, 1e-3])
def test_what_a_late_event_does(late: float) -> None:
    """The bar is what the delay does to the way, and no more than a few times that."""
    true = slides(2.0, end(2.0))
    moved = float(np.max(np.abs(slides(2.0, end(2.0) + late) - true)))
    found = beside_events(T, true, [end(2.0)], late)
    assert moved * 0.99 <= found <= 3 * moved
    assert beside_events(T, true, [], late) == 0.0
    assert beside_events(T, np.sin(T), [0.5], late) < 0.2 * late, "a parabola is no sine"


def test_a_sample_in_a_late_event_is_off_by_the_jump() -> None:
    """A force that jumps where the slip ends is wrong by all of it at a sample that the delay covers."""
    force = np.where(end(2.0) > T, BRAKE, 0.0)
    assert beside_events(T, force, [0.1999], 1e-3) >= BRAKE
    assert beside_events(T, force, [0.19], 1e-3) < 1e-9


def test_honest_engines_whose_events_end_with_steps_have_no_other_limit() -> None:
    """At none of 20 speeds is a run that is exact but for the step of its event told to have another limit."""
    accused = []
    for speed in SPEEDS:
        steps = [4e-3, 2e-3, 1e-3]
        true, curves = slides(speed, end(speed)), [slides(speed, end(speed, step)) for step in steps]
        bare = richardson(curves, steps)
        for beside in (0.0, beside_events(T, curves[-1], [end(speed, steps[-1])], steps[-1])):
            limit = type(bare)(bare.values, bare.error_bar, bare.order, bare.shown, beside=beside)
            found = judged_curve(
                "x", "m", curves[-1], true, truth_error_bar=1e-15, tolerance=1e-4, scale=1.0, limit=limit, ladder=True
            )
            if found.limit is LimitResult.ANOTHER or found.remarks:
                accused.append((speed, beside > 0))
    assert any(not barred for _, barred in accused), "the ladders are those that share ends of steps"
    assert not any(barred for _, barred in accused)
