"""Equivalence first: what the engine really built, held against the scene before anything is stepped."""

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from proofroll.core.engine import EPSILON, Regularised, precision_of
from proofroll.core.errors import Diverged
from proofroll.core.multi_element import sample_of, shaped
from proofroll.core.number_format import number
from proofroll.core.scene import Scene

# Engines that compute in double precision reproduce the scene's numbers to this relative difference.
EXACT = 1e-12
# What an engine that computes in single precision may lose of a quantity, in roundings of the quantity's scale.
ROUNDINGS = 64.0
# How the reason of a line ends that allows the roundings of such an engine.
ROUNDED = "single precision"
# So many times the largest expected number, the scale of a difference is named.
_OTHER = 1.2
SAY_SINGLE = 'settings of the engine must say precision = "single"'
# Numbers of one quantity that fit into a sentence: an inertia has nine.
_SHOWN = 9


class Standing(StrEnum):
    """Standing of one quantity of an engine against the scene."""

    HOLDS = "holds"
    DIFFERS = "differs"
    NOT_REPORTED = "not reported"  # the engine is silent, which is allowed and shown


@dataclass(frozen=True)
class Line:
    """One quantity of the certificate.

    Attributes:
        quantity: name of the compared quantity.
        unit: its unit.
        expected, found: from the scene, and read back from the engine; nothing is found where the engine is silent.
        difference: relative to the quantity's scale; None where the engine is silent.
        tolerance: largest difference that is accepted.
        because: reason for a tolerance above round-off; empty: it is round-off.
        roundings: roundings of the scale that an honest engine may lose, in whatever precision.
    """

    quantity: str
    unit: str
    expected: tuple[float, ...]
    found: tuple[float, ...]
    difference: float | None
    tolerance: float
    because: str = ""
    roundings: float = ROUNDINGS

    @property
    def standing(self) -> Standing:
        """Standing of the engine's number against the scene's."""
        if self.difference is None:
            return Standing.NOT_REPORTED
        return Standing.HOLDS if self.difference <= self.tolerance else Standing.DIFFERS

    @property
    def holds(self) -> bool:
        """True unless the engine's number contradicts the scene; an engine may be silent (:attr:`standing`)."""
        return self.standing is not Standing.DIFFERS

    def as_dict(self) -> dict[str, Any]:
        """All fields, ``holds`` and ``standing``, for a result."""
        return {**dataclasses.asdict(self), "holds": self.holds, "standing": self.standing.value}


def certify(engine: Any, scene: Scene, settings: Any = None) -> list[Line]:
    """Compares a freshly built engine with the scene: the lines of all its elements.

    ``settings`` are those with which it was built; in single precision each line allows its roundings.

    Raises:
        Diverged: a sample, or a field of what was built, has another shape than the scene's bodies.
    """
    built, sample = engine.built(), shaped(scene, engine.sample(), 0.0)
    lines: list[Line] = []
    for element in scene.elements:
        own = built[element.name] if len(scene.elements) > 1 else built
        for line in element.certify(own, sample_of(scene, element, sample)):
            lines.append(_rounded(replace(line, quantity=scene.label(element, line.quantity)), precision_of(settings)))
    return lines


def _rounded(line: Line, precision: str) -> Line:
    """The line with room for the roundings of a precision less than double."""
    room = line.roundings * EPSILON[precision]
    if precision == "double" or room <= line.tolerance:
        return line
    return replace(line, tolerance=room, because="; ".join(filter(None, (line.because, ROUNDED))))


def tolerated(soft: Regularised | None, cap: Regularised | None, tolerance: float, because: str) -> tuple[float, str]:
    """Tolerance of a quantity and its reason.

    Args:
        soft: softening that the engine declares, or None.
        cap: largest softening that is accepted; None: none is.
        tolerance: of what is not softened.
        because: its reason.
    """
    if soft is None:
        return tolerance, because
    if cap is None:
        return tolerance, f"cannot be softened, though the engine asks for {number(soft.tolerance)} ({soft.because})"
    if soft.tolerance <= cap.tolerance:
        return soft.tolerance, soft.because
    asked = number(soft.tolerance)
    return cap.tolerance, f"{soft.because}; of the {asked} asked for this much is allowed: {cap.because}"


