"""Impact on the wall: velocity and spin after it, computed in two ways, one for each route of the truth.

Newton's coefficient of restitution e for the normal velocity. Along the wall the contact point's velocity u becomes
-e_t u if friction suffices; otherwise the impulse of friction is μk times the normal one, opposite to u (Walton, in
Particulate Two-Phase Flow, 1993). e_t = 0 stops the contact point, e_t = 1 reverses its velocity (Garwin, Am. J. Phys.
37, 1969).
"""

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall


def by_coefficients(
    body: RollingBall, p: FloatArray, v: FloatArray, w: FloatArray, e: float, e_t: float
) -> tuple[FloatArray, FloatArray]:
    """Velocity [m/s] and spin [rad/s] after an impact at the centre ``p`` [m], from the contact's effective mass."""
    a, m, J, contact = body.ball.radius, body.ball.mass, body.ball.inertia, body.contact
    e1 = body.surface.normal(p)
    approach = float(v @ e1)
    slip = v - approach * e1 + a * np.cross(w, e1)
    press, size = m * (1 + e) * approach, float(np.linalg.norm(slip))
    needed = (1 + e_t) * size / (1 / m + a**2 / J)
    taken = needed if needed <= contact.mu_static * press else contact.mu_kinetic * press
    friction = -taken * slip / size if size else np.zeros(3)
    return v + (friction - press * e1) / m, w + a * np.cross(e1, friction) / J


def by_equations(
    body: RollingBall, p: FloatArray, v: FloatArray, w: FloatArray, e: float, e_t: float
) -> tuple[FloatArray, FloatArray]:
    """Result of :func:`by_coefficients`, from linear equations for velocity, spin and impulse (nine unknowns)."""
    a, m, J, contact = body.ball.radius, body.ball.mass, body.ball.inertia, body.contact
    e1 = body.surface.normal(p)
    cross = np.array([[0, -e1[2], e1[1]], [e1[2], 0, -e1[0]], [-e1[1], e1[0], 0]])
    contact_velocity = v - a * cross @ w  # velocity of the contact point; along e1 it equals that of the centre
    slip = contact_velocity - (contact_velocity @ e1) * e1
    matrix, right = np.zeros((9, 9)), np.zeros(9)
    matrix[:3, :3], matrix[:3, 6:], right[:3] = m * np.eye(3), -np.eye(3), m * v
    matrix[3:6, 3:6], matrix[3:6, 6:], right[3:6] = J * np.eye(3), -a * cross, J * w
    matrix[6:, :3], matrix[6:, 3:6] = np.eye(3), -a * cross
    right[6:] = -e * (contact_velocity @ e1) * e1 - e_t * slip
    solution = np.linalg.solve(matrix, right)
    press, size = -float(solution[6:] @ e1), float(np.linalg.norm(slip))
    if size and np.linalg.norm(solution[6:] + press * e1) > contact.mu_static * press:
        heading = slip / size
        matrix[6:] = 0.0
        matrix[6:, 6:] = np.eye(3) - np.outer(e1 + contact.mu_kinetic * heading, e1)
        matrix[6:, :3] += np.outer(e1, e1)
        right[6:] = -e * (contact_velocity @ e1) * e1
        solution = np.linalg.solve(matrix, right)
    return np.asarray(solution[:3]), np.asarray(solution[3:6])
