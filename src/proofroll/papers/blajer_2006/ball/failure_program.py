"""Signs of failure of a ball's run, each threshold with its reason, and the text of programs that show one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core import program_text
from proofroll.core.arrays import FloatArray
from proofroll.core.element import Sign
from proofroll.core.program_text import FailedRun, asking, assignment
from proofroll.elements.mechanism.run.contacts.local_frame import creep
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall

if TYPE_CHECKING:
    import xarray as xr

_WALL = '''

def frame(p):
    """e1 (into the wall), e2, e3 for a ball at p."""
    return np.reshape(BODY.surface.frame(BODY.surface.locate(p)).T, (3, 3))


def gap(p):
    """Distance of the ball from the wall [m], negative where it has sunk in."""
    return float(BODY.surface.gap(p))
'''
_SIGNS = '''

def signs(stopped, p, v, w):
    """Which failures the run shows."""
    p, v, w = (np.reshape(values, (-1, 3)) for values in (p, v, w))
    gaps = np.array([gap(x) for x in p])
    energy = 0.5 * MASS * (v**2).sum(1) + 0.5 * INERTIA * (w**2).sum(1) - MASS * p @ np.array(GRAVITY)
    gain = float(np.max(energy - energy[0])) / KINETIC
    slip = np.linalg.norm([b + RADIUS * np.cross(c, frame(a)[0]) for a, b, c in zip(p, v, w)], axis=1)
    slipped = float(np.sum(EVERY * (slip[1:] + slip[:-1]) / 2))
    backwards = -float(np.min((v * HEADING[: len(p)]).sum(1))) if HEADING else 0.0
    print(f"off the wall by {gaps.min():.3g} to {gaps.max():.3g} m, allowed: {OFF:.3g} m to either side")
    print(f"energy grew by {100 * gain:.3g} % of the largest kinetic energy, allowed: {100 * GAIN:.3g} %")
    error = 0.0
    if TRUE:
        error = float(np.max(np.abs((p - POSITION) @ np.array(ALONG) - TRUE[: len(p)])))
        print(f"the last coordinate is wrong by {error:.3g} m, {100 * error / RANGE:.3g} % of its range {RANGE:.3g} m,")
        print(f"allowed: {100 * ALLOWED:.3g} %; way slipped: {slipped:.3g} m")
    if HEADING:
        print(f"speed against the way: {backwards:.3g} m/s, allowed: {BACKWARDS * np.linalg.norm(VELOCITY):.3g} m/s")
    return {
        "left the surface": gaps.max() > OFF or stopped,
        "sank in": gaps.min() < -OFF,
        "energy gain": gain > GAIN,
        "creep": error > ALLOWED * RANGE and slipped >= SLIPPED * ALLOWED * RANGE,
        "reversed": backwards > BACKWARDS * np.linalg.norm(VELOCITY),
        "lost phase": error > ALLOWED * RANGE,
    }
'''


def _run(body: BodyOnWall, failed: FailedRun) -> str:
    """Part of the program that runs the ball by proofroll."""
    head = "import numpy as np\nfrom proofroll import load_scene, simulate\n\n"
    numbers = assignment(
        RADIUS=body.ball.radius,
        MASS=body.ball.mass,
        INERTIA=body.ball.inertia,
        GRAVITY=body.gravity,
        POSITION=body.surface.position(body.u0),
        VELOCITY=body.v0,
    )
    run = asking(failed, "p_WB", "v_WB", "w_WB")
    return f"{head}{numbers}\n{run}\n\nBODY = SCENE.elements[0].on_wall\n{_WALL}"


def program(body: BodyOnWall, failed: FailedRun, engine: str | None) -> str:
    """Text of the program; see :class:`proofroll.core.element_abilities.WritesPrograms`."""
    truth, part = failed.truth, engine if engine is not None else _run(body, failed)
    true: list[float] = []
    if truth is not None:
        true = (truth[body.surface.coordinates[-1]].to_numpy() - body.u0[-1]).tolist()
    resists = truth is not None and body.contact.rolling_resistance > 0
    ways = np.round(heading(body.own(truth, "v_WB")), 4).tolist() if resists and truth is not None else []
    numbers = {
        "OFF": off_surface(body),
        "KINETIC": largest_kinetic_energy(body, truth),
        "GAIN": GAIN,
        "SLIPPED": SLIPPED,
        "BACKWARDS": BACKWARDS,
        "ALONG": body.surface.axis.tolist(),
        "TRUE": true,
        "HEADING": ways,
    }
    return program_text.program(failed, "A ball rolls on a wall", part, numbers, _SIGNS)


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
