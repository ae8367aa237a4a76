"""Formulas of surfaces: written once, evaluated with floats and arrays, differentiated, and made Taylor series.

A function of ``+ - * /``, ``**`` with a whole number, :func:`sqrt`, :func:`sin` and :func:`cos` is evaluated once on
symbols inside of :class:`Jet`: values with first and second derivatives, forward differentiation by truncated Taylor
series (Griewank and Walther, Evaluating Derivatives, 2008, chapter 13). The operations are recorded as a program of
plain assignments, which costs a tenth of jets of numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from proofroll.core.arrays import FloatArray

_NAMES = re.compile(r"\bn\d+\b")  # of results


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
    return math.sqrt(x) if type(x) is float and x >= 0.0 else _applied("sqrt", x)


def sin(x: Any) -> Any:
    """Sine of the same types as :func:`sqrt`."""
    return _applied("sin", x)


def cos(x: Any) -> Any:
    """Cosine of the same types as :func:`sqrt`."""
    return _applied("cos", x)


def _applied(name: str, x: Any) -> Any:
    if isinstance(x, Jet):
        return x.call(name, _applied)
    if isinstance(x, (int, float, np.ndarray, np.generic)):
        return getattr(np, name)(x)
    if isinstance(x, Applicable):
        return x.applied(name)
    import heyoka

    return getattr(heyoka, name)(x)


class _Symbol:
    """An unknown number in a :class:`RecordedProgram`: the name of a result, or that number with the other sign."""

    __slots__ = ("name", "negative", "steps")

    def __init__(self, steps: dict[str, str], name: str, negative: bool = False) -> None:
        self.steps, self.name, self.negative = steps, name, negative

    @property
    def text(self) -> str:
        """The number in a formula."""
        return f"-{self.name}" if self.negative else self.name

    def noted(self, formula: str, negative: bool = False) -> _Symbol:
        """Result of a formula as a symbol; a repeated formula is recorded once."""
        return _Symbol(self.steps, self.steps.setdefault(formula, f"n{len(self.steps)}"), negative)

    def applied(self, name: str) -> Any:
        """See :class:`Applicable`."""
        return self.noted(f"{name}({self.text})")

    def __add__(self, other: Any) -> Any:
        if _is(other, 0):
            return self
        name, negative = _signed(other)
        if negative == self.negative:
            return self.noted(" + ".join(sorted((self.name, name))), negative)
        if name == self.name:
            return 0.0
        first, second = sorted((self.name, name))  # so that a - b and b - a are one result
        return self.noted(f"{first} - {second}", self.negative == (first == self.name))

    def __mul__(self, other: Any) -> Any:
        if _is(other, 0):
            return 0.0
        name, negative = _signed(other)
        negative = negative != self.negative
        if _is(other, 1) or _is(other, -1):
            return _Symbol(self.steps, self.name, negative)
        return self.noted(" * ".join(sorted((self.name, name))), negative)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Any:
        return _Symbol(self.steps, self.name, not self.negative)

    def __sub__(self, other: Any) -> Any:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Any:
        return (-self).__add__(other)

    def __pow__(self, power: int) -> Any:
        return self.noted(f"{self.name} ** {power:d}", self.negative and power % 2 == 1)

    def __truediv__(self, other: Any) -> Any:
        name, negative = _signed(other)
        return self.noted(f"{self.name} / {name}", negative != self.negative)

    def __rtruediv__(self, other: Any) -> Any:
        name, negative = _signed(other)
        return 0.0 if _is(other, 0) else self.noted(f"{name} / {self.name}", negative != self.negative)


def _is(x: Any, number: int) -> bool:
    return isinstance(x, (int, float)) and x == number


def _signed(x: Any) -> tuple[str, bool]:
    """Name of a symbol, or absolute value of a number, and True if it is negative."""
    return (x.name, x.negative) if isinstance(x, _Symbol) else (f"{abs(float(x))!r}", math.copysign(1.0, x) < 0)


class RecordedProgram:
    """Operations on symbols, recorded as plain assignments.

    Attributes:
        symbols: the arguments.
    """

    def __init__(self, count: int) -> None:
        self._steps: dict[str, str] = {}
        self.symbols = [_Symbol(self._steps, f"x{k}") for k in range(count)]

    def functions(self, results: Sequence[Any], *kinds: Any) -> list[Callable[..., tuple[Any, ...]]]:
        """Function of the arguments that returns the results, with the elementary functions of each module given."""
        texts = ["-" * negative + name for name, negative in map(_signed, results)]
        formulas = {name: formula for formula, name in self._steps.items()}
        needed, waiting = set[str](), _NAMES.findall(" ".join(texts))
        while waiting:
            name = waiting.pop()
            if name not in needed:
                needed.add(name)
                waiting += _NAMES.findall(formulas[name])
        steps = "".join(f"    {name} = {formula}\n" for name, formula in formulas.items() if name in needed)
        arguments = ", ".join(symbol.name for symbol in self.symbols)
        source = f"def calculated({arguments}):\n{steps}    return {', '.join(texts)},\n"
        scopes = [{name: getattr(kind, name) for name in ("sqrt", "sin", "cos")} for kind in kinds]
        for scope in scopes:
            exec(source, scope)  # only the arithmetic recorded above
        return [scope["calculated"] for scope in scopes]

    def arrays(self, parts: Sequence[Any]) -> Callable[[Sequence[float]], list[FloatArray]]:
        """Function of the arguments' values that returns arrays of results as arrays of floats.

        It raises ArithmeticError or ValueError where a formula has no value.
        """
        flat = [np.asarray(part, dtype=object) for part in parts]
        ends = np.cumsum([part.size for part in flat]).tolist()
        places = [(slice(end - part.size, end), part.shape) for end, part in zip(ends, flat, strict=True)]
        (program,) = self.functions([item for part in flat for item in part.ravel().tolist()], math)

        def calculated(values: Sequence[float]) -> list[FloatArray]:
            numbers = np.array(program(*values))
            return [numbers[place].reshape(shape) for place, shape in places]

        return calculated


def differentiated(formula: Callable[..., Any], count: int) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Value, gradient and upper half of the Hessian of each result, as a function of floats and one of arrays.

    ``formula`` takes ``count`` numbers and returns one or a tuple of them. Where it is undefined, the values are NaN.
    """
    program, parts = RecordedProgram(count), []
    results = formula(*variables(*program.symbols))
    for result in results if isinstance(results, tuple) else (results,):
        parts += result.parts if isinstance(result, Jet) else [result] + [0.0] * (count + count * (count + 1) // 2)
    (plain, of_arrays), missing = program.functions(parts, math, np), (math.nan,) * len(parts)

    def floats(*place: float) -> Any:
        try:
            return plain(*place)
        except (ValueError, ArithmeticError):  # numpy gives NaN there
            return missing

    def arrays(*place: Any) -> Any:
        with np.errstate(invalid="ignore", divide="ignore"):
            return of_arrays(*place)

    return floats, arrays
