"""What MuJoCo's soft contact changes at time 0, and by how much at most: the certificate's tolerances."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from proofroll.engine import Regularised
from proofroll.engines.mujoco.friction import corrects
from proofroll.engines.mujoco.settings import (
    PRELOAD,
    MujocoSettings,
    impedance,
    normal_lead,
    time_constant,
    velocity_lag,
)
from proofroll.mechanics import initial_response, newton_euler
from proofroll.scene import RollingBall

_FORCES = ("acceleration", "N", "F2", "F3")
# The bounds below are asymptotic in depth/a, and MuJoCo's Newton solver stops at a relative 1e-8.
_MARGIN = 1.1
_SOLVER = 1e-8
# What is left where a state at time 0 is the last of a sequence that converges.
_SEQUENCE = 1e-6


def softness(body: RollingBall, settings: MujocoSettings) -> Mapping[str, Regularised]:
    """Names of certificate quantities with tolerance and reason."""
    a, r = body.ball.radius, body.ball.inertia_ratio
    e1_rate = body.surface.normal_gradient(body.p0) @ body.v0
    bend = abs(float(e1_rate @ body.v0))
    load = bend + float(np.linalg.norm(body.gravity))
    least, most = impedance(settings)
    response = initial_response(body)[0]
    scale = float(np.linalg.norm(response)) or 1.0
    lacks = settings.formulation != "chart" and not settings.curvature
    # What is missing along the normal at depth zero: the share 1 - d of the load, which the impedance leaves, and the
    # bend of the path where J̇v is missing. Along the wall it is a ω × ė1, divided between motion and friction.
    ahead = 2 * normal_lead(settings) * abs(float(e1_rate @ response))  # how the bend changes until it is needed
    pressed = PRELOAD if corrects(body.contact, settings) else 0.0
    missing = (1 - least + pressed) * load + ahead + (bend if lacks else 0.0)
    turning = np.cross(body.surface.normal(body.p0), np.cross(body.w0, e1_rate))  # its part along the wall, turned
    creep = a * float(np.linalg.norm(turning)) * r / (1 + r) if lacks else 0.0
    why = "the impedance of a soft contact is below 1" + (" and its rows lack J̇v" if lacks else "")
    result = dict(_computed(body, settings))
    if settings.start == "touching":
        unloaded = f"{why}; at depth zero, where the ball starts, no depth makes up for it, nor holds the friction"
        free_fall = float(np.linalg.norm(body.gravity))
        return result | dict.fromkeys(_FORCES, Regularised(_MARGIN * (missing + creep + free_fall) / scale, unloaded))
    # A settled start has the depth at which the reference acceleration k depth, k = 1 / (dmax tc)², supplies it.
    depth = _MARGIN * missing * (most * time_constant(settings)) ** 2 / least / a
    sunk = f"a soft contact carries the load only at a depth, {depth:.1e} of the radius at most"
    rolls = "MuJoCo's contact point, at which it rolls, lies midway in that depth"
    # The depth shortens the lever of friction, which balances gravity along the wall.
    lever = depth * float(np.linalg.norm(body.gravity))
    law = _MARGIN * _law_of_friction(body, settings)
    if law:
        why += "; as the ball slips from the start, MuJoCo's cone of friction lifts it or turns its friction"
    soft = (2 * (1 - least) * load + lever + _MARGIN * creep + law) / scale + _SOLVER
    return result | {
        "position": Regularised(depth, sunk),
        "gap": Regularised(depth, sunk),
        "spin": Regularised(depth / 2 + _SOLVER, rolls),
        "slip": Regularised(depth / 2, rolls),
        **dict.fromkeys(_FORCES, Regularised(soft, why)),
    }


def _computed(body: RollingBall, settings: MujocoSettings) -> Iterator[tuple[str, Regularised]]:
    """What is exact but for the solver, because forces enter it."""
    if body.contact.rolling_resistance:
        yield "rolling resistance", Regularised(_SOLVER, "its torque uses the normal force of the evaluation before")
    if velocity_lag(settings):
        # With the correction of a slip, that acceleration is the last of a sequence that converges.
        share = _SEQUENCE if corrects(body.contact, settings) else _SOLVER
        yield "velocity", Regularised(share, "it is MuJoCo's of half a step before plus half a step's acceleration")


def _law_of_friction(body: RollingBall, settings: MujocoSettings) -> float:
    """Error of the acceleration at time 0 from MuJoCo's law of friction, at most [m/s²]; 0 for a ball that holds."""
    ball, contact = body.ball, body.contact
    if math.isinf(contact.mu_static):
        return 0.0
    e1 = body.surface.normal(body.p0)
    force = newton_euler(body, body.p0, body.v0, body.w0)[2]
    N = -float(force @ e1)
    needed = float(np.linalg.norm(force + N * e1))
    pyramidal = settings.cone == "pyramidal"
    if needed * (math.sqrt(2) if pyramidal else 1.0) <= contact.mu_static * N:
        return 0.0
    slip_rate = max(needed - contact.mu_kinetic * N, 0.0) * (1 / ball.mass + ball.radius**2 / ball.inertia)
    lift = 0.0 if corrects(contact, settings) else contact.mu_kinetic * slip_rate
    return lift + (contact.mu_kinetic * N / ball.mass if pyramidal else 0.0)
