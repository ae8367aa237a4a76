"""The written-out equations of :mod:`uniform` in Euler angles."""

from __future__ import annotations

import math

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.projection.geometry import Uniform
from proofroll.engines.projection.uniform import Closed

# A turning axis whose horizontal components are smaller than this is vertical.
_VERTICAL = 1e-15


class Euler(Closed):
    """Velocities φ̇, θ̇, ψ̇: the axes about which they turn are given in the world.

    M̄ falls apart into the blocks m TᵀT of the centre and J [[1, 0, cos θ], [0, 1, 0], [cos θ, 0, 1]] of the angles,
    whose inverses are known. So the multipliers come from (C M̄⁻¹ Cᵀ) λ = C M̄⁻¹ h - ξ, two equations, and the
    accelerations from M̄ ṡ = h - Cᵀ λ, which is Blajer's (2002) way; the matrix of all seven is never put together.
    """

    _coordinates = 5

    def __init__(self, body: RollingBall, geometry: Uniform) -> None:
        super().__init__(body, geometry)
        (self._u2, self._u3), (self._v2, self._v3) = np.linalg.inv(self.tangents).tolist()
        # Where the frame turns about the vertical, or not at all, the axes of the angles as seen from it are those at
        # its start, with the precession counted from the frame: nothing but that angle then changes with the place.
        x, y, z = geometry.axis
        self._upright = self.steady and max(abs(x), abs(y)) <= _VERTICAL
        self._along = math.copysign(1.0, z)

    def _view(self, state: list[float]) -> tuple[tuple[float, ...], tuple[float, ...], float, float, float, float]:
        """Local axes, gravity along them [m/s²], and sine and cosine of θ and of ψ, from where the axes are given.

        Raises:
            ArithmeticError: the state is not finite, or the angles are singular.
        """
        theta, psi = state[3], state[4]
        if self._upright:
            if self.column is not None:
                psi -= self._along * state[self.column]
            frame, gravity = self.frames[0], self.gravity[0]
        else:
            turned = self.angle(state)
            frame, gravity = self.frame(*turned), self.weight(*turned)
        if not math.isfinite(theta + psi):
            raise FloatingPointError("the Euler angles overflow inside a step")
        sin = math.sin(theta)
        if not sin:
            raise ArithmeticError("the equations of motion are singular")
        return frame, gravity, sin, math.cos(theta), math.sin(psi), math.cos(psi)

    def _all(self, x: FloatArray) -> tuple[FloatArray, float]:
        state = x.tolist()
        _, _, _, _, _, u, v, phi, theta, psi = state
        (x1, y1, z1, x2, y2, z2, x3, y3, z3), (g1, g2, g3), sin, cos, sin_psi, cos_psi = self._view(state)
        m, J, a = self.m, self.J, self.a
        uu, uv, vv = u * u, u * v, v * v
        (a1, b1, c1), (a2, b2, c2), (a3, b3, c3) = self.second
        d2, d3 = a2 * uu + b2 * uv + c2 * vv, a3 * uu + b3 * uv + c3 * vv
        (p1, p2, p3), (q1, q2, q3) = self.turn_u, self.turn_v
        o1, o2, o3 = p1 * u + q1 * v, p2 * u + q2 * v, p3 * u + q3 * v
        v2, v3 = self.t2u * u + self.t2v * v, self.t3u * u + self.t3v * v
        N = m * (g1 - (a1 * uu + b1 * uv + c1 * vv))
        # The axis of θ is (cos ψ, sin ψ, 0), across it lies (sin ψ, -cos ψ, 0), and in the plane of that and of the
        # vertical, the axis of ψ, lies the axis of φ. Along e2 and e3 they are:
        theta2, theta3 = x2 * cos_psi + y2 * sin_psi, x3 * cos_psi + y3 * sin_psi
        k2, k3 = x2 * sin_psi - y2 * cos_psi, x3 * sin_psi - y3 * cos_psi
        phi2, phi3 = sin * k2 + cos * z2, sin * k3 + cos * z3
        w1 = phi * (sin * (x1 * sin_psi - y1 * cos_psi) + cos * z1) + theta * (x1 * cos_psi + y1 * sin_psi) + psi * z1
        w2, w3 = phi * phi2 + theta * theta2 + psi * z2, phi * phi3 + theta * theta3 + psi * z3
        # Ȧ r: ``turned`` along the axis of θ, ``across`` it, and -``down`` along the vertical; see EulerAngles. Along
        # the axes of the angles it is (-θ̇ψ̇, φ̇ψ̇, -φ̇θ̇) sin θ, d̄ of the paper.
        tilted, turned, node = phi * theta, phi * psi * sin, theta * psi
        across, down = tilted * cos - node, tilted * sin
        h_phi, h_theta, h_psi = node * sin, -turned, down  # Aᵀ M_C / J - d̄ / J
        if self.f:
            M2, M3 = self.moment(N, v2, v3)
            M2, M3 = M2 / J, M3 / J
            h_phi += phi2 * M2 + phi3 * M3
            h_theta += theta2 * M2 + theta3 * M3
            h_psi += z2 * M2 + z3 * M3
        p2, p3 = g2 - d2, g3 - d3
        slip2 = d2 + o1 * v3 + a * (turned * theta3 + across * k3 - down * z3 - (o1 * w2 - o2 * w1))
        slip3 = d3 - o1 * v2 - a * (turned * theta2 + across * k2 - down * z2 - (o3 * w1 - o1 * w3))
        # M̄⁻¹ h, the rate of slip that it leaves, and the friction that takes this away.
        scale = 1.0 / (sin * sin)
        b_phi, b_psi = scale * (h_phi - cos * h_psi), scale * (h_psi - cos * h_phi)
        free2 = p2 + a * (phi3 * b_phi + theta3 * h_theta + z3 * b_psi) + slip2
        free3 = p3 - a * (phi2 * b_phi + theta2 * h_theta + z2 * b_psi) + slip3
        L2, L3, on_phi, on_theta, on_psi = self._held((phi2, theta2, z2), (phi3, theta3, z3), cos, scale, free2, free3)
        p2, p3 = p2 - L2 / m, p3 - L3 / m
        everything = (
            u,
            v,
            phi,
            theta,
            psi,
            self._u2 * p2 + self._u3 * p3,
            self._v2 * p2 + self._v3 * p3,
            b_phi - on_phi,
            h_theta - on_theta,
            b_psi - on_psi,
            L2,
            L3,
        )
        return np.array(everything), N

    def _held(
        self,
        along2: tuple[float, float, float],
        along3: tuple[float, float, float],
        cos: float,
        scale: float,
        free2: float,
        free3: float,
    ) -> tuple[float, float, float, float, float]:
        """λ of (C M̄⁻¹ Cᵀ) λ = ``free``, and what it takes from the rates of φ, θ, ψ.

        ``along2`` and ``along3`` are the axes of φ, θ, ψ along e2 and e3, ``cos`` and ``scale`` cos θ and 1 / sin²θ.
        """
        a, J, per_mass = self.a, self.J, 1.0 / self.m
        (phi2, theta2, z2), (phi3, theta3, z3) = along2, along3
        scale *= a / J
        x_phi, x_theta, x_psi = scale * (phi3 - cos * z3), a / J * theta3, scale * (z3 - cos * phi3)
        y_phi, y_theta, y_psi = -scale * (phi2 - cos * z2), -a / J * theta2, -scale * (z2 - cos * phi2)
        S22 = per_mass + a * (phi3 * x_phi + theta3 * x_theta + z3 * x_psi)
        S23 = a * (phi3 * y_phi + theta3 * y_theta + z3 * y_psi)
        S33 = per_mass - a * (phi2 * y_phi + theta2 * y_theta + z2 * y_psi)
        size = S22 * S33 - S23 * S23
        L2, L3 = (S33 * free2 - S23 * free3) / size, (S22 * free3 - S23 * free2) / size
        return L2, L3, x_phi * L2 + y_phi * L3, x_theta * L2 + y_theta * L3, x_psi * L2 + y_psi * L3

    def eliminated(self, x: FloatArray) -> FloatArray:
        """See :class:`~proofroll.engines.projection.uniform.Closed`."""
        state = x.tolist()
        _, _, _, _, _, u, v, phi, theta, psi = state
        (_, _, _, x2, y2, z2, x3, y3, z3), _, sin, cos, sin_psi, cos_psi = self._view(state)
        phi2 = sin * (x2 * sin_psi - y2 * cos_psi) + cos * z2
        phi3 = sin * (x3 * sin_psi - y3 * cos_psi) + cos * z3
        theta2, theta3 = x2 * cos_psi + y2 * sin_psi, x3 * cos_psi + y3 * sin_psi
        slip2 = self.t2u * u + self.t2v * v + self.a * (phi * phi3 + theta * theta3 + psi * z3)
        slip3 = self.t3u * u + self.t3v * v - self.a * (phi * phi2 + theta * theta2 + psi * z2)
        L2, L3, on_phi, on_theta, on_psi = self._held(
            (phi2, theta2, z2), (phi3, theta3, z3), cos, 1.0 / (sin * sin), slip2, slip3
        )
        p2, p3 = L2 / self.m, L3 / self.m
        result = x.copy()
        result[5:] -= (self._u2 * p2 + self._u3 * p3, self._v2 * p2 + self._v3 * p3, on_phi, on_theta, on_psi)
        return result
