"""Vector formulas of a ball rolling on a surface, valid on every surface and in every regime.

Signs as in Blajer (2006), with the frame of :mod:`ball_on_surface.surfaces`: the contact point is at ``p_WB + a e1``.
Array arguments may carry leading dimensions.
"""

import math

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.contacts.on_wall import resistance_moment as resistance_moment  # noqa: PLC0414 -- public here

# Speed of a ball about to move from rest, relative to that of a fall by one radius: it has a direction and no effect.
_SETTING_OFF = 1e-12
_PULLS = 1e-9  # relative to the whole force: a smaller pull is round-off


def always_pressed(body: RollingBall) -> bool:
    """True if the wall presses the ball at every place and speed, so that nothing can lift it off.

    N / m = e1 · g + v · (∂e1/∂p) v: this holds if no normal points against gravity and the wall is nowhere convex. It
    is checked around the surface's periodic coordinates; along the others the surface is uniform.
    """
    around = [np.zeros(1) if period is None else np.linspace(0, period, 64) for period in body.surface.periods]
    u = body.u0 + np.stack(np.meshgrid(*around), axis=-1).reshape(-1, 2)
    p_WB = body.surface.position(u)
    gravity, bends = body.surface.normal(p_WB) @ body.gravity, np.linalg.eigvalsh(body.surface.normal_gradient(p_WB))
    round_off = 1e-12 * float(np.linalg.norm(body.gravity))
    return bool(
        np.min(gravity) >= -round_off and np.min(bends) >= -1e-12 * max(float(np.max(bends)), 1 / body.ball.radius)
    )


