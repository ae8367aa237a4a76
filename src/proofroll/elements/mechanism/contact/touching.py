"""Contact of two bodies: gap, normal, point of contact, and their rates, in floats or symbols.

One set of rules serves all: routes of truths compile them from symbols, where features that touch are given.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism.scene.rotations import (
    Array,
    Floats3,
    dot,
    minus,
    plain_cross,
    plain_dot,
    plus,
    scaled,
    square_of,
    turned,
    turned_back,
)
from proofroll.elements.mechanism.scene.shapes.box_features import BoxSlot, Lying
from proofroll.elements.mechanism.scene.shapes.capsule_box import CapsuleBoxSlot
from proofroll.elements.mechanism.scene.shapes.features import Border, CapsuleFeatures, SolidFeatures
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import (
    LEAST,
    BoxShape,
    CircleShape,
    ConvexShape,
    HalfSpace,
    Shape,
    SphereShape,
    Wall,
)
from proofroll.elements.mechanism.scene.shapes.walls import ConeWall, CurvedWall, EdgeLine, Shaft
from proofroll.elements.mechanism.scene.shapes.walls.formula import sqrt

# Sine of the angle between a disc and its plane, or two capsules, up to which they are parallel: digits of a file.
FLAT = 1e-9

PARALLEL = "parallel sides have no one point that is nearest, and where along the line the load acts is not determinate"


class Moving(NamedTuple):
    """Motion of a body at one instant: position and rotation of its frame, velocity of the origin, angular velocity.

    All in world axes [m, m/s, rad/s].
    """

    p: Array
    R: Array
    v: Array
    w: Array

    def velocity(self, place: Array) -> Array:
        """Velocity of the body's material at a place in the world [m/s]."""
        return np.array(self.plain_velocity(place.tolist()))

    def plain_velocity(self, place: Floats3) -> Floats3:
        """:meth:`velocity` in plain floats or symbols."""
        if self is AT_REST:
            return 0.0, 0.0, 0.0
        return plus(self.v.tolist(), plain_cross(self.w.tolist(), minus(place, self.p.tolist())))


class Touching(NamedTuple):
    """A contact at one instant, world axes.

    Attributes:
        gap: distance of the shapes, negative where they overlap [m].
        normal: unit vector from b to a; a force along it pushes a away.
        normal_rate: its time derivative [1/s].
        place: point of contact, or of an open contact the point that would touch: on the shape that is no wall, for two
            spheres, and for solids, on a [m].
        place_rate: velocity of that point in the world, as it moves over both bodies [m/s].
        slide: velocity of a's material relative to b's at that point [m/s]; along the normal it is the gap's rate.
        tilt: sine of the angle between a disc and its plane, or between two capsules whose sides are the nearest;
            square of the distance of a sphere's centre from a cone's axis over its radius; 1 for other shapes.
        feature: number of the nearest features of solids.
        borders: of these features.
        absent: True for a contact of two boxes that lies beyond a border; its gap is the way there.
    """

    gap: float
    normal: Array
    normal_rate: Array
    place: Array
    place_rate: Array
    slide: Array
    tilt: float = 1.0
    feature: int = 0
    borders: tuple[Border, ...] = ()
    absent: bool = False

    @property
    def flat(self) -> bool:
        """True for a disc on its plane, parallel capsules, or a ball in a cone's tip: they touch at many points."""
        return self.tilt <= FLAT


AT_REST = Moving(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))  # as the world is
ONE_POINT = "stands on its whole edge, of which this formulation has one point, so that it tips; give it three spheres"


def lying(contact: BodyContact, time: float) -> NotUnique:
    """Error of a disc that lies flat, of parallel capsules, or of a ball in the tip of a cone, from a time on [s]."""
    if contact.has_tip:
        return NotUnique(
            f"{contact.name} comes to the tip of its cone at t = {time:.6g} s, where the wall has no normal; end before"
        )
    if contact.features is not None:
        return NotUnique(
            f"the capsules of {contact.name} touch along a line at t = {time:.6g} s: {PARALLEL}; end before, or turn "
            "one"
        )
    return NotUnique(
        f"the disc of {contact.name} lies flat at t = {time:.6g} s: the forces along its edge are not determinate; end "
        "before, or give it three spheres"
    )


