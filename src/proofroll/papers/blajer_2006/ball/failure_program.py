"""Text of programs that show a failure of a ball: the run by proofroll, the reference values, the check."""

import numpy as np

from proofroll.core import program_text
from proofroll.core.program_text import FailedRun, asking, assignment
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall
from proofroll.papers.blajer_2006.ball.failure import (
    BACKWARDS,
    GAIN,
    SLIPPED,
    heading,
    largest_kinetic_energy,
    off_surface,
)

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
