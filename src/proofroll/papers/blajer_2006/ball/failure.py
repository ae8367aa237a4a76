"""Signs of failure of a run of a ball that rolls in an upright cylinder; each threshold has its reason."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element import Sign
from proofroll.elements.mechanism.run.contacts.local_frame import creep

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall

# Distance from the wall, relative to the radius or to the path's radius of curvature if smaller, that is a failure. The
# lever of friction and the curvature of the path are then wrong by as much, so that nothing is accurate.
OFF_SURFACE = 0.1
# Growth of energy that is a failure, relative to the largest kinetic energy. Nothing in a scene drives the ball, so
# that all growth is the engine's error; runs within 1 % of the path stay far below.
GAIN = 0.1
# Speed against the last heading that is a failure, relative to the initial speed, where rolling resistance must bring
# the ball to rest: a fixed step that ends beyond rest leaves a small reversed speed, which is no motion yet.
BACKWARDS = 0.01
# Slip explains a wrong path if the distance slipped while rolling is at least this part of the error.
SLIPPED = 0.5

LEFT, SANK, ENERGY_GAIN = "left the surface", "sank in", "energy gain"
REVERSED, CREEP = "reversed", "creep"
MEANINGS = {
    LEFT: f"the ball came off the wall by more than {OFF_SURFACE:.0%} of its radius",
    SANK: f"the ball sank into the wall by more than {OFF_SURFACE:.0%} of its radius",
    ENERGY_GAIN: f"the energy grew by more than {GAIN:.0%} of the largest kinetic energy",
    REVERSED: f"rolling resistance drove the ball back, by more than {BACKWARDS:.0%} of the initial speed",
    CREEP: f"the ball slipped while it should roll, which makes {SLIPPED:.0%} of the error or more",
}


def off_surface(body: BodyOnWall) -> float:
    """Largest allowed distance from the wall, to either side [m]."""
    bend = float(np.linalg.norm(body.surface.normal_gradient(body.surface.position(body.u0)), 2))
    return OFF_SURFACE * (min(body.ball.radius, 1 / bend) if bend else body.ball.radius)


def largest_kinetic_energy(body: BodyOnWall, truth: xr.Dataset | None) -> float:
    """Largest kinetic energy of the true run, or without it of the start [J]."""
    m, J = body.ball.mass, body.ball.inertia
    v, w = body.v0[None, :], body.w0[None, :]
    if truth is not None:
        v, w = (np.vstack([at_start, body.own(truth, name)]) for at_start, name in ((v, "v_WB"), (w, "w_WB")))
    return float(np.max(0.5 * m * (v**2).sum(-1) + 0.5 * J * (w**2).sum(-1)))


def signs(body: BodyOnWall, dataset: xr.Dataset, truth: xr.Dataset | None) -> list[Sign]:
    """See :class:`proofroll.core.element.Element`."""
    gap, energy = dataset["gap"].to_numpy(), dataset["energy"].to_numpy()
    allowed = off_surface(body)
    with np.errstate(over="ignore", invalid="ignore"):
        shown = {
            LEFT: gap > allowed,
            SANK: gap < -allowed,
            ENERGY_GAIN: energy - energy[0] > GAIN * largest_kinetic_energy(body, truth),
        }
    if truth is not None and body.contact.rolling_resistance > 0:
        v = body.own(dataset, "v_WB")
        forward_speed = np.sum(v * heading(body.own(truth, "v_WB"))[: len(v)], axis=-1)
        shown[REVERSED] = forward_speed < -BACKWARDS * float(np.linalg.norm(body.v0))
    return [Sign(name, values) for name, values in shown.items()]


def heading(v: FloatArray) -> FloatArray:
    """Directions of velocities, shape (n, 3); below the threshold of speed, the last direction before it."""
    speeds = np.linalg.norm(v, axis=-1)
    moves = speeds > BACKWARDS * speeds[0]
    last = np.maximum.accumulate(np.where(moves, np.arange(len(v)), 0))
    return np.asarray(v[last] / np.where(speeds[last] > 0, speeds[last], 1.0)[:, None])


def cause(body: BodyOnWall, dataset: xr.Dataset, error: float) -> str | None:
    """Creep, if the distance slipped while rolling explains the ``error`` of the last coordinate; else None."""
    return CREEP if creep(dataset) >= SLIPPED * error * body.surface.scales(*body.u0.tolist())[-1] else None
