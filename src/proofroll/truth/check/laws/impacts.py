"""Laws of an impact: impulses explain the jump, v+ = -e v-, impulses press within their cones.

Newton's and Coulomb's laws together may win energy (Kane's paradox), so that energy is no law here.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, JointKind
from proofroll.truth.check.laws.contacts import gap_of, slide_of
from proofroll.truth.check.laws.integrals import cross, norm, turned
from proofroll.truth.check.laws.joints import coordinate_of
from proofroll.truth.check.laws.record import Array, BodyPoses, Passage, Pieces
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import FREE, HELD_PLACES, HELD_TURNS, JointFrames, LawScene
from proofroll.truth.check.laws.surfaces import PairContact

_CLOSED = 1e-13  # gap in natural sizes below which a contact may take an impulse
_RANK = 1e-11  # singular value, relative to the largest, below which impulses are not independent
_SETTLED = 1.4e-6  # part of the fastest impact below which rebounds are summed: e^-13.5
_SLIPS = 1e-9  # slip after an impact in natural sizes above which it has a direction
_LEAST = float(np.finfo(float).tiny)
_FAINT = 1e-9  # part of the natural momentum below which an impulse counts as of that size


class Hit(NamedTuple):
    """A contact that may take an impulse: number, place, normal, slides before and after."""

    number: int
    contact: PairContact
    normal: Array
    slides: tuple[Array, Array]


class Coordinate(NamedTuple):
    """A joint with one coordinate: bodies' jump by a unit impulse along it, rates before and after, its armature."""

    column: Array
    rates: tuple[float, float]
    armature: float


class Stop(NamedTuple):
    """A joint at a stop: its rates off the stop before and after."""

    name: str
    restitution: float
    rates: tuple[float, float]


def impact(scene: LawScene, passage: Passage, residuals: LawResiduals, fastest: dict[str, float]) -> dict[int, float]:
    """Checks a jump of velocities; impulse along each driven joint, by its number [N s, N m s], NaN if not determinate.

    ``fastest``: largest speed of impact of each contact and stop so far.
    """
    pieces_before, pieces_after, time = passage.before, passage.after, passage.before.time
    m, fast = scene.mechanism, scene.speed + float(np.abs(pieces_before.v).max())
    columns, moving, stops, driven = list[Array](), dict[str, Coordinate](), list[Stop](), dict[int, int]()
    for number, connection in enumerate(scene.connections):
        ends, place = (connection.b, connection.a), scene.placed(connection, pieces_before).origin_b[0, 0]
        columns += [
            _column(scene, pieces_before, ends, place, *pair) for pair in held(scene, pieces_before, connection)
        ]
        if number < len(m.joints) and m.joints[number].nq == 1:
            moving[connection.name] = _coordinate(scene, passage, number)
            reached = _reached(scene, pieces_before, number, moving[connection.name])
            if m.joints[number].motion is not None:
                driven[number] = len(columns)
            if reached or number in driven:
                columns.append(moving[connection.name].column)
            stops += reached
    for coupling in m.couplings:
        columns.append(np.sum([factor * moving[name].column for name, factor in scene.terms(coupling)[0]], 0))
    joints, hits = len(columns), list[Hit]()
    for k, contact in enumerate(scene.contacts):
        is_struck, distance = contact.name in passage.impacts, float(gap_of(contact, pieces_before)[0, 0])
        if is_struck and contact.alone:
            residuals.note("event", contact.name, np.array([[abs(distance) / scene.length]]), 1.0, time)
        place = pieces_before.place[0, 0, k]
        touches = contact.alone and abs(distance) < _CLOSED * (scene.length + float(norm(place)))
        if is_struck or touches or pieces_before.modes.contacts[k] != "open":
            slides = [
                slide_of(contact, pieces, pieces_before.place[..., k, :])[0, 0]
                for pieces in (pieces_before, pieces_after)
            ]
            hits.append(Hit(k, contact, pieces_before.normal[0, 0, k], (slides[0], slides[1])))
            columns += [
                _column(scene, pieces_before, (contact.a, contact.b), place, axis, 0 * axis) for axis in np.eye(3)
            ]
    jump = _momentum(scene, pieces_before, pieces_after)
    for coordinate in moving.values():
        jump = jump + coordinate.armature * (coordinate.rates[1] - coordinate.rates[0]) * coordinate.column
    pulses, left = _explained(columns, jump)
    weight = np.tile(np.repeat([1.0, scene.length], 3), len(m.bodies)) * m.mass * fast
    residuals.note("impulse", "", np.array([[(np.abs(left) / weight).max()]]), 1.0, time)
    _newton(scene, passage, residuals, hits, stops, fastest)
    if len(hits) == 1 and not stops and not passage.settles and _rank(columns) - _rank(columns[:joints]) == 3:
        _coulomb(scene, passage, residuals, hits[0], pulses[joints:])
    alone = {number: _rank(columns) > _rank([*columns[:k], *columns[k + 1 :]]) for number, k in driven.items()}
    return {number: float(pulses[k]) if alone[number] else np.nan for number, k in driven.items()}


