"""Laws of motion as integrals over pieces: places, rotations, and momenta of free bodies."""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.contacts import contact_laws
from proofroll.truth.check.laws.integrals import cross, integral, norm, since_start, tail, turned
from proofroll.truth.check.laws.joints import joint_laws
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import Array, BodyPoses, Pieces
from proofroll.truth.check.laws.residuals import COARSE, LawResiduals
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
        rate = cross(w[..., None, :], R.swapaxes(-1, -2)).swapaxes(-1, -2)  # [w] R by columns
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


def momenta(scene: LawScene, pieces: Pieces, residuals: LawResiduals, loads: BodyLoads) -> None:
    """Momentum of each free body = integral of the forces, that about its centre of mass = integral of the moments."""
    velocities, time, pace = scene.centres(pieces)[1], pieces.time, pieces.pace
    inertia = pieces.R @ scene.inertia @ pieces.R.swapaxes(-1, -2)
    span, trace = time[:, -1:] - time[:, :1], np.trace(scene.inertia, axis1=-2, axis2=-1)
    moments = turned(inertia, pieces.w)
    for joint in scene.mechanism.joints:
        if joint.kind != JointKind.FREE:
            continue
        k = scene.index[joint.child]
        fast, quick = scene.speed + norm(velocities[..., k, :]), scene.rate + norm(pieces.w[..., k, :])
        for law, value, rate, size, digits in (
            (
                "momentum",
                scene.mass[k] * velocities[..., k, :],
                loads.force[..., k, :],
                scene.mass[k] * fast + span * loads.force_size[..., k],
                loads.force_digits[..., k],
            ),
            (
                "spin",
                moments[..., k, :],
                loads.moment[..., k, :],
                (trace[k] + scene.mass[k] * (_ARM * scene.length) ** 2) * quick + span * loads.moment_size[..., k],
                loads.moment_digits[..., k],
            ),
        ):
            left, unresolved = norm(since_start(value) - integral(rate, pace)), norm(tail(rate, pace))
            residuals.note(law, joint.child, left, size, time, span * digits, unresolved)


def laws_of_pieces(scene: LawScene, pieces: Pieces, residuals: LawResiduals) -> None:
    """Checks pieces of free bodies in one mode, whose record has all forces at their points, in order of time."""
    residuals.coarse = COARSE if pieces.coarse else 1.0
    residuals.points += pieces.time.size
    kinematics(scene, pieces, residuals)
    joined(scene, pieces, residuals)
    loads = BodyLoads(scene, pieces)
    joint_laws(scene, pieces, residuals, loads)
    contact_laws(scene, pieces, residuals, loads)
    momenta(scene, pieces, residuals, loads)
