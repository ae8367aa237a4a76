"""Other models of an element held against its certificate or its run: what each leaves of a difference."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence
from proofroll.core.diagnosis.fitting import fitted

M = TypeVar("M")
# The true run's own residuals are the measurement's: a difference below so many of them says nothing.
ABOVE = 20.0


@dataclass(frozen=True)
class Held(Generic[M]):
    """What models are held against.

    Attributes:
        left: what a model leaves, as one row of numbers; infinite for None, which is no model.
        quantity, unit: of what it leaves.
        before: largest that the scene's own model leaves.
        closes: part of it that a proof may leave.
        covers: quantities that follow from the model.
        alone: whether there is but one equation, which any one number closes.
    """

    left: Callable[[M | None], FloatArray]
    quantity: str
    unit: str
    before: float
    closes: float
    covers: tuple[str, ...]
    alone: bool = False

    def largest(self, model: M | None) -> float:
        """What a model leaves at most."""
        return float(np.max(np.abs(self.left(model)), initial=0.0))

    def fit(self, model: Callable[[float], M | None], start: float) -> float:
        """The number of a model that leaves least."""
        return fitted(lambda x: self.left(model(x)), start, 1.0)

    def cause(self, name: str, says: str, model: M | None, remedy: str, number: int) -> Cause:
        """That the engine moves by this model."""
        after = self.largest(model)
        return Cause(name, says, self.quantity, self.unit, self.before, after, remedy, number, self.covers, self.closes)


@dataclass(frozen=True)
class AnyGravity:
    """Gravity points another way.

    Attributes:
        held: what models of an element are held against.
        gravity: of an element in the scene [m/s²].
        falling: the model of an element in which gravity is another.
    """

    held: Callable[[Evidence], Iterator[Held[Any]]]
    gravity: Callable[[Any], FloatArray]
    falling: Callable[[Any, FloatArray], Any]
    id: str = "direction of gravity"
    grounds: str = "the equations are linear in gravity: one vector closes them at every state"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        element = evidence.element
        g = self.gravity(element)
        for held in self.held(evidence):
            at = held.left(self.falling(element, g))
            if len(at) <= 3:
                continue
            slopes = [held.left(self.falling(element, g + axis)) - at for axis in np.eye(3)]
            found = g - np.linalg.lstsq(np.stack(slopes, axis=-1), at, rcond=None)[0]
            found = np.where(np.abs(found) < 1e-6 * max(float(np.max(np.abs(found))), 1e-300), 0.0, found)
            says = f"the engine's gravity is ({', '.join(f'{x:.4g}' for x in found)}) m/s^2"
            yield held.cause(self.id, says, self.falling(element, found), "look at the axes of gravity", 3)
