from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core.certificate import Line, Standing, certify
from proofroll.running.simulation import build

pytest.importorskip("exudyn")

from proofroll.papers.blajer_2006.exudyn import ball as ball_module
from proofroll.papers.blajer_2006.exudyn.formulations import PRESETS, RUNS

MODELS = [(formulation, preset) for formulation in RUNS for preset in PRESETS[formulation]]
# Nothing is zero or symmetric.
MOVING = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0, "rolling_resistance": 5e-4}


def broken(lines: list[Line]) -> set[str]:
    """Names of the lines that fail."""
    return {line.quantity for line in lines if not line.holds}


@pytest.mark.parametrize(("formulation", "preset"), MODELS)
def test_a_wrong_inertia_inside_the_engine_is_felt(
    formulation: str, preset: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """J doubled in the engine's body alone shows in its accelerations, even where the start is set from the scene."""
    true = load_scene("sphere_in_cylinder", **MOVING)
    proper = ball_module.add_body

    def wrong(system: Any, mass: float, inertia: float, *state: Any) -> Any:
        return proper(system, mass, 2 * inertia, *state)

    monkeypatch.setattr(ball_module, "add_body", wrong)
    found = broken(certify(build(true, "exudyn", formulation=formulation, preset=preset), true))
    assert {"inertia", "angular acceleration"} <= found


@pytest.mark.parametrize(("formulation", "preset"), MODELS)
def test_unbounded_friction(formulation: str, preset: str) -> None:
    """Rows that hold both ways have no coefficient."""
    true = load_scene("sphere_in_cylinder", speed=4)
    engine = build(true, "exudyn", formulation=formulation, preset=preset)
    assert not broken(certify(engine, true))
    assert engine.built().contact_friction is None


@pytest.mark.parametrize(("formulation", "preset"), MODELS)
def test_everything_is_read_back(formulation: str, preset: str) -> None:
    """Rolling resistance, angular acceleration and, but for a joint without one, the gap come from the engine."""
    true = load_scene("sphere_in_cylinder", **MOVING)
    certificate = certify(build(true, "exudyn", formulation=formulation, preset=preset), true)
    assert not broken(certificate)
    lines = {line.quantity for line in certificate if line.standing is not Standing.NOT_REPORTED}
    told = {"places of contact", "rolling resistance", "acceleration", "angular acceleration", "forces of contact"}
    assert told <= lines
    # The rolling disc's joint constrains velocities only: it has no distance.
    assert ("gaps" in lines) == (formulation != "rolling_disc")


def test_the_gap_is_that_of_the_engines_wall() -> None:
    """A ball that is moved into the wall behind the adapter's back is seen by the engine's own distance."""
    import exudyn

    current = exudyn.ConfigurationType.Current
    engine = build(load_scene("sphere_in_cylinder"), "exudyn", formulation="carrier")
    (before,) = engine.built().contact_gap
    data = engine.system.systemData
    q = np.array(data.GetODE2Coordinates(current))
    q[0] += 1e-6  # towards the wall: x of the ball's centre, as γ = 0
    data.SetODE2Coordinates(q, current)
    assert engine.built().contact_gap[0] - before == pytest.approx(-1e-6, rel=1e-6)
