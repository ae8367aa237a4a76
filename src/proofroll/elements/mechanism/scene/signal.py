"""Signals of time: a number, a formula of the time t, a table, or a value held from one instant to the next."""

import keyword
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from simpleeval import InvalidExpression

from proofroll.core.errors import InputError, no_such_key, require_known
from proofroll.core.expressions import CONSTANTS, evaluated, evaluator, parsed_formula
from proofroll.core.expressions import FUNCTIONS as OF_PARAMETERS
from proofroll.core.parameters import Parameters, measured
from proofroll.core.quantity import Quantity
from proofroll.elements.mechanism.scene import checks
from proofroll.elements.mechanism.scene.kinks import KINKED, functions_of, kinks_in

TIME = "t"
PIECE = "piece of a signal"  # key of a function of a table or held value and a symbol of time
# Smooth functions that a formula may call; other modules map their names to functions of symbols or of compiled code.
SMOOTH: Mapping[str, Callable[..., Any]] = {
    name: getattr(np, {"asin": "arcsin", "atan": "arctan"}.get(name, name))
    for name in ("sin", "cos", "tan", "asin", "atan", "exp", "log", "sqrt", "tanh")
}
FUNCTIONS: Mapping[str, Callable[..., Any]] = {**SMOOTH, **KINKED}
_NAME = re.compile(r"(?<![\w.])[^\W\d]\w*")  # of 1e3 the e is none
_MOST_FACTORS = 16  # powers of symbols up to it are products, which have derivatives where the base is zero


# What evaluates to no number; KeyError: an operator that is not known, such as a comparison.
NO_NUMBER: tuple[type[Exception], ...] = (InvalidExpression, ArithmeticError, KeyError, SyntaxError, TypeError)
NO_NUMBER += (ValueError, RecursionError, MemoryError)


