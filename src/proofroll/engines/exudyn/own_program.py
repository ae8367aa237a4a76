"""Options of a person's own Exudyn program, read without running it."""

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from proofroll.core.engine_abilities import OwnOptions
from proofroll.core.errors import InputError
from proofroll.core.number_format import number
from proofroll.engines.exudyn.settings import EXPLICIT, OWN

_OPERATIONS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip
_FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "int": int, "float": float, "round": round, "ceil": math.ceil, "floor": math.floor,
}  # fmt: skip
# Exudyn's own values of what a program leaves out [s, 1].
_OWN = {
    "numberOfSteps": 100.0, "endTime": 1.0, "spectralRadius": OWN["spectral_radius"],
    "relativeTolerance": OWN["newton_tolerance"],
}  # fmt: skip
# Solver types that the adapter has, as it names them; explicit ones move its kinematic tree.
_SOLVERS = {
    "GeneralizedAlpha": "generalized_alpha", "TrapezoidalIndex2": "trapezoidal_index2", "RK44": "rk44", "RK67": "rk67",
}  # fmt: skip
# Options of exu.SimulationSettings() that are read, by their last name.
_READ = (*_OWN, "useNewmark", "adaptiveStep")


def own_options(path: Path) -> OwnOptions:
    """Options of a program: the last value that it gives to each option of ``exu.SimulationSettings()``.

    Values may be numbers, names that were given numbers before, and their sums, products and roundings.

    Raises:
        InputError: the file is no Python program, sets no step, or an integrator that the adapter has not.
    """
    try:
        program = ast.parse(path.read_text(encoding="utf-8"))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InputError("--like", path, f"it is no Python program: {type(error).__name__}") from None
    values = dict(_assigned(program))
    solver = _solver(program) or ("TrapezoidalIndex2" if values.get("useNewmark") else "GeneralizedAlpha")
    if solver not in _SOLVERS:
        advice = f"its solver {solver} is none that can be compared; choose {', '.join(_SOLVERS)}"
        raise InputError("--like", path, advice)
    if not {"numberOfSteps", "endTime"} & values.keys():
        raise InputError("--like", path, "it gives timeIntegration.numberOfSteps and endTime no numbers")
    options, integrator = _OWN | values, _SOLVERS[solver]
    step = options["endTime"] / max(options["numberOfSteps"], 1.0)
    settings = {"integrator": integrator, "dt": f"{step:.12g}"}
    words = f"{solver}, dt {number(step, 3)} s"
    if integrator in EXPLICIT:
        settings["formulation"] = "tree"
    else:
        settings["newton_tolerance"] = repr(options["relativeTolerance"])
    if integrator == "generalized_alpha":
        settings["spectral_radius"] = repr(options["spectralRadius"])
        words += f", spectral radius {number(options['spectralRadius'])}"
    others = ["the adaptive step"] if values.get("adaptiveStep", 1.0) and integrator not in EXPLICIT else []
    return OwnOptions(engine="exudyn", words=words, settings=settings, of_contacts={}, others=others)


def _assigned(program: ast.Module) -> Iterator[tuple[str, float]]:
    """Last name and number of each option that is assigned, in their order."""
    values: dict[str, float] = {}
    assignments = [node for node in ast.walk(program) if isinstance(node, ast.Assign)]
    for node in sorted(assignments, key=lambda node: node.lineno):
        if (value := _value(node.value, values)) is None:
            continue
        for target in node.targets:
            if isinstance(target, ast.Name):
                values[target.id] = value
            elif isinstance(target, ast.Attribute) and target.attr in _READ:
                yield target.attr, value


def _value(node: ast.expr, values: Mapping[str, float]) -> float | None:
    """Number of an expression; None: it is none of numbers, known names, sums, products and roundings."""
    parts: list[ast.expr] = []
    apply: Callable[..., Any] | None = None
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, (int, float)) else None
    if isinstance(node, ast.Name):
        return values.get(node.id)
    if isinstance(node, ast.BinOp):
        parts, apply = [node.left, node.right], _OPERATIONS.get(type(node.op))
    elif isinstance(node, ast.UnaryOp):
        parts, apply = [node.operand], _OPERATIONS.get(type(node.op))
    elif isinstance(node, ast.Call) and len(node.args) == 1:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        parts, apply = node.args, _FUNCTIONS.get(name)
    operands = [_value(part, values) for part in parts]
    if apply is None or None in operands:
        return None
    try:
        return float(apply(*operands))
    except (ArithmeticError, ValueError):
        return None


def _solver(program: ast.Module) -> str:
    """Name of the solver type that ``SolveDynamic`` is called with; empty: none is given."""
    for node in ast.walk(program):
        for keyword in node.keywords if isinstance(node, ast.Call) else ():
            if keyword.arg == "solverType" and isinstance(keyword.value, ast.Attribute):
                return keyword.value.attr
    return ""
