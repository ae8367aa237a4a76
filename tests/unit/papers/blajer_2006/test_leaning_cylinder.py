"""A cylinder whose axis leans, with gravity along it."""

from __future__ import annotations

import pytest
from placed_balls import leaning_cylinder
from true_runs import true_run

from proofroll.running.simulation import simulate


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("engine", "resistance", "error"),
    [
        ("mujoco[formulation=chart]", 5e-4, 1e-4),
        ("mujoco[formulation=geoms,preset=tuned]", 5e-4, 1e-4),
        ("exudyn[formulation=carrier,dt=5e-4]", 0.0, 1e-3),
        ("exudyn[formulation=rolling_disc,dt=5e-4]", 0.0, 1e-3),
        ("pinocchio[formulation=composite,preset=tuned]", 5e-4, 1e-12),
    ],
)
def test_a_leaning_cylinder_is_run_by_the_same_code(engine: str, resistance: float, error: float) -> None:
    """The model passes its certificate, and its path is the truth's within the errors of its steps."""
    scene = leaning_cylinder(0.3, rolling_resistance=resistance)
    run = simulate(scene, engine, until=0.5, every=0.1)
    assert run.status == "done", run.message
    assert float(abs(run.p_WB - true_run(scene, 0.5, 0.1).p_WB).max()) < error
