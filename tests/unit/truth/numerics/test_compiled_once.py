"""Cache of compiled expressions."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.truth.numerics.compiled_once import compiled_once, heyoka

pytestmark = pytest.mark.skipif(heyoka is None, reason="heyoka is not installed")


def test_equal_expressions_of_longer_states_are_compiled_apart() -> None:
    """A function takes as many variables as its own state has, whatever was compiled before."""
    x, y, z = heyoka.make_vars("x", "y", "z")
    for state in ([x, y], [x, y, z]):
        values = compiled_once([x * y], state, by_collocation=True).values
        assert values(np.array([2.0, 3.0, 5.0])[: len(state)]) == [6.0]
