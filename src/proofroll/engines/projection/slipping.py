"""Contact by kinetic friction: two descriptions of one slip.

A slip is described by its size ρ = |u| and its direction, which are states of their own, because the difference
C v would lose the digits of a small slip; elimination then holds C v to them. There are two descriptions, since the
direction is stiff where ρ is small. It obeys ρ φ̇ = -|b| sin(φ - ψ), with ψ the direction of the drive b: it relaxes
within ρ/|b|. A slip that starts grazing (ρ ~ t²) starts with no slip and infinite stiffness.

* :class:`SlavedSlip`, while ρ/|b| is below a small part ε of the time scale T of the motion: the direction follows
  the drive. Its asymptotic value φ = ψ - ρ ψ̇ / (|b| + ρ̇) is exact to second order in ρ/|b|, and unlike an explicit
  start with some tiny ρ it needs neither ρ > 0 nor small steps: the slip starts at ρ = 0, where the cone was left.
* :class:`FreeSlip`: φ is integrated.

The angle between both at the change is of the order ε² (T ψ̇)², some 1e-9 rad, and dies out within ρ/|b| of it. So ε
is no parameter of the result but of the cost: the steps that an explicit method needs fall like 1/√ε.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.engines.projection.friction import Friction, SlidingForces, along
from proofroll.engines.projection.method import Kinematics
from proofroll.engines.projection.modes import DIFFERENCE, Exit, Pace, Survey

# ε: the start of a slip ends where its direction relaxes more slowly than this part of T.
START = 1e-3
# A slip that dies out this much faster than its direction relaxes (ρ̇ < -0.25 |b|) is not slaved: the asymptotic value
# assumes that the relaxation wins, and fails altogether at -1.
_DYING = 0.25


class _Slip(ABC):
    """Base of both descriptions of slip: ``size`` numbers of a slip behind x."""

    sticking = False
    size: ClassVar[int]

    def __init__(self, friction: Friction, pace: Pace) -> None:
        self._friction, self._ball, self._pace = friction, friction.sliding, pace

    @abstractmethod
    def look(self, y: FloatArray) -> SlidingForces:
        """The slip at y."""

    def x(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        return y[: -self.size]

    def force(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        return self._ball.contact_force(self.look(y).response)


class SlavedSlip(_Slip):
    """Slip whose direction follows the drive. y = [x, ρ]."""

    exits = (Exit.STILL, Exit.LIFTOFF, Exit.CHANGE)
    size = 1

    def look(self, y: FloatArray) -> SlidingForces:
        """The slip at y."""
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
        """Time [s] over which to difference the drive, in which the resistance jumps where the centre stands still."""
        span = DIFFERENCE * self._pace.time
        if not self._ball.rolling_resistance:
            return span
        return min(span, 0.1 * math.hypot(*kin.v[1:3]) / (math.hypot(*sliding.response.rate[1:3]) or 1.0))

    def rates(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        sliding = self.look(y)
        return np.append(self._ball.derivative(sliding.kin, sliding.response), sliding.growth)

    def eliminated(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        (d2, d3), rho = self.look(y).direction, float(y[-1])
        return np.append(self._friction.rolling.eliminated(y[:-1], (rho * d2, rho * d3)), rho)

    def survey(self, y: FloatArray) -> Survey:
        """See :class:`ContactMode`."""
        sliding, rho = self.look(y), float(y[-1])
        slow = START * self._pace.time * sliding.strength - rho
        dying = sliding.growth + _DYING * sliding.strength
        return Survey((rho, sliding.response.N, min(slow, dying)), longest=self._pace.time)

    def freed(self, y: FloatArray) -> FloatArray:
        """The same slip as a state of :class:`FreeSlip`."""
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
        """The slip at y."""
        return self._friction.slide(self._ball.kinematics(y[:-2]), along(float(y[-1])))

    def rates(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        sliding = self.look(y)
        rate = self._ball.derivative(sliding.kin, sliding.response)
        return np.concatenate([rate, [sliding.growth, sliding.across / float(y[-2])]])

    def eliminated(self, y: FloatArray) -> FloatArray:
        """See :class:`ContactMode`."""
        (d2, d3), rho = along(float(y[-1])), float(y[-2])
        x = self._friction.rolling.eliminated(y[:-2], (rho * d2, rho * d3))
        return np.concatenate([x, y[-2:]])

    def survey(self, y: FloatArray) -> Survey:
        """See :class:`ContactMode`. The stiff direction bounds a step before it would make the method unstable."""
        sliding, rho = self.look(y), float(y[-2])
        N, span = sliding.response.N, DIFFERENCE * self._pace.time
        ahead = self._ball.kinematics(y[:-2] + span * self._ball.derivative(sliding.kin, sliding.response))
        trend = (self._ball.normal_force(ahead) - N) / span
        relaxation = rho / sliding.strength if sliding.strength else math.inf
        # Not at the same bounds at which a slaved slip ends, so that the two do not alternate.
        slaved = relaxation < 0.5 * START * self._pace.time and sliding.growth > -0.5 * _DYING * sliding.strength
        if slaved:
            d = self._slaved.look(y[:-1]).direction
            slaved = abs(math.remainder(float(y[-1]) - math.atan2(d[1], d[0]), math.tau)) < START**2
        change = math.hypot(sliding.growth, sliding.across)
        doubling = rho / change if change else math.inf
        longest = min(self._pace.reach * doubling, 0.8 * self._pace.stability * relaxation)
        return Survey((rho - self._pace.still, N), trend, 1, longest, slaved)
