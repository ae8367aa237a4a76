"""Start of a ball in sentences for the author of the scene."""

from collections.abc import Sequence

import numpy as np

from proofroll.core.number_format import vector
from proofroll.elements.ball_on_surface.mechanics import initial_response, normal_force
from proofroll.elements.ball_on_surface.model import RollingBall


def start_facts(body: RollingBall) -> Sequence[str]:
    """Sentences on centre, velocity, normal force, and whether the ball rolls, slips, rests or leaves at once."""
    named = zip(body.wall.coordinates, body.u0.tolist(), body.wall.units, strict=True)
    at = ", ".join(f"{name} = {value:.4g}{'' if unit == '1' else f' {unit}'}" for name, value, unit in named)
    said = [
        f"{body.ball.name}: centre at {vector(body.p0)} m in the world ({at}), velocity {vector(body.v0)} m/s, "
        f"spin {vector(body.w0)} rad/s"
    ]
    if body.gap0:
        return [*said, f"it starts {body.gap0:.4g} m above the {body.wall.kind} and falls"]
    _, force = initial_response(body)
    press = float(normal_force(body, body.p0, force))
    if not np.any(force):
        return [*said, f"it leaves the {body.wall.kind} at once: nothing presses it on"]
    slip = float(np.linalg.norm(body.slip0))
    moves = f"it slips at {slip:.4g} m/s" if slip else "it rolls" if np.any(body.v0) else "its centre is at rest"
    return [*said, f"{moves}; the {body.wall.kind} presses it with {press:.4g} N"]
