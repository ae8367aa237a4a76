"""Contact of two bodies: gap, normal, point of contact, and their rates."""

from typing import NamedTuple

import numpy as np

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism.scene.rotations import Array, cross
from proofroll.elements.mechanism.scene.shapes.box_features import BoxSlot, Lying
from proofroll.elements.mechanism.scene.shapes.capsule_box import CapsuleBoxSlot
from proofroll.elements.mechanism.scene.shapes.features import Border, CapsuleFeatures, SolidFeatures
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import (
    BoxShape,
    CircleShape,
    ConvexShape,
    HalfSpace,
    Shape,
    SphereShape,
    Wall,
)
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall, EdgeLine, Shaft

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
        return self.v + cross(self.w, place - self.p)


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
        tilt: sine of the angle between a disc and its plane, or between two capsules whose sides are the nearest; 1 for
            other shapes.
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
        """True for a disc on its plane, or parallel capsules, which touch along an edge or a line, not at one point."""
        return self.tilt <= FLAT


def lying(contact: BodyContact, time: float) -> NotUnique:
    """Error of a disc that lies flat, or of capsules that are parallel, from a time on [s]."""
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
        found = _touch(contact.shape_a, a, contact.shape_b, b)
        discs = ((contact.shape_a, a), (contact.shape_b, b))
        tilts = (
            float(np.linalg.norm(cross(of.R @ disc.normal, found.normal)))
            for disc, of in discs
            if isinstance(disc, CircleShape)
        )
        return found._replace(tilt=next(tilts, 1.0))
    *measures, tilt = _measures(features, a, b)
    feature = features.nearest(*measures) if feature is None else feature
    one, two = features.shapes(feature)
    found = _touch(one, a, two, b)
    if isinstance(one, Wall) and not isinstance(two, Wall):
        found = _on_first(found, a, b)
    tilt = tilt if features.needs_angle(feature) else 1.0
    return found._replace(tilt=tilt, feature=feature, borders=tuple(features.borders(feature, *measures)))


def _touch_boxes(slot: BoxSlot, a: Moving, b: Moving, feature: int | None) -> Touching:
    """One contact of two boxes; see :func:`touch`."""
    lying = _lying_of(slot, a, b)
    faces = lying.faces if feature is None else slot.faces(feature)
    all_beyond, heights = lying.beyond(faces)
    beyond = float(all_beyond[slot.slot])
    feature = slot.feature(faces, beyond > 0) if feature is None else feature
    absent = slot.absent(feature)
    borders = [Border(-beyond if absent else beyond, feature ^ 1)]
    borders += [Border(lying.turned_away(*faces), feature)] if slot.leads else []
    if not absent:
        one, two = slot.shapes(feature)
        return _touch(one, a, two, b)._replace(feature=feature, borders=tuple(borders))
    gap = beyond if slot.of_edges else max(beyond, float(heights[slot.slot]))
    found = _absent(gap, lying.normal(False, faces[1]), lying.place_a, a, b)
    return found._replace(feature=feature, borders=tuple(borders))


def _absent(gap: float, normal: Array, place: Array, a: Moving, b: Moving) -> Touching:
    """Contact beyond its border, with a place of its bodies, as edges may be parallel."""
    speed, other = a.velocity(place), b.velocity(place)
    return Touching(
        gap=gap,
        normal=normal,
        normal_rate=np.zeros(3),
        place=place,
        place_rate=speed,
        slide=speed - other,
        absent=True,
    )


