"""What all engines have in common on mechanisms; each through its own model."""

import re
from dataclasses import replace

import held_bodies
import mechanism_examples as examples
import mechanism_runs as runs
import numpy as np
import pytest

from proofroll.core.certificate import certify, first_difference
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Force, Joint, Loop, Mechanism, Spring
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.run.capabilities import required
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.joint_kinds import WITH_AXIS
from proofroll.elements.mechanism.scene.rotations import from_quaternion
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build, simulate

ALL = tuple(runs.FORMULATIONS)
ROUND_OFF = 1e-12
LAW = SpringLaw("0.3*dL^3 - 0.2/L")
# Explicit in joint coordinates, so that it has neither other joints nor reactions.
WITH_REACTIONS = tuple(name for name in ALL if name != "tree")


def with_laws(formulation):
    """A joint of each kind, with springs, dampers and drives where there may be any."""
    law = {"stiffness": 3.0, "rest": 0.2, "damping": 0.3}
    laws = {"revolute": law | {"torque": 0.7}, "prismatic": law | {"torque": 0.5}, "spherical": {"damping": 0.4}}
    if formulation != "redundant":  # Exudyn's bodies have no such spring
        laws["universal"] = law
    return tuple(replace(joint, **laws.get(joint.kind, {})) for joint in examples.every_kind().joints)


def example(formulation):
    """A tree with every kind of joint, or with those that a kinematic tree has; with spring, dampers and drives."""
    if formulation != "tree":
        kinds = examples.every_kind()
        springs = tuple(replace(spring, force=LAW) for spring in kinds.springs)
        return replace(kinds, loops=(), joints=with_laws(formulation), springs=springs)
    solid = examples.SOLID
    joints = (
        Joint(
            "a", "revolute", "world", "b0", (1, 0, 0.2), (0.1, 0.2, 0.3), (1, 2, 3), None, (0.1, 0, 0), (0.4,), (1.1,)
        ),
        Joint(
            "b", "prismatic", "b0", "b1", (0, 1, 0), (0.3, 0, 0.3), (1, 0, 3), None, (0, 0.2, 0), (0.5,), (-0.7,),
            stiffness=20, rest=0.1, damping=0.3, torque=0.5,
        ),
        Joint("c", "revolute", "b0", "b2", (0, 0, 1), axis=(0, 1, 0), stiffness=3, rest=0.2, damping=0.1, torque=0.4),
    )  # fmt: skip
    spring = Spring("s", "b1", "world", (0.1, 0, 0), (0, 0, 1), stiffness=20.0, damping=0.5, length=0.3, force=LAW)
    forces = (
        Force("f", "b2", "force", (1.0, -2.0, 0.5), (0.1, 0.2, -0.1), "body"),
        Force("m", "b1", "moment", (0.2, 0.1, -0.3)),
    )
    bodies = tuple(Body(f"b{i}", **solid) for i in range(3))
    return Mechanism(bodies, joints, springs=(spring,), forces=forces, bushings=(examples.BUSHING,))


@pytest.mark.parametrize("formulation", ALL)
def test_bodies_start_as_the_mechanism_says(formulation):
    """Positions, velocities, orientations and angular velocities at time 0 are those of the joint coordinates."""
    mechanism = example(formulation)
    motion, _, _ = runs.start(mechanism)
    sample = runs.build(formulation, mechanism).sample()
    for found, expected in zip(
        (sample.p_WB, sample.v_WB, sample.w_WB, [from_quaternion(q) for q in sample.q_WB]),
        (motion.p_WB, motion.v_WB, motion.w_WB, motion.R_WB),
        strict=True,
    ):
        np.testing.assert_allclose(found, expected[:-1], atol=ROUND_OFF)