def require_shapes(built: Any, shapes: Mapping[str, tuple[tuple[int, ...], ...]]) -> None:
    """Looks at the numbers that an engine says it built, before they are compared; fields that are None are no matter.

    ``shapes`` are those that a field may have, by its name; -1 is any length.

    Raises:
        Diverged: one is lacking, is not of numbers, or has another shape.
    """
    for name, allowed in shapes.items():
        if not hasattr(built, name):
            raise Diverged(f"the engine's built() gave {type(built).__name__}, which has no {name}")
        given = getattr(built, name)
        if given is None:
            continue
        try:
            shape = np.asarray(given, dtype=np.float64).shape
        except (TypeError, ValueError):
            raise Diverged(f"the engine's built() gave {name} that is no array of numbers") from None
        if not any(
            len(shape) == len(one) and all(n in {m, -1} for n, m in zip(one, shape, strict=True)) for one in allowed
        ):
            wanted = str(allowed[0]).replace("-1", "n")
            raise Diverged(f"the engine's built() gave {name} with shape {shape} instead of {wanted}")


def first_difference(lines: list[Line]) -> str | None:
    """One sentence about the first quantity that differs, or None if the certificate holds."""
    for line in lines:
        if line.standing is not Standing.DIFFERS:
            continue
        if all(np.isnan(line.found)):
            return f"the engine's model does not say its {line.quantity}, which the scene requires"
        built, expected = told_apart(*worst_numbers(line))
        where = f" (the one of {len(line.found)} numbers that is furthest off)" if len(line.found) > _SHOWN else ""
        refused = f"; {line.quantity} {line.because}" if line.tolerance == EXACT and line.because else ""
        return (
            f"the engine's model differs from the scene: {line.quantity} is {built} instead of "
            f"{expected} {line.unit}{where} (relative difference {number(line.difference)}{_scale(line)}, "
            f"allowed {number(line.tolerance)}){refused}{_single(line)}"
        )
    return None


def not_reported(lines: Iterable[Mapping[str, Any]]) -> list[str]:
    """Quantities about which the engine is silent, of a stored certificate (:meth:`Line.as_dict`)."""
    return [str(line["quantity"]) for line in lines if line["standing"] == Standing.NOT_REPORTED]


def worst_numbers(line: Line, most: int = _SHOWN) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Found and expected numbers; of more than ``most`` only those that are furthest from each other."""
    if len(line.found) <= most or len(line.found) != len(line.expected):
        return line.found, line.expected
    apart = np.abs(np.array(line.found) - np.array(line.expected))
    worst = int(np.argmax(np.where(np.isnan(apart), 0.0, apart)))
    return (line.found[worst],), (line.expected[worst],)


def told_apart(found: tuple[float, ...], expected: tuple[float, ...]) -> tuple[str, str]:
    """Texts of two lists of numbers, with enough digits to differ."""
    for digits in range(6, 18):
        one, other = (", ".join(f"{value:.{digits}g}" for value in values) for values in (found, expected))
        if one != other:
            break
    return one, other


def _scale(line: Line) -> str:
    """Clause with the scale of a difference that is not relative to the numbers beside it; empty: it is."""
    if len(line.found) != len(line.expected) or not line.difference:
        return ""
    expected = np.array(line.expected)
    scale = float(np.nanmax(np.abs(np.array(line.found) - expected))) / line.difference
    return f" of {number(scale)} {line.unit}" if scale > _OTHER * np.nanmax(np.abs(expected)) else ""


def _single(line: Line) -> str:
    """Note that built numbers are the scene's rounded to single precision; empty: they are not."""
    if len(line.found) != len(line.expected) or line.found == line.expected:
        return ""
    one, other = np.array(line.found), np.array(line.expected, dtype=np.float32).astype(float)
    if not np.array_equal(one, other):
        return ""
    return f"; it is the same number in single precision (float32): {SAY_SINGLE}"
