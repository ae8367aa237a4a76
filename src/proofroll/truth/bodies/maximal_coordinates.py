"""Route 2 of the truth: separate bodies held by constraint rows, without joint coordinates and tree.

It shares no kinematics with route 1. Taylor series (heyoka) integrate it; without heyoka, or with dependent rows,
DOP853 with projection: the rank is fixed at the start, and violations are eliminated after each step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import qr
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import uneven
from proofroll.core.errors import Missing
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.link_forces import working, working_joints
from proofroll.elements.mechanism.dynamics.named_forces import joint_force_shares, lengths, pick_named
from proofroll.elements.mechanism.dynamics.record import Record, record_of
from proofroll.elements.mechanism.scene.kinks import Functions
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.walls.formula import RecordedProgram, cos, sin
from proofroll.elements.mechanism.scene.signal import SMOOTH
from proofroll.truth.bodies.constraint_rows import ConstraintRow
from proofroll.truth.bodies.maximal_bodies import BodyInScalars
from proofroll.truth.bodies.maximal_equations import FUNCTIONS, ConstrainedEquations, MaximalEquations, Switched
from proofroll.truth.bodies.maximal_taylor import MaximalTaylor, Visited, compiled_powers

# Initial displacement for growth, m, rad and relative to velocities: far above round-off, small if grown by 1e7.
BESIDE = 1e-9
RANK = 1e-8  # see analysis.RANK; this route determines its own rank
# Least singular value of chosen rows relative to that of all rows, below which other rows are chosen. Each factor of
# ten costs a digit of the accelerations; a choice by pivoting begins above 0.1, and is compiled anew, in seconds.
WEAKEST = 0.02


@dataclass(frozen=True)
class Solved:
    """Accelerations u̇ and multipliers at one state, with matrices that eliminate violations.

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
        self.rank = self._rank(self.equations.start())

    def switched(self, state: Array, switched: Switched) -> NumericEquations:
        """Copy of the equations with joints held or pushed; rows of held ones give the rank at ``state``."""
        equations = copy(self)
        equations._switched = switched
        if switched.held:
            equations.rank = equations._rank(state)
        return equations

    def _rank(self, state: Array) -> int:
        C = self._matrix(self.equations.at(state.tolist(), switched=self._switched).rows)
        values = np.linalg.svd(C @ self._inverse_root, compute_uv=False) if C.size else np.zeros(0)
        # rows that hold a planar body in its plane are none at all, but for round-off of a turned frame
        unit = float(np.linalg.svd(self._inverse_root, compute_uv=False)[-1])
        return int((values > RANK * values.max(initial=unit)).sum())

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
        return program.arrays([self._matrix(rows, object)])

    def _weighted(self, state: Array) -> Array:
        """Rows at a state, with velocities weighted by inertia."""
        return self._matrix(self.equations.lasting_rows(self.equations.views(state.tolist()))) @ self._inverse_root

    def solve(self, state: Array, time: float = 0.0, applied: Array | None = None) -> Solved:
        """Accelerations and multipliers at a time [s]; of dependent rows, the multipliers of least norm.

        ``applied``: further forces and moments about the centres of mass, world axes, (bodies, 6).
        """
        constrained = self.equations.at(state.tolist(), self.functions, switched=self._switched, time=time)
        C, (half, force) = self._matrix(constrained.rows), self._driven(constrained)
        if applied is not None:
            force = force + self.equations.projected(constrained.views, applied)
        free = half.T @ force
        residual = np.array([row.residual for row in constrained.rows], dtype=float)
        if self._switched is not None and self._switched.held:
            residual[-len(self._switched.held) :] = 0.0  # held where they are, not at zero
        if not self.rank:
            into, back = np.zeros((len(half), 0)), np.zeros((0, len(C)))
            return Solved(constrained, half @ free, np.zeros(len(C)), C, residual=residual, into=into, back=back)
        weighted = C @ half
        sizes = np.linalg.norm(weighted, axis=1)
        # rows of light rotors and of heavy frames alike; rows that are round-off stay so
        even = 1 / np.where(sizes > RANK * sizes.max(), sizes, 1.0)
        U, S, Vt = np.linalg.svd(even[:, None] * weighted, full_matrices=False)
        locked, back = Vt[: self.rank], U[:, : self.rank].T / S[: self.rank, None] * even
        normal = -back @ np.array([row.bias for row in constrained.rows], dtype=float) - locked @ free
        into = half @ locked.T
        acceleration = half @ free + into @ normal
        return Solved(constrained, acceleration, back.T @ normal, C, residual=residual, into=into, back=back)

    def loaded(
        self, state: Array, time: float = 0.0, switched: Switched | None = None
    ) -> tuple[ConstrainedEquations, Array, Array, Array, Array]:
        """Equations at a state and a time [s], their rows C and biases, H with M⁻¹ = H Hᵀ, and the loads."""
        constrained = self.equations.at(state.tolist(), self.functions, switched=switched, time=time)
        bias = np.array([row.bias for row in constrained.rows], dtype=float)
        return constrained, self._matrix(constrained.rows), bias, *self._driven(constrained)

    def _driven(self, constrained: ConstrainedEquations) -> tuple[Array, Array]:
        """H with M⁻¹ = H Hᵀ, and loads; both include the armature of joints."""
        half, force = self._inverse_root, np.array(constrained.force, dtype=float)
        if added := [*constrained.drives, *constrained.holders]:
            G = self._matrix([drive.row for drive in added])
            inertia = np.array([drive.inertia for drive in added])
            half = np.linalg.inv(np.linalg.cholesky(self.equations.mass_matrix + (G.T * inertia) @ G)).T
            force = force - G.T @ (inertia * np.array([drive.row.bias for drive in added], dtype=float))
        return half, force

    def along(self, state: Array, joints: Sequence[int]) -> tuple[Array, Array]:
        """Coordinates and rates of joints with one coordinate, rad or m and per s.

        Angles that are integrated count whole turns.
        """
        e = self.equations
        rows = e.rate_rows(state.tolist(), joints)
        rates = self._matrix(rows) @ state[e.nx : e.nx + e.nu]
        kept = {number: state[e.nx + e.nu + index] for index, (number, _) in enumerate(e.angles)}
        positions = [kept.get(number, float(row.residual)) for number, row in zip(joints, rows, strict=True)]
        return np.array(positions, dtype=float), np.asarray(rates, dtype=float)

    def poses(self, state: Array) -> tuple[Array, Array, Array, Array]:
        """Places, velocities, quaternions and angular velocities of all bodies, world axes."""
        views = self.equations.views(self.normalised(state).tolist())[:-1]
        R, r, v, w = (np.array([getattr(view, name) for view in views], float) for name in "Rrvw")
        arm = np.einsum("nij,nj->ni", R, np.array([body.com for body in self.equations.mechanism.bodies]))
        return r - arm, v - np.cross(w, arm), Rotation.from_matrix(R).as_quat(scalar_first=True), w

    def poses_at(self, states: Array) -> tuple[Array, Array, Array, Array]:
        """Places, velocities, rotations and angular velocities at states, each (states, bodies, …), world axes."""
        unit = self.normalised(states).T
        views = self.equations.views(list(unit), SMOOTH)[:-1]

        def stacked(values: Sequence[Any]) -> Array:
            return np.stack([np.broadcast_to(value, len(states)) for value in values], -1)

        R = np.stack([np.stack([stacked(row) for row in view.R], -2) for view in views], 1)
        r, v, w = (np.stack([stacked(getattr(view, name)) for view in views], 1) for name in "rvw")
        arm = np.einsum("tnij,nj->tni", R, np.array([body.com for body in self.equations.mechanism.bodies]))
        return r - arm, v - np.cross(w, arm), R, w

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

    def _matrix(self, rows: Sequence[ConstraintRow], kind: type = float) -> Array:
        C = np.zeros((len(rows), self.equations.nu), dtype=kind)
        for number, row in enumerate(rows):
            for index, value in row.coefficients.items():
                C[number, index] = value
        return C


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

    def take_functions(self, functions: Functions) -> None:
        """Takes functions of formulas for records, which may hold the sides of kinks."""
        self._whole.functions = functions

    def recorded(
        self,
        times: Array,
        states: Array,
        switched: Sequence[Switched] | None = None,
        applied: Sequence[Array] | None = None,
    ) -> Record:
        """Record of the states, with the modes of switched joints; reactions follow from the rows in space.

        ``applied``: additional forces and moments about the centres of mass, world axes, (bodies, 6).
        """
        modes = [None] * len(states) if switched is None else switched
        more = [None] * len(states) if applied is None else applied
        rows = zip(times, states, modes, more, strict=True)
        record = record_of(times, [self._sample(float(t), self.lean.normalised(y), mode, w) for t, y, mode, w in rows])
        q, v = record.placed(self.mechanism).of_tree()
        return replace(record, q=q, v=v)

    def _sample(
        self, time: float, state: Array, switched: Switched | None = None, applied: Array | None = None
    ) -> dict[str, Any]:
        lean = self.lean.equations
        views = lean.views(state.tolist())
        whole = self._complete(views, state[lean.nx + lean.nu :])
        solved = self._solved(time, whole, switched, applied)
        u = whole[self._whole.equations.nx :][: self._whole.equations.nu]
        opening = solved.equations.opening(solved.C @ u)
        n = len(self.mechanism.bodies)
        arms = [np.array(view.R) @ body.com for view, body in zip(views, self.mechanism.bodies, strict=False)]
        return {
            "p_WB": np.array([np.array(views[i].r) - arms[i] for i in range(n)]),
            "v_WB": np.array([np.array(views[i].v) - np.cross(views[i].w, arms[i]) for i in range(n)]),
            "q_WB": whole[: 7 * n].reshape(n, 7)[:, 3:],
            "w_WB": np.array([views[i].w for i in range(n)], dtype=float),
            "q": [],  # set later, from the poses at all times
            "v": [],
            "wrench": self._wrenches(solved),
            "named": self._named(solved, switched or Switched()),
            "residual": np.array([np.abs(solved.residual).max(initial=0.0), np.abs(opening).max(initial=0.0)]),
        }

    def _solved(self, time: float, whole: Array, switched: Switched | None, applied: Array | None) -> Solved:
        """Accelerations and multipliers of the rows in space at a state that is whole."""
        equations = self._whole if switched is None else self._whole.switched(whole, switched)
        return equations.solve(whole, time, applied)

    def reactions(self, time: float, state: Array, switched: Switched, applied: Array) -> tuple[Array, Array]:
        """Reactions (joints + loops, 6) and named forces at a state of :meth:`recorded` with unit quaternions."""
        lean = self.lean.equations
        whole = self._complete(lean.views(state.tolist()), state[lean.nx + lean.nu :])
        solved = self._solved(time, whole, switched, applied)
        return self._wrenches(solved), self._named(solved, switched)

    def powers(self, times: Array, states: Array) -> Array:
        """Power of each of :func:`.working` at states [W], (times, drives)."""
        joints = [self.mechanism.joint_index[name] for name in working_joints(self.mechanism)]
        forces = [item for _, item in working(self.mechanism)]
        driven = [self.mechanism.joint_index[joint.name] for joint, _, _ in self.mechanism.prescribed]
        places = [driven.index(item.number) if item.field == "drive" else item.number for item in forces]
        fields = [item.field for item in forces]
        with suppress(Missing):
            if not self.lean.moved_alone():
                raise Missing("forces of drives that independent rows determine")
            compiled = compiled_powers(
                self.lean.equations, self.lean.independent_rows(), list(zip(fields, places, joints, strict=True))
            )
            unit = np.array([self.lean.normalised(y) for y in states])
            return compiled(np.column_stack([unit, times]))
        numbers = [number for number, _ in working(self.mechanism)]
        return np.array(
            [
                self._named(self.lean.solve(self.lean.normalised(y), float(t)), Switched())[numbers]
                * self.lean.along(y, joints)[1]
                for t, y in zip(times, states, strict=True)
            ]
        ).reshape(len(times), len(joints))

    def _complete(self, views: list[BodyInScalars], angles: Array) -> Array:
        """State with seven coordinates for each body, also for planar ones."""
        x: list[float] = []
        u: list[float] = []
        for view in views[:-1]:
            R = Rotation.from_matrix(np.array(view.R, dtype=float))
            x += [*view.r, *R.as_quat(canonical=True, scalar_first=True)]
            u += [*view.v, *R.inv().apply(np.array(view.w, dtype=float))]
        return np.array([*x, *u, *angles])

    def _wrenches(self, solved: Solved) -> Array:
        wrenches = np.zeros((len(self._whole.equations.connections), 6))
        for row, multiplier in zip(solved.equations.rows, solved.multipliers, strict=True):
            wrenches[row.connection] += multiplier * np.array([*row.force, *row.torque])
            for connection, force, torque in row.besides:
                wrenches[connection] += multiplier * np.array([*force, *torque])
        for row, inertia in solved.equations.drives:
            rate = sum(value * solved.acceleration[k] for k, value in row.coefficients.items()) + row.bias
            wrenches[row.connection] -= inertia * rate * np.array([*row.force, *row.torque])
        for number, (force, moment) in enumerate(solved.equations.laws):
            wrenches[number] += np.array([*force, *moment])
        return wrenches

    def _named(self, solved: Solved, switched: Switched) -> Array:
        fields = {name: np.zeros(count) for name, count in lengths(self.mechanism).items()}
        fields["effort"][:] = solved.equations.efforts
        fields["coupling"][:] = solved.multipliers[solved.equations.coupled]
        driven = [self.mechanism.joint_index[joint.name] for joint, _, _ in self.mechanism.prescribed]
        fields["drive"][driven] = solved.multipliers[solved.equations.moved]
        holding = dict(zip(switched.held, solved.multipliers[solved.equations.moved.stop :], strict=True))
        for number, joint in enumerate(self.mechanism.joints):
            force = holding.get(number, switched.push.get(number, 0.0))
            on = joint_force_shares(number in switched.stopped, joint.friction, force)
            fields["friction"][number], fields["stop"][number] = on
        return pick_named(self.mechanism, fields)
