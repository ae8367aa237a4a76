"""What a scene file can say of contact, and what it cannot."""

from typing import Any

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.errors import InputError
from proofroll.core.parameters import Parameters
from proofroll.elements.mechanism.reading.reader import made_mechanism
from proofroll.elements.mechanism.run.capabilities import MechanismCapability, required

PLANE = {"name": "floor", "body": "world", "kind": "plane"}
BALL = {"name": "ball", "body": "b", "kind": "sphere", "radius": 0.1}
STONE = {"name": "stone", "body": "b", "kind": "ellipsoid", "axes": [0.3, 0.2, 0.1], "position": [0, 0, 1]}
RING = {"name": "ring", "body": "world", "kind": "torus", "radius": 0.1, "ring_radius": 0.15}
FUNNEL = {"name": "funnel", "body": "world", "kind": "cone", "slope": 0.5}
BORE = {"name": "tube", "body": "world", "kind": "bore", "radius": 0.1}
PAIR = {"name": "foot", "geometries": ["ball", "floor"], "friction": 0.3}


def made(
    *geometries: dict[str, Any],
    pairs: tuple[dict[str, Any], ...] = (),
    q0: Any = (0, 0, 1, 1, 0, 0, 0),
    v0: Any = (0,) * 6,
) -> Any:
    """A free body and a fixed second one with these geometries and pairs."""
    bodies = [{"name": name, "mass": 1.0, "inertia": [1.0, 1.0, 1.0]} for name in ("b", "c")]
    joints = [
        {"name": "j", "kind": "free", "parent": "world", "child": "b", "q0": list(q0), "v0": list(v0)},
        {"name": "k", "kind": "fixed", "parent": "world", "child": "c", "position": [3, 0, 1]},
    ]
    tables = {"bodies": bodies, "joints": joints, "geometries": list(geometries), "pairs": list(pairs)}
    return made_mechanism(tables, (0, 0, -9.81), Parameters({}, {}))


