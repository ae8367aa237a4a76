"""Rolling resistance and Coulomb friction in the wall's local frame: friction needed to roll, and friction of slip.

All vectors have two components, along e2 and e3. While the ball slips, the force is -μk N d with a unit direction d
that is constant over a step, so that Newton's method never meets the kink of the law at rest.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.exudyn.ball.local_frame import curvature

# A slip that the needed friction would stop within this part of a step counts as round-off of a rolling constraint.
AT_REST = 1e-6
ROUND_OFF = 1e-12  # of a slip velocity [m/s]
# Cosine between present and predicted slip below which the slip counts as ending, not as turning.
ACROSS = 0.1
# Speed, in units of sqrt(a g), below which the moment of rolling resistance falls to zero with the speed: Newton's
# method fails at the jump of its direction at rest. It lets a ball roll too far by the square of this, 4e-6.
_SLOW = 2e-3


class Touch(NamedTuple):
    """Contact forces and slip at a state.

    Attributes:
        N: normal force [N].
        need2, need3: friction on the ball that would keep the slip velocity constant [N].
        u2, u3: slip velocity [m/s].
    """

    N: float
    need2: float
    need3: float
    u2: float
    u3: float

    @property
    def needed(self) -> float:
        """Size of the needed friction [N]."""
        return math.hypot(self.need2, self.need3)

    @property
    def slip(self) -> float:
        """Size of the slip velocity [m/s]."""
        return math.hypot(self.u2, self.u3)


@dataclass
class KineticFriction:
    """Kinetic friction of a model; its user function for forces reads ``direction``.

    Attributes:
        mu_kinetic: |F|/N [1].
        direction: unit direction of slip (e2, e3) for the coming step; None: the ball rolls.
        applied: direction with which the present state was computed; None: rolling.
    """

    mu_kinetic: float
    direction: tuple[float, float] | None = None
    applied: tuple[float, float] | None = None

    def force(self, direction: tuple[float, float], N: float) -> tuple[float, float]:
        """Friction on the ball along e2 and e3 [N]."""
        size = -self.mu_kinetic * N
        return size * direction[0], size * direction[1]


# (velocity of the centre along e2 and e3, spin about e1, gravity along e1, e2, e3) -> N, need2, need3 of Touch
NeededAt = Callable[[float, float, float, float, float, float], tuple[float, float, float]]


def slow(body: RollingBall) -> float:
    """Speed of the centre [m/s] below which the rolling resistance is proportional to it."""
    return _SLOW * math.sqrt(body.ball.radius * float(np.linalg.norm(body.gravity)))


def resistance_moment(f: float, N: float, v2: float, v3: float, slow: float) -> tuple[float, float]:
    """Moment about the centre along e2 and e3 [N m]: that of -N e1 shifted by ``f`` [m] along the velocity [m/s].

    :func:`mechanics.resistance_moment` in the local frame and as plain floats, for it runs for every residual. Below
    the speed ``slow`` [m/s] the moment is proportional to the speed.
    """
    speed = max(math.hypot(v2, v3), slow)
    if not speed:
        return 0.0, 0.0
    factor = f * N / speed
    return -factor * v3, factor * v2


def mobility(body: RollingBall) -> float:
    """β = 1/m + a²/J: change of the slip velocity per impulse of friction [1/kg]."""
    return 1 / body.ball.mass + body.ball.radius**2 / body.ball.inertia


def needed_function(body: RollingBall) -> NeededAt:
    """Function for the normal force and the needed friction of a ball on a homogeneous surface.

    Homogeneous: the curvature in the local frame is the same everywhere.

    The slip velocity u = v + a ω × e1 changes by u̇ = g + βF + (a/J) M × e1 + a ω × ė1 along the tangents, with the
    moment M of the rolling resistance; N = m (v·ė1 + e1·g), as the ball stays on the wall.
    """
    a, m, f = body.ball.radius, body.ball.mass, body.contact.rolling_resistance
    least, beta, lever = slow(body), mobility(body), body.ball.radius / body.ball.inertia
    (k22, k23), (k32, k33) = curvature(body.surface, body.u0).tolist()

    def needed(v2: float, v3: float, w1: float, g1: float, g2: float, g3: float) -> tuple[float, float, float]:
        turn2, turn3 = k22 * v2 + k23 * v3, k32 * v2 + k33 * v3
        N = m * (v2 * turn2 + v3 * turn3 + g1)
        free2, free3 = g2 - a * w1 * turn3, g3 + a * w1 * turn2
        if f:
            M2, M3 = resistance_moment(f, N, v2, v3, least)
            free2 += lever * M3
            free3 -= lever * M2
        return N, -free2 / beta, -free3 / beta

    return needed


def slip_direction(
    touch: Touch, rate: tuple[float, float], friction: float, beta: float, dt: float, *, inside: bool
) -> tuple[float, float]:
    """Unit direction of slip (e2, e3) that is used throughout the coming step.

    Near rest the direction turns towards that of -need at the rate x = β|need| dt/|u| per step, faster than any step
    resolves. With the need constant, the old direction decays by exp(-x); this gives the direction at the end of the
    step, or its mean inside the step. Both are of second order where x is small and do not ring where it is large. In
    the step that brings the ball to rest, it is the one direction in which both components of slip end together.

    Args:
        touch: the contact at the start of the step.
        rate: rate of the needed friction [N/s].
        friction: μk N [N].
        beta: see :func:`mobility`.
        dt: step [s].
        inside: the mean direction inside the step instead of the one at its end.
    """
    later = 0.5 * dt if inside else dt
    need2, need3 = touch.need2 + later * rate[0], touch.need3 + later * rate[1]
    slip, need = touch.slip, math.hypot(need2, need3)
    if slip <= max(AT_REST * dt * beta * need, ROUND_OFF) and need >= friction and need:
        return -need2 / need, -need3 / need
    if slip == 0:
        return 1.0, 0.0  # friction holds the ball in any direction
    ahead = _time_to_rest(touch, need2, need3, friction, beta)
    if ahead > dt:
        x = min(dt * beta * need / slip, 1 / AT_REST)
        ahead = dt * (_mean(x) if inside else _end(x))
    w2, w3 = touch.u2 - ahead * beta * need2, touch.u3 - ahead * beta * need3
    size = math.hypot(w2, w3)
    if touch.u2 * w2 + touch.u3 * w3 <= ACROSS * slip * size:
        # Friction and need together stop the ball before it is turned around.
        return touch.u2 / slip, touch.u3 / slip
    return w2 / size, w3 / size


def _time_to_rest(touch: Touch, need2: float, need3: float, friction: float, beta: float) -> float:
    """Time to rest with a constant direction [s]: smallest τ > 0 with |u - τ β need| = τ β friction; else infinity."""
    # A τ² - 2 B τ + u² = 0, solved for 1/τ, which stays well-defined for A = 0.
    A = beta * beta * (need2 * need2 + need3 * need3 - friction * friction)
    B = beta * (touch.u2 * need2 + touch.u3 * need3)
    u = touch.u2 * touch.u2 + touch.u3 * touch.u3
    discriminant = B * B - A * u
    inverse = (B + math.sqrt(discriminant)) / u if discriminant >= 0 else 0.0
    return 1 / inverse if inverse > 0 else math.inf


def _mean(x: float) -> float:
    """Part θ of the step for which 1/(1 + θx) is the mean of exp(-sx) over s in [0, 1]."""
    return 0.5 + x / 12 if x < 1e-3 else 1 / -math.expm1(-x) - 1 / x


def _end(x: float) -> float:
    """Part θ of the step for which 1/(1 + θx) is exp(-x); for x above 30, exp(-30)."""
    return 1 + x / 2 if x < 1e-6 else math.expm1(min(x, 30.0)) / x