def torn(name: str, time: float) -> NotUnique:
    """Error of Painlevé's paradox at a contact, from a time on [s]."""
    return NotUnique(
        f"{name} would not press but tear from t = {time:.6g} s on: with its friction the motion that follows is "
        "not unique or does not exist (Painlevé)"
    )


def guided(name: str, time: float) -> NotUnique:
    """Error of a contact with friction whose load joints share, from a time on [s]."""
    return NotUnique(
        f"joints already hold the body of {name} off its surface at t = {time:.6g} s: they share its normal force, "
        "which is not determinate, nor is its friction; leave out the friction, or give the joint play"
    )


def touch(contact: BodyContact, a: Moving, b: Moving, feature: int | None = None) -> Touching:
    """Gap, normal, point of contact and rates of a contact at given motions of its bodies.

    ``feature``: features of solids that touch; None: the nearest.
    """
    features = contact.features
    if contact.box_slot is not None:
        if isinstance(contact.box_slot, BoxSlot):
            return _touch_boxes(contact.box_slot, a, b, feature)
        return _touch_capsule(contact.box_slot, a, b, feature)
    if features is None:
        result = _touch(contact.shape_a, a, contact.shape_b, b)
        ends = ((contact.shape_a, a), (contact.shape_b, b))
        for (shape, body), (partner, of) in (ends, ends[::-1]):
            if isinstance(shape, CircleShape):
                leaning = plain_cross((body.R @ shape.normal).tolist(), result.normal.tolist())
                result = result._replace(tilt=sqrt(square_of(leaning)))
            elif isinstance(shape, ConeWall) and isinstance(partner, SphereShape):
                result = result._replace(tilt=_from_tip(partner, of, shape, body))
        return result
    *measures, tilt = _measures(features, a, b)
    feature = features.nearest(*measures) if feature is None else feature
    shape_a, shape_b = features.shapes(feature)
    result = _touch(shape_a, a, shape_b, b)
    if isinstance(shape_a, Wall) and not isinstance(shape_b, Wall):
        result = _on_first(result, a, b)
    tilt = tilt if features.needs_angle(feature) else 1.0
    return result._replace(tilt=tilt, feature=feature, borders=tuple(features.borders(feature, *measures)))


def _touch_boxes(slot: BoxSlot, a: Moving, b: Moving, feature: int | None) -> Touching:
    """One contact of two boxes; see :func:`touch`."""
    lying, absents = _lying_of(slot, a, b)
    faces = lying.faces if feature is None else slot.faces(feature)
    all_beyond, heights = lying.beyond(faces)
    beyond = float(all_beyond[slot.slot])
    feature = slot.feature(faces, beyond > 0) if feature is None else feature
    absent = slot.absent(feature)
    borders = [Border(-beyond if absent else beyond, feature ^ 1)]
    borders += [Border(lying.turned_away(*faces), feature)] if slot.leads else []
    if not absent:
        shape_a, shape_b = slot.shapes(feature)
        return _touch(shape_a, a, shape_b, b)._replace(feature=feature, borders=tuple(borders))
    gap = beyond if slot.of_edges else max(beyond, float(heights[slot.slot]))
    if faces[1] not in absents:
        absents[faces[1]] = _absent(0.0, lying.normal(False, faces[1]), lying.place_a, a, b)
    return absents[faces[1]]._replace(gap=gap, feature=feature, borders=tuple(borders))


def _absent(gap: float, normal: Array, place: Array, a: Moving, b: Moving) -> Touching:
    """Contact beyond its border, with a place of its bodies, as edges may be parallel."""
    speed, other_speed = a.velocity(place), b.velocity(place)
    return Touching(
        gap=gap,
        normal=normal,
        normal_rate=np.zeros(3),
        place=place,
        place_rate=speed,
        slide=speed - other_speed,
        absent=True,
    )


