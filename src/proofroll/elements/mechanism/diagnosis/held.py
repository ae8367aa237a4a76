"""What other models of a mechanism are held against: its certificate, if that differs, and the states of its run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, CLOSES_EXACTLY, Evidence
from proofroll.core.diagnosis.fitting import ABOVE, FACTORS, Residuals, once
from proofroll.core.diagnosis.lines import differing
from proofroll.elements.mechanism.diagnosis.equations import Change, MechanismStates, of_run, of_start

# Equations that the true run leaves more of, relative, tell nothing.
_TELLS = 1e-4
COVERED = ("p_WB", "v_WB", "w_WB", "q_WB", "force", "torque")
# Quantities of the certificate that follow from how the mechanism moves.
_FOLLOWS = {f"{turning}acceleration{when}" for turning in ("", "angular ") for when in ("", " of the first steps")}


@once
def held_against(evidence: Evidence) -> Iterator[Residuals[Change]]:
    """The start by the certificate, if its accelerations differ; the run, if it does not balance as the truth."""
    mechanism = evidence.element.mechanism
    plain = Change(mechanism)
    if _FOLLOWS & {line["quantity"] for line in differing(evidence.lines)}:
        start = of_start(evidence)
        if start is not None:
            left = start.left(plain)
            before = float(np.max(np.abs(left), initial=0.0))
            yield _held(start, "at time 0", before, 1e3 * CLOSES_EXACTLY, len(left) < 2)
    if evidence.run is None or evidence.truth is None:
        return
    seen, true = of_run(mechanism, evidence.run), of_run(mechanism, evidence.truth)
    if seen is None or true is None or not seen.consistent:
        return
    own = np.abs(true.left(plain))
    tells = own < _TELLS  # of a body that spins freely about its axis nothing is left to balance but round-off
    at = np.abs(seen.left(plain))
    if at.shape != own.shape or not tells.any():
        return
    before, floor = float(np.max(at[tells])), float(np.max(own[tells]))
    if np.isfinite(before) and before > ABOVE * floor:
        yield _held(seen, "along the run", before, CLOSES, False, tells)


def _held(
    states: MechanismStates, at: str, before: float, closes: float, alone: bool, tells: Any = slice(None)
) -> Residuals[Change]:
    def left(change: Change | None) -> FloatArray:
        return np.asarray(states.left(change or Change(states.mechanism))[tells])

    quantity = f"balance of the equations of motion {at}, relative,"
    return Residuals(left, quantity, "1", before, closes, ("motion", *COVERED), alone)


def best(held: Residuals[Change], change: Callable[[float], Change]) -> tuple[float, int]:
    """The factor that balances a linear equation, and how many numbers were fitted: none if it is a known one.

    Where there is one equation, any factor would do, and only those that mistakes make are looked at.
    """
    at = held.left(change(1.0))
    slope = held.left(change(2.0)) - at

    def left_by(factor: float) -> float:
        left: FloatArray = at + (factor - 1.0) * slope
        return float(np.max(np.abs(left), initial=0.0))

    known = min(FACTORS, key=left_by)
    if held.alone or left_by(known) <= held.closes * held.before:
        return known, 0
    square = float(slope @ slope)
    return (1.0 - float(slope @ at) / square if square else 1.0), 1
