"""Exudyn's actuators, drives in time, couplings and armature, as the scene has them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from one_coordinate import moved

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.switched_truth import truth_of

pytest.importorskip("exudyn")

from proofroll.engines.exudyn.settings import PRESETS
from proofroll.engines.exudyn.smooth.redundant import Redundant
from proofroll.engines.exudyn.smooth.tree import KinematicTree

ONES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
MODELS = {"redundant": Redundant, "tree": KinematicTree}


def built(mechanism: Mechanism, formulation: str = "redundant", dt: float = 1e-3) -> Any:
    """The mechanism in Exudyn, at time 0."""
    return MODELS[formulation](mechanism, replace(PRESETS[formulation]["matched"], dt=dt))


def wheel(*actuators: Actuator, **more: Any) -> Mechanism:
    """A wheel of 1 kg m² on an axle that does not lie in the axes of the world."""
    joint = Joint("j", "revolute", "world", "b", orientation=(0.3, 0.5, 0.1), q0=(0.2,), v0=(0.5,), **more)
    return Mechanism((Body("b", 1.0, inertia=ONES),), (joint,), actuators=actuators, gravity=(0, 0, 0))


@pytest.mark.parametrize("formulation", MODELS)
@pytest.mark.parametrize(
    "actuator",
    [
        Actuator("a", "j", "torque", 3.0, gear=-2.0),
        Actuator("a", "j", "velocity", 3.0, kd=5.0, gear=2.0),
        Actuator("a", "j", "position", 3.0, kp=7.0, kd=5.0, gear=-2.0),
        Actuator("a", "j", "position", 3.0, kp=7.0, kd=5.0, gear=2.0, limit=9.0),
        Actuator("a", "j", "position", Formula("sin(7*t)"), kp=50.0, kd=2.0),
    ],
)
def test_efforts_are_those_of_the_scene(actuator: Actuator, formulation: str) -> None:
    """Each kind, with gear, limit and a target in time, has the scene's effort at the start and its motion after it."""
    made = wheel(actuator)
    engine = built(made, formulation)
    (effort,) = engine.sample().effort
    assert effort == pytest.approx(actuator.effort(0.0, 0.2, 0.5), rel=1e-9)
    assert np.linalg.norm(engine.built().angular_acceleration) == pytest.approx(abs(effort), rel=1e-5)
    engine.advance(0.2)
    _, spin, efforts = moved(made, 0.2)
    found = engine.sample()
    assert found.effort == pytest.approx(efforts, rel=1e-3, abs=1e-3)
    assert np.linalg.norm(found.w_WB) == pytest.approx(abs(spin), rel=1e-3, abs=1e-3)
    if found.joint_torque is not None:
        assert found.joint_torque[0] @ engine.built().joint_axis[0] == pytest.approx(found.effort[0], rel=1e-9)


def test_a_drive_in_time_is_evaluated_within_a_step() -> None:
    """The error of a drive in time falls with the square of the step."""
    made = wheel(torque=Formula("3*cos(9*t)"))
    _, spin, _ = moved(made, 0.4)
    errors = []
    for dt in (4e-3, 2e-3):
        engine = built(made, dt=dt)
        engine.advance(0.4)
        errors.append(abs(np.linalg.norm(engine.sample().w_WB) - abs(spin)))
    assert errors[1] < 0.3 * errors[0] < 1e-4


@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
def test_couplings_and_armature_bear_their_forces(kind: Any) -> None:
    """Two joints move by ratio and offset, with their armature; the force on joint_b is the coupling's."""
    bodies = (Body("a", 1.0, inertia=ONES), Body("b", 2.0, inertia=ONES))
    joints = (
        Joint("one", kind, "world", "a", q0=(0.4,), torque=3.0, armature=0.5),
        Joint("two", kind, "world", "b", q0=(-0.9,), v0=(0.2,), armature=0.25),
    )
    joints = (replace(joints[0], v0=(-0.1,)), joints[1])
    made = Mechanism(bodies, joints, couplings=(Coupling("g", "one", "two", -2.0, -0.1),), gravity=(0, 0, 0))
    engine = built(made)
    assert engine.built().mobility == 1
    engine.advance(0.3)
    found, truth = engine.sample(), truth_of(made, np.array([0.0, 0.3])).record
    rates = (found.v_WB if kind == "prismatic" else found.w_WB)[:, 2]
    assert rates == pytest.approx(truth.v[1], abs=1e-6)
    assert found.coupling == pytest.approx(truth.named[1], rel=1e-4)
    passed = (found.joint_force if kind == "prismatic" else found.joint_torque)[:, 2]
    inertia = np.array([1.0, 2.0 if kind == "prismatic" else 1.0])
    acceleration = 3.0 / (1.5 + 4 * (inertia[1] + 0.25)) * np.array([1.0, -2.0])
    assert passed == pytest.approx(inertia * acceleration, rel=1e-4)


def test_a_stop_is_where_the_scene_has_it() -> None:
    """An axle whose child is turned against its parent stops at its limit, counted from the scene's zero."""
    made = wheel(limits=(-1.0, 0.4), torque=0.1)
    engine = Redundant(made, PRESETS["redundant"]["tuned"])
    engine.advance(1.0)
    turned = 2 * np.arccos(abs(engine.sample().q_WB[0] @ built(made).sample().q_WB[0]))
    assert turned == pytest.approx(0.4 - made.joints[0].q0[0], abs=1e-4)


def test_a_tree_refuses_what_needs_a_constraint() -> None:
    """Exudyn's explicit integrators have neither couplings nor armature, and the refusal says why."""
    with pytest.raises(Refused, match="inertia of drives"):
        built(wheel(armature=1.0), "tree")
