"""Balls, boxes and capsules on solids: rest, borders that are passed, impacts anywhere, and what is not followed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.rotations import to_rpy
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.truth_of_mechanism import truth_of

MASS, GRAVITY = 2.0, 9.81
RADIUS, SPEED = 0.1, 0.3  # of the ball
HALF, ACROSS, FAST = 0.05, 0.012, 0.9  # half the height of box and rod, the rod's moment, and how fast they slide
TURN = Rotation.from_rotvec([0.3, -0.7, 0.5])
AXES = TURN.as_matrix()
BARS = 1e-11  # 5e-13 is seen
SMALL, LARGE = (0.2, 0.1, 2 * HALF), (1.0, 0.3, 0.2)
TOP = {
    "box": {"size": (1.0, 1.0, 1.0), "orientation": to_rpy(AXES)},
    "cylinder": {"radius": 0.5, "length": 1.0, "axis": tuple(AXES[:, 2])},
}
ROD = Geometry("upper", "body", "capsule", radius=HALF, length=0.3, axis=(1, 0, 0))


def turned(vector: Any) -> tuple[float, float, float]:
    """A vector given in turned axes, in the world's."""
    x, y, z = (AXES @ np.asarray(vector, dtype=float)).tolist()
    return x, y, z


def inertia(size: Any) -> Any:
    """Principal moments of a solid box."""
    a, b, c = size
    return tuple(MASS * (p**2 + q**2) / 12 for p, q in ((b, c), (a, c), (a, b)))


def free(
    shape: Geometry, solid: Geometry, moments: Any, place: Any, v: Any = (0, 0, 0), w: Any = (0, 0, 0),
    turn: Any = (0, 0, 0), **law: float,
) -> Mechanism:  # fmt: skip
    """A free body beside a fixed solid; place and motion in turned axes, where gravity is along -z; ``turn``: of it."""
    attitude = TURN * Rotation.from_rotvec(turn)
    velocity = attitude.inv().apply(turned(v)).tolist()
    q = attitude.as_quat(scalar_first=True).tolist()
    return Mechanism(
        (Body("body", MASS, inertia=moments),),
        (Joint("j", "free", "world", "body", q0=(*turned(place), *q), v0=(*velocity, *w)),),
        gravity=turned((0, 0, -GRAVITY)),
        geometries=(shape, solid),
        pairs=(Pair("touch", (shape.name, solid.name), **({"friction": 0.0} | law)),),
    )


def ball_on(solid: Geometry, place: Any, v: Any, w: Any = (0, 0, 0), **law: float) -> Mechanism:
    """A ball beside a fixed solid."""
    ball = Geometry("ball", "body", "sphere", radius=RADIUS)
    return free(ball, solid, (0.4 * MASS * RADIUS**2,) * 3, place, v, w, **law)


def base(size: Any = LARGE) -> Geometry:
    """A fixed box whose upper face ends at x = 0."""
    return Geometry("lower", "world", "box", turned((-size[0] / 2, 0, -size[2] / 2)), to_rpy(AXES), size=size)


def on_box(place: Any, v: Any = (0, 0, 0), size: Any = SMALL, below: Any = LARGE, **law: Any) -> Mechanism:
    """A box above a fixed one of size ``below``."""
    return free(Geometry("upper", "body", "box", size=size), base(below), inertia(size), place, v, **law)


def rod_on_box(place: Any, v: Any = (0, 0, 0), rod: Geometry = ROD) -> Mechanism:
    """A capsule above a fixed box."""
    return free(rod, base((1.0, 0.6, 0.2)), (ACROSS,) * 3, place, v)


def followed(mechanism: Mechanism, times: Any) -> TwoRouteMotion:
    """Truth to the last time, whose bars are narrow."""
    found = truth_of(mechanism, np.array(times))
    assert np.isinf(found.horizon), found.reason
    assert max(float(np.nanmax(found.bars[name])) for name in ("p_WB", "v_WB", "w_WB")) < BARS
    return found


