"""Blajer's projection method: from Newton-Euler with constraints to the motion and the constraint reactions.

The unconstrained ball has six velocities v = [v1 v2 v3 ω1 ω2 ω3], here along the local axes e1, e2, e3; a dot is a
rate seen from the world, so that M v̇ = f without gyroscopic terms. (Blajer 2006 takes the translation along the
world's axes and ω along the body's. A ball's mass matrix M is the same along all of them, and so is everything that
follows by projection.) The constraints on v are C_h v = 0, the ball stays on the surface, and C v = 0, it does not
slip.

Sources: W. Blajer, Math. Comput. Model. Dyn. Syst. 12(6), 2006, 543-553, sections 2.1-2.4, for the projections;
W. Blajer, Multibody Syst. Dyn. 7, 2002, 265-284, for the elimination of constraint violations.
"""

from __future__ import annotations

import copy
import math
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.projection.geometry import Geometry, Local, Uniform
from proofroll.engines.projection.orientation import Orientation

_STANDS, _NONE = np.zeros((2, 3)), np.zeros(0)


class Kinematics(NamedTuple):
    """Kinematics of the ball in the velocities s: v = D s and v̇ = D ṡ + Ḋ s.

    Attributes:
        local: geometry where the ball is.
        turning: FᵀḞ, skew matrix of the frame's angular velocity [rad/s], shape (3, 3).
        D: shape (6, 5), with C_h D = 0 whatever s is.
        drift: Ḋ s, shape (6,).
        v: D s, shape (6,).
        carried: velocity of the wall where the ball touches it, along the local axes, and its rate as seen along
            them, shape (2, 3); zero where the wall stands.
    """

    local: Local
    turning: FloatArray
    D: FloatArray
    drift: FloatArray
    v: FloatArray
    carried: FloatArray


class Response(NamedTuple):
    """Solution of the equations at one state.

    Attributes:
        acceleration: ṡ, shape (5,).
        N: λ_h, the normal force [N].
        multipliers: λ_nh [N], one per active row: -F2 and -F3.
    """

    acceleration: FloatArray
    N: float
    multipliers: FloatArray


def rolling_rows(radius: float) -> FloatArray:
    """C: slip velocity of the contact point [m/s] along e2 and e3 from v, shape (2, 6): v2 + a ω3 and v3 - a ω2."""
    a = radius
    return np.array([[0.0, 1.0, 0.0, 0.0, 0.0, a], [0.0, 0.0, 1.0, 0.0, -a, 0.0]])


