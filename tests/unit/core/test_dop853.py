"""Steps of DOP853 that are looked into: where a guard rises, and how well that is known."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.dop853 import controlled_step, located, solver_from


@pytest.mark.parametrize(("level", "rises"), [(0.0, 0.0), (0.16, 0.2)])
def test_a_rise_is_known_to_a_bracket_that_is_not_empty(level: float, rises: float) -> None:
    """Where a parabola of time passes a level lies in a bracket of some width."""
    solver = solver_from(lambda t, _: np.array([1.0 - 2.0 * t]), 0.0, np.zeros(1), 1e-13, 1e-13, 1.0)
    controlled_step(solver, None, 1.0)
    rise = located(solver, lambda y: np.array([y[0] - level]))
    assert rise is not None
    assert rise.width > 0
    assert abs(rise.time - rises) <= 4 * max(rise.width, float(np.spacing(0.5)))
