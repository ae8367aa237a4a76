"""Route 2 of the truth: separate bodies held by constraint rows, without joint coordinates and tree.

It shares no kinematics with route 1. Taylor series (heyoka) integrate it; without heyoka, or with dependent rows,
DOP853 with projection: the rank is fixed at the start, and violations are eliminated after each step.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import qr
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import uneven
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.link_forces import working, working_joints
from proofroll.elements.mechanism.dynamics.named_forces import joint_force_shares, lengths, named_forces, pick_named
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.kinks import Functions
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.walls.formula import RecordedProgram, cos, sin
from proofroll.truth.bodies.constraint_rows import ConstraintRow
from proofroll.truth.bodies.maximal_equations import FUNCTIONS, ConstrainedEquations, MaximalEquations, Switched
from proofroll.truth.bodies.maximal_taylor import MaximalTaylor, Visited
from proofroll.truth.numerics.scalars import Scalar

# Initial displacement for growth, m, rad and relative to velocities: far above round-off, small if grown by 1e7.
BESIDE = 1e-9
RANK = 1e-8  # see analysis.RANK; this route determines its own rank
# Least singular value of chosen rows relative to that of all rows, below which other rows are chosen. Each factor of
# ten costs a digit of the accelerations; a choice by pivoting begins above 0.1, and is compiled anew, in seconds.
WEAKEST = 0.02
_TOGETHER = 500  # states whose rows are formed at once: as many as memory holds for any mechanism


@dataclass(frozen=True)
class Solved:
    """Accelerations u̇ and multipliers at a state, or at several along a first axis, with the way to remove violations.

    Attributes:
        equations: rows and loads at this state.
        acceleration: u̇, (nu).
        multipliers: one for each row.
        C: all rows, (rows, nu).
        residual: Φ of the rows.
        into, back: −into @ back @ r is the change along u that removes a violation r of the rows.
    """

    equations: ConstrainedEquations
    acceleration: Array
    multipliers: Array
    C: Array
    residual: Array
    into: Array
    back: Array


class NumericEquations:
    """Equations of :class:`MaximalEquations` in numbers, solved by projection with a fixed rank."""

    def __init__(self, equations: MaximalEquations) -> None:
        self.equations = equations
        self._switched: Switched | None = None
        self.functions: Functions = FUNCTIONS  # of formulas, which may hold the sides of their kinks
        mass = equations.mass_matrix.copy()
        mass[equations.light, equations.light] += max(equations.usual)  # only the scale of the rows depends on it
        self._inverse_root = np.linalg.inv(np.linalg.cholesky(mass)).T
        self.rank = int(self.ranks(self.equations.start()))

    def switched(self, switched: Switched, rank: int, functions: Functions) -> NumericEquations:
        """Copy of the equations with joints held or pushed; ``rank``: of all rows, with those of held joints."""
        equations = copy(self)
        equations._switched, equations.rank, equations.functions = switched, rank, functions
        return equations

    def ranks(self, state: Array, switched: Switched | None = None) -> Array:
        """Rank of the rows at a state, or at each of several, with those of held joints."""
        C = self._matrix(self.equations.at(_scalars(state), switched=switched).rows, state.shape[:-1])
        values = np.linalg.svd(C @ self._inverse_root, compute_uv=False) if C.size else np.zeros((*state.shape[:-1], 0))
        # rows that hold a planar body in its plane are none at all, but for round-off of a turned frame
        unit = float(np.linalg.svd(self._inverse_root, compute_uv=False)[-1])
        return np.asarray((values > RANK * values.max(-1, keepdims=True, initial=unit)).sum(axis=-1))

    def independent_rows(self, state: Array | None = None) -> tuple[int, ...]:
        """Indices of linearly independent rows, as many as the rank, chosen by pivoting at a state, or at the start."""
        C = self._weighted(self.equations.start() if state is None else state)
        if not C.size:
            return ()
        return tuple(sorted(qr(C.T, mode="r", pivoting=True)[1][: self.rank].tolist()))

    @property
    def redundant(self) -> bool:
        """True if some rows follow from the others."""
        return len(self._weighted(self.equations.start())) > self.rank

    def moved_alone(self) -> bool:
        """True if each row of a prescribed motion is independent of all others at the start."""
        moved, C = self.equations.at(self.equations.start().tolist()).moved, self._weighted(self.equations.start())

        def rank(rows: Array) -> int:
            return int(np.linalg.matrix_rank(rows, RANK * float(np.abs(C).max()))) if len(rows) else 0

        return all(rank(np.delete(C, k, 0)) < self.rank for k in range(moved.start, moved.stop))

    def independence(self, rows: Sequence[int], state: Array) -> float:
        """Least singular value of some rows at a state, relative to that of all rows without the redundant ones."""
        C = self._recorded(state.tolist())[0] @ self._inverse_root
        whole, chosen = (np.linalg.svd(matrix, compute_uv=False) for matrix in (C, C[list(rows)]))
        return float(chosen[-1] / whole[self.rank - 1]) if self.rank else 1.0  # all rows may be round-off

    @cached_property
    def _recorded(self) -> Callable[[Sequence[float]], list[Array]]:
        """Function of a state that gives its rows, recorded as plain assignments, for they are asked for often."""
        equations, functions = self.equations, {**FUNCTIONS, "sin": sin, "cos": cos}
        program = RecordedProgram(len(equations.start()))
        rows = equations.lasting_rows(equations.views(program.symbols, functions), functions)
        return program.arrays([self._matrix(rows, kind=object)])

    def _weighted(self, state: Array) -> Array:
        """Rows at a state, with velocities weighted by inertia."""
        return self._matrix(self.equations.lasting_rows(self.equations.views(state.tolist()))) @ self._inverse_root

    def solve(self, state: Array, time: float | Array = 0.0, applied: Array | None = None) -> Solved:
        """Accelerations and multipliers at a state and a time [s], or at several; those of dependent rows are least.

        ``applied``: further forces and moments about the centres of mass, world axes, (…, bodies, 6).
        """
        constrained = self.equations.at(_scalars(state), self.functions, switched=self._switched, time=time)
        shape = state.shape[:-1]
        C, (half, force) = self._matrix(constrained.rows, shape), self._driven(constrained, shape)
        if applied is not None:
            wrenches = [_scalars(applied[..., body, :]) for body in range(applied.shape[-2])]
            force = force + _stacked(self.equations.projected(constrained.views, wrenches), shape)
        free = _product(half.swapaxes(-1, -2), force)
        residual = _stacked([row.residual for row in constrained.rows], shape)
        if self._switched is not None and self._switched.held:
            residual[..., -len(self._switched.held) :] = 0.0  # held where they are, not at zero
        if not self.rank:
            into, back = np.zeros((*half.shape[:-1], 0)), np.zeros((0, C.shape[-2]))
            multipliers = np.zeros(C.shape[:-1])
            return Solved(constrained, _product(half, free), multipliers, C, residual=residual, into=into, back=back)
        weighted = C @ half
        sizes = np.linalg.norm(weighted, axis=-1)
        # rows of light rotors and of heavy frames alike; rows that are round-off stay so
        even = 1 / np.where(sizes > RANK * sizes.max(axis=-1, keepdims=True), sizes, 1.0)
        U, S, Vt = np.linalg.svd(even[..., None] * weighted, full_matrices=False)
        locked = Vt[..., : self.rank, :]
        back = U[..., : self.rank].swapaxes(-1, -2) / S[..., : self.rank, None] * even[..., None, :]
        bias = _stacked([row.bias for row in constrained.rows], shape)
        normal = _product(-back, bias) - _product(locked, free)
        into = half @ locked.swapaxes(-1, -2)
        acceleration = _product(half, free) + _product(into, normal)
        multipliers = _product(back.swapaxes(-1, -2), normal)
        return Solved(constrained, acceleration, multipliers, C, residual=residual, into=into, back=back)

    def loaded(
        self, state: Array, time: float = 0.0, switched: Switched | None = None
    ) -> tuple[ConstrainedEquations, Array, Array, Array, Array]:
        """Equations at a state and a time [s], their rows C and biases, H with M⁻¹ = H Hᵀ, and the loads."""
        constrained = self.equations.at(state.tolist(), self.functions, switched=switched, time=time)
        bias = np.array([row.bias for row in constrained.rows], dtype=float)
        return constrained, self._matrix(constrained.rows), bias, *self._driven(constrained)

    def _driven(self, constrained: ConstrainedEquations, shape: tuple[int, ...] = ()) -> tuple[Array, Array]:
        """H with M⁻¹ = H Hᵀ, and loads; both include the armature of joints."""
        half, force = self._inverse_root, _stacked(constrained.force, shape)
        if added := [*constrained.drives, *constrained.holders]:
            G = self._matrix([drive.row for drive in added], shape)
            inertia, back = np.array([drive.inertia for drive in added]), G.swapaxes(-1, -2)
            half = np.linalg.inv(np.linalg.cholesky(self.equations.mass_matrix + (back * inertia) @ G)).swapaxes(-1, -2)
            force = force - _product(back, inertia * _stacked([drive.row.bias for drive in added], shape))
        return half, force

    def along(self, state: Array, joints: Sequence[int]) -> tuple[Array, Array]:
        """Coordinates and rates of joints with one coordinate at a state, or at several, rad or m and per s.

        Angles that are integrated count whole turns.
        """
        e, shape = self.equations, state.shape[:-1]
        rows = e.rate_rows(_scalars(state), joints)
        rates = _product(self._matrix(rows, shape), state[..., e.nx : e.nx + e.nu])
        kept = {number: state[..., e.nx + e.nu + index] for index, (number, _) in enumerate(e.angles)}
        places = [kept.get(number, row.residual) for number, row in zip(joints, rows, strict=True)]
        return _stacked(places, shape), rates

    def poses(self, state: Array, functions: Functions = FUNCTIONS) -> tuple[Array, Array, Array, Array]:
        """Places, velocities, rotations and angular velocities at a state or several, (…, bodies, …), world axes."""
        R, r, v, w = self.placed(self.normalised(state), functions)
        arm = np.einsum("...nij,nj->...ni", R, np.array([body.com for body in self.equations.mechanism.bodies]))
        return r - arm, v - np.cross(w, arm), R, w

    def placed(self, state: Array, functions: Functions = FUNCTIONS) -> tuple[Array, Array, Array, Array]:
        """Rotations, centres of mass, their velocities and angular velocities of all bodies, each (…, bodies, …)."""
        views, shape = self.equations.views(_scalars(state), functions)[:-1], state.shape[:-1]
        if not shape:
            R, r, v, w = (np.array([getattr(view, name) for view in views], dtype=float) for name in "Rrvw")
            return R, r, v, w
        R = np.stack([np.stack([_stacked(row, shape) for row in view.R], -2) for view in views], -3)
        r, v, w = (np.stack([_stacked(getattr(view, name), shape) for view in views], -2) for name in "rvw")
        return R, r, v, w

    def normalised(self, state: Array) -> Array:
        """State, or states, (…, n), with quaternions of unit length."""
        state = state.copy()
        for body, part in zip(self.equations.bodies, self.equations.x_slices, strict=True):
            if body.nx == 7:
                state[..., part][..., 3:] /= np.linalg.norm(state[..., part][..., 3:], axis=-1, keepdims=True)
        return state

    def rate(self, time: float, state: Array) -> Array:
        """Time derivative of a state."""
        e, unit = self.equations, self.normalised(state)
        solved = self.solve(unit, time)
        x, u = state[: e.nx], unit[e.nx : e.nx + e.nu]
        return np.array([*self.moving(x, u), *solved.acceleration, *solved.equations.angle_rate], dtype=float)

    def moving(self, x: Array, u: Array) -> Array:
        """Rates of the coordinates x at velocities u."""
        e = self.equations
        bodies = zip(e.bodies, e.x_slices, e.u_slices, strict=True)
        rates = [rate for body, at_x, at_u in bodies for rate in body.rate(x[at_x].tolist(), u[at_u].tolist())]
        return np.array(rates, dtype=float)

    def eliminated(self, state: Array) -> Array:
        """State without violations of rows and of unit quaternions."""
        e, state = self.equations, self.normalised(state)
        solved = self.solve(state)
        u = state[e.nx : e.nx + e.nu]
        back = -solved.into @ (solved.back @ solved.residual)
        state[: e.nx] += self.moving(state[: e.nx], back)
        u -= solved.into @ (solved.back @ solved.equations.opening(solved.C @ u))
        return self.normalised(state)

    def beside(self, state: Array, by: float) -> Array:
        """State displaced by about ``by``, m and rad, with velocities changed by that fraction, as the rows allow."""
        e, state = self.equations, state.copy()
        ways = by * uneven(e.nu)
        state[: e.nx] += self.moving(state[: e.nx], ways)
        state[e.nx : e.nx + e.nu] *= 1.0 + ways
        for _ in range(3):  # Newton's method doubles the number of digits
            state = self.eliminated(state)
        return state

    def _matrix(self, rows: Sequence[ConstraintRow], shape: tuple[int, ...] = (), kind: type = float) -> Array:
        C = np.zeros((*shape, len(rows), self.equations.nu), dtype=kind)
        for number, row in enumerate(rows):
            for index, value in row.coefficients.items():
                C[..., number, index] = value
        return C


def _scalars(state: Array) -> list[Scalar]:
    """Scalars of a state, or of several, (states, n): numbers, or arrays over the states."""
    return list(state.T) if state.ndim > 1 else state.tolist()


def _stacked(values: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Array (…, values) of scalars, each a number or an array of the shape."""
    if not shape:
        return np.array(values, dtype=float)
    array = np.empty((*shape, len(values)))
    for number, value in enumerate(values):
        array[..., number] = value
    return array