def _touch_capsule(slot: CapsuleBoxSlot, a: Moving, b: Moving, feature: int | None) -> Touching:
    """One contact of a capsule and a box; see :func:`touch`."""
    of_a, of_b = slot.centres
    places = a.p + a.R @ of_a, b.p + b.R @ of_b
    (capsule, box), (place, other_place) = ((a, b), places) if slot.capsule_first else ((b, a), places[::-1])
    axes = box.R @ slot.box.frame
    seen = axes.T @ (place - other_place), axes.T @ (capsule.R @ slot.capsule.axis)
    feature = slot.nearest(*seen) if feature is None else feature
    left_by = slot.left_by(feature, *seen)
    borders = (Border(left_by, feature ^ 1),)
    if slot.absent(feature):
        apart = places[0] - places[1]
        normal = apart / (float(np.linalg.norm(apart)) or 1.0)
        return _absent(-left_by, normal, places[0], a, b)._replace(feature=feature, borders=borders)
    shape_a, shape_b = slot.shapes(feature)
    touching = _touch(shape_a, a, shape_b, b)
    if isinstance(shape_a, Wall) and not isinstance(shape_b, Wall):
        touching = _on_first(touching, a, b)
    return touching._replace(feature=feature, borders=borders)


# Of the last boxes, which have many contacts, with those that are absent by the face of the second box.
_LYING: list[tuple[Moving, Moving, BoxShape, BoxShape, tuple[Lying, dict[int, Touching]]]] = []


def _lying_of(slot: BoxSlot, a: Moving, b: Moving) -> tuple[Lying, dict[int, Touching]]:
    box_a, box_b = slot.first, slot.second
    for last in _LYING[:1]:
        if last[0] is a and last[1] is b and last[2] is box_a and last[3] is box_b:
            return last[4]
    lying = Lying(
        place_a=a.p + a.R @ box_a.centre,
        axes_a=a.R @ box_a.frame,
        half_a=box_a.half,
        place_b=b.p + b.R @ box_b.centre,
        axes_b=b.R @ box_b.frame,
        half_b=box_b.half,
    )
    _LYING[:] = [(a, b, box_a, box_b, (lying, {}))]
    return _LYING[0][4]


def _measures(features: SolidFeatures, a: Moving, b: Moving) -> tuple[Any, ...]:
    """Measures of two solids, see :mod:`.features`, and the sine of the angle between two capsules, or 1."""
    of_a, of_b = features.centres
    apart = a.p + a.R @ of_a - b.p - b.R @ of_b
    if isinstance(features, CapsuleFeatures):
        u, w = a.R @ features.first.axis, b.R @ features.second.axis
        return dot(apart, u), dot(apart, w), dot(u, w), sqrt(square_of(plain_cross(u.tolist(), w.tolist())) + LEAST)
    R, apart = (b.R, apart) if features.ball_first else (a.R, -apart)
    return *((R @ features.axes).T @ apart).tolist(), 1.0


def _touch(shape_a: Shape, a: Moving, shape_b: Shape, b: Moving) -> Touching:
    """Contact of two shapes with one rule."""
    if isinstance(shape_a, Shaft) and isinstance(shape_b, Shaft):
        gap, n, n_rate, place, rate = _two_shafts(shape_a, a, shape_b, b)
    elif isinstance(shape_b, Wall):
        assert not isinstance(shape_a, Wall)  # two walls are no contact
        gap, n, n_rate, place, rate = _on_wall(shape_a, a, shape_b, b)
    elif isinstance(shape_a, Wall):
        gap, n, n_rate, place, rate = _on_wall(shape_b, b, shape_a, a)
        n, n_rate = scaled(-1.0, n), scaled(-1.0, n_rate)
    else:
        assert isinstance(shape_a, SphereShape)
        assert isinstance(shape_b, SphereShape)
        gap, n, n_rate, place, rate = _two_spheres(shape_a, a, shape_b, b)
    return Touching(
        gap=gap,
        normal=np.array(n),
        normal_rate=np.array(n_rate),
        place=np.array(place),
        place_rate=np.array(rate),
        slide=np.array(minus(a.plain_velocity(place), b.plain_velocity(place))),
    )


