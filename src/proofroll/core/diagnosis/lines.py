"""Certificates under a hypothesis: an engine's report at time 0 compared with the numbers of another model."""

import dataclasses
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.certificate import Line, distinct_texts, worst_numbers
from proofroll.core.diagnosis import Cause, Difference, Evidence, Hypothesis, hypothesis
from proofroll.core.diagnosis.fitting import factor_text

# Most numbers of a line that are shown in a cause; of more only the one that differs most.
_SHOWN = 3
# Relative deviation within which all numbers of a line are the scene's times one factor.
_ALIKE = 1e-9


def differing(lines: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Lines of quantities that the engine reports and that differ from the scene's."""
    return [line for line in lines if not line["holds"] and line["found"] and np.all(np.isfinite(line["found"]))]


def scale_of(line: Mapping[str, Any]) -> float:
    """Scale of a line's difference, in its unit."""
    apart = float(np.max(np.abs(np.subtract(line["found"], line["expected"]))))
    return apart / line["difference"] if apart and line["difference"] else 1.0


def built_otherwise(
    names: Collection[str], covers: tuple[str, ...], places: Collection[str] = (), state: Collection[str] = ()
) -> Hypothesis:
    """Hypothesis: the model was built with other numbers than the scene's, as its certificate shows.

    Args:
        names: quantities that the adapter hands to the engine.
        covers: quantities that follow from them.
        places: part of ``names`` that is another, too, where the start is another.
        state: quantities of the start.
    """

    @hypothesis(
        "built", "the engine's own model, read back, holds other numbers than the scene: its certificate says so"
    )
    def test(evidence: Evidence) -> Iterator[Cause]:
        lines = differing(evidence.lines)
        moved = any(line["quantity"] in state for line in lines)
        wrong = [line for line in lines if line["quantity"] in names and not (moved and line["quantity"] in places)]
        if not wrong or all(_is_single(line) for line in wrong):
            return
        worst = max(wrong, key=lambda line: float(line["difference"]))
        says = f"the engine's model has {' and '.join(_otherwise(line) for line in wrong)}"
        remedy = (
            "give the engine the scene's number, once, in its unit and about the point and axes that the engine takes"
        )
        yield _relative(worst["quantity"], worst["difference"], covers).cause("built", says, 0.0, remedy)

    return test


def _relative(quantity: str, before: float, covers: tuple[str, ...] = ()) -> Difference:
    return Difference(f"at time 0 {quantity}, relative", "1", before, covers)


def _otherwise(line: Mapping[str, Any]) -> str:
    """Text about a wrongly built quantity: both numbers, and their ratio if all its numbers have the same."""
    built, expected = (np.asarray(line[key], dtype=np.float64) for key in ("found", "expected"))
    values = {field.name: line[field.name] for field in dataclasses.fields(Line)}
    text, expected_text = distinct_texts(*worst_numbers(Line(**values), _SHOWN))
    shown = f"{text} instead of {expected_text}{'' if line['unit'] == '1' else ' ' + line['unit']}"
    square = float(expected @ expected) if built.shape == expected.shape else 0.0
    factor = float(built @ expected) / square if square else 0.0
    alike = square > 0 and bool(np.max(np.abs(built - factor * expected)) <= _ALIKE * np.max(np.abs(expected)))
    return f"{line['quantity']} {factor_text(factor)} ({shown})" if alike else f"{line['quantity']} {shown}"


def _is_single(line: Mapping[str, Any]) -> bool:
    """True if the found numbers are the expected ones rounded to float32."""
    return np.array_equal(np.float32(line["expected"]), np.asarray(line["found"])) and any(line["expected"])


def single_precision(lines: Sequence[Mapping[str, Any]]) -> Iterator[Cause]:
    """Cause: the engine computes with 24 bits, as the differing numbers are the expected ones rounded to float32."""
    exact = [line for line in differing(lines) if _is_single(line)]
    if exact:
        difference = max(line["difference"] for line in exact)
        name, says = str(exact[0]["quantity"]), "the engine holds single-precision numbers (float32)"
        remedy = 'compute in double precision, or say precision = "single" in the settings'
        yield _relative(name, difference).cause("float32", says, 0.0, remedy)