class ProjectedBall:
    """The ball's equations of motion in the state x = [q, s]: coordinates q = [u, angles] and velocities s.

    Attributes:
        mass: diagonal of M [kg, kg m²], shape (6,).
        gravity: in the world [m/s²], shape (3,).
        rolling_resistance: f [m].
        rows: C, the active rows of the non-holonomic constraints, shape (0…2, 6).
    """

    def __init__(self, body: RollingBall, geometry: Geometry, orientation: Orientation) -> None:
        m, J = body.ball.mass, body.ball.inertia
        self.mass = np.array([m, m, m, J, J, J])
        self.gravity = body.gravity
        self.rolling_resistance = body.contact.rolling_resistance
        self.rows = rolling_rows(body.ball.radius)
        self._geometry = geometry
        self._orientation = orientation
        self._coordinates = 2 + orientation.size
        self._surface, self._wall_rate, self._radius = body.surface, body.wall_rate, body.ball.radius
        self._tangents = geometry.at(body.u0).tangents[1:] if isinstance(geometry, Uniform) else None

    def kinematics(self, x: FloatArray) -> Kinematics:
        """The explicit form of the holonomic constraint at the state x."""
        q, s = x[: self._coordinates], x[self._coordinates :]
        local = self._geometry.at(q[:2])
        turning = local.turning @ s[:2]
        D, drift = np.zeros((6, 5)), np.empty(6)
        D[:3, :2], drift[:3] = local.tangents, local.second @ s[:2] @ s[:2]
        D[3:, 2:], drift[3:] = self._orientation.kinematics(q[2:], s[2:], local.frame, turning)
        v = D @ s
        W = self._wall_rate
        carried = _STANDS if W is None else self._carried(W @ local.frame, q, local.frame, turning, v)
        return Kinematics(local, turning, D, drift, v, carried)

    def _carried(
        self, W: FloatArray, q: FloatArray, frame: FloatArray, turning: FloatArray, v: FloatArray
    ) -> FloatArray:
        """Velocity W × (p + a e1) of a wall that turns at W, and its rate along the turning axes."""
        contact = self._surface.position(q[:2]) @ frame + [self._radius, 0.0, 0.0]
        velocity = cross(W, contact)
        return np.stack([velocity, cross(W, v[:3] + self._radius * turning[:, 0]) - turning @ velocity])

    def speed(self, x: FloatArray) -> float:
        """Speed of the centre [m/s]."""
        n = self._coordinates
        tangents = self._geometry.at(x[:2]).tangents[1:] if self._tangents is None else self._tangents
        return math.hypot(*tangents.dot(x[n : n + 2]).tolist())

    def mass_matrix(self, kin: Kinematics) -> FloatArray:
        """M̄ = DᵀMD, shape (5, 5)."""
        return np.asarray((kin.D.T * self.mass) @ kin.D)

    def bias(self, kin: Kinematics) -> FloatArray:
        """d̄ = DᵀMḊs, shape (5,)."""
        return kin.D.T @ (self.mass * kin.drift)

    def weight(self, kin: Kinematics) -> FloatArray:
        """The applied force f of gravity alone, shape (6,)."""
        force = np.zeros(6)
        force[:3] = self.mass[:3] * (self.gravity @ kin.local.frame)
        return force

    def normal_force(self, kin: Kinematics, force: FloatArray) -> float:
        """N = λ_h = (C_h M⁻¹ C_hᵀ)⁻¹ C_h (M⁻¹ f - Ḋs), the orthogonal projection; C_h = [1 0 0 0 0 0] picks e1."""
        return float(force[0] - self.mass[0] * kin.drift[0])

    def resistance(self, kin: Kinematics, N: float) -> FloatArray:
        """M_C [N m], shape (3,): moment of the normal force N shifted by f along the centre's velocity.

        At rest the direction does not exist and the moment is zero.
        """
        _, v2, v3, *_ = kin.v.tolist()
        speed = math.hypot(v2, v3)
        lever = N * self.rolling_resistance / speed if speed else 0.0
        return np.array([0.0, -lever * v3, lever * v2])

    def response(self, kin: Kinematics, drag: FloatArray | None = None) -> Response:
        """Accelerations and reactions: the tangential projection together with the non-holonomic constraints.

        ``drag`` is an applied force per newton of normal force, besides the rolling resistance, along v's components
        and without one along e1, shape (6,).
        """
        force = self.weight(kin)
        N = self.normal_force(kin, force)
        if self.rolling_resistance:
            force[3:] = self.resistance(kin, N)
        if drag is not None:
            force += N * drag
        solution = self._solve(kin, kin.D.T @ force - self.bias(kin), -self.slip_drift(kin))
        return Response(solution[:5], N, solution[5:])

    def response_at(self, x: FloatArray) -> Response:
        """Solution of :meth:`response` at the state x."""
        return self.response(self.kinematics(x))

    def slip_drift(self, kin: Kinematics) -> FloatArray:
        """Ċ_nh s = -ξ [m/s²]: rate of the slip of the active rows when ṡ = 0.

        The rows C are constant along the local axes. So the slip changes by C times the rate of v as seen from the
        turning frame, which is Ḋs less FᵀḞ v, for the translation and the rotation alike.
        """
        if not len(self.rows):  # the ball slips
            return _NONE
        own = self.rows @ (kin.drift - (kin.v.reshape(2, 3) @ kin.turning.T).ravel())
        return np.asarray(own - self.rows[:, :3] @ kin.carried[1])

    def contact_force(self, response: Response) -> FloatArray:
        """Force of the wall on the ball along the local axes, -C_hᵀ N - Cᵀ λ_nh = (-N, F2, F3) [N], shape (3,)."""
        force = -self.rows[:, :3].T @ response.multipliers
        force[0] -= response.N
        return force

    def rates(self, x: FloatArray) -> FloatArray:
        """ẋ: the angles, if there are any, follow the velocities s."""
        return self.derivative(x, self.response_at(x))

    def derivative(self, x: FloatArray, response: Response) -> FloatArray:
        """ẋ with the accelerations of ``response``."""
        n = self._coordinates
        turning = self._orientation.rates(x[:2], x[2:n], x[n + 2 : n + 5])
        return np.concatenate([x[n : n + 2], turning, response.acceleration])

    def with_rows(self, rows: FloatArray) -> ProjectedBall:
        """The same ball with other active rows of the non-holonomic constraints."""
        other = copy.copy(self)
        other.rows = rows
        return other

    def violation(self, kin: Kinematics) -> FloatArray:
        """C v of the active rows, less what the wall carries along [m/s]."""
        return np.asarray(self.rows @ kin.v - self.rows[:, :3] @ kin.carried[0])

    def eliminated(self, x: FloatArray, slip: FloatArray | None = None) -> FloatArray:
        """The state x with the violation of C v = 0, or of C v = ``slip`` [m/s], removed from s (Blajer 2002).

        s - M̄⁻¹C_nhᵀ(C_nh M̄⁻¹ C_nhᵀ)⁻¹ C_nh s is the nearest admissible s in the metric of M̄. The correction solves
        a system with the same matrix as the equations of motion.
        """
        kin = self.kinematics(x)
        violation = self.violation(kin) - (0.0 if slip is None else slip)
        result = x.copy()
        result[self._coordinates :] -= self._solve(kin, np.zeros(5), violation)[:5]
        return result

    def _solve(self, kin: Kinematics, upper: FloatArray, lower: FloatArray) -> FloatArray:
        """Solution of [M̄ C_nhᵀ; C_nh 0] [ṡ; λ] = [upper; lower], where C_nh = C D.

        Raises:
            ArithmeticError: there is none.
        """
        from scipy.linalg.lapack import dgesv

        C = self.rows @ kin.D
        matrix = np.zeros((5 + len(C), 5 + len(C)))
        matrix[:5, :5] = self.mass_matrix(kin)
        matrix[:5, 5:] = C.T
        matrix[5:, :5] = C
        # LAPACK directly: numpy's wrapper costs more than the solution of so small a system.
        _, _, solution, info = dgesv(matrix, np.concatenate([upper, lower]))
        if info:
            raise ArithmeticError("the equations of motion are singular")
        return np.asarray(solution)
