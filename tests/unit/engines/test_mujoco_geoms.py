"""Bodies that touch in MuJoCo: shapes, the law of each pair, forces, and what is read back."""

from dataclasses import replace

import numpy as np
import pytest

from proofroll.core.engine import EPSILON
from proofroll.core.errors import InputError, Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism, Tree
from proofroll.elements.mechanism.contact.start import touches
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

mujoco = pytest.importorskip("mujoco")

MUJOCO = load_engine("mujoco")
FLOOR = Geometry("floor", "world", "plane", (0, 0, 0.2), normal=(0.1, 0.0, 1.0))
TILTED = (0.1, 0.2, 0.9, 0.9, 0.3, 0.2, 0.1)
G = 9.81


def preset(name="matched", **options):
    """Settings of the formulation geoms."""
    return replace(MUJOCO.presets["geoms"][name], **options)


def free(*geometries, pairs, q0=TILTED, v0=(0,) * 6, gravity=(0, 0, -G), bodies=1):
    """Free bodies b0, b1 … of 2 kg, the second 3 m further, with these geometries and pairs."""
    solid = {"mass": 2.0, "inertia": (0.02, 0.03, 0.04)}
    joints = (
        Joint(f"j{k}", "free", "world", f"b{k}", q0=(q0[0] + 3 * k, *q0[1:]), v0=v0 if not k else (0,) * 6)
        for k in range(bodies)
    )
    names = tuple(Body(f"b{k}", **solid) for k in range(bodies))
    return Mechanism(names, tuple(joints), geometries=geometries, pairs=pairs, gravity=gravity)


def on_floor(*feet, mu=0.3, restitution=0.0, v0=(0,) * 6, height=0.1):
    """A body on spheres of 2 cm at these places under it, ``height`` above a floor at 0."""
    floor = Geometry("floor", "world", "plane")
    spheres = tuple(Geometry(f"f{k}", "b0", "sphere", place, radius=0.02) for k, place in enumerate(feet))
    pairs = tuple(Pair(f"p{k}", (f"f{k}", "floor"), mu, restitution) for k in range(len(feet)))
    return free(floor, *spheres, pairs=pairs, q0=(0, 0, height, 1, 0, 0, 0), v0=v0)


SLED = ((0.15, 0.10, -0.08), (0.15, -0.10, -0.08), (-0.20, 0.03, -0.08))
SHAPES = {
    "sphere": Geometry("shape", "b0", "sphere", (0.1, 0, 0), radius=0.2),
    "vertex": Geometry("shape", "b0", "sphere", (0.1, 0, 0), radius=0.0),
    "ellipsoid": Geometry("shape", "b0", "ellipsoid", (0.1, 0, 0), (0.2, 0.3, 0.4), axes=(0.3, 0.2, 0.1)),
    "circle": Geometry("shape", "b0", "circle", (0.1, 0, 0), radius=0.2, normal=(1, 2, 2)),
    "box": Geometry("shape", "b0", "box", (0.1, 0, 0), (0.2, 0.3, 0.4), size=(0.3, 0.2, 0.1)),
}


def read_back(mechanism, **options):
    """Lines of contact of the certificate: largest relative difference of each."""
    run = MUJOCO.build(mechanism, preset(**options))
    lines = MechanismElement(mechanism).certify(run.built(), run.sample())
    geometry = [line for line in lines if line.quantity != "forces of contact"]
    return {
        line.quantity: line.difference for line in geometry if "contact" in line.quantity or line.quantity == "gaps"
    }


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("order", [("shape", "floor"), ("floor", "shape")])
def test_shapes_over_a_plane_are_read_back(kind, order):
    """Gap, normal, place and friction of every shape over a tilted plane are the scene's, either way round."""
    found = read_back(free(FLOOR, SHAPES[kind], pairs=(Pair("p", order, 0.3),)))
    assert len(found) == 5
    assert max(found.values()) < 1e-9


def test_spheres_and_moving_planes_are_read_back():
    """Two spheres, and a sphere over a plane of a moving body, lie in MuJoCo as in the scene."""
    ball, other = (Geometry(f"s{k}", f"b{k}", "sphere", (0.1, 0, 0), radius=0.2 + 0.1 * k) for k in range(2))
    plane = Geometry("top", "b1", "plane", (-0.5, 0, 0), normal=(-1, 0.2, 0.1))
    pairs = (Pair("two", ("s0", "s1"), 0.2, 0.5), Pair("moving", ("top", "s0"), 0.4))
    found = read_back(free(ball, other, plane, pairs=pairs, bodies=2))
    assert max(found.values()) < 1e-9


