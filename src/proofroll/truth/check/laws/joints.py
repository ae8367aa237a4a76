"""Laws of joints, loops and couplings: closure at place and rate, and the forces along each free direction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, JointKind
from proofroll.truth.check.laws.integrals import cross, dot, norm
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import Array, BodyPoses, Pieces, PublishedValues
from proofroll.truth.check.laws.residuals import LAWS, ROUND, LawResiduals
from proofroll.truth.check.laws.scene import (
    FREE,
    HELD_PLACES,
    HELD_TURNS,
    JointFrames,
    LawScene,
    PlacedFrames,
    motion_of,
)
from proofroll.truth.check.laws.signals import value_of

if TYPE_CHECKING:
    from proofroll.elements.mechanism.scene.control import Control
    from proofroll.elements.mechanism.scene.drives import Actuator

_CERTAIN = 10.0  # allowances of a rate from which on its sign is certain
_PART = 1e-6  # part of a scene's natural force that counts in the size of an effort


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


def forces_along(
    scene: LawScene, pieces: Pieces, residuals: LawResiduals, number: int, place: Array, rate: Array
) -> list[Array]:
    """Forces along a coordinate but those of its spring and damper [N, N m]; efforts, friction and stops are checked.

    Args:
        scene: the numbers.
        pieces: the record.
        residuals: take what the laws leave.
        number: of the joint.
        place: its coordinate [m, rad].
        rate: of the coordinate [m/s, rad/s].
    """
    m, joint = scene.mechanism, scene.mechanism.joints[number]
    parts = [value_of(joint.torque, pieces.time)]
    for k, motor in enumerate(m.actuators):
        if motor.joint == joint.name:
            _effort(scene, pieces, residuals, (k, motor), place, rate)
            parts.append(pieces.effort[..., k])
    for k, coupling in enumerate(m.couplings):
        parts += [factor * pieces.coupling[..., k] for name, factor in scene.terms(coupling)[0] if name == joint.name]
    if joint.motion is not None:
        parts.append(pieces.drive[..., number])
    if joint.friction:
        _dry_friction(scene, pieces, residuals, number, rate)
        parts.append(pieces.friction[..., number])
    if joint.limits is not None:
        _stops(scene, pieces, residuals, number, place, rate)
        parts += [pieces.stops[..., number, 0], pieces.stops[..., number, 1]]
    return parts


def _sizes(scene: LawScene, number: int) -> tuple[float, float, float]:
    """Natural place, rate and force along a coordinate."""
    turns = scene.mechanism.joints[number].kind == JointKind.REVOLUTE
    length = 1.0 if turns else scene.length
    return length, scene.rate * length, scene.force * (scene.length if turns else 1.0)


def _effort(
    scene: LawScene, pieces: Pieces, residuals: LawResiduals, motor: tuple[int, Actuator], place: Array, rate: Array
) -> None:
    """Effort = law of the actuator, clamped to its limit."""
    k, data = motor
    length, fast, force = _sizes(scene, scene.mechanism.joint_index[data.joint])
    n, effort, control = data.gear, pieces.effort[..., k], scene.mechanism.control
    if control is None or data.name not in control.actuators:
        law = law_of(data, value_of(data.target, pieces.time), place, rate)
    elif control.held == "target" and control.policy is None:
        law = law_of(data, target_of(control, data, pieces.time), place, rate)
    else:  # the answer of a policy is not known; for efforts see :func:`.held_efforts`
        law = effort
    size = np.abs(effort) + n * n * (data.kp * length + data.kd * fast) + _PART * force
    residuals.note("effort", data.name, effort - law, size, pieces.time)


def law_of(data: Actuator, target: Array, place: Array, rate: Array) -> Array:
    """Effort of an actuator by its law [N, N m]."""
    n, limit = data.gear, np.inf if data.limit is None else data.limit
    law = {
        "torque": n * target,
        "velocity": n * data.kd * (target - n * rate),
        "position": n * (data.kp * (target - n * place) - data.kd * n * rate),
    }[data.kind]
    return np.clip(law, -limit, limit)


def target_of(control: Control, data: Actuator, time: Array) -> Array:
    """Target that a controller without a policy has set at the last of its instants before a time [s]."""
    sent = np.floor(time * control.rate) - control.delay
    pose = control.pose[control.actuators.index(data.name)]
    return np.where(sent >= 0, value_of(data.target, sent / control.rate), pose)


def _dry_friction(scene: LawScene, pieces: Pieces, residuals: LawResiduals, number: int, rate: Array) -> None:
    """Dry friction opposes the rate by its bound, or holds within it; beside a stop only the sum is determinate."""
    joint, mode, force = scene.mechanism.joints[number], pieces.modes.friction[number], pieces.friction[..., number]
    if any(stop != "open" for stop in pieces.modes.stops[number]):
        return
    fast, bound = _sizes(scene, number)[1], joint.friction
    if mode == "stick":
        residuals.note("dry friction", joint.name, np.maximum(np.abs(force) - bound, 0), bound, pieces.time)
        residuals.note("stop rate", joint.name, rate, fast, pieces.time)
    elif mode == "slip":
        certain = np.abs(rate) > _CERTAIN * LAWS["joint rate"][0] * residuals.coarse * (fast + np.abs(rate))
        opposed = np.where(certain, force + bound * np.sign(rate), np.abs(force) - bound)
        residuals.note("dry friction", joint.name, opposed, bound, pieces.time)
    else:
        residuals.note("dry friction", joint.name, bound + 0 * force, bound, pieces.time)


def _stops(scene: LawScene, pieces: Pieces, residuals: LawResiduals, number: int, place: Array, rate: Array) -> None:
    """A stop that is closed holds the joint there and presses; an open one is not passed and has no force."""
    joint, (length, fast, natural) = scene.mechanism.joints[number], _sizes(scene, number)
    assert joint.limits is not None  # as its joint has stops
    pairs = zip((1.0, -1.0), joint.limits, pieces.modes.stops[number], strict=True)
    for k, (sign, stop, mode) in enumerate(pairs):
        distance, push = sign * (place - stop), sign * pieces.stops[..., number, k]
        size = np.abs(push) + 1e-3 * natural
        far = length + abs(stop)
        if mode == "open":
            residuals.note("stop", joint.name, np.maximum(-distance, 0), far, pieces.time)
            residuals.note("pull", joint.name, push, size, pieces.time)
            continue
        residuals.note("stop", joint.name, distance, far, pieces.time)
        residuals.note("stop rate", joint.name, rate, fast, pieces.time)
        # beside dry friction the share of the stop is not determinate: the sum may be down to minus the bound
        residuals.note("pull", joint.name, np.maximum(-push - joint.friction, 0), size, pieces.time)
