"""Features of solids: distances by a search over the whole shapes, borders between features, and what is refused."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.contact.touching import Moving, touch
from proofroll.elements.mechanism.scene.shapes.features import features_between
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact, Geometry, Pair
from proofroll.elements.mechanism.scene.shapes.shapes import BoxShape, CapsuleShape, CylinderShape, SphereShape

BALL, HALF = 0.2, np.array([0.3, 0.5, 0.8])
SOLIDS: dict[str, Any] = {
    "box": BoxShape(np.zeros(3), HALF, np.eye(3)),
    "capsule": CapsuleShape(np.zeros(3), np.eye(3)[2], 0.8, 0.3),
    "cylinder": CylinderShape(np.zeros(3), np.eye(3)[2], 0.8, 0.3),
}


def resting(place: Any, turn: Any) -> Moving:
    """A body at rest."""
    return Moving(np.asarray(place), turn, np.zeros(3), np.zeros(3))


def nearest_in(kind: str, place: Any) -> Any:
    """Nearest point of a solid to a place beyond it, or of the axis of a capsule."""
    x, y, z = place
    if kind == "box":
        return np.clip(place, -HALF, HALF)
    around = np.hypot(x, y)
    flat = np.array([x, y]) * (min(1.0, 0.3 / around) if kind == "cylinder" else 0.0)
    return np.array([*flat, np.clip(z, -0.8, 0.8)])


@pytest.mark.parametrize("kind", SOLIDS)
@given(seed=st.integers(0, 10**6))
def test_a_ball_is_as_far_from_a_solid_as_its_centre_from_the_nearest_point(kind: str, seed: int) -> None:
    """Gap and normal follow from the point of the solid that is nearest to the ball's centre, wherever both are."""
    rng = np.random.default_rng(seed)
    place = rng.normal(size=3)
    place /= max(1e-3, float(np.linalg.norm(place / [0.6, 0.9, 1.2], ord=np.inf)))  # on a box around all solids
    near = nearest_in(kind, place)
    turn, at = Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)
    ball, solid = SphereShape(np.zeros(3), BALL), SOLIDS[kind]
    for contact, sign in (
        (BodyContact("c", "a", "b", ball, solid, 0.0, 0.0), 1.0),
        (BodyContact("c", "a", "b", solid, ball, 0.0, 0.0), -1.0),
    ):
        bodies = resting(at + turn @ place, np.eye(3)), resting(at, turn)
        found = touch(contact, *bodies[:: int(sign)])
        away = place - near
        radius = BALL + (0.3 if kind == "capsule" else 0.0)
        assert found.gap == pytest.approx(np.linalg.norm(away) - radius, abs=1e-14)
        assert np.abs(found.normal - sign * turn @ away / np.linalg.norm(away)).max() < 1e-14
        assert all(border.left_by <= 1e-14 for border in found.borders)


@given(seed=st.integers(0, 10**6))
def test_two_capsules_are_as_far_apart_as_their_segments(seed: int) -> None:
    """Gap and features follow from the least squares of bounded places along both axes, in any attitude."""
    rng = np.random.default_rng(seed)
    u, w = (Rotation.random(random_state=seed + k).as_matrix()[:, 0] for k in range(2))
    one, two = CapsuleShape(np.zeros(3), u, 0.5, 0.1), CapsuleShape(np.zeros(3), w, 0.3, 0.05)
    apart = rng.normal(size=3)
    best = lsq_linear(np.array([u, -w]).T, -apart, ([-0.5, -0.3], [0.5, 0.3]), tol=1e-15)
    contact = BodyContact("c", "a", "b", one, two, 0.0, 0.0)
    found = touch(contact, resting(apart, np.eye(3)), resting(np.zeros(3), np.eye(3)))
    assert found.gap == pytest.approx(np.linalg.norm(best.fun) - 0.15, abs=1e-7)
    assert all(border.left_by <= 1e-14 for border in found.borders)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("kind", [*SOLIDS, "two capsules"])
@given(seed=st.integers(0, 10**6))
def test_gap_and_normal_go_on_where_features_change(kind: str, seed: int) -> None:
    """Along a circle around a solid neither makes a step, and a border leads to the features that follow."""
    turn = Rotation.random(random_state=seed).as_matrix()
    one = CapsuleShape(np.zeros(3), np.eye(3)[0], 0.5, 0.1) if kind == "two capsules" else SphereShape(np.zeros(3), 0.1)
    contact = BodyContact("c", "a", "b", one, SOLIDS.get(kind, SOLIDS["capsule"]), 0.0, 0.0)
    still = resting(np.zeros(3), np.eye(3))
    angles = np.linspace(0.0, 2 * np.pi, 400)
    places = 1.5 * (np.outer(np.cos(angles), turn[0]) + np.outer(np.sin(angles), turn[1]))
    ways = [touch(contact, resting(place, np.eye(3)), still) for place in places]
    for before, after in itertools.pairwise(ways):
        if before.feature != after.feature:
            beyond = {border.beyond for border in before.borders}
            chain = {after.feature} | {border.beyond for border in after.borders}
            assert beyond & chain  # by one border, or by two that are passed between samples
    step = 1.5 * (angles[1] - angles[0])
    assert np.abs(np.diff([each.gap for each in ways])).max() <= step
    assert np.abs(np.diff([each.normal for each in ways], axis=0)).max() <= 10 * step


def pair(first: Geometry, second: Geometry, place: tuple[float, ...] = (0, 0, 1)) -> Mechanism:
    """A free body above a fixed one."""
    body = Body("b", 1.0, inertia=(0.1, 0.1, 0.1))
    joint = Joint("j", "free", "world", "b", q0=(*place, 1.0, 0.0, 0.0, 0.0))
    return Mechanism((body,), (joint,), geometries=(first, second), pairs=(Pair("p", ("m", "f"), 0.3),))


def test_what_solids_do_not_do_is_said_in_one_line() -> None:
    """A vertex at an edge, parallel capsules that touch and a centre within have a reason."""
    rod, ball = Geometry("m", "b", "capsule", radius=0.1, length=1.0), Geometry("m", "b", "sphere", radius=0.1)
    fixed = Geometry("f", "world", "capsule", radius=0.1, length=1.0)
    box = Geometry("f", "world", "box", size=(1.0, 1.0, 1.0))
    with pytest.raises(InputError, match="a point has no direction from an edge; give the sphere a radius"):
        assert pair(Geometry("m", "b", "sphere", radius=0.0), box).contacts
    with pytest.raises(InputError, match="touch along a line: parallel sides have no one point that is nearest"):
        check_contacts(pair(rod, fixed, (0.2, 0.0, 0.3)))
    with pytest.raises(InputError, match=r"they overlap by 0\.4 m at the start; move one"):
        check_contacts(pair(ball, box, (0.0, 0.1, 0.2)))


def test_shapes_without_several_features_have_none() -> None:
    """Two spheres have one rule."""
    ball = SphereShape(np.zeros(3), 0.1)
    assert features_between(ball, ball) is None
