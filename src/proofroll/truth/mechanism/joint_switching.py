"""Route 1 of a mechanism with dry friction, stops or limits of efforts: joint coordinates, modes by complementarity."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.drives import MODES, Actuator
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import HOLDING, Mode, SwitchedJoint, changes, held_by, left_by
from proofroll.truth.hybrid import Stretch, Transition
from proofroll.truth.mechanism.stretches import Stretches, StretchLaw

Motors = tuple[Actuator, ...]
# Of the largest speed at which a joint hit its stop: of slower rebounds only the time is summed. They have 1e-12 of the
# way of the first, which drowns in the round-off of the coordinate.
SETTLED = 1e-6
_NEAR = 1e-12  # relative: a coordinate this close to a stop is at it
_DIGITS = 8  # last digits of a coordinate that are round-off


class SwitchedTree(Stretches[Mode]):
    """The legs of a mechanism in the coordinates of its tree; a state ends with the time.

    See :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    def __init__(self, equations: JointCoordinates, tolerance: float) -> None:
        self.equations, self.joints = equations, equations.switched
        self.motors = tuple(actuator for actuator, *_ in equations.limited)
        self._nq = equations.mechanism.nq
        super().__init__(self._nq + equations.mechanism.nv + 1, tolerance)

    def begin(self) -> Transition[Mode]:
        """See the protocol."""
        state = np.append(np.concatenate(self.equations.mechanism.start()), 0.0)
        mode, margin = self.equations.decided(*self._parts(state), 0.0)
        return Transition(state, mode, (), margin)

    def _law(self, state: Array, mode: Mode) -> StretchLaw:
        q, v = self._parts(state)
        at_q = [joint.coordinate for joint in self.joints]
        corrected = self.equations.followed(mode)
        return StretchLaw(
            lambda y: np.append(self.equations.rate(float(y[-1]), y[:-1], mode), 1.0),
            lambda y: self._guards(y, mode),
            lambda y: np.append(corrected(y[:-1]), y[-1]),
            noise_of(self.joints, self.motors, mode, q[at_q], self._wanted(float(state[-1]), q, v)),
        )

    def change(self, leg: Stretch[Mode]) -> Transition[Mode]:
        """See the protocol."""
        if leg.guard is None:  # at a break
            return Transition(leg.last, leg.mode, ())
        which, kind = guards_of(self.joints, leg.mode)[leg.guard]
        state, mode = leg.last.copy(), list(leg.mode)
        state[-1] = leg.end
        if kind in MODES:
            mode[which] = kind
            return Transition(state, tuple(mode), (effort_event(self.motors[which - len(self.joints)], kind),))
        joint = self.joints[which]
        q, v = self._parts(state)
        if kind in {"up", "down"}:
            # The force that holds has reached its bound: the joint leaves, and nothing else feels it yet.
            was, mode[which] = mode[which], joint.moving(1.0 if kind == "up" else -1.0)
            return Transition(state, tuple(mode), ((left_by(was), joint.name),))
        if kind == "still":
            v[joint.velocity] = 0.0
            decided, margin = self.equations.decided(q, v, leg.end)
            return Transition(state, decided, self._stopped(leg.mode, decided), margin)
        q[joint.coordinate] = joint.low if kind == "low" else joint.high
        speed = abs(float(v[joint.velocity]))
        fastest = self._fastest.setdefault(which, speed)
        v[:], margin = self.equations.struck(q, v, which)
        delay, rebound = 0.0, abs(float(v[joint.velocity]))
        if joint.restitution and speed < SETTLED * fastest:
            pull = abs(float(self.equations.solve(q, v, leg.mode, time=leg.end).acceleration[joint.velocity]))
            v[joint.velocity] = 0.0
            delay = 2 * rebound / (pull * (1 - joint.restitution))
        decided, after = self.equations.decided(q, v, leg.end)
        settles = delay > 0 and decided[which] in HOLDING
        happened = [("settle" if settles else "impact", joint.name)] + [
            item for item in self._stopped(leg.mode, decided) if item[1] != joint.name
        ]
        return Transition(state, decided, tuple(happened), np.inf if settles else min(margin, after), delay)

    def holding(self, state: Array, mode: Mode) -> Array:
        """Force of what holds or rubs along each switched joint's coordinate, N or N m."""
        found = self.equations.solve(*self._parts(state), mode, time=float(state[-1])).holding
        force = np.array([joint.push(own) for joint, own in zip(self.joints, mode, strict=False)])
        force[held_by(mode)] = found
        return force

    def _parts(self, state: Array) -> tuple[Array, Array]:
        return state[: self._nq], state[self._nq : -1]

    def _wanted(self, time: float, q: Array, v: Array) -> list[float]:
        return [float(item.wanted(time, q[at_q], v[at_v])) for item, at_q, at_v in self.equations.limited]

    def _guards(self, state: Array, mode: Mode) -> FloatArray:
        q, v = self._parts(state)
        holds = any(own in HOLDING for own in mode)
        force = self.holding(state, mode) if holds else np.zeros(len(self.joints))
        at_q, at_v = [joint.coordinate for joint in self.joints], [joint.velocity for joint in self.joints]
        return guard_values(
            self.joints, self.motors, mode, q[at_q], v[at_v], force, self._wanted(float(state[-1]), q, v)
        )

    def _stopped(self, before: Mode, after: Mode) -> tuple[tuple[str, str], ...]:
        return changes(self.joints, before, after)