def test_wrong_geometry_and_friction_are_told():
    """A foot moved by a millimetre, a normal turned, and friction off by 1 % contradict the certificate."""
    pair = Pair("p", ("shape", "floor"), 0.3)
    mechanism = free(FLOOR, SHAPES["sphere"], pairs=(pair,))
    wrong = {
        "places of contact": free(FLOOR, replace(SHAPES["sphere"], position=(0.1, 0.001, 0)), pairs=(pair,)),
        "normals of contact": free(replace(FLOOR, normal=(0.11, 0, 1.0)), SHAPES["sphere"], pairs=(pair,)),
        "friction of contacts": free(FLOOR, SHAPES["sphere"], pairs=(replace(pair, friction=0.303),)),
        "restitution of contacts": free(FLOOR, SHAPES["sphere"], pairs=(replace(pair, restitution=0.1),)),
    }
    for quantity, other in wrong.items():
        run = MUJOCO.build(other, preset())
        lines = MechanismElement(mechanism).certify(run.built(), run.sample())
        assert quantity in [line.quantity for line in lines if not line.holds], quantity


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", ["sled", "ladder", "free_turntable", "rattleback", "tilted_disc", "flick"])
@pytest.mark.parametrize("settings", ["default", "matched", "tuned"])
def test_the_delassus_matrix_is_read_back(name, settings):
    """What forces on what touches do to its slides is, by MuJoCo's own rows and mass matrix, as in the scene."""
    (element,) = load_scene(name).elements
    run = MUJOCO.build(load_scene(name), preset(settings))
    line = next(item for item in element.certify(run.built(), run.sample()) if item.quantity == "responses of contacts")
    # Near what is seen, 7.2e-11 with every kind of arithmetic that was tried: it is no round-off.
    assert line.difference < 1e-10, line


def test_loops_hold_what_contacts_push():
    """The Delassus matrix is that of bodies which a loop holds together, for MuJoCo's soft loops, too."""
    frame = Geometry("floor", "world", "plane", (0, 0, -0.8))
    tip = Geometry("tip", "link", "sphere", (0.3, 0.0, -0.2), radius=0.1)
    solid = {"mass": 1.0, "inertia": (0.02, 0.02, 0.02)}
    arms = tuple(
        Joint(f"j{k}", "revolute", "world", name, position=(k, 0, 0), axis=(0, 1, 0)) for k, name in enumerate("ab")
    )
    link = Joint("k", "revolute", "a", "link", position=(0, 0, -0.5), axis=(0, 1, 0))
    ends = {"position_a": (0, 0, -0.5), "position_b": (1, 0, 0), "axis_a": (0, 1, 0), "axis_b": (0, 1, 0)}
    loop = Loop("l", "revolute", "b", "link", **ends)
    mechanism = Mechanism(
        (Body("a", **solid), Body("b", **solid), Body("link", **solid)),
        (*arms, link),
        (loop,),
        geometries=(frame, tip),
        pairs=(Pair("p", ("tip", "floor"), 0.3),),
    )
    assert read_back(mechanism)["responses of contacts"] < 1e-9


def test_coefficients_are_those_that_mujoco_uses():
    """A global override of contacts leaves the pairs' own table as it was; the certificate has what is used."""
    mechanism = on_floor(*SLED)
    run = MUJOCO.build(mechanism, preset())
    run._model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    run._model.opt.o_friction[:2], run._model.opt.o_margin = 0.5, 1.0
    assert run._model.pair_friction[:, 0].tolist() == [0.3, 0.3, 0.3]
    assert run.built().contact_friction.tolist() == [0.5, 0.5, 0.5]


