"""Vector formulas of a ball rolling on a surface, in an upright cylinder.

Signs as in Blajer (2006), with the frame of :mod:`cylinder`: the contact point is at ``p_WB + a e1``.
Array arguments may carry leading dimensions.
"""

import math
from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.elements.mechanism.run.contacts.on_wall import resistance_moment as resistance_moment  # noqa: PLC0414 -- public here
from proofroll.papers.blajer_2006.ball.model import RollingBall


@dataclass(frozen=True)
class BallMotion:
    """State and contact force at given times.

    Attributes:
        p_WB, v_WB, w_WB: centre [m], its velocity [m/s], angular velocity [rad/s], shape (time, 3).
        force: of the wall on the ball [N], shape (time, 3).
        route: name of the method that found it, for a person.
    """

    p_WB: FloatArray
    v_WB: FloatArray
    w_WB: FloatArray
    force: FloatArray
    route: str


def world_motion(
    body: RollingBall,
    u: FloatArray,
    *,
    velocity: FloatArray,
    spin: FloatArray,
    friction: FloatArray,
    press: FloatArray,
    route: str,
) -> BallMotion:
    """Motion in the world of rolling at n times, from values in the local frame.

    Args:
        body: the scene's ball.
        u: surface coordinates, shape (n, 2).
        velocity: of the centre along e2, e3 [m/s], shape (n, 2).
        spin: ω1 [rad/s], shape (n,).
        friction: on the ball along e2, e3 [N], shape (n, 2).
        press: normal force N [N], shape (n,).
        route: name of the method, for a person.
    """
    frame = body.surface.frame(u)
    e1, e2, e3 = np.moveaxis(frame, -1, 0)

    def along(x: FloatArray) -> FloatArray:
        return np.asarray(x[:, :1] * e2 + x[:, 1:] * e3)

    v_WB = along(velocity)
    w_WB = spin[:, None] * e1 - cross(e1, v_WB) / body.ball.radius
    return BallMotion(
        p_WB=body.surface.position(u), v_WB=v_WB, w_WB=w_WB, force=along(friction) - press[:, None] * e1, route=route
    )


def natural_acceleration(body: RollingBall) -> float:
    """Scale of accelerations at time 0, max(g, |p̈|) [m/s²], never zero; times the mass it is that of forces.

    The certificate's relative differences of acceleration, N, F2 and F3 refer to it.
    """
    acceleration = initial_response(body)[0]
    return max(float(np.linalg.norm(body.gravity)), float(np.linalg.norm(acceleration))) or 1.0


def natural_speed(body: RollingBall) -> float:
    """Natural speed [m/s], never zero: root of the sum of squares of |v0|, a |ω0| and √(a g)."""
    a = body.ball.radius
    parts = np.linalg.norm(body.v0), a * np.linalg.norm(body.w0), math.sqrt(a * float(np.linalg.norm(body.gravity)))
    return math.hypot(*(float(part) for part in parts)) or 1.0


def initial_response(body: RollingBall) -> tuple[FloatArray, FloatArray]:
    """Acceleration of the centre [m/s²] and force of the wall on the ball [N] at time 0, each shape (3,).

    By Newton-Euler for the nine unknowns p̈, ω̇, (N, F2, F3) together; the last three equations are the constraints
    differentiated, using the signed distance and its derivatives.
    """
    acceleration, _, force = newton_euler(body, body.p0, body.v0, body.w0)
    return acceleration, force


def newton_euler(
    body: RollingBall, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """p̈ [m/s²], ω̇ [rad/s²] and the wall's force on the ball [N] while rolling without slip, each shape (3,).

    Unreduced: six equations of motion and three acceleration constraints, in the world frame, with no
    parametrisation of the surface.
    """
    a, m, J, f = body.ball.radius, body.ball.mass, body.ball.inertia, body.contact.rolling_resistance
    e1 = body.surface.normal(p_WB)
    e1_rate = body.surface.normal_gradient(p_WB) @ v_WB
    # Unknowns: p̈, ω̇ and the force R of the wall in world components, so the rolling constraint has three rows:
    #   p̈ + a ω̇ × e1 = -a ω × ė1 along the tangents,  e1 · p̈ = -ė1 · v along the normal.
    # v + a ω × e1 = 0 holds along the tangents only by rolling, along e1 by the wall: both are one vector equation,
    # since (ω × e1) · e1 = 0. Its derivative is the last block.
    cross_e1 = np.array([[0, -e1[2], e1[1]], [e1[2], 0, -e1[0]], [-e1[1], e1[0], 0]])  # [e1]× y = e1 × y
    matrix = np.zeros((9, 9))
    matrix[:3, :3] = m * np.eye(3)
    matrix[:3, 6:] = -np.eye(3)
    matrix[3:6, 3:6] = J * np.eye(3)
    matrix[3:6, 6:] = -a * cross_e1
    if f:  # the resistance is linear in N, and -N = R · e1: M = f (v/V) × (R·e1) e1
        matrix[3:6, 6:] += np.outer(resistance_moment(f, 1.0, e1, v_WB), e1)
    matrix[6:, :3] = np.eye(3)
    matrix[6:, 3:6] = -a * cross_e1
    right = np.concatenate([m * body.gravity, np.zeros(3), -a * cross(w_WB, e1_rate)])
    solution = np.linalg.solve(matrix, right)
    return solution[:3], solution[3:6], solution[6:]
