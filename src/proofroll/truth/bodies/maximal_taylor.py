"""Equations of route 2 as symbols, integrated by Taylor series (heyoka, an extra).

The multipliers are eliminated symbolically: C M⁻¹ Cᵀ = L D Lᵀ, sparse, in an order of little fill. That needs linearly
independent rows. Of redundant rows some are chosen, and others as soon as these come near to dependence.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.errors import Diverged, Missing
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import SMOOTH
from proofroll.truth.bodies.constraint_rows import ConstraintRow
from proofroll.truth.bodies.maximal_equations import ConstrainedEquations, MaximalEquations
from proofroll.truth.numerics.scalars import Scalar, add, is_zero, mul, sub

try:
    import heyoka
except ImportError:  # no wheel for this platform
    heyoka = None


# Integrator, time [s] and state before each step.
Visited = list[tuple["MaximalTaylor", Scalar, Array]]


class MaximalTaylor:
    """Compiled integrator of a mechanism, in long doubles; every run starts anew.

    Args:
        equations: of the mechanism.
        rows: indices of linearly independent constraint rows that imply all others.

    Raises:
        Missing: heyoka is not installed.
    """

    def __init__(self, equations: MaximalEquations, rows: Sequence[int]) -> None:
        if heyoka is None:
            raise Missing("Taylor series need heyoka: pip install 'proofroll[fast]'")
        state, rates = _in_symbols(equations, rows, heyoka.time)
        self._start = equations.start().astype(np.longdouble)
        self._integrator = heyoka.taylor_adaptive(
            [(name, _expression(value, np.longdouble)) for name, value in zip(state, rates, strict=True)],
            self._start,
            fp_type=np.longdouble,
            compact_mode=True,
            opt_level=0,  # optimised code takes two to ten times as long to compile, which no run earns back
        )

    def start(self) -> Any:
        """State at the start."""
        return self._start.copy()

    def run_while(
        self,
        sound: Callable[[Array], bool],
        time: Scalar,
        state: Array,
        times: Sequence[float],
        visited: Visited | None = None,
    ) -> tuple[Scalar, Array, list[Array]]:
        """Steps from a time [s] and a state to the last of ``times``, or to the end of the first unsound step.

        ``visited`` takes this integrator, and time [s] and state before each step; None: they are not kept.

        Returns:
            Time and state at the end, and states at those of ``times`` that are not after it.

        Raises:
            Diverged: the integration stops before the last time.
        """
        integrator = self._integrator
        self._begin(time, state)
        states: list[Array] = []
        while len(states) < len(times):
            begun, left = integrator.time, np.longdouble(times[-1]) - integrator.time
            if visited is not None:
                visited.append((self, begun, integrator.state.copy()))
            _, step = integrator.step(max_delta_t=left, write_tc=True)
            if not np.isfinite(np.asarray(integrator.state, dtype=float)).all() or (step == 0 and left > 0):
                text = f"Taylor series stop at t = {float(begun):.6g} s: the motion has no finite derivatives there"
                raise Diverged(text, float(begun))
            last = step == left
            while len(states) < len(times) and (last or np.longdouble(times[len(states)]) <= integrator.time):
                states.append(integrator.update_d_output(np.longdouble(times[len(states)])).copy())
            if not last and not sound(np.asarray(integrator.state, dtype=float)):
                break
        return integrator.time, integrator.state.copy(), states

    def inside(self, time: Scalar, state: Array, end: Scalar, times: Array) -> Array:
        """States at times [s] within the step from a time and state to ``end`` [s], which is taken again."""
        self._begin(time, state)
        self._integrator.step(max_delta_t=end - time, write_tc=True)
        return np.array([self._integrator.update_d_output(np.longdouble(t)).copy() for t in times], dtype=float)

    def _begin(self, time: Scalar, state: Array) -> None:
        self._integrator.state[:] = state
        self._integrator.time = np.longdouble(time)


def compiled_rates(equations: MaximalEquations, rows: Sequence[int]) -> Callable[[Array], Array]:
    """Compiled rates of many states at once; the last column is the time [s]: (states, n + 1) -> (states, n).

    Raises:
        Missing: heyoka is not installed.
    """
    if heyoka is None:
        raise Missing("compiled equations need heyoka: pip install 'proofroll[fast]'")
    time = heyoka.make_vars("t")
    state, rates = _in_symbols(equations, rows, time)
    function = heyoka.cfunc([_expression(value, float) for value in rates], [*state, time], compact_mode=True)
    return lambda states: np.asarray(function(np.ascontiguousarray(states.T)).T)


def compiled_powers(
    equations: MaximalEquations, rows: Sequence[int], forces: Sequence[tuple[str, int, int]]
) -> Callable[[Array], Array]:
    """Compiled powers of efforts and drives at many states; the last column is the time [s]: (states, n + 1) -> [W].

    ``forces``: field (``effort`` or ``drive``), index of the actuator or prescribed motion, and index of the joint.

    Raises:
        Missing: heyoka is not installed, or a drive is not among the independent ``rows``.
    """
    if heyoka is None:
        raise Missing("compiled equations need heyoka: pip install 'proofroll[fast]'")
    functions, time = {name: getattr(heyoka, name) for name in SMOOTH}, heyoka.make_vars("t")
    state = [heyoka.make_vars(f"s{index}") for index in range(len(equations.start()))]
    at_state = equations.at(state, functions, time=time)
    moved = {number: at_state.moved.start + number for field, number, _ in forces if field == "drive"}
    if not set(moved.values()) <= set(rows):
        raise Missing("a drive whose force is not determined by independent rows")
    multipliers = _solution(equations, at_state, [at_state.rows[k] for k in rows])[1] if moved else []
    u, powers = state[equations.nx : equations.nx + equations.nu], list[Scalar]()
    made = equations.rate_rows(state, [joint for _, _, joint in forces], functions)
    for (field, number, _), row in zip(forces, made, strict=True):
        rate = add(*(mul(value, u[k]) for k, value in row.coefficients.items()))
        force = at_state.efforts[number] if field == "effort" else multipliers[list(rows).index(moved[number])]
        powers.append(mul(force, rate))
    function = heyoka.cfunc([_expression(value, float) for value in powers], [*state, time], compact_mode=True)
    return lambda states: np.asarray(function(np.ascontiguousarray(states.T)).T)


def _in_symbols(equations: MaximalEquations, rows: Sequence[int], time: Any) -> tuple[list[Any], list[Scalar]]:
    """Variables of a state, and its rates as expressions in them."""
    state = [heyoka.make_vars(f"s{index}") for index in range(len(equations.start()))]
    at_state = equations.at(state, {name: getattr(heyoka, name) for name in SMOOTH}, time=time)
    u_rate = accelerations(equations, at_state, [at_state.rows[k] for k in rows])
    return state, [*at_state.rate, *u_rate, *at_state.angle_rate]


def accelerations(
    equations: MaximalEquations, constrained: ConstrainedEquations, rows: Sequence[ConstraintRow]
) -> list[Scalar]:
    """Accelerations u̇ = M⁻¹(force + Cᵀλ), see :func:`_solution`."""
    return _solution(equations, constrained, rows)[0]


def _solution(
    equations: MaximalEquations, constrained: ConstrainedEquations, rows: Sequence[ConstraintRow]
) -> tuple[list[Scalar], list[Scalar]]:
    """Accelerations, and multipliers λ of the rows: (C M⁻¹ Cᵀ) λ = −bias − C M⁻¹ force, solved sparsely in scalars.

    A drive is an additional row with compliance 1/inertia. Accelerations u̇₀ of bodies without inertia, whose M is
    singular, are additional unknowns: C₀ᵀλ − M₀u̇₀ = −force₀.
    """
    row_count, drives = len(rows), [*constrained.drives, *constrained.holders]
    rows = [*rows, *(drive.row for drive in drives)]
    blocks = _inverse_blocks(equations)
    free = [add(*(mul(value, constrained.force[k]) for k, value in block)) for block in blocks]
    weighted = [_times(row.coefficients, blocks) for row in rows]  # rows of C M⁻¹
    m = len(rows)
    touching = [set(weight) for weight in weighted]
    A: dict[tuple[int, int], Scalar] = {}
    for i in range(m):
        for j in range(i + 1):
            shared = touching[i] & rows[j].coefficients.keys()
            if shared:
                A[i, j] = add(*(mul(weighted[i][k], rows[j].coefficients[k]) for k in sorted(shared)))
    for i, drive in enumerate(drives, row_count):
        A[i, i] = add(A.get((i, i), 0.0), 1.0 / drive.inertia)
    predecessors = _of_light_bodies(A, equations, rows, row_count)
    right = [
        sub(sub(0.0, row.bias), add(*(mul(value, free[k]) for k, value in row.coefficients.items()))) for row in rows
    ]
    right += [sub(0.0, constrained.force[k]) for k in equations.light]
    unknowns = _solved(A, right, predecessors)
    result = list(free)
    for weight, multiplier in zip(weighted, unknowns, strict=False):
        for k, value in weight.items():
            result[k] = add(result[k], mul(value, multiplier))
    for k, value in zip(equations.light, unknowns[m:], strict=True):
        result[k] = value
    return result, unknowns[:row_count]


def _of_light_bodies(
    A: dict[tuple[int, int], Scalar], equations: MaximalEquations, rows: Sequence[ConstraintRow], row_count: int
) -> dict[int, set[int]]:
    """Adds the columns of u̇₀ to A; returns the unknowns that must be eliminated before each unknown.

    Drives come before the accelerations that they hold, these before the multipliers of the first ``row_count`` rows.
    Then no pivot is zero, as M plus the drives is positive definite.
    """
    predecessors: dict[int, set[int]] = {}
    for p, k in enumerate(equations.light, len(rows)):
        for i, row in enumerate(rows):
            if k in row.coefficients:
                A[p, i] = row.coefficients[k]
                later, earlier = (i, p) if i < row_count else (p, i)
                predecessors.setdefault(later, set()).add(earlier)
        for column, index in enumerate(equations.light[: p - len(rows) + 1], len(rows)):
            A[p, column] = -float(equations.mass_matrix[k, index])
    return predecessors


def _inverse_blocks(equations: MaximalEquations) -> list[list[tuple[int, float]]]:
    """Rows of M⁻¹ by their nonzero entries; empty for bodies without inertia."""
    blocks: list[list[tuple[int, float]]] = [[] for _ in range(equations.nu)]
    for body, part in zip(equations.bodies, equations.u_slices, strict=True):
        if body.heavy:
            inverse = np.linalg.inv(body.mass_matrix)
            for i, row in enumerate(inverse):
                blocks[part.start + i] = [(part.start + k, float(row[k])) for k in np.flatnonzero(row).tolist()]
    return blocks


def _times(coefficients: dict[int, Scalar], blocks: list[list[tuple[int, float]]]) -> dict[int, Scalar]:
    product: dict[int, Scalar] = {}
    for i, coefficient in coefficients.items():
        for k, value in blocks[i]:
            product[k] = add(product.get(k, 0.0), mul(value, coefficient))
    return {k: value for k, value in product.items() if not is_zero(value)}


def _solved(
    A: dict[tuple[int, int], Scalar], right: list[Scalar], predecessors: Mapping[int, set[int]]
) -> list[Scalar]:
    """Solution x of the symmetric A x = right; A holds the lower triangle.

    Pivots have the fewest neighbours; ``predecessors``: unknown -> unknowns that must be eliminated before it.
    """
    entries = {frozenset(pair): value for pair, value in A.items() if not is_zero(value)}
    neighbours: dict[int, set[int]] = {i: set() for i in range(len(right))}
    for pair in entries:
        if len(pair) == 2:
            i, j = pair
            neighbours[i].add(j)
            neighbours[j].add(i)
    b, order, factors = list(right), [], []
    while neighbours:
        ready = (
            neighbours
            if not predecessors
            else [i for i in neighbours if predecessors.get(i, set()).isdisjoint(neighbours)]
        )
        pivot = min(ready, key=lambda i: (len(neighbours[i]), i))
        others = sorted(neighbours.pop(pivot))
        diagonal = entries[frozenset([pivot])]
        factor = {i: entries[frozenset([pivot, i])] / diagonal for i in others}
        for index, i in enumerate(others):
            neighbours[i].discard(pivot)
            for j in others[: index + 1]:
                key = frozenset([i, j])
                entries[key] = sub(entries.get(key, 0.0), mul(factor[i], entries[frozenset([pivot, j])]))
                if i != j:
                    neighbours[i].add(j)
                    neighbours[j].add(i)
            b[i] = sub(b[i], mul(factor[i], b[pivot]))
        b[pivot] = 0.0 if is_zero(b[pivot]) else b[pivot] / diagonal
        order.append(pivot)
        factors.append(factor)
    for pivot, factor in zip(reversed(order), reversed(factors), strict=True):
        b[pivot] = sub(b[pivot], add(*(mul(value, b[i]) for i, value in factor.items())))
    return b


def _expression(value: Scalar, number: Any) -> Any:
    return value if isinstance(value, heyoka.expression) else heyoka.expression(number(value))
