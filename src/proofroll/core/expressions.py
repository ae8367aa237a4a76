"""Formulas in a scene file: ``"= mass*length^2/12"`` and, in names that repeat, ``"rod{i+1}"``."""

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from simpleeval import FeatureNotAvailable, InvalidExpression, NameNotDefined, SimpleEval

from proofroll.core.errors import InputError
from proofroll.core.quantity import OR, Quantity, UnitsDiffer, powers_of

_OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
# Names of constants that a formula may have.
CONSTANTS = {"pi": Quantity(math.pi), "deg": Quantity(math.pi / 180)}
_LONGEST = 500  # characters: far more than a person writes, and few enough that nesting cannot overflow the parser
# What a formula may consist of; everything else that Python's grammar knows is refused.
_CHARACTERS = re.compile(r"[\w\s.+\-*/^(),]*")
_NUMBER = re.compile(r"(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_LEAVES = (ast.Name, ast.Load, *_OPERATORS, ast.Pow)


@cache
def parsed_formula(text: str) -> ast.expr:
    """Tree of a formula without its sign: numbers, names, + - * / ^ ** ( ) and calls of functions by their name.

    Raises:
        FeatureNotAvailable: anything else, or more than 500 characters.
        SyntaxError: an end that is missing.
        OverflowError: a whole number beyond the largest float.
    """
    source = text.replace("^", "**").strip()
    if len(text) > _LONGEST or not _CHARACTERS.fullmatch(text):
        raise FeatureNotAvailable(f"a formula has at most {_LONGEST} characters, each of which arithmetic needs")
    with warnings.catch_warnings(action="ignore", category=SyntaxWarning):  # "1if" warns, and is refused below
        tree = ast.parse(source, mode="eval").body
    for node in ast.walk(tree):
        if not _is_arithmetic(node, source):
            raise FeatureNotAvailable(f"{type(node).__name__} is no arithmetic")
    return tree


def _is_arithmetic(node: ast.AST, source: str) -> bool:
    if isinstance(node, ast.Constant):
        if type(node.value) is int:
            float(node.value)  # raises OverflowError, which sums and products with floats would raise later
        return type(node.value) in (int, float) and bool(_NUMBER.fullmatch(ast.get_source_segment(source, node) or ""))
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and not node.keywords
    return isinstance(node, (ast.BinOp, ast.UnaryOp, *_LEAVES))


def evaluator(
    names: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]], power: Callable[[Any, Any], Any]
) -> SimpleEval:
    """Evaluator of formulas with + - * / ^ ** ( ) and the given names and functions; attributes are not allowed.

    The name of a function is no value: ``abs`` alone is not defined.
    """
    made = SimpleEval(operators={**_OPERATORS, ast.Pow: power}, functions=dict(functions), names=dict(names))
    del made.nodes[ast.Attribute]

    def value(node: ast.Name) -> Any:
        if node.id not in names:
            raise NameNotDefined(node.id, made.expr)
        return names[node.id]

    made.nodes[ast.Name] = value
    return made


def _power(base: Any, power: Any) -> Any:
    return (base if isinstance(base, Quantity) else Quantity(base)) ** power


