"""Vector algebra over any scalars: floats, long doubles, expressions of heyoka.

Plain float zeros and ones are folded away: terms that vanish by a mechanism's geometry are never formed. Vectors of
plain floats are multiplied as they are; adding 0.0 leaves no negative zero, as folding leaves none.
"""

from collections.abc import Sequence
from typing import Any

Scalar = Any
Vector = Sequence[Scalar]
_ZERO, _FOLDED = 0.0, (0.0, 1.0)


def clean(vector: Any) -> list[float]:
    """Plain floats, with round-off removed from zeros and ones so that they fold."""
    return [float(round(x)) if abs(x - round(x)) < 1e-15 else float(x) for x in vector]


def is_zero(a: Scalar) -> bool:
    """True for the plain float zero."""
    return type(a) is float and a == 0.0


def mul(a: Scalar, b: Scalar) -> Scalar:
    """Product a·b."""
    if type(a) is float and a in _FOLDED:
        return b if a else _ZERO
    if type(b) is float and b in _FOLDED:
        return a if b else _ZERO
    return a * b


def add(*terms: Scalar) -> Scalar:
    """Sum of the terms."""
    total: Scalar = _ZERO
    for term in terms:
        if type(term) is not float or term:
            total = term if type(total) is float and not total else total + term
    return total


def sub(a: Scalar, b: Scalar) -> Scalar:
    """Difference a − b."""
    if is_zero(b):
        return a
    return -b if is_zero(a) else a - b


def dot(a: Vector, b: Vector) -> Scalar:
    """Scalar product a·b in space."""
    (ax, ay, az), (bx, by, bz) = a, b
    if type(ax) is type(ay) is type(az) is type(bx) is type(by) is type(bz) is float:
        return 0.0 + ax * bx + ay * by + az * bz
    return add(mul(ax, bx), mul(ay, by), mul(az, bz))


def cross(a: Vector, b: Vector) -> list[Scalar]:
    """Vector product a×b."""
    (ax, ay, az), (bx, by, bz) = a, b
    if type(ax) is type(ay) is type(az) is type(bx) is type(by) is type(bz) is float:
        return [ay * bz - az * by + 0.0, az * bx - ax * bz + 0.0, ax * by - ay * bx + 0.0]
    return [sub(mul(ay, bz), mul(az, by)), sub(mul(az, bx), mul(ax, bz)), sub(mul(ax, by), mul(ay, bx))]


def plus(*vectors: Vector) -> list[Scalar]:
    """Sum of vectors."""
    return list(map(add, *vectors))


def minus(a: Vector, b: Vector) -> list[Scalar]:
    """Difference a − b of vectors."""
    return list(map(sub, a, b))


def scaled(factor: Scalar, a: Vector) -> list[Scalar]:
    """Product factor·a."""
    return [mul(factor, x) for x in a]


def turned(R: Sequence[Vector], a: Vector) -> list[Scalar]:
    """Product R a; R is a list of rows."""
    return [dot(row, a) for row in R]


def turned_back(R: Sequence[Vector], a: Vector) -> list[Scalar]:
    """Product Rᵀ a."""
    return [dot(column, a) for column in zip(*R, strict=True)]


def product(R: Sequence[Vector], S: Sequence[Vector]) -> list[list[Scalar]]:
    """Product R S."""
    return [[dot(row, column) for column in zip(*S, strict=True)] for row in R]


def of_quaternion(q: Vector) -> tuple[Vector, Vector, Vector]:
    """Rotation by rows of a unit quaternion, scalar first."""
    a, b, c, d = q
    return (
        (1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)),
        (2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b)),
        (2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)),
    )


def quaternion_rate(q: Vector, w: Vector) -> list[Scalar]:
    """Rate of a unit quaternion by the angular velocity in the axes that it turns."""
    (a, b, c, d), (x, y, z) = q, w
    return [
        -0.5 * (b * x + c * y + d * z),
        0.5 * (a * x + c * z - d * y),
        0.5 * (a * y + d * x - b * z),
        0.5 * (a * z + b * y - c * x),
    ]
