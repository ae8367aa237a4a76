"""Formulas of surfaces: written once, they are calculated with floats and arrays, differentiated, and made series.

A function of ``+ - * /``, ``**`` with a whole number, :func:`sqrt`, :func:`sin` and :func:`cos` is carried out once on
symbols, by way of :class:`Jet`. What it does is noted as a program of plain assignments, which costs a tenth of jets of
numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.elements.ball_on_surface.surfaces.jet import Jet, variables


def sqrt(x: Any) -> Any:
    """Square root of whatever a formula is asked about: a number, an array, a jet, an expression of heyoka."""
    return _applied("sqrt", x)


def sin(x: Any) -> Any:
    """Sine, as :func:`sqrt`."""
    return _applied("sin", x)


def cos(x: Any) -> Any:
    """Cosine, as :func:`sqrt`."""
    return _applied("cos", x)


def _applied(name: str, x: Any) -> Any:
    if isinstance(x, Jet):
        return x.call(name, _applied)
    if isinstance(x, _Symbol):
        return x.noted(f"{name}({x.text})")
    if isinstance(x, (int, float, np.ndarray, np.generic)):
        return getattr(np, name)(x)
    import heyoka

    return getattr(heyoka, name)(x)


class _Symbol:
    """A number that is not known yet, and the program that it belongs to: what each name there is assigned."""

    __slots__ = ("program", "text")

    def __init__(self, program: dict[str, str], text: str) -> None:
        self.program, self.text = program, text

    def noted(self, formula: str) -> _Symbol:
        """The result of a formula; the same formula is noted once."""
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
    """Value, gradient and upper half of the Hessian of each result, one after the other: of floats, and of arrays.

    The formula is one of ``count`` numbers, giving one or a tuple of them. Where it has no value, there are NaN.
    """
    program: dict[str, str] = {}
    given = [f"x{i}" for i in range(count)]
    found = formula(*variables(*(_Symbol(program, name) for name in given)))
    parts = []
    for result in found if isinstance(found, tuple) else (found,):
        flat = result.parts if isinstance(result, Jet) else [result] + [0.0] * (count + count * (count + 1) // 2)
        parts += [_text(part) for part in flat]
    steps = "".join(f"    {name} = {text}\n" for text, name in program.items())
    source = f"def calculated({', '.join(given)}):\n{steps}    return {', '.join(parts)},\n"
    of_floats, of_arrays = ({name: getattr(kind, name) for name in ("sqrt", "sin", "cos")} for kind in (math, np))
    for names in (of_floats, of_arrays):
        exec(source, names)  # arithmetic that was noted above
    plain, missing = of_floats["calculated"], (math.nan,) * len(parts)

    def floats(*at: float) -> Any:
        try:
            return plain(*at)
        except (ValueError, ArithmeticError):  # numpy gives NaN there
            return missing

    def arrays(*at: Any) -> Any:
        with np.errstate(invalid="ignore", divide="ignore"):
            return of_arrays["calculated"](*at)

    return floats, arrays