def _touch_capsule(slot: CapsuleBoxSlot, a: Moving, b: Moving, feature: int | None) -> Touching:
    """One contact of a capsule and a box; see :func:`touch`."""
    of_a, of_b = slot.centres
    places = a.p + a.R @ of_a, b.p + b.R @ of_b
    (capsule, box), (place, other) = ((a, b), places) if slot.capsule_first else ((b, a), places[::-1])
    axes = box.R @ slot.box.frame
    seen = axes.T @ (place - other), axes.T @ (capsule.R @ slot.capsule.axis)
    feature = slot.nearest(*seen) if feature is None else feature
    left_by = slot.left_by(feature, *seen)
    borders = (Border(left_by, feature ^ 1),)
    if slot.absent(feature):
        apart = places[0] - places[1]
        normal = apart / (float(np.linalg.norm(apart)) or 1.0)
        return _absent(-left_by, normal, places[0], a, b)._replace(feature=feature, borders=borders)
    one, two = slot.shapes(feature)
    found = _touch(one, a, two, b)
    if isinstance(one, Wall) and not isinstance(two, Wall):
        found = _on_first(found, a, b)
    return found._replace(feature=feature, borders=borders)


_LYING: list[tuple[Moving, Moving, BoxShape, BoxShape, Lying]] = []  # of the last boxes, which have many contacts


def _lying_of(slot: BoxSlot, a: Moving, b: Moving) -> Lying:
    one, two = slot.first, slot.second
    for last in _LYING[:1]:
        if last[0] is a and last[1] is b and last[2] is one and last[3] is two:
            return last[4]
    lying = Lying(
        place_a=a.p + a.R @ one.centre,
        axes_a=a.R @ one.frame,
        half_a=one.half,
        place_b=b.p + b.R @ two.centre,
        axes_b=b.R @ two.frame,
        half_b=two.half,
    )
    _LYING[:] = [(a, b, one, two, lying)]
    return lying


def _measures(features: SolidFeatures, a: Moving, b: Moving) -> tuple[float, float, float, float]:
    """Measures of two solids, see :mod:`.features`, and the sine of the angle between two capsules, or 1."""
    of_a, of_b = features.centres
    apart = a.p + a.R @ of_a - b.p - b.R @ of_b
    if isinstance(features, CapsuleFeatures):
        u, w = a.R @ features.first.axis, b.R @ features.second.axis
        return float(apart @ u), float(apart @ w), float(u @ w), float(np.linalg.norm(cross(u, w)))
    R, apart = (b.R, apart) if features.ball_first else (a.R, -apart)
    x, y, z = ((R @ features.axes).T @ apart).tolist()
    return x, y, z, 1.0


def _touch(one: Shape, a: Moving, two: Shape, b: Moving) -> Touching:
    """Contact of two shapes with one rule."""
    if isinstance(one, Shaft) and isinstance(two, Shaft):
        gap, n, n_rate, place, rate = _two_shafts(one, a, two, b)
    elif isinstance(two, Wall):
        assert not isinstance(one, Wall)  # two walls are no contact
        gap, n, n_rate, place, rate = _on_wall(one, a, two, b)
    elif isinstance(one, Wall):
        gap, n, n_rate, place, rate = _on_wall(two, b, one, a)
        n, n_rate = -n, -n_rate
    else:
        assert isinstance(one, SphereShape)
        assert isinstance(two, SphereShape)
        gap, n, n_rate, place, rate = _two_spheres(one, a, two, b)
    return Touching(
        gap=gap,
        normal=n,
        normal_rate=n_rate,
        place=place,
        place_rate=rate,
        slide=a.velocity(place) - b.velocity(place),
    )


def _on_first(found: Touching, a: Moving, b: Moving) -> Touching:
    """The contact with its place moved from the second shape to the first."""
    place = found.place + found.gap * found.normal
    rate = found.place_rate + float(found.normal @ found.slide) * found.normal + found.gap * found.normal_rate
    return found._replace(place=place, place_rate=rate, slide=a.velocity(place) - b.velocity(place))


_Lying = tuple[float, Array, Array, Array, Array]


def _on_wall(shape: ConvexShape, own: Moving, wall: Wall, other: Moving) -> _Lying:
    """Gap, normal, its rate, point of contact and its rate of a convex shape on a wall, with the wall's normal."""
    if isinstance(wall, HalfSpace):
        return _on_plane(shape, own, wall, other)
    assert isinstance(shape, SphereShape)  # alone has a rule
    return _on_curve(shape, own, wall, other)


