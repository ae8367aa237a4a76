"""Rotations as 3×3 matrices and scalar-first unit quaternions."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from proofroll.core.arrays import FloatArray

Array = FloatArray  # its short name, for signatures of mechanisms
# A vector in plain floats: numpy's calls for three numbers cost several times as much.
Floats3 = tuple[float, float, float]
_UNIT = np.eye(3)


def cross(a: Any, b: Any) -> Array:
    """Cross product of two 3-vectors; several times faster than :func:`numpy.cross` on one pair."""
    # arithmetic of Python's own numbers is faster than that of numpy's scalars
    a0, a1, a2 = a.tolist() if isinstance(a, np.ndarray) else a
    b0, b1, b2 = b.tolist() if isinstance(b, np.ndarray) else b
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def plain_cross(a: Sequence[float], b: Sequence[float]) -> Floats3:
    """:func:`cross` in plain floats."""
    a0, a1, a2 = a
    b0, b1, b2 = b
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


def dot(a: Array, b: Array) -> Any:
    """Product of two 3-vectors, as a plain float, or as a symbol of symbols."""
    return plain_dot(a.tolist(), b.tolist())


def plain_dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """:func:`dot` in plain floats or symbols."""
    (x, y, z), (u, v, w) = a, b
    return x * u + y * v + z * w


def square_of(a: Sequence[Any]) -> Any:
    """Square of the length of a vector in plain floats or symbols."""
    return plain_dot(a, a)


def plus(a: Sequence[float], b: Sequence[float]) -> Floats3:
    """Sum of two vectors in plain floats."""
    (x, y, z), (u, v, w) = a, b
    return x + u, y + v, z + w


def minus(a: Sequence[float], b: Sequence[float]) -> Floats3:
    """Difference of two vectors in plain floats."""
    (x, y, z), (u, v, w) = a, b
    return x - u, y - v, z - w


def scaled(factor: Any, a: Sequence[float]) -> Floats3:
    """Product of a number and a vector in plain floats."""
    x, y, z = a
    return factor * x, factor * y, factor * z


def turned(R: Sequence[Sequence[float]], a: Sequence[float]) -> Floats3:
    """Product of a matrix, by its rows, and a vector in plain floats."""
    x, y, z = a
    (a0, a1, a2), (b0, b1, b2), (c0, c1, c2) = R
    return a0 * x + a1 * y + a2 * z, b0 * x + b1 * y + b2 * z, c0 * x + c1 * y + c2 * z


def turned_back(R: Sequence[Sequence[float]], a: Sequence[float]) -> Floats3:
    """Product of the transpose of a matrix, by its rows, and a vector in plain floats."""
    x, y, z = a
    (a0, a1, a2), (b0, b1, b2), (c0, c1, c2) = R
    return a0 * x + b0 * y + c0 * z, a1 * x + b1 * y + c1 * z, a2 * x + b2 * y + c2 * z


def skew(a: Any) -> Array:
    """Matrix of the cross product: ``skew(a) @ b = a × b``."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


_SKEW = np.array([skew(e) for e in _UNIT]).reshape(3, 9)


def skews(a: Array) -> Array:
    """:func:`skew` of each vector of an array (..., 3), shape (..., 3, 3)."""
    matrices: Array = (a @ _SKEW).reshape(*a.shape, 3)
    return matrices


def about(axis: int, angle: Any) -> Array:
    """Rotation about a coordinate axis (0, 1, 2) by an angle, rad, or by a symbol of one."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    if isinstance(angle, (int, float)):
        c, s, R = math.cos(angle), math.sin(angle), _UNIT.copy()
    else:
        c, s, R = angle.applied("cos"), angle.applied("sin"), _UNIT.astype(object)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


def from_rotation_vector(turn: Array) -> Array:
    """Rotations about the axes of vectors by their lengths, rad, shape (…, 3); shape (…, 3, 3)."""
    K, angle = skews(turn), np.linalg.norm(turn, axis=-1)[..., None, None]
    R: Array = _UNIT + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * K @ K
    return R


def from_rpy(rpy: ArrayLike) -> Array:
    """Rotation of roll, pitch, yaw about fixed axes x, y, z, rad (URDF's convention)."""
    roll, pitch, yaw = np.asarray(rpy, dtype=float)
    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def to_rpy(R: Array) -> tuple[float, float, float]:
    """Roll, pitch, yaw (rad) of a rotation; roll is 0 where pitch is ±π/2, for only yaw ± roll is determinate there."""
    cosine = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], cosine)
    if cosine < 1e-9:
        return 0.0, pitch, math.atan2(-R[0, 1], R[1, 1])
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def from_quaternion(q: Any) -> Array:
    """Rotation matrix of a quaternion ``(w, x, y, z)`` of any length but zero."""
    w, x, y, z = q
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)],
        ]
    )


