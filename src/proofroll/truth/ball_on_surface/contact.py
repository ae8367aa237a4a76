"""Stick and slip by Newton-Euler in the world frame; the surface enters only by its signed distance.

The wall's force R follows from the acceleration of the contact point, as vectors: zero along the wall's normal; along
the wall, the point sticks or obeys the law of friction. Implicit collocation integrates the equations, so neither the
stiff start of a slip nor its end is regularised.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, cross
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.truth.numerics.collocation import System

AnyArray = npt.NDArray[Any]  # real or complex
_PLUS_MINUS = np.concatenate([np.eye(3), -np.eye(3)])
_ONES = np.ones(3)


def _dot(x: AnyArray, y: AnyArray) -> AnyArray:
    """Scalar product x · y along the last axis, which is kept with length 1; complex values are not conjugated."""
    return np.asarray(((x * y) @ _ONES)[..., None])


class ContactRates:
    """Rates of the state y = (p, ω, u), shape (n, 9), with the slip velocity u instead of the centre's velocity v.

    u is a state because v + a ω × e1 would lose the digits of a small slip.
    """

    def __init__(self, body: RollingBall) -> None:
        self._body = body
        pace = np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)) + np.linalg.norm(body.v0)
        pace = max(float(pace), 1e-300)
        spin = max(pace / body.ball.radius, float(np.linalg.norm(body.w0)))
        self.scale = np.repeat([max(body.surface.length_scales[0], body.ball.radius), spin, pace], 3)

    def velocity(self, y: FloatArray) -> FloatArray:
        """Velocity v_WB of the centre [m/s], shape (n, 3): slip velocity minus the part due to spin."""
        e1 = self._body.surface.normal(y[:, :3])
        return np.asarray(y[:, 6:] - self._body.ball.radius * cross(y[:, 3:6], e1))

    def force(self, y: FloatArray, sticking: bool) -> FloatArray:
        """Force R of the wall on the ball [N], shape (n, 3)."""
        return np.asarray(self._solve(*self._geometry(y[:, :3]), y[:, 3:6], y[:, 6:], sticking)[1])

    def split(self, y: FloatArray, sticking: bool) -> tuple[FloatArray, FloatArray]:
        """Friction on the ball, shape (n, 3), and normal force N, shape (n,), both in [N]."""
        e1 = self._body.surface.normal(y[:, :3])
        R = self.force(y, sticking)
        N = -np.sum(R * e1, axis=-1)
        return R + N[:, None] * e1, N

    def slip_direction_at_rest(self, y: FloatArray) -> FloatArray:
        """Unit direction in which a slip starts, shape (3,), opposite to the friction needed to stick; else zero."""
        friction, _ = self.split(y[None, :], sticking=True)
        size = float(np.linalg.norm(friction))
        return np.asarray(-friction[0] / size) if size > 0 else np.zeros(3)

    def system(self, sticking: bool) -> System:
        """Rates, Jacobian and scales for the integrator."""
        return System(lambda y: self.rates(y, sticking), lambda y: self._jacobian(y, sticking), self.scale)

    def rates(self, y: FloatArray, sticking: bool) -> FloatArray:
        """Rates of the states, shape (n, 9)."""
        return np.asarray(self._solve(*self._geometry(y[:, :3]), y[:, 3:6], y[:, 6:], sticking)[0])

    def _geometry(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self._body.surface.normal(p), self._body.surface.normal_gradient(p)

    def _jacobian(self, y: FloatArray, sticking: bool) -> FloatArray:
        """∂ẏ/∂y, shape (n, 9, 9): by complex steps for ω and u, which are stiff; by differences for the geometry."""
        n, stiff = len(y), np.arange(3, 6 if sticking else 9)
        result = np.zeros((n, 9, 9))
        tilted = np.tile(y[:, 3:].astype(np.complex128), (len(stiff), 1, 1))
        tilted[np.arange(len(stiff)), :, stiff - 3] += 1e-30j * self.scale[stiff, None]
        rates = self._solve(*self._geometry(y[:, :3]), tilted[..., :3], tilted[..., 3:], sticking)[0]
        result[:, :, stiff] = np.moveaxis(np.imag(rates), 0, -1) / (1e-30 * self.scale[stiff])
        small = 1e-6 * self.scale[0]
        moved = (y[:, :3] + small * _PLUS_MINUS[:, None]).reshape(-1, 3)
        e1, bend = self._geometry(moved)
        rates = self._solve(e1.reshape(6, n, 3), bend.reshape(6, n, 3, 3), y[:, 3:6], y[:, 6:], sticking)[0]
        result[:, :, :3] = np.moveaxis(np.real(rates[:3] - rates[3:]), 0, -1) / (2 * small)
        return result

    def _solve(
        self, e1: FloatArray, bend: FloatArray, w: AnyArray, u: AnyArray, sticking: bool
    ) -> tuple[AnyArray, AnyArray]:
        """Rates ẏ, shape (n, 9), and wall force R [N], shape (n, 3); w and u may be complex.

        Newton's p̈ = g + R/m and Euler's J ω̇ = a e1 × R + f (v/V) × (R · e1) e1, with R = R1 e1 + T, are inserted into
        the acceleration p̈ + a ω̇ × e1 + a ω × ė1 of the contact point. With λ = 1/m + a²/J and the direction d of v
        this gives
            along e1:        R1/m + e1 · g = -ė1 · v, for e1 · v = 0 always,
            along the wall:  λ T + g - (a f/J) R1 d + a ω × ė1 = 0 in stick;  T = μ R1 u/|u| in slip.
        """
        body = self._body
        a, m, J, f = body.ball.radius, body.ball.mass, body.ball.inertia, body.contact.rolling_resistance
        v = u + a * cross(e1, w)
        e1_rate = (bend @ v[..., None])[..., 0]
        free = body.gravity + a * cross(w, e1_rate)
        R1 = -m * (_dot(e1, body.gravity) + _dot(e1_rate, v))
        tangential = free - _dot(e1, free) * e1
        ahead = np.zeros_like(v)
        if f:
            speed = np.sqrt(_dot(v, v))
            ahead = np.divide(v, speed, out=ahead, where=speed != 0)
            tangential = tangential - (a * f / J) * R1 * ahead
        if sticking:
            T = tangential / -(1 / m + a * a / J)
        else:
            size = np.sqrt(_dot(u, u))
            T = body.contact.mu_kinetic * R1 * np.divide(u, size, out=np.zeros_like(u), where=size != 0)
        R = R1 * e1 + T
        turning = a * cross(e1, T)
        if f:
            turning = turning + f * R1 * cross(ahead, e1)
        u_rate = np.zeros_like(v) if sticking else tangential + (1 / m + a * a / J) * T - _dot(e1_rate, u) * e1
        return np.concatenate([v, turning / J, u_rate], axis=-1), R
