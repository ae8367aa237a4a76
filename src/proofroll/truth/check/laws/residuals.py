"""Laws with their allowances, and the residuals of one route in parts of these."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from proofroll.truth.check.laws.record import Array

STRUCK = 1e-9  # jump of velocities, in natural sizes, above which there was an impact
INSTANT = 1e-6  # natural times beside an event of which what jumps may be on either side
_HOLE = 1e-6  # natural times that steps may leave out
# Law -> allowance of its residual, relative to its natural size, and the law as a clause. On honest records of all
# models the largest residual is 0.2 of its allowance, most are below 1e-3 of it.
LAWS: dict[str, tuple[float, str]] = {
    "place": (1e-10, "place = integral of the velocity"),
    "turn": (1e-10, "rotation = integral of the angular velocity"),
    "joined": (1e-10, "poses and velocities go on where they ended"),
    "momentum": (1e-10, "momentum = integral of the forces"),
    "spin": (1e-10, "angular momentum = integral of the moments"),
    "joint place": (1e-10, "a joint holds its bodies together"),
    "joint rate": (1e-10, "bodies of a joint move together"),
    "loop force": (1e-10, "a loop bears no force along its free directions"),
    "coupling": (1e-10, "coupled coordinates keep their sum"),
    "coupling rate": (1e-10, "coupled rates keep their sum"),
    "motion": (1e-10, "a driven joint follows its motion"),
    "effort": (1e-9, "effort = law of the actuator within its limit"),
    "dry friction": (1e-9, "dry friction opposes the rate within its bound"),
    "stop": (1e-10, "no joint passes its stop"),
    "stop rate": (1e-10, "a joint that a stop or dry friction holds is at rest"),
    "gap": (1e-10, "no body passes into another"),
    "surface": (1e-10, "a contact force acts on both surfaces"),
    "normal": (1e-10, "the normal is that of the surfaces"),
    "gap rate": (1e-10, "surfaces in contact neither part nor approach"),
    "pull": (1e-9, "a contact presses and never pulls; apart, no force"),
    "cone": (1e-9, "friction of a contact that sticks lies within its bound"),
    "stick": (1e-10, "a contact that sticks does not slip"),
    "slip": (1e-9, "friction of a slip opposes it with mu N"),
    "turning": (1e-9, "the moment against rolling or spin follows its law"),
    "event": (1e-9, "a change of mode happens at the zero of its cause"),
    "impulse": (1e-10, "velocities jump by impulses of joints, stops and contacts"),
    "restitution": (1e-10, "v+ = -e v- at an impact"),
    "impact cone": (1e-9, "impulses press, within the bound of friction"),
    # Of what is published; ten times what answers of all models and 130 drawn scenes need.
    "start": (1e-13, "the motion begins as the joints say"),
    "tiled": (_HOLE, "the motion that was followed leaves no time out"),
    "sample": (3e-12, "a sample lies on the motion that was followed"),
    "times": (1e-14, "samples are at the times that were asked for"),
    "newton": (5e-11, "mass times acceleration = sum of the published forces"),
    "euler": (5e-11, "rate of angular momentum = sum of the published moments"),
    "unknown": (1e-1, "what the laws of motion determine is known"),
    "along": (5e-11, "a joint transmits along a free direction what its drives, springs and friction give"),
    "power": (5e-11, "rate of the energy = power of the published forces"),
    "value": (1e-13, "a published value follows from places and velocities"),
    "spelling": (1e-13, "two variables of one quantity are equal"),
    "nothing left": (1e-11, "published residuals of the laws are round-off"),
    "strike": (1e-12, "what is told of an impact follows from the motion beside it"),
    "rebound": (1e-11, "the rate of a gap or coordinate turns at an impact with the restitution"),
    "work": (1e-11, "work = integral of force times rate"),
    "change": (1e-11, "an event lies where the motion changes, and each change has its event"),
}
# Laws that a route keeps by their second derivatives alone: their residuals (1e-13 after 1 s of `stopped_fall`) grow
# as a random walk of rates does. So their allowances grow with the time in natural units.
_DRIFTING = frozenset({"joint place", "joint rate", "coupling", "coupling rate", "motion", "stop", "stop rate"})
_DRIFTING |= {"gap", "surface", "normal", "gap rate", "stick", "event"}
COARSE = 30.0  # factor for what dense output of DOP853 says inside a step: it holds to 1.4e-12, ten times the steps
ROUND = 1e-13  # round-off of places and angles in their natural sizes, which stiff springs turn into forces
# What 12 points do not resolve excuses a residual up to this part of its size: more would hide a force that jumps.
_UNRESOLVED = 1e-9


class Violation(NamedTuple):
    """First violation of a law by a route.

    Attributes:
        time: start of the piece in which it happens [s].
        law: name of the law.
        part: name of the body, joint or contact; empty: the whole mechanism.
        size: residual relative to its natural size.
        allowed: allowance relative to it.
    """

    time: float
    law: str
    part: str
    size: float
    allowed: float


@dataclass
class LawResiduals:
    """Residuals of one route, in parts of their allowances.

    Attributes:
        largest: law -> largest residual in parts of its allowance, its time [s] and part.
        first: first violation; None: all laws hold.
        points: number of points at which laws were evaluated.
        events: number of transitions.
        coarse: factor on all allowances, now.
        rate: natural rate of the scene [1/s].
        known_alone: True if no law holds for a value of NaN, which is not determined.
    """

    largest: dict[str, tuple[float, float, str]] = field(default_factory=dict)
    first: Violation | None = None
    points: int = 0
    events: int = 0
    coarse: float = 1.0
    rate: float = 0.0
    known_alone: bool = False

    def note(
        self,
        law: str,
        part: str,
        residual: Array,
        size: Array | float,
        time: Array,
        extra: Array | float = 0.0,
        tail: Array | float = 0.0,
    ) -> None:
        """Takes residuals (pieces, points, …), with their natural sizes, at times (pieces, points, …) [s].

        ``extra``: further allowance, absolute; ``tail``: likewise, of what the points do not resolve, bounded.
        """
        residual = np.abs(residual)
        if not residual.size:
            return
        size, extra, tail = (np.broadcast_to(np.asarray(value, float), residual.shape) for value in (size, extra, tail))
        times = np.broadcast_to(time.reshape(time.shape + (1,) * (residual.ndim - time.ndim)), residual.shape)
        growth = 1.0 + self.rate * times if law in _DRIFTING else 1.0
        with np.errstate(all="ignore"):
            allowed = LAWS[law][0] * self.coarse * growth * size + extra + np.minimum(tail, _UNRESOLVED * size)
            parts = np.where(residual > 0, residual / allowed, 0.0)
        parts = np.where(np.isfinite(residual), parts, np.inf)
        if self.known_alone:
            parts = np.where(np.isnan(residual) | np.isnan(allowed), 0.0, parts)
        worst = int(np.argmax(parts))
        if parts.flat[worst] >= self.largest.get(law, (0.0,))[0]:
            self.largest[law] = float(parts.flat[worst]), float(times.flat[worst]), part
        if not parts.flat[worst] > 1.0:
            return
        violating = (parts > 1.0).reshape(len(parts), -1).any(1)
        piece = int(violating.argmax())
        begin = float(times[piece].min())
        if self.first is None or begin < self.first.time:
            number = int(np.argmax(parts[piece]))
            with np.errstate(all="ignore"):
                size_there = float(residual[piece].flat[number] / size[piece].flat[number])
                bound = float(allowed[piece].flat[number] / size[piece].flat[number])
            self.first = Violation(time=begin, law=law, part=part, size=size_there, allowed=bound)

    def held(self) -> str:
        """Clause on the laws that hold; empty: nothing could be held to a law."""
        if not (self.points or self.events):
            return ""
        law, (part, time, _) = max(self.largest.items(), key=lambda item: item[1][0], default=("", (0.0, 0.0, "")))
        points = [f"at {self.points:,} points"] * bool(self.points)
        events = [f"on both sides of {self.events} event{'s' * (self.events != 1)}"] * bool(self.events)
        return (
            f"holds {len(self.largest)} laws {' and '.join(points + events)}; "
            f"largest residual {part:.2g} of its allowance ({law}, {time:.3g} s)"
        )

    def broken(self, subject: str) -> str:
        """Sentence of the first violation; empty: there is none."""
        item = self.first
        if item is None:
            return ""
        part = f" for {item.part}" if item.part else ""
        return (
            f'{subject} breaks the law "{LAWS[item.law][1]}"{part} by {item.size:.2g} of its natural size '
            f"(allowed {item.allowed:.1g}): an error of proofroll; please report it"
        )
