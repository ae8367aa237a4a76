"""Poses and turns between proofroll's arrays and Rapier's types."""

from __future__ import annotations

from typing import Any

import numpy as np
import rapier3d

from proofroll.adapter import Array, to_quaternion


def isometry(place: Any, rotation: Any) -> Any:
    """Rapier's pose of a place [m] and a rotation matrix."""
    return rapier3d.Isometry3(tuple(np.array(place, float)), turn(rotation))


def turn(rotation: Any) -> Any:
    """Rapier's quaternion of a rotation matrix."""
    return rapier3d.Rotation3(*to_quaternion(np.array(rotation, float)))


def quaternion(rotation: Any) -> Array:
    """Unit quaternion, scalar first, of Rapier's, which it gives with the scalar last and in 24 bits."""
    x, y, z, w = rotation.to_tuple()
    found = np.array([w, x, y, z], float)
    return np.asarray(found / np.linalg.norm(found))


def vector(values: Any) -> Array:
    """Array of a vector of Rapier."""
    return np.array([values.x, values.y, values.z], float)
