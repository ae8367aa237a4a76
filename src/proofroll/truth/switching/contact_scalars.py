"""Gap, normal, point of contact and rates of two shapes, in any scalars: the geometry of contacts as symbols.

It repeats :mod:`proofroll.elements.mechanism.contact.touching` for symbols, from which right-hand sides are compiled.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.features import Border, CapsuleFeatures, SolidFeatures
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import (
    CircleShape,
    ConvexShape,
    EllipsoidShape,
    HalfSpace,
    Shape,
    SphereShape,
    Wall,
)
from proofroll.elements.mechanism.scene.shapes.walls import ConeWall, CurvedWall, Shaft
from proofroll.truth.numerics.scalars import (
    Scalar,
    add,
    cross,
    dot,
    minus,
    mul,
    plus,
    product,
    scaled,
    sub,
    turned,
    turned_back,
)

# Square of a sine far below that of a flat disc (touching.FLAT): a disc exactly flat in flight has numbers.
_LEAST = 1e-32

Vector = Sequence[Scalar]
Root = Callable[[Scalar], Scalar]


class ScalarMotion(NamedTuple):
    """Motion of a body: place of its frame, rotation by rows, velocity of the origin, angular velocity; world axes."""

    p: Vector
    R: Sequence[Vector]
    v: Vector
    w: Vector

    def velocity(self, place: Vector) -> list[Scalar]:
        """Velocity of the body's material at a place in the world [m/s]."""
        return plus(self.v, cross(self.w, minus(place, self.p)))


class ScalarTouch(NamedTuple):
    """A contact at one instant; see :class:`proofroll.elements.mechanism.contact.touching.Touching`."""

    gap: Scalar
    normal: Vector
    normal_rate: Vector
    place: Vector
    place_rate: Vector
    slide: Vector
    tilt: Scalar = 1.0
    borders: Sequence[Border] = ()

    def across(self, vector: Vector) -> list[Scalar]:
        """Part of a vector along the surfaces."""
        return minus(vector, scaled(dot(self.normal, vector), self.normal))


def touch_in_scalars(
    contact: BodyContact, a: ScalarMotion, b: ScalarMotion, root: Root, feature: int = 0
) -> ScalarTouch:
    """Contact at given motions of its bodies; ``root``: square root for the scalars; ``feature``: of solids."""
    features = contact.features
    if features is None:
        touch = _touch(contact.shape_a, a, contact.shape_b, b, root)
        ends = ((contact.shape_a, a), (contact.shape_b, b))
        for (shape, body), (partner, of) in (ends, ends[::-1]):
            if isinstance(shape, CircleShape):
                leaning = cross(turned(body.R, floats(shape.normal)), touch.normal)
                touch = touch._replace(tilt=root(dot(leaning, leaning)))
            elif isinstance(shape, ConeWall) and isinstance(partner, SphereShape):
                centre = minus(plus(of.p, turned(of.R, floats(partner.centre))), body.p)
                seen = minus(turned_back(body.R, centre), floats(shape.point))
                beside = cross(floats(shape.axis), seen)
                touch = touch._replace(tilt=mul(1 / (partner.radius or 1.0) ** 2, dot(beside, beside)))
        return touch
    *measures, tilt = _measures(features, a, b, root)
    shape_a, shape_b = features.shapes(feature)
    touch = _touch(shape_a, a, shape_b, b, root)
    if isinstance(shape_a, Wall) and not isinstance(shape_b, Wall):
        place = plus(touch.place, scaled(touch.gap, touch.normal))
        rate = plus(touch.place_rate, scaled(dot(touch.normal, touch.slide), touch.normal))
        rate = plus(rate, scaled(touch.gap, touch.normal_rate))
        touch = touch._replace(place=place, place_rate=rate, slide=minus(a.velocity(place), b.velocity(place)))
    tilt = tilt if features.needs_angle(feature) else 1.0
    return touch._replace(tilt=tilt, borders=features.borders(feature, *measures))


def _measures(features: SolidFeatures, a: ScalarMotion, b: ScalarMotion, root: Root) -> tuple[Scalar, ...]:
    """Measures of two solids, and the sine of the angle between two capsules, or 1."""
    of_a, of_b = features.centres
    apart = minus(plus(a.p, turned(a.R, floats(of_a))), plus(b.p, turned(b.R, floats(of_b))))
    if isinstance(features, CapsuleFeatures):
        u, w = turned(a.R, floats(features.first.axis)), turned(b.R, floats(features.second.axis))
        across = cross(u, w)
        return dot(apart, u), dot(apart, w), dot(u, w), root(dot(across, across) + _LEAST)
    R, apart = (b.R, apart) if features.ball_first else (a.R, scaled(-1.0, apart))
    return *turned_back(product(R, [floats(row) for row in features.axes]), apart), 1.0


