"""Stick and slip by Newton-Euler in the world: the surface only through its signed distance, every force unknown.

One linear system for p̈, ω̇ and the wall's force R serves both modes; switching exchanges two of its rows. Integrated
by implicit collocation, so that neither the stiff start of a slip nor its end is regularised.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.truth.collocation import System

AnyArray = npt.NDArray[Any]  # real or complex
_PLUS_MINUS = np.concatenate([np.eye(3), -np.eye(3)])
# [e1]× from e1: e1 @ _CROSS has the rows of the matrix of e1 × x
_CROSS = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
)


def _times(matrix: AnyArray, x: AnyArray) -> AnyArray:
    return np.asarray((matrix @ x[..., None])[..., 0])


class Contact:
    """Rates of the state y = (p, ω, u), shape (n, 9), with the slip velocity u in place of the centre's velocity.

    u is a state because the difference v + a ω × e1 would lose the digits of a small slip.
    """

    def __init__(self, body: RollingBall) -> None:
        self._body = body
        pace = np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)) + np.linalg.norm(body.v0)
        pace = max(float(pace), 1e-300)
        spin = max(pace / body.ball.radius, float(np.linalg.norm(body.w0)))
        self.scale = np.repeat([max(body.surface.length_scales[0], body.ball.radius), spin, pace], 3)

    def velocity(self, y: FloatArray) -> FloatArray:
        """v_WB [m/s], shape (n, 3): slip without the part that the spin makes."""
        e1 = self._body.surface.normal(y[:, :3])
        return np.asarray(y[:, 6:] - self._body.ball.radius * np.cross(y[:, 3:6], e1))

    def force(self, y: FloatArray, sticking: bool) -> FloatArray:
        """R: force of the wall on the ball [N], shape (n, 3)."""
        return np.asarray(self._solve(*self._geometry(y[:, :3]), y[:, 3:6], y[:, 6:], sticking)[1])

    def split(self, y: FloatArray, sticking: bool) -> tuple[FloatArray, FloatArray]:
        """Friction on the ball, shape (n, 3), and N, shape (n,) [N]."""
        e1 = self._body.surface.normal(y[:, :3])
        R = self.force(y, sticking)
        N = -np.sum(R * e1, axis=-1)
        return R + N[:, None] * e1, N

    def slip_direction_at_rest(self, y: FloatArray) -> FloatArray:
        """Direction in which a slip starts, shape (3,): against the friction that sticking would need."""
        friction, _ = self.split(y[None, :], sticking=True)
        size = float(np.linalg.norm(friction))
        return np.asarray(-friction[0] / size) if size > 0 else np.zeros(3)

    def system(self, sticking: bool) -> System:
        """What the integrator needs."""
        return System(lambda y: self.rates(y, sticking), lambda y: self._jacobian(y, sticking), self.scale)

    def rates(self, y: FloatArray, sticking: bool) -> FloatArray:
        """ẏ, shape (n, 9)."""
        return np.asarray(self._solve(*self._geometry(y[:, :3]), y[:, 3:6], y[:, 6:], sticking)[0])

    def _geometry(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self._body.surface.normal(p), self._body.surface.normal_gradient(p)

    def _jacobian(self, y: FloatArray, sticking: bool) -> FloatArray:
        """∂ẏ/∂y: exact by complex steps for ω and u, where it is stiff; by differences for the smooth geometry."""
        n, stiff = len(y), np.arange(3, 6 if sticking else 9)
        small = 1e-6 * self.scale[0]
        p = np.concatenate([np.tile(y[:, :3], (len(stiff), 1)), *(y[:, :3] + step for step in small * _PLUS_MINUS)])
        rest = np.tile(y[:, 3:].astype(np.complex128), (len(stiff) + len(_PLUS_MINUS), 1, 1))
        rest = rest.reshape(-1, n, 6)
        for number, column in enumerate(stiff):
            rest[number, :, column - 3] += 1e-30j * self.scale[column]
        rest = rest.reshape(-1, 6)
        rates = self._solve(*self._geometry(p), rest[:, :3], rest[:, 3:], sticking)[0].reshape(-1, n, 9)
        result = np.zeros((n, 9, 9))
        exact, moved = rates[: len(stiff)], rates[len(stiff) :]
        result[:, :, stiff] = np.moveaxis(np.imag(exact), 0, -1) / (1e-30 * self.scale[stiff])
        result[:, :, :3] = np.moveaxis(np.real(moved[:3] - moved[3:]), 0, -1) / (2 * small)
        return result

    def _solve(
        self, e1: FloatArray, bend: FloatArray, w: AnyArray, u: AnyArray, sticking: bool
    ) -> tuple[AnyArray, AnyArray]:
        """ẏ and R; w and u may be complex."""
        body = self._body
        a, m, J, f = body.ball.radius, body.ball.mass, body.ball.inertia, body.contact.rolling_resistance
        cross = np.tensordot(e1, _CROSS, axes=1)  # cross @ x = e1 × x
        v = u + a * _times(cross, w)
        e1_rate = _times(bend, v)
        n, eye = len(v), np.eye(3)
        matrix = np.zeros((n, 9, 9), dtype=v.dtype)
        right = np.zeros((n, 9), dtype=v.dtype)
        matrix[:, :3, :3] = m * eye
        matrix[:, :3, 6:] = -eye
        right[:, :3] = m * body.gravity
        matrix[:, 3:6, 3:6] = J * eye
        matrix[:, 3:6, 6:] = -a * cross
        if f:  # moment f (v/V) × (R · e1) e1 of the shifted normal force
            speed = np.sqrt(np.sum(v * v, axis=-1, keepdims=True))
            ahead = np.divide(v, speed, out=np.zeros_like(v), where=speed != 0)
            matrix[:, 3:6, 6:] -= f * _times(-cross, ahead)[:, :, None] * e1[:, None, :]
        # Contact point's acceleration p̈ + a ω̇ × e1 + a ω × ė1: all of it zero in stick, in slip only that along e1,
        # where ω̇ has no part; the other two rows are then the law of friction.
        carried = a * _times(np.tensordot(w, _CROSS, axes=1), e1_rate)
        matrix[:, 6:, :3] = eye
        matrix[:, 6:, 3:6] = -a * cross
        right[:, 6:] = -carried
        if not sticking:
            size = np.sqrt(np.sum(u * u, axis=-1, keepdims=True))
            direction = np.divide(u, size, out=np.zeros_like(u), where=size != 0)
            normal = e1[:, :, None] * e1[:, None, :]
            law = eye - normal - body.contact.mu_kinetic * direction[:, :, None] * e1[:, None, :]
            # e1 (e1 · p̈ + ė1 · v) + R_t - μ (R · e1) u/|u| = 0, the two parts at right angles
            matrix[:, 6:, :3] = normal
            matrix[:, 6:, 3:6] = 0.0
            matrix[:, 6:, 6:] = law / m
            right[:, 6:] = -e1 * np.sum(e1_rate * v, axis=-1, keepdims=True)
        solution = np.linalg.solve(matrix, right[..., None])[..., 0]
        p_second, w_rate, R = solution[:, :3], solution[:, 3:6], solution[:, 6:]
        if sticking:
            return np.concatenate([v, w_rate, np.zeros_like(v)], axis=-1), R
        u_rate = p_second + carried - a * _times(cross, w_rate)
        return np.concatenate([v, w_rate, u_rate], axis=-1), R
