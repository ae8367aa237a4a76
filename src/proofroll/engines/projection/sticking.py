"""Contact by static friction: rolling, and standing still under rolling resistance. The state y is x = [q, s]."""

from __future__ import annotations

import math

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.engines.projection.friction import Friction
from proofroll.engines.projection.method import ProjectedBall
from proofroll.engines.projection.modes import DIFFERENCE, Exit, Pace, Survey, time_left

# While the cone leaves more than this part of itself, the needed friction cannot leave it and be back within one step:
# a crest that high is many steps wide.
_CLEAR = 0.25


class _Held:
    """Base of the modes with active rows."""

    sticking = True

    def __init__(self, ball: ProjectedBall, friction: Friction) -> None:
        self._ball, self._friction = ball, friction

    def rates(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        return self._ball.rates(y)

    def x(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        return y

    def eliminated(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        return self._ball.eliminated(y)

    def force(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        return self._ball.contact_force(self._ball.response_at(y))


class Stick(_Held):
    """Rolling without slip: both rows active."""

    def __init__(self, friction: Friction, pace: Pace) -> None:
        super().__init__(friction.rolling, friction)
        self._pace = pace
        self.halts = friction.rolling.rolling_resistance > 0
        # Where friction has no bound nobody looks for a slip.
        self.exits = (*((Exit.CONE,) if friction.bounded else ()), *((Exit.HALT,) if self.halts else ()))

    def survey(self, y: FloatArray) -> Survey:
        """See :class:`ContactMode`. Rolling resistance shortens steps towards where the centre stands still."""
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
        (v2, v3), along = kin.v[1:3], response.rate[1:3]
        speed = math.hypot(v2, v3)
        slowing = (v2 * along[0] + v3 * along[1]) / speed if speed else 0.0
        longest = self._pace.reach * time_left(speed, slowing)
        return Survey((*cone, speed - self._pace.still), trend, longest=longest)

    def glance(self, y: FloatArray, before: Survey, elapsed: float) -> Survey:
        """The survey of a ball that nothing but its own stop can end, from the one a step of ``elapsed`` [s] before.

        How fast the centre slows down is read off that step, which spares an evaluation of the equations.
        """
        speed = self._ball.speed(y)
        margin = speed - self._pace.still
        growth = (margin - before.margins[0]) / elapsed
        return Survey((margin,), longest=self._pace.reach * time_left(speed, growth))


class Rest(_Held):
    """The centre stands still, held by friction and rolling resistance; the ball may spin about the normal.

    Two more rows, ω2 = 0 and ω3 = 0, whose multipliers are the moment of the resistance: a bound, as friction is.
    """

    exits = ()

    def __init__(self, friction: Friction) -> None:
        super().__init__(friction.rolling.under("centre"), friction)

    def holds(self, x: FloatArray) -> bool:
        """True if friction and resistance can both hold the ball at x."""
        response = self._ball.response_at(x)
        moment = self._ball.radius * math.hypot(response.F2, response.F3)  # that holds the ball against the friction
        return self._friction.reserve(response) >= 0 and moment <= self._ball.rolling_resistance * response.N

    def released(self, x: FloatArray, speed: float) -> FloatArray:
        """The state x with a speed of the centre [m/s], too small to matter, in the direction in which it sets off.

        It gives the resistance a direction, which it has not at rest.
        """
        ball = self._ball.under("contact")
        ball.rolling_resistance = 0.0
        response = ball.response_at(x)
        pull = math.hypot(*response.rate[1:3])  # nothing drifts where the centre stands still
        result = x.copy()
        result[-5:-3] += speed / pull * np.array(response.acceleration[:2])
        return ball.eliminated(result)

    def survey(self, y: FloatArray) -> Survey:  # noqa: ARG002 -- nothing changes any more
        """See :class:`ContactMode`."""
        return Survey(())
