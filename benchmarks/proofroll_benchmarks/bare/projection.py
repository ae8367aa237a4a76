"""The projection method as a reader of the paper would code it for the cylinder, with numpy and scipy alone.

Closed forms of Blajer (2006), section 3, instead of projections that are carried out numerically. Along the local axes
the matrix of the equations is constant, and inverted once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.linalg.lapack import dgesv

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder, is_mechanism
from proofroll_benchmarks.bare.mechanisms import dop853, projection_rows

Equations = tuple[FloatArray, Callable[[float, FloatArray], FloatArray], Callable[[FloatArray], FloatArray], FloatArray]


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`; with bounded friction it watches for slip, and ends there."""
    if is_mechanism(scene):
        return projection_rows(scene, settings)
    body = in_vertical_cylinder(scene)
    equations = (_euler if settings.formulation == "euler" else _rotating_frame)(body)
    return Bare(
        _run(body, settings, equations),
        1e-9,
        "the closed forms round otherwise, and the ball turns by some hundred radians",
    )


def _run(body: RollingBall, settings: Any, equations: Equations) -> Callable[[FloatArray], FloatArray]:
    x, rates, eliminated, reactions = equations
    c, mc, mu = body.surface.length_scales[0], body.ball.mass * body.surface.length_scales[0], body.contact.mu_static
    n = len(x) - 5  # coordinates; then the five velocities
    dt = settings.dt

    def check(t: float, x: FloatArray) -> None:
        """Checks that the equations hold: finite state, off the singularity, and within the cone."""
        if not math.isfinite(x.sum()) or (n > 2 and abs(math.sin(x[3])) < 0.01):
            raise Diverged(f"the angles are singular or not finite at {t:g} s")
        if mu < math.inf and math.hypot(*reactions.tolist()) > mu * mc * x[n] ** 2:
            raise Diverged(f"the ball slips at {t:g} s, for which there is no bare loop")

    def fixed_steps(times: FloatArray) -> FloatArray:
        x_now = x
        for start, end in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
            for step in range(round((end - start) / dt)):
                t = start + step * dt
                k1 = rates(t, x_now)
                k2 = rates(t, x_now + dt / 2 * k1)
                k3 = rates(t, x_now + dt / 2 * k2)
                k4 = rates(t, x_now + dt * k3)
                x_now = x_now + dt / 6 * (k1 + 2 * (k2 + k3) + k4)
                if settings.eliminates:
                    x_now = eliminated(x_now)
                check(t + dt, x_now)
        return x_now

    def accepted(solver: DOP853, _: float) -> None:
        if settings.eliminates:
            solver.y = eliminated(solver.y)
            solver.f = rates(solver.t, solver.y)
        check(solver.t, solver.y)

    def controlled_steps(times: FloatArray) -> FloatArray:
        solver = DOP853(rates, 0.0, x, np.inf, rtol=settings.rtol, atol=settings.rtol * _scales(body, n - 2))
        dop853(solver, times, accepted)
        return np.asarray(solver.y)

    def run(times: FloatArray) -> FloatArray:
        angle, height = (controlled_steps if settings.integrator == "dop853" else fixed_steps)(times)[:2].tolist()
        return np.array([c * math.cos(angle), c * math.sin(angle), height])

    return run


def _scales(body: RollingBall, angles: int) -> FloatArray:
    """Natural sizes of the state: lengths by the ball's radius, speeds by the initial ones."""
    a, c = body.ball.radius, body.surface.length_scales[0]
    speed = math.sqrt(body.v0 @ body.v0 + a * a * (body.w0 @ body.w0) + a * math.sqrt(body.gravity @ body.gravity))
    return np.array([a / c, a, *[1.0] * angles, speed / c, speed, *[speed / a] * 3])