def top(kind: Any) -> Geometry:
    """A solid whose upper end or face is at height 0."""
    return Geometry("solid", "world", kind, position=turned((0, 0, -0.5)), **TOP[kind])  # type: ignore[arg-type]


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("0.0-cylinder", "inf-box")
@pytest.mark.parametrize("kind", TOP)
@pytest.mark.parametrize("friction", [0.0, np.inf])
def test_a_ball_leaves_an_edge_where_its_load_ends(kind: Any, friction: float) -> None:
    """It slides or rolls over an edge or rim and leaves where g cos θ = v²/r, by the balance of energy on the edge."""
    carried = 1.0 if friction else 0.0  # a ball that slides does not spin
    share = 1 + 0.4 * carried
    mechanism = ball_on(
        top(kind), (0.45, 0, RADIUS), (SPEED, 0, 0), (0, carried * SPEED / RADIUS, 0), friction=friction
    )
    (left,) = followed(mechanism, [0.0, 0.4]).events
    cosine = (SPEED**2 / (GRAVITY * RADIUS) + 2 / share) / (1 + 2 / share)
    at = followed(mechanism, [0.0, left.time]).record.p_WB[-1, 0] @ AXES
    assert left.kind == "lift_off"
    assert at[2] == pytest.approx(RADIUS * cosine, abs=1e-12)
    assert at[0] == pytest.approx(0.5 + RADIUS * np.sqrt(1 - cosine**2), abs=1e-12)


@pytest.mark.drill
def test_a_ball_on_a_face_moves_as_on_a_plane() -> None:
    """On a face of a box, which it does not leave, it slides, spins and rolls as on a plane."""
    plane = Geometry("solid", "world", "plane", normal=turned((0, 0, 1)))
    motions = [
        followed(ball_on(solid, (0, 0.1, RADIUS), (0.8, 0.1, 0), (3, -4, 2), friction=0.4), np.linspace(0, 0.4, 9))
        for solid in (top("box"), plane)
    ]
    box, flat = (motion.record for motion in motions)
    assert [event.kind for event in motions[0].events] == [event.kind for event in motions[1].events] == ["stick"]
    for name in ("p_WB", "v_WB", "w_WB"):
        np.testing.assert_allclose(getattr(box, name), getattr(flat, name), rtol=0, atol=1e-13)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("aside", [(0.06, 0.0), (0.05, 0.07)])
def test_a_ball_that_drops_on_an_edge_or_corner_rebounds_along_the_line_to_it(aside: tuple[float, float]) -> None:
    """Its centre aside of an edge, or of a corner, sets the normal of the impact: v' = v - (1 + e)(v·n)n."""
    n = np.array([*aside, np.sqrt(RADIUS**2 - aside[0] ** 2 - aside[1] ** 2)]) / RADIUS
    beyond = (0.5 if aside[1] else 0.2) + aside[1]
    found = followed(ball_on(top("box"), (0.5 + aside[0], beyond, 0.3), (0, 0, -1.0), restitution=0.6), [0.0, 0.3])
    height = 0.3 - RADIUS * n[2]
    at = (np.sqrt(1 + 2 * GRAVITY * height) - 1) / GRAVITY
    v = np.array([0, 0, -1 - GRAVITY * at])
    after = v - 1.6 * (v @ n) * n - [0, 0, GRAVITY * (0.3 - at)]
    assert [event.kind for event in found.events] == ["impact"]
    assert found.events[0].time == pytest.approx(at, abs=1e-13)
    np.testing.assert_allclose(found.record.v_WB[-1, 0] @ AXES, after, rtol=0, atol=1e-12)


def rods(shapes: tuple[Geometry, Geometry], friction: float = 0.3) -> Mechanism:
    """Two bodies in free space that meet as they turn."""
    bodies = (Body("a", 1.0, inertia=(0.02, 0.03, 0.01)), Body("b", 2.0, inertia=(0.05, 0.03, 0.04)))
    q = TURN.as_quat(scalar_first=True).tolist()
    joints = (
        Joint("ja", "free", "world", "a"),
        Joint("jb", "free", "world", "b", q0=(0.02, 0.05, 0.3, *q), v0=(-0.9, 0.3, -1.9, 0.4, -1.0, 0.7)),
    )
    pair = Pair("touch", ("one", "two"), friction, 0.5)
    return Mechanism(bodies, joints, gravity=(0, 0, 0), geometries=shapes, pairs=(pair,))


