"""Both routes of the truth against each other and against digits agreed by independent programs."""

from dataclasses import replace
from itertools import count

import mechanism_examples
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lone_routes import by_bodies, by_joints, by_series
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism, Tree
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.record import record_of
from proofroll.elements.mechanism.reading.assembly import check_start
from proofroll.elements.mechanism.scene.joint_kinds import FACTS, WITH_AXIS
from proofroll.elements.mechanism.scene.rotations import to_rpy
from proofroll.truth.bodies.maximal_bodies import Planar, made_bodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates

# What independent programs (Pinocchio, heyoka, closed forms) agree on: end time, point, its place, tolerance.
# The tolerances are what those programs differ by among each other, twice; of the free body, which magnifies
# round-off, ten times.
AGREED = {
    "pendulum": (10.0, {}, (0.346437135939026, 0.938073190556607, 0.0), 3e-12),
    "double_pendulum": (1.0, {}, (-1.750528895256390, -0.961284660281620, 0.0), 2e-13),
    "free_body": (10.0, {}, (-0.709533805150226, -0.035489134140886, 0.703777166940625), 2e-11),
    "slider_crank": (1.0, {}, (0.406696428168407, 0.0, 0.0), 2e-13),
    "four_bar": (0.5, {"windows": 1}, (0.701512678910477, 0.712656973113886, 0.0), 2e-13),
    "oscillators": (1.0, {}, (0.135757161259753, 0.0, 0.0), 2e-15),
}


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", AGREED)
def test_tracked_point_is_where_independent_programs_agree(scene, name):
    """Taylor series in maximal coordinates reach the agreed digits."""
    pytest.importorskip("heyoka")
    end, parameters, place, tolerance = AGREED[name]
    mechanism = scene(name, **parameters)
    record = by_series(MaximalCoordinates(mechanism), np.array([end]))
    assert placed(mechanism, record).points[0, 0] == pytest.approx(place, abs=tolerance)


def placed(mechanism, record):
    """Where everything is, by the poses that a route recorded."""
    return Placed(mechanism, record.time, record.p_WB, record.v_WB, record.w_WB, record.q_WB)


def apart(one, two, mask):
    """Largest differences of positions, attitudes and determinate reactions."""
    attitude = np.minimum(np.abs(one.q_WB - two.q_WB).max(axis=-1), np.abs(one.q_WB + two.q_WB).max(axis=-1))
    wrench = np.abs(one.wrench - two.wrench)[:, mask]
    return np.abs(one.p_WB - two.p_WB).max(), attitude.max(), wrench.max()


# A tree in space, each way to close loops, many bodies, and what is nearly singular; other scenes' routes are held
# against each other wherever their truth is found. Short, so that the slow route stays fast; the reactions scale with
# the forces of each scene.
SHORT = {
    "heavy_top": (0.2, 1e-10),
    "slider_crank": (0.2, 1e-10),
    "bricard": (0.3, 1e-9),
    "chain": (0.1, 1e-10),
    "gyroscope_cart": (0.1, 1e-10),
}


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("bricard", "chain")
@pytest.mark.parametrize("name", SHORT)
def test_both_routes_agree(scene, name):
    """Motion within 1e-11 m and 1, and every determinate component of every reaction."""
    pytest.importorskip("heyoka")
    end, of_forces = SHORT[name]
    mechanism = scene(name)
    times = np.array([0.0, end / 2, end])
    one = by_joints(mechanism, times)
    two = by_series(MaximalCoordinates(mechanism), times)
    place, attitude, wrench = apart(one, two, analyse(mechanism).determinate)
    assert place < 1e-11
    assert attitude < 1e-11
    assert wrench < of_forces
    energy = placed(mechanism, one).energy()
    assert np.abs(energy - placed(mechanism, two).energy()).max() < 1e-11 * max(1.0, np.abs(energy).max())


@pytest.mark.drill
def test_maximal_coordinates_without_taylor_series(scene):
    """DOP853 with projection of the same rows gives the same motion, redundant rows included."""
    mechanism = scene("bricard")
    times = np.array([0.0, 0.05])
    one = by_joints(mechanism, times)
    two = by_bodies(MaximalCoordinates(mechanism), times)
    assert max(apart(one, two, analyse(mechanism).determinate)[:2]) < 1e-12
    assert two.residual.max() < 1e-13


@pytest.mark.drill
def test_routes_agree_on_every_kind_of_joint():
    """A tree with planar, universal, prismatic, spherical, free and fixed joints moves alike by both routes."""
    mechanism = replace(mechanism_examples.every_kind(), loops=())
    times = np.array([0.0, 0.02])
    one, two = by_joints(mechanism, times), by_bodies(MaximalCoordinates(mechanism), times)
    place, attitude, wrench = apart(one, two, analyse(mechanism).determinate)
    assert max(place, attitude) < 1e-12
    assert wrench < 1e-10
    assert np.abs(one.v - two.v).max() < 1e-11


