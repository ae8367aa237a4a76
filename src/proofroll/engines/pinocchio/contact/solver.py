"""Pinocchio's frictional contact solvers, and the largest coefficient that each takes."""

from typing import Any, NamedTuple

import pinocchio as pin

# Pinocchio's cone needs a number for unbounded friction. PGS accepts any; the iterations of ADMM grow with it.
LARGEST_FRICTION = {"pgs": 1e6, "admm": 1e2}
# Pinocchio's limit of 1000 is reached at tight tolerances where the normal force is small.
_ADMM_ITERATIONS = 10_000


class SolverParts(NamedTuple):
    """Pinocchio's objects for a subset of contacts and joint rows: constraints, solver, its options and result."""

    points: list[Any]
    point_datas: list[Any]
    models: Any
    datas: Any
    solve: Any
    options: Any
    result: Any


def solver_of(kind: str, tolerance: float, size: int = 3) -> tuple[Any, Any, Any]:
    """Solver, its options and its result object for ``size`` rows."""
    if kind == "pgs":
        solver, options, result = pin.PGSConstraintSolver(size), pin.PGSSolverSettings(), pin.PGSSolverResult()
    else:
        solver, options, result = pin.ADMMConstraintSolver(size), pin.ADMMSolverSettings(), pin.ADMMSolverResult()
        options.max_iterations = _ADMM_ITERATIONS
    for name in ("feasibility", "complementarity"):
        for bound in ("absolute", "relative"):
            setattr(options, f"{bound}_{name}_tol", tolerance)
    return solver, options, result
