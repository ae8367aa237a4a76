"""Contact modes: rolling or rest by static friction, and slip by kinetic friction in two descriptions.

A slip is described by its size ρ = |u| and its direction, as states of their own, because the difference C v would lose
the digits of a small slip; elimination then makes C v consistent with them. There are two descriptions, since the
direction is stiff for small ρ: it obeys ρ φ̇ = -|b| sin(φ - ψ), with ψ the direction of the drive b, and so relaxes
within ρ/|b|. A slip that starts grazing (ρ ~ t²) starts with ρ = 0 and infinite stiffness.

* :class:`SlavedSlip`, while ρ/|b| is below a small fraction ε of the time scale T of the motion: the direction follows
  the drive. Its asymptotic value φ = ψ - ρ ψ̇ / (|b| + ρ̇) is exact to second order in ρ/|b|, and unlike an explicit
  start with some tiny ρ it needs neither ρ > 0 nor small steps: the slip starts at ρ = 0, where the cone was left.
* :class:`FreeSlip`: φ is integrated.

At the transition the two directions differ by about ε² (T ψ̇)², some 1e-9 rad, which decays within ρ/|b|. So ε affects
not the result but the cost: the steps that an explicit method needs decrease like 1/√ε.
"""

import math
from abc import ABC, abstractmethod
from enum import Enum, auto
from typing import ClassVar, NamedTuple

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.engines.projection.ball.friction import Friction, SlidingForces, along
from proofroll.engines.projection.ball.method import Kinematics, ProjectedBall

# Speed, relative to the pace of the motion, below which a contact point or a centre is at rest: 1e-14 s before it is.
_STILL = 1e-13
# Speed, relative to the pace, below which a ball that could rest where it is comes to rest: it has some 1e-11 m to go.
_SETTLED = 1e-5
# Span of finite differences relative to the time scale: the rate of a force has 1e-12 of round-off and 1e-4 of
# curvature.
DIFFERENCE = 1e-4


class Exit(Enum):
    """Reason that a mode ends."""

    CONE = auto()  # sticking: the needed friction left the static cone
    HALT = auto()  # sticking with rolling resistance: the centre stopped
    STILL = auto()  # slipping: the contact point stopped
    LIFTOFF = auto()  # slipping: the normal force reached zero
    CHANGE = auto()  # slipping: the other description is needed


class Survey(NamedTuple):
    """Margins of a mode after a step, and bounds on the next one.

    Attributes:
        margins: one per exit of the mode; the mode holds while none is negative.
        trend: rate of the margin with index ``dips``, which may become negative and recover within one step; 0 where it
            is too large for that.
        longest: bound on the next step [s].
        slaved: True if the slip may be slaved from here on.
    """

    margins: tuple[float, ...]
    trend: float = 0.0
    dips: int = 0
    longest: float = math.inf
    slaved: bool = False


class Pace(NamedTuple):
    """Natural scales of the motion, and limits of the integrator.

    Attributes:
        speed, time: natural size of speeds [m/s] and times [s].
        stability, reach: of the integrator, see :class:`proofroll.core.integrators.Integrator`.
    """

    speed: float
    time: float
    stability: float
    reach: float

    @property
    def still(self) -> float:
        """Speed [m/s] below which a contact point or a centre is at rest."""
        return _STILL * self.speed

    @property
    def settled(self) -> float:
        """Speed of the centre [m/s] below which a ball that could rest where it is comes to rest."""
        return _SETTLED * self.speed


class BallMode(ABC):
    """One mode of contact: its own state y and equations, and the margins that end it.

    Attributes:
        sticking: True if the contact holds by static friction.
        exits: possible ends, in the order of :attr:`Survey.margins`.
    """

    sticking: ClassVar[bool]
    exits: tuple[Exit, ...]

    @abstractmethod
    def rates(self, y: FloatArray) -> FloatArray:
        """Time derivative of the mode's state."""

    @abstractmethod
    def x(self, y: FloatArray) -> FloatArray:
        """Coordinates and velocities [q, s]."""

    @abstractmethod
    def eliminated(self, y: FloatArray) -> FloatArray:
        """State with velocities whose slip C v equals that described in y."""

    @abstractmethod
    def survey(self, y: FloatArray) -> Survey:
        """Margins of the mode."""

    @abstractmethod
    def force(self, y: FloatArray) -> FloatArray:
        """Force of the wall on the ball in local axes [N], shape (3,)."""


def time_left(size: float, growth: float) -> float:
    """Time until a size reaches zero at its present rate; inf: it does not."""
    return size / -growth if growth < 0 else math.inf


# Reserve of the cone, relative to the available friction, above which the needed friction cannot exceed the cone and
# return within one step: a peak that high is many steps wide.
_CLEAR = 0.25