def _product(matrix: Array, vector: Array) -> Array:
    """Products of matrices (…, m, n) and vectors (…, n)."""
    return np.asarray(matrix @ vector if vector.ndim == 1 else (matrix @ vector[..., None])[..., 0])


class MaximalCoordinates:
    """Route 2 of one mechanism.

    Args:
        mechanism: any mechanism.
        equations: class of its equations.
    """

    def __init__(self, mechanism: Mechanism, equations: type[MaximalEquations] = MaximalEquations) -> None:
        self.mechanism = mechanism
        self.lean = NumericEquations(equations(mechanism, allow_planar=True))
        self._whole = NumericEquations(equations(mechanism, allow_planar=False))
        self._compiled: dict[tuple[int, ...], MaximalTaylor] = {}

    def taylor(self, rows: tuple[int, ...]) -> MaximalTaylor:
        """Compiled integrator with some rows; a first call compiles, in seconds.

        Raises:
            Missing: heyoka is not installed.
        """
        if rows not in self._compiled:
            self._compiled[rows] = MaximalTaylor(self.lean.equations, rows)
        return self._compiled[rows]

    def taylor_states(self, times: Array, start: Array | None = None, visited: Visited | None = None) -> Array:
        """States at the given times, s, (times, state), by Taylor series, from the mechanism's own start or another.

        Of redundant rows others are chosen where the present ones come near to dependence.

        Raises:
            Missing: heyoka is not installed.
            Diverged: the integration stops before the last time.
        """
        rows, redundant = self.lean.independent_rows(), self.lean.redundant
        time, states = 0.0, list[Array]()
        state = self.taylor(rows).start() if start is None else start

        def sound(state: Array) -> bool:
            return not redundant or self.lean.independence(rows, state) > WEAKEST

        while len(states) < len(times):
            left = times[len(states) :].tolist()
            time, state, passed = self.taylor(rows).run_while(sound, time, state, left, visited)
            states += passed
            rows = self.lean.independent_rows(np.asarray(state, dtype=float)) if redundant else rows
        return np.array(states)

    def at_start(self) -> Record:
        """Poses of this route at time 0."""
        return self.recorded(np.zeros(1), self.lean.equations.start()[None])

    def recorded(
        self,
        times: Array,
        states: Array,
        switched: Sequence[Switched] | None = None,
        applied: Sequence[Array] | None = None,
        functions: Functions = FUNCTIONS,
    ) -> Record:
        """Record of the states, with the modes of switched joints; reactions follow from the rows in space.

        ``applied``: additional forces and moments about the centres of mass, world axes, (bodies, 6). ``functions``: of
        formulas, which may hold the sides of kinks.
        """
        lean = self.lean.equations
        units, n = self.lean.normalised(states), len(self.mechanism.bodies)
        R, r, v, w = self.lean.placed(units)
        whole = self._complete(R, r, v, w, units[:, lean.nx + lean.nu :])
        arms = np.stack([_product(R[:, k], np.array(body.com)) for k, body in enumerate(self.mechanism.bodies)], axis=1)
        loads = None if applied is None else np.array(applied)
        wrench = np.zeros((len(times), len(self._whole.equations.connections), 6))
        named, residual = np.zeros((len(times), len(named_forces(self.mechanism)))), np.zeros((len(times), 2))
        u = whole[:, self._whole.equations.nx :][:, : self._whole.equations.nu]
        for chosen, mode, rank in self._alike(whole, [Switched()] * len(times) if switched is None else switched):
            equations = self._whole.switched(mode, rank, functions)
            solved = equations.solve(whole[chosen], times[chosen], None if loads is None else loads[chosen])
            opening = solved.equations.opening(_product(solved.C, u[chosen]))
            wrench[chosen], named[chosen] = self._wrenches(solved), self._named(solved, mode)
            for k, violated in enumerate((solved.residual, opening)):
                residual[chosen, k] = np.abs(violated).max(axis=-1, initial=0.0)
        record = Record(
            time=times,
            p_WB=r - arms,
            v_WB=v - np.cross(w, arms),
            q_WB=whole[:, : 7 * n].reshape(-1, n, 7)[..., 3:],
            w_WB=w,
            q=np.zeros((len(times), 0)),  # set below, from the poses at all times
            v=np.zeros((len(times), 0)),
            wrench=wrench,
            named=named,
            residual=residual,
        )
        q, v = record.placed(self.mechanism).of_tree()
        return replace(record, q=q, v=v)

    def _alike(self, whole: Array, switched: Sequence[Switched]) -> Iterator[tuple[list[int], Switched, int]]:
        """Groups of states with the same joints held and efforts clamped: numbers, values over them, rank of rows."""
        ranks = np.full(len(whole), self._whole.rank)
        for held in {mode.held for mode in switched if mode.held}:
            chosen = [number for number, mode in enumerate(switched) if mode.held == held]
            ranks[chosen] = self._whole.ranks(whole[chosen], Switched(held))
        groups: dict[Hashable, list[int]] = {}
        for number, mode in enumerate(switched):
            kind = int(ranks[number]), mode.held, mode.stopped, tuple(mode.push), tuple(mode.clamped)
            groups.setdefault(kind, []).append(number)
        blocks = (same[k : k + _TOGETHER] for same in groups.values() for k in range(0, len(same), _TOGETHER))
        for chosen in blocks:
            first, modes = switched[chosen[0]], [switched[number] for number in chosen]
            push = {key: np.array([mode.push[key] for mode in modes]) for key in first.push}
            clamped = {key: np.array([mode.clamped[key] for mode in modes]) for key in first.clamped}
            yield chosen, Switched(first.held, first.stopped, push, clamped), int(ranks[chosen[0]])

    def powers(self, times: Array, states: Array) -> Array:
        """Power of each of :func:`.working` at states [W], (times, drives)."""
        joints = [self.mechanism.joint_index[name] for name in working_joints(self.mechanism)]
        numbers, powers = [number for number, _ in working(self.mechanism)], np.zeros((len(times), len(joints)))
        for block in (slice(k, k + _TOGETHER) for k in range(0, len(times), _TOGETHER)):
            solved = self.lean.solve(self.lean.normalised(states[block]), times[block])
            powers[block] = self._named(solved, Switched())[:, numbers] * self.lean.along(states[block], joints)[1]
        return powers

    @staticmethod
    def _complete(R: Array, r: Array, v: Array, w: Array, angles: Array) -> Array:
        """State, or states, with seven coordinates for each body, also for planar ones."""
        rotations, shape = Rotation.from_matrix(R.reshape(-1, 3, 3)), angles.shape[:-1]
        quaternions = rotations.as_quat(canonical=True, scalar_first=True).reshape(*r.shape[:-1], 4)
        spins = _product(rotations.inv().as_matrix().reshape(R.shape), w)
        x, u = (np.concatenate(parts, axis=-1).reshape(*shape, -1) for parts in ((r, quaternions), (v, spins)))
        return np.concatenate([x, u, angles], axis=-1)

    def _wrenches(self, solved: Solved) -> Array:
        shape = solved.multipliers.shape[:-1]
        wrenches = np.zeros((*shape, len(self._whole.equations.connections), 6))

        def add(connection: int, force: Sequence[Scalar], torque: Sequence[Scalar], factor: Array) -> None:
            wrenches[..., connection, :] += factor[..., None] * _stacked([*force, *torque], shape)

        for row, multiplier in zip(solved.equations.rows, solved.multipliers.T, strict=True):
            for wrench in ((row.connection, row.force, row.torque), *row.besides):
                add(*wrench, np.asarray(multiplier))
        for row, inertia in solved.equations.drives:
            rate = sum(value * solved.acceleration[..., k] for k, value in row.coefficients.items()) + row.bias
            add(row.connection, row.force, row.torque, np.asarray(-inertia * rate))
        for number, law in enumerate(solved.equations.laws):
            add(number, *law, np.ones(()))
        return wrenches

    def _named(self, solved: Solved, switched: Switched) -> Array:
        multipliers, shape = solved.multipliers, solved.multipliers.shape[:-1]
        fields = {name: np.zeros((*shape, count)) for name, count in lengths(self.mechanism).items()}
        fields["effort"][:] = _stacked(solved.equations.efforts, shape)
        fields["coupling"][:] = multipliers[..., solved.equations.coupled]
        driven = [self.mechanism.joint_index[joint.name] for joint, _, _ in self.mechanism.prescribed]
        fields["drive"][..., driven] = multipliers[..., solved.equations.moved]
        holding = dict(zip(switched.held, multipliers.T[solved.equations.moved.stop :], strict=True))
        for number, joint in enumerate(self.mechanism.joints):
            force: Scalar = holding.get(number, switched.push.get(number, 0.0))
            on = joint_force_shares(number in switched.stopped, joint.friction, force)
            fields["friction"][..., number], fields["stop"][..., number] = on
        return pick_named(self.mechanism, fields).T.reshape(*shape, -1)
