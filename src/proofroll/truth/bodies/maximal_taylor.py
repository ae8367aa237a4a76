"""Equations of route 2 as symbols, integrated by Taylor series (heyoka, an extra).

Their elimination needs linearly independent rows. Of redundant rows some are chosen, and others as soon as these come
near to dependence.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from proofroll.core.errors import Diverged, Missing
from proofroll.core.pace import PACE
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import SMOOTH
from proofroll.truth.bodies.constraint_rows import ConstraintRow
from proofroll.truth.bodies.maximal_equations import ConstrainedEquations, MaximalEquations
from proofroll.truth.numerics.compiled_once import heyoka
from proofroll.truth.numerics.elimination import Row, eliminated
from proofroll.truth.numerics.scalars import Scalar, sub

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
        state, rates = _in_symbols(equations, rows, None if heyoka is None else heyoka.time)
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
            OutOfTime: the truth has taken the processor time that it may.
        """
        integrator = self._integrator
        self._begin(time, state)
        states: list[Array] = []
        while len(states) < len(times):
            begun, left = integrator.time, np.longdouble(times[-1]) - integrator.time
            PACE.reached(float(begun))
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
    state, rates = _in_symbols(equations, rows)
    function = heyoka.cfunc([_expression(value, float) for value in rates], state, compact_mode=True)
    return lambda states: np.asarray(function(np.ascontiguousarray(states.T)).T)


def _in_symbols(equations: MaximalEquations, rows: Sequence[int], time: Any = None) -> tuple[list[Any], list[Scalar]]:
    """Variables of a state, with a time of their own unless there is one, and its rates as expressions in them.

    Raises:
        Missing: heyoka is not installed.
    """
    if heyoka is None:
        raise Missing("compiled equations need heyoka: pip install 'proofroll[fast]'")
    functions = {name: getattr(heyoka, name) for name in SMOOTH}
    state = [heyoka.make_vars(f"s{index}") for index in range(len(equations.start()))]
    own_time = [heyoka.make_vars("t")] if time is None else []
    at_state = equations.at(state, functions, time=own_time[0] if own_time else time)
    system = BodySystem(equations, at_state, [at_state.rows[k] for k in rows], number=_exact)
    acceleration = system.accelerated(at_state.force)[0]
    return [*state, *own_time], [*at_state.rate, *acceleration, *at_state.angle_rate]


def _exact(value: float) -> Any:
    """A number in long doubles."""
    return heyoka.expression(np.longdouble(value))


def _expression(value: Scalar, number: Any) -> Any:
    return value if isinstance(value, heyoka.expression) else heyoka.expression(number(value))


class BodySystem:
    """Linear system M u̇ − Cᵀλ − Pᵀz = loads, C u̇ = −bias, K u̇ = aims of bodies in one state, in scalars.

    An armature is a further row with the compliance 1/inertia. Bodies without inertia, whose M is singular, have their
    accelerations eliminated after those rows and before all multipliers: no pivot is zero then, as M plus the drives is
    positive definite.

    Args:
        equations: of the mechanism.
        constrained: these at one state.
        joints: linearly independent rows C that imply all others.
        contacts: rows K, and loads P along u by a unit of each one's force.
        number: of a float as a scalar in whose arithmetic inertias are eliminated: rounded apart, forces and
            accelerations would not fit each other to the last digit of long doubles.
    """

    def __init__(
        self,
        equations: MaximalEquations,
        constrained: ConstrainedEquations,
        joints: Sequence[ConstraintRow],
        contacts: Sequence[tuple[Row, Row]] = (),
        number: Callable[[float], Scalar] = float,
    ) -> None:
        drives, light = [*constrained.drives, *constrained.holders], set(equations.light)
        self._held = [*joints, *(drive.row for drive in drives)]
        self._nu, self._joints, self._first = equations.nu, len(joints), equations.nu + len(self._held)
        pairs = [*((row.coefficients, row.coefficients) for row in self._held), *contacts]
        self._rows: list[Row] = [
            *({k: number(float(value)) for k, value in enumerate(line) if value} for line in equations.mass_matrix),
            *(dict(row) for row, _ in pairs),
        ]
        for place, (_, push) in enumerate(pairs, self._nu):
            for k, value in push.items():
                self._rows[k][place] = value
        for place, drive in enumerate(drives, self._nu + self._joints):
            self._rows[place][place] = -1.0 / number(drive.inertia)
        self._symmetric = all(row is push for row, push in contacts)
        turns = [2 if k in light else 0 for k in range(self._nu)] + [3] * len(joints) + [1] * len(drives)
        turns += [4] * len(contacts)
        self._after = [{j for j in row if turns[j] < turn} for row, turn in zip(self._rows, turns, strict=True)]
        self._after[self._first :] = [set(range(self._first))] * len(contacts)

    def accelerated(
        self, loads: Sequence[Scalar], aims: Sequence[Scalar] = ()
    ) -> tuple[list[Scalar], list[Scalar], list[Scalar], list[Scalar]]:
        """Accelerations u̇, multipliers λ, forces z of contacts, and the pivots of these; ``aims``: of contacts."""
        right = [*loads, *(sub(0.0, row.bias) for row in self._held), *aims]
        (answer,), pivots = eliminated(self._rows, [right], self._after, symmetric=self._symmetric)
        forces = [sub(0.0, value) for value in answer[self._nu :]]
        count = self._first - self._nu
        return answer[: self._nu], forces[: self._joints], forces[count:], pivots[self._first :]

    def pivots(self) -> list[Scalar]:
        """Pivots of the contacts."""
        return eliminated(self._rows, [], self._after, symmetric=self._symmetric)[1][self._first :]

    def responses(self, pushes: Sequence[Row]) -> list[list[Scalar]]:
        """Accelerations by some loads alone, without what velocities bring."""
        rights = [[push.get(k, 0.0) for k in range(len(self._rows))] for push in pushes]
        return [answer[: self._nu] for answer in eliminated(self._rows, rights, self._after, symmetric=True)[0]]