def evaluated(
    field: str,
    text: str,
    names: Mapping[str, Quantity],
    unit: str = "",
    functions: Mapping[str, Callable[[float], float]] | None = None,
) -> float:
    """The number of an expression of parameters with + - * / ^ ** ( ), ``pi``, ``deg`` = π/180, and functions.

    Args:
        field: location in the file, for the message.
        text: the expression.
        names: the parameters, with their units.
        unit: required unit of the result, as scene files write it, or several joined by OR; "": not checked. A formula
            of plain numbers is accepted for any unit, as a plain number is.
        functions: further functions of a dimensionless number that the expression may call, beside :data:`FUNCTIONS`.

    Raises:
        InputError: the expression cannot be read, has an unknown name or function, divides by zero, overflows, adds
            different units, or its result has another unit.
    """
    if len(text) > _LONGEST:
        raise InputError(field, text, f"an expression may have at most {_LONGEST} characters")
    constants = {**CONSTANTS, **names}
    further = {name: _of_ratio(name, item) for name, item in (functions or {}).items() if name not in FUNCTIONS}
    called = {**FUNCTIONS, **further}
    try:
        value = evaluator(constants, called, _power).eval(text, parsed_formula(text))
        quantity = Quantity(0.0) + value
        number = float(quantity.value)
    except ZeroDivisionError:
        raise InputError(field, text, "divides by zero; change the expression or its parameters") from None
    except UnitsDiffer as error:
        raise InputError(field, text, f"{error}; change the formula, or the unit of a parameter in it") from None
    except FeatureNotAvailable:
        raise InputError(field, text, f"is no arithmetic; use numbers, + - * / ^ and {_list(constants)}") from None
    except InvalidExpression as error:
        problem = str(error).splitlines()[0].rstrip(".")
        raise InputError(field, text, f"{problem}; use + - * / ^, {', '.join(called)} and {_list(constants)}") from None
    except SyntaxError:
        raise InputError(field, text, f"is not complete; use + - * / ^ and {_list(constants)}") from None
    except (TypeError, ValueError, OverflowError, RecursionError, MemoryError, KeyError):
        raise InputError(field, text, f"is no finite real number; use + - * / ^ and {_list(constants)}") from None
    if not math.isfinite(number):
        raise InputError(field, text, "is not finite; change the expression or its parameters")
    if unit and quantity.powers is not None and quantity.powers not in map(powers_of, unit.split(OR)):
        advice = f"this number is in {unit}, the formula gives {quantity.unit}; a bare number in a product has no unit"
        raise InputError(field, text, f"{advice}: make a parameter of the number with a unit")
    return number


def _of_ratio(name: str, function: Callable[[float], float]) -> Callable[[Quantity | float], Quantity]:
    """Function of quantities that raises UnitsDiffer for an argument with a unit."""

    def called(argument: Quantity | float) -> Quantity:
        ratio = Quantity(0.0) + argument
        if ratio.powers:
            raise UnitsDiffer(f"{name} is of a ratio, and this is in {ratio.unit}")
        return Quantity(float(function(ratio.value)))

    return called


def _root(argument: Quantity | float) -> Quantity:
    return (Quantity(0.0) + argument) ** 0.5


def _hypotenuse(leg: Quantity | float, two: Quantity | float) -> Quantity:
    total = Quantity(0.0) + leg + two  # raises if their units differ
    return Quantity(math.hypot(_plain(leg), _plain(two)), total.powers)


def _angle(y: Quantity | float, x: Quantity | float) -> Quantity:
    _hypotenuse(y, x)
    return Quantity(math.atan2(_plain(y), _plain(x)))


def _size(argument: Quantity | float) -> Quantity:
    quantity = Quantity(0.0) + argument
    return Quantity(abs(quantity.value), quantity.powers)


def _sign(argument: Quantity | float) -> Quantity:
    value = _plain(argument)
    return Quantity(math.copysign(1.0, value) if value else 0.0)


def _chosen(name: str, choose: Callable[..., float]) -> Callable[..., Quantity]:
    """Largest or smallest of quantities in one unit."""

    def called(*arguments: Quantity | float) -> Quantity:
        total = Quantity(0.0)
        for argument in arguments:
            total = total + argument  # raises if their units differ
        return Quantity(choose(map(_plain, arguments)), total.powers)

    called.__name__ = name
    return called


def _plain(argument: Quantity | float) -> float:
    return float((Quantity(0.0) + argument).value)


# Functions of formulas that do not depend on time; their units are checked.
FUNCTIONS: Mapping[str, Callable[..., Quantity]] = {
    **{name: _of_ratio(name, getattr(math, name)) for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
    "atan2": _angle,
    "sqrt": _root,
    "hypot": _hypotenuse,
    "abs": _size,
    "sign": _sign,
    "max": _chosen("max", max),
    "min": _chosen("min", min),
}


def _list(names: Mapping[str, Quantity]) -> str:
    return ", ".join(names) or "no parameter"