@pytest.mark.parametrize("formulation", ALL)
def test_what_was_built_is_read_back(formulation):
    """Masses, centres of mass, inertias, joints, gravity, mobility and accelerations are the mechanism's."""
    mechanism = example(formulation)
    motion, accelerations, _ = runs.start(mechanism)
    built = runs.build(formulation, mechanism).built()
    bodies = mechanism.bodies
    np.testing.assert_allclose(built.mass, [body.mass for body in bodies], rtol=ROUND_OFF)
    np.testing.assert_allclose(built.com, [body.com for body in bodies], atol=ROUND_OFF)
    np.testing.assert_allclose(built.inertia, [body.inertia for body in bodies], atol=ROUND_OFF)
    np.testing.assert_allclose(built.gravity, mechanism.gravity, atol=ROUND_OFF)
    np.testing.assert_allclose(built.joint_position, motion.p_joint, atol=ROUND_OFF)
    for joint, found, axes in zip(mechanism.joints, built.joint_axis, motion.R_parent, strict=True):
        if joint.kind in WITH_AXIS:
            np.testing.assert_allclose(found, axes[:, 2], atol=ROUND_OFF)
        else:
            assert np.isnan(found).all()
    assert built.mobility == mechanism.nv
    # relative to the largest; the engine says where it is no more than that exact
    for name, columns in (("acceleration", slice(0, 3)), ("angular_acceleration", slice(3, 6))):
        expected = accelerations[:, columns]
        tolerance = built.regularised[name].tolerance if name in built.regularised else 1e-11
        assert np.abs(getattr(built, name) - expected).max() < tolerance * np.abs(expected).max()


@pytest.mark.parametrize("formulation", WITH_REACTIONS)
def test_reactions_at_the_start(formulation):
    """The wrench on each joint's child, at the joint and along the world's axes, is the truth's; NaN if not said."""
    mechanism = example(formulation)
    _, _, expected = runs.start(mechanism)
    run = runs.build(formulation, mechanism)
    found = runs.wrench(run.sample())
    regularised = run.built().regularised
    tolerance = regularised["acceleration"].tolerance if regularised else 1e-11
    said = np.isfinite(found).all(axis=1)
    assert [joint.kind for joint, says in zip(mechanism.joints, said, strict=True) if not says] in ([], ["fixed"])
    assert np.abs(found - expected)[said].max() < tolerance * np.abs(expected).max()


@pytest.mark.one_in(4)
@pytest.mark.parametrize("formulation", WITH_REACTIONS)
@pytest.mark.parametrize("kind", held_bodies.LOOPS)
def test_a_loop_holds_as_the_joint_does(formulation, kind):
    """A body that a loop of some kind holds moves as on a joint of that kind, with its reaction; or it is refused."""
    by_loop, on_joint = held_bodies.held(kind)
    engine, _ = runs.settings(formulation)
    if required(by_loop) - engine.provides[formulation]:
        with pytest.raises(Refused, match="loops closed by"):
            runs.build(formulation, by_loop)
        return
    truth, _ = runs.true(on_joint, 0.05)
    options = {"dt": 1e-4, "time_constant": 10.0} if formulation == "joints" else {}
    run = runs.build(formulation, by_loop, **options)
    assert run.built().mobility == on_joint.nv
    run.advance(0.05)
    sample = run.sample()
    # soft loops of MuJoCo; second order of Exudyn at 1e-3 s; else the integrator's tolerance: no processor changes them
    position, force = {"joints": (1e-7, 1e-4), "redundant": (1e-6, 1e-4)}.get(formulation, (1e-11, 1e-9))
    assert np.abs(sample.p_WB - truth.p_WB[-1]).max() < position
    found = runs.wrench(sample)[2]
    if formulation == "joints" and kind == "fixed":
        assert np.isnan(found).all()  # a weld's torque is scaled by MuJoCo's own length
    else:
        assert np.abs(found - truth.wrench[-1, 1]).max() < force