def _column(
    scene: LawScene, pieces_before: Pieces, ends: tuple[int, int], place: Array, force: Array, moment: Array
) -> Array:
    """Momenta (linear, about the centre of mass) of all bodies by an impulse on the first of two, its opposite on b."""
    centres, momenta = scene.centres(pieces_before)[0][0, 0], np.zeros((len(scene.mass), 6))
    for body, sign in zip(ends, (1.0, -1.0), strict=True):
        momenta[body, :3] += sign * force
        momenta[body, 3:] += sign * (cross(place - centres[body], force) + moment)
    return momenta[:-1].ravel()


def held(scene: LawScene, pieces: BodyPoses, connection: JointFrames) -> list[tuple[Array, Array]]:
    """Forces and moments on its second body that a connection can give, at its place there."""
    placed, none = scene.placed(connection, pieces), np.zeros(3)
    A, B = placed.A[0, 0], placed.B[0, 0]
    if connection.kind == DISTANCE:
        apart = (placed.origin_b - placed.origin_a)[0, 0]
        return [(apart / np.linalg.norm(apart), none)]
    forces = [(A[:, k], none) for k in HELD_PLACES.get(connection.kind, (0, 1, 2))]
    return forces + [(none, cross(A[:, i], B[:, k])) for i, k in HELD_TURNS.get(connection.kind, ())]


def _coordinate(scene: LawScene, passage: Passage, number: int) -> Coordinate:
    """A joint with one coordinate in an impact."""
    connection, joint = scene.connections[number], scene.mechanism.joints[number]
    _, axis, turns = FREE[connection.kind][0]
    placed = [scene.placed(connection, frames) for frames in (passage.before, passage.after)]
    direction, none = placed[0].A[0, 0][:, axis], np.zeros(3)
    force, moment = (none, direction) if turns else (direction, none)
    place, ends = placed[0].origin_b[0, 0], (connection.b, connection.a)
    rates = [float((frames.spin if turns else frames.slide)[0, 0] @ direction) for frames in placed]
    column = _column(scene, passage.before, ends, place, force, moment)
    return Coordinate(column, (rates[0], rates[1]), joint.armature)


def _reached(scene: LawScene, pieces_before: Pieces, number: int, coordinate: Coordinate) -> list[Stop]:
    """Stops of a joint at which it is just before the impact, but for whole turns."""
    joint, connection = scene.mechanism.joints[number], scene.connections[number]
    if joint.limits is None:
        return []
    placed, stops = scene.placed(connection, pieces_before), list[Stop]()
    length = 1.0 if joint.kind == JointKind.REVOLUTE else scene.length
    for sign, stop in zip((1.0, -1.0), joint.limits, strict=True):
        near = replace(pieces_before, turns=np.full((1, 1, len(scene.mechanism.joints), 1), stop))
        place = float(coordinate_of(scene, number, 0, near, placed)[0, 0])
        if abs(place - stop) < _CLOSED * (abs(stop) + length):
            rates = sign * coordinate.rates[0], sign * coordinate.rates[1]
            stops.append(Stop(joint.name, joint.restitution, rates))
    return stops


def _momentum(scene: LawScene, pieces_before: Pieces, pieces_after: Pieces) -> Array:
    """Jump of linear momentum and of that about the centre of mass, of all bodies."""
    velocities = [scene.centres(pieces)[1][0, 0] for pieces in (pieces_before, pieces_after)]
    spin = turned(
        pieces_before.R[0, 0] @ scene.inertia @ pieces_before.R[0, 0].swapaxes(-1, -2),
        pieces_after.w[0, 0] - pieces_before.w[0, 0],
    )
    linear = scene.mass[:, None] * (velocities[1] - velocities[0])
    return np.concatenate([linear, spin], -1)[:-1].ravel()


