"""Writes the program that shows what Exudyn does without proofroll; of mechanisms see :mod:`mechanism`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.program_text import assigned
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import ball_numbers, wall_source
from proofroll.engines.exudyn.carrier import Carrier
from proofroll.engines.exudyn.contact import PenaltyContact
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
    solver_source,
)
from proofroll.engines.exudyn.rolling_disc import RollingDisc
from proofroll.engines.exudyn.settings import ExudynSettings


def source(model: Any, body: RollingBall, settings: ExudynSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`; from the formulation's ``model`` at time 0.

    Raises:
        Refused: the scene has a term that the program has not.
    """
    wall = wall_source(body)
    if body.flies:
        raise Refused("there is no program with impacts yet")
    generic, resists = isinstance(model, Generic), body.contact.rolling_resistance > 0
    if generic and math.isfinite(body.contact.mu_static):
        raise Refused("the loop that switches Exudyn's constraint of rolling off while the ball slips is proofroll's")
    numbers = ball_numbers(body) | {"LEVER": body.contact.rolling_resistance} | _start(model)
    numbers |= {} if isinstance(model, RollingDisc) else model.numbers()
    if resists:
        numbers |= {"SLOW": slow(body), "CURVATURE": curvature(body.surface, body.u0)}
    parts = {Generic: GENERIC, Carrier: CARRIER, RollingDisc: ROLLING_DISC, PenaltyContact: CONTACT}
    return "".join(
        [
            "import exudyn as exu\nimport exudyn.itemInterface as items\nimport numpy as np\n\n",
            assigned(**numbers),
            wall,
            "\nexu.config.printToConsole = False\nmbs = exu.SystemContainer().AddSystem()\n",
            "" if generic else BALL,
            RESISTANCE if resists and not generic else "",
            parts[type(model)],
            solver_source(settings),
            CONSISTENT,
            RUN,
            GENERIC_STATE if generic else BALL_STATE,
        ]
    )


def _start(model: Any) -> dict[str, Any]:
    """The ball's spin as the model has it; accelerations and multipliers at time 0 where Exudyn does not find them.

    A contact starts with the creep that holds the ball.
    """
    data, initial = model.system.systemData, exu.ConfigurationType.Initial
    numbers: dict[str, Any] = {"ACCELERATIONS": [], "MULTIPLIERS": []}
    if not isinstance(model, Generic):
        # Rates of the Euler parameters of the first node, a body that is not turned, are half of it.
        numbers["START_SPIN"] = 2 * np.array(data.GetODE2Coordinates_t(initial)[4:7])
    if isinstance(model, (Carrier, RollingDisc)):
        numbers["ACCELERATIONS"] = data.GetODE2Coordinates_tt(initial)
        numbers["MULTIPLIERS"] = data.GetAECoordinates()
    return numbers
