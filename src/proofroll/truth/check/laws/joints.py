"""Laws of joints, loops and couplings: closure at place and rate, and the forces along each free direction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, JointKind
from proofroll.truth.check.laws.integrals import cross, dot, norm
from proofroll.truth.check.laws.joint_forces import forces_along
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import Array, BodyPoses, Pieces, PublishedValues
from proofroll.truth.check.laws.residuals import ROUND, LawResiduals
from proofroll.truth.check.laws.scene import (
    FREE,
    HELD_PLACES,
    HELD_TURNS,
    JointFrames,
    LawScene,
    PlacedFrames,
    motion_of,
)


class FreeDirection(NamedTuple):
    """A free direction of a joint of the tree, at the points of pieces.

    Attributes:
        joint: number of the joint.
        direction: unit vector, world axes.
        turns: True for an axis of rotation.
        rate: along the direction [m/s, rad/s].
        force: of all laws along it, on the child [N, N m].
        size: sum of the sizes of these.
        digits: effect of round-off of the coordinate by a stiff spring.
    """

    joint: int
    direction: Array
    turns: bool
    rate: Array
    force: Array
    size: Array
    digits: Array


def coordinate_of(scene: LawScene, number: int, k: int, pieces: BodyPoses, placed: PlacedFrames) -> Array:
    """Coordinate k of a joint with one or two at the points of pieces [m, rad].

    If the pieces do not tell whole turns, an angle goes on from that at time 0: between points it changes by the mean
    of its rates there, but for less than half a turn.
    """
    kind, joint = scene.connections[number].kind, scene.mechanism.joints[number]
    axes, axis, turns = FREE[kind][k]
    if not turns:
        return dot(placed.origin_b - placed.origin_a, placed.A[..., axis])
    R = placed.A.swapaxes(-1, -2) @ placed.B
    angle = np.arctan2(R[..., 2, 1], R[..., 2, 2]) if axes == "B" else np.arctan2(R[..., 1, 0], R[..., 0, 0])
    if pieces.turns is not None:
        turn = pieces.turns[..., number, k] - angle
    else:
        start = float(joint.q0[k]) if joint.q0 else 0.0
        times, rates = np.append(0.0, pieces.time.ravel()), np.append(0.0, placed.free(kind)[k].rate.ravel())
        moved = np.diff(times) * (rates[1:] + rates[:-1]) / 2
        apart = np.diff(np.append(start, angle.ravel())) - moved
        path = start + np.cumsum(moved + apart - 2 * np.pi * np.round(apart / (2 * np.pi)))
        turn = path.reshape(angle.shape) - angle
    return np.asarray(angle + 2 * np.pi * np.round(turn / (2 * np.pi)))


class Sizes(NamedTuple):
    """Natural sizes of a connection's places, velocities and angular velocities at the points of pieces."""

    place: Array
    velocity: Array
    spin: Array


def joint_laws(scene: LawScene, pieces: Pieces, residuals: LawResiduals, loads: BodyLoads) -> list[FreeDirection]:
    """Checks joints, loops and couplings, and adds their power to the loads; the free directions of the tree."""
    axes, moving, joints = list[FreeDirection](), dict[str, tuple[Array, Array]](), scene.mechanism.joints
    for number, connection in enumerate(scene.connections):
        placed = scene.placed(connection, pieces)
        sizes = sizes_of(scene, pieces, connection, placed)
        closure(pieces, residuals, connection, placed, sizes)
        if number < len(joints):
            axes += _axes(scene, pieces, residuals, (number, connection, placed, sizes), moving)
    for axis in axes:
        loads.works(axis.force * axis.rate, axis.size * (scene.rate if axis.turns else scene.speed))
    _couplings(scene, pieces, residuals, moving)
    return axes


def sizes_of(scene: LawScene, pieces: BodyPoses, connection: JointFrames, placed: PlacedFrames) -> Sizes:
    """Natural sizes of a connection."""
    ends = connection.a, connection.b
    spin = sum(norm(pieces.w[..., body, :]) for body in ends)
    velocity = scene.speed + sum(norm(pieces.v[..., body, :]) for body in ends) + spin * scene.length
    return Sizes(scene.length + norm(placed.origin_b), np.asarray(velocity), np.asarray(scene.rate + spin))


