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

# Unit of a number, or of each number of a list; "": not checked. Several that are allowed are joined by OR.
Unit = str | tuple[str, ...]
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

    def filled(self, content: Any, where: str, units: Mapping[str, Unit], unit: Unit = "") -> Any:
        """Content of a table with its parameters and formulas replaced by numbers, each checked for its unit.

        Args:
            content: of a file: ``"$name"`` is a parameter, ``"= ..."`` a formula, ``{i}`` in a text a number.
            where: location in the file, for messages.
            units: key -> unit of its number.
            unit: of the content itself, if it is a number or a list of numbers.

        Raises:
            InputError: unknown parameter, wrong unit, invalid formula, or a truth value instead of a number.
        """
        if isinstance(content, dict):
            return {
                key: self.filled(value, f"{where}.{key}", units, units.get(key, "")) for key, value in content.items()
            }
        if isinstance(content, list):
            return [
                self.filled(value, f"{where}.{index}", units, unit_at(unit, index))
                for index, value in enumerate(content)
            ]
        own = unit_at(unit, 0)
        plain = isinstance(content, str) and not content.startswith(("$", "="))
        if own and (plain or isinstance(content, bool)):
            raise InputError(where, content, "this is not a number; give one" + (f" in {own}" if own != "1" else ""))
        if not isinstance(content, str):
            require_usable(where, content)
            return content
        if content.startswith("$"):
            require_known(where, content[1:], self.values, "there is no such parameter; choose from", content)
            given = self.units.get(content[1:], "")
            if own and given and given not in own.split(OR):
                raise InputError(where, content, f"this number is in {own}, that parameter in {given}")
            return self.values[content[1:]]
        if content.startswith("="):
            value = evaluated(where, content[1:], self.quantities, own)
            require_usable(where, value)
            return value
        return _NUMBERED.sub(lambda index: f"{evaluated(where, index[1], self.quantities):g}", content)

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


def unit_at(unit: Unit, index: int) -> str:
    """Unit of one number of a list; "" (not checked) beyond the end of the list of units."""
    if isinstance(unit, str):
        return unit
    return unit[index] if index < len(unit) else ""
