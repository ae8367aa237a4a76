"""What the coordinates and velocities of each kind of joint do, in its frames A (parent) and B (child)."""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism.rotations import Array, about, cross, from_quaternion, quaternion_rate

_O = np.zeros(3)


def placed(kind: str, q: Array) -> tuple[Array, Array]:
    """Where B stands in A: its origin, m, and its rotation."""
    origin, rotation = _O, np.eye(3)
    if kind == "revolute":
        rotation = about(2, q[0])
    elif kind == "prismatic":
        origin = np.array([0.0, 0.0, q[0]])
    elif kind == "universal":
        rotation = about(2, q[0]) @ about(0, q[1])
    elif kind == "spherical":
        rotation = from_quaternion(q)
    elif kind == "planar":
        origin, rotation = np.array([q[0], q[1], 0.0]), about(2, q[2])
    elif kind == "free":
        origin, rotation = q[:3], from_quaternion(q[3:])
    return origin, rotation


def subspace(kind: str, A: Array, B: Array, v: Array, w: Array) -> tuple[Array, Array, Array, Array]:
    """What velocities v do to B against the parent, world axes.

    Args:
        kind: of the joint.
        A: its frame on the parent, world axes.
        B: its frame on the child, world axes.
        v: its velocities (nv).
        w: angular velocity of the parent, rad/s.

    Returns:
        Columns of linear and of angular velocity (3, nv), and the rate of the columns, world axes, times v.
    """
    linear, angular = np.zeros((3, len(v))), np.zeros((3, len(v)))
    linear_bias, angular_bias = _O, _O
    if kind == "revolute":
        angular = A[:, 2:]
        angular_bias = cross(w, A[:, 2]) * v[0]
    elif kind == "prismatic":
        linear = A[:, 2:]
        linear_bias = cross(w, A[:, 2]) * v[0]
    elif kind == "universal":  # the first axis turns with the parent, the second with the child
        angular = np.column_stack([A[:, 2], B[:, 0]])
        first = A[:, 2] * v[0]
        angular_bias = cross(w, first) + cross(w + first, B[:, 0] * v[1])
    elif kind == "spherical":
        angular = B
        angular_bias = cross(w, B @ v)
    elif kind == "planar":
        linear[:, :2], angular[:, 2] = A[:, :2], A[:, 2]
        linear_bias, angular_bias = cross(w, linear @ v), cross(w, angular @ v)
    elif kind == "free":
        linear[:, :3], angular[:, 3:] = B, B
        turn = angular @ v
        linear_bias, angular_bias = cross(w + turn, linear @ v), cross(w, turn)
    return linear, angular, linear_bias, angular_bias


def rate(kind: str, q: Array, v: Array) -> Array:
    """Rate of a joint's coordinates."""
    if kind == "spherical":
        return quaternion_rate(q, v)
    if kind == "free":
        return np.concatenate([from_quaternion(q[3:]) @ v[:3], quaternion_rate(q[3:], v[3:])])
    return v
