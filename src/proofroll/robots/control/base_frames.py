"""Frames of a floating base that programs report in place of that of its link: at its centre of mass, turned or not."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.robots.control.record import ControlRecord
from proofroll.robots.model import Array, Robot

_EQUAL, _DIGITS = 1e-9, 9  # part of the largest moment by which equal ones differ, and decimals of equal turns
# Products of inertia that a program takes for none when it turns an inertia to its principal axes, in parts of the sum
# of its moments; PyBullet's importer does so.
_LEFT = 1e-6


@dataclass(frozen=True)
class BaseFrame:
    """Frame that is fixed in a base.

    Attributes:
        words: clause on a record whose base has its place, attitude and velocity there.
        place: of its origin in the base's frame [m], shape (3,).
        rotation: of its axes against those of the base, shape (3, 3).
        error: angle by which a program's axes may be off these [rad].
    """

    words: str
    place: Array
    rotation: Array
    error: float = 0.0

    def corrected(self, record: ControlRecord) -> ControlRecord:
        """The record with place, attitude and velocity of the base's own frame, where it has those of this one."""
        columns, rounding, spin = dict(record.columns), dict(record.rounding), record.stacked("w_WB", "xyz")
        attitude = record.stacked("q_WB", "wxyz")
        if attitude is None:
            return record
        turned = Rotation.from_quat(attitude, scalar_first=True) * Rotation.from_matrix(self.rotation).inv()
        offset = turned.apply(self.place)
        columns |= {f"q_WB.{axis}": turned.as_quat(scalar_first=True)[:, k] for k, axis in enumerate("wxyz")}
        moved = {"p_WB": offset} | ({} if spin is None else {"v_WB": np.cross(spin, offset)})
        for name, change in moved.items():
            for k, axis in enumerate("xyz"):
                if f"{name}.{axis}" in columns:
                    columns[f"{name}.{axis}"] = columns[f"{name}.{axis}"] - change[:, k]
                    rounding[f"{name}.{axis}"] = rounding[f"{name}.{axis}"] + self.error * np.abs(change).max()
        for axis in "wxyz":
            rounding[f"q_WB.{axis}"] = rounding[f"q_WB.{axis}"] + self.error / 2
        return ControlRecord(record.path, columns, rounding, record.time)

    def reported(self, record: ControlRecord) -> ControlRecord:
        """The record as a program reports it that has this frame."""
        R = self.rotation.T
        return BaseFrame("", -R @ self.place, R).corrected(record)

    def based(self, robot: Robot) -> Robot:
        """The robot with this frame as that of its base: a program steps what it reports."""
        root, R = robot.moving[0].child, self.rotation
        body = robot.bodies[root]
        moved = replace(body, com=R.T @ (body.com - self.place), inertia=R.T @ body.inertia @ R)
        joints = (
            replace(joint, position=R.T @ (joint.position - self.place), rotation=R.T @ joint.rotation)
            if joint.parent == root
            else joint
            for joint in robot.joints
        )
        return robot.with_bodies([moved]).change(joints=tuple(joints))

    def equals(self, frame: BaseFrame) -> bool:
        """True if the frame is this one."""
        return bool(np.allclose(self.place, frame.place) and np.allclose(self.rotation, frame.rotation))


def base_frames(robot: Robot) -> tuple[BaseFrame, ...]:
    """Frames that programs report, at the centre of mass of the root's link and at that of all that is fixed to it."""
    root = robot.moving[0] if robot.moving else None
    if root is None or root.kind != JointKind.FREE:
        return ()
    link, whole = robot.bodies[root.child], robot.groups[root.name]
    written = np.array(robot.sources.get(root.child, {}).get("frame", np.eye(3)))
    centre = "p_WB and v_WB are those of the base's centre of mass, not of its origin"
    frames = [
        BaseFrame(centre, link.com, np.eye(3)),
        BaseFrame(f"{centre}, and q_WB has the axes of its <inertial>", link.com, written),
        BaseFrame(
            f"{centre}, and q_WB has its principal axes",
            link.com,
            written @ _principal(link.inertia, written),
            _error(link.inertia),
        ),
        BaseFrame(f"{centre} (with all links that are fixed to it)", whole.com, np.eye(3)),
        BaseFrame(
            f"{centre} (with all links that are fixed to it), and q_WB has its principal axes",
            whole.com,
            _principal(whole.inertia, np.eye(3)),
            _error(whole.inertia),
        ),
    ]
    several = [BaseFrame("", np.zeros(3), np.eye(3))]
    for frame in frames:
        several += [] if any(map(frame.equals, several)) else [frame]
    return tuple(several[1:])


def _error(inertia: Array) -> float:
    """Angle by which a program's principal axes may be off [rad]; axes of equal moments are found as those written."""
    moments = np.linalg.eigvalsh(inertia)
    gaps = np.diff(moments)[np.diff(moments) > _EQUAL * moments.max()]
    return _LEFT * float(moments.sum() / gaps.min()) if len(gaps) else 0.0


def _principal(inertia: Array, axes: Array) -> Array:
    """Principal axes of an inertia, in these axes: of the orders and signs of them those that are turned least.

    Equal moments have any axes in their plane: those nearest to the given ones.
    """
    moments, vectors = np.linalg.eigh(axes.T @ inertia @ axes)
    turned = []
    for order in map(list, itertools.permutations(range(3))):
        nearest = vectors[:, order].copy()
        for moment in moments:
            equal = np.abs(moments[order] - moment) <= _EQUAL * moments.max()
            left, _, right = np.linalg.svd(vectors[:, order][:, equal].T[:, equal])
            nearest[:, equal] = vectors[:, order][:, equal] @ left @ right
        signed = (nearest @ np.diag(signs) for signs in itertools.product((1.0, -1.0), repeat=3))
        turned += [item for item in signed if np.linalg.det(item) > 0]
    return max(turned, key=lambda item: round(float(np.trace(item)), _DIGITS))
