"""Signals and laws of springs at points of pieces, read by an evaluator of the checks' own."""

import ast
import operator
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from proofroll.truth.check.laws.record import Array

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_SMOOTH: Mapping[str, Callable[[Any], Any]] = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "atan": np.arctan, "exp": np.exp, "log": np.log,
    "sqrt": np.sqrt, "tanh": np.tanh,
}  # fmt: skip


def value_of(signal: Any, time: Array) -> Array:
    """Values of a signal at the points of pieces; a held value is that of the middle of its piece."""
    if hasattr(signal, "text"):
        second, factor = getattr(signal, "second", 1.0), getattr(signal, "factor", 1.0)  # of one in other units
        names = {"t": second * time - getattr(signal, "delay", 0.0), **dict(signal.numbers)}
        value = factor * formula(signal.text, names)
    elif hasattr(signal, "times"):
        value = _of_table(signal, (time[:, :1] + time[:, -1:]) / 2 if signal.hold else time)
    else:
        value = signal.at(time) if hasattr(signal, "at") else signal
    return np.asarray(np.broadcast_to(np.asarray(value, float), time.shape))


def pull_by(law: Any, length: Array, rate: Array) -> Array:
    """Pull of a spring with a formula of its own [N], at lengths [m] and their rates [m/s], (pieces, points)."""
    metre, speed, newton = law.units
    value = formula(law.text, {"L": metre * length, "dL": speed * rate, **dict(law.numbers)}) / newton
    return np.asarray(np.broadcast_to(np.asarray(value, float), length.shape))


def _of_table(table: Any, time: Array) -> Array:
    """Values of a table at times: of the line between two of its rows, or of the row before."""
    times, values = np.array(table.times), np.array(table.values)
    row = np.clip(np.sum(times <= time[..., None], -1) - 1, 0, len(times) - 1)
    if table.hold or len(times) == 1:
        return np.asarray(values[row])
    row = np.minimum(row, len(times) - 2)
    part = np.clip((time - times[row]) / (times[row + 1] - times[row]), 0.0, 1.0)
    return np.asarray((1 - part) * values[row] + part * values[row + 1])


@cache
def _parsed(text: str) -> ast.expr:
    return ast.parse(text.replace("^", "**").strip(), mode="eval").body


def formula(text: str, names: Mapping[str, Any]) -> Any:
    """Value of a formula whose variables are numbers, or arrays (pieces, points)."""
    with np.errstate(all="ignore"):
        return _evaluated(_parsed(text), {"pi": np.pi, **names})


def _evaluated(node: ast.expr, names: Mapping[str, Any]) -> Any:
    """Value of a node; a kink has the side of the middle of its piece, for pieces end at kinks."""
    match node:
        case ast.Constant(value=int() | float() as value):
            return float(value)
        case ast.Name(id=name):
            return names[name]
        case ast.UnaryOp(op=sign, operand=operand):
            return _OPERATORS[type(sign)](_evaluated(operand, names))
        case ast.BinOp(left=left, op=sign, right=right):
            return _OPERATORS[type(sign)](_evaluated(left, names), _evaluated(right, names))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _called(name, [_evaluated(item, names) for item in arguments])
    raise ValueError(f"a formula has no {type(node).__name__}")


def _called(name: str, values: list[Any]) -> Any:
    if name in _SMOOTH:
        return _SMOOTH[name](*values)
    if name in {"abs", "sign"}:
        side = _side(values[0])
        return side if name == "sign" else side * values[0]
    chosen = values[0]
    for value in values[1:]:
        side = _side(chosen - value) * (1.0 if name == "max" else -1.0)
        chosen = np.where(side > 0, chosen, value)
    return chosen


def _side(argument: Any) -> Any:
    """Sign of an argument in the middle of each piece, at all of its points."""
    argument = np.asarray(argument, float)
    if argument.ndim < 2:
        return np.sign(argument)
    middle = argument.shape[1] // 2
    return np.broadcast_to(np.sign(argument[:, middle : middle + 1]), argument.shape)