@pytest.mark.drill
def test_two_capsules_strike_as_two_balls_at_their_nearest_points() -> None:
    """Where sides that cross touch, the impact with friction is that of two balls there, and it stays in momentum."""
    sides = (
        Geometry("one", "a", "capsule", radius=0.05, length=0.6, axis=(1, 0, 0)),
        Geometry("two", "b", "capsule", radius=0.04, length=0.5, axis=(0, 1, 0)),
    )
    crossed = rods(sides)
    (event,) = followed(crossed, [0.0, 0.2]).events
    assert event.kind == "impact"
    touching = followed(crossed, [0.0, event.time]).record
    (pa, pb), (Ra, Rb) = touching.p_WB[-1], Rotation.from_quat(touching.q_WB[-1], scalar_first=True).as_matrix()
    u, w = Ra[:, 0], Rb[:, 1]
    s, t = np.linalg.lstsq(np.array([u, -w]).T, pb - pa, rcond=None)[0]
    assert abs(s) < 0.3
    assert abs(t) < 0.25
    balls = (
        Geometry("one", "a", "sphere", position=(float(s), 0, 0), radius=0.05),
        Geometry("two", "b", "sphere", position=(0, float(t), 0), radius=0.04),
    )
    one, two = (followed(each, [0.0, event.time + 0.01]).record for each in (crossed, rods(balls)))
    for name in ("p_WB", "v_WB", "w_WB"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=0, atol=1e-12)
    momentum = [each @ [1.0, 2.0] for each in np.moveaxis(one.v_WB, 1, -1)]
    np.testing.assert_allclose(momentum[0], momentum[1], rtol=0, atol=1e-13)


@pytest.mark.drill
def test_a_capsule_without_length_is_a_ball() -> None:
    """A ball rolls over a capsule of a length of round-off, across its side, as over a ball of its radius."""
    shapes = (
        Geometry("solid", "world", "capsule", radius=0.4, length=1e-15, axis=turned((1, 0, 0))),
        Geometry("solid", "world", "sphere", radius=0.4),
    )
    start = (-0.5 * np.sin(0.1), 0, 0.5 * np.cos(0.1))
    v = 0.8 * np.array([np.cos(0.1), 0, np.sin(0.1)])
    one, two = (followed(ball_on(shape, start, v, (0, 8.0, 0), friction=0.8), [0.0, 0.1, 0.2]) for shape in shapes)
    assert one.record.p_WB[0, 0] @ AXES[:, 0] < 0 < one.record.p_WB[-1, 0] @ AXES[:, 0]
    np.testing.assert_allclose(one.record.p_WB, two.record.p_WB, rtol=0, atol=1e-13)
    np.testing.assert_allclose(one.record.w_WB, two.record.w_WB, rtol=0, atol=1e-12)


@pytest.mark.drill
def test_capsules_that_come_to_lie_along_each_other_end_the_truth_with_the_reason() -> None:
    """A rod that lands parallel on another one has no one point of contact."""
    shapes = (
        Geometry("one", "a", "capsule", radius=0.05, length=0.6, axis=(1, 0, 0)),
        Geometry("two", "world", "capsule", radius=0.05, length=0.6, axis=(1, 0, 0)),
    )
    body, joint = (
        Body("a", 1.0, inertia=(0.02, 0.03, 0.01)),
        Joint("j", "free", "world", "a", q0=(0.1, 0, 1, 1, 0, 0, 0)),
    )
    mechanism = Mechanism((body,), (joint,), geometries=shapes, pairs=(Pair("touch", ("one", "two"), 0.3),))
    assert "the capsules of touch touch along a line at t = 0.428" in truth_of(mechanism, np.array([0.0, 1.0])).ended


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("size", "below", "closed"),
    [
        (SMALL, LARGE, (0, 1, 2, 3)),  # corners of the upper one
        (LARGE, SMALL, (4, 5, 6, 7)),  # of the lower one
        ((0.8, 0.1, 0.1), (0.2, 0.6, 0.2), (10, 11, 14, 15)),  # a plank across a beam: edges that cross
    ],
)
def test_a_box_on_a_box_rests(size: Any, below: Any, closed: tuple[int, ...]) -> None:
    """The sum of the forces is its weight, and what presses are the corners of where both faces overlap."""
    mechanism = on_box((-below[0] / 2, 0, size[2] / 2), size=size, below=below, friction=0.4)
    found = followed(mechanism, [0.0, 0.5])
    assert found.events == ()
    assert found.sums is not None
    np.testing.assert_allclose(found.sums[-1, 0] @ AXES, [0, 0, MASS * GRAVITY], rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.record.p_WB[1], found.record.p_WB[0], rtol=0, atol=1e-14)
    assert found.pressed is not None
    loose = np.isnan(found.pressed[-1, :, :3]).any(axis=1)  # of a load that corners share none is determinate
    assert set(np.flatnonzero(loose)) <= set(closed)


