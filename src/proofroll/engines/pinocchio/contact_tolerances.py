"""What the formulation ``contact`` softens, and by how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from proofroll.core.engine import Regularised
from proofroll.elements.ball_on_surface.mechanics import (
    initial_angular_acceleration,
    initial_response,
    natural_acceleration,
    newton_euler,
)
from proofroll.elements.ball_on_surface.model import RollingBall

# Errors that the solver's tolerance and round-off explain, over what was measured at most on either scene.
_MARGIN = 10.0


def softened(
    body: RollingBall, *, bends: bool, dt: float, impulse: float, unbounded: float | None
) -> dict[str, Regularised]:
    """What :attr:`proofroll.core.engine.Built.regularised` holds.

    Args:
        body: as the scene has it.
        bends: whether the solver is told how the wall bends during a step.
        dt: step [s].
        impulse: error of the velocity of the contact point that the solver leaves [m/s]; 0 if it is round-off.
        unbounded: the number that stands for unbounded friction [-]; None if friction is bounded.
    """
    natural = natural_acceleration(body)
    # Velocities are wrong by what the solver leaves and by the round-off of the position over a step.
    size = body.ball.radius + float(np.linalg.norm(body.p0))
    velocity = impulse + float(np.finfo(float).eps) * size / dt
    rough = _MARGIN * velocity / (dt * natural)
    reasons = ["round-off of the position, divided by the square of the step, is acceleration"]
    if impulse:
        reasons.append("impulses are found to solver_tolerance")
    missing = dict.fromkeys(("acceleration", "angular acceleration", "N", "F2", "F3"), 0.0)
    if not bends:
        missing = {name: value / natural for name, value in _missing_bend(body).items()}
        if max(missing.values()) > rough:
            reasons.append("for the length of a step the wall is a plane, and at time 0 it does not yet bend the path")
    if slip := float(np.linalg.norm(body.slip0)):
        # An impulse opposes the slip at the end of its step, whose direction may have changed by then.
        turned = _MARGIN * dt * float(np.linalg.norm(initial_response(body)[1])) / body.ball.mass / slip
        turned *= (1 + 1 / body.ball.inertia_ratio) * min(body.contact.mu_kinetic, 1.0)
        missing = {name: value + turned for name, value in missing.items()}
        reasons.append("an impulse opposes the slip at its end, which turns")
    because = "; ".join(reasons)
    result = {name: Regularised(value + rough, because) for name, value in missing.items()}
    if unbounded is not None:
        because = f"the friction cone of Pinocchio's solver needs a number, here {unbounded:g}"
        result |= {f"1 / {kind} friction": Regularised(1 / unbounded, because) for kind in ("static", "kinetic")}
    return result


def _missing_bend(body: RollingBall) -> dict[str, float]:
    """Accelerations [m/s²], angular times the radius and forces over the mass, that the bend of the wall makes."""
    acceleration, force = initial_response(body)
    turning = initial_angular_acceleration(body)
    e1 = body.surface.normal(body.p0)
    # In the equations of motion the bend is multiplied by the spin, and nothing else is.
    flat = replace(body, w0=np.zeros(3))
    flat_acceleration, flat_turning, flat_force = body.gravity, np.zeros(3), np.zeros(3)
    # A plane that would have to pull does nothing; round-off is no push.
    if -newton_euler(flat, flat.p0, flat.v0, flat.w0)[2] @ e1 > 1e-9 * float(np.linalg.norm(force)):
        flat_acceleration, flat_force = initial_response(flat)
        flat_turning = initial_angular_acceleration(flat)
    N, F2, F3 = np.abs((force - flat_force) @ body.surface.frame(body.u0)) / body.ball.mass
    return {
        "acceleration": float(np.max(np.abs(acceleration - flat_acceleration))),
        "angular acceleration": float(np.max(np.abs(turning - flat_turning))) * body.ball.radius,
        "N": float(N),
        "F2": float(F2),
        "F3": float(F3),
    }
