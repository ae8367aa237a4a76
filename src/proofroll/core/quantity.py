"""Numbers with units, to check the units of formulas in scene files."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

# Base unit -> its power, without zeros; rad is a plain ratio.
Powers = Mapping[str, float]
_IN_BASE_UNITS: Mapping[str, Powers] = {
    "1": {},
    "rad": {},
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Hz": {"s": -1},
}
OR = " or "  # between units of which a number may have any
_POWER = re.compile(r"([^^]+)\^(-?\d+)")


class UnitsDiffer(Exception):  # noqa: N818 -- says what is wrong; the reader of the formula makes an error of it
    """A sum of different units or a power that is not a plain number; the text says which."""


@cache
def powers_of(unit: str) -> Powers:
    """Powers of base units in a unit as scene files write it, e.g. ``N m s/rad``; an unknown name is a base unit."""
    powers: Powers = {}
    for index, part in enumerate(unit.split("/")):
        for factor in part.split():
            matched = _POWER.fullmatch(factor)
            name, power = (matched[1], float(matched[2])) if matched else (factor, 1.0)
            powers = _product(powers, _IN_BASE_UNITS.get(name, {name: 1.0}), -power if index else power)
    return powers


def _product(base: Powers, two: Powers, power: float) -> Powers:
    """Powers of base units of the product of one unit and a power of another."""
    powers = {name: base.get(name, 0.0) + power * two.get(name, 0.0) for name in [*base, *two]}
    return {name: value for name, value in sorted(powers.items()) if value}


@dataclass(frozen=True)
class Quantity:
    """A number and its unit.

    Attributes:
        value: in SI units.
        powers: base unit -> power; None: a plain number, which takes the unit of its partner in a sum.
    """

    value: float
    powers: Powers | None = None

    @property
    def unit(self) -> str:
        """The unit in base units as a person writes it; ``1`` for a ratio."""
        powers = self.powers or {}
        over = " ".join(_written(name, power) for name, power in powers.items() if power > 0)
        under = " ".join(_written(name, -power) for name, power in powers.items() if power < 0)
        return (over or "1") + (f"/{under}" if under else "")

    def __add__(self, other: object) -> Quantity:
        return self._sum(other, lambda a, b: a + b)

    def __radd__(self, other: object) -> Quantity:
        return _quantity(other) + self

    def __sub__(self, other: object) -> Quantity:
        return self._sum(other, lambda a, b: a - b)

    def __rsub__(self, other: object) -> Quantity:
        return _quantity(other) - self

    def __mul__(self, other: object) -> Quantity:
        right = _quantity(other)
        return Quantity(self.value * right.value, self._joined(right, 1.0))

    __rmul__ = __mul__

    def __truediv__(self, other: object) -> Quantity:
        right = _quantity(other)
        return Quantity(self.value / right.value, self._joined(right, -1.0))

    def __rtruediv__(self, other: object) -> Quantity:
        return _quantity(other) / self

    def __pow__(self, other: object) -> Quantity:
        power = _quantity(other)
        if power.powers:
            raise UnitsDiffer(f"a power must be a plain number, this one is in {power.unit}")
        raised = float(self.value) ** float(power.value)  # integers would grow for hours before they overflow
        powers = None if self.powers is None else _product({}, self.powers, float(power.value))
        return Quantity(raised, powers)

    def __rpow__(self, other: object) -> Quantity:
        return _quantity(other) ** self

    def __neg__(self) -> Quantity:
        return Quantity(-self.value, self.powers)

    def __pos__(self) -> Quantity:
        return self

    def _sum(self, addend: object, operation: Callable[[float, float], float]) -> Quantity:
        right = _quantity(addend)
        if self.powers is not None and right.powers is not None and self.powers != right.powers:
            raise UnitsDiffer(f"{self.unit} and {right.unit} cannot be added")
        return Quantity(operation(self.value, right.value), right.powers if self.powers is None else self.powers)

    def _joined(self, right: Quantity, sign: float) -> Powers | None:
        if self.powers is None and right.powers is None:
            return None
        return _product(self.powers or {}, right.powers or {}, sign)


def _written(name: str, power: float) -> str:
    return name if power == 1 else f"{name}^{power:g}"


def _quantity(value: object) -> Quantity:
    if isinstance(value, Quantity):
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{value!r} is no number")
    return Quantity(float(value))
