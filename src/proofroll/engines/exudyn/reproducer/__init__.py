"""Writes the program that shows what Exudyn does without proofroll; of mechanisms see :mod:`mechanism`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import assigned, ball_numbers, wall_source
from proofroll.engines.exudyn.carrier import Carrier
from proofroll.engines.exudyn.contact import SURELY, PenaltyContact
from proofroll.engines.exudyn.friction import slow
from proofroll.engines.exudyn.generic import Generic
from proofroll.engines.exudyn.local_frame import curvature
from proofroll.engines.exudyn.native import exu
from proofroll.engines.exudyn.reproducer.text import (
    BALL,
    BALL_STATE,
    CARRIER,
    CONSISTENT,
    CONTACT,
    GENERIC,
    GENERIC_STATE,
    RESISTANCE,
    ROLLING_DISC,
    RUN,
    SETTINGS,
)
from proofroll.engines.exudyn.rolling_disc import RollingDisc
from proofroll.engines.exudyn.settings import ExudynSettings


def source(model: Any, body: RollingBall, settings: ExudynSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`.

    Args:
        model: of the formulation, at time 0.
        body: the scene's.
        settings: of the adapter.

    Raises:
        Refused: the scene has a term that the program has not.
    """
    wall = wall_source(body)
    if body.flies:
        raise Refused("there is no program with impacts yet")
    generic, resists = isinstance(model, Generic), body.contact.rolling_resistance > 0
    if generic and math.isfinite(body.contact.mu_static):
        raise Refused("the loop that switches Exudyn's constraint of rolling off while the ball slips is proofroll's")
    numbers = ball_numbers(body) | ({} if generic else {"START_SPIN": _start_spin(model)})
    numbers |= {"LEVER": body.contact.rolling_resistance} | ({"SLOW": slow(body)} if resists else {})
    numbers |= {"CURVATURE": curvature(body.surface, body.u0)} if resists and not generic else {}
    numbers |= {"STEP_SIZE": settings.dt, "NEWTON_TOLERANCE": settings.newton_tolerance}
    start = _start(model)
    lines = [
        f"HALVINGS = {settings.halvings or 0}",
        f"NEW_JACOBIAN = {settings.jacobian == 'step'}",
        f"TRAPEZOIDAL = {settings.integrator == 'trapezoidal_index2'}",
        f"SPECTRAL_RADIUS = {settings.spectral_radius!r}",
        f"ACCELERATIONS = {start[0]!r}",
        f"MULTIPLIERS = {start[1]!r}",
        *_numbers(model, body),
    ]
    parts = {Generic: GENERIC, Carrier: CARRIER, RollingDisc: ROLLING_DISC, PenaltyContact: CONTACT}
    return (
        "import exudyn as exu\nimport exudyn.itemInterface as items\nimport numpy as np\n\n"
        + assigned(**numbers)
        + "\n".join(lines)
        + "\n"
        + wall
        + "\nexu.config.printToConsole = False\nmbs = exu.SystemContainer().AddSystem()\n"
        + ("" if generic else BALL + (RESISTANCE if resists else ""))
        + parts[type(model)]
        + SETTINGS
        + CONSISTENT
        + RUN
        + (GENERIC_STATE if generic else BALL_STATE)
    )


def _start_spin(model: Any) -> Any:
    """Angular velocity of the ball in the model [rad/s]; a contact starts with the creep that holds the ball."""
    data, initial = model.system.systemData, exu.ConfigurationType.Initial
    # Rates of the Euler parameters of the first node, a body that is not turned, are half of it.
    return 2 * np.array(data.GetODE2Coordinates_t(initial)[4:7])


def _start(model: Any) -> tuple[list[float], list[float]]:
    """Accelerations and multipliers at time 0, where the adapter gives them; else nothing."""
    if isinstance(model, (PenaltyContact, Generic)):
        return [], []  # Exudyn finds them
    data = model.system.systemData
    initial = data.GetODE2Coordinates_tt(exu.ConfigurationType.Initial)
    return np.array(initial).tolist(), np.array(data.GetAECoordinates()).tolist()


def _numbers(model: Any, body: RollingBall) -> list[str]:
    """Assignments that only one formulation needs."""
    if isinstance(model, (Carrier, Generic)):
        return model.numbers()
    if isinstance(model, PenaltyContact):
        contact = model.system.GetObject(model.contact)
        state = model.system.GetNode(model.data)["initialCoordinates"]
        radii = [float(radius) for radius in contact["spheresRadii"]]
        return [
            f"HOLLOW = {sum(radii) - body.ball.radius!r}",
            f"RADII = {radii!r}",
            f"CONTACT_STATE = {np.array(state).tolist()!r}",
            f"FRICTION = {float(contact['dynamicFriction'])!r}",
            f"ZONE = {float(contact['frictionProportionalZone'])!r}",
            f"BOUNDED = {model.bounded}",
            f"SURELY = {SURELY!r}",
            f"STIFFNESS = {float(contact['contactStiffness'])!r}",
        ]
    return []
