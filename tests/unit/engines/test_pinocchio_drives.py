"""Pinocchio's equations with actuators, drives in time and couplings, as the scene has them."""

from typing import Any

import numpy as np
import pytest
from one_coordinate import moved

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.truth.switched_truth import truth_of

pytest.importorskip("pinocchio")

ONES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
AT = np.array([0.0, 0.2])


def built(mechanism: Mechanism, formulation: str = "null_space", preset: str = "default") -> Any:
    """The mechanism in Pinocchio, at time 0."""
    kind = load_engine("pinocchio")
    return kind.build(mechanism, kind.presets[formulation][preset])


def wheel(*actuators: Actuator, **more: Any) -> Mechanism:
    """A wheel of 1 kg m² on an axle."""
    joint = Joint("j", "revolute", "world", "b", q0=(0.2,), v0=(0.5,), **more)
    return Mechanism((Body("b", 1.0, inertia=ONES),), (joint,), actuators=actuators, gravity=(0, 0, 0))


@pytest.mark.parametrize("formulation", ["null_space", "constraint_dynamics"])
@pytest.mark.parametrize(
    "actuator",
    [
        Actuator("a", "j", "torque", 3.0, gear=-2.0),
        Actuator("a", "j", "velocity", 3.0, kd=5.0, gear=2.0),
        Actuator("a", "j", "position", 3.0, kp=7.0, kd=5.0, gear=2.0, limit=9.0),
        Actuator("a", "j", "position", Formula("sin(7*t)"), kp=50.0, kd=2.0),
    ],
)
def test_efforts_are_those_of_the_scene(actuator: Actuator, formulation: str) -> None:
    """Each kind has the scene's effort at the start, and its motion and effort after it."""
    made = wheel(actuator)
    engine = built(made, formulation)
    assert engine.sample().effort == pytest.approx([actuator.effort(0.0, 0.2, 0.5)], rel=1e-12)
    _, spin, efforts = moved(made, AT[1])
    engine.advance(AT[1])
    found = engine.sample()
    assert found.w_WB[0, 2] == pytest.approx(spin, abs=1e-5)
    assert found.effort == pytest.approx(efforts, abs=1e-4)
    assert found.joint_torque[0, 2] == pytest.approx(found.effort[0], rel=1e-12)


@pytest.mark.parametrize(("preset", "error"), [("default", 1e-6), ("tuned", 1e-9)])
def test_a_drive_is_that_of_each_stage(preset: str, error: float) -> None:
    """A drive in time that is held over a step would leave 1e-3; within a table's corner a step is of lower order."""
    for signal, more in ((Formula("3*cos(9*t)"), 1.0), (Table((0.0, 0.1, 0.4), (0.0, 1.0, -1.0)), 100.0)):
        made = wheel(torque=signal)
        engine = built(made, preset=preset)
        engine.advance(AT[1])
        assert engine.sample().w_WB[0, 2] == pytest.approx(moved(made, AT[1])[1], abs=more * error)


def test_couplings_are_rows() -> None:
    """Two joints move by ratio and offset, and the force on joint_b is the coupling's."""
    bodies = (Body("a", 1.0, inertia=ONES), Body("b", 2.0, inertia=ONES))
    joints = (
        Joint("one", "prismatic", "world", "a", q0=(0.4,), torque=3.0),
        Joint("two", "prismatic", "world", "b", q0=(-0.9,)),
    )
    made = Mechanism(bodies, joints, couplings=(Coupling("g", "one", "two", -2.0, -0.1),), gravity=(0, 0, 0))
    engine = built(made)
    assert (engine.built().rows, engine.built().mobility) == (1, 1)
    engine.advance(AT[1])
    found, truth = engine.sample(), truth_of(made, AT).record
    assert found.p_WB[:, 2] == pytest.approx(truth.q[1], abs=1e-10)
    assert found.coupling == pytest.approx(truth.named[1], rel=1e-10)
    with pytest.raises(Refused, match="no single angle"):
        built(made, "constraint_dynamics")


def test_programs_lack_drives_in_time() -> None:
    """A program without what changes the scene's drives is refused; it could not be read with Pinocchio alone."""
    kind, moved = load_engine("pinocchio"), wheel(Actuator("a", "j", "position", Formula("sin(7*t)"), kp=50.0))
    with pytest.raises(Refused, match="drives that change in time"):
        kind.reproducer(moved, kind.presets["null_space"]["default"])
