"""Certificate: the engine's model and its start, read back and compared with the scene before the first step."""

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
# Largest difference allowed to an engine in single precision, in roundings of the quantity's scale.
ROUNDINGS = 64.0
# End of the reason (``because``) of a line whose tolerance was raised to those roundings.
ROUNDED = "single precision"
# What follows the reason of a softening that asks for more than is accepted.
_CAPPED = "; of the "
# A message names the scale of a difference if it exceeds the largest expected number by this factor.
_OTHER = 1.2
SAY_SINGLE = 'settings of the engine must say precision = "single"'
# Numbers of one quantity that fit into a sentence: an inertia has nine.
_SHOWN = 9


class Standing(StrEnum):
    """Result of comparing one quantity of an engine with the scene."""

    HOLDS = "holds"
    DIFFERS = "differs"
    NOT_REPORTED = "not reported"  # the engine is silent, which is allowed and shown


@dataclass(frozen=True)
class Line:
    """One quantity of the certificate.

    Attributes:
        quantity: name of the compared quantity.
        unit: its unit.
        expected: numbers of the scene.
        found: numbers read back from the engine; empty if it does not report them.
        difference: relative to the quantity's scale; None if the engine does not report it.
        tolerance: largest difference that is accepted.
        because: reason for a tolerance above round-off; empty: the tolerance is round-off.
        roundings: allowed round-off, in the engine's machine epsilons times the scale.
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
        """Result of comparing the engine's numbers with the scene's."""
        if self.difference is None:
            return Standing.NOT_REPORTED
        return Standing.HOLDS if self.difference <= self.tolerance else Standing.DIFFERS

    @property
    def holds(self) -> bool:
        """True unless the engine's numbers contradict the scene; a quantity that is not reported holds, too."""
        return self.standing is not Standing.DIFFERS

    def as_dict(self) -> dict[str, Any]:
        """All fields, ``holds`` and ``standing``, for a result."""
        return {**dataclasses.asdict(self), "holds": self.holds, "standing": self.standing.value}


def certify(engine: Any, scene: Scene, settings: Any = None) -> list[Line]:
    """Compares a freshly built engine with the scene: the lines of all its elements.

    Args:
        engine: just built.
        scene: the scene it was built from.
        settings: of the engine that was built; in single precision each line allows its roundings.

    Raises:
        Diverged: a sample, or a field of what was built, has another shape than the scene's bodies.
    """
    built, sample = engine.built(), shaped(scene, engine.sample(), 0.0)
    lines: list[Line] = []
    for element in scene.elements:
        model = built[element.name] if len(scene.elements) > 1 else built
        for line in element.certify(model, sample_of(scene, element, sample)):
            lines.append(_rounded(replace(line, quantity=scene.label(element, line.quantity)), precision_of(settings)))
    return lines


def _rounded(line: Line, precision: str) -> Line:
    """The line, with a tolerance that allows the roundings of a precision below double."""
    room = line.roundings * EPSILON[precision]
    if precision == "double" or room <= line.tolerance:
        return line
    return replace(line, tolerance=room, because="; ".join(filter(None, (line.because, ROUNDED))))


def tolerated(soft: Regularised | None, cap: Regularised | None, tolerance: float, because: str) -> tuple[float, str]:
    """Tolerance of a quantity that an engine may soften, and its reason, at least that without softening.

    Args:
        soft: softening that the engine declares, or None.
        cap: largest softening that is accepted; None: none is.
        tolerance: tolerance without softening.
        because: reason for that tolerance.
    """
    if soft is None or soft.tolerance <= tolerance:
        return tolerance, because
    if cap is None:
        return tolerance, f"cannot be softened, though the engine asks for {number(soft.tolerance)} ({soft.because})"
    if soft.tolerance <= cap.tolerance:
        return soft.tolerance, soft.because
    asked = number(soft.tolerance)
    return cap.tolerance, f"{soft.because}{_CAPPED}{asked} requested this much is allowed: {cap.because}"


