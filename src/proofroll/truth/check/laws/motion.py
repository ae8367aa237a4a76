"""Laws of motion as integrals over pieces: places, rotations, and momentum along each free direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.integrals import dot, integral, norm, since_start, tail, turned
from proofroll.truth.check.laws.joints import FreeDirection
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import Array, BodyPoses, Pieces
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import LawScene

_ARM = 1e-2  # part of the natural length that a body extends at least, for the size of its angular momentum
_MEETS = 1e-13  # difference of times, relative to them, up to which a piece begins where the last one ended


def kinematics(scene: LawScene, pieces: BodyPoses, residuals: LawResiduals) -> None:
    """Place = integral of the velocity, rotation = integral of [w] R, for each body."""
    time, pace = pieces.time, pieces.pace
    for k, body in enumerate(scene.mechanism.bodies):
        p, v, R, w = (part[:, :, k] for part in (pieces.p, pieces.v, pieces.R, pieces.w))
        far = scene.length + np.abs(p).max((1, 2))[:, None]
        unresolved = norm(tail(v, pace))
        residuals.note("place", body.name, norm(since_start(p) - integral(v, pace)), far, time, tail=unresolved)
        rate = np.cross(w[..., None, :], R.swapaxes(-1, -2)).swapaxes(-1, -2)  # [w] R by columns
        apart, unresolved = since_start(R) - integral(rate, pace), tail(rate, pace).max((-1, -2))
        residuals.note("turn", body.name, np.abs(apart).max((-1, -2)), 1.0, time, tail=unresolved)


def joined(scene: LawScene, pieces: BodyPoses, residuals: LawResiduals, evenly: Array | bool = True) -> None:
    """Each piece begins where the one before has ended; ``evenly``: where its velocities do, too."""
    begins, ends = pieces.time[1:, 0], pieces.time[:-1, -1]
    meets = np.abs(begins - ends) <= _MEETS * (1.0 + np.abs(begins))
    if meets.any():
        later = slice(1, None), slice(None, -1)
        apart = np.where(evenly, jump(scene, pieces, pieces, *later), jump(scene, pieces, pieces, *later, rates=False))
        residuals.note("joined", "", np.where(meets, apart, 0.0)[:, None], 1.0, pieces.time[1:, :1])


def jump(scene: LawScene, later: BodyPoses, sooner: BodyPoses, starts: slice, ends: slice, rates: bool = True) -> Array:
    """Largest difference of the first points of pieces from the last points of others, in natural sizes."""
    sizes = {"p": scene.length, "R": 0.0} | ({"v": scene.speed, "w": scene.rate} if rates else {})
    parts = []
    for name, size in sizes.items():
        values, others = getattr(later, name)[starts, 0], getattr(sooner, name)[ends, -1]
        apart = np.abs(values - others).reshape(len(values), -1).max(1)
        parts.append(apart / (size + np.abs(getattr(later, name)).max()))
    return np.asarray(np.max(parts, 0))


def momenta(
    scene: LawScene, pieces: Pieces, residuals: LawResiduals, loads: BodyLoads, axes: Sequence[FreeDirection]
) -> None:
    """Momentum along each free direction of the tree, of all bodies beyond its joint, = integral of the loads.

    Constraint forces of the joint have no part along it; the direction turns with its carrier. Together these are all
    equations of motion of the tree.
    """
    centres, velocities = scene.centres(pieces)
    inertia = pieces.R @ scene.inertia @ pieces.R.swapaxes(-1, -2)
    spin = turned(inertia, pieces.w)
    inertia_size = np.trace(scene.inertia, axis1=-2, axis2=-1) + scene.mass * (_ARM * scene.length) ** 2
    time, pace = pieces.time, pieces.pace
    span = time[:, -1:] - time[:, :1]
    fast, quick = scene.speed + norm(velocities), scene.rate + norm(pieces.w)
    for axis in axes:
        joint, body = scene.mechanism.joints[axis.joint], scene.subtrees[axis.joint]
        linear = (scene.mass[body, None] * velocities[..., body, :]).sum(-2)
        force = loads.force[..., body, :].sum(-2)
        turning = np.cross(pieces.w[..., axis.carrier, :], axis.direction)
        if axis.turns:
            arm = centres[..., body, :] - axis.origin[..., None, :]
            angular = np.cross(arm, scene.mass[body, None] * velocities[..., body, :]) + spin[..., body, :]
            angular = angular.sum(-2)
            moment = (loads.moment[..., body, :] + np.cross(arm, loads.force[..., body, :])).sum(-2)
            rate = dot(moment - np.cross(axis.speed, linear), axis.direction) + dot(angular, turning)
            value, reach = dot(angular, axis.direction), norm(arm)
            size = (inertia_size[body] * quick[..., body] + scene.mass[body] * reach * fast[..., body]).sum(-1)
            loaded = (loads.moment_size[..., body] + reach * loads.force_size[..., body]).sum(-1)
            digits = (loads.moment_digits[..., body] + reach * loads.force_digits[..., body]).sum(-1)
        else:
            rate = dot(force, axis.direction) + dot(linear, turning)
            value = dot(linear, axis.direction)
            size = (scene.mass[body] * fast[..., body]).sum(-1)
            loaded, digits = loads.force_size[..., body].sum(-1), loads.force_digits[..., body].sum(-1)
        rate = rate + axis.force
        value = value + joint.armature * axis.rate
        size = size + joint.armature * ((scene.rate if axis.turns else scene.speed) + np.abs(axis.rate))
        residuals.note(
            "spin" if axis.turns else "momentum",
            joint.child if joint.kind == JointKind.FREE else joint.name,
            since_start(value) - integral(rate, pace),
            size + span * (loaded + axis.size),
            time,
            span * (digits + axis.digits),
            tail(rate, pace),
        )
