"""Kinks of formulas: abs, sign, max and min are smooth on each side of a zero of their argument.

The argument of abs(x) and sign(x) is x, of max(a, b) and min(a, b) a - b. While its side, 1 or -1, is held the formula
is smooth, so that integrators keep their order up to the kink, and beyond it with the other side.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import reduce
from itertools import count
from typing import Any

import numpy as np

Functions = Mapping[str, Callable[..., Any]]

KINKS = "kinks of laws"  # key of functions: takes a law and all functions, gives those of this law
JUMP = "sign"  # the function that jumps at its kink
# Values in numbers and arrays.
KINKED: Functions = {
    "abs": np.abs,
    JUMP: np.sign,
    "max": lambda *values: reduce(np.maximum, values),
    "min": lambda *values: reduce(np.minimum, values),
}


def kinks_in(parsed: Any) -> list[str]:
    """Functions with a kink in a parsed formula, one for each kink."""
    calls = [node for node in ast.walk(parsed) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    names = [(node.func.id, len(node.args)) for node in calls if isinstance(node.func, ast.Name)]
    return [name for name, size in names if name in KINKED for _ in range(max(size - 1, 1))]


def functions_of(law: Hashable, functions: Functions) -> Functions:
    """Functions for one evaluation of a law: its kinks have the sides that are held, if any are."""
    return functions[KINKS](law, functions) if KINKS in functions else functions


class Sides:
    """Sides of the kinks of all laws of a mechanism; it also keeps the kinks' arguments of the last evaluation.

    Args:
        laws: each law and the functions of its kinks (:func:`kinks_in`).
        held: side of each kink, numbers or symbols; None: they follow from the arguments.

    Attributes:
        held: the given sides.
        arguments: of the kinks, in the order of the laws; 1 of one that was not evaluated.
    """

    def __init__(self, laws: Mapping[Hashable, Sequence[str]], held: Sequence[Any] | None = None) -> None:
        ends = np.cumsum([0, *map(len, laws.values())]).tolist()
        self._first, self.held = dict(zip(laws, ends, strict=False)), held
        self.arguments: list[Any] = [1.0] * ends[-1]

    def functions(self, functions: Functions) -> Functions:
        """Functions that hold these sides, from those without kinks."""
        return {**functions, KINKS: self._of}

    def _of(self, law: Hashable, functions: Functions) -> Functions:
        if law not in self._first and "" not in self._first:  # it has no kinks
            return functions
        numbers = count(self._first.get(law, 0))

        def side(argument: Any) -> Any:
            number = next(numbers)
            self.arguments[number] = getattr(argument, "value", argument)  # of a jet the value decides
            return side_of(argument) if self.held is None else self.held[number]

        return with_sides(functions, side)


def held_sides(laws: Mapping[Hashable, Sequence[str]], sides: Sequence[Any], functions: Functions) -> Functions:
    """Functions that hold the sides of kinks; without sides these follow from the arguments."""
    return Sides(laws, sides).functions(functions) if len(sides) else functions


def side_of(argument: Any) -> Any:
    """Side that follows from an argument: a number, an array, or a jet in time, whose kink is left as time goes on."""
    value, *derivatives = getattr(argument, "parts", [argument])
    side = np.sign(value)
    for derivative in derivatives:
        side = np.where(side == 0, np.sign(derivative), side)
    return side[()] if isinstance(side, np.ndarray) else side


def with_sides(functions: Functions, side: Callable[[Any], Any]) -> Functions:
    """Functions with kinks whose sides a function of their arguments gives."""

    def larger(a: Any, b: Any, way: float = 0.5) -> Any:
        half = way * side(a - b)
        one, other = a * (0.5 + half), b * (0.5 - half)
        return other + one if hasattr(b, "value") else one + other  # a jet takes symbols from the right alone

    return {
        **functions,
        "abs": lambda x: x * side(x),
        JUMP: side,
        "max": lambda *values: reduce(larger, values),
        "min": lambda *values: reduce(lambda a, b: larger(a, b, -0.5), values),
    }