def normal_force(body: RollingBall, p_WB: FloatArray, force: FloatArray) -> FloatArray:
    """Normal force N [N], shape (...), of the wall's force on the ball [N], shape (..., 3)."""
    return np.asarray(-np.sum(force * body.surface.normal(p_WB), axis=-1))


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

    * Rolling: Newton-Euler for the nine unknowns p̈, ω̇, (N, F2, F3) together; the last three equations are the
      constraints differentiated, using the signed distance and its derivatives.
    * Rolling that needs more friction than the bound: the ball begins to slip against it. N is the same, for friction
      along the wall does not change it.
    * At rest: the ball stays if rolling resistance and friction can hold it.
    * Held by nothing but a pull: the ball falls.
    """
    if resistance_undirected(body, body.v0) and can_rest(body, body.p0):
        return np.zeros(3), -body.ball.mass * body.gravity
    acceleration, _, force = newton_euler(body, body.p0, _way(body), body.w0)
    e1 = body.surface.normal(body.p0)
    normal = (force @ e1) * e1
    friction, press = force - normal, -float(force @ e1)
    if press < -_PULLS * float(np.linalg.norm(force)):  # no wall pulls: the ball falls off
        return body.gravity, np.zeros(3)
    press = abs(press)
    needed = float(np.linalg.norm(friction))
    if needed <= body.contact.mu_static * press * (1 + 1e-12):
        return acceleration, force
    force = normal + friction * (body.contact.mu_kinetic * press / needed)
    return force / body.ball.mass + body.gravity, force


def initial_angular_acceleration(body: RollingBall) -> FloatArray:
    """Angular acceleration at time 0 in the world [rad/s²], shape (3,): moments of contact and resistance over J."""
    if resistance_undirected(body, body.v0) and can_rest(body, body.p0):
        return np.zeros(3)
    _, force = initial_response(body)
    e1 = body.surface.normal(body.p0)
    moment = body.ball.radius * cross(e1, force)
    moment += resistance_moment(body.contact.rolling_resistance, -force @ e1, e1, _way(body))
    return np.asarray(moment / body.ball.inertia)


def _way(body: RollingBall) -> FloatArray:
    """Velocity at time 0 [m/s]; for a ball at rest that will not stay, a tiny one along its coming motion."""
    return setting_off(body, body.p0) if resistance_undirected(body, body.v0) else body.v0


def newton_euler(
    body: RollingBall,
    p_WB: FloatArray,
    v_WB: FloatArray,
    w_WB: FloatArray,
    *,
    force: FloatArray | float = 0.0,
    moment: FloatArray | float = 0.0,
    resistance: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """p̈ [m/s²], ω̇ [rad/s²] and the wall's force on the ball [N] while rolling without slip, each shape (3,).

    Unreduced: six equations of motion and three acceleration constraints, in the world frame, with no
    parametrisation of the surface. ``force`` [N] and ``moment`` [N m] are additional loads; ``resistance`` replaces the
    moment of rolling resistance for N = 1 [m].
    """
    a, m, J, f = body.ball.radius, body.ball.mass, body.ball.inertia, body.contact.rolling_resistance
    e1 = body.surface.normal(p_WB)
    e1_rate = body.surface.normal_gradient(p_WB) @ v_WB
    # Unknowns: p̈, ω̇ and the force R of the wall in world components, so the rolling constraint has three rows:
    #   p̈ + a ω̇ × e1 = -a ω × ė1 along the tangents,  e1 · p̈ = -ė1 · v along the normal.
    # v + a ω × e1 = 0 holds along the tangents only by rolling, along e1 by the wall: both are one vector equation,
    # since (ω × e1) · e1 = 0. Its derivative is the last block.
    cross_e1 = np.array([[0, -e1[2], e1[1]], [e1[2], 0, -e1[0]], [-e1[1], e1[0], 0]])  # [e1]× y = e1 × y
    if resistance is None and f:
        resistance = resistance_moment(f, 1.0, e1, v_WB)
    matrix = np.zeros((9, 9))
    matrix[:3, :3] = m * np.eye(3)
    matrix[:3, 6:] = -np.eye(3)
    matrix[3:6, 3:6] = J * np.eye(3)
    matrix[3:6, 6:] = -a * cross_e1
    if resistance is not None:  # it is linear in N, and -N = R · e1: M = f (v/V) × (R·e1) e1
        matrix[3:6, 6:] += np.outer(resistance, e1)
    matrix[6:, :3] = np.eye(3)
    matrix[6:, 3:6] = -a * cross_e1
    right = np.concatenate([m * body.gravity + force, np.zeros(3) + moment, -a * cross(w_WB, e1_rate)])
    solution = np.linalg.solve(matrix, right)
    return solution[:3], solution[3:6], solution[6:]


# Rolling resistance has the direction of the centre's velocity (Blajer 2006, section 2.4), which does not exist at
# rest. There it is a bound, like static friction: a moment of at most f N, which must hold gravity along the wall.


def resistance_undirected(body: RollingBall, v_WB: FloatArray) -> bool:
    """True if there is rolling resistance without a direction, for the centre's velocity ``v_WB`` [m/s] is zero."""
    return body.contact.rolling_resistance > 0 and not np.any(v_WB)


def can_rest(body: RollingBall, p_WB: FloatArray) -> bool:
    """True if friction and resistance can hold a ball whose centre stands still at ``p_WB`` [m]."""
    pull, press = _pull(body, p_WB)
    strength, contact = float(np.linalg.norm(pull)), body.contact
    # Unbounded friction holds even without pressure: inf times 0 would be NaN.
    rubs = strength <= contact.mu_static * press if np.isfinite(contact.mu_static) else True
    return bool(press >= 0 and strength * body.ball.radius <= contact.rolling_resistance * press and rubs)


def setting_off(body: RollingBall, p_WB: FloatArray) -> FloatArray:
    """Negligible velocity down the slope at ``p_WB`` [m], shape (3,) [m/s].

    It gives rolling resistance a direction where a resting ball starts to move, and does not :func:`can_rest`.
    """
    pull, _ = _pull(body, p_WB)
    strength = float(np.linalg.norm(pull))
    return np.asarray(_SETTING_OFF * np.sqrt(body.ball.radius / strength) * pull) if strength else np.zeros(3)


def _pull(body: RollingBall, p_WB: FloatArray) -> tuple[FloatArray, float]:
    """Tangential gravity [m/s²], shape (3,), and the normal force per mass of a ball at rest [m/s²]."""
    e1 = body.surface.normal(p_WB)
    press = float(e1 @ body.gravity)
    return body.gravity - press * e1, press