def _on_first(touching: Touching, a: Moving, b: Moving) -> Touching:
    """The contact with its place moved from the second shape to the first."""
    n, closing = touching.normal.tolist(), dot(touching.normal, touching.slide)
    place = touching.place + np.array(scaled(touching.gap, n))
    moved = plus(scaled(closing, n), scaled(touching.gap, touching.normal_rate.tolist()))
    slide = a.velocity(place) - b.velocity(place)
    return touching._replace(place=place, place_rate=touching.place_rate + np.array(moved), slide=slide)


_Lying = tuple[Any, Floats3, Floats3, Floats3, Floats3]


def _on_wall(shape: ConvexShape, body: Moving, wall: Wall, wall_body: Moving) -> _Lying:
    """Gap, normal, its rate, point of contact and its rate of a convex shape on a wall, with the wall's normal."""
    if isinstance(wall, HalfSpace):
        return _on_plane(shape, body, wall, wall_body)
    assert isinstance(shape, SphereShape)  # alone has a rule
    return _on_curve(shape, body, wall, wall_body)


def _on_curve(sphere: SphereShape, body: Moving, wall: CurvedWall, wall_body: Moving) -> _Lying:
    """Numbers of :func:`_on_wall` on a curved wall."""
    radius, (centre, slides) = sphere.radius, _carried(body, sphere.centre)
    axes, velocity, place = wall.axes, slides, minus(centre, wall.point.tolist())
    if wall_body is not AT_REST:
        axes, beside = (wall_body.R @ wall.frame).tolist(), minus(centre, wall_body.p.tolist())
        place = minus(beside, turned(wall_body.R.tolist(), wall.point.tolist()))
        slides = minus(velocity, wall_body.plain_velocity(centre))  # over the wall's body
    distance, normal, (xx, xy, xz, yy, yz, zz) = wall.seen(*turned_back(axes, place))
    n = turned(axes, normal)
    n_rate = turned(axes, turned(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), turned_back(axes, slides)))
    if wall_body is not AT_REST:
        n_rate = plus(plain_cross(wall_body.w.tolist(), n), n_rate)
    return distance - radius, n, n_rate, minus(centre, scaled(radius, n)), minus(velocity, scaled(radius, n_rate))


def _carried(body: Moving, place: Array) -> tuple[Floats3, Floats3]:
    """Place in the world and velocity of a place in the body's frame."""
    arm = turned(body.R.tolist(), place.tolist())
    return plus(body.p.tolist(), arm), plus(body.v.tolist(), plain_cross(body.w.tolist(), arm))


def _from_tip(sphere: SphereShape, body: Moving, cone: ConeWall, cone_body: Moving) -> Any:
    """Square of the distance of a sphere's centre from the axis of a cone over its radius [1]; it is smooth."""
    centre = minus(_carried(body, sphere.centre)[0], cone_body.p.tolist())
    seen = minus(turned_back(cone_body.R.tolist(), centre), cone.point.tolist())
    return square_of(plain_cross(cone.axis.tolist(), seen)) / (sphere.radius or 1.0) ** 2


