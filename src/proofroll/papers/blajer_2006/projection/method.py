"""Blajer's projection method: from Newton-Euler with constraints to the motion and the constraint reactions.

The unconstrained ball has six velocities v = [v1 v2 v3 ω1 ω2 ω3], here in the local axes e1, e2, e3; a dot is a rate in
the world frame, so that M v̇ = f without gyroscopic terms. (Blajer 2006 takes the translation in world axes and ω in
body axes. A ball's mass matrix M is the same in all of them, and so is everything that follows by projection.) The
constraints on v are C_h v = 0, the ball stays on the surface, and C v = 0, it does not slip.

With v = D s, which satisfies C_h v = 0, the projections onto D and C_h give

    [DᵀMD (CD)ᵀ; CD 0] [ṡ; λ] = [Dᵀ(f - M Ḋs); -ξ],    N = (C_h M⁻¹ C_hᵀ)⁻¹ C_h (M⁻¹ f - Ḋs).

Without its first row D is square and regular, with blocks T for the position and A for the rotation, and C is zero
along e1. So Dᵀ cancels in the upper rows: S λ = C (M⁻¹ f - R v), v̇ = M⁻¹ (f - Cᵀ λ), ṡ = D⁻¹ (v̇ - Ḋs), with R v the
rate of v due to the turning of the axes alone and S = C M⁻¹ Cᵀ, which is (1/m + a²/J) 1 for a ball. The remaining
products have a few numbers each, and are faster in plain floats than in arrays.

Sources: W. Blajer, Math. Comput. Model. Dyn. Syst. 12(6), 2006, 543-553, sections 2.1-2.4, for the projections; W.
Blajer, Multibody Syst. Dyn. 7, 2002, 265-284, for the elimination of constraint violations.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.mechanics import natural_speed
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.projection.geometry import Frame, Uniform, Vector, along
from proofroll.papers.blajer_2006.projection.orientation import Orientation


class Kinematics(NamedTuple):
    """Kinematics of the ball in the velocities s: v = D s and v̇ = D ṡ + Ḋ s.

    Attributes:
        frame: at the ball's position.
        rates: rates of the coordinates: u̇, and of the angles if there are any.
        r: velocities of the rotation.
        pose: numbers of the rotation, see :meth:`Orientation.pose`.
        v: D s, six numbers.
        drift: Ḋ s of the centre, along e1 alone [m/s²].
        turned: rate of ω' by the turning of the axes alone, zero along e3 [rad/s²].
    """

    frame: Frame
    rates: tuple[float, ...]
    r: Sequence[float]
    pose: tuple[float, ...]
    v: tuple[float, ...]
    drift: float
    turned: Vector


class Response(NamedTuple):
    """Solution of the equations at one state.

    Attributes:
        acceleration: ṡ, five numbers.
        rate: v̇ = D ṡ + Ḋ s, six numbers.
        N: λ_h, the normal force [N].
        F2, F3: friction on the ball along e2 and e3 [N]: -λ_nh.
    """

    acceleration: tuple[float, ...]
    rate: tuple[float, ...]
    N: float
    F2: float
    F3: float


class ProjectedBall:
    """Equations of motion of the ball in the state x = [q, s]: coordinates q = [u, angles] and velocities s.

    Attributes:
        mass, inertia: diagonal of M: m [kg] and J [kg m²].
        radius: a [m].
        mobility: S, the same along e2 and e3 [1/kg].
        gravity: in the world [m/s²], shape (3,).
        rolling_resistance: f [m].
    """

    def __init__(self, body: RollingBall, geometry: Uniform, orientation: Orientation) -> None:
        self.mass, self.inertia, self.radius = float(body.ball.mass), float(body.ball.inertia), float(body.ball.radius)
        self.mobility = 1.0 / self.mass + self.radius**2 / self.inertia
        self.gravity = body.gravity
        self.rolling_resistance = body.contact.rolling_resistance
        self._g = body.gravity.tolist()
        self._geometry, self._c, self._per_c = geometry, geometry.radius, 1 / geometry.radius
        self._orientation = orientation
        self._coordinates = 2 + orientation.size

    def kinematics(self, x: FloatArray) -> Kinematics:
        """Explicit form of the holonomic constraint at the state x."""
        n = self._coordinates
        state = x.tolist()
        angles, (s_1, s_2, *r) = state[2:n], state[n:]
        frame = self._geometry.at(state)
        pose = self._orientation.pose(angles)
        w1, w2, w3 = self._orientation.angular_velocity(pose, r, frame)
        return Kinematics(
            frame=frame,
            rates=(s_1, s_2, *self._orientation.rates(angles, r, frame)),
            r=r,
            pose=pose,
            v=(0.0, self._c * s_1, s_2, w1, w2, w3),
            drift=-self._c * (s_1 * s_1),
            turned=(-s_1 * w2, s_1 * w1, 0.0),
        )

    def weight(self, kin: Kinematics) -> Vector:
        """Gravity along e1, e2, e3 [m/s²]: applied force of a ball without rolling resistance, divided by its mass."""
        return along(kin.frame, *self._g)

    def resistance(self, kin: Kinematics, N: float) -> tuple[float, float]:
        """Moment M_C of rolling resistance along e2 and e3 [N m]: N is shifted by f along the centre's velocity.

        It is zero at rest, where it has no direction.
        """
        _, v2, v3, *_ = kin.v
        speed = math.hypot(v2, v3)
        lever = N * self.rolling_resistance / speed if speed else 0.0
        return -lever * v3, lever * v2

    def response(self, kin: Kinematics) -> Response:
        """Accelerations and reactions by the tangential projection and the non-holonomic constraints."""
        a, m, J = self.radius, self.mass, self.inertia
        # a2, a3: translational part of M⁻¹ f along e2 and e3; b2, b3: rotational part, zero along e1
        g1, a2, a3 = self.weight(kin)
        N, b2, b3 = m * (g1 - kin.drift), 0.0, 0.0
        if self.rolling_resistance:
            M2, M3 = self.resistance(kin, N)
            b2, b3 = M2 / J, M3 / J
        F2, F3 = -(a2 + a * b3) / self.mobility, -(a3 - a * (b2 - kin.turned[1])) / self.mobility
        a2, a3, b2, b3 = a2 + F2 / m, a3 + F3 / m, b2 - a * F3 / J, b3 + a * F2 / J
        spin = self._orientation.acceleration(kin.pose, kin.r, (0.0, b2, b3), kin.turned, kin.frame)
        rate = (kin.drift, a2, a3, 0.0, b2, b3)
        return Response(acceleration=(self._per_c * a2, a3, *spin), rate=rate, N=N, F2=F2, F3=F3)

    def velocity_rate(self, kin: Kinematics, acceleration: Sequence[float]) -> FloatArray:
        """Rate v̇ = D ṡ + Ḋ s for accelerations ṡ, shape (6,)."""
        rate_1, rate_2, *spin = acceleration
        still = self._orientation.acceleration(kin.pose, kin.r, (0.0, 0.0, 0.0), kin.turned, kin.frame)
        spin = [turn - still_turn for turn, still_turn in zip(spin, still, strict=True)]  # ω̇ = A (ṙ - ṙ where ω̇ = 0)
        rotation = self._orientation.angular_velocity(kin.pose, spin, kin.frame)
        return np.array((kin.drift, self._c * rate_1, rate_2, *rotation))

    @staticmethod
    def contact_force(response: Response) -> FloatArray:
        """Force of the wall on the ball in local axes, -C_hᵀ N - Cᵀ λ_nh = (-N, F2, F3) [N], shape (3,)."""
        return np.array((-response.N, response.F2, response.F3))

    def rates(self, x: FloatArray) -> FloatArray:
        """Time derivative ẋ; angles, if there are any, follow from the velocities s."""
        kin = self.kinematics(x)
        return np.array((*kin.rates, *self.response(kin).acceleration))

    def slip(self, kin: Kinematics) -> tuple[float, float]:
        """Slip velocity C v along e2 and e3 [m/s]."""
        _, v2, v3, _, w2, w3 = kin.v
        return v2 + self.radius * w3, v3 - self.radius * w2

    def eliminated(self, x: FloatArray) -> FloatArray:
        """State x with the violation of C v = 0 removed from s (Blajer 2002).

        s - M̄⁻¹C_nhᵀ(C_nh M̄⁻¹ C_nhᵀ)⁻¹ C_nh s is the nearest admissible s in the metric of M̄ = DᵀMD, where C_nh = C
        D: M⁻¹ Cᵀ S⁻¹ C v in the velocities v.
        """
        kin = self.kinematics(x)
        slip2, slip3 = self.slip(kin)
        F2, F3 = slip2 / self.mobility, slip3 / self.mobility
        v2, v3, lever = F2 / self.mass, F3 / self.mass, self.radius / self.inertia
        w2, w3 = -lever * F3, lever * F2
        spin1, spin2, spin3 = self._orientation.solved(kin.pose, (0.0, w2, w3), kin.frame)
        *q, s_1, s_2, r1, r2, r3 = x.tolist()
        return np.array((*q, s_1 - self._per_c * v2, s_2 - v3, r1 - spin1, r2 - spin2, r3 - spin3))


def start_and_scales(body: RollingBall, orientation: Orientation) -> tuple[FloatArray, FloatArray]:
    """State at time 0, and the natural size of each component: the unit of absolute errors in an adaptive step.

    Lengths are of the order of the ball's radius, speeds of the natural speed.
    """
    a, speed, frame = body.ball.radius, natural_speed(body), body.surface.frame(body.u0)
    angles, r = orientation.start(frame, frame.T @ body.w0)
    per_metre = 1 / np.asarray(body.surface.length_scales)
    scales = np.concatenate([a * per_metre, np.ones(orientation.size), speed * per_metre, np.full(3, speed / a)])
    return np.concatenate([body.u0, angles, body.udot0, r]), scales
