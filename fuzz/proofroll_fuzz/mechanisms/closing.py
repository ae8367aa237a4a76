"""Closes loops and contacts of a scene file anew, after its lengths have changed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.adapter import Array, JointKind, frame_of_axis
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE
from proofroll.elements.mechanism.scene.rotations import from_rpy, to_rpy
from proofroll_fuzz.mechanisms.poses import PosesAtStart, floats

_O, _X, _Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def close(tables: dict[str, Any], former: Mapping[str, Any]) -> None:
    """Moves the second point of each loop onto the first, and each touching body to its former distance.

    Args:
        tables: content of a scene file, which changes.
        former: content before its lengths changed.
    """
    poses = PosesAtStart.of(tables)
    for row in tables.get("loops", ()):
        _close_loop(row, poses)
    former_poses, pairs = PosesAtStart.of(former), {row["name"]: row for row in former.get("pairs", ())}
    for row in tables.get("pairs", ()):
        distance, _ = _gap(former, former_poses, pairs[row["name"]])
        _move_upper(tables, row, distance)


def extent(geometry: Mapping[str, Any], direction: Array) -> float:
    """Distance from the centre of a geometry to its outermost point along a direction of its body [m]."""
    kind, radius = geometry["kind"], geometry.get("radius", 0.0)
    if kind == "sphere":
        return float(radius)
    if kind == "ellipsoid":
        return float(np.linalg.norm(np.array(geometry["axes"]) * direction))
    if kind == "box":
        return float(np.abs(direction) @ np.array(geometry["size"])) / 2
    axis = np.array(geometry.get("axis", _Z))
    cosine = abs(float(axis @ direction)) / float(np.linalg.norm(axis))
    across = 1.0 if kind == "capsule" else float(np.sqrt(max(0.0, 1 - cosine**2)))
    return float(geometry["length"] / 2 * cosine + radius * across)


def _close_loop(row: dict[str, Any], poses: PosesAtStart) -> None:
    kind, (a, b) = row["kind"], (row["body_a"], row["body_b"])
    point = poses.place(a) + poses.rotation(a) @ np.array(row.get("position_a", _O))
    if kind == DISTANCE:
        end = poses.place(b) + poses.rotation(b) @ np.array(row.get("position_b", _O))
        row["length"] = float(np.linalg.norm(end - point))
        return
    row["position_b"] = poses.in_body(b, point)
    axis = poses.rotation(a) @ np.array(row.get("axis_a", _Z))
    if kind == JointKind.UNIVERSAL:
        row["axis_b"] = poses.along(b, frame_of_axis(axis)[:, 0])
    elif kind in {JointKind.REVOLUTE, JointKind.CYLINDRICAL, JointKind.PLANAR}:
        row["axis_b"] = poses.along(b, axis)
    if kind in {JointKind.FIXED, JointKind.PRISMATIC}:
        row["orientation"] = floats(to_rpy(poses.rotation(a).T @ poses.rotation(b)))


def _move_upper(tables: dict[str, Any], pair: Mapping[str, Any], distance: float) -> None:
    """Moves the free body of the first geometry of a pair along the normal to a distance [m]."""
    poses = PosesAtStart.of(tables)
    gap, normal = _gap(tables, poses, pair)
    upper, _ = _both(tables, pair)
    joint = next(row for row in tables["joints"] if row["child"] == upper["body"])
    local = from_rpy(joint.get("orientation", _O)).T @ normal * (distance - gap)
    joint["q0"] = [*floats(np.array(joint["q0"][:3]) + local), *joint["q0"][3:]]


def _both(tables: Mapping[str, Any], pair: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    rows = {row["name"]: row for row in tables["geometries"]}
    return [rows[name] for name in pair["geometries"]]


def _gap(tables: Mapping[str, Any], poses: PosesAtStart, pair: Mapping[str, Any]) -> tuple[float, Array]:
    """Distance of the two geometries of a pair [m], and the normal out of the second one."""
    upper, lower = _both(tables, pair)
    R, centre = poses.rotation(upper["body"]), poses.place(upper["body"])
    base = poses.rotation(lower["body"])
    origin = poses.place(lower["body"]) + base @ np.array(lower.get("position", _O), dtype=float)
    offset, kind = centre - origin, lower["kind"]
    if kind in {"plane", "box"}:
        normal = base @ np.array(lower.get("normal", _Z)) if kind == "plane" else _face(base, lower, offset)
        normal = normal / np.linalg.norm(normal)
        reach = extent(lower, base.T @ normal) if kind == "box" else 0.0
        return float(normal @ offset) - reach - extent(upper, R.T @ normal), normal
    if kind in {"bore", "shaft"}:
        axis = base @ np.array(lower["axis"]) / np.linalg.norm(lower["axis"])
        offset = offset - axis * (axis @ offset)
    apart = float(np.linalg.norm(offset))
    outside = 1.0 if kind in {"shaft", "sphere", "capsule"} else -1.0
    normal = outside * offset / apart
    return outside * (apart - lower["radius"]) - extent(upper, R.T @ normal), normal


def _face(base: Array, box: Mapping[str, Any], offset: Array) -> Array:
    """Normal of the face of a box that is nearest to a point outside it."""
    local = base.T @ offset
    index = int(np.argmax(np.abs(local) / np.array(box["size"])))
    face: Array = base[:, index] * np.sign(local[index])
    return face
