"""Parameters of a scene: their declarations in a file, and their values."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from proofroll.core.bounds import require_usable
from proofroll.core.errors import InputError, choices, require_known
from proofroll.core.number_format import spaced
from proofroll.core.parameters import measured

_LONGEST_NAME = 200  # characters


@dataclass(frozen=True)
class Parameter:
    """A number that a user may set by name.

    Attributes:
        value: default, perhaps with another unit, ``"30 deg"`` or ``"2 mm"``, or the name of the parameter that has it.
        unit: of the value, an SI unit.
        symbol: as equations write it.
        meaning: description in one line, used in messages.
        source: origin of the number.
        above, at_least, below, at_most: bounds, as numbers or names of other parameters.
        nonzero: reason for which the value must not be zero.
        unbounded: True if inf is allowed.
        integer: True for a count.
    """

    value: float | str
    unit: str
    meaning: str
    source: str
    symbol: str = ""
    above: float | str | None = None
    at_least: float | str | None = None
    below: float | str | None = None
    at_most: float | str | None = None
    nonzero: str | None = None
    unbounded: bool = False
    integer: bool = False


def units_read(parameters: Mapping[str, Parameter], place: str) -> dict[str, Parameter]:
    """Parameters whose values and bounds with another unit, ``"30 deg"`` or ``"2 mm"``, are in their own.

    Args:
        parameters: as a file declares them.
        place: name of the file, for messages.

    Raises:
        InputError: a number has a unit that is not converted to that of its parameter.
    """
    read = {}
    for name, parameter in parameters.items():
        changes: dict[str, Any] = {}
        for key in ("value", "above", "at_least", "below", "at_most"):
            text = getattr(parameter, key)
            number = (
                measured(f"{place}: parameters.{name}.{key}", text, parameter.unit) if isinstance(text, str) else None
            )
            if number is not None:
                changes[key] = number
        read[name] = replace(parameter, **changes)
    return read


def check_parameters(parameters: Mapping[str, Parameter], units: Iterable[str], path: Path) -> None:
    """Checks the declarations of a scene's parameters, and their defaults.

    Raises:
        InputError: an unknown unit, a reference to an unknown parameter, or a default out of its bounds.
    """
    known_units = dict.fromkeys(units)
    for name, parameter in parameters.items():
        place = f"{path}: parameters.{name}"
        if len(name) > _LONGEST_NAME or not name.isprintable():
            advice = f"a name is one line of at most {_LONGEST_NAME} printable characters"
            raise InputError(f"{path}: parameters", name, advice)
        advice = "this unit is not known; write the value in"
        require_known(f"{place}.unit", parameter.unit, known_units, advice)
        for key in ("value", "above", "at_least", "below", "at_most"):
            end = getattr(parameter, key)
            if not isinstance(end, str):
                continue
            if end == name or end not in parameters:
                suggestions = choices(item for item in parameters if item != name)
                advice = f"no parameter has this name; choose from {suggestions}"
                if end.removeprefix("$") in parameters:
                    advice = "a parameter refers to another one by its name alone, without $, and never to itself"
                raise InputError(f"{place}.{key}", end, advice)
            if parameters[end].unit != parameter.unit:
                advice = f"its unit is {parameters[end].unit}, that of {name} is {parameter.unit}"
                raise InputError(f"{place}.{key}", end, advice)
        _check_end(parameters, name, f"{place}.value")
    try:
        values_of(parameters, {})
    except InputError as error:
        raise InputError(f"{path}: parameters.{error.field}.value", error.value, error.advice) from None


def _check_end(parameters: Mapping[str, Parameter], name: str, place: str) -> None:
    """Raises InputError if defaults that refer to other parameters form a circle."""
    passed = [name]
    while isinstance(following := parameters[passed[-1]].value, str) and following in parameters:
        if following in passed:
            raise InputError(place, " -> ".join([*passed, following]), "parameters refer in a circle; give a number")
        passed.append(following)


def values_of(parameters: Mapping[str, Parameter], set_values: Mapping[str, object]) -> dict[str, float]:
    """Value of every parameter: the given one, the default, or that of the parameter to which the default refers.

    Raises:
        InputError: there is no such parameter, or a value is no number or out of its bounds.
    """
    for name, value in set_values.items():
        require_known(name, name, parameters, "there is no such parameter; choose from", value)
    values: dict[str, float] = {}
    for name, parameter in parameters.items():
        source = name
        while source not in set_values and (following := str(parameters[source].value)) in parameters:
            source = following
        values[name] = _number(name, set_values.get(source, parameters[source].value), parameter)
    # Bounds that are numbers come first, so that a parameter is not blamed for the bad value of another.
    for kind in (float, str):
        for name, parameter in parameters.items():
            _check_bounds(name, parameter, values, kind)
    return values


def _number(name: str, value: object, parameter: Parameter) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InputError(name, value, f"this is not a number; give one in {parameter.unit}")
    try:
        if isinstance(value, str) and "_" in value:  # which Python would ignore
            raise ValueError
        converted = measured(name, value, parameter.unit) if isinstance(value, str) else None
        number = float(value) if converted is None else converted
    except (ValueError, OverflowError):
        raise InputError(name, value, f"this is not a number; give one in {parameter.unit}") from None
    if math.isnan(number) or (math.isinf(number) and not (parameter.unbounded and number > 0)):
        raise InputError(name, value, f"the value must be finite; give a number in {parameter.unit}")
    require_usable(name, number)
    if parameter.integer and number != round(number):
        raise InputError(name, value, f"{parameter.meaning} must be a whole number")
    if parameter.nonzero is not None and number == 0:
        raise InputError(name, value, f"{parameter.nonzero}; give a value other than 0 {parameter.unit}")
    return number


_Bound = tuple[str, float | str | None, Callable[[float, float], bool]]


def _check_bounds(name: str, parameter: Parameter, values: Mapping[str, float], kind: type) -> None:
    value = values[name]
    bounds: tuple[_Bound, ...] = (
        ("above", parameter.above, operator.gt),
        ("at least", parameter.at_least, operator.ge),
        ("below", parameter.below, operator.lt),
        ("at most", parameter.at_most, operator.le),
    )
    for words, bound, holds in bounds:
        if bound is None or not isinstance(bound, kind):
            continue
        limit = values[bound] if isinstance(bound, str) else bound
        if not holds(value, limit):
            shown = f"{bound} = {limit:g}" if isinstance(bound, str) else f"{limit:g}"
            raise InputError(name, value, f"{parameter.meaning} must be {words} {shown}{spaced(parameter.unit)}")