# Largest over a grid of times: positions [m], determinate reactions [N, N m]. What the comparisons slider_crank and
# bricard bound as closely is not repeated.
BOUNDS = [
    ("joints", "pendulum", 1.0, {"dt": 1e-3}, 1e-10, 1e-9),
    ("joints", "chain", 0.1, {"dt": 1e-3}, 1e-8, 1e-4),
    ("joints", "gyroscope_cart", 0.1, {"dt": 1e-4}, 1e-11, 1e-8),
    ("redundant", "oscillators", 0.5, {"dt": 1e-3}, 5e-6, 1e-3),
    ("redundant", "andrews_squeezer", 0.002, {"dt": 1e-5}, 2e-6, 0.02),
    ("tree", "chain", 0.1, {"dt": 1e-3}, 1e-11, None),
    ("tree", "oscillators", 0.5, {"dt": 1e-3}, 1e-13, None),
    ("null_space", "bricard", 0.5, {}, 1e-11, 1e-9),
    ("null_space", "gyroscope_cart", 0.1, {}, 1e-11, 1e-9),
    ("null_space", "free_body", 1.0, {}, 1e-11, 1e-9),
    ("constraint_dynamics", "bricard", 0.5, {}, 1e-11, 1e-9),
    ("dependent", "bricard", 0.5, {}, 1e-11, 1e-9),
    ("dependent", "gyroscope_cart", 0.1, {}, 1e-11, 1e-9),
    ("dependent", "free_body", 1.0, {}, 1e-11, 1e-9),
]


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize(("formulation", "name", "until", "options", "position", "reaction"), BOUNDS)
def test_errors_stay_below_what_is_declared(formulation, name, until, options, position, reaction):
    """Positions and determinate reactions of the scenes are as near to the truth as the engine is known to come."""
    mechanism = runs.model(name)
    found = runs.errors(runs.build(formulation, mechanism, **options), mechanism, until)
    assert found[0] < position
    if reaction is not None:
        assert 0 < found[1] < reaction


@pytest.mark.parametrize("formulation", ALL)
def test_a_spring_winds_up_more_than_a_turn(formulation):
    """A torsional spring whose rest is ten radians away turns the wheel there along a cosine."""
    wheel = Body("wheel", 1.0, inertia=(0.1, 0.1, 0.2))
    axle = Joint("axle", "revolute", "world", "wheel", stiffness=20.0, rest=10.0, q0=(0.1,))
    run = runs.build(formulation, Mechanism((wheel,), (axle,)))
    run.advance(0.15)  # 1.5 rad of phase: the wheel has turned by 9.3 rad
    angle = 10 - 9.9 * np.cos(np.sqrt(20.0 / 0.2) * 0.15)
    expected = [np.cos(angle / 2), 0, 0, np.sin(angle / 2)]
    error = min(np.abs(run.sample().q_WB[0] - sign * np.array(expected)).max() for sign in (1, -1))
    assert error < {"joints": 1e-8, "redundant": 1e-3}.get(formulation, 1e-11)  # RK4 and order 2 at 1e-3 s


@pytest.mark.one_in(3)
@pytest.mark.parametrize("formulation", ["joints", "redundant", "null_space", "dependent"])
@pytest.mark.parametrize("name", ["slider_crank", "four_bar", "bricard"])
def test_mobility_is_that_of_the_geometry(formulation, name):
    """However an engine writes its rows, velocities less independent rows leave the mechanism's mobility."""
    mechanism = runs.model(name)
    assert runs.build(formulation, mechanism).built().mobility == analyse(mechanism).mobility


