"""Laws of motion as integrals over pieces: places, rotations, momenta of free bodies; those at all times, by tiles."""

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.contacts import apart, contact_laws
from proofroll.truth.check.laws.integrals import cross, integral, norm, of_quaternion, since_start, tail, turned
from proofroll.truth.check.laws.joints import closure, coordinate_of, joint_laws, sizes_of
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import Array, BodyPoses, Pieces
from proofroll.truth.check.laws.residuals import COARSE, LawResiduals
from proofroll.truth.check.laws.scene import FREE, LawScene, PlacedFrames, motion_of
from proofroll.truth.check.laws.tiles import Tiles

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
