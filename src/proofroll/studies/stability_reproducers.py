"""Writes a self-contained program for every boundary of a map that shows the failure with the engine alone."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from proofroll.case import Case
from proofroll.reproducing import literal
from proofroll.runner import programs
from proofroll.scene import Capability, Scene
from proofroll.store import write_text
from proofroll.studies.failure import ACCURATE, GAIN, SLIPPED, WRONG, Failure
from proofroll.studies.stability import MapPoint, StabilityMap
from proofroll.workers import Workers

# A run that did not begin, and one that nobody waited for, show nothing.
_NOTHING_TO_SHOW = {
    Failure.REFUSED: "the run was refused before it began",
    Failure.TOO_SLOW: "the run was only too slow for the map",
}

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
    # All of it is wrong: the ball should roll.
    slipped = float(np.sum(EVERY * (slip[1:] + slip[:-1]) / 2))
    print(f"{len(rows)} of {len(times)} samples, step {STEP:g}")
    print(f"off the wall by {gaps.min():.3g} to {gaps.max():.3g} m, allowed: {OFF:.3g} m to either side")
    print(f"energy grew by {100 * gain:.3g} % of the largest kinetic energy, allowed: {100 * GAIN:.3g} %")
    error = 0.0
    if TRUE:
        error = float(np.max(np.abs((p - POSITION) @ np.array(ALONG) - TRUE[: len(rows)])))
        print(f"the last coordinate is wrong by {error:.3g} m, {100 * error / RANGE:.3g} % of its range {RANGE:.3g} m,")
        print(f"allowed: {100 * ALLOWED:.3g} %; way slipped: {slipped:.3g} m")
    if stopped:
        print(stopped)
    shown = {
        "diverged": bool(stopped),
        "solver gave up": bool(stopped),
        "crashed": bool(stopped),
        "left the surface": gaps.max() > OFF or bool(stopped),
        "sank in": gaps.min() < -OFF,
        "energy gain": gain > GAIN,
        "creep": error > ALLOWED * RANGE and slipped >= SLIPPED * ALLOWED * RANGE,
        "lost phase": error > ALLOWED * RANGE,
    }[FAILURE]
    print(f"{FAILURE}: {'shown' if shown else 'not shown'}")
    return 1 if shown else 0


if __name__ == "__main__":
    sys.exit(main())
'''


def write_reproducers(found: StabilityMap, study: dict[str, Any], folder: Path, workers: Workers | None = None) -> None:
    """Puts the path of each program into its point of the study, or why there is none.

    Args:
        found: the map.
        study: the same as :func:`proofroll.studies.stability_content.content` has it; its points are in its order.
        folder: where the programs go.
        workers: idle ones that may be asked.
    """
    wanted: list[tuple[MapPoint, dict[str, Any], dict[str, Any], Case, str]] = []
    for point, entry in zip(found.points, study["points"], strict=True):
        name, side = _shown(entry)
        if side is None or side["failure"] is None:
            continue
        if side["failure"] in _NOTHING_TO_SHOW:
            entry["reproducer_note"] = _NOTHING_TO_SHOW[Failure(side["failure"])]
            continue
        if side["failure"] == Failure.CREEP and Capability.BOUNDED_FRICTION in _scene(point).requires:
            entry["reproducer_note"] = "a program does not know when a ball with bounded friction should not slip"
            continue
        rung = point.ladder.index(side["beyond"])
        wanted.append((point, entry, side, point.cases[rung], name))
    for (point, entry, side, case, name), (program, reason) in zip(
        wanted, programs([item[3] for item in wanted], workers), strict=True
    ):
        if program is None:
            entry["reproducer_note"] = reason
            continue
        path = folder / f"{_file_name(entry)}.py"
        write_text(path, _program(point, entry, side, case, program, name))
        entry["reproducer"] = str(path)


def _scene(point: MapPoint) -> Scene:
    assert point.place.scene is not None  # a point has one
    return point.place.scene


def _shown(entry: dict[str, Any]) -> tuple[str, dict[str, Any] | None]:
    """The boundary that a program can show: that of stability, or else that of accuracy."""
    for name in ("stable", "accurate"):
        side = entry["sides"][name]
        if side["failure"] and side["failure"] not in _NOTHING_TO_SHOW:
            return name, side
    return entry["boundary"], entry["sides"][entry["boundary"]]


def _file_name(entry: dict[str, Any]) -> str:
    settings = entry["settings"]
    words = (entry["engine"], settings.get("formulation"), settings.get("preset"), entry["axis"], f"{entry['value']:g}")
    return re.sub(r"[^\w.+-]+", "_", "-".join(str(word) for word in words if word))


def _program(
    point: MapPoint, entry: dict[str, Any], side: dict[str, Any], case: Case, engine: str, boundary: str
) -> str:
    """The whole file: what it is about, the engine's part, the numbers to hold it against, and the check."""
    yardstick, facts = point.place.yardstick, case.engine
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
        "Needs numpy and this engine alone. Exit code 1: the failure shows.",
    ]
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
    return "".join(text) + _CHECK
