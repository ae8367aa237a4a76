"""Writes the program that shows what Exudyn does without proofroll; of mechanisms see :mod:`mechanism`."""

from __future__ import annotations

import math
from typing import Any

from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import cut_program
from proofroll.engines.exudyn.generic import Generic
from proofroll.engines.exudyn.settings import ExudynSettings

_RUN = '''

def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    model = {model}(BODY, SETTINGS)
    for t in times:
        model.advance(t)
        seen = model.sample()
        yield np.array(seen.p_WB), np.array(seen.v_WB), np.array(seen.w_WB)
'''


def source(model: Any, body: RollingBall, settings: ExudynSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`: the adapter's ``model`` of a ball, cut out.

    Raises:
        Refused: the scene has a term that the program has not.
    """
    if body.flies:
        raise Refused("there is no program with impacts yet")
    if isinstance(model, Generic) and math.isfinite(body.contact.mu_static):
        raise Refused("the loop that switches Exudyn's constraint of rolling off while the ball slips is proofroll's")
    kind = type(model)
    run, never = _RUN.format(model=kind.__name__), {"SwitchedIntegration": "SwitchedIntegration = None"}
    return cut_program(body, settings, [kind], ["advance", "sample"], run, never)