@pytest.mark.parametrize("formulation", ALL)
def test_what_a_formulation_lacks_is_refused_with_the_reason(formulation):
    """Dry friction in a joint is built where it is provided, and refused with a reason elsewhere."""
    wheel = Body("wheel", 1.0, inertia=(0.1, 0.1, 0.2))
    mechanism = Mechanism((wheel,), (Joint("axle", "revolute", "world", "wheel", v0=(1.0,), friction=0.1),))
    engine, _ = runs.settings(formulation)
    if required(mechanism) <= engine.provides[formulation]:
        run = runs.build(formulation, mechanism)
        run.advance(0.1)
        assert run.sample().w_WB[0, 2] == pytest.approx(1 - 0.1 / 0.2 * 0.1, rel=1e-3)  # MuJoCo's friction is soft
    else:
        with pytest.raises(Refused, match="needs dry friction in joints, and "):
            runs.build(formulation, mechanism)


@pytest.mark.parametrize("formulation", ["joints", "null_space", "constraint_dynamics", "dependent"])
def test_the_inertia_of_a_drive_slows_its_coordinate(formulation):
    """A pendulum with an armature swings as the truth says, slower than without."""
    mechanism = runs.model("pendulum")
    geared = replace(mechanism, joints=(replace(mechanism.joints[0], armature=0.2),))
    position, reaction = runs.errors(runs.build(formulation, geared), geared, 0.2)
    assert position < 1e-10
    assert reaction < 1e-8
    plain, slow = (runs.true(each, 0.2)[0].v[-1, 0] for each in (mechanism, geared))
    assert abs(slow) < 0.8 * abs(plain)


@pytest.mark.nightly
def test_a_singular_pose_is_told_with_time_and_pose() -> None:
    """A run whose loops lose a row ends there, before its steps shrink to nothing, and says when and where."""
    run = simulate(load_scene("four_bar", windows=1), "projection", until=1.0)
    assert run.attrs["status"] == "diverged"
    found = re.search(r"a singular pose at t = ([\d.]+) s, .*; q\.A0 = (\S+) rad, q\.B0 = ", run.attrs["message"])
    assert found, run.attrs["message"]
    assert 0.70 < float(found[1]) < 0.72
    assert abs(float(found[2]) + np.pi / 2) < 0.01


@pytest.mark.parametrize(("size", "said"), [(1.0, "at least 1e-15 kg m^2; carriage has 0"), (1e6, "")])
def test_mujoco_names_its_least_inertia(size, said):
    """A body without inertia is refused with MuJoCo's least, where that is not small beside others."""
    carriage = Body("carriage", 0.0, (0.0, 0.0, 0.0), ((0.0,) * 3,) * 3)
    nut = Body("nut", 1e-4 * size, (0.0, 0.0, 0.0), tuple(1.6e-8 * size * np.eye(3)))
    joints = (Joint("slide", "prismatic", "world", "carriage"), Joint("turn", "revolute", "carriage", "nut"))
    mechanism = Mechanism((carriage, nut), joints)
    if said:
        with pytest.raises(Refused, match=re.escape(said)):
            runs.build("joints", mechanism)
    else:
        runs.build("joints", mechanism)


def test_forces_of_soft_loops_differ_as_much_as_softness_says() -> None:
    """A rod near its dead centre moves as with a hard loop, and is pressed by a ten-thousandth less."""
    bodies = (Body("crank", 1.0), Body("arm", 1.0), Body("rod", 1.0, inertia=(0.2, 0.2, 0.2)))
    joints = (
        Joint("pivot", "revolute", "world", "crank", q0=(-1.0,)),
        Joint("elbow", "revolute", "crank", "arm", position=(0.1, -0.2, 0.7), armature=0.2),
        Joint("ball", "spherical", "arm", "rod", position=(-0.3, -0.02, -0.2)),
    )
    end = Loop("end", "spherical", "crank", "rod", position_b=(0.2, 0.22, -0.5))
    servo = Actuator("servo", "pivot", "position", kp=5.0)
    linkage = Mechanism(bodies, joints, (end,), actuators=(servo,), gravity=(0.0, 0.0, -10.0))
    scene = Scene("linkage", "", (MechanismElement(linkage),))
    assert first_difference(certify(build(scene, "mujoco"), scene)) is None
