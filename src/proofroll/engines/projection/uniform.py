"""The equations of motion on a surface that looks the same from every point of it, written out.

There all geometry along the local axes is constant, and what is left of the projections of :mod:`method` are a few
dozen products. As plain floats they cost a fifth of the same in arrays of three to seven numbers. Nothing is modelled
here: the results are those of :class:`~proofroll.engines.projection.method.ProjectedBall` with both rows of rolling
active.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from scipy.linalg.lapack import dgesv

from proofroll.engines.projection.geometry import Uniform
from proofroll.engines.projection.orientation import EulerAngles, Orientation, RotatingFrame
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray


class Closed(Protocol):
    """The equations at a state x = [q, s]."""

    def solve(self, x: FloatArray) -> tuple[FloatArray, float]:
        """[ṡ, λ_nh], shape (7,), and N [N].

        Raises:
            ArithmeticError: there is no solution, or the state is not finite.
        """

    def eliminated(self, x: FloatArray) -> FloatArray:
        """The state with the violation of C v = 0 removed from s."""


class _Translation:
    """What the centre contributes: constants in the local axes.

    Attributes:
        mass: m TᵀT, shape (2, 2).
        tangents: T, rows e2 and e3, shape (2, 2).
    """

    def __init__(self, body: RollingBall, geometry: Uniform) -> None:
        local = geometry.at(np.zeros(2))
        self.m, self.J, self.a = body.ball.mass, body.ball.inertia, body.ball.radius
        self.f = body.contact.rolling_resistance
        self.tangents = local.tangents[1:]
        self.mass = self.m * self.tangents.T @ self.tangents
        (self.t2u, self.t2v), (self.t3u, self.t3v) = self.tangents.tolist()
        # d_i = uu u̇² + uv u̇ v̇ + vv v̇²
        self.second = [(float(s[0, 0]), float(s[0, 1] + s[1, 0]), float(s[1, 1])) for s in local.second]
        turning = local.turning
        self.turn_u, self.turn_v = (
            (float(turning[2, 1, k]), float(turning[0, 2, k]), float(turning[1, 0, k])) for k in (0, 1)
        )
        self.column = geometry.column
        # A frame turned by α about k is F0 + sin α F1 + (1 - cos α) F2, and so is gravity along its axes.
        zero = np.zeros((3, 3))
        frames = [*geometry.parts, zero, zero][:3]
        self.frames = [tuple(part.T.ravel().tolist()) for part in frames]
        self.gravity = [tuple((body.gravity @ part).tolist()) for part in frames]
        size = 1e-15 * float(np.linalg.norm(body.gravity))
        self.steady = all(abs(x) <= size for part in self.gravity[1:] for x in part)

    def frame(self, sin: float, cos: float) -> tuple[float, ...]:
        """Components of e1, e2, e3 in the world, one after the other."""
        start, once, twice = self.frames
        x1, y1, z1, x2, y2, z2, x3, y3, z3 = start
        a1, b1, c1, a2, b2, c2, a3, b3, c3 = once
        d1, e1, f1, d2, e2, f2, d3, e3, f3 = twice
        back = 1.0 - cos
        return (
            x1 + sin * a1 + back * d1,
            y1 + sin * b1 + back * e1,
            z1 + sin * c1 + back * f1,
            x2 + sin * a2 + back * d2,
            y2 + sin * b2 + back * e2,
            z2 + sin * c2 + back * f2,
            x3 + sin * a3 + back * d3,
            y3 + sin * b3 + back * e3,
            z3 + sin * c3 + back * f3,
        )

    def weight(self, sin: float, cos: float) -> tuple[float, ...]:
        """Gravity along e1, e2, e3 [m/s²]."""
        start, once, twice = self.gravity
        if self.steady:
            return start
        back = 1.0 - cos
        return tuple([x + sin * y + back * z for x, y, z in zip(start, once, twice, strict=True)])

    def angle(self, x: list[float]) -> tuple[float, float]:
        """Sine and cosine of the angle by which the frame is turned."""
        if self.column is None:
            return 0.0, 1.0
        angle = x[self.column]
        if not math.isfinite(angle):
            raise FloatingPointError("the place on the surface is not finite")
        return math.sin(angle), math.cos(angle)

    def drift(self, u: float, v: float) -> tuple[float, float, float]:
        """Second derivative of the place along e1, e2, e3 without accelerations [m/s²]."""
        uu, uv, vv = u * u, u * v, v * v
        (a1, b1, c1), (a2, b2, c2), (a3, b3, c3) = self.second
        return a1 * uu + b1 * uv + c1 * vv, a2 * uu + b2 * uv + c2 * vv, a3 * uu + b3 * uv + c3 * vv

    def frame_rate(self, u: float, v: float) -> tuple[float, float, float]:
        """Angular velocity of the frame along its axes [rad/s]."""
        (x1, x2, x3), (y1, y2, y3) = self.turn_u, self.turn_v
        return x1 * u + y1 * v, x2 * u + y2 * v, x3 * u + y3 * v

    def moment(self, N: float, v2: float, v3: float) -> tuple[float, float]:
        """M2, M3 of the rolling resistance [N m]."""
        speed = math.hypot(v2, v3)
        lever = N * self.f / speed if speed else 0.0
        return -lever * v3, lever * v2


class _AlongAxes(_Translation):
    """Velocities ω' along the local axes: A = 1, so the matrix is constant, and inverted once."""

    def __init__(self, body: RollingBall, geometry: Uniform) -> None:
        super().__init__(body, geometry)
        rows = np.zeros((2, 5))
        rows[:, :2] = self.tangents
        rows[0, 4], rows[1, 3] = self.a, -self.a
        matrix = np.zeros((7, 7))
        matrix[:2, :2], matrix[2:5, 2:5] = self.mass, self.J * np.eye(3)
        matrix[:5, 5:], matrix[5:, :5] = rows.T, rows
        self._inverse = np.linalg.inv(matrix)
        self._by_slip = self._inverse[:5, 5:] @ rows

    def solve(self, x: FloatArray) -> tuple[FloatArray, float]:
        """See :class:`Closed`."""
        state = x.tolist()
        _, _, u, v, w1, w2, w3 = state
        g1, g2, g3 = self.gravity[0] if self.steady else self.weight(*self.angle(state))
        d1, d2, d3 = self.drift(u, v)
        o1, o2, o3 = self.frame_rate(u, v)
        v2, v3 = self.t2u * u + self.t2v * v, self.t3u * u + self.t3v * v
        m, J = self.m, self.J
        N = m * (g1 - d1)
        M2, M3 = self.moment(N, v2, v3) if self.f else (0.0, 0.0)
        p2, p3 = m * (g2 - d2), m * (g3 - d3)
        right = (
            self.t2u * p2 + self.t3u * p3,
            self.t2v * p2 + self.t3v * p3,
            -J * (o2 * w3 - o3 * w2),
            M2 - J * (o3 * w1 - o1 * w3),
            M3 - J * (o1 * w2 - o2 * w1),
            -(d2 + o1 * v3),
            -(d3 - o1 * v2),
        )
        return self._inverse.dot(np.array(right)), N

    def eliminated(self, x: FloatArray) -> FloatArray:
        """See :class:`Closed`."""
        result = x.copy()
        result[2:] -= self._by_slip.dot(x[2:])
        return result


