"""The parameters of a scene file: numbers, or expressions of parameters that stand before them, within bounds."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from typing import Any

from proofroll.core.errors import InputError
from proofroll.elements.mechanism import checks
from proofroll.elements.mechanism.expressions import substituted

_BOUNDS = {"above": operator.gt, "at_least": operator.ge, "below": operator.lt, "at_most": operator.le}
_KEYS = {"value", "unit", "symbol", "meaning", "source", "nonzero", "integer", *_BOUNDS}


def parameter_values(tables: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, float]:
    """Every parameter's number.

    Args:
        tables: ``[parameters.*]`` of the file: ``value`` and bounds ``above``, ``at_least``, ``below``, ``at_most``
            (numbers, ``$name`` or ``= expression``), ``nonzero`` (why it must not be zero), ``integer`` (whether it
            counts something); ``unit``, ``symbol``, ``meaning``, ``source`` for a person.
        given: what the user sets instead of the file's values.

    Raises:
        InputError: an unknown parameter or key, no number, or a number out of its bounds.
    """
    for name in given:
        if name not in tables:
            known = ", ".join(tables) or "none: the scene has no parameters"
            raise InputError(name, given[name], f"there is no such parameter; choose from {known}")
    values: dict[str, float] = {}
    for name, table in tables.items():
        field = f"parameters.{name}"
        if not isinstance(table, Mapping) or "value" not in table:
            raise InputError(field, table, "give a table with value, unit and meaning")
        for key in table:
            if key not in _KEYS:
                raise InputError(f"{field}.{key}", table[key], "there is no such key here; remove it")
        chosen = given[name] if name in given else substituted(f"{field}.value", table["value"], values)
        values[name] = checks.number(name, chosen)
    for name, table in tables.items():
        _check(name, values[name], table, values)
    return values


def _check(name: str, value: float, table: Mapping[str, Any], values: Mapping[str, float]) -> None:
    unit = "" if table.get("unit", "1") == "1" else f" {table['unit']}"
    meaning = table.get("meaning", name)
    if value == 0 and table.get("nonzero"):
        raise InputError(name, value, f"{table['nonzero']}; give a value other than 0{unit}")
    if table.get("integer") and value != round(value):
        raise InputError(name, value, f"{meaning} must be a whole number")
    for key, holds in _BOUNDS.items():
        if key in table:
            field = f"parameters.{name}.{key}"
            bound = checks.number(field, substituted(field, table[key], values))
            if not holds(value, bound):
                raise InputError(name, value, f"{meaning} must be {key.replace('_', ' ')} {bound:g}{unit}")
