"""Coulomb friction in the projection method, while sticking and while slipping.

While sticking, both rows of the non-holonomic constraints are active, and their multipliers are the needed friction.
While slipping, no row is active; the friction -μ_k N d, with d the direction of the slip, is an applied force, and
enters through D like gravity. The slip u = C v then changes at the rate u̇ = b - μ_k N (C M⁻¹ Cᵀ) d, where the *drive*
b is u̇ without friction. Both rows of C have the same inertia, so C M⁻¹ Cᵀ = (1/m + a²/J) 1, and b is the needed
friction times that, with the opposite sign: the static cone and the drive are equivalent.
"""

import math
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.balls import Contact
from proofroll.engines.projection.ball.method import Kinematics, ProjectedBall, Response

# Round-off of the comparison of needed friction with the cone, relative to available friction plus weight.
_ON_CONE = 1e-12


class SlidingForces(NamedTuple):
    """Equations solved at one state of slip.

    Attributes:
        kin: kinematics at the state.
        response: solution with friction as an applied force.
        direction: d, unit vector along e2 and e3.
        drive: b [m/s²].
        growth: rate of |u| [m/s²].
        across: component of u̇ perpendicular to d [m/s²]; divided by |u|, the rate at which d turns.
    """

    kin: Kinematics
    response: Response
    direction: tuple[float, float]
    drive: tuple[float, float]
    growth: float
    across: float

    @property
    def strength(self) -> float:
        """Magnitude |b| [m/s²]; the direction of a slip u relaxes towards that of b within the time |u|/|b|."""
        return math.hypot(*self.drive)


def along(angle: float) -> tuple[float, float]:
    """Unit vector at this angle [rad] from e2 towards e3."""
    return math.cos(angle), math.sin(angle)


class Friction:
    """Coulomb's law for one ball.

    Attributes:
        rolling: the ball with both rows active.
        sliding: the ball with no row active.
        mu_static, mu_kinetic: coefficients [1].
        bounded: True if static friction is bounded.
    """

    def __init__(self, ball: ProjectedBall, contact: Contact) -> None:
        self.rolling, self.sliding = ball, ball.under(None)
        self.bounded = math.isfinite(contact.mu_static)
        self.mu_static, self.mu_kinetic = contact.mu_static, contact.mu_kinetic
        self._weight = float(ball.mass * np.linalg.norm(ball.gravity))

    def reserve(self, response: Response) -> float:
        """Available minus needed friction while sticking [N]; negative where the ball must slip."""
        if not self.bounded:
            return math.inf  # even if N is negative
        available, needed = self.mu_static * response.N, math.hypot(response.F2, response.F3)
        return available - needed + _ON_CONE * (abs(available) + self._weight)

    def drive(self, kin: Kinematics) -> tuple[float, float]:
        """Rate b of the slip without friction [m/s²]."""
        return self.sliding.response(kin).slip_rate

    def slide(self, kin: Kinematics, direction: tuple[float, float]) -> SlidingForces:
        """Equations solved for a slip in this direction."""
        d2, d3 = direction
        response = self.sliding.response(kin, (-self.mu_kinetic * d2, -self.mu_kinetic * d3))
        rate2, rate3 = response.slip_rate
        held = self.sliding.mobility * self.mu_kinetic * response.N
        drive = rate2 + held * d2, rate3 + held * d3
        return SlidingForces(
            kin=kin,
            response=response,
            direction=direction,
            drive=drive,
            growth=d2 * rate2 + d3 * rate3,
            across=d2 * rate3 - d3 * rate2,
        )