def closure(
    pieces: BodyPoses, residuals: LawResiduals, connection: JointFrames, placed: PlacedFrames, sizes: Sizes
) -> None:
    """Checks that a connection holds its bodies together, at place and rate."""
    time, name, A, B = pieces.time, connection.name, placed.A, placed.B
    apart = placed.origin_b - placed.origin_a
    if connection.kind == DISTANCE:
        length = norm(apart)
        residuals.note("joint place", name, length - connection.length, sizes.place, time)
        residuals.note("joint rate", name, dot(apart / length[..., None], placed.slide), sizes.velocity, time)
        return
    for k in HELD_PLACES.get(connection.kind, (0, 1, 2)):
        residuals.note("joint place", name, dot(apart, A[..., k]), sizes.place, time)
        residuals.note("joint rate", name, dot(placed.slide, A[..., k]), sizes.velocity, time)
    for i, k in HELD_TURNS.get(connection.kind, ()):
        residuals.note("joint place", name, dot(A[..., i], B[..., k]), 1.0, time)
        residuals.note("joint rate", name, dot(cross(B[..., k], A[..., i]), placed.spin), sizes.spin, time)


def loop_forces(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Checks that loops have no force and moment along their free directions."""
    pieces, joints = published.pieces, len(scene.mechanism.joints)
    for number, connection in enumerate(scene.connections[joints:], joints):
        placed, wrench = scene.placed(connection, pieces), published.reactions[..., number, :]
        force, moment = wrench[..., :3], wrench[..., 3:]
        size = norm(moment) + (norm(force) + scene.faint) * scene.length
        if connection.kind == DISTANCE:
            apart = placed.origin_b - placed.origin_a
            direction = apart / norm(apart)[..., None]
            across = norm(force - dot(force, direction)[..., None] * direction) + norm(moment) / scene.length
            residuals.note("loop force", connection.name, across, size / scene.length, pieces.time)
            continue
        for direction, _, turns in placed.free(connection.kind):
            part = dot(moment if turns else force, direction)
            residuals.note("loop force", connection.name, part, size / (1.0 if turns else scene.length), pieces.time)


def _axes(
    scene: LawScene,
    pieces: Pieces,
    residuals: LawResiduals,
    joint: tuple[int, JointFrames, PlacedFrames, Sizes],
    moving: dict[str, tuple[Array, Array]],
) -> list[FreeDirection]:
    """Free directions of a joint of the tree; ``moving`` takes place and rate of one with one coordinate."""
    number, connection, placed, sizes = joint
    data, time, axes = scene.mechanism.joints[number], pieces.time, []
    for k, (direction, rate, turns) in enumerate(placed.free(connection.kind)):
        force, size, digits = (np.zeros(time.shape) for _ in range(3))
        if data.nq in {1, 2}:
            place = coordinate_of(scene, number, k, pieces, placed)
            parts = [-data.stiffness * (place - data.rest), -data.damping * rate]
            digits = ROUND * data.stiffness * (np.abs(place) + (1.0 if turns else scene.length))
            if data.nq == 1:
                moving[data.name] = place, rate
                parts += forces_along(scene, pieces, residuals, number, place, rate)
            force, size = np.sum(parts, 0), np.sum(np.abs(parts), 0)
        elif connection.kind == JointKind.SPHERICAL:
            force = -data.damping * rate
            size = np.abs(force)
        axes.append(
            FreeDirection(
                joint=number, direction=direction, turns=turns, rate=rate, force=force, size=size, digits=digits
            )
        )
    if data.motion is not None:
        prescribed = motion_of(data.motion, time)
        far = (sizes.place if data.kind == JointKind.PRISMATIC else 1.0) + np.abs(prescribed)
        residuals.note("motion", data.name, moving[data.name][0] - prescribed, far, time)
    return axes


def _couplings(
    scene: LawScene, pieces: Pieces, residuals: LawResiduals, moving: Mapping[str, tuple[Array, Array]]
) -> None:
    for coupling in scene.mechanism.couplings:
        terms, total = scene.terms(coupling)
        for law, which, least in (("coupling", 0, 1.0), ("coupling rate", 1, scene.rate)):
            values = [factor * moving[name][which] for name, factor in terms]
            size = sum(np.abs(value) + abs(factor) * least for value, (_, factor) in zip(values, terms, strict=True))
            constant = 0.0 if which else total
            residuals.note(law, coupling.name, np.sum(values, 0) - constant, np.asarray(size), pieces.time)
