"""Scalars that turn each number of a scene into a parameter at run time, so that one compilation serves all of a sweep.

Tables and held values are lines from one break to the next: their coefficients are parameters, too.
Operations with plain numbers as of formulas (0, 1, 2, a half and their negatives) keep them, as those of a scene may be
any: a scene with other numbers has the same expression.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import PIECE, Held, Table

_KEPT = frozenset({0.0, 1.0, -1.0, 2.0, -2.0, 0.5, -0.5})


class _Coefficient(NamedTuple):
    """Coefficient of the line of a signal: time and value at one place, slope."""

    signal: Table | Held
    number: int


class Constants:
    """Numbers of one scene as parameters, each different number once, and the lines of its signals.

    Args:
        parameter: index -> symbol of a parameter.
        first: index of the first one.
        number: value -> symbol of a number.
    """

    def __init__(self, parameter: Callable[[int], Any], start: int, number: Callable[[float], Any]) -> None:
        self._parameter, self._first, self._number = parameter, start, number
        self._indices: dict[float | _Coefficient, int] = {}
        self._functions: dict[str, Callable[[Any], Any]] = {}

    def values(self, time: float) -> Array:
        """Values of the parameters, in order, from a time [s] to the next break of a signal."""
        return np.array(
            [key if isinstance(key, float) else key.signal.piece(time)[key.number] for key in self._indices]
        )

    def symbol(self, value: Any) -> Any:
        """Symbol of a symbol or of a number."""
        if isinstance(value, Symbol):
            return value.expression
        value = float(value)
        if value in _KEPT:
            return self._number(value)
        return self._place(value)

    def piece(self, signal: Table | Held, time: Any) -> Any:
        """Line of a signal at a symbol of time."""
        begin, value, slope = (Symbol(self._place(_Coefficient(signal, number)), self) for number in range(3))
        return value if isinstance(signal, Held) or signal.hold else value + slope * (time - begin)

    def _place(self, key: float | _Coefficient) -> Any:
        return self._parameter(self._first + self._indices.setdefault(key, len(self._indices)))

    def functions(self, names: Mapping[str, Callable[[Any], Any]]) -> dict[str, Callable[..., Any]]:
        """Functions of symbols, from those of expressions, and of signals; symbols know them from then on."""
        self._functions |= {name: self._of_symbols(function) for name, function in names.items()}
        return {**self._functions, PIECE: self.piece}

    def applied(self, name: str, x: Any) -> Any:
        """Function of a symbol, by its name."""
        return self._functions[name](x)

    def _of_symbols(self, function: Callable[[Any], Any]) -> Callable[[Any], Any]:
        return lambda x: Symbol(function(self.symbol(x)), self)


class Symbol:
    """An expression whose operations with numbers take these as parameters."""

    __array_ufunc__ = None  # a number of NumPy leaves operations to this class

    def __init__(self, expression: Any, constants: Constants) -> None:
        self.expression, self._constants = expression, constants

    def applied(self, name: str) -> Any:
        """Function of this expression, by its name."""
        return self._constants.applied(name, self)

    def _with(self, operand: Any, operation: Callable[[Any, Any], Any]) -> Symbol:
        return Symbol(operation(self.expression, self._constants.symbol(operand)), self._constants)

    def __add__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: a + b)

    def __radd__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: b + a)

    def __sub__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: a - b)

    def __rsub__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: b - a)

    def __mul__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: a * b)

    def __rmul__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: b * a)

    def __truediv__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: a / b)

    def __rtruediv__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: b / a)

    def __pow__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: a**b)

    def __rpow__(self, operand: Any) -> Symbol:
        return self._with(operand, lambda a, b: b**a)

    def __neg__(self) -> Symbol:
        return Symbol(-self.expression, self._constants)

    def __pos__(self) -> Symbol:
        return self
