"""Integrals over a piece from its values at Chebyshev points, and small vector algebra on arrays of points."""

import numpy as np
from numpy.polynomial import chebyshev

from proofroll.truth.check.laws.record import Array

COUNT = 12  # points of a piece: they resolve a turn of 1 rad to the last digit
POINTS: Array = -np.cos(np.pi * np.arange(COUNT) / (COUNT - 1))
IN_PLANE = 1e-12  # component of a unit direction that is round-off
RESOLVED = 1e-13  # last coefficients of a series, relative to its size, that are round-off
TO_SERIES: Array = np.linalg.inv(np.asarray(chebyshev.chebvander(POINTS, COUNT - 1), np.float64))
_INTEGRALS = [chebyshev.chebval(POINTS, chebyshev.chebint(series, lbnd=-1)) for series in np.eye(COUNT)]
_TO_EACH: Array = np.array(_INTEGRALS).T @ TO_SERIES


def integral(values: Array, pace: Array) -> Array:
    """Integrals over time from the start of each piece to each of its points; values (pieces, points, …)."""
    weighted = values * pace.reshape(pace.shape + (1,) * (values.ndim - 2))
    return np.asarray(np.einsum("kn,sn...->sk...", _TO_EACH, weighted))


def since_start(values: Array) -> Array:
    """Values minus those at the start of each piece."""
    return values - values[:, :1]


def tail(values: Array, pace: Array) -> Array:
    """Part of an integral that the points of a piece do not resolve: its last two coefficients, (pieces, 1, …)."""
    weighted = values * pace.reshape(pace.shape + (1,) * (values.ndim - 2))
    return np.asarray(2 * np.abs(np.einsum("kn,sn...->sk...", TO_SERIES[-2:], weighted)).max(1)[:, None])


def dot(a: Array, b: Array) -> Array:
    """Scalar products."""
    return np.asarray(np.sum(a * b, -1))


def cross(a: Array, b: Array) -> Array:
    """Vector products, in half the time of numpy's for few vectors."""
    return np.asarray(a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]])


def along(vectors: Array, directions: Array) -> Array:
    """Parts of vectors along unit directions, unknown only where a component that they use is NaN."""
    return dot(np.where(np.abs(directions) < IN_PLANE, 0.0, vectors), directions)


def norm(a: Array) -> Array:
    """Lengths of vectors."""
    return np.asarray(np.sqrt(np.sum(a * a, -1)))


def turned(R: Array, x: Array) -> Array:
    """Vectors R x."""
    return np.asarray((R @ x[..., None])[..., 0])


def turned_back(R: Array, x: Array) -> Array:
    """Vectors Rᵀ x."""
    return np.asarray((x[..., None, :] @ R)[..., 0, :])


def frame_of(z: Array, x: Array | None = None) -> Array:
    """Axes, as columns, whose third is z; the first lies nearest to x, by default of the scene format's choice."""
    z = np.asarray(z, float) / np.linalg.norm(z)
    default = (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0)
    x = np.array(default if x is None else x, float)
    x = x - z * (z @ x)
    x = x / np.linalg.norm(x)
    return np.stack([x, cross(z, x), z], -1)


def of_angles(angles: Array) -> Array:
    """Rotation by roll, pitch and yaw about fixed axes [rad]."""
    rotation = np.eye(3)
    for axis, angle in enumerate(angles):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        step = np.eye(3)
        step[i, i] = step[j, j] = np.cos(angle)
        step[i, j], step[j, i] = -np.sin(angle), np.sin(angle)
        rotation = step @ rotation
    return rotation


def of_quaternion(q: Array) -> Array:
    """Rotation of a unit quaternion, scalar first."""
    s, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - s * z), 2 * (x * z + s * y)],
        [2 * (x * y + s * z), 1 - 2 * (x * x + z * z), 2 * (y * z - s * x)],
        [2 * (x * z - s * y), 2 * (y * z + s * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.asarray(np.moveaxis(np.array(rows), (0, 1), (-2, -1)))
