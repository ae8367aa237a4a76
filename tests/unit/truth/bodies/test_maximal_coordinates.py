"""Separate bodies with constraint rows, in numbers."""

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.truth.bodies.maximal_coordinates import NumericEquations
from proofroll.truth.bodies.maximal_equations import MaximalEquations


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("name", ["four_bar", "gear_pair", "shaken_pendulum"])
def test_independence_of_rows_is_asked_of_recorded_ones(
    name: str, planar: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Recorded rows are those of the equations to the last bit, which are not set up anew at each state."""
    equations = NumericEquations(MaximalEquations(mechanism_named(name), allow_planar=planar))
    start, rng = equations.equations.start(), np.random.default_rng(0)
    states = [equations.normalised(start + 0.1 * rng.normal(size=len(start))) for _ in range(3)]
    chosen = equations.independent_rows()
    all_rows = [equations._weighted(state) for state in states]
    values = [np.linalg.svd(rows, compute_uv=False)[equations.rank - 1] for rows in all_rows]
    least = [np.linalg.svd(rows[list(chosen)], compute_uv=False)[-1] for rows in all_rows]
    equations.independence(chosen, start)
    monkeypatch.delattr(MaximalEquations, "lasting_rows")
    found = [equations.independence(chosen, state) for state in states]
    assert found == [float(weak / whole) for weak, whole in zip(least, values, strict=True)]