def require_shapes(built: Any, shapes: Mapping[str, tuple[tuple[int, ...], ...]]) -> None:
    """Checks type and shape of the numbers in an engine's ``built()`` before they are compared; None is allowed.

    Args:
        built: the engine's account of its model.
        shapes: field -> allowed shapes; -1 is any length.

    Raises:
        Diverged: a field is missing, is not numeric, or has another shape.
    """
    for name, allowed in shapes.items():
        if not hasattr(built, name):
            raise Diverged(f"the engine's built() gave {type(built).__name__}, which has no {name}")
        value = getattr(built, name)
        if value is None:
            continue
        try:
            shape = np.asarray(value, dtype=np.float64).shape
        except (TypeError, ValueError):
            raise Diverged(f"the engine's built() gave {name}, which is no array of numbers") from None
        if not any(
            len(shape) == len(sizes) and all(n in {m, -1} for n, m in zip(sizes, shape, strict=True))
            for sizes in allowed
        ):
            letters = str(allowed[0]).replace("-1", "n")
            raise Diverged(f"the engine's built() gave {name} with shape {shape} instead of {letters}")


def first_difference(lines: list[Line]) -> str | None:
    """One sentence about the first quantity that differs, or None if the certificate holds."""
    for line in lines:
        if line.standing is not Standing.DIFFERS:
            continue
        built, expected = distinct_texts(*worst_numbers(line))
        note = f" (the one of {len(line.found)} numbers that is furthest off)" if len(line.found) > _SHOWN else ""
        refused = f"; {line.quantity} {line.because}" if line.tolerance == EXACT and line.because else ""
        if _CAPPED in line.because:
            refused = f"; {line.because.partition(_CAPPED)[0]}"
        return (
            f"the engine's model differs from the scene: {line.quantity} is {built} instead of "
            f"{expected} {line.unit}{note} (relative difference {number(line.difference)}{_scale(line)}, "
            f"allowed {number(line.tolerance)}){refused}{_single(line)}"
        )
    return None


def not_reported(lines: Iterable[Mapping[str, Any]]) -> list[str]:
    """Quantities of a stored certificate (:meth:`Line.as_dict`) that the engine does not report."""
    return [str(line["quantity"]) for line in lines if line["standing"] == Standing.NOT_REPORTED]


def worst_numbers(line: Line, most: int = _SHOWN) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Found and expected numbers of a line; of more than ``most`` only the pair that differs most."""
    if len(line.found) <= most or len(line.found) != len(line.expected):
        return line.found, line.expected
    apart = np.abs(np.array(line.found) - np.array(line.expected))
    worst = int(np.argmax(np.where(np.isnan(apart), np.inf if line.difference == np.inf else 0.0, apart)))
    return (line.found[worst],), (line.expected[worst],)


def distinct_texts(numbers: tuple[float, ...], expected: tuple[float, ...]) -> tuple[str, str]:
    """Texts of two lists of numbers, with enough digits to differ."""
    for digits in range(6, 18):
        text, expected_text = (", ".join(f"{value:.{digits}g}" for value in values) for values in (numbers, expected))
        if text != expected_text:
            break
    return text, expected_text


def _scale(line: Line) -> str:
    """Clause with the scale of the difference if it is not the size of the shown numbers; otherwise empty."""
    if len(line.found) != len(line.expected) or not line.difference or line.difference == np.inf:
        return ""
    expected = np.array(line.expected)
    scale = float(np.nanmax(np.abs(np.array(line.found) - expected))) / line.difference
    return f" of {number(scale)} {line.unit}" if scale > _OTHER * np.nanmax(np.abs(expected)) else ""


def _single(line: Line) -> str:
    """Note that the engine's numbers are the scene's rounded to single precision; empty if they are not."""
    if len(line.found) != len(line.expected) or line.found == line.expected:
        return ""
    numbers, rounded = np.array(line.found), np.array(line.expected, dtype=np.float32).astype(float)
    if not np.array_equal(numbers, rounded):
        return ""
    return f"; it is the same number in single precision (float32): {SAY_SINGLE}"
