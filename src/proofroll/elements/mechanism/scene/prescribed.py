"""Prescribed motions of joints: a coordinate as a signal of time, with its exact first and second derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.kinks import KINKS, side_of, with_sides
from proofroll.elements.mechanism.scene.shapes.walls.formula import Jet
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, Formula, Signal, Table

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


class Moved(NamedTuple):
    """A prescribed coordinate, its rate and its acceleration [rad or m, per s, per s²]."""

    place: Any
    rate: Any
    acceleration: Any


def _of_tan(_: Any, y: Any, __: Any) -> tuple[Any, Any]:
    slope = 1.0 + y * y
    return slope, 2.0 * y * slope


def _of_tanh(_: Any, y: Any, __: Any) -> tuple[Any, Any]:
    slope = 1.0 - y * y
    return slope, -2.0 * y * slope


def _of_asin(x: Any, _: Any, f: Mapping[str, Callable[[Any], Any]]) -> tuple[Any, Any]:
    slope = 1.0 / f["sqrt"](1.0 - x * x)
    return slope, slope * x / (1.0 - x * x)


def _of_atan(x: Any, _: Any, __: Any) -> tuple[Any, Any]:
    slope = 1.0 / (1.0 + x * x)
    return slope, -2.0 * x * slope * slope


# First and second derivative of each function, from its argument x, its value y and all functions.
_DERIVATIVES: Mapping[str, Callable[[Any, Any, Mapping[str, Callable[[Any], Any]]], tuple[Any, Any]]] = {
    "sin": lambda x, y, f: (f["cos"](x), -y),
    "cos": lambda x, y, f: (-f["sin"](x), -y),
    "tan": _of_tan,
    "asin": _of_asin,
    "atan": _of_atan,
    "exp": lambda _, y, __: (y, y),
    "log": lambda x, _, __: (1.0 / x, -1.0 / (x * x)),
    "sqrt": lambda x, y, _: (0.5 / y, -0.25 / (y * x)),
    "tanh": _of_tanh,
}


def of_jets(functions: Mapping[str, Callable[..., Any]]) -> dict[str, Callable[..., Any]]:
    """Functions of jets, by the chain rule from those of their parts."""

    def lifted(name: str) -> Callable[[Any], Any]:
        def called(argument: Any) -> Any:
            if not isinstance(argument, Jet):
                return functions[name](argument)
            value = functions[name](argument.value)
            return argument.through(value, *_DERIVATIVES[name](argument.value, value, functions))

        return called

    of_sides = {KINKS: functions[KINKS]} if KINKS in functions else {}
    return {**with_sides({name: lifted(name) for name in _DERIVATIVES}, side_of), **of_sides}


def moved(signal: Signal, time: Any, functions: Mapping[str, Callable[[Any], Any]] = FUNCTIONS) -> Moved:
    """Prescribed coordinate with its derivatives at a time [s]; for a formula the time may be an array or a symbol.

    A table is a spline of fifth order through its points, at rest before its first and after its last time.
    """
    if isinstance(signal, Formula):
        with np.errstate(all="ignore"):
            jet = signal.at(Jet(time, [1.0], [0.0]), of_jets(functions))
        return Moved(*jet.parts) if isinstance(jet, Jet) else Moved(jet, 0.0, 0.0)
    if isinstance(signal, Table):
        splines, (begin, last) = _splines(signal), (signal.times[0], signal.times[-1])
        inside = np.clip(time, begin, last)
        moving = (np.asarray(time) > begin) & (np.asarray(time) < last)
        place, rate, acceleration = (np.asarray(spline(inside)) for spline in splines)
        return Moved(*(part[()] for part in (place, rate * moving, acceleration * moving)))
    return Moved(signal, 0.0, 0.0)


@lru_cache(maxsize=64)
def _splines(table: Table) -> tuple[BSpline, BSpline, BSpline]:
    """Spline of a table, and its first and second derivatives; it begins and ends at rest without a jolt."""
    from scipy.interpolate import make_interp_spline

    at_rest = [(1, 0.0), (2, 0.0)]
    spline = make_interp_spline(table.times, table.values, k=5, bc_type=(at_rest, at_rest))
    return spline, spline.derivative(1), spline.derivative(2)


def checked_motion(field: str, signal: Signal) -> Moved:
    """Coordinate, rate and acceleration at time 0 of a motion that a scene gives.

    Raises:
        InputError: the motion jumps, or one of them is not finite.
    """
    if isinstance(signal, Table):
        if signal.hold:
            raise InputError(f"{field}.hold", True, "a place that jumps needs an infinite force; leave hold out")
        if len(signal.times) < 2:
            raise InputError(f"{field}.times", signal.times, "give at least two times, or a number that stays")
    try:
        start = Moved(*(float(part) for part in moved(signal, 0.0)))
    except (ArithmeticError, TypeError, ValueError):
        start = Moved(np.nan, np.nan, np.nan)
    if not np.isfinite(start).all():
        advice = "has no finite place, rate and acceleration at t = 0; choose a formula that begins smoothly"
        raise InputError(field, str(signal), advice)
    return start