def test_geoms_have_no_mass():
    """Mass, centre and inertia stay those of the bodies, whatever is fixed to them."""
    mechanism = free(FLOOR, SHAPES["box"], pairs=(Pair("p", ("shape", "floor"), 0.3),))
    built = MUJOCO.build(mechanism, preset()).built()
    assert built.mass == pytest.approx([2.0], abs=EPSILON["double"])
    np.testing.assert_allclose(built.com, [[0, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(built.inertia, [np.diag((0.02, 0.03, 0.04))], atol=1e-15)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", ["default", "matched", "tuned"])
def test_forces_at_rest_bear_the_weight(name):
    """Forces on the first geometry's body hold it; turned round, the pair tells those on the floor's side."""
    mechanism = on_floor(*SLED)
    run = MUJOCO.build(mechanism, preset(name))
    run.advance(0.5)
    force = run.sample().contact_force
    np.testing.assert_allclose(force.sum(axis=0), (0, 0, 2 * G), atol=1e-4)
    x, y, _ = np.transpose(SLED)
    np.testing.assert_allclose(force[:, 2], np.linalg.solve([np.ones(3), x, y], (2 * G, 0, 0)), atol=1e-2)
    turned = replace(mechanism, pairs=tuple(replace(p, geometries=p.geometries[::-1]) for p in mechanism.pairs))
    run = MUJOCO.build(turned, preset(name))
    run.advance(0.5)
    np.testing.assert_allclose(run.sample().contact_force, -force, atol=1e-9)


def test_only_listed_pairs_touch():
    """A geometry in no pair passes through the floor."""
    mechanism = on_floor(*SLED)
    alone = replace(mechanism, pairs=mechanism.pairs[:1])
    run = MUJOCO.build(alone, preset())
    run.advance(0.3)
    foot = touches(mechanism, Tree(mechanism).at(*mechanism.start()))[1].place
    assert run.sample().p_WB[0, 2] < 0.09
    assert foot[2] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3])
def test_each_pair_has_its_own_friction(mu):
    """What slips straight on loses mu g of its speed each second, with the correction of the cone."""
    run = MUJOCO.build(on_floor(*SLED, mu=mu, v0=(2, 0, 0, 0, 0, 0)), preset("tuned"))
    run.advance(0.3)
    assert run.sample().v_WB[0, 0] == pytest.approx(2 - mu * G * 0.3, abs=5e-3)


def test_a_slip_that_gains_speed_keeps_its_contacts() -> None:
    """What starts to slide down a slope presses with its weight in every step: the lift by the slip's rate is taken."""
    mechanism = replace(on_floor(*SLED), gravity=(G * np.sin(0.5), 0.0, -G * np.cos(0.5)))
    run = MUJOCO.build(mechanism, preset("tuned"))
    run.advance(0.1)
    for step in range(101, 120):
        run.advance(step * 1e-3)
        assert run.sample().contact_force[:, 2].sum() == pytest.approx(2 * G * np.cos(0.5), rel=1e-6)


@pytest.mark.parametrize(
    ("pair", "options", "said"),
    [
        ({"friction": 1e-6}, {}, "raises a coefficient of friction of 1e-06 to 1e-05"),
        ({"friction": 2.0}, {"name": "default"}, "cone=pyramidal with friction above 1"),
        ({"friction": 0.3, "restitution": 0.5}, {"name": "tuned"}, "cone_correction=false"),
    ],
)
def test_what_mujoco_would_change_silently_is_refused(pair, options, said):
    """Coefficients that MuJoCo cannot hold are refused, each with its reason."""
    with pytest.raises(Refused, match=said):
        MUJOCO.build(free(FLOOR, SHAPES["sphere"], pairs=(Pair("p", ("shape", "floor"), **pair),)), preset(**options))


def test_planes_that_move_meet_spheres_alone():
    """A plane of a moving body is a box in MuJoCo, whose contact with an ellipsoid is not exact: it is refused."""
    plane = Geometry("top", "b1", "plane", (-0.5, 0, 0), normal=(-1, 0, 0))
    mechanism = free(SHAPES["ellipsoid"], plane, pairs=(Pair("p", ("shape", "top"), 0.3),), bodies=2)
    with pytest.raises(Refused, match="the plane of p moves with b1"):
        MUJOCO.build(mechanism, preset())


def test_joints_have_no_contact():
    """The formulation joints refuses bodies that touch."""
    with pytest.raises(Refused, match="contact between bodies"):
        MUJOCO.build(on_floor(*SLED), MUJOCO.presets["joints"]["matched"])


def test_a_model_file_holds_geoms_but_no_correction():
    """MJCF has geoms and pairs; the correction of the cone, made in every step, is refused."""
    xml = MUJOCO.model_file(on_floor(*SLED), preset())
    assert xml.count("<pair ") == 3
    with pytest.raises(Refused, match="cone_correction=false"):
        MUJOCO.model_file(on_floor(*SLED), preset("tuned"))


def test_a_short_step_starts_as_the_scene_does():
    """The gap below which MuJoCo has a contact pushes less than a thousandth of gravity, however stiff the contact."""
    (element,) = load_scene("inclined_plane").elements
    run = MUJOCO.build(load_scene("inclined_plane"), preset("tuned", dt=1e-5))
    assert [str(line) for line in element.certify(run.built(), run.sample()) if not line.holds] == []


@pytest.mark.parametrize("name", ["default", "matched"])
def test_touching_bodies_without_weight_are_certified(name):
    """Balls that touch and nothing pulls are pushed apart by the round-off of their gap, which is no wrong model."""
    (element,) = load_scene("cradle").elements
    run = MUJOCO.build(load_scene("cradle"), preset(name))
    assert [str(line) for line in element.certify(run.built(), run.sample()) if not line.holds] == []


def damped_slider(kd, damping, *, contact=True, armature=0.01):
    """A slider of 2 kg that reaches the floor at 1 m/s, the speed of its servo, through a gear of 2."""
    shapes = {
        "geometries": (Geometry("floor", "world", "plane"), Geometry("ball", "b", "sphere", radius=0.1)),
        "pairs": (Pair("touch", ("ball", "floor"), 0.0),),
    }
    laws = {"damping": damping, "armature": armature, "torque": -damping}
    joint = Joint("z", "prismatic", "world", "b", axis=(0, 0, 1), q0=(0.1 - 1e-9,), v0=(-1.0,), **laws)
    servo = (Actuator("servo", "z", "velocity", target=-2.0, kd=kd, gear=2.0),) if kd else ()
    body = Body("b", mass=2.0 - armature, inertia=(0.02, 0.02, 0.02))
    return Mechanism((body,), (joint,), actuators=servo, gravity=(0, 0, 0), **(shapes if contact else {}))


def stopped(mechanism, settings):
    """Speed after the step in which a slider meets the floor [m/s]."""
    run = MUJOCO.build(mechanism, settings)
    run.advance(settings.dt)
    return abs(float(run.sample().v_WB[0, 2]))


@pytest.mark.parametrize(("kd", "damping"), [(500.0, 0.0), (0.0, 2000.0), (250.0, 1000.0)])
def test_contacts_see_the_armature_of_damping(kd, damping):
    """Contacts leave h c/(m + h c) of the speed with implicit damping of servos and joints, tuned leaves none."""
    h, c = 1e-3, 4 * kd + damping
    slider = damped_slider(kd, damping)
    keeps = h * c / (2.0 + h * c)
    assert stopped(slider, preset(dt=h, integrator="implicitfast")) == pytest.approx(keeps, rel=1e-3)
    assert stopped(slider, preset("tuned", dt=h)) < 1e-3 * keeps


def test_the_armature_of_damping_is_the_implicit_step():
    """Without contact the step is MuJoCo's implicit one to round-off, and forces of a state are those without it."""
    robot = damped_slider(30.0, 5.0, contact=False)
    robot = replace(robot, joints=(replace(robot.joints[0], v0=(0.3,)),))
    usual = replace(MUJOCO.presets["joints"]["tuned"], integrator="Euler")
    runs = [MUJOCO.build(robot, replace(usual, **more)) for more in ({"damping_armature": True}, {}, {})]
    runs[2] = MUJOCO.build(robot, replace(usual, integrator="implicitfast"))
    assert runs[0].built().acceleration == pytest.approx(runs[1].built().acceleration, rel=1e-13)
    for run in runs:
        run.advance(0.1)
    speeds = [float(run.sample().v_WB[0, 2]) for run in runs]
    assert speeds[0] == pytest.approx(speeds[2], rel=1e-12)
    assert runs[0].built().acceleration == pytest.approx(runs[2].built().acceleration, rel=1e-9)


def test_the_armature_of_damping_needs_euler():
    """Other integrators are refused, for they damp by themselves."""
    for settings, said in (
        (preset("tuned", integrator="implicitfast", cone_correction=False), "needs integrator=Euler"),
        (preset("default", integrator="implicitfast", eulerdamp=False), "implicitfast does not use it"),
    ):
        with pytest.raises(InputError, match=said):
            MUJOCO.build(damped_slider(1.0, 0.0), settings)


@pytest.mark.drill
def test_what_sticks_is_not_lifted_by_the_correction_of_the_cone():
    """A ball that rolls on a turning table presses with its weight: no friction is missed, and none is corrected."""
    scene = load_scene("free_turntable")
    for dt in (2e-3, 1e-3):
        run = simulate(scene, "mujoco[formulation=geoms]", until=0.2, every=0.05, preset="tuned", dt=dt)
        assert np.abs(run["normal_forces"][1:] - 0.3 * G).max() < 1e-3  # 0.71 N where it was lifted in every other step


@pytest.mark.parametrize(("speed", "dt"), [(12.8, 1e-3), (200.0, 6e-6)])
def test_a_fast_ball_in_a_bore_is_certified(speed, dt):
    """A ball as deep in its wall as its load asks slips by that depth, with J̇v, too; that is no wrong model."""
    scene = load_scene("sphere_in_cylinder", speed=speed)
    run = MUJOCO.build(scene, preset("tuned", dt=dt))
    assert [str(line) for line in scene.elements[0].certify(run.built(), run.sample()) if not line.holds] == []