def guards_of(joints: tuple[SwitchedJoint, ...], mode: Mode) -> list[tuple[int, str]]:
    """Ends that a leg in this mode may have: number of the joint, or after these of the motor, and kind.

    ``up``, ``down``: the force that holds reaches its bound and the joint moves so; ``still``: a joint that moves
    against friction comes to rest; ``low``, ``high``: it reaches a stop; ``least``, ``linear``, ``greatest``: an effort
    comes to be so.
    """
    found = []
    for number, (joint, own) in enumerate(zip(joints, mode, strict=False)):
        low, high = joint.bounds(own)
        if own in HOLDING:
            found += [(number, "up")] * math.isfinite(low) + [(number, "down")] * math.isfinite(high)
            continue
        if own != "free":
            found.append((number, "still"))
        if math.isfinite(joint.low) and own != "forward":
            found.append((number, "low"))
        if math.isfinite(joint.high) and own != "backward":
            found.append((number, "high"))
    for number, own in enumerate(mode[len(joints) :], len(joints)):
        found += [(number, other) for other in (("least", "greatest") if own == "linear" else ("linear",))]
    return found


def guard_values(
    joints: tuple[SwitchedJoint, ...],
    motors: Motors,
    mode: Mode,
    q: Array,
    v: Array,
    force: Array,
    wanted: Sequence[float],
) -> FloatArray:
    """The guards of :func:`guards_of`, from the coordinates, rates and forces of the joints and the efforts wanted."""
    found = []
    for k, kind in guards_of(joints, mode):
        if k < len(joints):
            found.append(_guard_value(joints[k], mode[k], kind, float(q[k]), float(v[k]), float(force[k])))
        else:
            found.append(_beyond(wanted[k - len(joints)], motors[k - len(joints)].bound, mode[k], kind))
    return np.array(found)


def _beyond(wanted: float, bound: float, mode: str, kind: str) -> float:
    """Effort beyond its bound, or back from it."""
    if kind == "linear":
        return bound - wanted if mode == "greatest" else bound + wanted
    return wanted - bound if kind == "greatest" else -bound - wanted


def effort_event(motor: Actuator, kind: str) -> tuple[str, str]:
    """The event of an effort that reaches its limit or leaves it."""
    return ("release" if kind == "linear" else "saturate", motor.name)


def _guard_value(joint: SwitchedJoint, mode: str, kind: str, q: float, v: float, force: float) -> float:
    """The value of a guard, negative while the mode lasts."""
    low, high = joint.bounds(mode)
    if kind == "up":
        return low - force
    if kind == "down":
        return force - high
    if kind == "still":
        return -v if mode == "forward" else v
    return joint.low - q if kind == "low" else q - joint.high


def noise_of(
    joints: tuple[SwitchedJoint, ...], motors: Motors, mode: Mode, q: Array, wanted: Sequence[float]
) -> FloatArray:
    """Round-off of the guards of a leg that begins at coordinates q of its joints: one that leaves a stop is at it."""
    found = []
    for number, kind in guards_of(joints, mode):
        if number >= len(joints):
            motor = motors[number - len(joints)]
            apart = abs(abs(wanted[number - len(joints)]) - motor.bound)
            found.append(_DIGITS * float(np.spacing(motor.bound)) if apart <= _NEAR * motor.bound else 0.0)
            continue
        at = {"low": joints[number].low, "high": joints[number].high}.get(kind)
        leaves = at is not None and abs(q[number] - at) <= _NEAR * max(1.0, abs(at))
        found.append(_DIGITS * float(np.spacing(max(1.0, abs(at)))) if leaves and at is not None else 0.0)
    return np.array(found)
