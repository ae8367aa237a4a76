"""Exudyn's penalty contact of a ball that rolls."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core.certificate import certify
from proofroll.core.errors import Diverged
from proofroll.running.simulation import build, simulate

pytest.importorskip("exudyn")


@pytest.mark.parametrize("preset", ["default", "matched", "tuned"])
@pytest.mark.parametrize("parameters", [{"rolling_resistance": 5e-4}, {"speed": -4, "radial_spin": -20}])
def test_contact_certificate(preset: str, parameters: dict[str, float]) -> None:
    """The contact model starts with the scene's accelerations and forces; what it softens is named and small."""
    scene = load_scene("sphere_in_cylinder", **parameters)
    engine = build(scene, "exudyn", formulation="contact", preset=preset)
    lines = {line.quantity: line for line in certify(engine, scene)}
    assert [line for line in lines.values() if not line.holds] == []
    assert {"mass", "ball radius", "gap", "acceleration", "N", "F2", "F3"} <= lines.keys()
    assert max(lines[name].tolerance for name in ("N", "F2", "F3", "acceleration", "angular acceleration")) < 5e-6
    # As deep as the ball sinks in: at 41 N and 1e6 N/m a six-hundredth of the radius.
    assert lines["gap in the engine"].tolerance < 1.7e-3
    assert lines["gap in the engine"].found[0] < 0
    assert "creeps" in engine.built().regularised["slip"].because


# k d = 41 N of penetration changes by the change of N: 1e-6 m; and (ω dt)² of the spin as for the other rigid bodies.
@pytest.mark.parametrize("f", [0.0, 5e-4])
def test_contact_with_unbounded_friction(f: float) -> None:
    """With unbounded friction the contact follows the rolling ball, and creeps no more than its grip says."""
    scene = load_scene("sphere_in_cylinder", rolling_resistance=f)
    found = simulate(scene, "exudyn", until=0.5, every=0.05, formulation="contact", dt=1e-3)
    truth = simulate(scene, "truth", until=0.5, every=0.05)
    assert float(np.abs(found.z - truth.z).max()) < 7e-4
    assert float(np.abs(found.N - truth.N).max()) < 0.05
    assert float(np.abs(found.gap).max()) < 2e-6


def test_rolling_needs_more_than_the_grip() -> None:
    """A grip that is too small for unbounded friction ends the run with one line instead of a slip nobody asked for."""
    engine = build(load_scene("sphere_in_cylinder"), "exudyn", formulation="contact", grip=0.1, dt=1e-3)
    with pytest.raises(Diverged, match="use a larger grip") as raised:
        engine.advance(0.5)
    assert "\n" not in str(raised.value)
