"""Contact kinematics against what their definition says."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism.contact.touching import Moving, Touching, touch
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import (
    BoxShape,
    CapsuleShape,
    CircleShape,
    CylinderShape,
    EllipsoidShape,
    HalfSpace,
    SphereShape,
)
from proofroll.elements.mechanism.scene.shapes.walls import Bore, BowlWall, ConeWall, Shaft, TorusWall
from proofroll.elements.mechanism.scene.shapes.walls.formula import RecordedProgram

STEP = 1e-5  # s; central differences leave 1e-10 of it, round-off 1e-11


def moved(body: Moving, time: float) -> Moving:
    """The body after a time with constant velocities."""
    R = Rotation.from_rotvec(body.w * time).as_matrix() @ body.R
    return Moving(body.p + body.v * time, R, body.v, body.w)


def some_body(rng: np.random.Generator) -> Moving:
    """A body anywhere."""
    return Moving(
        rng.normal(size=3), Rotation.random(random_state=7).as_matrix(), rng.normal(size=3), rng.normal(size=3)
    )


def some_shape(kind: str, rng: np.random.Generator) -> Any:
    """A shape anywhere on its body."""
    centre, axes = rng.normal(size=3), rng.uniform(0.1, 1.0, 3)
    frame = Rotation.random(random_state=3).as_matrix()
    return {
        "ball": lambda: SphereShape(centre, 0.3),
        "vertex": lambda: SphereShape(centre, 0.0),
        "ellipsoid": lambda: EllipsoidShape(centre, axes, frame),
        "disc": lambda: CircleShape(centre, 0.3, frame[:, 2].copy()),
        "bore": lambda: Bore(centre, frame[:, 1].copy(), 9.0),
        "shaft": lambda: Shaft(centre, frame[:, 1].copy(), 0.2),
        "bowl": lambda: BowlWall(centre, frame[:, 1].copy(), 9.0),
        "cone": lambda: ConeWall(centre, frame[:, 1].copy(), 0.6),
        "ring": lambda: TorusWall(centre, frame[:, 1].copy(), 4.0, 0.2),
        "plane": lambda: HalfSpace(centre, frame[:, 1].copy()),
        "box": lambda: BoxShape(centre, axes, frame),
        "capsule": lambda: CapsuleShape(centre, centre / np.linalg.norm(centre), 0.9, 0.1),
        "cylinder": lambda: CylinderShape(centre, frame[:, 1].copy(), 0.4, 0.7),
    }[kind]()


def test_balls_with_one_centre_have_numbers() -> None:
    """A trial step may lay a ball on the other: the gap is known there, and nothing is NaN, for all that they move."""
    ball, origin = SphereShape(np.zeros(3), 0.2), np.zeros(3)
    a, b = (Moving(origin, np.eye(3), speed, origin) for speed in (origin, np.array([1.0, 0.0, 0.0])))
    found = touch(BodyContact("c", "a", "b", ball, ball, 0.0, 0.0), a, b)
    assert found.gap == -0.4
    assert all(np.isfinite(part).all() for part in found)


def test_a_ball_on_the_axis_of_its_bore_has_numbers() -> None:
    """A trial step may lay it there: the gap is known, and nothing is NaN."""
    ball, still = SphereShape(np.zeros(3), 0.2), Moving(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))
    found = touch(BodyContact("c", "a", "b", ball, Bore(np.zeros(3), np.eye(3)[2], 0.5), 0.0, 0.0), still, still)
    assert found.gap == pytest.approx(0.3)
    assert all(np.isfinite(part).all() for part in found)


PAIRS = [
    "ball plane",
    "plane ball",
    "vertex plane",
    "ellipsoid plane",
    "disc plane",
    "plane disc",
    "ball ball",
    "ball bore",
    "bore vertex",
    "ball shaft",
    "bowl ball",
    "ball cone",
    "vertex cone",
    "ring ball",
    "ball box",
    "box ball",
    "ball capsule",
    "cylinder ball",
    "capsule capsule",
]


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rates_are_derivatives(pair: str, seed: int) -> None:
    """The rates of gap, normal and place are their differences over a short time, wherever two bodies are."""
    rng = np.random.default_rng(seed)
    one, two = (some_shape(kind, rng) for kind in pair.split())
    contact = BodyContact("c", "a", "b", one, two, 0.0, 0.0)
    a, b = some_body(rng), some_body(rng)
    before, now, after = (touch(contact, moved(a, t), moved(b, t)) for t in (-STEP, 0.0, STEP))

    def rate(name: str) -> Any:
        return (getattr(after, name) - getattr(before, name)) / (2 * STEP)

    assert rate("gap") == pytest.approx(float(now.normal @ now.slide), abs=1e-7)
    assert np.abs(rate("normal") - now.normal_rate).max() < 1e-7
    assert np.abs(rate("place") - now.place_rate).max() < 1e-7


@pytest.mark.parametrize("pair", PAIRS)
def test_symbols_have_the_rules_of_numbers(pair: str) -> None:
    """A contact recorded with symbols gives the numbers of the same contact, with the same features."""
    rng, program = np.random.default_rng(4), RecordedProgram(36)
    one, two = (some_shape(kind, rng) for kind in pair.split())
    contact, bodies = BodyContact("c", "a", "b", one, two, 0.0, 0.0), (some_body(rng), some_body(rng))
    expected = touch(contact, *bodies)
    symbols = np.array(program.symbols, dtype=object).reshape(2, 18)
    recorded = touch(
        contact, *(Moving(p[:3], p[3:12].reshape(3, 3), *p[12:].reshape(2, 3)) for p in symbols), expected.feature
    )

    def flat(touching: Touching) -> list[Any]:
        vectors = touching[1:6]
        return [
            touching.gap,
            *(x for v in vectors for x in v.tolist()),
            touching.tilt,
            *(at for at, _ in touching.borders),
        ]

    (calculated,) = program.functions(flat(recorded), math)
    numbers = np.concatenate([np.ravel(part) for body in bodies for part in body])
    assert np.array(calculated(*numbers.tolist())) == pytest.approx(np.array(flat(expected)), abs=1e-12)


def test_an_ellipsoid_is_as_far_from_a_plane_as_its_nearest_point() -> None:
    """No point of the surface is nearer to the plane than the place of contact."""
    rng = np.random.default_rng(5)
    shape, plane = some_shape("ellipsoid", rng), some_shape("plane", rng)
    a, b = some_body(rng), some_body(rng)
    found: Touching = touch(BodyContact("c", "a", "b", shape, plane, 0.0, 0.0), a, b)
    unit = rng.normal(size=(20000, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    surface = a.p + (shape.centre + (unit * shape.axes) @ shape.frame.T) @ a.R.T
    n, through = b.R @ plane.normal, b.p + b.R @ plane.point
    heights = (surface - through) @ n
    assert found.gap <= heights.min()
    assert found.gap == pytest.approx(heights.min(), abs=1e-2)
    assert float(n @ (found.place - through)) == pytest.approx(found.gap, abs=1e-14)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_ball_is_as_far_from_a_bore_as_its_farthest_point_from_the_axis(seed: int) -> None:
    """Gap and place of contact from the distances of a sphere's points from the axis; the normal points to it."""
    rng = np.random.default_rng(seed)
    ball, bore = some_shape("ball", rng), some_shape("bore", rng)
    a, b = some_body(rng), some_body(rng)
    found = touch(BodyContact("c", "a", "b", ball, bore, 0.0, 0.0), a, b)
    way = rng.normal(size=(20000, 3))
    surface = a.p + a.R @ ball.centre + ball.radius * way / np.linalg.norm(way, axis=1, keepdims=True)
    axis, foot = b.R @ bore.axis, b.p + b.R @ bore.point

    def distance(places: np.ndarray[Any, Any]) -> Any:
        return np.linalg.norm(np.cross(places - foot, axis), axis=-1)

    assert found.gap == pytest.approx(bore.radius - distance(surface).max(), abs=1e-3)
    assert distance(found.place) == pytest.approx(bore.radius - found.gap, abs=1e-13)
    assert distance(found.place + 1e-3 * found.normal) < distance(found.place)
    assert abs(float(found.normal @ axis)) < 1e-14
