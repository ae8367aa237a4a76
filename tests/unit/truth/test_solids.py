"""Truths of solids that meet: closed forms in turned axes, and the bars of both routes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.rotations import to_rpy
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.switched_truth import truth_of

RADIUS, MASS, GRAVITY, SPEED = 0.1, 1.5, 9.81, 0.3
TURN = Rotation.from_rotvec([0.3, -0.7, 0.5])
AXES = TURN.as_matrix()
BARS = 1e-11  # 2e-13 is seen
TOP = {
    "box": {"size": (1.0, 1.0, 1.0), "orientation": to_rpy(AXES)},
    "cylinder": {"radius": 0.5, "length": 1.0, "axis": tuple(AXES[:, 2])},
}


def turned(vector: Any) -> tuple[float, float, float]:
    """A vector given in turned axes, in the world's."""
    x, y, z = (AXES @ np.asarray(vector, dtype=float)).tolist()
    return x, y, z


def ball_on(solid: Geometry, place: Any, v: Any, w: Any = (0, 0, 0), **law: float) -> Mechanism:
    """A free ball beside a fixed solid; place and motion in turned axes, where gravity is along -z."""
    inertia = 0.4 * MASS * RADIUS**2
    q = TURN.as_quat(scalar_first=True).tolist()
    joint = Joint("j", "free", "world", "ball", q0=(*turned(place), *q), v0=(*v, *w))
    shapes = (Geometry("ball", "ball", "sphere", radius=RADIUS), solid)
    return Mechanism(
        (Body("ball", MASS, inertia=(inertia, inertia, inertia)),),
        (joint,),
        gravity=turned((0, 0, -GRAVITY)),
        geometries=shapes,
        pairs=(Pair("touch", ("ball", solid.name), **({"friction": 0.0} | law)),),
    )


def followed(mechanism: Mechanism, times: Any) -> TwoRouteMotion:
    """Truth to the last time, whose bars are narrow."""
    found = truth_of(mechanism, np.array(times))
    assert np.isinf(found.horizon), found.reason
    assert max(float(np.nanmax(found.bars[name])) for name in ("p_WB", "v_WB", "w_WB")) < BARS
    return found


def top(kind: Any) -> Geometry:
    """A solid whose upper end or face is at height 0."""
    return Geometry("solid", "world", kind, position=turned((0, 0, -0.5)), **TOP[kind])  # type: ignore[arg-type]


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
