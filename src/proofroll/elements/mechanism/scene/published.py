"""Numbers that somebody else published of a mechanism, of an instant or over time: ``[[published]]`` of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError

_OWN = ("source", "time", "times", "within", "parameters")


@dataclass(frozen=True)
class Published:
    """One ``[[published]]`` table.

    Attributes:
        source: author of the numbers, and where they stand.
        times: instants, ascending [s].
        values: name of an observable, as ``q.slide``, -> its value at each instant.
        within: largest error that the numbers are known to have, in the observable's unit; None: a unit of the last
            digit of each.
        parameters: values of the scene's parameters for which they hold; the others have their defaults.
    """

    source: str
    times: tuple[float, ...]
    values: Mapping[str, tuple[float, ...]]
    within: float | None
    parameters: Mapping[str, float]

    def allowed(self, name: str) -> FloatArray:
        """Largest difference of each value of an observable from the true one that its digits allow."""
        if self.within is not None:
            return np.full(len(self.times), self.within)
        return np.array([last_digit(value) for value in self.values[name]])


def last_digit(value: float) -> float:
    """A unit of the last digit of a number as it is written; zeros at its end do not count: 1e-3 for 0.0510."""
    exponent = Decimal(repr(value)).normalize().as_tuple().exponent
    assert isinstance(exponent, int)  # of finite numbers
    return math.pow(10.0, exponent)


def read_published(tables: Any) -> tuple[Published, ...]:
    """All ``[[published]]`` tables of a scene file. Raises InputError if one is wrong."""
    if not isinstance(tables, list):
        raise InputError("published", tables, "give a list of tables, [[published]]")
    return tuple(_read(f"published.{number}", table) for number, table in enumerate(tables))


def _read(field: str, table: Any) -> Published:
    if not isinstance(table, Mapping):
        raise InputError(field, table, "give a table")
    source, within, parameters = table.get("source"), table.get("within"), table.get("parameters", {})
    if not isinstance(source, str) or not source:
        raise InputError(f"{field}.source", source, "say in a text who published the numbers, and where")
    if ("time" in table) == ("times" in table):
        raise InputError(f"{field}.time", table.get("time"), "give time, an instant [s], or times, a list of them")
    single = "time" in table
    times = _numbers(f"{field}.time{'' if single else 's'}", table["time" if single else "times"], single, None)
    if times[0] < 0 or np.any(np.diff(times) <= 0):
        raise InputError(f"{field}.times", list(times), "must ascend from 0 on")
    if within is not None:
        (within,) = _numbers(f"{field}.within", within, True, None)
        if within <= 0:
            raise InputError(f"{field}.within", within, "must be above 0")
    if not isinstance(parameters, Mapping):
        raise InputError(f"{field}.parameters", parameters, "give a table, name = value")
    values = {
        name: _numbers(f"{field}.{name}", value, single, len(times))
        for name, value in table.items()
        if name not in _OWN
    }
    if not values:
        raise InputError(field, "no numbers", 'give values of an observable, as "q.slide" = 0.25')
    return Published(source=source, times=times, values=values, within=within, parameters=dict(parameters))


def _numbers(field: str, value: Any, single: bool, count: int | None) -> tuple[float, ...]:
    """One number, or a list of as many as there are times."""
    numbers = [value] if single else value
    if not isinstance(numbers, list) or not numbers:
        raise InputError(field, value, "give a list of numbers, one for each of times")
    if not all(
        isinstance(item, int | float) and not isinstance(item, bool) and math.isfinite(item) for item in numbers
    ):
        raise InputError(field, value, "give a number" if single else "give numbers")
    if count is not None and len(numbers) != count:
        raise InputError(field, f"{len(numbers)} numbers", f"give {count}, one for each of times")
    return tuple(map(float, numbers))