@pytest.mark.one_in(3)
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "fixed"])
def test_routes_agree_on_every_kind_of_loop(kind):
    """A loop of each kind between two branches in space, reactions included; the root is free, so nothing hides."""
    tree = mechanism_examples.every_kind()
    still = replace(tree, loops=(), joints=tuple(replace(j, v0=(0.0,) * j.nv) for j in tree.joints))
    motion = Tree(still).at(*still.start())
    (p_a, R_a), (p_b, R_b) = ((motion.p_WB[i], motion.R_WB[i]) for i in (4, 5))
    at, axis = np.array([0.3, 0.2, 0.1]), np.array([0.6, 0.0, 0.8])
    world_axis = R_a @ ([0.0, 1.0, 0.0] if kind == "universal" else axis)
    loop = Loop(
        "loop",
        kind,
        "b4",
        "b5",
        tuple(at),
        tuple(R_b.T @ (p_a + R_a @ at - p_b)),
        tuple(axis),
        tuple(R_b.T @ world_axis),
        to_rpy(R_a.T @ R_b),
    )
    mechanism = replace(still, loops=(loop,))
    check_start(mechanism)
    times = np.array([0.0, 0.005])
    one, two = by_joints(mechanism, times), by_bodies(MaximalCoordinates(mechanism), times)
    place, attitude, wrench = apart(one, two, analyse(mechanism).determinate)
    assert max(place, attitude) < 1e-12
    assert wrench < 1e-10 * max(1.0, np.abs(one.wrench).max())
    assert max(one.residual.max(), two.residual.max()) < 1e-12


def moved(joint, time):
    """Turn and slide of a child in its frame at zero, a time after the start at the first rates of its joint."""
    q, v, turn = np.array(joint.q0), np.array(joint.v0), Rotation.from_rotvec
    z = np.array(joint.axis) / np.linalg.norm(joint.axis)
    x = np.array(joint.second_axis or np.cross(z, np.eye(3)[np.argmin(np.abs(z))]))
    x, none = (x - z * (z @ x)) / np.linalg.norm(x - z * (z @ x)), np.zeros(3)
    if joint.kind in {"spherical", "free"}:
        whole = Rotation.from_quat(q[-4:], scalar_first=True)
        return whole * turn(v[-3:] * time), q[:3] + whole.apply(v[:3]) * time if joint.kind == "free" else none
    q = q + v * time
    return {
        "fixed": lambda: (turn(none), none),
        "revolute": lambda: (turn(q[0] * z), none),
        "prismatic": lambda: (turn(none), q[0] * z),
        "cylindrical": lambda: (turn(q[1] * z), q[0] * z),
        "universal": lambda: (turn(q[0] * z) * turn(q[1] * x), none),
        "planar": lambda: (turn(q[2] * z), q[0] * x + q[1] * np.cross(z, x)),
    }[joint.kind]()


def by_definition(mechanism, time):
    """Rotations and places of the bodies of a chain, a time after the start at the first rates of its joints."""
    turns, places = [Rotation.identity()], [np.zeros(3)]
    for joint in mechanism.joints:
        turned, slid = moved(joint, time)
        at_zero = turns[-1] * Rotation.from_euler("xyz", joint.orientation)
        places.append(places[-1] + turns[-1].apply(joint.position) + at_zero.apply(slid))
        turns.append(at_zero * turned)
        places[-1] -= turns[-1].apply(joint.child_position)
    return Rotation.concatenate(turns[1:]), np.array(places[1:])


numbers = st.floats(-1.2, 1.2)
vectors = st.tuples(numbers, numbers, numbers)