@pytest.mark.drill
def test_a_capsule_rests_on_a_face() -> None:
    """Both ends bear half of its weight."""
    across = replace(ROD, axis=(0, 1, 0))
    found = followed(rod_on_box((-0.5, 0, HALF), rod=across), [0.0, 0.3])
    assert found.events == ()
    assert found.pressed is not None
    loads = found.pressed[-1, :, :3] @ AXES[:, 2]
    assert loads[:2] == pytest.approx([MASS * GRAVITY / 2] * 2, abs=1e-11)
    assert not np.nan_to_num(loads[2:]).any()


def over_the_rim(times: Any, moment: float) -> Any:
    """Place, in the plane of motion, and turn of a body whose centre passes a rim without friction at time 0.

    Coordinates are its turn, and the place of its centre along its lower face from the rim; (times, 3).
    """

    def rates(_: float, y: Any) -> list[float]:
        turn, along, w, u = y
        matrix = [[1, HALF, 0], [0, -along, -1 / MASS], [0, moment, -along]]
        right = [along * w**2 + GRAVITY * np.sin(turn), (u + HALF * w) * w + u * w - GRAVITY * np.cos(turn), 0]
        slide, turning, _force = np.linalg.solve(matrix, right)
        return [w, u, turning, slide]

    solved = solve_ivp(rates, (0, times[-1]), [0, 0, 0, FAST], "DOP853", times, rtol=1e-13, atol=1e-15)
    turn, along = solved.y[:2]
    x, z = along * np.cos(turn) + HALF * np.sin(turn), HALF * np.cos(turn) - along * np.sin(turn)
    return np.array([x, z, turn]).T


@pytest.mark.nightly
def test_a_box_that_slides_over_a_rim_tips_when_its_centre_passes_it() -> None:
    """Its leading corners end at the rim, where edges cross; it tips about these as an independent solver says."""
    start, since = -0.12, np.array([0.0, 0.03, 0.06, 0.09])
    passes = -start / FAST
    found = followed(on_box((start, 0, HALF), (FAST, 0, 0)), [0.0, *(passes + since)])
    events = [(event.kind, event.name, event.time) for event in found.events]
    assert [event[:2] for event in events] == [("lift_off", f"touch.{k}") for k in (3, 4, 1, 2)]
    assert [event[2] for event in events] == pytest.approx([0.02 / FAST] * 2 + [passes] * 2, abs=1e-12)
    expected = over_the_rim(since, inertia(SMALL)[1])
    place = found.record.p_WB[1:, 0] @ AXES
    np.testing.assert_allclose(place[:, [0, 2]], expected[:, :2], rtol=0, atol=1e-11)
    attitude = TURN * Rotation.from_rotvec(np.outer(expected[:, 2], [0, 1, 0]))
    measured = Rotation.from_quat(found.record.q_WB[1:, 0], scalar_first=True)
    assert (attitude.inv() * measured).magnitude().max() < 1e-11


@pytest.mark.nightly
def test_a_rod_that_slides_over_a_rim_tips_on_it_and_leaves_by_its_end() -> None:
    """Its side crosses the edge where its middle passes; an independent solver moves it so until its end passes."""
    start, since = -0.02, np.array([0.0, 0.05, 0.1, 0.15])
    passes = -start / FAST
    found = followed(rod_on_box((start, 0, HALF), (FAST, 0, 0)), [0.0, *(passes + since), passes + 0.19])
    assert [event.kind for event in found.events] == ["lift_off", "lift_off"]
    assert found.events[0].time == pytest.approx(passes, abs=1e-12)
    place = found.record.p_WB[1:-1, 0] @ AXES
    np.testing.assert_allclose(place[:, [0, 2]], over_the_rim(since, ACROSS)[:, :2], rtol=0, atol=1e-11)


