"""Regime of a ball by the first route of the truth, and analytic boundaries between regimes."""

from enum import IntEnum

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.events import EventKind
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.polar import first_route
from proofroll.papers.blajer_2006.truth.switching import follow


class Regime(IntEnum):
    """Regime of a ball over a whole run."""

    NEVER_SLIPS = 0
    RECOVERS = 1  # slips, and sticks at the end or could still carry its weight by friction
    FALLS = 2  # slips at the end with too little friction to carry its weight


def classify(body: RollingBall, until: float) -> tuple[Regime, int, float]:
    """Regime of the ball until ``until`` [s], the number of its slips, and the time of the first [s] (nan: never).

    Raises:
        Refused: the motion is not known so far.
    """
    route = first_route(body)
    path = follow(body, route, until)
    slips = [time for kind, time in path.events if kind == EventKind.SLIP]
    first_slip = slips[0] if slips else float("nan")
    last = path.stretches[-1]
    if not slips and not path.ended:
        return Regime.NEVER_SLIPS, 0, first_slip
    if not (last.sticking or _carries(body, *route.world(last.state)[:2])):
        return Regime.FALLS, len(slips), first_slip  # the wall presses less and less, so what comes does not matter
    if path.ended:
        raise Refused(path.ended)
    return Regime.RECOVERS, len(slips), first_slip


def _carries(body: RollingBall, p_WB: FloatArray, v_WB: FloatArray) -> bool:
    """True if friction, pointing straight up along the surface, could carry the weight."""
    weight = np.linalg.norm(body.gravity)
    return bool(body.contact.mu_kinetic * (v_WB @ body.surface.normal_gradient(p_WB) @ v_WB) >= weight)


def analytic_boundaries(body: RollingBall, speeds: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Bounds on μ for each initial speed: below the first the ball falls, above the second it never slips.

    The closed form holds for a level start and no spin about the normal; it leaves out rolling resistance. The friction
    needed is m g (1 - cos νt / (1 + κ)) with κ = J/ma²: at most 12/7 of the weight of a homogeneous ball.

    Args:
        body: the ball.
        speeds: initial speeds [m/s], shape (n,).

    Returns:
        Two arrays of shape (n,); None: there is no closed form.
    """
    surface = body.surface
    e1, gravity = surface.normal(body.p0), float(np.linalg.norm(body.gravity))
    if abs(body.v0 @ np.asarray(surface.axis)) > 0 or abs(body.w0 @ e1) > 0:
        return None
    kappa = body.ball.inertia_ratio
    falls = gravity * surface.radius / speeds**2
    return falls, falls * (2 + kappa) / (1 + kappa)
