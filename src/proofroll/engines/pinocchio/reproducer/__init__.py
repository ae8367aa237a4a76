"""Writes the program that shows what Pinocchio does with a ball on a wall, without proofroll: the adapter's steps."""

from __future__ import annotations

import math

from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import cut_program
from proofroll.engines.pinocchio.contact import ContactSteps
from proofroll.engines.pinocchio.rows_run import RowsRun
from proofroll.engines.pinocchio.settings import PinocchioSettings

_SEEN = '''

def seen(model, ball, q, v):
    """Centre, velocity and angular velocity of the ball in the world."""
    data = model.createData()
    pin.forwardKinematics(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    return data.oMi[ball].translation.copy(), velocity.linear.copy(), velocity.angular.copy()


def run(times):
    """Observed quantities at each time."""
'''
_ROWS = """    mechanism = {mechanism}(BODY, bool(SETTINGS.orientation))
    motion = {motion}(mechanism, SETTINGS)
    for t in times:
        motion.advance(t)
        yield seen(mechanism.model, mechanism.ball, motion.q, motion.v)
"""
_CONTACT = """    steps = ContactSteps(BODY, SETTINGS)
    for t in times:
        steps.advance(t)
        # With leapfrog the velocity is half a step ahead: the present one is the mean of two.
        v = (steps.v + steps.kick().v) / 2 if steps.leapfrog and steps.started else steps.v
        yield seen(steps.contact.model, steps.contact.ball, steps.q, v)
"""


def source(body: RollingBall, settings: PinocchioSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`; the settings say whether the orientation is integrated.

    Raises:
        Refused: the scene or the settings have something that the program has not.
    """
    if settings.formulation == "contact":
        return cut_program(body, settings, [ContactSteps], ["advance", "kick"], _SEEN + _CONTACT)
    if math.isfinite(body.contact.mu_static):
        raise Refused("the loop that switches between stick and slip around Pinocchio's terms is proofroll's")
    run = RowsRun(body, settings)
    wanted = type(run.mechanism), type(run.motion)
    mechanism, motion = (kind.__name__ for kind in wanted)
    text = _SEEN + _ROWS.format(mechanism=mechanism, motion=motion)
    return cut_program(body, settings, wanted, ["advance", "orientation"], text)
