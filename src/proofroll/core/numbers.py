"""The numbers of a scene file, for those who read its tables: ``"$name"`` is the value of a parameter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from proofroll.core.errors import InputError, require_known


@dataclass(frozen=True)
class Numbers:
    """The parameters of a scene.

    Attributes:
        values: parameter -> number, SI units.
        units: parameter -> its unit.
    """

    values: Mapping[str, float]
    units: Mapping[str, str]

    def filled(self, content: Any, where: str, units: Mapping[str, str], unit: str = "") -> Any:
        """The content of a table with each ``$name`` replaced by its number, which must have the unit of its place.

        ``units`` are those of numbers by their keys, ``unit`` is that of the content itself, if it is a number.

        Raises:
            InputError: no such parameter, another unit, or a truth value instead of a number.
        """
        if isinstance(content, dict):
            return {
                key: self.filled(value, f"{where}.{key}", units, units.get(key, "")) for key, value in content.items()
            }
        if isinstance(content, list):
            return [self.filled(value, f"{where}.{index}", units, unit) for index, value in enumerate(content)]
        if isinstance(content, bool):
            raise InputError(where, content, "this is not a number; give one" + (f" in {unit}" if unit else ""))
        if isinstance(content, str) and content.startswith("$"):
            require_known(where, content[1:], self.values, "there is no such parameter; choose from", content)
            given = self.units[content[1:]]
            if unit and given != unit:
                raise InputError(where, content, f"this number is in {unit}, that parameter in {given}")
            return self.values[content[1:]]
        return content