def _power(functions: Mapping[str, Callable[[Any], Any]], base: Any, power: Any) -> Any:
    base = float(base) if isinstance(base, int) else base  # integers would grow for hours
    if not isinstance(base, float | np.ndarray | np.number) and power in range(2, _MOST_FACTORS + 1):
        half = _power(functions, base, power // 2) if power > 3 else base
        return half * half * base if power % 2 else half * half
    if isinstance(power, int | float | np.ndarray | np.number):
        return base**power
    return functions["exp"](power * (math.log(base) if isinstance(base, float) else functions["log"](base)))


def formula_value(parsed: Any, names: Mapping[str, Any], functions: Mapping[str, Callable[[Any], Any]]) -> Any:
    """Value of a parsed formula; names may be numbers, arrays or symbols, which ``functions`` take."""
    with np.errstate(all="ignore"):
        return evaluator({"pi": math.pi, **names}, functions, partial(_power, functions)).eval(
            "", previously_parsed=parsed
        )


@dataclass(frozen=True)
class WrittenFormula:
    """A formula of numbers, parameters, + - * / ^ ( ), ``pi`` and :data:`FUNCTIONS`.

    Attributes:
        text: the formula, without the sign that opens it in a file.
        numbers: the parameters that it names, and their values.
    """

    text: str
    numbers: tuple[tuple[str, float], ...] = ()

    @cached_property
    def kinks(self) -> list[str]:
        """Functions of its kinks, see :func:`.kinks_in`."""
        return kinks_in(self._parsed)

    @cached_property
    def _parsed(self) -> Any:
        return parsed_formula(self.text)

    def __str__(self) -> str:
        return f"= {self.text}"


@dataclass(frozen=True)
class Formula(WrittenFormula):
    """A formula of the time ``t`` [s]."""

    def __post_init__(self) -> None:
        try:
            value = float(self.at(0.0))
        except NO_NUMBER:
            value = math.nan
        if not math.isfinite(value):
            advice = "is no finite number at t = 0; use t, parameters, + - * / ^ ( ), pi and " + ", ".join(FUNCTIONS)
            raise InputError("formula", f"= {self.text}", advice)

    def at(self, time: Any, functions: Mapping[str, Callable[[Any], Any]] = FUNCTIONS) -> Any:
        """Value at a time [s], which may be an array or a symbol; ``functions`` evaluates the calls for that type."""
        return formula_value(self._parsed, {**dict(self.numbers), TIME: time}, functions_of(self, functions))


@dataclass(frozen=True)
class Table:
    """Values at times, constant before the first and after the last time.

    Attributes:
        times: growing [s].
        values: one for each time.
        hold: True if each value holds from its time to the next one; False: linear interpolation.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]
    hold: bool = False

    def __post_init__(self) -> None:
        count = max(len(self.times), 1)
        checks.assign(self, times=checks.numbers("times", self.times, count))
        checks.assign(self, values=checks.numbers("values", self.values, count))
        late = np.flatnonzero(np.diff(self.times) <= 0)
        if len(late):
            advice = "the times of a table grow; sort them, and give each time once"
            raise InputError(f"times.{late[0] + 1}", self.times[late[0] + 1], advice)

    def at(self, time: Any) -> Any:
        """Value at a time [s], or at an array of them; the time of a held value belongs to it."""
        if self.hold:
            return np.asarray(self.values)[np.maximum(np.searchsorted(self.times, time, side="right") - 1, 0)]
        return np.interp(time, self.times, self.values)

    def piece(self, time: float) -> tuple[float, float, float]:
        """Line on which it goes on from a time [s] to its next break: time and value at one place, and slope."""
        place = int(np.searchsorted(self.times, time, side="right")) - 1
        if self.hold or place < 0 or place + 1 == len(self.times):
            return time, float(self.at(time)), 0.0
        (begin, end), (first, last) = self.times[place : place + 2], self.values[place : place + 2]
        return begin, first, (last - first) / (end - begin)


class Held:
    """Value that is set from outside at instants, and constant between them.

    Attributes:
        value: the present one.
        past: values of a run that is over, by which :meth:`at` answers; None: the present value answers.
    """

    def __init__(self, value: float = 0.0) -> None:
        self.value = value
        self.past: Table | None = None

    def at(self, time: Any) -> Any:
        """The present value; of a run that is over, the value at a time [s]."""
        return self.value if self.past is None else self.past.at(time)

    def piece(self, time: float) -> tuple[float, float, float]:
        """Value that it holds from a time [s] on, as :meth:`Table.piece`."""
        return time, float(self.at(time)), 0.0


Signal = float | Formula | Table | Held


def value_at(signal: Signal, time: Any, functions: Mapping[str, Callable[..., Any]] = FUNCTIONS) -> Any:
    """Value of a signal at a time [s]; for a formula the time may be an array or a symbol.

    For a table or a held value it may be a symbol if ``functions`` have a rule for these, under :data:`PIECE`.
    """
    if isinstance(signal, Formula):
        return signal.at(time, functions)
    if isinstance(signal, Table | Held):
        return functions[PIECE](signal, time) if PIECE in functions else signal.at(time)
    return signal


@dataclass(frozen=True)
class _Delayed(Formula):
    """A formula whose time runs late."""

    delay: float = 0.0

    def at(self, time: Any, functions: Mapping[str, Callable[[Any], Any]] = FUNCTIONS) -> Any:
        return super().at(time - self.delay, functions)


def delayed(signal: Signal, delay: float) -> Signal:
    """The signal with the values that it had by ``delay`` [s] earlier."""
    if isinstance(signal, Formula):
        return _Delayed(signal.text, signal.numbers, delay)
    if isinstance(signal, Table):
        return Table(tuple(time + delay for time in signal.times), signal.values, signal.hold)
    return signal


def varies(signal: Signal) -> bool:
    """True if the signal changes in time."""
    return not isinstance(signal, float | int)


def is_held(signal: Signal) -> bool:
    """True if a signal jumps at instants, and is constant between them."""
    return isinstance(signal, Held) or (isinstance(signal, Table) and signal.hold)


def breaks(signals: Sequence[Signal]) -> list[float]:
    """Times at which one of the signals is not smooth [s], sorted."""
    return sorted({time for signal in signals if isinstance(signal, Table) for time in signal.times})


def checked(field: str, value: Any) -> Signal:
    """Signal of a part of a mechanism. Raises InputError if the value is not a signal."""
    return value if isinstance(value, Formula | Table | Held) else checks.number(field, value)


def read_signal(field: str, entry: Any, numbers: Parameters, unit: str = "") -> Any:
    """Signal of a file, in this unit; a number or a formula without time is returned unchanged.

    A list of components gives a list of signals, and so does a table whose values are lists.

    Raises:
        InputError: a formula or a table is wrong, or a formula has another unit.
    """
    if isinstance(entry, dict) and (columns := _columns(field, entry)):
        entry = columns
    if isinstance(entry, list):
        return [read_signal(f"{field}.{number}", part, numbers, unit) for number, part in enumerate(entry)]
    try:
        if isinstance(entry, str) and entry.startswith("=") and TIME not in numbers.values:
            used = names_in(entry[1:])
            if TIME in used or used - {*CONSTANTS, *OF_PARAMETERS, *numbers.values}:
                for name in sorted(used - {TIME, "pi", *FUNCTIONS}):
                    require_known(
                        field, name, [TIME, *sorted(numbers.values)], "there is no such parameter; choose from"
                    )
                constants = tuple((name, float(value)) for name, value in numbers.values.items() if name in used)
                made = Formula(entry[1:].strip(), constants)
                _check_unit(field, made.text, numbers, unit)
                return made
        if isinstance(entry, dict):
            for key in entry:
                if key not in {"times", "values", "hold"}:
                    raise no_such_key(key, entry[key], ("times", "values", "hold"))
            axes, hold = {"times": "s", "values": unit}, entry.get("hold", False)
            if not isinstance(hold, bool):
                raise InputError("hold", hold, "give true (each value holds until the next) or false")
            filled = {key: numbers.filled(entry.get(key, []), key, {}, axes[key]) for key in axes}
            return Table(**filled, hold=hold)
        if isinstance(entry, str) and not entry.startswith(("=", "$")) and measured(field, entry, unit) is None:
            raise InputError(
                field, entry, "give a number, a formula that begins with =, or a table of times and values"
            )
    except InputError as error:
        inside = "" if error.field in {"formula", field} else f".{error.field}"
        raise InputError(f"{field}{inside}", error.value, error.advice) from None
    return entry


def _columns(field: str, table: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Table of each component, for a table whose values are lists; else an empty list."""
    rows = table.get("values")
    if not isinstance(rows, list) or not any(isinstance(row, list) for row in rows):
        return []
    counts = [len(row) if isinstance(row, list) else 1 for row in rows]
    for number, row in enumerate(rows):
        if counts[number] != counts[0]:
            raise InputError(f"{field}.values.{number}", row, f"give {counts[0]} components, as in the first row")
    return [{**table, "values": list(column)} for column in zip(*rows, strict=True)]


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


def names_in(text: str) -> set[str]:
    """Names in a formula, of functions too."""
    return set(_NAME.findall(text)).difference(keyword.kwlist)
