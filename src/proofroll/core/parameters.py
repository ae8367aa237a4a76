"""Numbers of a scene file: ``"$name"`` is the value of a parameter, ``"= mass*length^2/12"`` that of a formula."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from proofroll.core.bounds import require_usable
from proofroll.core.errors import InputError, require_known
from proofroll.core.expressions import evaluated
from proofroll.core.quantity import OR, Quantity, powers_of
from proofroll.core.unit_conversion import in_proportion, in_si, is_known

# Unit of a number, or of each number of a list; "": not checked. Several that are allowed are joined by OR.
Unit = str | tuple[str, ...]
# Quantifiers that give nothing back, or a text of n digits without a unit would be read n^2 times.
_MEASURED = re.compile(r"\s*+([-+]?(?:\d++\.?\d*+|\.\d++)(?:[eE][-+]?\d++)?)\s*+([^\W\d_][^=$]*+|°(?:/s)?)\s*+")
_NUMBERED = re.compile(r"\{([^{}]*)\}")


@dataclass(frozen=True)
class Parameters:
    """The parameters of a scene.

    Attributes:
        values: parameter -> number, SI units.
        units: parameter -> its unit.
    """

    values: Mapping[str, float]
    units: Mapping[str, str]

    def filled(self, content: Any, place: str, units: Mapping[str, Unit], unit: Unit = "") -> Any:
        """Content of a table with its parameters and formulas replaced by numbers, each checked for its unit.

        Args:
            content: of a file: ``"$name"`` is a parameter, ``"= ..."`` a formula, ``"30 deg"`` and ``"2 mm"`` numbers
                in another unit, and ``{i}`` in a text a number.
            place: location in the file, for messages.
            units: key -> unit of its number.
            unit: of the content itself, if it is a number or a list of numbers.

        Raises:
            InputError: unknown parameter, wrong unit, invalid formula, or a truth value instead of a number.
        """
        if isinstance(content, dict):
            return {
                key: self.filled(value, f"{place}.{key}", units, units.get(key, "")) for key, value in content.items()
            }
        if isinstance(content, list):
            return [
                self.filled(value, f"{place}.{index}", units, unit_at(unit, index))
                for index, value in enumerate(content)
            ]
        unit_here = unit_at(unit, 0)
        if isinstance(content, str):
            return self._of_text(content, place, unit_here)
        if unit_here and isinstance(content, bool):
            raise _no_number(place, content, unit_here)
        require_usable(place, content)
        return content

    def _of_text(self, text: str, place: str, unit: str) -> Any:
        """Number of a parameter, a formula or a text with a unit; otherwise the text with its numbers filled in."""
        if text.startswith("$"):
            require_known(place, text[1:], self.values, "there is no such parameter; choose from", text)
            asked_unit = self.units.get(text[1:], "")
            if unit and asked_unit and asked_unit not in unit.split(OR):
                raise InputError(place, text, f"this number is in {unit}, that parameter in {asked_unit}")
            return self.values[text[1:]]
        if text.startswith("="):
            value = evaluated(place, text[1:], self.quantities, unit)
            require_usable(place, value)
            return value
        if unit:
            number = measured(place, text, unit)
            if number is None:
                raise _no_number(place, text, unit)
            return number
        return _NUMBERED.sub(lambda index: f"{evaluated(place, index[1], self.quantities):g}", text)

    def beside(self, name: str, value: float) -> Parameters:
        """Parameters extended by one plain number of this name."""
        return Parameters({**self.values, name: value}, self.units)

    @cached_property
    def quantities(self) -> dict[str, Quantity]:
        """Parameters as quantities with units."""
        units = {name: self.units.get(name, "1") for name in self.values}
        return {
            name: Quantity(float(value), None if units[name] == "1" else powers_of(units[name]))
            for name, value in self.values.items()
        }


def _no_number(place: str, content: object, unit: str) -> InputError:
    return InputError(place, content, "this is not a number; give one" + (f" in {unit}" if unit != "1" else ""))


def measured(field: str, text: str, unit: str) -> float | None:
    """Number in the unit of its place of a text with a unit, ``30 deg`` or ``2 mm``; None for other texts.

    Args:
        field: of the text, for messages.
        text: a number and a unit, or anything else.
        unit: of the place; several that are allowed are joined by OR.

    Raises:
        InputError: the number of this place has another unit.
    """
    match = _MEASURED.fullmatch(text)
    if match is None:
        return None
    si, factor = in_si(match[2])
    if si in unit.split(OR):
        return in_proportion(float(match[1]), factor)
    if not is_known(match[2]):
        return None
    raise InputError(field, text, f"this number is in {unit}, and not in {match[2].strip()}")


def unit_at(unit: Unit, index: int) -> str:
    """Unit of one number of a list; "" (not checked) beyond the end of the list of units."""
    if isinstance(unit, str):
        return unit
    return unit[index] if index < len(unit) else ""
