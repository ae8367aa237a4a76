"""Equivalence first: what the engine really built, held against the scene before anything is stepped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from proofroll.core.dataset import sample_of
from proofroll.core.scene import Scene

# Engines that compute in double precision reproduce the scene's numbers to this relative difference.
EXACT = 1e-12


@dataclass(frozen=True)
class Line:
    """One quantity of the certificate.

    Attributes:
        quantity: what is compared.
        unit: its unit.
        expected, found: from the scene, and read back from the engine.
        difference: relative to the quantity's scale.
        tolerance: largest difference that is accepted.
        because: why the tolerance is not round-off; empty if it is.
    """

    quantity: str
    unit: str
    expected: tuple[float, ...]
    found: tuple[float, ...]
    difference: float
    tolerance: float
    because: str = ""

    @property
    def holds(self) -> bool:
        """Whether the engine built what the scene says."""
        return bool(self.difference <= self.tolerance)


def certify(engine: Any, scene: Scene) -> list[Line]:
    """Compares a freshly built engine with the scene: the lines of all its elements."""
    built, sample = engine.built(), engine.sample()
    lines: list[Line] = []
    for element in scene.elements:
        own = built[element.name] if len(scene.elements) > 1 else built
        for line in element.certify(own, sample_of(scene, element, sample)):
            lines.append(replace(line, quantity=scene.label(element, line.quantity)))
    return lines


def first_difference(lines: list[Line]) -> str | None:
    """One sentence about the first quantity that differs, or None if the certificate holds."""
    for line in lines:
        if not line.holds and all(np.isnan(line.found)):
            return f"the engine's model does not say its {line.quantity}, which the scene requires"
        if not line.holds:
            return (
                f"the engine's model differs from the scene: {line.quantity} is {_shown(line.found)} instead of "
                f"{_shown(line.expected)} {line.unit} (relative difference {line.difference:.2g}, "
                f"allowed {line.tolerance:.2g})"
            )
    return None


def _shown(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:.6g}" for value in values)
