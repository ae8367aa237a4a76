"""Numbers in a scene file: ``"$length"``, ``"= mass*length^2/12"`` and, in names that repeat, ``"rod{i+1}"``."""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Mapping
from typing import Any

from simpleeval import InvalidExpression, SimpleEval

from proofroll.core.errors import InputError, require_known

_OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: lambda base, power: float(base) ** float(power),  # integers would grow for hours before they overflow
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_LONGEST = 500  # characters: what a person writes is far shorter, and nesting stays shallow enough to be parsed


def evaluated(field: str, text: str, values: Mapping[str, float]) -> float:
    """The number of an expression of parameters with + - * / ^ ** ( ) and ``pi``; it cannot call functions.

    Args:
        field: where it stands, for the message.
        text: the expression.
        values: the parameters.

    Raises:
        InputError: it cannot be read, names an unknown parameter, calls a function, divides by zero or overflows.
    """
    if len(text) > _LONGEST:
        raise InputError(field, text, f"an expression may have at most {_LONGEST} characters")
    names = {"pi": math.pi} | {name: float(value) for name, value in values.items()}
    evaluator = SimpleEval(operators=_OPERATORS, functions={}, names=names)
    del evaluator.nodes[ast.Attribute]
    try:
        number = float(evaluator.eval(text.replace("^", "**").strip()))
    except ZeroDivisionError:
        raise InputError(field, text, "divides by zero; change the expression or its parameters") from None
    except InvalidExpression as error:
        problem = str(error).splitlines()[0].rstrip(".")
        raise InputError(field, text, f"{problem}; use + - * / ^ and {_list(names)}") from None
    except (SyntaxError, TypeError, ValueError, OverflowError, RecursionError, MemoryError, KeyError):
        raise InputError(field, text, f"is no finite real number; use + - * / ^ and {_list(names)}") from None
    if not math.isfinite(number):
        raise InputError(field, text, "is not finite; change the expression or its parameters")
    return number


def substituted(field: str, content: Any, values: Mapping[str, float]) -> Any:
    """The content of a table with every ``$name``, ``= expression`` and ``{index}`` replaced.

    Raises:
        InputError: one of them cannot be replaced.
    """
    if isinstance(content, dict):
        return {key: substituted(f"{field}.{key}", value, values) for key, value in content.items()}
    if isinstance(content, list):
        return [substituted(f"{field}.{place}", value, values) for place, value in enumerate(content)]
    if not isinstance(content, str):
        return content
    if content.startswith("$"):
        require_known(field, content[1:], values, "there is no such parameter; choose from", content)
        return values[content[1:]]
    if content.startswith("="):
        return evaluated(field, content[1:], values)
    return re.sub(r"\{([^{}]*)\}", lambda found: f"{evaluated(field, found[1], values):g}", content)


def _list(names: Mapping[str, float]) -> str:
    return ", ".join(names) or "no parameter"
