"""Stretches of a mechanism with dry friction, stops or limits of efforts: ends and events, which its two routes share.

What they share is no equation and no decision.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.drives import MODES, Actuator
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import HOLDING, Mode, SwitchedJoint, changes, left_by
from proofroll.truth.hybrid import Stretch, Transition
from proofroll.truth.mechanism.stretches import Stretches
from proofroll.truth.mechanism.two_paths import CLOSE, moment

Motors = tuple[Actuator, ...]
_NEAR = 1e-12  # relative: a coordinate this close to a stop is at it
_DIGITS = 8  # last digits of a coordinate that are round-off


class JointStretches(Stretches[Mode]):
    """Stretches, ends of them, and what follows; a state ends with the time.

    See :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    joints: tuple[SwitchedJoint, ...]
    motors: Motors

    @abstractmethod
    def _at_rest(self, leg: Stretch[Mode], state: Array, which: int) -> tuple[Array, Mode, float]:
        """State, mode and margin after a joint that moved against friction has come to rest."""

    @abstractmethod
    def _hit(self, leg: Stretch[Mode], state: Array, which: int, stop: float) -> tuple[Array, Mode, float, float]:
        """State, mode, margin, and time until rebounds are over [s], after a joint has hit a stop."""

    @abstractmethod
    def _along(self, state: Array) -> tuple[Array, Array]:
        """Coordinates and rates of the switched joints."""

    def change(self, leg: Stretch[Mode]) -> Transition[Mode]:
        """See the protocol."""
        if leg.guard is None:  # at a break
            return Transition(leg.last, leg.mode, ())
        which, kind = guards_of(self.joints, leg.mode)[leg.guard]
        state, mode = np.append(leg.last[:-1], leg.end), list(leg.mode)
        if kind in MODES:
            mode[which] = kind
            return Transition(state, tuple(mode), (effort_event(self.motors[which - len(self.joints)], kind),))
        joint = self.joints[which]
        if kind in {"up", "down"}:
            # The force that holds has reached its bound: the joint leaves, and nothing else feels it yet.
            was, mode[which] = mode[which], joint.moving(1.0 if kind == "up" else -1.0)
            return Transition(state, tuple(mode), ((left_by(was), joint.name),))
        if kind == "still":
            state, decided, margin = self._at_rest(leg, state, which)
            return Transition(state, decided, changes(self.joints, leg.mode, decided), margin)
        q, before = self._along(state.copy())
        state, decided, margin, delay = self._hit(leg, state, which, joint.low if kind == "low" else joint.high)
        if order_decides(self.joints, leg, q, before, self._along(state)[1], which):
            return Transition(state, None, (), 0.0)
        settles = delay > 0 and decided[which] in HOLDING
        changed = [item for item in changes(self.joints, leg.mode, decided) if item[1] != joint.name]
        happened = ("settle" if settles else "impact", joint.name), *changed
        return Transition(state, decided, happened, np.inf if settles else margin, delay)


def turned(mode: Mode, which: int) -> Mode:
    """The mode with one joint on its way back."""
    back = {"forward": "backward", "backward": "forward"}
    return tuple(back.get(own, own) if k == which else own for k, own in enumerate(mode))


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


def order_decides(
    joints: tuple[SwitchedJoint, ...], leg: Stretch[Mode], q: Array, before: Array, after: Array, hit: int
) -> bool:
    """True if less than parameters are known to decides which of two stops is hit first, and it matters.

    Another joint would come to its stop nearer in time than times are known to, and the impact moves it.
    ``q`` are coordinates at the impact, ``before`` and ``after`` rates beside it, of the switched joints.
    """
    speed, within = abs(float(before[hit])), moment(leg.end)
    for k, kind in guards_of(joints, leg.mode):
        if k >= len(joints) or k == hit or kind not in {"low", "high"}:
            continue
        closing = -float(before[k]) if kind == "low" else float(before[k])
        gap = -_guard_value(joints[k], leg.mode[k], kind, float(q[k]), 0.0, 0.0)
        if closing > 0 and gap <= closing * within and abs(after[k] - before[k]) > CLOSE * speed:
            return True
    return False


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