def _explained(columns: Sequence[Array], jump: Array) -> tuple[Array, Array]:
    """Impulses that explain a jump best, and what they leave of it."""
    if not columns:
        return np.zeros(0), jump
    matrix = np.array(columns).T
    units = np.linalg.norm(matrix, axis=0)
    units = np.where(units > 0, units, 1.0)
    pulses = np.linalg.lstsq(matrix / units, jump, rcond=_RANK)[0] / units
    return pulses, matrix @ pulses - jump


def _rank(columns: Sequence[Array]) -> int:
    """Number of independent impulses: a contact whose bodies joints hold in part shares its impulse with these."""
    units = [np.linalg.norm(column) for column in columns]
    matrix = np.array([column / unit for column, unit in zip(columns, units, strict=True) if unit > 0])
    return int((np.linalg.svd(matrix, compute_uv=False) > _RANK).sum()) if len(matrix) else 0


def _newton(
    scene: LawScene,
    passage: Passage,
    residuals: LawResiduals,
    hits: Sequence[Hit],
    stops: Sequence[Stop],
    fastest: dict[str, float],
) -> None:
    """No contact that was struck closes further; of one alone v+ = -e v-, or 0 where its rebounds are summed.

    Of several each leaves with e of its speed at least, and one with no more: impulses that press have caused the jump.
    """
    pieces_before, time = passage.before, passage.before.time
    fast, strikes = scene.speed + float(np.abs(pieces_before.v).max()), list[Stop]()
    happened = passage.impacts | passage.settles
    for hit in hits:
        speeds = [float(hit.normal @ slide) for slide in hit.slides]
        strikes.append(Stop(hit.contact.name, hit.contact.pair.restitution, (speeds[0], speeds[1])))
        if pieces_before.modes.contacts[hit.number] != "open" or hit.contact.name in happened:
            residuals.note("restitution", hit.contact.name, np.array([[max(-speeds[1], 0.0)]]), fast, time)
    strikes += stops
    if len(strikes) != 1:
        beyond = {
            name: left + restitution * came
            for name, restitution, (came, left) in strikes
            if name in passage.impacts and came < 0 and not passage.settles
        }
        for name, speed in beyond.items():
            residuals.note("restitution", name, np.array([[max(-speed, 0.0)]]), fast, time)
        if beyond:
            nearest = min(beyond, key=lambda name: abs(beyond[name]))
            residuals.note("restitution", nearest, np.array([[beyond[nearest]]]), fast, time)
        return
    name, restitution, (came, left) = strikes[0]
    if not passage.settles:
        residuals.note("restitution", name, np.array([[left + restitution * came]]), fast, time)
        fastest[name] = max(fastest.get(name, 0.0), -came)
        return
    residuals.note("restitution", name, np.array([[left]]), fast, time)
    most = _SETTLED * max(scene.speed, fastest.get(name, 0.0))
    residuals.note("restitution", name, np.array([[max(-came - most, 0.0)]]), fast, time)


def _coulomb(scene: LawScene, passage: Passage, residuals: LawResiduals, hit: Hit, pulse: Array) -> None:
    """Impulse of one contact: it presses, its friction lies within the cone, and opposes the slip that is left."""
    time, name, pair = passage.before.time, hit.contact.name, hit.contact.pair
    fast = scene.speed + float(np.abs(passage.before.v).max())
    pressed = float(hit.normal @ pulse)
    friction = pulse - pressed * hit.normal
    came, left = (slide - (hit.normal @ slide) * hit.normal for slide in hit.slides)
    size, slip = abs(pressed) + _FAINT * scene.mechanism.mass * fast, float(norm(left))
    bounded = np.isfinite(pair.static)
    excess = max(float(norm(friction)) - pair.static * pressed if bounded else 0.0, -pressed, 0.0)
    residuals.note("impact cone", name, np.array([[excess]]), size, time)
    # it sticks, and leaves with its part of the slip, or slips against mu N
    returned, opposed = float(norm(left + pair.tangential_restitution * came)), np.inf
    if np.isfinite(pair.friction) and slip > _SLIPS * fast:
        direction = left / slip if not pair.tangential_restitution else -friction / max(float(norm(friction)), _LEAST)
        opposed = float(norm(friction + pair.friction * pressed * direction))
    if returned / fast <= opposed / size:
        residuals.note("restitution", name, np.array([[returned]]), fast, time)
    else:
        residuals.note("impact cone", name, np.array([[opposed]]), size, time)