def _on_curve(sphere: SphereShape, own: Moving, wall: CurvedWall, other: Moving) -> _Lying:
    """Numbers of :func:`_on_wall` on a curved wall."""
    centre, axes = own.p + own.R @ sphere.centre, other.R @ wall.frame
    near = wall.near(axes.T @ (centre - other.p - other.R @ wall.point))
    n = axes @ near.normal
    slides = own.velocity(centre) - other.velocity(centre)  # of the centre over the wall's body
    n_rate = cross(other.w, n) + axes @ (near.bend @ (axes.T @ slides))
    place, rate = centre - sphere.radius * n, own.velocity(centre) - sphere.radius * n_rate
    return near.distance - sphere.radius, n, n_rate, place, rate


def _on_plane(shape: ConvexShape, own: Moving, plane: HalfSpace, other: Moving) -> _Lying:
    """Numbers of :func:`_on_wall` on a plane, of any convex shape."""
    n = other.R @ plane.normal
    n_rate = cross(other.w, n)
    point, by_direction = shape.support(-(own.R.T @ n))
    arm = own.R @ point
    turning = cross(own.w, n) - n_rate  # rate of the direction in the body's frame
    place = own.p + arm
    rate = own.v + cross(own.w, arm) + own.R @ (by_direction @ (own.R.T @ turning))
    gap = float(n @ (place - other.p - other.R @ plane.point))
    return gap, n, n_rate, place, rate


def _two_spheres(one: SphereShape, a: Moving, two: SphereShape, b: Moving) -> _Lying:
    centre_a, centre_b = a.p + a.R @ one.centre, b.p + b.R @ two.centre
    d, d_rate = centre_a - centre_b, a.velocity(centre_a) - b.velocity(centre_b)
    distance = float(np.linalg.norm(d))
    length = distance or 1.0  # a trial step may lay one centre on the other, where the normal is zero
    n = d / length
    n_rate = (d_rate - n * (n @ d_rate)) / length
    place, rate = centre_a - one.radius * n, a.velocity(centre_a) - one.radius * n_rate
    return distance - one.radius - two.radius, n, n_rate, place, rate


def _two_shafts(one: Shaft, a: Moving, two: Shaft, b: Moving) -> _Lying:
    """Numbers of :func:`_on_wall` of two round shafts that cross, where their axes are nearest."""
    u, w = a.R @ one.axis, b.R @ two.axis
    u_rate, w_rate = cross(a.w, u), cross(b.w, w)
    foot_a, foot_b = a.p + a.R @ one.point, b.p + b.R @ two.point
    d, d_rate = foot_a - foot_b, a.velocity(foot_a) - b.velocity(foot_b)
    across, across_rate = cross(u, w), cross(u_rate, w) + cross(u, w_rate)
    square = float(across @ across) or 1.0  # of parallel shafts, which have no normal
    ahead = b.R @ two.outward if isinstance(two, EdgeLine) else d
    sign = np.copysign(1.0, float(ahead @ across)) / np.sqrt(square)
    n, n_rate = sign * across, sign * across_rate
    n_rate = n_rate - n * (n @ n_rate)
    cosine, cosine_rate = float(u @ w), float(u_rate @ w + u @ w_rate)
    along_a, along_b = float(d @ u), float(d @ w)
    rate_a, rate_b = float(d_rate @ u + d @ u_rate), float(d_rate @ w + d @ w_rate)
    s = (cosine * along_b - along_a) / square
    s_rate = (cosine_rate * along_b + cosine * rate_b - rate_a + 2 * s * cosine * cosine_rate) / square
    place = foot_a + s * u - one.radius * n
    rate = a.velocity(foot_a) + s_rate * u + s * u_rate - one.radius * n_rate
    return float(n @ d) - one.radius - two.radius, n, n_rate, place, rate