@pytest.mark.nightly
def test_edges_that_cross_rebound_from_each_other() -> None:
    """An edge below that falls across an edge above rebounds by its restitution, v' = -e v, without turning."""
    across = Rotation.from_rotvec([np.pi / 4, 0, 0])
    size, side = (0.5, 0.1, 0.1), 0.1 / np.sqrt(2)
    roof = TURN * Rotation.from_rotvec([0, np.pi / 4, 0])
    falling = on_box((0, 0, 2 * side + 0.005), size=size, turn=across.as_rotvec(), restitution=0.5, friction=0.2)
    lower = Geometry("lower", "world", "box", orientation=to_rpy(roof.as_matrix()), size=(0.1, 0.5, 0.1))
    mechanism = Mechanism(
        falling.bodies, falling.joints, gravity=falling.gravity, geometries=(falling.geometries[0], lower),
        pairs=falling.pairs,
    )  # fmt: skip
    hits = np.sqrt(2 * 0.005 / GRAVITY)
    found = followed(mechanism, [0.0, hits + 0.01])
    assert [event.kind for event in found.events] == ["impact"]
    assert found.events[0].time == pytest.approx(hits, abs=1e-12)
    speed = 0.5 * GRAVITY * hits - GRAVITY * 0.01
    np.testing.assert_allclose(found.record.v_WB[-1, 0] @ AXES, [0, 0, speed], rtol=0, atol=1e-12)
    assert np.abs(found.record.w_WB[-1]).max() < 1e-11


@pytest.mark.nightly
def test_a_box_that_meets_a_side_rebounds_from_it() -> None:
    """Faces that come to meet are those of the sides: a box that flies at the side of another one comes back."""
    found = followed(on_box((0.15, 0, -0.1), (-1.0, 0, 0.3), restitution=0.6), [0.0, 0.06])
    assert {event.kind for event in found.events} == {"impact"}
    assert [event.time for event in found.events] == pytest.approx([0.05] * len(found.events), abs=1e-13)
    v = found.record.v_WB[-1, 0] @ AXES
    np.testing.assert_allclose(v, [0.6, 0, 0.3 - GRAVITY * 0.06], rtol=0, atol=1e-12)
    assert np.abs(found.record.w_WB[-1]).max() < 1e-12


@pytest.mark.nightly
def test_a_box_that_tips_by_more_than_half_a_right_angle_ends_the_truth_with_the_reason() -> None:
    """A box that does not slip on the rim turns on until other faces meet, and the line says so."""
    found = truth_of(on_box((0.02, 0, HALF), friction=np.inf), np.array([0.0, 0.5]))
    assert [event.kind for event in found.events] == []
    assert "have turned so far at t = 0." in found.ended


HULL = Geometry("hull_a", "a", "box", size=(0.4, 0.3, 0.2))
# What tumbles towards a hull, the centre of mass of the hull's body, seeds, and the kinds of events.
TUMBLERS = {
    "box": (Geometry("hull_b", "b", "box", size=(0.3, 0.3, 0.5)), (0.01, 0, 0.02), (1, 4, 8), {"impact"}),
    "capsule": (
        Geometry("hull_b", "b", "capsule", radius=0.06, length=0.5), (0, 0, 0), (0, 4, 11), {"impact", "lift_off"}
    ),
}  # fmt: skip


def mujoco_distances(shapes: tuple[Geometry, ...], found: TwoRouteMotion) -> list[float]:
    """Distance of two bodies at each time [m], by MuJoCo."""
    spec = mujoco.MjSpec()
    for shape in shapes:
        body = spec.worldbody.add_body()
        body.add_freejoint()
        size = np.array(shape.size if shape.kind == "box" else (2 * shape.radius, shape.length, 0)) / 2
        body.add_geom(type=getattr(mujoco.mjtGeom, f"mjGEOM_{shape.kind.upper()}"), size=size)
    model = spec.compile()
    data, apart = mujoco.MjData(model), []
    for places, attitudes in zip(found.record.p_WB, found.record.q_WB, strict=True):
        data.qpos[:] = np.concatenate([places, attitudes], axis=1).ravel()
        mujoco.mj_forward(model, data)
        apart.append(mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None))
    return apart


