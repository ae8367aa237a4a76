"""Actuators, drives in time, couplings, dry friction and stops of joints in every engine, as the scene has them."""

from typing import Any

import numpy as np
import pytest
from one_coordinate import moved

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.files.scene_file import load_scene
from proofroll.truth.truth_of_mechanism import truth_of

ONES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
# Engine, formulation and preset -> allowed error of velocities after 0.2 s [rad/s], ten times what is seen; of
# efforts a hundred times as much, for their gains.
CLOSE = {
    ("mujoco", "joints", "matched"): 3e-8,
    ("exudyn", "redundant", "matched"): 4e-4,
    ("exudyn", "tree", "matched"): 2e-8,
    ("pinocchio", "null_space", "default"): 3e-8,
    ("pinocchio", "constraint_dynamics", "default"): 3e-8,
    ("projection", "dependent", "default"): 3e-9,
    ("projection", "dependent", "matched"): 2e-10,
}
ACTUATORS = [
    Actuator("a", "j", "torque", 3.0, gear=-2.0),
    Actuator("a", "j", "velocity", 3.0, kd=5.0, gear=2.0),
    Actuator("a", "j", "velocity", 30.0, kd=5.0, limit=2.0),
    Actuator("a", "j", "position", 3.0, kp=7.0, kd=5.0, gear=-2.0),
    Actuator("a", "j", "position", 3.0, kp=7.0, kd=5.0, gear=2.0, limit=9.0),
    Actuator("a", "j", "position", Formula("sin(7*t)"), kp=50.0, kd=2.0),
]


def built(mechanism: Mechanism, engine: str, formulation: str, preset: str, **settings: Any) -> Any:
    """The mechanism in an engine, at time 0; the test is skipped where the engine is not installed."""
    if engine != "projection":
        pytest.importorskip(engine)
    kind = load_engine(engine)
    return kind.build(mechanism, resolve_settings(kind, {"formulation": formulation, "preset": preset, **settings}))


def wheel(*actuators: Actuator, **more: Any) -> Mechanism:
    """A wheel of 1 kg m² on an axle that does not lie in the axes of the world."""
    joint = Joint("j", "revolute", "world", "b", orientation=(0.3, 0.5, 0.1), q0=(0.2,), v0=(0.5,), **more)
    return Mechanism((Body("b", 1.0, inertia=ONES),), (joint,), actuators=actuators, gravity=(0, 0, 0))


def slider(gravity: float = 0.0, **more: Any) -> Mechanism:
    """A mass on an upright slide."""
    guide = Joint("j", "prismatic", "world", "b", **more)
    return Mechanism((Body("b", 1.0, inertia=ONES),), (guide,), gravity=(0, 0, -gravity))


@pytest.mark.one_in(3)
@pytest.mark.parametrize("model", CLOSE, ids="-".join)
@pytest.mark.parametrize("actuator", ACTUATORS)
def test_efforts_are_those_of_the_scene(actuator: Actuator, model: tuple[str, str, str]) -> None:
    """Each kind, with gear, limit and a target in time, has the scene's effort at the start and its motion after it."""
    made, close = wheel(actuator), CLOSE[model]
    engine = built(made, *model)
    (effort,) = engine.sample().effort
    assert effort == pytest.approx(actuator.effort(0.0, 0.2, 0.5), rel=1e-9)
    assert np.linalg.norm(engine.built().angular_acceleration) == pytest.approx(abs(effort), rel=1e-5)
    engine.advance(0.2)
    _, spin, efforts = moved(made, 0.2)
    sample = engine.sample()
    assert np.linalg.norm(sample.w_WB) == pytest.approx(abs(spin), abs=close)
    assert sample.effort == pytest.approx(efforts, abs=100 * close)
    if sample.joint_torque is not None:
        assert sample.joint_torque[0] @ engine.built().joint_axis[0] == pytest.approx(sample.effort[0], rel=1e-9)


@pytest.mark.parametrize("model", CLOSE, ids="-".join)
@pytest.mark.parametrize("signal", [Formula("3*cos(9*t)"), Table((0.0, 0.1, 0.4), (0.0, 1.0, -1.0))])
def test_a_drive_in_time_is_that_of_each_stage(signal: Formula | Table, model: tuple[str, str, str]) -> None:
    """A drive in time that is held over a step would leave 1e-3."""
    made = wheel(torque=signal)
    engine = built(made, *model)
    engine.advance(0.2)
    assert np.linalg.norm(engine.sample().w_WB) == pytest.approx(abs(moved(made, 0.2)[1]), abs=CLOSE[model])


# Those with rows of couplings; of the projection method the quicker preset.
COUPLED = [
    model
    for model in CLOSE
    if model[1] not in {"tree", "constraint_dynamics"} and model != ("projection", "dependent", "default")
]


