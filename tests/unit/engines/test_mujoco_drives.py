"""MuJoCo's actuators, joint equalities, dry friction and stops, as the scene has them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from one_coordinate import moved

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.files.scene_file import load_scene
from proofroll.truth.switched_truth import truth_of

pytest.importorskip("mujoco")

from proofroll.engines.mujoco.settings import PRESETS
from proofroll.engines.mujoco.smooth.mechanism import MujocoMechanism

ONES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))


def built(mechanism: Mechanism, preset: str = "matched", **settings: Any) -> MujocoMechanism:
    """The mechanism in MuJoCo, at time 0."""
    return MujocoMechanism(mechanism, replace(PRESETS["joints"][preset], **settings))


def wrong_in_a_gear(ratio: float, built_ratio: float, preset: str) -> list[Any]:
    """Lines of a certificate that do not hold of a pair of gears with one ratio that is built with another."""
    element, kind = load_scene("gear_pair", ratio=ratio).elements[0], load_engine("mujoco")
    model = kind.build(load_scene("gear_pair", ratio=built_ratio), replace(PRESETS["joints"][preset], dt=1e-3))
    return [line for line in element.certify(model.built(), model.sample()) if not line.holds]


def slider(*actuators: Actuator, gravity: float = 0.0, **more: Any) -> Mechanism:
    """A mass on an upright slide."""
    return Mechanism(
        (Body("b", 1.0, inertia=ONES),),
        (Joint("j", "prismatic", "world", "b", **more),),
        actuators=actuators,
        gravity=(0, 0, -gravity),
    )


@pytest.mark.parametrize(
    "actuator",
    [
        Actuator("a", "j", "torque", 3.0, gear=-2.0),
        Actuator("a", "j", "velocity", 3.0, kd=5.0, gear=2.0),
        Actuator("a", "j", "position", 3.0, kp=7.0, kd=5.0, gear=-2.0),
        Actuator("a", "j", "position", 3.0, kp=7.0, kd=5.0, gear=2.0, limit=9.0),
        Actuator("a", "j", "position", -3.0, kp=7.0, kd=5.0, gear=-50.0, limit=9.0),
    ],
)
def test_efforts_are_those_of_the_scene(actuator: Actuator) -> None:
    """Each kind, with its gear and its limit, has the scene's effort at the start and its motion after it."""
    made = slider(actuator, q0=(0.2,), v0=(0.5,))
    engine = built(made, dt=1e-4)
    (effort,) = engine.sample().effort  # type: ignore[misc]
    assert effort == pytest.approx(actuator.effort(0.0, 0.2, 0.5), rel=1e-12)
    assert engine.built().acceleration[0, 2] == pytest.approx(effort, rel=1e-9)
    engine.advance(0.2)
    assert engine.sample().p_WB[0, 2] == pytest.approx(moved(made, 0.2)[0], abs=1e-5)


@pytest.mark.parametrize("signal", [Formula("sin(7*t)"), Table((0.0, 0.1, 0.4), (0.0, 1.0, -1.0))])
def test_what_changes_in_time_is_taken_at_each_stage(signal: Formula | Table) -> None:
    """With RK4, targets and drives are those of the stages; held over a step they would leave 1e-3."""
    made = slider(Actuator("a", "j", "position", signal, kp=50.0, kd=2.0), torque=signal)
    engine = built(made, dt=1e-3)
    engine.advance(0.5)
    place, _, efforts = moved(made, 0.5)
    found = engine.sample()
    assert found.p_WB[0, 2] == pytest.approx(place, abs=1e-6)
    assert found.effort == pytest.approx(efforts, abs=1e-4)
    with pytest.raises(Refused, match="in no MJCF"):
        engine.spec()
    euler = built(made, "default", dt=1e-4)
    euler.advance(0.5)
    assert euler.sample().effort == pytest.approx(efforts, abs=0.1)


def test_a_coupling_has_its_ratio_and_its_offset() -> None:
    """Two slides that are coupled move as the coupling says, and its force is that on joint_b."""
    bodies = (Body("a", 1.0, inertia=ONES), Body("b", 2.0, inertia=ONES))
    joints = (
        Joint("one", "prismatic", "world", "a", q0=(0.4,), torque=3.0),
        Joint("two", "prismatic", "world", "b", q0=(-0.9,)),
    )
    made = Mechanism(bodies, joints, couplings=(Coupling("g", "one", "two", -2.0, -0.1),), gravity=(0, 0, 0))
    engine = built(made)
    engine.advance(0.3)
    found, truth = engine.sample(), truth_of(made, np.array([0.0, 0.3])).record
    assert found.p_WB[:, 2] == pytest.approx(truth.q[1], abs=1e-6)
    assert found.coupling == pytest.approx(truth.named[1], rel=1e-6)
    assert truth.named[1] == pytest.approx([2.0 * -2.0 * 3.0 / 9.0])


@pytest.mark.parametrize("ratio", [-0.5, 0.01, 100.0])
@pytest.mark.parametrize("preset", ["default", "matched"])
def test_a_soft_gear_is_no_wrong_model(ratio: float, preset: str) -> None:
    """Forces of a soft gear are granted what softness changes."""
    assert not wrong_in_a_gear(ratio, ratio, preset)


@pytest.mark.parametrize("ratio", [-0.5, 0.01, 100.0])
def test_another_ratio_is_a_wrong_model(ratio: float) -> None:
    """Where softness changes little, a ratio off by 1 % is found."""
    assert wrong_in_a_gear(ratio, 1.01 * ratio, "matched")


def test_friction_and_stops_are_told_apart() -> None:
    """A mass that friction holds, and one that a stop holds from either side, tell the forces with their signs."""
    held = built(slider(gravity=9.81, friction=15.0))
    held.advance(0.1)
    assert held.sample().friction == pytest.approx([9.81], rel=1e-3)
    assert held.sample().stop == pytest.approx([0.0])
    for side, limits in ((1.0, (0.0, 1.0)), (-1.0, (-1.0, 0.0))):
        lying = built(slider(gravity=side * 9.81, limits=limits))
        lying.advance(0.5)
        assert lying.sample().stop == pytest.approx([side * 9.81], rel=1e-3)
        assert lying.sample().friction == pytest.approx([0.0])


def test_the_engine_says_that_it_has_all_of_it() -> None:
    """Actuators, limits, couplings and signals are asked of formulation joints, and of none of those of balls."""
    provides = load_engine("mujoco").provides
    for need in (
        "actuators of joints",
        "limits of efforts",
        "couplings of joints",
        "drives and targets that change in time",
    ):
        assert need in provides["joints"]
        assert not any(need in provides[name] for name in ("chart", "free", "facets"))


@pytest.mark.parametrize(("factor", "preset", "holds"), [(1.0, "default", True), (2.0, "matched", False)])
def test_dry_friction_of_a_slow_joint_is_softness_and_a_wrong_one_is_none(
    factor: float, preset: str, holds: bool
) -> None:
    """MuJoCo's default row pushes along a slow motion, which is its law; twice the friction is a wrong model."""

    def mass(friction: float) -> Mechanism:
        law: Any = {"q0": (0.95,), "v0": (0.5,), "stiffness": 100.0, "friction": friction}
        guide = Joint("guide", "prismatic", "world", "mass", **law)
        return Mechanism((Body("mass", 1.0, inertia=ONES),), (guide,), gravity=(0.0, 0.0, 0.0))

    run = built(mass(3.0 * factor), preset)
    lines = MechanismElement(mass(3.0)).certify(run.built(), run.sample())
    assert [line.holds for line in lines if line.quantity == "acceleration"] == [holds]
