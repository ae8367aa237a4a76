"""Formulas of surfaces: written once, evaluated with floats and arrays, differentiated, and made Taylor series.

A function of ``+ - * /``, ``**`` with a whole number, :func:`sqrt`, :func:`sin` and :func:`cos` is evaluated once on
symbols inside of :class:`Jet`: values with first and second derivatives, forward differentiation by truncated Taylor
series (Griewank and Walther, Evaluating Derivatives, 2008, chapter 13). The operations are recorded as a program of
plain assignments, which costs a tenth of jets of numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np


@runtime_checkable
class Applicable(Protocol):
    """A scalar that evaluates elementary functions of itself."""

    def applied(self, name: str) -> Any:
        """Value of the function of this name."""


class Jet:
    """A value with its gradient and Hessian in a few variables; the numbers may be of any type with arithmetic.

    Attributes:
        value: f.
        first: ∂f/∂x_i, one for each variable.
        second: ∂²f/∂x_i∂x_j for i ≤ j, row by row.
    """

    __slots__ = ("first", "second", "value")

    def __init__(self, value: Any, first: list[Any], second: list[Any]) -> None:
        self.value, self.first, self.second = value, first, second

    @property
    def parts(self) -> list[Any]:
        """Value, gradient and upper half of the Hessian in one list."""
        return [self.value, *self.first, *self.second]

    def through(self, value: Any, slope: Any, bend: Any) -> Jet:
        """Function of this jet (chain rule), from the function's value, slope and second derivative at it."""
        first, index, second = self.first, 0, []
        for i, slope_i in enumerate(first):
            for slope_j in first[i:]:
                second.append(slope * self.second[index] + bend * slope_i * slope_j)
                index += 1
        return Jet(value, [slope * slope_i for slope_i in first], second)

    def call(self, name: str, apply: Callable[[str, Any], Any]) -> Jet:
        """Elementary function ``name`` of this jet; ``apply`` evaluates a function by name at a value."""
        value = apply(name, self.value)
        if name == "sqrt":
            slope = 0.5 / value
            return self.through(value, slope, -0.5 * slope / self.value)
        if name == "sin":
            return self.through(value, apply("cos", self.value), -1.0 * value)
        return self.through(value, -1.0 * apply("sin", self.value), -1.0 * value)

    def __add__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.first, self.second)
        both = zip(self.parts, other.parts, strict=True)
        value, *rest = (x + y for x, y in both)
        return Jet(value, rest[: len(self.first)], rest[len(self.first) :])

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, [x * other for x in self.first], [x * other for x in self.second])
        a, b, index, second = self.value, other.value, 0, []
        for i, (x, y) in enumerate(zip(self.first, other.first, strict=True)):
            for s, t in zip(self.first[i:], other.first[i:], strict=True):
                second.append(a * other.second[index] + b * self.second[index] + x * t + y * s)
                index += 1
        return Jet(a * b, [a * y + b * x for x, y in zip(self.first, other.first, strict=True)], second)

    __radd__ = __add__
    __rmul__ = __mul__

    def __neg__(self) -> Jet:
        return self.__mul__(-1.0)

    def __sub__(self, other: Any) -> Jet:
        return self.__add__(other * -1.0)

    def __rsub__(self, other: Any) -> Jet:
        return self.__neg__().__add__(other)

    def __pow__(self, power: float) -> Jet:
        if not isinstance(power, int) or power < 1:
            p, x = float(power), self.value
            slope = p * x ** (p - 1.0) if p else 0.0
            return self.through(x**p, slope, p * (p - 1.0) * x ** (p - 2.0) if p else 0.0)
        result = self
        for _ in range(power - 1):
            result = result * self
        return result

    def __truediv__(self, other: Any) -> Jet:
        return self.__mul__(1.0 / other)

    def __rtruediv__(self, other: Any) -> Jet:
        inverse = 1.0 / self.value
        square = inverse * inverse
        return self.through(inverse, -1.0 * square, 2.0 * square * inverse).__mul__(other)


