"""Text of computed numbers for people: errors, costs, steps.

Numbers that the user gave (parameters, lengths of runs) are written with ``:g`` instead, in commands by :func:`exact`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import ROUND_CEILING, Decimal
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from proofroll.core.arrays import FloatArray

# Significant digits that tell any two numbers apart.
_ALL_DIGITS = 17


def number(value: float | None, digits: int = 2, none: str = "–") -> str:
    """A number in few characters, e.g. ``3.4e-7``; ``none`` if it is missing or not finite."""
    if value is None or not math.isfinite(value):
        return none
    value = float(f"{value:.{digits - 1}e}")  # its form is that of what is written: 0.01 and a hair less are one text
    if 0 < abs(value) < 0.01:  # one form for all small numbers, which makes columns comparable at a glance
        mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
        return f"{mantissa.rstrip('0').rstrip('.') if '.' in mantissa else mantissa}e{int(power)}"
    mantissa, exponent, power = f"{value:.{max(digits, 4)}g}".partition("e")  # 10 and 1200, not 1e1 and 1.2e3
    return f"{mantissa}e{int(power)}" if exponent else mantissa


def exact(value: float) -> str:
    """Text of a number that a person gave, which reads back as the same number: ``2``, ``0.123456789``."""
    text = f"{value:g}"
    return text if float(text) == value else repr(value)


def error(value: float | None, digits: int = 2) -> str:
    """Text of an error; ∞ where it is missing or not finite."""
    return number(value, digits, none="∞")


def with_bar(value: float, bar: float, digits: int = 2) -> tuple[str, str]:
    """Texts of a value and its error bar, between which the whole interval lies: value - bar to value + bar.

    The value is rounded at the first digit of its bar, and to 0 within it. What that changes is added to the bar, which
    is rounded up to ``digits`` digits.
    """
    if not (math.isfinite(value) and math.isfinite(bar)):
        return number(value, 12), error(bar, digits)
    exact, half = Decimal(value), Decimal(bar)
    text = "0"
    if abs(exact) > half:
        places = exact.adjusted() - half.adjusted() + 1 if half else _ALL_DIGITS
        text = f"{value:.{places}g}" if places < _ALL_DIGITS - 1 else repr(value)  # the shortest that tells it apart
    whole = half + abs(Decimal(text) - exact)
    if not whole:
        return text, "0"
    upper = whole.quantize(Decimal(1).scaleb(whole.adjusted() - digits + 1), ROUND_CEILING)
    return text, number(float(upper), digits + 1)


def spaced(unit: str) -> str:
    """Unit to stand behind a number, with a space in front; empty for a ratio."""
    return "" if unit == "1" else f" {unit}"


def vector(values: Sequence[float] | FloatArray) -> str:
    """Text of a vector; components that are round-off of the largest one become zero."""
    numbers = [float(value) for value in values]
    size = max(map(abs, numbers), default=0.0) or 1.0
    return f"({', '.join(f'{round(value / size, 9) * size + 0.0:.4g}' for value in numbers)})"


def counted(count: int, many: str) -> str:
    """A count with its noun; ``many`` is the plural: ``1 velocity``, ``2 velocities``."""
    singular = f"{many.removesuffix('ies')}y" if many.endswith("ies") else many.removesuffix("s")
    return f"{count} {singular if count == 1 else many}"


def be(quantity: str) -> str:
    """The verb of a quantity's name: ``gap is``, ``across is``, ``positions are``."""
    return "are" if quantity.endswith("s") and not quantity.endswith("ss") else "is"