def _euler(body: RollingBall) -> Equations:
    """Coordinates q = [γ z φ θ ψ] with velocities q̇: state, ẋ, elimination of violations, present multipliers."""
    m, J, a, c = body.ball.mass, body.ball.inertia, body.ball.radius, body.surface.length_scales[0]
    g, f, mc = -float(body.gravity[2]), body.contact.rolling_resistance, m * c
    w1, w2, w3 = body.w0.tolist()
    x = np.array([0.0, 0.0, 0.0, math.pi / 2, 0.0, *body.udot0, -w2, w1, w3])
    matrix = np.diag([m * c * c, m, J, J, J, 0.0, 0.0])
    matrix[0, 5] = matrix[5, 0] = c
    matrix[1, 6] = matrix[6, 1] = 1.0
    matrix[4, 5] = matrix[5, 4] = a
    reactions = np.zeros(2)
    upper = np.zeros(7)

    def fill(cos: float, sin: float, cos_d: float, sin_d: float) -> None:
        """M̄ and C_nh at θ and δ = ψ - γ; symmetric, so the order in memory does not matter."""
        matrix[2, 4] = matrix[4, 2] = J * cos
        matrix[2, 5] = matrix[5, 2] = a * cos
        matrix[2, 6] = matrix[6, 2] = a * sin * cos_d
        matrix[3, 6] = matrix[6, 3] = -a * sin_d

    def rates(_: float, x: FloatArray) -> FloatArray:
        gamma, _z, _phi, theta, psi, turn, rise, p, t, s = x.tolist()
        cos, sin, cos_d, sin_d = math.cos(theta), math.sin(theta), math.cos(psi - gamma), math.sin(psi - gamma)
        fill(cos, sin, cos_d, sin_d)
        on_phi, on_theta, on_psi = J * t * s * sin, -J * p * s * sin, J * p * t * sin
        if f:
            scale = f * mc * turn * turn / math.hypot(c * turn, rise)
            M2, M3 = -scale * rise, scale * c * turn
            on_phi += M3 * cos - M2 * sin * cos_d
            on_theta += M2 * sin_d
            on_psi += M3
        tilt = s - turn
        drift = -cos * cos_d * t * p + sin * sin_d * tilt * p + cos_d * tilt * t
        right = np.array([0.0, -m * g, on_phi, on_theta, on_psi, a * sin * t * p, a * drift])
        _, _, solution, info = dgesv(matrix, right)
        if info:
            raise Diverged("the equations of motion are singular")
        reactions[:] = solution[5:]
        return np.concatenate([x[5:], solution[:5]])

    def eliminated(x: FloatArray) -> FloatArray:
        gamma, _z, _phi, theta, psi = x[:5].tolist()
        fill(math.cos(theta), math.sin(theta), math.cos(psi - gamma), math.sin(psi - gamma))
        upper[5:] = matrix[5:, :5] @ x[5:]
        result = x.copy()
        result[5:] -= dgesv(matrix, upper)[2][:5]
        return result

    return x, rates, eliminated, reactions


def _rotating_frame(body: RollingBall) -> Equations:
    """Coordinates q = [γ z] with the velocities [γ̇ ż ω1 ω2 ω3]; as :func:`_euler`."""
    m, J, a, c = body.ball.mass, body.ball.inertia, body.ball.radius, body.surface.length_scales[0]
    g, f, mc = -float(body.gravity[2]), body.contact.rolling_resistance, m * c
    x = np.array([0.0, 0.0, *body.udot0, *body.w0])
    rows = np.array([[c, 0.0, 0.0, 0.0, a], [0.0, 1.0, 0.0, -a, 0.0]])
    matrix = np.zeros((7, 7))
    matrix[:5, :5] = np.diag([m * c * c, m, J, J, J])
    matrix[:5, 5:], matrix[5:, :5] = rows.T, rows
    inverse = np.linalg.inv(matrix)
    by_force, by_violation = inverse[:, :5].copy(), inverse[:5, 5:] @ rows
    reactions = np.zeros(2)

    def rates(_: float, x: FloatArray) -> FloatArray:
        _gamma, _z, turn, rise, w1, w2, _w3 = x.tolist()
        M2 = M3 = 0.0
        if f:
            scale = f * mc * turn * turn / math.hypot(c * turn, rise)
            M2, M3 = -scale * rise, scale * c * turn
        solution = by_force.dot(np.array([0.0, -m * g, J * turn * w2, M2 - J * turn * w1, M3]))
        reactions[:] = solution[5:]
        return np.concatenate([x[2:4], solution[:5]])

    def eliminated(x: FloatArray) -> FloatArray:
        result = x.copy()
        result[2:] -= by_violation @ x[2:]
        return result

    return x, rates, eliminated, reactions
