"""The text of the programs: what each is about, the engine's part, the numbers to hold it against, and the check."""

from __future__ import annotations

from typing import Any

import numpy as np

from proofroll.elements.ball_on_surface.reproducer_source import ball_numbers, literal
from proofroll.running.case import Case
from proofroll.studies.failure import ACCURATE, BACKWARDS, GAIN, SLIPPED, WRONG
from proofroll.studies.stability_places import Place

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
BODY = SCENE.rolling


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


def through_proofroll(case: Case, place: Place) -> str:
    """An engine's part that asks proofroll to run it, where what fails is, in part or as a whole, proofroll's."""
    assert place.scene is not None  # a point has one
    head = "import numpy as np\nfrom proofroll import load_scene, simulate\n\n"
    numbers = "".join(f"{name} = {literal(value)}\n" for name, value in ball_numbers(place.scene.rolling).items())
    return (
        head
        + numbers
        + _THROUGH.format(
            scene=case.scene, parameters=dict(place.parameters), engine=case.engine.name, settings=case.engine.settings
        )
    )


def needs(engine: str) -> list[str]:
    """What a program imports besides the standard library, by the first lines of the engine's part."""
    head = engine.partition("\n\n")[0]
    return list(dict.fromkeys(line.split()[1].partition(".")[0] for line in head.splitlines()))


def program(place: Place, entry: dict[str, Any], side: dict[str, Any], case: Case, engine: str, boundary: str) -> str:
    """The whole file.

    Args:
        place: of the point.
        entry: the point, as the study has it.
        side: its boundary, likewise.
        case: the run beyond the boundary.
        engine: the engine's part.
        boundary: name of the boundary.
    """
    yardstick, facts = place.yardstick, case.engine
    assert yardstick is not None  # a point has one
    body = yardstick.body
    resolution = str(facts.resolution)
    where = ", ".join(f"{name} = {value:g}" for name, value in entry["parameters"].items()) or "default parameters"
    settings = ", ".join(f"{key}={value}" for key, value in facts.settings.items())
    silent = "The engine does not say so." if side["silent"] else "The engine says so."
    lines = [
        f"{facts.name} {facts.version}: {side['failure']} ({entry['axis']} = {entry['value']:g}).",
        "",
        f"A ball rolls on a wall ({case.scene}, {where}).",
        f"Beyond the largest {resolution} that is {boundary}. {silent}",
        f"Settings: {settings}.",
        f"Needs {' and '.join(needs(engine))} alone. Exit code 1: the failure shows.",
    ]
    if entry["reproducer_note"]:
        lines.insert(-1, f"Why proofroll: {entry['reproducer_note']}.")
    generators = body.surface.generators
    along = None if generators is None else generators[-1]
    true = (
        [] if yardstick.true is None or along is None or along.kind != "translation" else yardstick.true - body.u0[-1]
    )
    numbers = {
        "EVERY": case.every,
        "STEP": facts.settings[resolution],
        "OFF": yardstick.off_surface,
        "KINETIC": yardstick.kinetic,
        "GAIN": GAIN,
        "SLIPPED": SLIPPED,
        "BACKWARDS": BACKWARDS,
        "RANGE": yardstick.scale,
        "ALLOWED": WRONG if boundary == "stable" else ACCURATE,
    }
    head, _, rest = engine.partition("\n\n")
    text = ['"""' + "\n".join(lines) + '\n"""\n', "import sys\n" + head + "\n", rest]
    text.append("\n# What the run is held against.\n")
    text += [f"{name} = {literal(value)}\n" for name, value in numbers.items()]
    text.append(f"SAMPLES = {round(case.until / case.every)}\nFAILURE = {side['failure']!r}\n")
    text.append(f"ALONG = {list(along.axis) if along else [0.0, 0.0, 0.0]!r}\n")
    text.append(f"TRUE = {[float(value) for value in true]!r}  # by two independent routes\n")
    rolls, heading = yardstick.rolls, yardstick.heading
    text.append(f"ROLLS = {[] if rolls is None else [int(value) for value in rolls]!r}\n")
    text.append(f"HEADING = {[] if heading is None else np.round(heading, 4).tolist()!r}\n")
    return "".join(text) + _CHECK
