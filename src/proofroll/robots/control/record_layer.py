"""Layer of a record of a robot under a controller, with the mistakes that explain it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class LayerCause:
    """Mistake that explains a layer: its name, a sentence, its size (None: it has none), and the residual with it."""

    id: str
    sentence: str
    size: float | None
    after: float


@dataclass(frozen=True)
class Layer:
    """A layer of a record.

    Attributes:
        name: of :data:`~proofroll.robots.control.bookkeeping.mistakes.LAYERS`.
        residual: largest difference between the record and what the layers before give; None: not looked at.
        bar: residual that the rounding of the record explains.
        column: column with the largest difference in parts of its bar.
        time: of that difference [s].
        reason: reason why it was not looked at, or a remark.
        causes: mistakes that explain it, the best first.
        tried: number of mistakes that were tried, of those that are ``known``.
    """

    name: str
    residual: float | None = None
    bar: float = 0.0
    column: str = ""
    time: float = math.nan
    reason: str = ""
    causes: tuple[LayerCause, ...] = ()
    tried: int = 0
    known: int = 0

    @property
    def holds(self) -> bool:
        """True if the layer was not looked at, or its residual is rounding."""
        return self.residual is None or self.residual <= self.bar
