"""Regime of a ball by the first route of the truth, and analytic boundaries between regimes."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.events import EventKind
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.polar import first_route
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


class Regime(IntEnum):
    """Regime of a ball over a whole run."""

    NEVER_SLIPS = 0
    RECOVERS = 1  # slips, and sticks at the end or could still carry its weight by friction
    FALLS = 2  # slips at the end with too little friction to carry its weight


def classify(body: RollingBall, until: float) -> tuple[Regime, int, float]:
    """Regime of the ball until ``until`` [s], the number of its slips, and the time of the first [s] (nan: never).

    Raises:
        Refused: the motion is not known so far.
    """
    route = first_route(body)
    path = follow(body, route, until)
    slips = [time for kind, time in path.events if kind == EventKind.SLIP]
    first_slip = slips[0] if slips else float("nan")
    last = path.stretches[-1]
    if not slips and not path.ended:
        return Regime.NEVER_SLIPS, 0, first_slip
    if not (last.sticking or _carries(body, *route.world(last.state)[:2])):
        return Regime.FALLS, len(slips), first_slip  # the wall presses less and less, so what comes does not matter
    if path.ended:
        raise Refused(path.ended)
    return Regime.RECOVERS, len(slips), first_slip


def _carries(body: RollingBall, p_WB: FloatArray, v_WB: FloatArray) -> bool:
    """True if friction, pointing straight up along the surface, could carry the weight."""
    weight = np.linalg.norm(body.gravity)
    return bool(body.contact.mu_kinetic * (v_WB @ body.surface.normal_gradient(p_WB) @ v_WB) >= weight)


def analytic_boundaries(body: RollingBall, speeds: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Bounds on μ for each initial speed: below the first the ball falls, above the second it never slips.

    The closed form holds for a level start and no spin about the normal; it leaves out rolling resistance. The friction
    needed is m g (1 - cos νt / (1 + κ)) with κ = J/ma²: at most 12/7 of the weight of a homogeneous ball.

    Args:
        body: the ball.
        speeds: initial speeds [m/s], shape (n,).

    Returns:
        Two arrays of shape (n,); None: there is no closed form.
    """
    surface = body.surface
    e1, gravity = surface.normal(body.p0), float(np.linalg.norm(body.gravity))
    if abs(body.v0 @ np.asarray(surface.axis)) > 0 or abs(body.w0 @ e1) > 0:
        return None
    kappa = body.ball.inertia_ratio
    falls = gravity * surface.radius / speeds**2
    return falls, falls * (2 + kappa) / (1 + kappa)
