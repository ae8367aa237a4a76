"""What the coordinates and velocities of each kind of joint do, in its frames A (parent) and B (child)."""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism.rotations import Array, about, from_quaternion, quaternion_rate

_O, _UNIT = np.zeros(3), np.eye(3)
# Of each velocity: whether its axis is one of B, not of A; which; whether it turns about it; whether the child carries
# the axis round, not the parent. Of three turns about axes of the child the sum does not turn itself: ω × ω = 0.
AXES: dict[str, tuple[tuple[bool, int, bool, bool], ...]] = {
    "fixed": (),
    "revolute": ((False, 2, True, False),),
    "prismatic": ((False, 2, False, False),),
    "universal": ((False, 2, True, False), (True, 0, True, True)),
    "spherical": tuple((True, axis, True, False) for axis in range(3)),
    "planar": ((False, 0, False, False), (False, 1, False, False), (False, 2, True, False)),
    "free": tuple((True, axis, turns, not turns) for turns in (False, True) for axis in range(3)),
}


def placed(kind: str, q: Array) -> tuple[Array, Array]:
    """Where B stands in A: its origin, m, and its rotation."""
    origin, rotation = _O, _UNIT
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


def rate(kind: str, q: Array, v: Array) -> Array:
    """Rate of a joint's coordinates."""
    if kind == "spherical":
        return quaternion_rate(q, v)
    if kind == "free":
        return np.concatenate([from_quaternion(q[3:]) @ v[:3], quaternion_rate(q[3:], v[3:])])
    return v
