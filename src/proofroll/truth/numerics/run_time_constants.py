"""Scalars that turn each number of a scene into a parameter at run time, so that one compilation serves all of a sweep.

Tables and held values are lines from one break to the next: their coefficients are parameters, too.
Operations with plain numbers as of formulas (0, 1, 2, a half and their negatives) keep them, as those of a scene may be
any: a scene with other numbers has the same expression.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from operator import add, mul, sub, truediv
from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import PIECE, Held, Table

_Operation = Callable[[Any, Any], Any]
_NEUTRAL: Mapping[_Operation, float] = {add: 0.0, sub: 0.0, mul: 1.0, truediv: 1.0, pow: 1.0}  # that change nothing
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
    """An expression whose operations with numbers take these as parameters; those with zeros and ones fold."""

    __array_ufunc__ = None  # a number of NumPy leaves operations to this class

    def __init__(self, expression: Any, constants: Constants) -> None:
        self.expression, self._constants = expression, constants

    def applied(self, name: str) -> Any:
        """Function of this expression, by its name."""
        return self._constants.applied(name, self)

    def _with(self, operation: _Operation, operand: Any) -> Any:
        if not isinstance(operand, Symbol) and operand == _NEUTRAL[operation]:
            return self
        return Symbol(operation(self.expression, self._constants.symbol(operand)), self._constants)

    def _after(self, operand: Any, operation: _Operation) -> Symbol:
        return Symbol(operation(self._constants.symbol(operand), self.expression), self._constants)

    def __add__(self, operand: Any) -> Any:
        return self._with(add, operand)

    def __sub__(self, operand: Any) -> Any:
        return self._with(sub, operand)

    def __rsub__(self, operand: Any) -> Symbol:
        return self._after(operand, sub) if operand else -self

    def __mul__(self, operand: Any) -> Any:
        return self._with(mul, operand) if isinstance(operand, Symbol) or operand else 0.0

    def __truediv__(self, operand: Any) -> Any:
        return self._with(truediv, operand)

    def __rtruediv__(self, operand: Any) -> Symbol:
        return self._after(operand, truediv)

    def __pow__(self, operand: Any) -> Any:
        return self._with(pow, operand)

    def __rpow__(self, operand: Any) -> Symbol:
        return self._after(operand, pow)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Symbol:
        return Symbol(-self.expression, self._constants)

    def __pos__(self) -> Symbol:
        return self
