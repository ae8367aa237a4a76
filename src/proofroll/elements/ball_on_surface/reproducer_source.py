"""Source text that programs of several engines share: numbers, and the wall as plain functions.

They are for :meth:`proofroll.core.engine_abilities.Reproduces.reproducer`; what that writes runs without proofroll.
"""

from __future__ import annotations

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.program_text import assigned
from proofroll.elements.ball_on_surface.model import RollingBall


def wall_source(body: RollingBall) -> str:
    """Functions ``frame(p)``, with rows e1, e2, e3, and ``gap(p)`` [m] of the centre p [m], with numpy alone.

    Both follow from the motions that slide the wall along itself: along a translation nothing changes, around a
    rotation the frame turns along.

    Raises:
        Refused: the wall has no such motions, or two rotations, or it moves.
    """
    if body.wall_rate is not None:
        raise Refused("programs are written only for walls that stand")
    generators = body.surface.generators
    if generators is None or all(generator.kind == "rotation" for generator in generators):
        raise Refused("programs are written only for walls that a translation slides along themselves")
    rotation = next((generator for generator in generators if generator.kind == "rotation"), None)
    frame = body.surface.frame(body.u0).T
    if rotation is None:
        return (
            assigned(P0=body.p0, FRAME=frame)
            + '''

def frame(p):
    """e1 (into the wall), e2, e3: the wall is flat."""
    return np.array(FRAME)


def gap(p):
    """Distance of the ball from the wall [m], negative where it has sunk in."""
    return float(np.dot(np.subtract(P0, p), FRAME[0]))
'''
        )
    axis = np.asarray(rotation.axis)
    radial = body.p0 - (body.p0 @ axis) * axis
    distance = float(np.linalg.norm(radial))
    around = np.stack([radial / distance, np.cross(axis, radial / distance), axis], axis=-1)
    outward = float(np.sign(radial @ frame[0]))
    return (
        assigned(AXIS=axis, DISTANCE=distance, OUTWARD=outward, COMPONENTS=frame @ around)
        + '''

def frame(p):
    """e1 (into the wall), e2, e3 for a ball at p: they turn with it about AXIS."""
    radial = p - np.dot(p, AXIS) * np.array(AXIS)
    radial = radial / np.linalg.norm(radial)
    return np.array(COMPONENTS) @ np.array([radial, np.cross(AXIS, radial), AXIS])


def gap(p):
    """Distance of the ball from the wall [m], negative where it has sunk in."""
    return OUTWARD * (DISTANCE - float(np.linalg.norm(p - np.dot(p, AXIS) * np.array(AXIS))))
'''
    )


def normal_rate_source(body: RollingBall) -> str:
    """Function ``normal_rate(p, v)``: rate of e1 [1/s] at a ball at p [m] that moves with v [m/s]; needs ``frame``."""
    if all(generator.kind == "translation" for generator in body.surface.generators or ()):
        return '''

def normal_rate(p, v):
    """Rate of e1: the wall is flat."""
    return np.zeros(3)
'''
    return '''

def normal_rate(p, v):
    """Rate of e1 at a ball at p that moves with v: it turns with the ball about AXIS."""
    radial = p - np.dot(p, AXIS) * np.array(AXIS)
    turning = np.dot(np.cross(AXIS, radial), v) / np.dot(radial, radial)
    return turning * np.cross(AXIS, frame(p)[0])
'''


def ball_numbers(body: RollingBall) -> dict[str, float | FloatArray]:
    """The numbers of the ball, by the names that programs use."""
    return {
        "RADIUS": body.ball.radius,
        "MASS": body.ball.mass,
        "INERTIA": body.ball.inertia,
        "GRAVITY": body.gravity,
        "POSITION": body.p0,
        "VELOCITY": body.v0,
        "SPIN": body.w0,
    }
