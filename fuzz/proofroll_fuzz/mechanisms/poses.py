"""Poses of the bodies of a random mechanism at the start, from the joints of its scene file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from proofroll.adapter import WORLD, Array, JointKind, frame_of_axis, from_quaternion
from proofroll.elements.mechanism.scene.joint_kinds import SLIDING, WITH_QUATERNION
from proofroll.elements.mechanism.scene.rotations import from_rpy

_ZERO, _Z = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def floats(values: Any) -> list[float]:
    """A vector as a list of Python's own numbers."""
    return [float(value) for value in values]


class PosesAtStart:
    """Rotations and places of bodies against the world, exact for kinds of joints whose coordinates need no convention.

    These are revolute, prismatic, cylindrical, spherical, free and fixed joints; others count as if they stood at zero.
    """

    def __init__(self) -> None:
        self._poses: dict[str, tuple[Array, Array]] = {WORLD: (np.eye(3), np.zeros(3))}

    @classmethod
    def of(cls, tables: Mapping[str, Any]) -> Self:
        """Poses of a scene file, whose joints stand behind those of their parents."""
        poses = cls()
        for joint in tables["joints"]:
            poses.hang(joint)
        return poses

    def hang(self, joint: Mapping[str, Any]) -> None:
        """Adds the child of a joint."""
        self._poses[joint["child"]] = self._pose(joint)

    def _pose(self, joint: Mapping[str, Any]) -> tuple[Array, Array]:
        """Rotation and place of a joint's child in the world; exact for kinds whose coordinates need no convention."""
        R, place = self._poses[joint["parent"]]
        place = place + R @ np.array(joint.get("position", _ZERO), dtype=float)
        R = R @ from_rpy(joint.get("orientation", _ZERO))
        kind, coordinates = joint["kind"], joint.get("q0")
        if "motion" in joint:
            coordinates = float(joint["motion"].split()[1])  # "= START + …", where the rest is zero at first
        if coordinates is not None and kind in {JointKind.REVOLUTE, JointKind.PRISMATIC, JointKind.CYLINDRICAL}:
            frame = frame_of_axis(joint.get("axis", _Z))
            slide, angle = coordinates if kind == JointKind.CYLINDRICAL else (coordinates, coordinates)
            if kind in SLIDING:
                place = place + R @ frame[:, 2] * slide
            if kind != JointKind.PRISMATIC:
                turn = np.array(
                    [[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]
                )
                R = R @ frame @ turn @ frame.T
        elif coordinates is not None and kind in WITH_QUATERNION:
            place = place + R @ np.array(coordinates[:-4] or [0.0, 0.0, 0.0])
            R = R @ from_quaternion(coordinates[-4:])
        return R, place - R @ np.array(joint.get("child_position", _ZERO), dtype=float)

    def in_body(self, body: str, point: Array) -> list[float]:
        """Place in a body's frame of a point of the world at the start."""
        R, place = self._poses[body]
        return floats(R.T @ (point - place))

    def along(self, body: str, direction: Array) -> list[float]:
        """Direction in a body's frame of a direction of the world at the start."""
        return floats(self._poses[body][0].T @ direction)

    def rotation(self, body: str) -> Array:
        """Rotation of a body against the world at the start."""
        return self._poses[body][0]

    def place(self, body: str) -> Array:
        """Place of a body's frame in the world at the start."""
        return self._poses[body][1]