# Faces and edges, and a round solid, with their order as it is and swapped; the others are for the night.
TUMBLE_FIRST = {("box", 1), ("capsule", 0)}


@pytest.mark.nightly_of("box-1-False")
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("other", "seed", "swapped"),
    [
        pytest.param(name, seed, not seed % 2, marks=() if (name, seed) in TUMBLE_FIRST else pytest.mark.nightly)
        for name, (_, _, seeds, _) in TUMBLERS.items()
        for seed in seeds
    ],
)
def test_solids_that_tumble_collide_without_overlap(other: str, seed: int, swapped: bool) -> None:
    """Wherever they meet, corner or edge first, they stay apart by MuJoCo's own distance and keep their momentum."""
    tumbler, com, _, kinds = TUMBLERS[other]
    rng = np.random.default_rng(seed)
    turns = [Rotation.random(random_state=seed + k) for k in (0, 99)]
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    v = turns[1].inv().apply(-3 * way + 0.2 * rng.normal(size=3))
    spins = rng.normal(size=3), 2 * rng.normal(size=3)
    starts = ((0, 0, 0), (0, 0, 0), spins[0]), (0.6 * way, v, spins[1])
    joints = tuple(
        Joint(f"j{name}", "free", "world", name, q0=(*p, *turn.as_quat(scalar_first=True)), v0=(*u, *w))
        for name, turn, (p, u, w) in zip("ab", turns, starts, strict=True)
    )
    bodies = (Body("a", 1.0, com=com, inertia=(0.012, 0.013, 0.011)), Body("b", 2.0, inertia=(0.05, 0.03, 0.04)))
    pair = Pair("touch", ("hull_b", "hull_a") if swapped else ("hull_a", "hull_b"), 0.3, 0.5)
    mechanism = Mechanism(bodies, joints, gravity=(0, 0, 0), geometries=(HULL, tumbler), pairs=(pair,))
    found = followed(mechanism, np.linspace(0.0, 0.13, 27))
    assert {"impact"} <= {event.kind for event in found.events} <= kinds
    assert min(mujoco_distances((HULL, tumbler), found)) > -1e-9
    arm = Rotation.from_quat(found.record.q_WB[:, 0], scalar_first=True).apply(com)
    speeds = found.record.v_WB[:, 0] + np.cross(found.record.w_WB[:, 0], arm)
    momentum = speeds + 2.0 * found.record.v_WB[:, 1]
    assert np.abs(momentum - momentum[0]).max() < 1e-12


@pytest.mark.nightly
@pytest.mark.parametrize("friction", [pytest.param(0.0, marks=pytest.mark.nightly), 0.6])
def test_an_elastic_cube_that_lands_flat_beside_its_centre_rises_as_it_fell(friction: float) -> None:
    """Four points at one speed return it together: the cube does not turn, and its error bar is round-off."""
    cube = Geometry("hull", "body", "box", size=(1.0, 1.0, 1.0))
    block = Geometry("block", "world", "box", turned((0, 0, -0.25)), size=(0.75, 0.75, 0.5), orientation=to_rpy(AXES))
    motion = free(cube, block, inertia((1, 1, 1)), (0.3, 0, 1.5), friction=friction, restitution=1.0)
    falls = np.sqrt(2 / GRAVITY)
    times = np.array([0.0, 0.4, falls + 0.01, 0.6])
    rises = times - falls
    height = np.where(rises < 0, 1.5 - GRAVITY * times**2 / 2, 0.5 + GRAVITY * rises * (falls - rises / 2))
    found = truth_of(motion, times)
    assert found.ended == ""
    assert (AXES.T @ found.record.p_WB[:, 0].T)[2] == pytest.approx(height, abs=1e-12)
    assert found.bars["p_WB"].max() < BARS
    assert {event.kind for event in found.events} == {"impact"}
