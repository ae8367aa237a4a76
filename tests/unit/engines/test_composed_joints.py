"""Joints composed of others through bodies without mass: gimbal, screw, cylindrical, in every engine."""

import mechanism_runs as runs
import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.capabilities import required
from proofroll.elements.mechanism.scene.drives import Coupling

SOLID = ((0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.25))
ROTOR = Body("rotor", 2.0, (0.1, 0.05, 0.2), SOLID)
UNTIL = 0.1
# Largest errors of places [m]: soft couplings of MuJoCo, second order of Exudyn, else round-off.
BOUNDS = {"joints": 1e-6, "redundant": 1e-6}


def after(formulation: str, mechanism: Mechanism) -> np.ndarray | None:
    """Place of the last body after UNTIL in an engine; None where it refuses what the mechanism needs."""
    engine, _ = runs.settings(formulation)
    if required(mechanism) - engine.provides[formulation]:
        with pytest.raises(Refused):
            runs.build(formulation, mechanism)
        return None
    run = runs.build(formulation, mechanism)
    run.advance(UNTIL)
    sample = run.sample()
    return np.concatenate([sample.p_WB[-1], sample.w_WB[-1]])


@pytest.mark.parametrize("formulation", list(runs.FORMULATIONS))
def test_a_gimbal_is_a_ball_joint(formulation: str) -> None:
    """Three revolutes through rings without mass move a rotor as a spherical joint does."""
    rings = (Body("outer", 0.0), Body("inner", 0.0), ROTOR)
    joints = (
        Joint("j0", "revolute", "world", "outer", axis=(0, 0, 1), v0=(0.5,)),
        Joint("j1", "revolute", "outer", "inner", axis=(1, 0, 0), v0=(-0.4,)),
        Joint("j2", "revolute", "inner", "rotor", axis=(0, 1, 0), v0=(3.0,)),
    )
    ball = Mechanism((ROTOR,), (Joint("ball", "spherical", "world", "rotor", v0=(-0.4, 3.0, 0.5)),))
    found = after(formulation, Mechanism(rings, joints))
    truth, _ = runs.true(ball, UNTIL)
    exact = np.concatenate([truth.p_WB[-1, 0], truth.w_WB[-1, 0]])
    assert found is not None
    assert np.abs(found - exact).max() < (2e-5 if formulation == "redundant" else 1e-9)


@pytest.mark.parametrize("formulation", list(runs.FORMULATIONS))
def test_a_screw_falls_by_its_closed_form(formulation: str) -> None:
    """A carriage without mass, a revolute and a coupling fall with m g/(m + I/r²), r the travel per radian."""
    ratio, bodies = 0.05, (Body("carriage", 0.0), Body("nut", 1.0, inertia=((0.01, 0, 0), (0, 0.01, 0), (0, 0, 0.01))))
    joints = (Joint("slide", "prismatic", "world", "carriage"), Joint("turn", "revolute", "carriage", "nut"))
    screw = Mechanism(bodies, joints, couplings=(Coupling("thread", joint_a="turn", joint_b="slide", ratio=ratio),))
    found = after(formulation, screw)
    if found is None:
        assert formulation in {"tree", "constraint_dynamics"}
        return
    rate = -9.81 / (1.0 + 0.01 / ratio**2)
    assert found[2] == pytest.approx(rate * UNTIL**2 / 2, abs=BOUNDS.get(formulation, 1e-12))


@pytest.mark.parametrize("formulation", list(runs.FORMULATIONS))
def test_a_composed_cylindrical_joint_is_one(formulation: str) -> None:
    """A prismatic joint, a sleeve without mass and a revolute move a body as a cylindrical joint does."""
    joints = (Joint("slide", "prismatic", "world", "sleeve", axis=(1, 0, 1), v0=(0.3,)),
              Joint("turn", "revolute", "sleeve", "rotor", axis=(1, 0, 1), v0=(2.0,)))  # fmt: skip
    one = Mechanism((ROTOR,), (Joint("j", "cylindrical", "world", "rotor", axis=(1, 0, 1), v0=(0.3, 2.0)),))
    found = after(formulation, Mechanism((Body("sleeve", 0.0), ROTOR), joints))
    truth, _ = runs.true(one, UNTIL)
    assert found is not None
    assert np.abs(found[:3] - truth.p_WB[-1, 0]).max() < BOUNDS.get(formulation, 1e-9)
