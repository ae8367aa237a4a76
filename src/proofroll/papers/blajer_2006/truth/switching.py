"""Sequence of rolling and slipping of a ball, for any route.

A route integrates one stretch at a time and reports why it ended; this module decides what comes next.
:func:`proofroll.truth.numerics.hybrid.follow` chains the stretches.
"""

from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.events import EventKind
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.sliding import BallStretch, End, Sliding
from proofroll.truth.numerics import hybrid
from proofroll.truth.numerics.hybrid import Transition

# Relative distance from the friction cone below which round-off (1e-15) decides on which side a state is.
_ON_CONE = 1e-12


@dataclass(frozen=True)
class Path:
    """A motion from time 0.

    Attributes:
        stretches: in order.
        events: kind and time [s] of each change.
        ended: reason why it is not known to the last time, as a clause; empty: it is.
    """

    stretches: list[BallStretch]
    events: list[tuple[str, float]]
    ended: str


def follow(body: RollingBall, route: Sliding, until: float) -> Path:
    """Path from time 0 to ``until`` [s], or to an earlier time from which the motion is not known.

    Raises:
        Refused, Diverged: no motion is known from time 0 on, or rolling resistance is against turning.
    """
    if body.contact.rolling_resistance and body.contact.against == "turning":
        raise Refused('the article has its resistance against the motion of the centre; set against = "motion"')
    path = hybrid.follow(SwitchedBall(body, route), until)
    return Path(list(path.stretches), [(event.kind, event.time) for event in path.happenings], path.ended)


class SwitchedBall:
    """Stretches of a ball by one route, True for those that stick; see :class:`.hybrid.SwitchingRoute`."""

    def __init__(self, body: RollingBall, route: Sliding) -> None:
        self.body, self.route = body, route

    def begin(self) -> Transition[bool]:
        """See the protocol."""
        state = self.route.start()
        if _must_slip(self.body, self.route, state):
            return Transition(state, False, ((EventKind.SLIP, ""),))
        return Transition(state, True, ())

    def walk(self, time: float, state: FloatArray, mode: bool, until: float) -> BallStretch:
        """See the protocol."""
        return (self.route.stick if mode else self.route.slip)(time, state, until)

    def change(self, stretch: BallStretch) -> Transition[bool]:
        """See the protocol."""
        state = stretch.state
        # At |u| = 0 the ball sticks if the needed friction is inside the cone; otherwise it goes on slipping.
        slips = stretch.why is End.CONE or _must_slip(self.body, self.route, state)
        if slips != stretch.sticking:
            return Transition(state, not slips, ())
        return Transition(state, not slips, ((EventKind.SLIP if slips else EventKind.STICK, ""),))


def _must_slip(body: RollingBall, route: Sliding, state: FloatArray) -> bool:
    """True if the needed friction is outside the static cone, or on it and about to leave."""
    excess = route.excess(state)
    if abs(excess) > _ON_CONE:
        return excess > 0
    a, speed = body.ball.radius, float(np.linalg.norm(route.world(state)[1]))
    pace = np.sqrt(a * np.linalg.norm(body.gravity)) + speed
    return bool(pace > 0 and route.excess(route.ahead(state, 1e-3 * a / pace)) > _ON_CONE)