def _touch(shape_a: Shape, a: ScalarMotion, shape_b: Shape, b: ScalarMotion, root: Root) -> ScalarTouch:
    """Contact of two shapes with one rule."""
    if isinstance(shape_a, Shaft) and isinstance(shape_b, Shaft):
        gap, n, n_rate, place, rate = _two_shafts(shape_a, a, shape_b, b, root)
    elif isinstance(shape_b, Wall):
        assert not isinstance(shape_a, Wall)  # two walls are no contact
        gap, n, n_rate, place, rate = _on_wall(shape_a, a, shape_b, b, root)
    elif isinstance(shape_a, Wall):
        gap, n, n_rate, place, rate = _on_wall(shape_b, b, shape_a, a, root)
        n, n_rate = scaled(-1.0, n), scaled(-1.0, n_rate)
    else:
        assert isinstance(shape_a, SphereShape)
        assert isinstance(shape_b, SphereShape)
        gap, n, n_rate, place, rate = _two_spheres(shape_a, a, shape_b, b, root)
    return ScalarTouch(
        gap=gap,
        normal=n,
        normal_rate=n_rate,
        place=place,
        place_rate=rate,
        slide=minus(a.velocity(place), b.velocity(place)),
    )


def floats(vector: Array) -> list[float]:
    """Components as plain floats, so that zeros and ones fold."""
    return [float(x) for x in vector]


_Lying = tuple[Scalar, Vector, Vector, Vector, Vector]


def _on_wall(shape: ConvexShape, body: ScalarMotion, wall: Wall, wall_body: ScalarMotion, root: Root) -> _Lying:
    """Gap, normal, its rate, point of contact and its rate of a convex shape on a wall."""
    if isinstance(wall, HalfSpace):
        return _on_plane(shape, body, wall, wall_body, root)
    assert isinstance(shape, SphereShape)  # alone has a rule
    return _on_curve(shape, body, wall, wall_body)


def _on_curve(sphere: SphereShape, body: ScalarMotion, wall: CurvedWall, wall_body: ScalarMotion) -> _Lying:
    centre = plus(body.p, turned(body.R, floats(sphere.centre)))
    axes = product(wall_body.R, [floats(row) for row in wall.frame])
    foot = plus(wall_body.p, turned(wall_body.R, floats(wall.point)))
    distance, normal, bend = wall.near_in_scalars(turned_back(axes, minus(centre, foot)))
    n = turned(axes, normal)
    slides = minus(body.velocity(centre), wall_body.velocity(centre))
    n_rate = plus(cross(wall_body.w, n), turned(axes, turned(bend, turned_back(axes, slides))))
    place = minus(centre, scaled(sphere.radius, n))
    rate = minus(body.velocity(centre), scaled(sphere.radius, n_rate))
    return sub(distance, sphere.radius), n, n_rate, place, rate


def _on_plane(shape: ConvexShape, body: ScalarMotion, plane: HalfSpace, wall_body: ScalarMotion, root: Root) -> _Lying:
    n = turned(wall_body.R, floats(plane.normal))
    n_rate = cross(wall_body.w, n)
    turning = minus(cross(body.w, n), n_rate)  # minus the rate of the direction, as the body's axes turn with it
    arm, moved = _support(shape, body.R, n, turning, root)
    place = plus(body.p, arm)
    rate = plus(plus(body.v, cross(body.w, arm)), moved)
    gap = dot(n, minus(place, plus(wall_body.p, turned(wall_body.R, floats(plane.point)))))
    return gap, n, n_rate, place, rate


