"""Forces of the formulation ``generic``: gravity, inertia and rolling resistance in its coordinates."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.exudyn.ball.local_frame import LocalGeometry, slow

# Coordinates: distance towards the wall, two of the surface, and three whose rates are the angular velocity.
SIZE = 6


def base(local: LocalGeometry) -> FloatArray:
    """∂p/∂(distance, u1, u2) in the local frame."""
    return np.concatenate([np.eye(3)[:, :1], local.tangents], axis=1)


def quadratic_terms(body: RollingBall, local: LocalGeometry) -> list[tuple[int, int, int, float]]:
    """All inertial terms Q_r = Σ c_rij q̇_i q̇_j as (r, i, j, c).

    Terms with the distance itself as a factor are left out: the constraint keeps it at zero.
    """
    m, J = body.ball.mass, body.ball.inertia
    c = np.zeros((SIZE, SIZE, SIZE))
    derivatives = base(local)
    c[:3, 1:3, 1:3] = -m * np.einsum("ir,ijk->rjk", derivatives, local.second)
    for k in range(2):
        turn = local.turn[:, k]
        c[:3, 0, 1 + k] -= 2 * m * derivatives.T @ np.cross(turn, [1.0, 0.0, 0.0])
        c[3:, 1 + k, 3:] -= J * np.cross(turn, np.eye(3)).T
    return [(int(r), int(i), int(j), float(c[r, i, j])) for r, i, j in np.argwhere(np.abs(c) > 0)]


def force_function(body: RollingBall, local: LocalGeometry) -> Any:
    """Right-hand side of M q̈ + Cᵀλ = Q as plain floats: Exudyn calls it for every residual."""
    f, least = body.contact.rolling_resistance, slow(body)
    (t2u, t2v), (t3u, t3v) = local.tangents[1:].tolist()
    # gravity is along the axis about which the local frame turns
    weight = body.ball.mass * base(local).T @ body.surface.frame(body.u0).T @ body.gravity
    without_resistance = _written_out(quadratic_terms(body, local), [*weight.tolist(), 0.0, 0.0, 0.0])
    hypot = math.hypot

    def force(system: Any, t: float, item: int, q: list[float], rates: list[float]) -> list[float]:  # noqa: ARG001 -- Exudyn's signature
        result = without_resistance(rates)
        N = result[0]  # along the distance nothing accelerates
        if f:
            _, rate1, rate2, _, _, _ = rates
            v2, v3 = t2u * rate1 + t2v * rate2, t3u * rate1 + t3v * rate2
            speed = hypot(v2, v3)
            shifted = f * N / (speed if speed > least else least or 1.0)
            result[4] -= shifted * v3
            result[5] += shifted * v2
        return result

    return force


def _written_out(terms: list[tuple[int, int, int, float]], weight: list[float]) -> Callable[[list[float]], list[float]]:
    """Inertial terms and weight as one expression: a loop over the terms would take a fifth of a step of Exudyn."""
    sums = [[repr(part)] for part in weight]
    for row, i, j, factor in terms:
        sums[row].append(f"{factor!r} * rates[{i}] * rates[{j}]")
    text = "lambda rates: [" + ", ".join(" + ".join(summands) for summands in sums) + "]"
    sums_of: Callable[[list[float]], list[float]] = eval(text)
    return sums_of