@st.composite
def turned_joints(draw, kind, name, parent, along=None):
    """A joint whose frames, places, coordinates and rates are any; ``along``: its axis in the world at q = 0."""
    orientation = draw(vectors)
    axis = np.array(draw(vectors.filter(lambda v: np.linalg.norm(v) > 0.1)))
    if along is not None:
        before, way = along
        axis = (before * Rotation.from_euler("xyz", orientation)).inv().apply(way)
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    facts = FACTS[kind]
    q = np.array(draw(st.tuples(*[numbers] * facts.nq)))
    if facts.nq >= 4:
        q[-4:] += [2.0, 0.0, 0.0, 0.0]  # no quaternion of zeros
        q[-4:] /= np.linalg.norm(q[-4:])
    options = {"axis": tuple(axis)} if kind in WITH_AXIS else {}
    options |= {"second_axis": tuple(across)} if kind in {"universal", "planar"} else {}
    rates = draw(st.tuples(*[numbers] * facts.nv))
    there = draw(vectors)
    return Joint(name, kind, parent, name, draw(vectors), orientation, child_position=there, q0=tuple(q), v0=rates,
                 **options)  # fmt: skip


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("kind", "in_plane"), [*((kind, False) for kind in FACTS), ("revolute", True), ("planar", True)]
)
@settings(max_examples=4)
@given(st.data())
def test_both_routes_start_where_a_joints_definition_says(kind, in_plane, data):
    """Poses, velocities and spins of two bodies on turned frames at time 0: by formulas of their own."""
    first = data.draw(turned_joints("revolute", "a", "world"))
    before = Rotation.from_euler("xyz", first.orientation)
    along = (before, before.apply(first.axis)) if in_plane else None
    second = data.draw(turned_joints(kind, "b", "a", along))
    mechanism = Mechanism(tuple(Body(name, **mechanism_examples.SOLID) for name in "ab"), (first, second))
    if in_plane:
        assert {type(body) for body in made_bodies(mechanism, allow_planar=True)} == {Planar}
    h = 1e-5
    (turns, places), (later, there), (earlier, here) = (by_definition(mechanism, time) for time in (0.0, h, -h))
    rates, spins = (there - here) / (2 * h), (later * earlier.inv()).as_rotvec() / (2 * h)
    equations = JointCoordinates(mechanism)
    one = record_of(np.zeros(1), [equations.sample(*mechanism.start())])
    for record in (one, MaximalCoordinates(mechanism).at_start()):
        apart = Rotation.from_quat(record.q_WB[0], scalar_first=True) * turns.inv()
        assert max(np.abs(record.p_WB[0] - places).max(), apart.magnitude().max()) < 1e-13
        assert max(np.abs(record.v_WB[0] - rates).max(), np.abs(record.w_WB[0] - spins).max()) < 1e-8


@pytest.mark.drill
def test_springs_and_dampers_along_joints_act_alike():
    """Springs, dampers and drives along all kinds of coordinates that may have them, in both routes."""
    body = {"mass": 1.0, "com": (0.1, 0.2, -0.3), "inertia": (0.1, 0.2, 0.25)}
    laws = {"stiffness": 3.0, "rest": 0.1, "damping": 0.4}
    mechanism = Mechanism(
        bodies=(Body("a", **body), Body("b", **body), Body("c", **body)),
        joints=(
            Joint("u", "universal", "world", "a", axis=(1, 0, 1), q0=(0.3, 0.2), v0=(1, -2), **laws),
            Joint("s", "spherical", "a", "b", (0, 0, -0.5), v0=(1, 2, 3), damping=0.3),
            Joint("p", "prismatic", "b", "c", (0, 0, -0.5), (0.2, 0.3, 0), (1, 2, 0), v0=(1,), torque=0.7, **laws),
        ),
    )
    times = np.array([0.0, 0.1])
    one, two = by_joints(mechanism, times), by_bodies(MaximalCoordinates(mechanism), times)
    assert max(apart(one, two, analyse(mechanism).determinate)) < 1e-10
    energy = placed(mechanism, one).energy()
    assert energy == pytest.approx(placed(mechanism, two).energy(), abs=1e-11)
    assert energy[1] < energy[0]


@pytest.mark.drill
def test_energy_counts_the_springs_of_universal_joints():
    """What moves without a damper keeps its energy, that of both springs of a universal joint included."""
    body = Body("a", 1.0, (0.1, 0.2, -0.3), (0.1, 0.2, 0.25))
    spring = {"stiffness": 3.0, "rest": 0.1}
    joint = Joint("u", "universal", "world", "a", axis=(1, 0, 1), q0=(0.3, 0.2), v0=(1, -2), **spring)
    mechanism = Mechanism(bodies=(body,), joints=(joint,))
    energy = placed(mechanism, by_joints(mechanism, np.linspace(0, 1, 11))).energy()
    assert np.ptp(energy) < 1e-12


def test_series_are_in_long_doubles(scene):
    """Digits that doubles do not have come back where a step is taken again."""
    pytest.importorskip("heyoka")
    route = MaximalCoordinates(scene("double_pendulum"))
    states = route.taylor_states(np.array([0.0, 2.0]))
    assert states.dtype == np.longdouble
    assert 0 < np.abs(states - states.astype(float)).max() < 1e-14


@pytest.mark.drill
def test_steps_of_many_bodies_do_not_chase_round_off(scene, monkeypatch):
    """Twenty links take some thousand evaluations, though the tolerance lies below the noise of their accelerations."""
    evaluations = count(1)
    rate = JointCoordinates.rate
    monkeypatch.setattr(JointCoordinates, "rate", lambda *args: (next(evaluations), rate(*args))[1])
    by_joints(scene("chain", links=20), np.array([0.05]), 1e-15)
    assert next(evaluations) < 1500