def to_quaternion(R: Array) -> Array:
    """Unit quaternions ``(w, x, y, z)`` with w ≥ 0 of rotations, shape (…, 3, 3).

    Each is the largest eigenvector of K (Bar-Itzhack 2000).
    """
    K = np.zeros((*R.shape[:-2], 4, 4))
    K[..., 0, 0] = trace = np.trace(R, axis1=-2, axis2=-1)
    K[..., 1:, 1:] = R + R.swapaxes(-1, -2) - trace[..., None, None] * _UNIT
    K[..., 1:, 0] = (R[..., [2, 0, 1], [1, 2, 0]]) - R[..., [1, 2, 0], [2, 0, 1]]
    q: Array = np.linalg.eigh(K, UPLO="L")[1][..., -1]
    return np.where(q[..., :1] >= 0, q, -q)


def quaternion_product(p: Array, q: Array) -> Array:
    """Quaternions of turning first by ``q``, then by ``p``, shapes (…, 4)."""
    w = p[..., :1] * q[..., :1] - (p[..., 1:] * q[..., 1:]).sum(axis=-1, keepdims=True)
    v = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([w, v], axis=-1)


def quaternion_of_vector(turn: Array) -> Array:
    """Unit quaternions of rotation vectors, rad, shape (…, 3); shape (…, 4)."""
    half = np.linalg.norm(turn, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), np.sinc(half / np.pi) * turn / 2], axis=-1)


def vector_of_quaternion(q: Array) -> Array:
    """Rotation vectors of at most half a turn, rad, of unit quaternions, shape (…, 4); shape (…, 3)."""
    q = np.where(q[..., :1] < 0, -q, q)
    half = np.arctan2(np.linalg.norm(q[..., 1:], axis=-1, keepdims=True), q[..., :1])
    return np.asarray(2 * q[..., 1:] / np.sinc(half / np.pi))


def quaternion_from_z(axis: Sequence[float]) -> tuple[float, float, float, float]:
    """A unit quaternion ``(w, x, y, z)`` that turns z to a unit vector; the turn about that does not matter."""
    x, y, z = axis
    size = math.sqrt(2.0 + 2.0 * abs(z))
    # the smallest turn from z, or one from -z after half a turn about x
    return ((1.0 + z) / size, -y / size, x / size, 0.0) if z >= 0.0 else (-y / size, (1.0 - z) / size, 0.0, x / size)


def quaternion_rate(q: Any, w: Any) -> Array:
    """Time derivative of a quaternion for an angular velocity ``w`` in body axes, rad/s."""
    q0, q1, q2, q3 = q
    x, y, z = w
    return 0.5 * np.array(
        [-q1 * x - q2 * y - q3 * z, q0 * x + q2 * z - q3 * y, q0 * y + q3 * x - q1 * z, q0 * z + q1 * y - q2 * x]
    )


def carried(vector: Array, start: Array, end: Array) -> Array:
    """A vector turned by the smallest rotation that takes a unit vector to another one less than a half turn away."""
    axis = plain_cross(start.tolist(), end.tolist())
    across = plain_cross(axis, vector.tolist())
    back = scaled(1.0 / (1.0 + dot(start, end)), plain_cross(axis, across))
    return np.array(plus(plus(vector.tolist(), across), back))


def frame_of_axis(z: ArrayLike, x: ArrayLike | None = None) -> Array:
    """Right-handed frame (columns x, y, z) with the axis ``z``; x is as near as possible to ``x``, or to a default."""
    a, b, c = _unit(*np.asarray(z, dtype=float).tolist())
    if x is None:
        x = (1.0, 0.0, 0.0) if abs(a) < 0.9 else (0.0, 1.0, 0.0)
    u, v, w = x if isinstance(x, tuple) else np.asarray(x, dtype=float).tolist()
    cosine = a * u + b * v + c * w
    u, v, w = _unit(u - a * cosine, v - b * cosine, w - c * cosine)
    return np.array([[u, b * w - c * v, a], [v, c * u - a * w, b], [w, a * v - b * u, c]])


def _unit(x: float, y: float, z: float) -> Floats3:
    length = math.sqrt(x * x + y * y + z * z) or math.nan
    return x / length, y / length, z / length


def from_z(axis: ArrayLike) -> Array:
    """Smallest rotation that turns z to a unit vector; about y where that is -z."""
    x, y, z = np.asarray(axis, dtype=float).tolist()
    across = x * x + y * y
    if not across:
        return np.diag([1.0 if z > 0 else -1.0, 1.0, 1.0 if z > 0 else -1.0])
    k = 1.0 / (1.0 + z) if z > 0 else (1.0 - z) / across  # the same number, each without cancellation
    return np.array([[1.0 - k * x * x, -k * x * y, x], [-k * x * y, 1.0 - k * y * y, y], [-x, -y, z]])