@pytest.mark.parametrize(
    ("geometry", "said"),
    [
        ({**BALL, "radius": -0.1}, "geometries.ball.radius = -0.1: must be at least 0"),
        ({**BALL, "body": "nobody"}, "geometries.ball.body = 'nobody': there is no such body; choose from b, c, world"),
        ({**BALL, "kind": "prism"}, "geometries.1.kind"),
        ({**BALL, "axes": [1, 1, 1]}, "geometries.ball.axes = (1.0, 1.0, 1.0): a sphere has none; it has radius"),
        ({**STONE, "axes": [1, 1, 0]}, "geometries.stone.axes = (1.0, 1.0, 0.0): each must be above 0"),
        ({**STONE, "axes": [0.2, 0.1, 1e-6]}, "geometries.stone.axes = (0.2, 0.1, 1e-06): the largest may be at most"),
        ({**BALL, "kind": "circle", "radius": 0}, "geometries.ball.radius = 0.0: a circle has a radius above 0"),
        ({"name": "box", "body": "b", "kind": "box"}, "geometries.box.size is missing: a box needs it; add it"),
        ({**PLANE, "normal": [0, 0, 0]}, "geometries.floor.normal"),
        ({**STONE, "radius": 1}, "geometries.stone.radius = 1.0: an ellipsoid has none; it has axes and orientation"),
        ({**PLANE}, "geometries.floor.name = 'floor': this name is used twice"),
        ({**BORE, "radius": 0}, "geometries.tube.radius = 0.0: a bore has a radius above 0"),
        ({**BORE, "normal": [1, 0, 0]}, "geometries.tube.normal = (1.0, 0.0, 0.0): a bore has none; it has"),
        ({**BORE, "axis": [0, 0, 0]}, "geometries.tube.axis"),
        ({**RING, "ring_radius": 0.1}, "geometries.ring.ring_radius = 0.1: must be above that of the wire, 0.1"),
        ({**RING, "slope": 0.1}, "geometries.ring.slope = 0.1: a torus has none; it has ring_radius and radius and"),
        ({**FUNNEL, "slope": 1.6}, "geometries.funnel.slope = 1.6: must lie between 0 and a right angle, pi/2"),
        ({**FUNNEL, "radius": 1.0}, "geometries.funnel.radius = 1.0: a cone has none; it has slope and axis"),
    ],
)  # fmt: skip
def test_bad_geometries_are_one_line(geometry: dict[str, Any], said: str) -> None:
    """Each impossible geometry names its field, its value and what to do."""
    with pytest.raises(InputError) as error:
        made(PLANE, geometry)
    assert str(error.value).startswith(said)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        ({"geometries": ["ball", "roof"]}, "pairs.foot.geometries = 'roof': there is no such geometry; choose from"),
        ({"geometries": ["ball", "ball"]}, "pairs.foot.geometries = ('ball', 'ball'): both belong to the body b"),
        ({"geometries": ["ball", "stone"]}, "pairs.foot.geometries = ('ball', 'stone'): both belong to the body b"),
        ({"geometries": ["floor", "floor"]}, "pairs.foot.geometries = ('floor', 'floor'): both belong to the world"),
        ({"geometries": ["stone", "egg"]}, "pairs.foot.geometries = ('stone', 'egg'): only a plane with"),
        ({"geometries": ["stone"]}, "pairs.0.geometries"),
        ({"geometries": ["stone", "tube"]}, "pairs.foot.geometries = ('stone', 'tube'): only a plane with"),
        ({"geometries": ["lid", "tube"]}, "pairs.foot.geometries = ('lid', 'tube'): only a plane with"),
        ({"geometries": ["tube", "ball"]}, "pairs.foot.geometries = ('tube', 'ball'): a sphere of radius 0.1 m has"),
        ({"geometries": ["ball", "ring"]}, "pairs.foot.geometries = ('ball', 'ring'): a sphere of radius 0.1 m has no"),
        ({"geometries": ["stone", "funnel"]}, "pairs.foot.geometries = ('stone', 'funnel'): only a plane with a sph"),
        ({"friction": -0.1}, "pairs.foot.friction = -0.1: must be at least 0"),
        ({"restitution": 1.5}, "pairs.foot.restitution = 1.5: no impact returns more than it takes"),
        ({"restitution": -0.5}, "pairs.foot.restitution = -0.5: must be at least 0"),
    ],
)  # fmt: skip
def test_bad_pairs_are_one_line(pair: dict[str, Any], said: str) -> None:
    """Each impossible pair names its field, its value and what to do."""
    egg = {**STONE, "name": "egg", "body": "c"}
    others = PLANE, BALL, STONE, egg, BORE, RING, FUNNEL, {**PLANE, "name": "lid", "body": "c"}
    with pytest.raises(InputError) as error:
        made(*others, pairs=({**PAIR, **pair},))
    assert str(error.value).startswith(said)
    assert "\n" not in str(error.value)


def test_room_in_a_bore_is_more_than_round_off() -> None:
    """A sphere that is smaller than its bore by 1e-12 of it is told that it has no room, before a truth fails at it."""
    with pytest.raises(InputError, match=r"a sphere of radius 0\.1 m has no room in a bore of 0\.1 m; make it smaller"):
        made(PLANE, BALL, {**BORE, "radius": 0.1 * (1 + 1e-12)}, pairs=({**PAIR, "geometries": ["tube", "ball"]},))


def test_a_ball_in_the_tip_of_a_cone_is_told_so() -> None:
    """There it touches along a whole circle, and no direction is the normal."""
    deep = {**FUNNEL, "position": [0, 0, 1 - 0.1 / np.cos(0.5)]}
    with pytest.raises(InputError, match="they touch at several points at once, without one normal; move one"):
        made(PLANE, BALL, deep, pairs=({**PAIR, "geometries": ["ball", "funnel"]},))


def test_a_pair_is_listed_once() -> None:
    """The same two geometries in another order are the same pair."""
    again = {**PAIR, "name": "again", "geometries": ["floor", "ball"]}
    with pytest.raises(InputError, match="these are the pair foot already; remove one"):
        made(PLANE, BALL, pairs=(PAIR, again))