class _Euler(_Translation):
    """Velocities φ̇, θ̇, ψ̇: the axes about which they turn are given in the world."""

    def __init__(self, body: RollingBall, geometry: Uniform) -> None:
        super().__init__(body, geometry)
        J = self.J
        self._matrix = np.zeros((7, 7))
        self._matrix[:2, :2] = self.mass
        self._matrix[2, 2] = self._matrix[3, 3] = self._matrix[4, 4] = J
        self._matrix[:2, 5:], self._matrix[5:, :2] = self.tangents.T, self.tangents
        self._upper = np.zeros(7)

    def _fill(self, frame: tuple[float, ...], sin: float, cos: float, sin_psi: float, cos_psi: float) -> None:
        """M̄ and C_nh = C D; symmetric, so that the order of the elements in memory does not matter."""
        _, _, _, x2, y2, z2, x3, y3, z3 = frame
        a, matrix = self.a, self._matrix
        nx, ny = sin * sin_psi, -sin * cos_psi  # the axis of φ; that of θ is (cos ψ, sin ψ, 0), that of ψ is vertical
        matrix[2, 4] = matrix[4, 2] = self.J * cos
        matrix[2, 5] = matrix[5, 2] = a * (x3 * nx + y3 * ny + z3 * cos)
        matrix[3, 5] = matrix[5, 3] = a * (x3 * cos_psi + y3 * sin_psi)
        matrix[4, 5] = matrix[5, 4] = a * z3
        matrix[2, 6] = matrix[6, 2] = -a * (x2 * nx + y2 * ny + z2 * cos)
        matrix[3, 6] = matrix[6, 3] = -a * (x2 * cos_psi + y2 * sin_psi)
        matrix[4, 6] = matrix[6, 4] = -a * z2

    def solve(self, x: FloatArray) -> tuple[FloatArray, float]:
        """See :class:`Closed`."""
        state = x.tolist()
        _, _, _, theta, psi, u, v, phi_rate, theta_rate, psi_rate = state
        if not math.isfinite(theta + psi):
            raise FloatingPointError("the Euler angles overflow inside a step")
        sin, cos, sin_psi, cos_psi = math.sin(theta), math.cos(theta), math.sin(psi), math.cos(psi)
        sin_a, cos_a = self.angle(state)
        frame = self.frame(sin_a, cos_a)
        self._fill(frame, sin, cos, sin_psi, cos_psi)
        x1, y1, z1, x2, y2, z2, x3, y3, z3 = frame
        g1, g2, g3 = self.weight(sin_a, cos_a)
        d1, d2, d3 = self.drift(u, v)
        o1, o2, o3 = self.frame_rate(u, v)
        v2, v3 = self.t2u * u + self.t2v * v, self.t3u * u + self.t3v * v
        m, J, a = self.m, self.J, self.a
        N = m * (g1 - d1)
        # Ȧ r in the world, and ω: see EulerAngles.
        tilted, turned, node = phi_rate * theta_rate, phi_rate * psi_rate * sin, theta_rate * psi_rate
        rx = tilted * cos * sin_psi + turned * cos_psi - node * sin_psi
        ry = -tilted * cos * cos_psi + turned * sin_psi + node * cos_psi
        rz = -tilted * sin
        nx, ny = sin * sin_psi, -sin * cos_psi
        wx, wy = phi_rate * nx + theta_rate * cos_psi, phi_rate * ny + theta_rate * sin_psi
        wz = psi_rate + phi_rate * cos
        w1 = x1 * wx + y1 * wy + z1 * wz
        w2 = x2 * wx + y2 * wy + z2 * wz
        w3 = x3 * wx + y3 * wy + z3 * wz
        # Aᵀ (M - J Ȧ r): along the three axes, M about e2 and e3 by the rows of the matrix.
        p2, p3 = m * (g2 - d2), m * (g3 - d3)
        on_phi = -J * (nx * rx + ny * ry + cos * rz)
        on_theta = -J * (cos_psi * rx + sin_psi * ry)
        on_psi = -J * rz
        if self.f:
            M2, M3 = self.moment(N, v2, v3)
            mx, my, mz = M2 * x2 + M3 * x3, M2 * y2 + M3 * y3, M2 * z2 + M3 * z3
            on_phi += nx * mx + ny * my + cos * mz
            on_theta += cos_psi * mx + sin_psi * my
            on_psi += mz
        slip2 = d2 + o1 * v3 + a * (x3 * rx + y3 * ry + z3 * rz - (o1 * w2 - o2 * w1))
        slip3 = d3 - o1 * v2 - a * (x2 * rx + y2 * ry + z2 * rz - (o3 * w1 - o1 * w3))
        right = (
            self.t2u * p2 + self.t3u * p3,
            self.t2v * p2 + self.t3v * p3,
            on_phi,
            on_theta,
            on_psi,
            -slip2,
            -slip3,
        )
        return _solved(self._matrix, np.array(right)), N

    def eliminated(self, x: FloatArray) -> FloatArray:
        """See :class:`Closed`."""
        state = x.tolist()
        theta, psi = state[3:5]
        frame = self.frame(*self.angle(state))
        self._fill(frame, math.sin(theta), math.cos(theta), math.sin(psi), math.cos(psi))
        self._upper[5:] = self._matrix[5:, :5].dot(x[5:])
        result = x.copy()
        result[5:] -= _solved(self._matrix, self._upper)[:5]
        return result


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    # LAPACK directly: numpy's wrapper costs more than the solution of so small a system.
    _, _, solution, info = dgesv(matrix, right)
    if info:
        raise ArithmeticError("the equations of motion are singular")
    return np.asarray(solution)


def closed_form(body: RollingBall, geometry: object, orientation: Orientation) -> Closed | None:
    """The equations written out, or None where they are not known."""
    if not isinstance(geometry, Uniform):
        return None
    if type(orientation) is RotatingFrame:  # not where the orientation is followed: its state is longer
        return _AlongAxes(body, geometry)
    return _Euler(body, geometry) if isinstance(orientation, EulerAngles) else None
