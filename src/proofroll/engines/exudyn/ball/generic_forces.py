"""Forces of the formulation ``generic``: gravity, inertia, rolling resistance and friction in its coordinates."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.exudyn.ball.friction import KineticFriction, slow
from proofroll.engines.exudyn.ball.local_frame import LocalGeometry

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


def force_function(body: RollingBall, local: LocalGeometry, friction: KineticFriction | None) -> Any:
    """Right-hand side of M q̈ + Cᵀλ = Q as plain floats: Exudyn calls it for every residual."""
    f, least = body.contact.rolling_resistance, slow(body)
    tangents = local.tangents
    (t2u, t2v), (t3u, t3v) = tangents[1:].tolist()
    scaled = body.ball.mass * base(local)
    weight, a, hypot = weight_function(body, local, scaled), body.ball.radius, math.hypot
    turns = weight_turns(body, local)
    without_resistance = _written_out(quadratic_terms(body, local), None if turns else weight([]))

    def force(system: Any, t: float, item: int, q: list[float], rates: list[float]) -> list[float]:  # noqa: ARG001 -- Exudyn's signature
        result = without_resistance(rates, weight(q) if turns else None)
        N = result[0]  # along the distance nothing accelerates
        if f:  # friction.resistance_moment, whose call would cost as much as the rest
            _, rate1, rate2, _, _, _ = rates
            v2, v3 = t2u * rate1 + t2v * rate2, t3u * rate1 + t3v * rate2
            speed = hypot(v2, v3)
            shifted = f * N / (speed if speed > least else least or 1.0)
            result[4] -= shifted * v3
            result[5] += shifted * v2
        if friction is not None and friction.direction is not None:
            F2, F3 = friction.force(friction.direction, N)
            result[1] += t2u * F2 + t3u * F3
            result[2] += t2v * F2 + t3v * F3
            result[4] -= a * F3
            result[5] += a * F2
        return result

    return force


def _written_out(
    terms: list[tuple[int, int, int, float]], constant: list[float] | None
) -> Callable[[list[float], list[float] | None], list[float]]:
    """Inertial terms and weight as one expression: a loop over the terms would take a fifth of a step of Exudyn.

    The weight is ``constant``, or an argument.
    """
    sums = [[f"weight[{row}]" if constant is None else repr(constant[row])] for row in range(SIZE)]
    for row, i, j, factor in terms:
        sums[row].append(f"{factor!r} * rates[{i}] * rates[{j}]")
    text = "lambda rates, weight: [" + ", ".join(" + ".join(summands) for summands in sums) + "]"
    sums_of: Callable[[list[float], list[float] | None], list[float]] = eval(text)
    return sums_of


def weight_turns(body: RollingBall, local: LocalGeometry) -> bool:
    """True if the direction of gravity in the local frame changes as the ball moves along the wall."""
    axes = [np.asarray(generator.axis) for generator in local.generators if generator.kind == "rotation"]
    return bool(axes) and bool(np.any(np.abs(np.cross(axes[0], body.gravity)) > 1e-14 * np.linalg.norm(body.gravity)))


def weight_function(body: RollingBall, local: LocalGeometry, scaled: FloatArray) -> Callable[[Any], list[float]]:
    """Generalised gravity as a function of q: constant, or periodic in the one coordinate that is an angle.

    ``scaled`` maps a local force per mass to generalised forces: mass times :func:`base`, or the identity for the
    acceleration itself. Raises Refused on a wall with two rotations.
    """
    to_local, zero = body.surface.frame(body.u0).T, [0.0, 0.0, 0.0]
    if not weight_turns(body, local):
        constant = [*(scaled.T @ to_local @ body.gravity).tolist(), *zero]
        return lambda q: constant[:]  # noqa: ARG005 -- the place does not matter here
    rotations = [k for k, generator in enumerate(local.generators) if generator.kind == "rotation"]
    if len(rotations) > 1:
        raise Refused("gravity along a wall with two rotations is not built")
    axis = np.asarray(local.generators[rotations[0]].axis)
    axial = axis * (axis @ body.gravity)
    cosine, sine = body.gravity - axial, np.cross(axis, body.gravity)
    steady, with_cosine, with_sine = (scaled.T @ to_local @ part for part in (axial, cosine, sine))
    column, start = 1 + rotations[0], float(body.u0[rotations[0]])

    def weight(q: list[float]) -> list[float]:
        angle = q[column] - start
        force: list[float] = (steady + np.cos(angle) * with_cosine - np.sin(angle) * with_sine).tolist()
        return force + zero

    return weight