def test_a_pair_has_a_name_of_its_own() -> None:
    """A pair that is named as a joint would have the same force in the results."""
    with pytest.raises(InputError, match="this name is used twice"):
        made(PLANE, BALL, pairs=({**PAIR, "name": "j"},))


def test_a_normal_of_any_size_has_its_direction() -> None:
    """A normal that is long, or whose squares vanish, is the same unit vector as a short one."""
    for size in (1e99, 1e-200):
        floor = made({**PLANE, "normal": [3 * size, 0, 4 * size]}).geometries[0]
        assert floor.normal == pytest.approx((0.6, 0.0, 0.8))


@pytest.mark.parametrize("ball", [{**BALL, "position": [1e300, 0, 0]}, {**BALL, "radius": 1e103}])
def test_a_shape_beyond_numbers_is_one_line(ball: dict[str, Any]) -> None:
    """A place or a radius whose cube overflows is told as too large."""
    with pytest.raises(InputError, match=r"beyond 1e\+100, so its cube overflows"):
        made(PLANE, ball, pairs=(PAIR,))


def test_nothing_overlaps_at_the_start() -> None:
    """A ball whose centre is nearer to the floor than its radius is told by how much."""
    with pytest.raises(InputError, match=r"pairs\.foot = 'b and world': they overlap by 0\.04 m at the start"):
        made(PLANE, BALL, pairs=(PAIR,), q0=(0, 0, 0.06, 1, 0, 0, 0))


def test_nothing_strikes_at_the_start() -> None:
    """A ball that touches the floor and moves into it would strike at time 0."""
    with pytest.raises(InputError, match=r"they touch and approach at 0\.5 m/s, an impact at time 0"):
        made(PLANE, BALL, pairs=(PAIR,), q0=(0, 0, 0.1, 1, 0, 0, 0), v0=(1, 0, -0.5, 0, 0, 0))


def test_a_disc_does_not_start_flat_on_its_plane() -> None:
    """A puck touches along its whole edge, where there is no point of contact; above the floor it may be flat."""
    puck = {**BALL, "kind": "circle"}
    with pytest.raises(InputError, match=r"pairs\.foot = 'b and world': the disc lies flat and touches along its"):
        made(PLANE, puck, pairs=(PAIR,), q0=(0, 0, 0, 1, 0, 0, 0), v0=(1, 0, 0, 0, 0, 5))
    made(PLANE, puck, pairs=(PAIR,))


def test_a_box_touches_with_its_vertices() -> None:
    """A box of edges 2, 4 and 6 cm, turned a quarter about z, has eight contacts at its corners."""
    box = {"name": "box", "body": "b", "kind": "box", "size": [0.02, 0.04, 0.06], "orientation": [0, 0, np.pi / 2]}
    found = made(PLANE, box, pairs=({**PAIR, "geometries": ["box", "floor"]},)).contacts
    assert [contact.name for contact in found] == [f"foot.{number}" for number in range(1, 9)]
    corners = np.array([contact.shape_a.centre for contact in found])
    assert np.abs(np.abs(corners) - [0.02, 0.01, 0.03]).max() < 1e-15
    assert len({tuple(np.sign(corner)) for corner in corners}) == 8


def test_contact_is_asked_of_a_formulation() -> None:
    """A sled asks for contact, its friction and what touches; a pair with restitution for rebounds too."""
    sled = mechanism_named("sled")
    assert required(sled) == {
        MechanismCapability.FREE,
        MechanismCapability.CONTACT,
        MechanismCapability.CONTACT_FRICTION,
        MechanismCapability.SPHERES,
        MechanismCapability.PLANES,
    }
    bouncing = made(PLANE, BALL, pairs=({**PAIR, "friction": 0, "restitution": 0.5},))
    asked = required(bouncing)
    assert MechanismCapability.CONTACT_REBOUNDS in asked
    assert MechanismCapability.CONTACT_FRICTION not in asked
