"""Forces along the coordinate of a joint with one, each held against its law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.record import Array, Pieces
from proofroll.truth.check.laws.residuals import LAWS, LawResiduals
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.signals import value_of

if TYPE_CHECKING:
    from proofroll.elements.mechanism.scene.control import Control
    from proofroll.elements.mechanism.scene.drives import Actuator

_CERTAIN = 10.0  # allowances of a rate from which on its sign is certain
_PART = 1e-6  # part of a scene's natural force that counts in the size of an effort


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
