"""Contact of two bodies: gap, normal, point of contact, and their rates."""

from typing import NamedTuple

import numpy as np

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism.contacts.geometry import BodyContact
from proofroll.elements.mechanism.contacts.shapes import CircleShape, ConvexShape, HalfSpace, SphereShape, Wall
from proofroll.elements.mechanism.contacts.walls import CurvedWall
from proofroll.elements.mechanism.rotations import Array, cross

# Sine of the angle between a disc and its plane up to which it lies flat: digits of a file.
FLAT = 1e-9


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
            spheres on a [m].
        place_rate: velocity of that point in the world, as it moves over both bodies [m/s].
        slide: velocity of a's material relative to b's at that point [m/s]; along the normal it is the gap's rate.
        tilt: sine of the angle between a disc and its plane; 1 for other shapes.
    """

    gap: float
    normal: Array
    normal_rate: Array
    place: Array
    place_rate: Array
    slide: Array
    tilt: float = 1.0

    @property
    def flat(self) -> bool:
        """True for a disc that lies on its plane, so that it touches along its whole edge and not at one point."""
        return self.tilt <= FLAT


def lying(name: str, time: float) -> NotUnique:
    """Error of a disc that lies flat from a time on [s]."""
    return NotUnique(
        f"the disc of {name} lies flat at t = {time:.6g} s: what its whole edge does at once is not determinate; end "
        "before, or give it three spheres"
    )


def torn(name: str, time: float) -> NotUnique:
    """Error of Painlevé's paradox at a contact, from a time on [s]."""
    return NotUnique(
        f"{name} would not press but tear from t = {time:.6g} s on: its friction makes what follows not unique or not "
        "possible (Painlevé)"
    )


def touch(contact: BodyContact, a: Moving, b: Moving) -> Touching:
    """Gap, normal, point of contact and rates of a contact at given motions of its bodies."""
    if isinstance(contact.shape_b, Wall):
        assert not isinstance(contact.shape_a, Wall)  # two walls are no contact
        gap, n, n_rate, place, rate = _on_wall(contact.shape_a, a, contact.shape_b, b)
    elif isinstance(contact.shape_a, Wall):
        gap, n, n_rate, place, rate = _on_wall(contact.shape_b, b, contact.shape_a, a)
        n, n_rate = -n, -n_rate
    else:
        assert isinstance(contact.shape_a, SphereShape)
        assert isinstance(contact.shape_b, SphereShape)
        gap, n, n_rate, place, rate = _two_spheres(contact.shape_a, a, contact.shape_b, b)
    discs = ((contact.shape_a, a), (contact.shape_b, b))
    tilts = (float(np.linalg.norm(cross(of.R @ disc.normal, n))) for disc, of in discs if isinstance(disc, CircleShape))
    return Touching(
        gap=gap,
        normal=n,
        normal_rate=n_rate,
        place=place,
        place_rate=rate,
        slide=a.velocity(place) - b.velocity(place),
        tilt=next(tilts, 1.0),
    )


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
