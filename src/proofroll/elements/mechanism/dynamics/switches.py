"""Switching laws of a mechanism's joints, as its scene states them: forces that hold or push, and names of events.

A switched joint has one coordinate. Its mode is ``free``; ``forward`` or ``backward`` while it slides against dry
friction; ``stick`` while friction holds it; ``low`` or ``high`` while a stop holds it, with its friction. The mode of
an effort with a limit is ``least``, ``linear`` or ``greatest``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.events import EventKind
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array

# Modes of the switched joints, then of the actuators whose effort has a limit.
Mode = tuple[str, ...]
# Speed of an impact, relative to the largest at the same stop or contact, below which only the total time of the
# further rebounds is summed: their height is 1e-12 of the first, less than the round-off of the coordinate. It is no
# power of a restitution that a file is likely to have, or round-off would decide which rebound is the last.
SETTLED = math.exp(-13.5)
NEAR = 1e-13  # distance from a stop, in parts of the range between both, that is rounding: the joint is at it
STOPPED = frozenset({"low", "high"})
HOLDING = STOPPED | {"stick"}
REDUNDANT = (
    "friction or stops of joints hold what loops, couplings, motions or one another hold already, so that "
    "their forces are not determinate: keep the friction or the stop of one of them; damping may stay in all"
)


@dataclass(frozen=True)
class SwitchedJoint:
    """A joint with dry friction, or with a stop.

    Attributes:
        name: of the joint.
        number: index among the joints.
        coordinate, velocity: indices in q and v.
        friction: N or N m; 0: none.
        low, high: rad or m; infinite: no stop.
        restitution: of an impact on a stop.
    """

    name: str
    number: int
    coordinate: int
    velocity: int
    friction: float
    low: float
    high: float
    restitution: float

    def bounds(self, mode: str) -> tuple[float, float]:
        """Bounds of the force on the coordinate that can hold it in this mode, N or N m."""
        low = -math.inf if mode == "high" else -self.friction
        return low, math.inf if mode == "low" else self.friction

    def moving(self, direction: float) -> str:
        """Mode in which the joint moves in a direction, by its sign."""
        if not self.friction:
            return "free"
        return "forward" if direction > 0 else "backward"

    def resting(self, q: float) -> str:
        """Mode that can hold the joint at a coordinate; ``free`` if none can."""
        return self.stop_at(q) or ("stick" if self.friction else "free")

    def stop_at(self, q: float) -> str:
        """The stop, ``low`` or ``high``, that a coordinate is at within rounding; empty: none."""
        if math.isinf(self.low):
            return ""
        near = NEAR * (self.high - self.low)
        return "low" if q - self.low <= near else "high" if self.high - q <= near else ""

    def lasts(self, q: float, v: float, a: float) -> float:
        """Time until it reaches a stop, or turns against friction, at a constant acceleration [s]; infinite: never."""
        times = [-v / a] if self.friction and v * a < 0 else []
        for stop, end, outward in (("low", self.low, -v), ("high", self.high, v)):
            if self.stop_at(q) == stop:  # it strikes at once, stays, or leaves and may come back
                times += [0.0] if outward > 0 else [-2 * v / a] if v * a < 0 else []
            elif math.isfinite(end):
                times += [root.real for root in np.roots([a / 2, v, q - end]) if root.imag == 0 < root.real]
        return min(times, default=math.inf)

    def push(self, mode: str) -> float:
        """Force of kinetic friction on the coordinate, N or N m."""
        return {"forward": -self.friction, "backward": self.friction}.get(mode, 0.0)


class Settling:
    """Largest impact speed at each stop or contact so far, which decides when rebounds are summed."""

    def __init__(self, *, early: bool = False) -> None:
        """Takes whether rebounds are summed ``early``: one before, and at twice the speed at least."""
        self._fastest, self._early = dict[int, float](), early

    def __call__(self, which: int, speed: float, restitution: float) -> bool:
        """True if only the total time of the rebounds that follow this impact is summed.

        ``which`` is the number of the stop or contact. ``speed`` is in natural units; the largest speed counts as at
        least 1, for the first impact itself may come from a fall of round-off.
        """
        fastest = self._fastest[which] = max(speed, self._fastest.get(which, 1.0))
        limit = SETTLED * fastest / (min(restitution, 0.5) if self._early and restitution else 1.0)
        return 0.0 < restitution < 1.0 and speed < limit


def switched_joints(mechanism: Mechanism) -> tuple[SwitchedJoint, ...]:
    """The joints of a mechanism that have dry friction or limits.

    Raises:
        Refused: dry friction in a joint with several coordinates, which has no direction of its own.
    """
    switched = []
    for number, joint in enumerate(mechanism.joints):
        if not joint.friction and joint.limits is None:
            continue
        if joint.nq != 1:
            raise Refused(f"joint {joint.name} has dry friction along several coordinates, which no route follows")
        q, v = mechanism.q_slices[number].start, mechanism.v_slices[number].start
        low, high = joint.limits or (-math.inf, math.inf)
        switched.append(
            SwitchedJoint(
                name=joint.name,
                number=number,
                coordinate=q,
                velocity=v,
                friction=joint.friction,
                low=low,
                high=high,
                restitution=joint.restitution,
            )
        )
    return tuple(switched)


def with_stops_at_start(mechanism: Mechanism) -> Mechanism:
    """Mechanism whose stops lie where its joints start, if these start beyond them, or before them by rounding."""

    def placed(joint: Joint) -> Joint:
        if not (joint.limits and joint.q0):
            return joint
        (low, high), (q,) = joint.limits, joint.q0
        near = NEAR * (high - low)
        return replace(joint, limits=(q if q - low <= near else low, q if high - q <= near else high))

    return replace(mechanism, joints=tuple(map(placed, mechanism.joints)))


def first_change(joints: Sequence[SwitchedJoint], q: Array, v: Array, rates: Array) -> float:
    """Earliest time [s] at which a joint reaches a stop or turns against friction."""
    return min((j.lasts(q[j.coordinate], v[j.velocity], rates[j.velocity]) for j in joints), default=math.inf)


def end_event(mode: str) -> str:
    """Event that ends the mode of a held joint."""
    return EventKind.SLIP if mode == "stick" else EventKind.LIFT_OFF


def changes(joints: Sequence[SwitchedJoint], old: Mode, new: Mode) -> tuple[tuple[str, str], ...]:
    """Events (kind, joint) of joints that become held, reverse, or are set free by a change of mode."""
    events: list[tuple[str, str]] = []
    for joint, earlier, now in zip(joints, old, new, strict=False):
        if now in HOLDING and earlier not in HOLDING:
            events.append((EventKind.STICK if now == "stick" else EventKind.REST, joint.name))
        elif earlier in HOLDING and now not in HOLDING:
            events.append((end_event(earlier), joint.name))
        elif earlier != now and earlier not in HOLDING:
            events.append((EventKind.TURN, joint.name))
    return tuple(events)


def held_joints(mode: Mode) -> list[int]:
    """Indices, among the switched joints, of those that are held."""
    return [number for number, joint_mode in enumerate(mode) if joint_mode in HOLDING]