@pytest.mark.one_in(3)
@pytest.mark.parametrize("model", COUPLED, ids="-".join)
@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
def test_couplings_bear_their_forces(kind: Any, model: tuple[str, str, str]) -> None:
    """Two joints move by ratio and offset, with their armature; the force on joint_b is the coupling's."""
    armature = 0.0 if model[0] == "projection" else 0.5
    bodies = (Body("a", 1.0, inertia=ONES), Body("b", 2.0, inertia=ONES))
    joints = (
        Joint("one", kind, "world", "a", q0=(0.4,), v0=(-0.1,), torque=3.0, armature=armature),
        Joint("two", kind, "world", "b", q0=(-0.9,), v0=(0.2,), armature=armature / 2),
    )
    made = Mechanism(bodies, joints, couplings=(Coupling("g", "one", "two", -2.0, -0.1),), gravity=(0, 0, 0))
    engine = built(made, *model)
    assert engine.built().mobility == 1
    engine.advance(0.3)
    sample, truth = engine.sample(), truth_of(made, np.array([0.0, 0.3])).record
    rates = (sample.v_WB if kind == "prismatic" else sample.w_WB)[:, 2]
    assert rates == pytest.approx(truth.v[1], abs=1e-5)
    assert sample.coupling == pytest.approx(truth.named[1], rel=1e-4)
    second = 2.0 if kind == "prismatic" else 1.0
    acceleration = 3.0 / (1.0 + armature + 4 * (second + armature / 2)) * np.array([1.0, -2.0])
    passed = (sample.joint_force if kind == "prismatic" else sample.joint_torque)[:, 2]
    assert passed == pytest.approx([1.0, second] * acceleration, rel=1e-4)


@pytest.mark.parametrize(
    ("mechanism", "model", "words"),
    [
        (wheel(armature=1.0), ("exudyn", "tree", "matched"), "inertia of drives"),
        (wheel(ACTUATORS[2]), ("projection", "dependent", "tuned"), "not compiled"),
        (slider(friction=1.0), ("pinocchio", "null_space", "default"), "no law that switches"),
    ],
)
def test_what_is_not_followed_is_refused(mechanism: Mechanism, model: tuple[str, str, str], words: str) -> None:
    """Laws that a formulation lacks are refused with the reason."""
    with pytest.raises(Refused, match=words):
        built(mechanism, *model)


def test_what_mujoco_sets_in_every_step_is_in_no_file() -> None:
    """A drive or a target that changes in time is in no MJCF."""
    with pytest.raises(Refused, match="in no MJCF"):
        built(wheel(torque=Formula("sin(7*t)")), "mujoco", "joints", "matched").spec()


def test_a_stop_is_where_the_scene_has_it() -> None:
    """In Exudyn an axle whose child is turned against its parent stops at its limit, counted from the scene's zero."""
    made = wheel(limits=(-1.0, 0.4), torque=0.1)
    engine = built(made, "exudyn", "redundant", "tuned")
    start = engine.sample().q_WB[0]
    engine.advance(1.0)
    turned = 2 * np.arccos(abs(engine.sample().q_WB[0] @ start))
    assert turned == pytest.approx(0.4 - made.joints[0].q0[0], abs=1e-4)


def wrong_in_a_gear(ratio: float, built_ratio: float, preset: str) -> list[Any]:
    """Lines of a certificate that do not hold of a pair of gears with one ratio that MuJoCo builds with another."""
    element = load_scene("gear_pair", ratio=ratio).elements[0]
    model = built(load_scene("gear_pair", ratio=built_ratio), "mujoco", "joints", preset, dt=1e-3)  # type: ignore[arg-type]  # builds scenes, too
    return [line for line in element.certify(model.built(), model.sample()) if not line.holds]


@pytest.mark.parametrize("ratio", [-0.5, 0.01, 100.0])
def test_a_soft_gear_is_no_wrong_model(ratio: float) -> None:
    """Forces of MuJoCo's soft gear are granted what softness changes; where that is little, 1 % of ratio is found."""
    assert not any(wrong_in_a_gear(ratio, ratio, preset) for preset in ("default", "matched"))
    assert wrong_in_a_gear(ratio, 1.01 * ratio, "matched")


def test_friction_and_stops_are_told_apart() -> None:
    """In MuJoCo a mass that friction holds, and one that a stop holds from either side, tell the forces with signs."""
    model = "mujoco", "joints", "matched"
    held = built(slider(gravity=9.81, friction=15.0), *model)
    held.advance(0.1)
    assert held.sample().friction == pytest.approx([9.81], rel=1e-3)
    assert held.sample().stop == pytest.approx([0.0])
    for side, limits in ((1.0, (0.0, 1.0)), (-1.0, (-1.0, 0.0))):
        lying = built(slider(gravity=side * 9.81, limits=limits), *model)
        lying.advance(0.5)
        assert lying.sample().stop == pytest.approx([side * 9.81], rel=1e-3)
        assert lying.sample().friction == pytest.approx([0.0])


@pytest.mark.parametrize(("factor", "preset", "holds"), [(1.0, "default", True), (2.0, "matched", False)])
def test_dry_friction_of_a_slow_joint_is_softness_and_a_wrong_one_is_none(
    factor: float, preset: str, holds: bool
) -> None:
    """MuJoCo's default row pushes along a slow motion, which is its law; twice the friction is a wrong model."""
    law: dict[str, Any] = {"q0": (0.95,), "v0": (0.5,), "stiffness": 100.0}
    run = built(slider(**law, friction=3.0 * factor), "mujoco", "joints", preset)
    lines = MechanismElement(slider(**law, friction=3.0)).certify(run.built(), run.sample())
    assert [line.holds for line in lines if line.quantity == "acceleration"] == [holds]