class _Held(BallMode):
    """Base of the modes with active rows."""

    sticking = True

    def __init__(self, ball: ProjectedBall, friction: Friction) -> None:
        self._ball, self._friction = ball, friction

    @override
    def rates(self, y: FloatArray) -> FloatArray:
        return self._ball.rates(y)

    @override
    def x(self, y: FloatArray) -> FloatArray:
        return y

    @override
    def eliminated(self, y: FloatArray) -> FloatArray:
        return self._ball.eliminated(y)

    @override
    def force(self, y: FloatArray) -> FloatArray:
        return self._ball.contact_force(self._ball.response_at(y))


class Stick(_Held):
    """Rolling without slip: both rows active."""

    def __init__(self, friction: Friction, pace: Pace) -> None:
        super().__init__(friction.rolling, friction)
        self._pace = pace
        self.halts = friction.rolling.rolling_resistance > 0
        # With unbounded friction no slip is searched for.
        self.exits = (*((Exit.CONE,) if friction.bounded else ()), *((Exit.HALT,) if self.halts else ()))

    def survey(self, y: FloatArray) -> Survey:
        """See :class:`BallMode`. Rolling resistance shortens steps towards the point where the centre stops."""
        kin, trend = self._ball.kinematics(y), 0.0
        response = self._ball.response(kin)
        cone: tuple[float, ...] = ()
        if self._friction.bounded:
            reserve = self._friction.reserve(response)
            cone = (reserve,)
            if reserve <= _CLEAR * self._friction.mu_static * response.N:
                span = DIFFERENCE * self._pace.time
                ahead = self._ball.response_at(y + span * self._ball.derivative(kin, response))
                trend = (self._friction.reserve(ahead) - reserve) / span
        if not self.halts:
            return Survey(cone, trend)
        (v2, v3), slide = kin.v[1:3], response.rate[1:3]
        speed = math.hypot(v2, v3)
        slowing = (v2 * slide[0] + v3 * slide[1]) / speed if speed else 0.0
        longest = self._pace.reach * time_left(speed, slowing)
        return Survey((*cone, speed - self._pace.still), trend, longest=longest)

    def glance(self, y: FloatArray, survey: Survey, elapsed: float) -> Survey:
        """Margins after a step of ``elapsed`` [s] without an evaluation of the equations, if only standstill ends it.

        The deceleration of the centre is estimated from that step; ``survey``: the margins at its start.
        """
        speed = self._ball.speed(y)
        margin = speed - self._pace.still
        growth = (margin - survey.margins[0]) / elapsed
        return Survey((margin,), longest=self._pace.reach * time_left(speed, growth))


class Rest(_Held):
    """Rest of the centre, by friction and rolling resistance; the ball may spin about the normal.

    Two more rows, ω2 = 0 and ω3 = 0, are active. Their multipliers are the moment of rolling resistance, which is
    bounded as friction is.
    """

    exits = ()

    def __init__(self, friction: Friction) -> None:
        super().__init__(friction.rolling.under("centre"), friction)

    def holds(self, x: FloatArray) -> bool:
        """True if friction and rolling resistance can both hold the ball at x."""
        response = self._ball.response_at(x)
        moment = self._ball.radius * math.hypot(response.F2, response.F3)  # moment that friction exerts on the ball
        return self._friction.reserve(response) >= 0 and moment <= self._ball.rolling_resistance * response.N

    def released(self, x: FloatArray, speed: float) -> FloatArray:
        """State x with a negligible speed of the centre [m/s], in the direction in which it starts to move.

        It gives the rolling resistance a direction, which is undefined at rest.
        """
        ball = self._ball.under("contact")
        ball.rolling_resistance = 0.0
        response = ball.response_at(x)
        pull = math.hypot(*response.rate[1:3])  # without drift, as the centre is at rest
        result = x.copy()
        result[-5:-3] += speed / pull * np.array(response.acceleration[:2])
        return ball.eliminated(result)

    @override
    def survey(self, y: FloatArray) -> Survey:
        return Survey(())


# ε: the slip is slaved while its direction relaxes within this fraction of T.
START = 1e-3
# A slip with ρ̇ < -_DYING |b| is not slaved: the asymptotic value assumes that relaxation is faster than the decay of
# ρ, and is undefined at ρ̇ = -|b|.
_DYING = 0.25


class _Slip(BallMode):
    """Base of both descriptions of slip; a state is x and ``size`` components of the slip."""

    sticking = False
    size: ClassVar[int]

    def __init__(self, friction: Friction, pace: Pace) -> None:
        self._friction, self._ball, self._pace = friction, friction.sliding, pace

    @abstractmethod
    def look(self, y: FloatArray) -> SlidingForces:
        """Equations solved for the slip at y."""

    @override
    def x(self, y: FloatArray) -> FloatArray:
        return y[: -self.size]

    @override
    def force(self, y: FloatArray) -> FloatArray:
        return self._ball.contact_force(self.look(y).response)