def _on_plane(shape: ConvexShape, body: Moving, plane: HalfSpace, wall_body: Moving) -> _Lying:
    """Numbers of :func:`_on_wall` on a plane, of any convex shape."""
    R, spin = body.R.tolist(), body.w.tolist()
    n = turned(wall_body.R.tolist(), plane.normal.tolist())
    n_rate = plain_cross(wall_body.w.tolist(), n)
    turning = minus(plain_cross(spin, n), n_rate)  # rate of the direction -n in the body's frame
    if isinstance(shape, SphereShape):
        arm, moved = minus(turned(R, shape.centre.tolist()), scaled(shape.radius, n)), scaled(shape.radius, turning)
    else:
        point, by_turning = shape.support(scaled(-1.0, turned_back(R, n)), turned_back(R, turning))
        arm, moved = turned(R, point), turned(R, by_turning)
    place = plus(body.p.tolist(), arm)
    rate = plus(plus(body.v.tolist(), plain_cross(spin, arm)), moved)
    foot = plus(wall_body.p.tolist(), turned(wall_body.R.tolist(), plane.point.tolist()))
    return plain_dot(n, minus(place, foot)), n, n_rate, place, rate


def _two_spheres(sphere_a: SphereShape, a: Moving, sphere_b: SphereShape, b: Moving) -> _Lying:
    (centre_a, velocity_a), (centre_b, velocity_b) = _carried(a, sphere_a.centre), _carried(b, sphere_b.centre)
    apart, apart_rate = minus(centre_a, centre_b), minus(velocity_a, velocity_b)
    distance = sqrt(square_of(apart))
    inverse = 1.0 / (distance or 1.0)  # a trial step may lay one centre on the other, where the normal is zero
    n = scaled(inverse, apart)
    n_rate = scaled(inverse, minus(apart_rate, scaled(plain_dot(n, apart_rate), n)))
    place, rate = minus(centre_a, scaled(sphere_a.radius, n)), minus(velocity_a, scaled(sphere_a.radius, n_rate))
    return distance - (sphere_a.radius + sphere_b.radius), n, n_rate, place, rate


def _two_shafts(shaft_a: Shaft, a: Moving, shaft_b: Shaft, b: Moving) -> _Lying:
    """Numbers of :func:`_on_wall` of two round shafts that cross, where their axes are nearest."""
    u, w = turned(a.R.tolist(), shaft_a.axis.tolist()), turned(b.R.tolist(), shaft_b.axis.tolist())
    u_rate, w_rate = plain_cross(a.w.tolist(), u), plain_cross(b.w.tolist(), w)
    (foot_a, velocity_a), (foot_b, velocity_b) = _carried(a, shaft_a.point), _carried(b, shaft_b.point)
    apart, apart_rate = minus(foot_a, foot_b), minus(velocity_a, velocity_b)
    across, across_rate = plain_cross(u, w), plus(plain_cross(u_rate, w), plain_cross(u, w_rate))
    square = square_of(across) or 1.0  # of parallel shafts, which have no normal
    ahead = turned(b.R.tolist(), shaft_b.outward.tolist()) if isinstance(shaft_b, EdgeLine) else apart
    factor = _sign(plain_dot(ahead, across)) / sqrt(square)
    n, n_rate = scaled(factor, across), scaled(factor, across_rate)
    n_rate = minus(n_rate, scaled(plain_dot(n, n_rate), n))
    cosine, cosine_rate = plain_dot(u, w), plain_dot(u_rate, w) + plain_dot(u, w_rate)
    along_a, along_b = plain_dot(apart, u), plain_dot(apart, w)
    rate_a = plain_dot(apart_rate, u) + plain_dot(apart, u_rate)
    rate_b = plain_dot(apart_rate, w) + plain_dot(apart, w_rate)
    s = (cosine * along_b - along_a) / square
    s_rate = (cosine_rate * along_b + cosine * rate_b - rate_a + 2.0 * s * cosine * cosine_rate) / square
    place = minus(plus(foot_a, scaled(s, u)), scaled(shaft_a.radius, n))
    rate = plus(plus(velocity_a, scaled(s_rate, u)), minus(scaled(s, u_rate), scaled(shaft_a.radius, n_rate)))
    return plain_dot(n, apart) - (shaft_a.radius + shaft_b.radius), n, n_rate, place, rate


def _sign(number: Any) -> Any:
    """Sign of a number or of a symbol."""
    return math.copysign(1.0, number) if isinstance(number, float) else number / sqrt(number * number)
