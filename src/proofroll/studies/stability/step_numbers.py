"""Dimensionless numbers of a step, and the one that explains a boundary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from proofroll.core.dataset import part
from proofroll.core.element import StepNumber
from proofroll.core.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

# Name of the step divided by the natural time, a number that every scene has; it explains nothing.
OSCILLATION = "oscillation"
# A number explains boundaries if it varies by at most this factor among them along an axis.
_EXPLAINS = 2.0
# Fewest boundaries that allow an explanation.
_ENOUGH = 3


def step_numbers(scene: Scene, h: float = 1.0, truth: xr.Dataset | None = None) -> list[StepNumber]:
    """Dimensionless numbers of a step ``h`` [s], of all elements."""
    numbers = []
    for element in scene.elements:
        true_part = None if truth is None else part(scene, element, truth)
        numbers += [
            StepNumber(scene.label(element, n.name), n.symbol, n.meaning, n.value)
            for n in element.step_numbers(h, true_part)
        ]
    return numbers


def values(scene: Scene, h: float, truth: xr.Dataset | None = None) -> dict[str, float]:
    """Dimensionless number of a step -> its value; numbers that are zero or unknown are left out."""
    numbers = {number.name: number.value for number in step_numbers(scene, h, truth) if number.value}
    return numbers | {OSCILLATION: h / scene.natural_time}


@dataclass(frozen=True)
class Explanation:
    """Dimensionless number that varies least among the boundaries along an axis.

    Attributes:
        number: its name.
        low, high: its least and largest value.
        spread: largest over least value.
        explains: True if it stays within a factor of two while another number varies by more.
    """

    number: str
    low: float
    high: float
    spread: float
    explains: bool


def explanation(boundaries: Sequence[Mapping[str, float]]) -> Explanation | None:
    """Number that explains the boundaries of one engine along one axis; None: there are too few of them."""
    if len(boundaries) < _ENOUGH:
        return None
    common = [name for name in boundaries[0] if name != OSCILLATION and all(name in item for item in boundaries)]
    spreads = {}
    for name in common:
        values = [item[name] for item in boundaries]
        spreads[name] = max(values) / min(values)
    if not spreads:
        return None
    best = min(spreads, key=lambda name: spreads[name])
    values = [item[best] for item in boundaries]
    tells = spreads[best] <= _EXPLAINS < max(spreads.values())
    return Explanation(number=best, low=min(values), high=max(values), spread=spreads[best], explains=tells)