class SlavedSlip(_Slip):
    """Slip whose direction follows the drive. y = [x, ρ]."""

    exits = (Exit.STILL, Exit.LIFTOFF, Exit.CHANGE)
    size = 1

    def look(self, y: FloatArray) -> SlidingForces:
        """Equations solved for the slip at y."""
        x, rho = y[:-1], float(y[-1])
        kin = self._ball.kinematics(x)
        drive = self._friction.drive(kin)
        psi = math.atan2(drive[1], drive[0])
        sliding = self._friction.slide(kin, along(psi))
        span = self._span(kin, sliding)
        if rho == 0.0 or span == 0.0:
            return sliding
        ahead = self._friction.drive(self._ball.kinematics(x + span * self._ball.derivative(kin, sliding.response)))
        turned = math.atan2(drive[0] * ahead[1] - drive[1] * ahead[0], drive[0] * ahead[0] + drive[1] * ahead[1])
        lag = rho * turned / span / (sliding.strength + sliding.growth)
        return self._friction.slide(kin, along(psi - lag))

    def _span(self, kin: Kinematics, sliding: SlidingForces) -> float:
        """Span [s] of differences of the drive; short if the centre is about to stop, where resistance reverses."""
        span = DIFFERENCE * self._pace.time
        if not self._ball.rolling_resistance:
            return span
        return min(span, 0.1 * math.hypot(*kin.v[1:3]) / (math.hypot(*sliding.response.rate[1:3]) or 1.0))

    @override
    def rates(self, y: FloatArray) -> FloatArray:
        sliding = self.look(y)
        return np.append(self._ball.derivative(sliding.kin, sliding.response), sliding.growth)

    @override
    def eliminated(self, y: FloatArray) -> FloatArray:
        (d2, d3), rho = self.look(y).direction, float(y[-1])
        return np.append(self._friction.rolling.eliminated(y[:-1], (rho * d2, rho * d3)), rho)

    @override
    def survey(self, y: FloatArray) -> Survey:
        sliding, rho = self.look(y), float(y[-1])
        slow = START * self._pace.time * sliding.strength - rho
        dying = sliding.growth + _DYING * sliding.strength
        return Survey((rho, sliding.response.N, min(slow, dying)), longest=self._pace.time)

    def freed(self, y: FloatArray) -> FloatArray:
        """Same slip as a state of :class:`FreeSlip`."""
        d = self.look(y).direction
        return np.append(y, math.atan2(d[1], d[0]))


class FreeSlip(_Slip):
    """Slip in polar variables: y = [x, ρ, φ] with u = ρ (cos φ, sin φ)."""

    exits = (Exit.STILL, Exit.LIFTOFF)
    size = 2

    def __init__(self, friction: Friction, pace: Pace) -> None:
        super().__init__(friction, pace)
        self._slaved = SlavedSlip(friction, pace)

    def look(self, y: FloatArray) -> SlidingForces:
        """Equations solved for the slip at y."""
        return self._friction.slide(self._ball.kinematics(y[:-2]), along(float(y[-1])))

    @override
    def rates(self, y: FloatArray) -> FloatArray:
        sliding = self.look(y)
        rate = self._ball.derivative(sliding.kin, sliding.response)
        return np.concatenate([rate, [sliding.growth, sliding.across / float(y[-2])]])

    @override
    def eliminated(self, y: FloatArray) -> FloatArray:
        (d2, d3), rho = along(float(y[-1])), float(y[-2])
        x = self._friction.rolling.eliminated(y[:-2], (rho * d2, rho * d3))
        return np.concatenate([x, y[-2:]])

    def survey(self, y: FloatArray) -> Survey:
        """See :class:`BallMode`. The stiff direction limits steps so that the method stays stable."""
        sliding, rho = self.look(y), float(y[-2])
        N, span = sliding.response.N, DIFFERENCE * self._pace.time
        ahead = self._ball.kinematics(y[:-2] + span * self._ball.derivative(sliding.kin, sliding.response))
        trend = (self._ball.normal_force(ahead) - N) / span
        relaxation = rho / sliding.strength if sliding.strength else math.inf
        # Bounds differ from those at which a slaved slip ends, so that the two do not alternate.
        slaved = relaxation < 0.5 * START * self._pace.time and sliding.growth > -0.5 * _DYING * sliding.strength
        if slaved:
            d = self._slaved.look(y[:-1]).direction
            slaved = abs(math.remainder(float(y[-1]) - math.atan2(d[1], d[0]), math.tau)) < START**2
        change = math.hypot(sliding.growth, sliding.across)
        doubling = rho / change if change else math.inf
        longest = min(self._pace.reach * doubling, 0.8 * self._pace.stability * relaxation)
        return Survey(margins=(rho - self._pace.still, N), trend=trend, dips=1, longest=longest, slaved=slaved)