def _support(
    shape: ConvexShape, R: Sequence[Vector], n: Vector, turning: Vector, root: Root
) -> tuple[list[Scalar], list[Scalar]]:
    """Farthest point against n from the body's origin, and its rate over the body where −n turns; world axes."""
    centre = turned(R, floats(shape.centre))
    if isinstance(shape, SphereShape):
        return minus(centre, scaled(shape.radius, n)), scaled(shape.radius, turning)
    if isinstance(shape, CircleShape):
        axis = turned(R, floats(shape.normal))
        beside = plus(scaled(-1.0, n), scaled(dot(n, axis), axis))
        beside = minus(beside, scaled(dot(beside, axis), axis))  # of a disc that is almost flat round-off is left
        length = root(dot(beside, beside) + _LEAST)
        e = scaled(1.0 / length, beside)
        flat = minus(minus(turning, scaled(dot(axis, turning), axis)), scaled(dot(e, turning), e))
        return plus(centre, scaled(shape.radius, e)), scaled(shape.radius / length, flat)
    assert isinstance(shape, EllipsoidShape)
    Q = [floats(row) for row in (shape.frame * shape.axes**2) @ shape.frame.T]
    d, way = scaled(-1.0, turned_back(R, n)), turned_back(R, turning)
    image, image_of_way = turned(Q, d), turned(Q, way)
    h = root(dot(d, image))
    moved = minus(scaled(1.0 / h, image_of_way), scaled(dot(image, way) / (h * h * h), image))
    return plus(centre, turned(R, scaled(1.0 / h, image))), turned(R, moved)


def _two_spheres(sphere_a: SphereShape, a: ScalarMotion, sphere_b: SphereShape, b: ScalarMotion, root: Root) -> _Lying:
    centre_a = plus(a.p, turned(a.R, floats(sphere_a.centre)))
    centre_b = plus(b.p, turned(b.R, floats(sphere_b.centre)))
    d, d_rate = minus(centre_a, centre_b), minus(a.velocity(centre_a), b.velocity(centre_b))
    distance = root(dot(d, d))
    n = scaled(1.0 / distance, d)
    n_rate = scaled(1.0 / distance, minus(d_rate, scaled(dot(n, d_rate), n)))
    place = minus(centre_a, scaled(sphere_a.radius, n))
    rate = minus(a.velocity(centre_a), scaled(sphere_a.radius, n_rate))
    return sub(distance, sphere_a.radius + sphere_b.radius), n, n_rate, place, rate


def _two_shafts(shaft_a: Shaft, a: ScalarMotion, shaft_b: Shaft, b: ScalarMotion, root: Root) -> _Lying:
    u, w = turned(a.R, floats(shaft_a.axis)), turned(b.R, floats(shaft_b.axis))
    u_rate, w_rate = cross(a.w, u), cross(b.w, w)
    foot_a = plus(a.p, turned(a.R, floats(shaft_a.point)))
    foot_b = plus(b.p, turned(b.R, floats(shaft_b.point)))
    d, d_rate = minus(foot_a, foot_b), minus(a.velocity(foot_a), b.velocity(foot_b))
    across, across_rate = cross(u, w), plus(cross(u_rate, w), cross(u, w_rate))
    square, apart = dot(across, across), dot(d, across)
    factor = apart / (root(mul(apart, apart)) * root(square))  # the sign of ``apart``
    n, n_rate = scaled(factor, across), scaled(factor, across_rate)
    n_rate = minus(n_rate, scaled(dot(n, n_rate), n))
    cosine, cosine_rate = dot(u, w), add(dot(u_rate, w), dot(u, w_rate))
    along_a, along_b = dot(d, u), dot(d, w)
    rate_a, rate_b = add(dot(d_rate, u), dot(d, u_rate)), add(dot(d_rate, w), dot(d, w_rate))
    s = sub(mul(cosine, along_b), along_a) / square
    turning = mul(2.0, mul(s, mul(cosine, cosine_rate)))
    s_rate = add(sub(add(mul(cosine_rate, along_b), mul(cosine, rate_b)), rate_a), turning) / square
    place = minus(plus(foot_a, scaled(s, u)), scaled(shaft_a.radius, n))
    rate = plus(plus(a.velocity(foot_a), scaled(s_rate, u)), scaled(s, u_rate))
    return (
        sub(dot(n, d), shaft_a.radius + shaft_b.radius),
        n,
        n_rate,
        place,
        minus(rate, scaled(shaft_a.radius, n_rate)),
    )


def known_shapes(contact: BodyContact) -> bool:
    """True if both shapes have a rule here."""
    rules = SphereShape | EllipsoidShape | CircleShape | HalfSpace | CurvedWall
    shapes = contact.shape_a, contact.shape_b
    simple = all(isinstance(shape, rules) and getattr(shape, "has_formula", True) for shape in shapes)
    return simple or contact.features is not None
