"""Bookkeeping of a controller as data: what it observes, what its actions mean, and the efforts that follow."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.engine import whole_steps
from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.control import EFFORT
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.policy import Observation, PolicySource
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import Signal, value_at

VECTORS = ("p_WB", "v_WB_W", "w_WB_B", "gravity_B")  # of an observation, shape (3,) each
TERMS = (("q", "v", "last"), VECTORS[1:])  # parts of an observation that have one length
SCALED = ("q", "v", "v_WB_W", "w_WB_B", "last")  # parts of an observation that programs scale


@dataclass(frozen=True)
class RobotState:
    """State of a robot at a time, SI units; W is the world, B the frame of the base, which is by default the world's.

    Arrays of several states have these first.

    Attributes:
        time: [s].
        q, v: coordinates and rates of the driven joints, in the controller's order.
        p_WB: origin of the base [m], shape (3,).
        q_WB: its quaternion, scalar first, shape (4,).
        v_WB: velocity of its origin in world axes [m/s], shape (3,).
        w_WB: its angular velocity in world axes [rad/s], shape (3,).
    """

    time: Any
    q: Array
    v: Array
    p_WB: Array = dataclasses.field(default_factory=lambda: np.zeros(3))
    q_WB: Array = dataclasses.field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    v_WB: Array = dataclasses.field(default_factory=lambda: np.zeros(3))
    w_WB: Array = dataclasses.field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class ControlLaw:
    """Controller of a robot, with the conventions in which bookkeeping goes wrong; the defaults are right.

    Attributes:
        joints: driven joints, in the order of arrays, of length n.
        rate: instants per second [Hz].
        delay: whole instants until a target acts.
        scale: of an action [rad or m].
        pose, kp, kd, limit, armature: of each joint, shape (n,).
        policy: None: ``targets`` hold.
        targets: signal of each joint.
        down: unit vector along gravity in world axes, shape (3,).
        gravity: acceleration of gravity in parts of the right one.
        action_order: joint that each entry of an action is for.
        observed_order: joint that each entry of the observed coordinates and rates is of.
        signs: sign of each joint's target, shape (n,).
        scalar_last: 1 if a quaternion with its scalar last is read as one with its scalar first, -1 the other way.
        conjugated: True if the quaternion is that of the inverse rotation, before it is read.
        turned_back: True if the rotation of the base is used the other way around.
        gravity_sign: of the observed direction of gravity.
        velocity_turns: times that the observed velocity of the base is turned from the world's axes to the base's.
        spin_turns: the same of its angular velocity, right being 1.
        centre: centre of mass of the base from its origin, in its own axes [m], shape (3,).
        at_centre: True if the velocity of the base is observed there.
        factors: on observed q, v, linear velocity, angular velocity and last action, shape (5,).
        pose_observed: part of the pose that is added to observed coordinates; -1: they are relative to it.
        exchanged: names of two parts of an observation that have each other's place; empty: none.
        clip: largest size of an action.
        smoothing: part of an action that counts, beside what counted at the instant before; 1: all.
        hold_effort: True if efforts hold between instants, False if they follow the state.
        reductions: turns of each joint's motor per turn of the joint, shape (n,).
        effort_factor: on what a servo's effort is before it acts, shape (n,).
        lag: steps by which the state of the servos is late.
        observed_lag: steps by which the state that the policy sees is late.
        clock: time by which the clock that the policy sees is ahead [s].
        extra_steps: steps by which the time between two instants is longer.
        begins: time of the first instant of a motion [s].
        earlier: actions at the instants before it, the last one last.
    """

    joints: tuple[str, ...]
    rate: float
    delay: int
    scale: float
    pose: Array
    kp: Array
    kd: Array
    limit: Array
    armature: Array
    policy: PolicySource | None
    targets: tuple[Signal, ...]
    down: Array
    gravity: float = 1.0
    action_order: tuple[int, ...] = ()
    observed_order: tuple[int, ...] = ()
    signs: Array = dataclasses.field(default_factory=lambda: np.ones(1))
    scalar_last: int = 0
    conjugated: bool = False
    turned_back: bool = False
    gravity_sign: float = 1.0
    velocity_turns: int = 0
    spin_turns: int = 1
    centre: Array = dataclasses.field(default_factory=lambda: np.zeros(3))
    at_centre: bool = False
    factors: tuple[float, ...] = (1.0,) * len(SCALED)
    pose_observed: float = 0.0
    exchanged: tuple[str, ...] = ()
    clip: float = math.inf
    smoothing: float = 1.0
    hold_effort: bool = False
    reductions: Array = dataclasses.field(default_factory=lambda: np.ones(1))
    effort_factor: Array = dataclasses.field(default_factory=lambda: np.ones(1))
    lag: int = 0
    observed_lag: int = 0
    clock: float = 0.0
    extra_steps: int = 0
    begins: float = 0.0
    earlier: tuple[Array, ...] = ()

    @classmethod
    def of(cls, mechanism: Mechanism) -> ControlLaw:
        """Law of a mechanism's controller.

        Raises:
            InputError: the mechanism has no controller with a rate, or its motors have gears.
        """
        control = mechanism.control
        if control is None or not control.actuators:
            advice = "mistakes of bookkeeping are found at a controller's instants; give the rate and the gains"
            raise InputError("rate", None, advice)
        by_name = {item.name: item for item in mechanism.actuators}
        servos = [by_name[name] for name in control.actuators]
        geared = next((item for item in servos if item.gear != 1), None)
        if geared is not None:
            raise InputError(f"actuators.{geared.name}.gear", geared.gear, "give gains and targets at the joint")
        return cls._servoed(mechanism, tuple(item.joint for item in servos)).change(
            rate=control.rate,
            delay=control.delay,
            scale=control.scale,
            pose=np.array(control.pose),
            kp=np.array([item.kp for item in servos]),
            kd=np.array([item.kd for item in servos]),
            limit=np.array([item.bound for item in servos]),
            policy=control.policy,
            targets=tuple(item.target for item in servos),
            hold_effort=control.held == EFFORT,
        )

    @classmethod
    def of_efforts(cls, mechanism: Mechanism) -> ControlLaw:
        """Law of a record whose efforts no file tells: no gains but the joints' own damping, no targets, no limits.

        A program may take that damping at the velocity after a step, as it may the kd of a servo.
        """
        single = [joint for joint in mechanism.joints if joint.nq == 1]
        law = cls._servoed(mechanism, tuple(joint.name for joint in single))
        return law.change(kd=np.array([joint.damping for joint in single]))

    @classmethod
    def _servoed(cls, mechanism: Mechanism, joints: tuple[str, ...]) -> ControlLaw:
        """Law of joints of a mechanism without gains, targets and limits."""
        armature = {joint.name: joint.armature for joint in mechanism.joints}
        size = float(np.linalg.norm(mechanism.gravity))
        base = next((joint.child for joint in mechanism.joints if joint.kind == JointKind.FREE), None)
        zeros = np.zeros(len(joints))
        return cls(
            joints=joints,
            rate=1.0,
            delay=0,
            scale=1.0,
            pose=zeros,
            kp=zeros,
            kd=zeros,
            limit=np.full(len(joints), math.inf),
            armature=np.array([armature[joint] for joint in joints]),
            policy=None,
            targets=(0.0,) * len(joints),
            down=np.array(mechanism.gravity) / (size or 1.0),
            signs=np.ones(len(joints)),
            centre=np.zeros(3) if base is None else np.array(mechanism.bodies[mechanism.body_index[base]].com),
        )

    def change(self, **changes: object) -> ControlLaw:
        """The law with some attributes replaced."""
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

    @cached_property
    def _entries(self) -> tuple[list[int], list[int]]:
        """Orders of actions and of observations as indices."""
        usual = range(len(self.joints))
        return list(self.action_order or usual), list(self.observed_order or usual)

    def answer(self) -> Callable[[Observation], Any] | None:
        """Policy before its first observation; None: there is none."""
        return None if self.policy is None else self.policy.made(self.joints)

    def observed(self, state: RobotState, last: Array) -> Observation:
        """Observation of a state, ``last`` being the action before; or of several states at once."""
        quaternion = state.q_WB * [1, -1, -1, -1] if self.conjugated else state.q_WB
        R = Rotation.from_quat(np.roll(quaternion, -self.scalar_last, axis=-1), scalar_first=True).as_matrix()
        R = np.swapaxes(R, -1, -2) if self.turned_back else R
        body = Rotation.from_quat(state.q_WB, scalar_first=True).as_matrix()
        order = self._entries[1]
        q, v, velocity, spin, action_factor = self.factors
        moving = state.v_WB + self.at_centre * np.cross(state.w_WB, body @ self.centre)
        seen = Observation(
            time=state.time + self.clock,
            q=q * (state.q + self.pose_observed * self.pose)[..., order],
            v=v * state.v[..., order],
            p_WB=state.p_WB,
            R_WB=R,
            v_WB_W=velocity * _turned(body, self.velocity_turns, moving),
            w_WB_B=spin * _turned(body, self.spin_turns, state.w_WB),
            gravity_B=self.gravity_sign * (np.swapaxes(R, -1, -2) @ self.down),
            last=action_factor * last,
        )
        others = zip(self.exchanged, reversed(self.exchanged), strict=True)
        return dataclasses.replace(seen, **{name: getattr(seen, other) for name, other in others})

    @property
    def observing(self) -> tuple[object, ...]:
        """Settings on which :meth:`observed` depends besides a state."""
        rotations = ("scalar_last", "conjugated", "turned_back", "gravity_sign", "velocity_turns", "spin_turns")
        others = ("observed_order", "factors", "pose_observed", "at_centre", "observed_lag", "exchanged", "clock")
        return tuple(getattr(self, name) for name in (*rotations, *others))

    def smoothed(self, action: Array, previous: Array) -> Array:
        """Part of an action that counts, clipped, beside what counted at the instant ``previous``."""
        clipped = np.clip(action, -self.clip, self.clip)
        return np.asarray(clipped if self.smoothing == 1 else previous + self.smoothing * (clipped - previous), float)

    def target(self, action: Array | None, time: float) -> Array:
        """Targets of the joints for an action, shape (n,), before any delay; without a policy those of ``time``."""
        if action is None:
            targets = np.array([float(value_at(signal, time)) for signal in self.targets])
        else:
            targets = np.empty(len(self.joints))
            targets[self._entries[0]] = action
            targets = self.pose + self.scale * targets
        return np.asarray(self.signs * targets, float)

    def period(self, step: float) -> int:
        """Number of steps [s] between two instants, at least 1. Raises InputError if it is not whole."""
        return max(1, whole_steps(0.0, 1 / self.rate, step) + self.extra_steps)

    def waiting(self) -> tuple[Array, list[Array]]:
        """Action before the first instant, (n), and the targets that wait then, the next to act first."""
        last = self.earlier[-1] if self.earlier else np.zeros(len(self.joints))
        late = [self.target(action, self.begins) for action in self.earlier[len(self.earlier) - self.delay :]]
        return last, [self.pose.copy()] * (self.delay - len(late)) + late

    def effort(self, target: Array, q: Array, v: Array) -> Array:
        """Efforts of the servos [N m or N], clamped; arrays have the joints last."""
        unclamped = self.kp * (target - q) - self.kd * v
        return np.asarray(self.effort_factor * np.clip(unclamped, -self.limit, self.limit))


def _turned(body: Array, turns: int, vector: Array) -> Array:
    """Vector that is turned so many times from the world's axes to those of the body, or back."""
    R = np.linalg.matrix_power(np.swapaxes(body, -1, -2) if turns > 0 else body, abs(turns))
    return np.asarray((R @ vector[..., None])[..., 0])
