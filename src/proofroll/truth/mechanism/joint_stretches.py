"""Stretches of a mechanism with dry friction, stops or effort limits: ends and events, which both routes share.

The routes share no equation and no decision.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.drives import MODES, Actuator
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import HOLDING, Mode, SwitchedJoint, changes, end_event
from proofroll.truth.hybrid import Stretch, Transition
from proofroll.truth.mechanism.followed_paths import CLOSE, time_accuracy
from proofroll.truth.mechanism.stretches import Stretches

Actuators = tuple[Actuator, ...]
_NEAR = 1e-12  # relative difference from a stop below which a coordinate is at it
_DIGITS = 8  # round-off of a coordinate, in units of its last digit
_STILL = 1e-13  # natural speed below which a joint stops together with another one, as where a loop links both


class JointStretches(Stretches[Mode]):
    """Stretches of a mechanism with switched joints, and transitions; the last component of a state is the time.

    Implements :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    joints: tuple[SwitchedJoint, ...]
    limited: Actuators

    @abstractmethod
    def _at_rest(self, stretch: Stretch[Mode], state: Array, stopped: Sequence[int]) -> tuple[Array, Mode, float]:
        """State, mode and margin after joints that moved against friction have stopped."""

    @abstractmethod
    def _hit(self, stretch: Stretch[Mode], state: Array, which: int, stop: float) -> tuple[Array, Mode, float, float]:
        """State, mode, margin, and time until the rebounds are over [s], after a joint has hit a stop."""

    @abstractmethod
    def _along(self, state: Array) -> tuple[Array, Array]:
        """Coordinates and rates of the switched joints."""

    def jumped(self, stretch: Stretch[Mode]) -> Transition[Mode]:
        """Transition at the end of a stretch where forces jump: the mode is decided anew."""
        holding = [k for k, own in enumerate(stretch.mode[: len(self.joints)]) if own in HOLDING]
        state = np.append(stretch.last[:-1], stretch.end)
        state, mode, margin = self._at_rest(stretch, state, holding)
        count = len(self.joints)
        pairs = zip(self.limited, stretch.mode[count:], mode[count:], strict=True)
        jumps = [effort_event(item, now) for item, before, now in pairs if now != before]
        return Transition(state, mode, (*changes(self.joints, stretch.mode, mode), *jumps), margin)

    def change(self, stretch: Stretch[Mode]) -> Transition[Mode]:
        """See the protocol."""
        if stretch.guard is None:  # at a break of the rates
            return Transition(stretch.last, stretch.mode, ())
        which, kind = guards_of(self.joints, stretch.mode)[stretch.guard]
        state, mode = np.append(stretch.last[:-1], stretch.end), list(stretch.mode)
        if kind in MODES:
            mode[which] = kind
            return Transition(state, tuple(mode), (effort_event(self.limited[which - len(self.joints)], kind),))
        joint = self.joints[which]
        if kind in {"up", "down"}:
            # The force that held the joint has reached its bound: only this joint starts to move.
            was, mode[which] = mode[which], joint.moving(1.0 if kind == "up" else -1.0)
            return Transition(state, tuple(mode), ((end_event(was), joint.name),))
        if kind == "still":
            rates = np.abs(self._along(state)[1])
            slides = [k for k, own in enumerate(stretch.mode) if own in {"forward", "backward"}]
            stopped = [k for k in slides if k == which or rates[k] <= _STILL]
            state, decided, margin = self._at_rest(stretch, state, stopped)
            return Transition(state, decided, changes(self.joints, stretch.mode, decided), margin)
        q, before = self._along(state.copy())
        state, decided, margin, delay = self._hit(stretch, state, which, joint.low if kind == "low" else joint.high)
        if order_decides(self.joints, stretch, q, before, self._along(state)[1], which):
            return Transition(state, None, (), 0.0)
        settles = delay > 0 and decided[which] in HOLDING
        changed = [item for item in changes(self.joints, stretch.mode, decided) if item[1] != joint.name]
        happened = ("settle" if settles else "impact", joint.name), *changed
        return Transition(
            state=state, mode=decided, happenings=happened, margin=np.inf if settles else margin, delay=delay
        )


def reversed_mode(mode: Mode, which: int) -> Mode:
    """Mode with the direction of one joint reversed."""
    back = {"forward": "backward", "backward": "forward"}
    return tuple(back.get(own, own) if k == which else own for k, own in enumerate(mode))


