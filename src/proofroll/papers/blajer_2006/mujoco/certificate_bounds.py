"""Certificate tolerances for MuJoCo's soft contact: bounds of its errors at time 0."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from proofroll.core.engine import Regularised
from proofroll.papers.blajer_2006.ball.mechanics import natural_acceleration, newton_euler
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.mujoco.settings import ChartSettings

_FORCES = ("acceleration", "N", "F2", "F3")
_MORE = "friction against turning or rolling, which the scene does not ask for, turns the ball otherwise"
# The bounds below are asymptotic in depth/a, and MuJoCo's Newton solver stops at a relative 1e-8.
_MARGIN = 1.1
_SOLVER = 1e-8
_ROUND_OFF = 1e-12


def softness(body: RollingBall, settings: ChartSettings) -> Mapping[str, Regularised]:
    """Certificate quantity -> its tolerance with the reason."""
    a = body.ball.radius
    bend = abs(float(body.v0 @ body.surface.normal_gradient(body.p0) @ body.v0))
    gravity = float(np.linalg.norm(body.gravity))
    load = bend + gravity
    least, most = settings.impedances
    scale = natural_acceleration(body)
    # Normal acceleration missing at depth zero: the share 1 - d of the load, which the impedance does not carry.
    missing = (1 - least) * load
    why = "the impedance of a soft contact is below 1"
    result = dict(_computed(body, settings))
    if settings.start == "touching":
        # Friction is bounded by the little normal force of a contact at depth zero.
        lost = _law_of_friction(body, settings, least * bend * body.ball.mass)
        why += "; the ball starts at depth zero, where no depth makes up for it"
        if lost:
            why += " and the normal force that remains does not hold the friction"
        soft = _MARGIN * (missing + lost) / scale + _SOLVER
        if soft >= 1:
            why += ": accelerations and forces at time 0 are not checked"
        return result | _dynamics(body, settings, soft, why)
    # At the depth of a settled start, the reference acceleration k depth, k = d / (dmax tc)², of which the impedance
    # turns the part d into acceleration, supplies what is missing.
    depth = _MARGIN * missing * (most * settings.contact_time / least) ** 2 / a
    sunk = f"a soft contact carries the load only at a depth, {depth:.1e} of the radius at most"
    rolls = "MuJoCo's contact point, at which it rolls, lies midway in that depth"
    # The depth shortens the lever of friction, which balances gravity along the wall.
    soft = (2 * (1 - least) * load + depth * gravity) / scale + _SOLVER
    return result | {
        "position": Regularised(depth, sunk),
        "gap": Regularised(depth, sunk),
        "gap in the engine": Regularised(depth, sunk),
        "spin": Regularised(depth / 2 + _SOLVER, rolls),
        "slip": Regularised(depth / 2, rolls),
        **_dynamics(body, settings, soft, why),
    }


def _dynamics(body: RollingBall, settings: ChartSettings, soft: float, why: str) -> dict[str, Regularised]:
    """Tolerances of accelerations and forces; ``soft`` is that of the centre, relative to the natural acceleration.

    An error F of friction changes the acceleration by F/m, and a times the angular acceleration by a² F/J: m a²/J times
    as much. Rolling resistance adds f to the lever a. A contact's own friction against turning and rolling adds moments
    of at most N times the coefficient.
    """
    a = body.ball.radius
    turning = soft * (1 + body.contact.rolling_resistance / a) / body.ball.inertia_ratio
    _, about_normal, rolling = settings.friction_coefficients(1.0)
    if about_normal or rolling:
        # Relative to the natural force, which N does not exceed by more than gravity.
        why += "; " + _MORE
        soft += 2 * rolling / a
        turning += 2 * (about_normal + rolling) / a / body.ball.inertia_ratio
    return dict.fromkeys(_FORCES, Regularised(soft, why)) | {"angular acceleration": Regularised(turning, why)}


def _computed(body: RollingBall, settings: ChartSettings) -> Iterator[tuple[str, Regularised]]:
    """Tolerances of the coefficient that stands for unbounded friction, of rolling resistance and of the velocity."""
    stands = f"MuJoCo has no unbounded friction: a coefficient of {settings.friction:g} stands for it"
    for name in ("1 / static friction", "1 / kinetic friction"):
        yield name, Regularised((1 + _ROUND_OFF) / settings.friction, stands)
    if body.contact.rolling_resistance:
        yield "rolling resistance", Regularised(_SOLVER, "its torque uses the normal force of the evaluation before")


def _law_of_friction(body: RollingBall, settings: ChartSettings, N: float) -> float:
    """Bound of the error of the acceleration at time 0 from MuJoCo's law of friction [m/s²]; 0 if the ball sticks.

    ``N`` is the normal force of a contact at depth zero, which has not its full load yet [N].
    """
    ball, mu = body.ball, settings.friction
    e1 = body.surface.normal(body.p0)
    force = newton_euler(body, body.p0, body.v0, body.w0)[2]
    loaded = -float(force @ e1)
    needed = float(np.linalg.norm(force + loaded * e1))
    if needed > mu * loaded:
        return 0.0  # a ball that slips under its full load shows a coefficient that is too small, not softness
    pyramidal = settings.cone == "pyramidal"
    if needed * (math.sqrt(2) if pyramidal else 1.0) <= mu * N:
        return 0.0
    slip_rate = max(needed - mu * N, 0.0) * (1 / ball.mass + ball.radius**2 / ball.inertia)
    # Friction of the unloaded contact is wrong altogether; that of a pyramid also has a wrong direction.
    return mu * slip_rate + (needed + (mu * N if pyramidal else 0.0)) / ball.mass
