"""Text of programs that show a failure of a mechanism: the engine's part, the reference values, the check."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from proofroll.core import program_text
from proofroll.core.program_text import FailedRun, asking

if TYPE_CHECKING:
    from proofroll.elements.mechanism.run.element import MechanismElement

_SIGNS = '''

def signs(stopped, points, energy, drift):
    """Which failures the run shows."""
    gain, drift = float(np.max(energy) - energy[0]), float(np.max(drift))
    print(f"energy grew by {gain:.3g} J, allowed: {GAIN:.3g} J" if GAIN else "energy is driven or damped")
    print(f"joints or loops opened by {drift:.3g} m, allowed: {OPEN:.3g} m")
    error = 0.0
    if TRUE:
        error = float(np.max(np.abs(points - np.array(TRUE)[: len(points)])))
        print(f"places are wrong by {error:.3g} m, {100 * error / RANGE:.3g} % of their range,")
        print(f"allowed: {100 * ALLOWED:.3g} %")
    return {
        "energy gain": bool(GAIN) and gain > GAIN,
        "joints opened": drift > OPEN,
        "lost phase": error > ALLOWED * RANGE,
    }
'''


def program(element: MechanismElement, failed: FailedRun, engine: str | None, gain: float, opened: float) -> str:
    """Text of the program; see :class:`proofroll.core.element_abilities.WritesPrograms`.

    ``gain``: energy that the element may gain [J], 0 where it is driven or damped; ``opened``: distance by which its
    joints and loops may be open [m].
    """
    if engine is None:
        engine = "import numpy as np\nfrom proofroll import load_scene, simulate\n\n"
        engine += asking(failed, "positions", "energy", "drift")
    true: Any = [] if failed.truth is None else failed.truth["positions"].to_numpy()
    what = f"A mechanism of {len(element.bodies)} bodies moves"
    numbers = {"GAIN": gain, "OPEN": opened, "TRUE": true}
    return program_text.program(failed, what, engine, numbers, _SIGNS)