def variables(*values: Any) -> list[Jet]:
    """Independent variables as jets at these values."""
    count = len(values)
    flat = [0.0] * (count * (count + 1) // 2)
    return [Jet(value, [float(i == j) for j in range(count)], flat) for i, value in enumerate(values)]


def sqrt(x: Any) -> Any:
    """Square root of a number, an array, a jet, a symbol, or an expression of heyoka."""
    return _applied("sqrt", x)


def sin(x: Any) -> Any:
    """Sine of the same types as :func:`sqrt`."""
    return _applied("sin", x)


def cos(x: Any) -> Any:
    """Cosine of the same types as :func:`sqrt`."""
    return _applied("cos", x)


def _applied(name: str, x: Any) -> Any:
    if isinstance(x, Jet):
        return x.call(name, _applied)
    if isinstance(x, _Symbol):
        return x.noted(f"{name}({x.text})")
    if isinstance(x, (int, float, np.ndarray, np.generic)):
        return getattr(np, name)(x)
    if isinstance(x, Applicable):
        return x.applied(name)
    import heyoka

    return getattr(heyoka, name)(x)


class _Symbol:
    """An unknown number in a recorded program; ``program`` maps each formula to the name of its result."""

    __slots__ = ("program", "text")

    def __init__(self, program: dict[str, str], text: str) -> None:
        self.program, self.text = program, text

    def noted(self, formula: str) -> _Symbol:
        """Result of a formula as a symbol; a repeated formula is recorded once."""
        return _Symbol(self.program, self.program.setdefault(formula, f"n{len(self.program)}"))

    def __add__(self, other: Any) -> Any:
        return self if _is(other, 0) else self.noted(f"{self.text} + {_text(other)}")

    def __mul__(self, other: Any) -> Any:
        if _is(other, 0):
            return 0.0
        return self if _is(other, 1) else self.noted(f"{self.text} * {_text(other)}")

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Any:
        return self.noted(f"-{self.text}")

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0) else self.noted(f"{self.text} - {_text(other)}")

    def __rsub__(self, other: Any) -> Any:
        return self.noted(f"{_text(other)} - {self.text}")

    def __pow__(self, power: int) -> Any:
        return self.noted(f"{self.text} ** {power:d}")

    def __truediv__(self, other: Any) -> Any:
        return self.noted(f"{self.text} / {_text(other)}")

    def __rtruediv__(self, other: Any) -> Any:
        return 0.0 if _is(other, 0) else self.noted(f"{_text(other)} / {self.text}")


def _is(x: Any, number: int) -> bool:
    return isinstance(x, (int, float)) and x == number


def _text(x: Any) -> str:
    return x.text if isinstance(x, _Symbol) else f"({float(x)!r})"


def differentiated(formula: Callable[..., Any], count: int) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Value, gradient and upper half of the Hessian of each result, as a function of floats and one of arrays.

    ``formula`` takes ``count`` numbers and returns one or a tuple of them. Where it is undefined, the values are NaN.
    """
    program: dict[str, str] = {}
    symbols = [f"x{i}" for i in range(count)]
    results = formula(*variables(*(_Symbol(program, name) for name in symbols)))
    parts = []
    for result in results if isinstance(results, tuple) else (results,):
        flat = result.parts if isinstance(result, Jet) else [result] + [0.0] * (count + count * (count + 1) // 2)
        parts += [_text(part) for part in flat]
    steps = "".join(f"    {name} = {text}\n" for text, name in program.items())
    source = f"def calculated({', '.join(symbols)}):\n{steps}    return {', '.join(parts)},\n"
    of_floats, of_arrays = ({name: getattr(kind, name) for name in ("sqrt", "sin", "cos")} for kind in (math, np))
    for names in (of_floats, of_arrays):
        exec(source, names)  # only the arithmetic recorded above
    plain, missing = of_floats["calculated"], (math.nan,) * len(parts)

    def floats(*place: float) -> Any:
        try:
            return plain(*place)
        except (ValueError, ArithmeticError):  # numpy gives NaN there
            return missing

    def arrays(*place: Any) -> Any:
        with np.errstate(invalid="ignore", divide="ignore"):
            return of_arrays["calculated"](*place)

    return floats, arrays
