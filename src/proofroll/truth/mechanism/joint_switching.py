"""Route 1 of a mechanism whose joints have dry friction or stops: joint coordinates, modes by complementarity."""

from __future__ import annotations

import math

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.record import integrated
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import HOLDING, Mode, SwitchedJoint, held_by
from proofroll.truth.hybrid import Stretch, Transition, walked

# Of the largest speed at which a joint hit its stop: of slower rebounds only the time is summed. They have 1e-12 of the
# way of the first, which drowns in the round-off of the coordinate.
SETTLED = 1e-6
_NEAR = 1e-12  # relative: a coordinate this close to a stop is at it
_DIGITS = 8  # last digits of a coordinate that are round-off


class SwitchedTree:
    """The legs of a mechanism in the coordinates of its tree. See :class:`proofroll.truth.hybrid.HybridRoute`."""

    def __init__(self, equations: JointCoordinates, tolerance: float) -> None:
        self.equations, self.joints = equations, equations.switched
        self._nq = equations.mechanism.nq
        self._tolerance = np.full(self._nq + equations.mechanism.nv, tolerance)
        self._fastest: dict[int, float] = {}
        self._span: float | None = None

    def begin(self) -> Transition[Mode]:
        """See the protocol."""
        state = np.concatenate(self.equations.mechanism.start())
        mode, margin = self.equations.decided(*self._parts(state))
        return Transition(state, mode, (), margin)

    def walk(self, time: float, state: Array, mode: Mode, until: float) -> Stretch[Mode]:
        """See the protocol."""
        equations = self.equations
        end, last, guard = walked(
            lambda t, y: equations.rate(t, y, mode),
            time,
            state,
            until,
            tolerance=self._tolerance,
            guards=lambda y: self._guards(y, mode),
            corrected=lambda y: equations.eliminated(y, mode),
            first_step=self._span,
            noise=noise_of(self.joints, mode, state[: self._nq][[joint.coordinate for joint in self.joints]]),
        )
        self._span = end - time if end > time else None
        return Stretch(time, end, mode, state, last, guard)

    def within(self, leg: Stretch[Mode], times: FloatArray) -> FloatArray:
        """See the protocol."""
        return np.array(
            list(
                integrated(
                    lambda t, y: self.equations.rate(t, y, leg.mode),
                    leg.first,
                    np.maximum(times - leg.start, 0.0),
                    float(self._tolerance[0]),
                    lambda y: self.equations.eliminated(y, leg.mode),
                )
            )
        )

    def change(self, leg: Stretch[Mode]) -> Transition[Mode]:
        """See the protocol."""
        assert leg.guard is not None  # nothing changes at the end of time
        which, kind = guards_of(self.joints, leg.mode)[leg.guard]
        joint, mode = self.joints[which], list(leg.mode)
        state = leg.last.copy()
        q, v = self._parts(state)
        if kind in {"up", "down"}:
            # The force that holds has reached its bound: the joint leaves, and nothing else feels it yet.
            was, mode[which] = mode[which], joint.moving(1.0 if kind == "up" else -1.0)
            return Transition(state, tuple(mode), ((left_by(was), joint.name),))
        if kind == "still":
            v[joint.velocity] = 0.0
            decided, margin = self.equations.decided(q, v)
            return Transition(state, decided, self._stopped(leg.mode, decided), margin)
        q[joint.coordinate] = joint.low if kind == "low" else joint.high
        speed = abs(float(v[joint.velocity]))
        fastest = self._fastest.setdefault(which, speed)
        v[:], margin = self.equations.struck(q, v, which)
        delay, rebound = 0.0, abs(float(v[joint.velocity]))
        if joint.restitution and speed < SETTLED * fastest:
            pull = abs(float(self.equations.solve(q, v, leg.mode).acceleration[joint.velocity]))
            v[joint.velocity] = 0.0
            delay = 2 * rebound / (pull * (1 - joint.restitution))
        decided, after = self.equations.decided(q, v)
        settles = delay > 0 and decided[which] in HOLDING
        happened = [("settle" if settles else "impact", joint.name)] + [
            item for item in self._stopped(leg.mode, decided) if item[1] != joint.name
        ]
        return Transition(state, decided, tuple(happened), np.inf if settles else min(margin, after), delay)

    def holding(self, state: Array, mode: Mode) -> Array:
        """Force of what holds or rubs along each switched joint's coordinate, N or N m."""
        found = self.equations.solve(*self._parts(state), mode).holding
        force = np.array([joint.push(own) for joint, own in zip(self.joints, mode, strict=True)])
        force[held_by(mode)] = found
        return force

    def _parts(self, state: Array) -> tuple[Array, Array]:
        return state[: self._nq], state[self._nq :]

    def _guards(self, state: Array, mode: Mode) -> FloatArray:
        q, v = self._parts(state)
        holds = any(own in HOLDING for own in mode)
        force = self.holding(state, mode) if holds else np.zeros(len(mode))
        return np.array(
            [
                guard_value(self.joints[k], mode[k], kind, q[self.joints[k].coordinate], v[self.joints[k].velocity], f)
                for k, kind in guards_of(self.joints, mode)
                for f in [float(force[k])]
            ]
        )

    def _stopped(self, before: Mode, after: Mode) -> tuple[tuple[str, str], ...]:
        return changes(self.joints, before, after)


def guards_of(joints: tuple[SwitchedJoint, ...], mode: Mode) -> list[tuple[int, str]]:
    """What may end a leg in this mode: number of the joint, and kind.

    ``up``, ``down``: the force that holds reaches its bound and the joint moves so; ``still``: a joint that moves
    against friction comes to rest; ``low``, ``high``: it reaches a stop.
    """
    found = []
    for number, (joint, own) in enumerate(zip(joints, mode, strict=True)):
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
    return found


def guard_value(joint: SwitchedJoint, mode: str, kind: str, q: float, v: float, force: float) -> float:
    """The value of a guard, negative while the mode lasts."""
    low, high = joint.bounds(mode)
    if kind == "up":
        return low - force
    if kind == "down":
        return force - high
    if kind == "still":
        return -v if mode == "forward" else v
    return joint.low - q if kind == "low" else q - joint.high


def noise_of(joints: tuple[SwitchedJoint, ...], mode: Mode, q: Array) -> FloatArray:
    """Round-off of the guards of a leg that begins at coordinates q of its joints: one that leaves a stop is at it."""
    found = []
    for number, kind in guards_of(joints, mode):
        at = {"low": joints[number].low, "high": joints[number].high}.get(kind)
        leaves = at is not None and abs(q[number] - at) <= _NEAR * max(1.0, abs(at))
        found.append(_DIGITS * float(np.spacing(max(1.0, abs(at)))) if leaves and at is not None else 0.0)
    return np.array(found)


def left_by(mode: str) -> str:
    """The event of a joint that leaves what held it."""
    return "slip" if mode == "stick" else "lift_off"


def changes(joints: tuple[SwitchedJoint, ...], before: Mode, after: Mode) -> tuple[tuple[str, str], ...]:
    """Events of joints that come to be held, turn, or are set free by a change of mode."""
    found = []
    for joint, was, now in zip(joints, before, after, strict=True):
        if now in HOLDING and was not in HOLDING:
            found.append(("stick" if now == "stick" else "rest", joint.name))
        elif was in HOLDING and now not in HOLDING:
            found.append((left_by(was), joint.name))
        elif was != now and was not in HOLDING:
            found.append(("turn", joint.name))
    return tuple(found)
