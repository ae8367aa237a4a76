"""Coulomb friction in the projection method: what sticking needs, and what slipping does.

Sticking keeps both rows of the non-holonomic constraints, and the multipliers are the needed friction. Slipping has
no such row; the friction -μ_k N d along the direction d of the slip is an applied force, and enters through D like
gravity. The slip u = C v then changes at the rate u̇ = b - μ_k N (C M⁻¹ Cᵀ) d, where the *drive* b is what u̇ would be
without friction. Both rows of C see the same inertia, so C M⁻¹ Cᵀ = (1/m + a²/J) 1, and b is the needed friction
times that, reversed: the static cone and the drive say the same.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import Contact
from proofroll.engines.projection.method import Kinematics, ProjectedBall, Response

# Needed friction is compared with the cone to this part of both and of the weight: below lies round-off.
_ON_CONE = 1e-12


class SlidingForces(NamedTuple):
    """Equations solved at one state of slip.

    Attributes:
        response: with the friction as an applied force.
        direction: d, unit vector along e2 and e3, shape (2,).
        drive: b [m/s²], shape (2,).
        growth: rate of |u| [m/s²].
        across: component of u̇ at right angles to d [m/s²]; over |u|, the rate at which d turns.
    """

    response: Response
    direction: FloatArray
    drive: FloatArray
    growth: float
    across: float

    @property
    def strength(self) -> float:
        """|b| [m/s²]; the direction of a slip u relaxes towards that of b within the time |u|/|b|."""
        return math.hypot(*self.drive.tolist())


def along(angle: float) -> FloatArray:
    """Unit vector at this angle [rad] from e2 towards e3, shape (2,)."""
    return np.array([math.cos(angle), math.sin(angle)])


class Friction:
    """Coulomb's law for one ball.

    Attributes:
        rolling: the ball with both rows active.
        sliding: the ball with none.
        mu_static, mu_kinetic: coefficients [1].
        bounded: whether there is a static cone to leave.
    """

    def __init__(self, ball: ProjectedBall, contact: Contact) -> None:
        self.rolling, self.sliding = ball, ball.with_rows(ball.rows[:0])
        self._rows = ball.rows
        self.bounded = math.isfinite(contact.mu_static)
        self.mu_static, self.mu_kinetic = contact.mu_static, contact.mu_kinetic
        self._mobility = float(ball.rows[0] ** 2 @ (1 / ball.mass))  # C M⁻¹ Cᵀ [1/kg]
        self._weight = float(ball.mass[0] * np.linalg.norm(ball.gravity))

    def reserve(self, response: Response) -> float:
        """Reserve of the static cone [N], from the reactions of sticking; negative where the ball must slip."""
        if not self.bounded:
            return math.inf  # whatever the sign of N
        F2, F3, *_ = response.multipliers.tolist()
        available, needed = self.mu_static * response.N, math.hypot(F2, F3)
        return available - needed + _ON_CONE * (abs(available) + self._weight)

    def drive(self, kin: Kinematics) -> FloatArray:
        """Rate b of the slip without friction [m/s²], shape (2,)."""
        return self._slip_rate(kin, self.sliding.response(kin))

    def slide(self, kin: Kinematics, direction: FloatArray) -> SlidingForces:
        """The ball slipping along ``direction``, shape (2,)."""
        response = self.sliding.response(kin, -self.mu_kinetic * (direction @ self._rows))
        rate = self._slip_rate(kin, response)
        growth, across = direction @ rate, direction[0] * rate[1] - direction[1] * rate[0]
        drive = rate + self._mobility * self.mu_kinetic * response.N * direction
        return SlidingForces(response, direction, drive, float(growth), float(across))

    def force(self, sliding: SlidingForces) -> FloatArray:
        """Force of the wall on the slipping ball along the local axes [N], shape (3,)."""
        friction = -self.mu_kinetic * sliding.response.N * (sliding.direction @ self._rows)
        return self.sliding.contact_force(sliding.response) + friction[:3]

    def _slip_rate(self, kin: Kinematics, response: Response) -> FloatArray:
        return np.asarray(self._rows @ (kin.D @ response.acceleration) + self.rolling.slip_drift(kin))
