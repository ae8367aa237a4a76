"""The text of the programs: what each is about, the engine's part, the numbers to hold it against, and the check."""

from __future__ import annotations

import numpy as np

from proofroll.core.failed_run import FailedRun
from proofroll.elements.ball_on_surface.failure import (
    BACKWARDS,
    GAIN,
    SLIPPED,
    heading,
    largest_kinetic_energy,
    off_surface,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import assigned, ball_numbers

_CHECK = '''

def main():
    """Runs the model, prints what is wrong and returns 1 if the failure shows, else 0."""
    times, rows = [EVERY * number for number in range(SAMPLES + 1)], []
    stopped = ""
    try:
        for p, v, w in run(times):
            if not np.all(np.isfinite([*p, *v, *w])):
                stopped = f"the state is not finite at {times[len(rows)]:g} s, and the engine did not say so"
                break
            rows.append((np.array(p), np.array(v), np.array(w)))
    except RuntimeError as error:
        stopped = f"the engine stopped: {error}"
    p, v, w = (np.array([row[index] for row in rows]) for index in range(3))
    gaps = np.array([gap(x) for x in p])
    energy = 0.5 * MASS * (v**2).sum(1) + 0.5 * INERTIA * (w**2).sum(1) - MASS * p @ np.array(GRAVITY)
    gain = float(np.max(energy - energy[0])) / KINETIC
    slip = np.linalg.norm([b + RADIUS * np.cross(c, frame(a)[0]) for a, b, c in rows], axis=1)
    # Where the ball should roll.
    rolls = np.array(ROLLS or [True] * len(times), dtype=bool)[: len(rows)]
    slipped = float(np.sum((rolls[1:] & rolls[:-1]) * EVERY * (slip[1:] + slip[:-1]) / 2))
    backwards = -float(np.min((v * HEADING[: len(rows)]).sum(1))) if HEADING else 0.0
    print(f"{len(rows)} of {len(times)} samples, step {STEP:g}")
    print(f"off the wall by {gaps.min():.3g} to {gaps.max():.3g} m, allowed: {OFF:.3g} m to either side")
    print(f"energy grew by {100 * gain:.3g} % of the largest kinetic energy, allowed: {100 * GAIN:.3g} %")
    error = 0.0
    if TRUE:
        error = float(np.max(np.abs((p - POSITION) @ np.array(ALONG) - TRUE[: len(rows)])))
        print(f"the last coordinate is wrong by {error:.3g} m, {100 * error / RANGE:.3g} % of its range {RANGE:.3g} m,")
        print(f"allowed: {100 * ALLOWED:.3g} %; way slipped: {slipped:.3g} m")
    if HEADING:
        print(f"speed against the way: {backwards:.3g} m/s, allowed: {BACKWARDS * np.linalg.norm(VELOCITY):.3g} m/s")
    if stopped:
        print(stopped)
    shown = {
        "diverged": bool(stopped),
        "solver gave up": bool(stopped),
        "crashed": bool(stopped),
        "left the surface": gaps.max() > OFF or bool(stopped),
        "sank in": gaps.min() < -OFF,
        "energy gain": gain > GAIN,
        "creep": error > ALLOWED * RANGE and (ROLLS or slipped >= SLIPPED * ALLOWED * RANGE),
        "reversed": backwards > BACKWARDS * np.linalg.norm(VELOCITY),
        "lost phase": error > ALLOWED * RANGE,
    }[FAILURE]
    print(f"{FAILURE}: {'shown' if shown else 'not shown'}")
    return 1 if shown else 0


if __name__ == "__main__":
    sys.exit(main())
'''

_THROUGH = """
SCENE = load_scene({scene!r}, **{parameters!r})
BODY = rolling_ball(SCENE)


def frame(p):
    \"\"\"e1 (into the wall), e2, e3 for a ball at p.\"\"\"
    return BODY.surface.frame(BODY.surface.locate(p)).T


def gap(p):
    \"\"\"Distance of the ball from the wall [m], negative where it has sunk in.\"\"\"
    return float(BODY.surface.gap(p))


def run(times):
    \"\"\"Centre, velocity and angular velocity of the ball in the world at each time.\"\"\"
    found = simulate(SCENE, {engine!r}, until=times[-1], every=times[1], **{settings!r})
    yield from zip(*(found[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB")))
    if found.attrs["status"] != "done":
        raise RuntimeError(found.attrs["message"])
"""


def through_proofroll(body: RollingBall, failed: FailedRun) -> str:
    """An engine's part that asks proofroll to run it, where what fails is, in part or as a whole, proofroll's."""
    head = "import numpy as np\nfrom proofroll import load_scene, simulate\n"
    head += "from proofroll.elements.ball_on_surface.element import rolling_ball\n\n"
    run = {"scene": failed.scene, "parameters": dict(failed.parameters)}
    return (
        head
        + assigned(**ball_numbers(body))
        + _THROUGH.format(**run, engine=failed.engine, settings=dict(failed.settings))
    )


def program(body: RollingBall, failed: FailedRun, engine: str | None) -> str:
    """The whole file; see :class:`proofroll.core.element_abilities.WritesPrograms`."""
    truth, part = failed.truth, engine if engine is not None else through_proofroll(body, failed)
    generators = body.surface.generators
    along = None if generators is None else generators[-1]
    true: list[float] = []
    if truth is not None and along is not None and along.kind == "translation":
        true = (truth[body.surface.coordinates[-1]].to_numpy() - body.u0[-1]).tolist()
    rolls = [] if truth is None or "sticking" not in truth else [int(value) for value in truth["sticking"].to_numpy()]
    resists = truth is not None and body.contact.rolling_resistance > 0
    ways = np.round(heading(truth["v_WB"].to_numpy()), 4).tolist() if resists and truth is not None else []
    numbers = {
        "EVERY": failed.every,
        "STEP": float(failed.settings[failed.resolution]),
        "OFF": off_surface(body),
        "KINETIC": largest_kinetic_energy(body, truth),
        "GAIN": GAIN,
        "SLIPPED": SLIPPED,
        "BACKWARDS": BACKWARDS,
        "RANGE": failed.scale,
        "ALLOWED": failed.allowed,
        "SAMPLES": round(failed.until / failed.every),
        "FAILURE": failed.failure,
        "ALONG": list(along.axis) if along else [0.0, 0.0, 0.0],
        "TRUE": true,
        "ROLLS": rolls,
        "HEADING": ways,
    }
    head, _, rest = part.partition("\n\n")
    text = ['"""' + "\n".join(failed.lines("A ball rolls on a wall", head)) + '\n"""\n', "import sys\n" + head + "\n"]
    text += [rest, "\n# What the run is held against; TRUE is what two independent routes say.\n"]
    return "".join(text) + assigned(**numbers) + _CHECK
