"""Laws of what is published at a sample: it lies on the motion, and its forces give the motion's accelerations."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from proofroll.truth.check.laws.contacts import contact_laws
from proofroll.truth.check.laws.integrals import COUNT, IN_PLANE, along, cross, dot, norm, turned
from proofroll.truth.check.laws.joints import FreeDirection, joint_laws, loop_forces
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import SPREAD, Array, BodyPoses, PublishedValues
from proofroll.truth.check.laws.residuals import ROUND, LawResiduals
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.tiles import Places, Tiles

_ARM = 1e-2  # part of the natural length by which a force turns at least, for sizes of moments
# Noise of a derivative at the end of a tile of unit half length, relative to the values; on another processor the last
# instants of a slip need a third of it.
NOISE = 60 * COUNT * 3e-14
_LEAST = 1e-3  # part of the mechanism's natural force that the size of forces on a body has at least, massless or not
_DENSE = 100.0  # factor for samples on dense output of DOP853, whose long steps miss up to 1.4e-9 of a state inside
_RANK = 1e-12  # relative singular value below which unknown forces are one
_ACROSS = 1e-2  # part of an axis across a normal below which other axes tell that direction with more digits


def on_the_motion(
    scene: LawScene, tiles: Tiles, places: Places, published: PublishedValues, residuals: LawResiduals
) -> None:
    """A sample is the motion at its time."""
    pieces = published.pieces
    sizes = {"p": scene.length, "v": scene.speed, "R": 1.0, "w": scene.rate}
    bars = {name: published.bars[f"{'q' if name == 'R' else name}_WB"] for name in sizes}
    for name, size in sizes.items():
        values = getattr(tiles, name)
        off = np.abs(getattr(pieces, name)[:, 0] - places.at(values)).reshape(len(places.tile), -1).max(1)
        room = (size + float(np.abs(values).max())) * (_DENSE if tiles.coarse else 1.0)
        residuals.note("sample", "", off[:, None], room, pieces.time, bars[name])


def force_laws(
    scene: LawScene, tiles: Tiles, places: Places, published: PublishedValues, residuals: LawResiduals
) -> None:
    """Checks samples of one mode: joints, contacts, Newton's and Euler's laws of each body, and power."""
    pieces = published.pieces
    loads = BodyLoads(scene, pieces)
    _newton_and_euler(scene, tiles, places, published, residuals)
    axes = joint_laws(scene, pieces, residuals, loads)
    loop_forces(scene, published, residuals)
    _along(scene, tiles, places, published, residuals, axes)
    contact_laws(scene, pieces, residuals, loads)
    _power(scene, tiles, places, published, residuals, loads)


def _newton_and_euler(
    scene: LawScene, tiles: Tiles, places: Places, published: PublishedValues, residuals: LawResiduals
) -> None:
    """Mass times acceleration, and the rate of angular momentum, of each body; what is unknown explains a rest."""
    pieces, bodies = published.pieces, len(scene.mechanism.bodies)
    acceleration, spin_rate = (places.rate(values)[:, None, :bodies] for values in _momenta(scene, tiles))
    loads, unknown = BodyLoads(scene, pieces), _Unknown(scene, pieces)
    for number, connection in enumerate(scene.connections):
        place = scene.placed(connection, pieces).origin_b
        force, moment = published.reactions[..., number, :3], published.reactions[..., number, 3:]
        loads.between(connection.b, connection.a, place, np.nan_to_num(force), np.nan_to_num(moment))
        unknown.take(connection.b, connection.a, place, np.isnan(force), np.isnan(moment), np.zeros(3))
    for k, contact in enumerate(scene.contacts):
        place, force = pieces.place[..., k, :], pieces.force[..., k, :]
        moment = pieces.rolling[..., k, :] + pieces.spinning[..., k, :]
        moment = moment + (np.nan if pieces.modes.contacts[k] == SPREAD else 0.0)
        told, way = _with_normal_force(force, pieces.normal[..., k, :], published.values["normal_forces"][:, None, k])
        loads.between(contact.a, contact.b, place, told, np.nan_to_num(moment))
        pressed = ~(norm(force) <= 0)[..., None]
        unknown.take(contact.a, contact.b, place, np.isnan(force), np.isnan(moment) & pressed, way)
    mass, trace = scene.mass[:bodies], np.trace(scene.inertia, axis1=-2, axis2=-1)[:bodies]
    left = np.concatenate(
        [mass[:, None] * acceleration - loads.force[..., :bodies, :], spin_rate - loads.moment[..., :bodies, :]], -1
    )
    half, bars = np.maximum(places.half, np.finfo(float).tiny)[:, None, None], published.bars
    off = (
        NOISE * (scene.speed + np.abs(pieces.v).max()) + bars["v_WB"],
        NOISE * (scene.rate + np.abs(pieces.w).max()) + bars["w_WB"],
    )
    digits = (
        loads.force_digits[..., :bodies] + mass * off[0] / half,
        loads.moment_digits[..., :bodies] + trace * off[1] / half,
    )
    size = loads.force_size[..., :bodies] + mass * (scene.speed * scene.rate + norm(acceleration))
    size = size + _LEAST * scene.force
    turning = trace * (scene.rate**2 + norm(pieces.w[..., :bodies, :]) ** 2) + size * _ARM * scene.length
    turning = turning + loads.moment_size[..., :bodies]
    left, cancelled = unknown.explained(left, np.stack([size + digits[0], turning + digits[1]], -1))
    for k, body in enumerate(scene.mechanism.bodies):
        rooms = (digits[part][..., k] + ROUND * norm(cancelled[..., k, 3 * part : 3 * part + 3]) for part in (0, 1))
        residuals.note("newton", body.name, norm(left[..., k, :3]), size[..., k], pieces.time, next(rooms))
        residuals.note("euler", body.name, norm(left[..., k, 3:]), turning[..., k], pieces.time, next(rooms))


def _with_normal_force(force: Array, normal: Array, N: Array) -> tuple[Array, Array]:
    """Force with zero for what is unknown but for what N tells, and the part of the normal among it, of length 1."""
    way = np.where(np.isnan(force) & ~np.isnan(N)[..., None], normal, 0.0)
    size, known = norm(way)[..., None], np.nan_to_num(force)
    way = np.where(size > IN_PLANE, way / np.maximum(size, IN_PLANE), 0.0)
    rest = np.nan_to_num(N - dot(normal, known))[..., None]
    return known + way * rest / np.maximum(size, IN_PLANE), way


def _momenta(scene: LawScene, moving: BodyPoses) -> tuple[Array, Array]:
    """Velocities of centres of mass, and angular momenta about them."""
    inertia = moving.R @ scene.inertia @ moving.R.swapaxes(-1, -2)
    return scene.centres(moving)[1], turned(inertia, moving.w)


class _Unknown:
    """Forces and moments that are not determined: whatever they are, they explain a part of what laws leave."""

    def __init__(self, scene: LawScene, pieces: BodyPoses) -> None:
        self._bodies, self._shape = len(scene.mechanism.bodies), pieces.time.shape
        self._centres, self._columns = scene.centres(pieces)[0], list[Array]()

    def take(
        self, b: int, a: int, place: Array, force: NDArray[np.bool_], moment: NDArray[np.bool_], known: Array
    ) -> None:
        """Takes unknown components, (samples, 1, 3), of a force at a place on body b and a moment; opposite on a.

        ``known``: direction in which their part of the force is known, or zero.
        """
        for mask, turns in ((force, False), (moment, True)):
            for axis in np.flatnonzero(mask.any((0, 1))):
                unit = np.where(mask, np.eye(3)[axis], 0.0)
                if not turns:
                    unit = unit - known * known[..., [axis]]
                    unit = np.where(norm(unit)[..., None] > _ACROSS, unit, 0.0)
                column = np.zeros((*self._shape, self._bodies, 6))
                for body, sign in ((b, 1.0), (a, -1.0)):
                    if body < self._bodies:
                        arm = place - self._centres[..., body, :]
                        column[..., body, :3] += 0.0 if turns else sign * unit
                        column[..., body, 3:] += sign * (unit if turns else cross(arm, unit))
                self._columns.append(column)

    def explained(self, left: Array, sizes: Array) -> tuple[Array, Array]:
        """Remainder that no unknown force explains, and the sizes of all that cancel in what they explain.

        ``sizes``: of force and moment, (samples, 1, bodies, 2).
        """
        if not self._columns:
            return left, np.zeros_like(left)
        scale = np.repeat(1 / sizes, 3, -1)
        flat = (left * scale).reshape(len(left), -1)
        columns = (np.stack(self._columns, -1) * scale[..., None]).reshape(*flat.shape, -1)
        reaches = np.maximum(norm(columns.swapaxes(-1, -2)), np.finfo(float).tiny)
        parts = []
        for row, matrix in zip(flat, columns / reaches[:, None], strict=True):
            forces = np.linalg.lstsq(matrix, row, rcond=_RANK)[0]
            parts.append((row - matrix @ forces, np.abs(matrix) @ np.abs(forces)))
        rests, cancelled = (np.array(values).reshape(left.shape) / scale for values in zip(*parts, strict=True))
        return rests, cancelled


def _along(
    scene: LawScene,
    tiles: Tiles,
    places: Places,
    published: PublishedValues,
    residuals: LawResiduals,
    axes: Sequence[FreeDirection],
) -> None:
    """A joint transmits along a free direction the forces of its springs, drives, friction and stops."""
    pieces, numbers = published.pieces, [axis.joint for axis in axes]
    for place, axis in enumerate(axes):
        joint = scene.mechanism.joints[axis.joint]
        natural = scene.force * (scene.length if axis.turns else 1.0)
        wrench = published.reactions[..., axis.joint, :]
        part = wrench[..., 3:] if axis.turns else wrench[..., :3]
        said = along(part, axis.direction)
        expected, size = axis.force, axis.size + _ARM * natural + np.nan_to_num(norm(part))
        size = size + np.nan_to_num(norm(pieces.force)).sum(-1) * (scene.length if axis.turns else 1.0)
        digits = axis.digits
        if joint.armature:
            rate = scene.free(axis.joint, tiles)[place - numbers.index(axis.joint)].rate
            faster = places.rate(rate)[:, None]
            expected = expected - joint.armature * faster
            size = size + joint.armature * np.abs(faster)
            noise = NOISE / np.maximum(places.half, np.finfo(float).tiny)[:, None]
            digits = digits + joint.armature * noise * (scene.rate + np.abs(rate).max())
        if axis.turns:
            size = size + np.nan_to_num(norm(wrench[..., :3])) * _ARM * scene.length
        residuals.note("along", joint.name, said - expected, size, pieces.time, digits)


def kinetic_energy(scene: LawScene, moving: BodyPoses) -> tuple[Array, Array]:
    """Kinetic energy with armatures, and that of gravity, and the sizes of its parts [J]."""
    gravity = np.array(scene.mechanism.gravity)
    centres, velocities = scene.centres(moving)
    local = turned(moving.R.swapaxes(-1, -2), moving.w)
    kinetic = 0.5 * (scene.mass * dot(velocities, velocities) + dot(local, turned(scene.inertia, local)))
    total, size = (kinetic - scene.mass * (centres @ gravity)).sum(-1), kinetic.sum(-1)
    size = size + (scene.mass * np.linalg.norm(gravity) * norm(centres)).sum(-1)
    for number, joint in enumerate(scene.mechanism.joints):
        for axis in scene.free(number, moving) if joint.armature else ():
            total = total + 0.5 * joint.armature * axis.rate**2
    return total, size


def _power(
    scene: LawScene, tiles: Tiles, places: Places, published: PublishedValues, residuals: LawResiduals, loads: BodyLoads
) -> None:
    """Kinetic energy and that of gravity change by the power of all forces."""
    total, size = kinetic_energy(scene, tiles)
    rate, natural = places.rate(total)[:, None], scene.mass.sum() * scene.speed**2
    sizes = np.nan_to_num(loads.power_size) + (natural + places.at(size)[:, None]) * scene.rate
    sizes = sizes + scene.force * norm(published.pieces.v).max(-1)
    noise = NOISE * (natural + places.at(size)[:, None]) + published.bars["energy"]
    noise = noise / np.maximum(places.half, np.finfo(float).tiny)[:, None]
    residuals.note("power", "", rate - loads.power, sizes, published.pieces.time, noise)
