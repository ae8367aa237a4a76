"""Signals of time: a number, a smooth formula of the time t, or a table with linear interpolation."""

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from simpleeval import InvalidExpression, SimpleEval

from proofroll.core.errors import InputError, no_such_key, require_known
from proofroll.core.expressions import CONSTANTS, LONGEST, evaluated, evaluator
from proofroll.core.expressions import FUNCTIONS as OF_PARAMETERS
from proofroll.core.parameters import Parameters, in_radians
from proofroll.core.quantity import Quantity
from proofroll.elements.mechanism import checks

TIME = "t"
# Smooth functions that a formula may call; other modules map their names to functions of symbols or of compiled code.
FUNCTIONS: Mapping[str, Callable[[Any], Any]] = {
    name: getattr(np, {"asin": "arcsin", "atan": "arctan"}.get(name, name))
    for name in ("sin", "cos", "tan", "asin", "atan", "exp", "log", "sqrt", "tanh")
}


# What evaluates to no number; KeyError: an operator that is not known, such as a comparison.
_NO_NUMBER: tuple[type[Exception], ...] = (InvalidExpression, ArithmeticError, KeyError, SyntaxError, TypeError)
_NO_NUMBER += (ValueError, RecursionError, MemoryError)


def _power(base: Any, power: Any) -> Any:
    return (float(base) if isinstance(base, int) else base) ** power  # integers would grow for hours


@dataclass(frozen=True)
class Formula:
    """A smooth formula of the time ``t`` [s]: numbers, parameters, + - * / ^ ( ), ``pi`` and :data:`FUNCTIONS`.

    Attributes:
        text: the formula, without the sign that opens it in a file.
        numbers: the parameters that it names, and their values.
    """

    text: str
    numbers: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        try:
            value = float(self.at(0.0))
        except _NO_NUMBER:
            value = math.nan
        if len(self.text) > LONGEST or not math.isfinite(value):
            advice = "is no finite number at t = 0; use t, parameters, + - * / ^ ( ), pi and " + ", ".join(FUNCTIONS)
            raise InputError("formula", f"= {self.text}", advice)

    def at(self, time: Any, functions: Mapping[str, Callable[[Any], Any]] = FUNCTIONS) -> Any:
        """Value at a time [s], which may be an array or a symbol; ``functions`` evaluates the calls for that type."""
        names = {"pi": math.pi, **dict(self.numbers), TIME: time}
        with np.errstate(all="ignore"):
            return evaluator(names, functions, _power).eval("", previously_parsed=self._parsed)

    @cached_property
    def _parsed(self) -> Any:
        return SimpleEval.parse(self.text.replace("^", "**").strip())

    def __str__(self) -> str:
        return f"= {self.text}"


@dataclass(frozen=True)
class Table:
    """Values at times, with linear interpolation; constant before the first and after the last time.

    Attributes:
        times: growing [s].
        values: one for each time.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        count = max(len(self.times), 1)
        checks.assign(self, times=checks.numbers("times", self.times, count))
        checks.assign(self, values=checks.numbers("values", self.values, count))
        late = np.flatnonzero(np.diff(self.times) <= 0)
        if len(late):
            advice = "the times of a table grow; sort them, and give each time once"
            raise InputError(f"times.{late[0] + 1}", self.times[late[0] + 1], advice)

    def at(self, time: Any) -> Any:
        """Value at a time [s], or at an array of them."""
        return np.interp(time, self.times, self.values)


Signal = float | Formula | Table


def value_at(signal: Signal, time: Any, functions: Mapping[str, Callable[[Any], Any]] = FUNCTIONS) -> Any:
    """Value of a signal at a time [s]; for a formula the time may be an array or a symbol."""
    if isinstance(signal, Formula):
        return signal.at(time, functions)
    return signal.at(time) if isinstance(signal, Table) else signal


def varies(signal: Signal) -> bool:
    """True if the signal changes in time."""
    return not isinstance(signal, float | int)


def breaks(signals: Sequence[Signal]) -> list[float]:
    """Times at which one of the signals is not smooth [s], sorted."""
    return sorted({time for signal in signals if isinstance(signal, Table) for time in signal.times})


def checked(field: str, given: Any) -> Signal:
    """Signal of a part of a mechanism. Raises InputError if the value is not a signal."""
    return given if isinstance(given, Formula | Table) else checks.number(field, given)


def read_signal(field: str, given: Any, numbers: Parameters, unit: str = "") -> Any:
    """Signal of a file, in this unit; a number or a formula without time is returned unchanged.

    Raises:
        InputError: a formula or a table is wrong, or a formula has another unit.
    """
    try:
        if isinstance(given, str) and given.startswith("=") and TIME not in numbers.values:
            used = _names(given[1:])
            if TIME in used or used - {*CONSTANTS, *OF_PARAMETERS, *numbers.values}:
                for name in sorted(used - {TIME, "pi", *FUNCTIONS}):
                    require_known(
                        field, name, [TIME, *sorted(numbers.values)], "there is no such parameter; choose from"
                    )
                own = tuple((name, float(value)) for name, value in numbers.values.items() if name in used)
                made = Formula(given[1:].strip(), own)
                _check_unit(field, made.text, numbers, unit)
                return made
        if isinstance(given, dict):
            for key in given:
                if key not in {"times", "values"}:
                    raise no_such_key(key, given[key], ("times", "values"))
            axes = {"times": "s", "values": unit}
            filled = {key: numbers.filled(given.get(key, []), key, {}, axes[key]) for key in axes}
            return Table(**filled)
        if isinstance(given, str) and not given.startswith(("=", "$")) and in_radians(field, given, unit) is None:
            raise InputError(
                field, given, "give a number, a formula that begins with =, or a table of times and values"
            )
    except InputError as error:
        inside = "" if error.field in {"formula", field} else f".{error.field}"
        raise InputError(f"{field}{inside}", error.value, error.advice) from None
    return given


def _check_unit(field: str, text: str, numbers: Parameters, unit: str) -> None:
    """Raises InputError if a formula has another unit, with t as seconds or as a plain number."""
    wrong: InputError | None = None
    for time in (Quantity(0.0, {"s": 1.0}), Quantity(0.0)):
        try:
            evaluated(field, text, {**numbers.quantities, TIME: time}, unit, FUNCTIONS)
        except InputError as error:
            wrong = wrong or error
        else:
            return
    if wrong is not None:
        raise wrong


def _names(text: str) -> set[str]:
    """Names in a formula; empty if it cannot be parsed, an error that its evaluation reports."""
    try:
        nodes = ast.walk(ast.parse(text.replace("^", "**").strip(), mode="eval"))
        return {node.id for node in nodes if isinstance(node, ast.Name)}
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return set()
