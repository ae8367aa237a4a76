"""Numbers that carry their first and second derivatives: forward differentiation by truncated Taylor series.

Source: Griewank and Walther, Evaluating Derivatives, 2008, chapter 13.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Jet:
    """A value with its gradient and Hessian in a few variables; of numbers of any type that can be calculated with.

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
        """The value, the gradient and the Hessian, one after the other."""
        return [self.value, *self.first, *self.second]

    def through(self, value: Any, slope: Any, bend: Any) -> Jet:
        """A function of this jet with the given value and derivatives."""
        first, index, second = self.first, 0, []
        for i, one in enumerate(first):
            for other in first[i:]:
                second.append(slope * self.second[index] + bend * one * other)
                index += 1
        return Jet(value, [slope * one for one in first], second)

    def call(self, name: str, apply: Callable[[str, Any], Any]) -> Jet:
        """An elementary function, by ``apply`` of its name and a value."""
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

    def __pow__(self, power: int) -> Jet:
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
    """The independent variables at these values."""
    count = len(values)
    flat = [0.0] * (count * (count + 1) // 2)
    return [Jet(value, [float(i == j) for j in range(count)], flat) for i, value in enumerate(values)]
