"""Laws of a motion at all times, which need no forces: no time left out, kinematics, joints, stops and gaps."""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.contacts import apart
from proofroll.truth.check.laws.integrals import of_quaternion
from proofroll.truth.check.laws.joints import closure, coordinate_of, sizes_of
from proofroll.truth.check.laws.motion import joined, jump, kinematics
from proofroll.truth.check.laws.record import Array, BodyPoses
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import FREE, LawScene, PlacedFrames, motion_of
from proofroll.truth.check.laws.tiles import Tiles

Turns = dict[tuple[int, int], Array]  # by number of a joint and of its coordinate, at the points of tiles [m, rad]


def laws_at_all_times(scene: LawScene, tiles: Tiles, residuals: LawResiduals, last: float) -> Turns:
    """Checks a motion from 0 to a ``last`` time [s]; coordinates of joints with one or two of them."""
    _without_holes(scene, tiles, residuals, last)
    kinematics(scene, tiles, residuals)
    joined(scene, tiles, residuals, tiles.stretch[1:] == tiles.stretch[:-1])
    turns = Turns()
    for number, connection in enumerate(scene.connections):
        placed = scene.placed(connection, tiles)
        closure(tiles, residuals, connection, placed, sizes_of(scene, tiles, connection, placed))
        if number >= len(scene.mechanism.joints):
            continue
        joint = scene.mechanism.joints[number]
        for k in range(joint.nq if joint.nq < 3 else 0):
            turns[number, k] = coordinate_of(scene, number, k, tiles, placed)
        if joint.limits is not None:
            q, (low, high) = turns[number, 0], joint.limits
            passed = np.maximum(np.maximum(low - q, q - high), 0)
            unit = 1.0 if joint.kind == JointKind.REVOLUTE else scene.length
            residuals.note("stop", joint.name, passed, unit + np.abs(q), tiles.time)
    seen = set[str]()
    for contact in scene.contacts:
        if contact.alone or contact.pair.name not in seen:
            seen.add(contact.pair.name)
            apart(scene, contact, tiles, residuals)
    return turns


def _without_holes(scene: LawScene, tiles: Tiles, residuals: LawResiduals, last: float) -> None:
    """Tiles leave no time out."""
    begins, ends = np.append(tiles.time[:, 0], last), np.append(0.0, np.maximum.accumulate(tiles.time[:, -1]))
    size = 1 / scene.rate + np.abs(begins)
    residuals.note("tiled", "", np.maximum(begins - ends, 0)[:, None], size[:, None], ends[:, None])


def start_of(scene: LawScene, moving: BodyPoses, residuals: LawResiduals, struck: bool) -> None:
    """A motion from time 0 begins at coordinates and rates of the joints' own fields; ``struck``: rates jump there."""
    for number, joint in enumerate(scene.mechanism.joints):
        connection = scene.connections[number]
        placed = PlacedFrames(*(part[:1, :1] for part in scene.placed(connection, moving)))
        time, free = moving.time[:1, :1], FREE[connection.kind]
        rates = [axis.rate[0, 0] for axis in placed.free(connection.kind)]
        sizes = np.array([scene.rate if turns else scene.speed for _, _, turns in free])
        v0 = np.array(joint.v0) if len(joint.v0) else np.zeros(len(free))
        if not struck and joint.motion is None and len(free):
            off = np.abs(np.array(rates) - v0) / (sizes + np.abs(v0))
            residuals.note("start", joint.name, off.max(keepdims=True)[None], 1.0, time)
        R = (placed.A.swapaxes(-1, -2) @ placed.B)[0, 0]
        apart_by = (placed.A.swapaxes(-1, -2) @ (placed.origin_b - placed.origin_a)[..., None])[0, 0, :, 0]
        q0 = np.array(joint.q0) if len(joint.q0) else np.zeros(joint.nq)
        if joint.motion is not None:
            q0 = np.array([motion_of(joint.motion, np.zeros((1, 1)))[0, 0]])
        if joint.nq in {4, 7}:
            R_start = of_quaternion(q0[-4:] / np.linalg.norm(q0[-4:]))
            off = np.abs(R - R_start).max(keepdims=True)
            if joint.nq == 7:
                off = np.maximum(off, np.abs(apart_by - q0[:3]).max() / (scene.length + np.abs(q0[:3]).max()))
        else:
            off = np.zeros((1, 1))
            for (axes, axis, turns), wished in zip(free, q0, strict=True):
                angle = np.arctan2(R[2, 1], R[2, 2]) if axes == "B" else np.arctan2(R[1, 0], R[0, 0])
                away = (angle - wished + np.pi) % (2 * np.pi) - np.pi if turns else apart_by[axis] - wished
                off = np.maximum(off, abs(away) / ((1.0 if turns else scene.length) + abs(wished)))
        residuals.note("start", joint.name, off.reshape(1, 1), 1.0, time)


def changed_velocity(scene: LawScene, tiles: Tiles) -> Array:
    """Jump of velocities from each tile to the next, in natural sizes."""
    if len(tiles.time) < 2:
        return np.zeros(0)
    return jump(scene, tiles, tiles, slice(1, None), slice(None, -1))