def guards_of(joints: tuple[SwitchedJoint, ...], mode: Mode) -> list[tuple[int, str]]:
    """Guards of a stretch in this mode: index of the joint (actuators are numbered after all joints), and kind.

    ``up``, ``down``: the holding force reaches its bound and the joint moves in this direction; ``still``: a joint that
    moves against friction stops; ``low``, ``high``: a joint reaches a stop; ``least``, ``greatest``: an effort reaches
    its limit; ``linear``: it leaves the limit.
    """
    guards = []
    for number, (joint, own) in enumerate(zip(joints, mode, strict=False)):
        low, high = joint.bounds(own)
        if own in HOLDING:
            guards += [(number, "up")] * math.isfinite(low) + [(number, "down")] * math.isfinite(high)
            continue
        if own != "free":
            guards.append((number, "still"))
        if math.isfinite(joint.low) and own != "forward":
            guards.append((number, "low"))
        if math.isfinite(joint.high) and own != "backward":
            guards.append((number, "high"))
    for number, own in enumerate(mode[len(joints) :], len(joints)):
        guards += [(number, other) for other in (("least", "greatest") if own == "linear" else ("linear",))]
    return guards


def guard_values(
    joints: tuple[SwitchedJoint, ...],
    actuators: Actuators,
    mode: Mode,
    q: Array,
    v: Array,
    force: Array,
    wanted: Sequence[float],
) -> FloatArray:
    """Values of :func:`guards_of`, from coordinates, rates and forces of the joints and efforts before clamping."""
    values = []
    for k, kind in guards_of(joints, mode):
        if k < len(joints):
            values.append(_guard_value(joints[k], mode[k], kind, float(q[k]), float(v[k]), float(force[k])))
        else:
            values.append(_beyond(wanted[k - len(joints)], actuators[k - len(joints)].bound, mode[k], kind))
    return np.array(values)


def _beyond(wanted: float, bound: float, mode: str, kind: str) -> float:
    """Effort beyond its bound; for kind ``linear``, back within it."""
    if kind == "linear":
        return bound - wanted if mode == "greatest" else bound + wanted
    return wanted - bound if kind == "greatest" else -bound - wanted


def effort_event(actuator: Actuator, kind: str) -> tuple[str, str]:
    """Event of an effort that reaches or leaves its limit."""
    return ("release" if kind == "linear" else "saturate", actuator.name)


def _guard_value(joint: SwitchedJoint, mode: str, kind: str, q: float, v: float, force: float) -> float:
    """Value of a joint's guard, negative while the mode lasts."""
    low, high = joint.bounds(mode)
    if kind == "up":
        return low - force
    if kind == "down":
        return force - high
    if kind == "still":
        return -v if mode == "forward" else v
    return joint.low - q if kind == "low" else q - joint.high


def order_decides(
    joints: tuple[SwitchedJoint, ...], stretch: Stretch[Mode], q: Array, before: Array, after: Array, hit: int
) -> bool:
    """True if the order of two impacts on stops matters and cannot be resolved.

    Another joint would reach its stop within the accuracy of times, and the impact changes its rate. ``q``: coordinates
    of the switched joints at the impact; ``before``, ``after``: their rates.
    """
    speed, within = abs(float(before[hit])), time_accuracy(stretch.end)
    for k, kind in guards_of(joints, stretch.mode):
        if k >= len(joints) or k == hit or kind not in {"low", "high"}:
            continue
        closing = -float(before[k]) if kind == "low" else float(before[k])
        gap = -_guard_value(joints[k], stretch.mode[k], kind, float(q[k]), 0.0, 0.0)
        if closing > 0 and gap <= closing * within and abs(after[k] - before[k]) > CLOSE * speed:
            return True
    return False


def noise_of(
    joints: tuple[SwitchedJoint, ...], actuators: Actuators, mode: Mode, q: Array, v: Array, wanted: Sequence[float]
) -> FloatArray:
    """Round-off of the guards of a stretch that starts at joint coordinates q and rates v.

    It is zero away from stops, limits and rest: the force that makes a joint slip is at its bound, so that round-off
    decides its first acceleration.
    """
    noise = []
    for number, kind in guards_of(joints, mode):
        if number >= len(joints):
            actuator = actuators[number - len(joints)]
            apart = abs(abs(wanted[number - len(joints)]) - actuator.bound)
            noise.append(_DIGITS * float(np.spacing(actuator.bound)) if apart <= _NEAR * actuator.bound else 0.0)
            continue
        if kind == "still":
            noise.append(_STILL if abs(v[number]) <= _STILL else 0.0)
            continue
        at = {"low": joints[number].low, "high": joints[number].high}.get(kind)
        leaves = at is not None and abs(q[number] - at) <= _NEAR * max(1.0, abs(at))
        noise.append(_DIGITS * float(np.spacing(max(1.0, abs(at)))) if leaves and at is not None else 0.0)
    return np.array(noise)


def near_stops(joints: tuple[SwitchedJoint, ...], mode: Mode) -> FloatArray:
    """Height of each guard's crest below which round-off decides if the joint reaches its stop.

    0 for other guards: an effort that reaches its limit for a moment has no impact, and changes nothing.
    """
    return np.array([CLOSE * (kind in {"low", "high"}) for _, kind in guards_of(joints, mode)])
