"""Scene files of mechanisms in a world whose axes are turned and whose origin lies elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from proofroll.adapter import WORLD, Array, JointKind
from proofroll.elements.mechanism.scene.rotations import from_rpy, to_rpy
from proofroll_fuzz.mechanisms.poses import floats

_O, _Z = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
# Keys of rows of the world that have a direction, also where a row leaves out its default.
_DIRECTIONS = {"plane": ("normal",), "bore": ("axis",), "shaft": ("axis",)}
_ALONG_Z = (JointKind.REVOLUTE, JointKind.CYLINDRICAL, JointKind.PLANAR, JointKind.PRISMATIC)


class Turn:
    """A rotation of the world followed by a shift.

    Args:
        rotation: of all that is fixed in the world.
        shift: [m].
    """

    def __init__(self, rotation: Array, shift: Array) -> None:
        self._R, self._shift = rotation, shift

    def __call__(self, tables: dict[str, Any]) -> None:
        """Turns and shifts the content of a scene file, which changes."""
        self._direction(tables["gravity"], "direction")
        for joint in tables["joints"]:
            if joint["parent"] == WORLD:
                self._place(joint, "position")
                self._orientation(joint, "orientation")
        for table in ("loops", "springs", "bushings"):
            for row in tables.get(table, ()):
                for side in "ab":
                    if row[f"body_{side}"] == WORLD:
                        self._end(row, side, table)
        for row in tables.get("forces", ()):
            if row.get("frame", WORLD) == WORLD:
                self._direction(row, "value")
        for row in tables.get("geometries", ()):
            if row["body"] == WORLD:
                self._place(row, "position")
                for key in _DIRECTIONS.get(row["kind"], ()):
                    self._direction(row, key)

    def _end(self, row: dict[str, Any], side: str, table: str) -> None:
        """Turns the end of a loop, spring or bushing that is fixed in the world."""
        self._place(row, f"position_{side}")
        if f"axis_{side}" in row or (table == "loops" and row["kind"] in _ALONG_Z and side == "a"):
            self._direction(row, f"axis_{side}")
        if table == "bushings":
            self._orientation(row, f"orientation_{side}")
        if table == "loops" and row["kind"] in {JointKind.FIXED, JointKind.PRISMATIC}:
            self._orientation(row, "orientation", inverse=side == "b")

    def _place(self, row: dict[str, Any], key: str) -> None:
        row[key] = floats(self._R @ np.array(row.get(key, _O), dtype=float) + self._shift)

    def _direction(self, row: dict[str, Any], key: str) -> None:
        row[key] = floats(self._R @ np.array(row.get(key, _Z), dtype=float))

    def _orientation(self, row: dict[str, Any], key: str, inverse: bool = False) -> None:
        frame = from_rpy(row.get(key, _O))
        row[key] = floats(to_rpy(frame @ self._R.T if inverse else self._R @ frame))
