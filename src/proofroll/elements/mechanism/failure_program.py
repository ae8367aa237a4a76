"""The text of programs that show a failure of a mechanism: an engine's part, what it is held against, the check."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.failed_run import FailedRun

if TYPE_CHECKING:
    from proofroll.elements.mechanism.element import MechanismElement

_CHECK = '''

def main():
    """Runs the model, prints what is wrong and returns 1 if the failure shows, else 0."""
    times, rows, stopped = [EVERY * number for number in range(SAMPLES + 1)], [], ""
    try:
        for points, energy, drift in run(times):
            if not np.all(np.isfinite([*np.ravel(points), energy, drift])):
                stopped = f"the state is not finite at {times[len(rows)]:g} s, and the engine did not say so"
                break
            rows.append((np.array(points), energy, drift))
    except RuntimeError as error:
        stopped = f"the engine stopped: {error}"
    gain = max(row[1] for row in rows) - rows[0][1]
    drift = max(row[2] for row in rows)
    print(f"{len(rows)} of {len(times)} samples, step {STEP:g}")
    print(f"energy grew by {gain:.3g} J, allowed: {GAIN:.3g} J" if GAIN else "energy is driven or damped")
    print(f"joints or loops opened by {drift:.3g} m, allowed: {OPEN:.3g} m")
    error = 0.0
    if TRUE:
        error = float(np.max(np.abs(np.array([row[0] for row in rows]) - np.array(TRUE)[: len(rows)])))
        print(f"places are wrong by {error:.3g} m, {100 * error / RANGE:.3g} % of their range,")
        print(f"allowed: {100 * ALLOWED:.3g} %")
    if stopped:
        print(stopped)
    shown = {
        "diverged": bool(stopped),
        "solver gave up": bool(stopped),
        "crashed": bool(stopped),
        "energy gain": bool(GAIN) and gain > GAIN,
        "joints opened": drift > OPEN,
        "lost phase": error > ALLOWED * RANGE,
    }[FAILURE]
    print(f"{FAILURE}: {'shown' if shown else 'not shown'}")
    return 1 if shown else 0


if __name__ == "__main__":
    sys.exit(main())
'''

_THROUGH = """import numpy as np
from proofroll import load_scene, simulate

SCENE = load_scene({scene!r}, **{parameters!r})


def run(times):
    \"\"\"Places [m], energy [J] and how far joints are open [m] at each time.\"\"\"
    found = simulate(SCENE, {engine!r}, until=times[-1], every=times[1], **{settings!r})
    yield from zip(*(found[name].to_numpy() for name in ("positions", "energy", "drift")))
    if found.attrs["status"] != "done":
        raise RuntimeError(found.attrs["message"])
"""


def program(element: MechanismElement, failed: FailedRun, engine: str | None, gain: float, opened: float) -> str:
    """The whole file; see :class:`proofroll.core.element_abilities.WritesPrograms`.

    The element may gain energy [J], 0 where it is driven or damped, and its joints and loops may be open so far [m].
    """
    part = engine
    if part is None:
        run = {"scene": failed.scene, "parameters": dict(failed.parameters)}
        part = _THROUGH.format(**run, engine=failed.engine, settings=dict(failed.settings))
    true = [] if failed.truth is None else np.asarray(failed.truth["positions"].to_numpy()).tolist()
    head, _, rest = part.partition("\n\n")
    what = f"A mechanism of {len(element.bodies)} bodies moves"
    numbers = {
        "EVERY": failed.every,
        "STEP": float(failed.settings[failed.resolution]),
        "GAIN": gain,
        "OPEN": opened,
        "RANGE": failed.scale,
        "ALLOWED": failed.allowed,
    }
    text = ['"""' + "\n".join(failed.lines(what, head)) + '\n"""\n', "import sys\n" + head + "\n\n"]
    text += [rest, "\n# What the run is held against; the truth's places by two independent routes.\n"]
    text += [f"{name} = {float(value)!r}\n" for name, value in numbers.items()]
    text.append(f"SAMPLES = {round(failed.until / failed.every)}\nFAILURE = {failed.failure!r}\nTRUE = {true!r}\n")
    return "".join(text) + _CHECK
