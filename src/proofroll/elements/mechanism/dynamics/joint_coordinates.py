"""Route 1 of the truth: the tree in joint coordinates, its loops by projection on the null space of their rows.

With M v̇ = b and C v̇ = −γ, the singular values of C L⁻ᵀ (M = L Lᵀ) split the velocities into directions that the loops
allow and those they lock. The rank is fixed at the start, so that redundant rows cost nothing and never flicker. After
each step the violations of Φ and C v are eliminated along the locked directions (Blajer 2002). Angular velocities of
spherical and free joints are states in the child's axes, which keeps digits when a body spins fast.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import cross
from proofroll.core.errors import Diverged, Refused
from proofroll.core.pace import PACE
from proofroll.elements.mechanism.dynamics.analysis import BRANCHES, RANK, RowSign, analyse, lacks_inertia, reactions
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion, Rows, Tree
from proofroll.elements.mechanism.dynamics.named_forces import joint_force_shares, lengths, pick_named
from proofroll.elements.mechanism.dynamics.point_loads import point_loads
from proofroll.elements.mechanism.dynamics.record import Record, record_of
from proofroll.elements.mechanism.dynamics.switches import REDUNDANT, STOPPED, Mode, held_joints, switched_joints
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE
from proofroll.elements.mechanism.scene.kinks import Functions
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array, skews, to_quaternion
from proofroll.elements.mechanism.scene.shapes.walls.formula import RecordedProgram
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, value_at, varies

_OF_ROWS = "residual", "C", "bias", "force", "torque"
_OF_BODIES = "p_WB", "R_WB", "v_WB", "w_WB", "J", "bias", "p_joint", "R_parent"
_MOST = 12  # bodies of a tree whose terms are recorded
_NEAR = 1e-7  # displacement of coordinates for finite differences of accelerations [m, 1]
_STEP = 0.05  # of DOP853, in times in which the fastest mode turns by 1 rad; chains of 5 to 80 links need no less


@dataclass(frozen=True)
class Solution:
    """Accelerations at one instant, with intermediate results.

    Attributes:
        acceleration: v̇, (nv).
        multipliers: of the rows of loops and couplings, the smallest in norm where they are redundant.
        motion: of the bodies.
        rows: constraints of loops and couplings.
        split: (A, B) = (L⁻ᵀV, Uᵀ/S) of the locked directions: −A B r is the correction that removes a residual r.
        C: rows of the loops, then of switched joints that are held, (rows, nv).
        holding: forces that hold switched joints, along their coordinates, in the order of ``held_joints``.
    """

    acceleration: Array
    multipliers: Array
    motion: BodyMotion
    rows: Rows
    split: tuple[Array, Array] | None
    C: Array
    holding: Array


class JointCoordinates:
    """Equations of motion of a mechanism in the coordinates of its tree.

    ``rank`` is that of the loops' rows; None: their rank at a general pose.
    """

    def __init__(self, mechanism: Mechanism, rank: int | None = None) -> None:
        self.mechanism, self.tree, self.switched = mechanism, Tree(mechanism), switched_joints(mechanism)
        self.rank = analyse(mechanism).rank if rank is None else rank
        self._mass = np.array([body.mass for body in mechanism.bodies])
        self._com = np.array([body.com for body in mechanism.bodies])
        self._inertia = np.array([body.inertia for body in mechanism.bodies])
        self._gravity = np.array(mechanism.gravity)
        by_velocity = [joint for joint in mechanism.joints for _ in range(joint.nv)]
        self._damping = np.array([joint.damping for joint in by_velocity])
        self._torque = np.array([joint.constant_drive for joint in by_velocity])
        joints = zip(mechanism.joints, mechanism.v_slices, strict=True)
        self._driven = [(joint.torque, columns.start) for joint, columns in joints if varies(joint.torque)]
        self.actuators = [(actuator, *mechanism.place_of(actuator.joint)) for actuator in mechanism.actuators]
        self.limited = [place for place in self.actuators if place[0].limit is not None]
        self._clamped = [actuator.limit is not None for actuator in mechanism.actuators]
        self.sides: Mode = ()  # modes of limited efforts that are kept; empty: they follow from the state
        self.functions: Functions = FUNCTIONS  # of formulas, which may hold the sides of their kinks
        self.switches = bool(self.switched or self.limited)
        self._program: Callable[[Sequence[float]], list[Array]] | None = None
        self._light = self.rank > 0 and lacks_inertia(mechanism)
        self._armature = np.diag([joint.armature for joint in by_velocity])
        laws = zip(mechanism.joints, mechanism.q_slices, mechanism.v_slices, strict=True)
        self._springs = [(joint.stiffness, joint.rest, at_q, at_v) for joint, at_q, at_v in laws if joint.stiffness]

    def solve(
        self, q: Array, v: Array, mode: Mode | None = None, load: Array | None = None, time: float = 0.0
    ) -> Solution:
        """Accelerations and multipliers for coordinates (nq) and velocities (nv), with drives at ``time`` [s].

        ``mode``: of switched joints and limited efforts; None: that of :meth:`sliding`.
        ``load``: additional force along the velocities, (nv).

        Raises:
            Diverged: a velocity moves nothing with inertia in this pose.
            Refused: joints that are held and loops lock the same direction, so that their forces are not determinate.
        """
        mode = self.sliding(v) if mode is None else mode
        motion, M, inertial, rows = self._terms(q, v, time)
        b = self._torque - self._damping * v - inertial
        for stiffness, rest, at_q, at_v in self._springs:
            b[at_v] -= stiffness * (q[at_q] - rest)
        for acting in point_loads(self.mechanism, motion, time, self.functions):
            b += acting.along(motion)
        for joint, kind in zip(self.switched, mode, strict=False):  # modes of efforts come last
            b[joint.velocity] += joint.push(kind)
        if load is not None:
            b += load
        for signal, column in self._driven:
            b[column] += value_at(signal, time, self.functions)
        if self.actuators:
            for (_, _, column), effort in zip(self.actuators, self.efforts(time, q, v, mode), strict=True):
                b[column] += effort
        C, bias, rank = rows.C, rows.bias, self.rank
        if held := [self.switched[number].velocity for number in held_joints(mode)]:
            C, bias, rank = np.vstack([C, np.eye(len(v))[held]]), np.append(bias, np.zeros(len(held))), rank + len(held)
        M, b = self.weighted(M, b, C, bias)
        try:
            into = np.linalg.inv(np.linalg.cholesky(M)).T  # M⁻¹ = into intoᵀ
        except np.linalg.LinAlgError:
            raise Diverged("the mass matrix is singular, as where joints of massless bodies line up") from None
        free = into.T @ b
        if not rank:
            return Solution(
                acceleration=into @ free,
                multipliers=np.zeros(len(rows.residual)),
                motion=motion,
                rows=rows,
                split=None,
                C=C,
                holding=np.zeros(0),
            )
        U, S, Vt = np.linalg.svd(C @ into, full_matrices=False)
        if held and (rank > len(S) or S[rank - 1] < RANK * S[0]):
            raise Refused(REDUNDANT)
        locked, back = Vt[:rank], U[:, :rank].T / S[:rank, None]
        normal = -back @ bias - locked @ free
        locked_into = into @ locked.T
        multipliers = back.T @ normal
        loops = len(rows.residual)
        return Solution(
            acceleration=into @ free + locked_into @ normal,
            multipliers=multipliers[:loops],
            motion=motion,
            rows=rows,
            split=(locked_into, back),
            C=C,
            holding=multipliers[loops:],
        )

    def record(self) -> None:
        """Records the terms of :meth:`solve` as plain assignments, which pays from some hundred solutions on.

        Trees of few bodies are recorded whose loops hold points and axes, without prescribed motions.
        """
        mechanism, nq = self.mechanism, self.mechanism.nq
        few = len(mechanism.bodies) <= _MOST and not mechanism.prescribed
        if few and all(loop.kind != DISTANCE for loop in mechanism.loops):
            program = RecordedProgram(nq + mechanism.nv)
            x = np.array(program.symbols, dtype=object)
            motion, M, inertial, rows = self._terms(x[:nq], x[nq:], 0.0)
            of_rows, of_bodies = (
                (getattr(rows, name) for name in _OF_ROWS),
                (getattr(motion, name) for name in _OF_BODIES),
            )
            self._program, self._loop = program.arrays([M, inertial, *of_rows, *of_bodies]), rows.loop

    def _terms(self, q: Array, v: Array, time: float) -> tuple[BodyMotion, Array, Array, Rows]:
        """Motion, mass matrix, inertial minus gravity forces along the velocities at v̇ = 0, (nv), and rows."""
        if self._program is not None:
            M, inertial, *arrays = self._program([*q.tolist(), *v.tolist()])
            of_rows = dict(zip(_OF_ROWS, arrays, strict=False))
            of_bodies = dict(zip(_OF_BODIES, arrays[len(_OF_ROWS) :], strict=True))
            return BodyMotion(**of_bodies, q=q), M, inertial, Rows(**of_rows, loop=self._loop, moved=0)
        motion = self.tree.at(q, v)
        J, M, loads = self.inertial(motion)
        rows = self.tree.loop_rows(motion, time, self.functions)
        return motion, M, loads.ravel() @ J.reshape(-1, len(v)), rows

    def weighted(self, M: Array, b: Array, C: Array, bias: Array) -> tuple[Array, Array]:
        """Mass matrix and forces with a weight on the rows, if the mass matrix is singular without them.

        Accelerations meet C v̇ = −bias, so the weight changes neither them nor the multipliers.
        """
        if not self._light:
            return M, b
        weight = float(M.max()) / float(np.abs(C.T @ C).max())
        return M + weight * C.T @ C, b - weight * bias @ C

    def rows(self, q: Array) -> Rows:
        """Constraints of loops and couplings for coordinates (nq), at rest."""
        return self._terms(q, np.zeros(self.mechanism.nv), 0.0)[-1]

    def efforts(self, time: float, q: Array, v: Array, mode: Mode = ()) -> list[float]:
        """Effort of each actuator at its joint [N m, N], by its mode if ``mode`` has one, else clamped to its limit."""
        modes = iter(mode[len(self.switched) :] or self.sides)
        return [
            actuator.effort(
                time, float(q[at_q]), float(v[at_v]), next(modes, None) if clamped else "linear", self.functions
            )
            for (actuator, at_q, at_v), clamped in zip(self.actuators, self._clamped, strict=True)
        ]

    def sliding(self, v: Array) -> Mode:
        """Mode in which each switched joint that moves slides, and those at rest are free."""
        rates = [(joint, v[joint.velocity]) for joint in self.switched]
        return tuple(joint.moving(rate) if rate else "free" for joint, rate in rates)

    def recorded(self, times: Array, states: Iterable[Array]) -> Record:
        """Record of states (q, v) at times [s]."""
        nq = self.mechanism.nq
        return record_of(times, [self.sample(y[:nq], y[nq:], None, t) for t, y in zip(times, states, strict=True)])

    def followed(self) -> Callable[[Array], Array]:
        """Correction of the state after each step of one motion, by elimination of violations.

        It raises Diverged where a step passes a singular pose of the loops, or comes too near to one to tell.
        """
        return self.watching(self.eliminated)

    def watching(self, eliminated: Callable[[Array], Array]) -> Callable[[Array], Array]:
        """A correction of the state that raises Diverged as :meth:`followed` does; then the step may be taken anew."""
        sign = RowSign(self.rank)

        def corrected(y: Array) -> Array:
            nonlocal sign
            y = eliminated(y)
            if self.rank:
                tried = copy(sign)
                if tried.changes(self.rows(y[: self.mechanism.nq]).C) or tried.least < BRANCHES:
                    raise Diverged("a step passes a singular pose of the loops, or one as near as lengths are known")
                sign = tried
            return y

        return corrected

    def sensitivity(self) -> tuple[float, float]:
        """Sensitivity of the accelerations to the state at the start.

        Returns:
            Rate of the fastest mode [rad/s], at least 1; and the change of accelerations if the state moves by its
            round-off, by which a joint at rest begins to rub: engines whose friction is soft begin without it.
        """
        q, v = self.mechanism.start()
        acceleration = self.solve(q, v).acceleration
        ways = np.random.default_rng(0).choice([-1.0, 1.0], (3, self.mechanism.nv))
        moved = [self.solve(self.tree.moved(q, _NEAR * way), v).acceleration for way in ways]
        nudged = [self.solve(self.tree.moved(q, np.spacing(1.0) * way), v + np.spacing(v) * way) for way in ways]
        slope = float(np.abs(np.array(moved) - acceleration).max(initial=0.0)) / _NEAR
        noise = max(float(np.abs(solution.acceleration - acceleration).max(initial=0.0)) for solution in nudged)
        return max(1.0, float(np.sqrt(slope))), noise

    def joint_gains(self) -> tuple[Array, Array]:
        """Damping and stiffness of the joints' own laws along the velocities, (nv) each."""
        stiffness = np.zeros(self.mechanism.nv)
        for of_joint, _, _, at_v in self._springs:
            stiffness[at_v] += of_joint
        return self._damping.copy(), stiffness

    def servo_gains(self) -> tuple[Array, Array]:
        """Gains kd and kp of actuators at their joints, along the velocities, (nv) each."""
        gains = np.zeros((2, self.mechanism.nv))
        for actuator, _, column in self.actuators:
            gains[:, column] += actuator.gear**2 * np.array([actuator.kd, actuator.kp])
        return gains[0], gains[1]

    def least(self, tolerance: float) -> Array:
        """Error tolerances of coordinates and velocities, (nq + nv): the level of the noise of accelerations.

        Noise enters the velocities in proportion to the step, not to its ninth power as the error of the method does.
        """
        fastest, noise = self.sensitivity()
        unavoidable = _STEP * noise / fastest
        return np.concatenate(
            [
                np.full(self.mechanism.nq, max(tolerance, _STEP * unavoidable / fastest)),
                np.full(self.mechanism.nv, max(tolerance, unavoidable)),
            ]
        )

    def rate(self, time: float, y: Array, mode: Mode | None = None) -> Array:
        """Right-hand side for the state (q, v), (nq + nv)."""
        q, v = y[: self.mechanism.nq], y[self.mechanism.nq :]
        return np.concatenate([self.tree.rate(q, v), self.solve(q, v, mode, time=time).acceleration])

    def rk4_states(self, times: Array, step: float) -> Iterator[Array]:
        """States (q, v) at the given times [s], by Runge-Kutta 4 in equal steps of at most ``step`` [s].

        Fixed steps pass singular poses, where adaptive steps would shrink to zero.

        Raises:
            OutOfTime: the truth that follows them has taken its processor time.
        """
        y, now = np.concatenate(self.mechanism.start()), 0.0
        for time in times:
            steps = int(np.ceil((time - now) / step - 1e-9))
            h = (time - now) / max(steps, 1)
            for t in (now + h * number for number in range(steps)):
                PACE.reached(t)
                k1 = self.rate(t, y)
                k2 = self.rate(t + h / 2, y + h / 2 * k1)
                k3 = self.rate(t + h / 2, y + h / 2 * k2)
                y = self.eliminated(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + self.rate(t + h, y + h * k3)))
            now = time
            yield y

    def eliminated(self, y: Array, mode: Mode | None = None) -> Array:
        """The state with violations of loops, of held joints and of unit quaternions removed."""
        nq = self.mechanism.nq
        q, v = self.tree.normalised(y[:nq]), y[nq:]
        if self.rank or self.switched:
            solution = self.solve(q, v, mode)
            if solution.split is not None:
                into, back = solution.split
                opening = np.append(solution.rows.opening(v), solution.C[len(solution.rows.residual) :] @ v)
                v = v - into @ (back @ opening)
                residual = np.append(solution.rows.residual, np.zeros(len(solution.C) - len(solution.rows.residual)))
                q = self.tree.moved(q, -into @ (back @ residual))
        return np.concatenate([q, v])

    def sample(
        self,
        q: Array,
        v: Array,
        mode: Mode | None = None,
        time: float = 0.0,
        load: Array | None = None,
        applied: Array | None = None,
    ) -> dict[str, Any]:
        """Fields of a :class:`~proofroll.elements.mechanism.dynamics.record.Record` at one time.

        ``load``: additional forces along the velocities, (nv). ``applied``: the wrenches on bodies and world that
        ``load`` comes from, about the world's origin, (bodies + 1, 6).
        """
        mode = self.sliding(v) if mode is None else mode
        solution = self.solve(q, v, mode, load, time)
        motion, rows, mechanism = solution.motion, solution.rows, self.mechanism
        n = len(mechanism.bodies)
        needed = self._needed(solution, time) - (0.0 if applied is None else applied)
        wrench = np.concatenate(reactions(self.tree, motion, rows, solution.multipliers, needed))
        largest = [np.abs(rows.residual).max(initial=0.0), np.abs(rows.opening(v)).max(initial=0.0)]
        return {
            "p_WB": motion.p_WB[:n],
            "v_WB": motion.v_WB[:n],
            "q_WB": to_quaternion(motion.R_WB[:n]),
            "w_WB": motion.w_WB[:n],
            "q": q,
            "v": v,
            "wrench": wrench,
            "named": self._named(solution, q, v, mode, time),
            "residual": np.array(largest),
        }

    def _named(self, solution: Solution, q: Array, v: Array, mode: Mode, time: float) -> Array:
        fields = {name: np.zeros(count) for name, count in lengths(self.mechanism).items()}
        fields["effort"][:] = self.efforts(time, q, v, mode)
        moved = len(solution.multipliers) - solution.rows.moved
        fields["coupling"][:] = solution.multipliers[moved - len(fields["coupling"]) : moved]
        driven = [self.mechanism.joint_index[joint.name] for joint, _, _ in self.mechanism.prescribed]
        fields["drive"][driven] = solution.multipliers[moved:]
        holding = dict(zip(held_joints(mode), solution.holding, strict=True))
        for number, (joint, kind) in enumerate(zip(self.switched, mode, strict=False)):
            force = holding.get(number, joint.push(kind))
            on = joint_force_shares(kind in STOPPED, joint.friction, force)
            fields["friction"][joint.number], fields["stop"][joint.number] = on
        return pick_named(self.mechanism, fields)

    def inertial(self, motion: BodyMotion) -> tuple[Array, Array, Array]:
        """Jacobians at the centres of mass, (bodies, 6, nv), mass matrix, inertial minus gravity wrenches at v̇ = 0."""
        n = len(self._mass)
        R, w = motion.R_WB[:n], motion.w_WB[:n]
        arm = (R @ self._com[:, :, None])[..., 0]
        inertia = R @ self._inertia @ R.transpose(0, 2, 1)
        J = motion.J[:n].copy()
        J[:, :3] -= skews(arm) @ J[:, 3:]
        weighted = np.concatenate([self._mass[:, None, None] * J[:, :3], inertia @ J[:, 3:]], axis=1)
        nv = self.mechanism.nv
        M = J.reshape(-1, nv).T @ weighted.reshape(-1, nv) + self._armature
        return J, M, self._wrenches(motion.bias[:n], arm, inertia, w)

    def _wrenches(self, acceleration: Array, arm: Array, inertia: Array, w: Array) -> Array:
        """Force and moment about the centre of mass that accelerate each body so, beyond gravity, (bodies, 6)."""
        alpha, turn = acceleration[:, 3:, None], skews(w)
        at_com = acceleration[:, :3] + (turn @ (turn @ arm[:, :, None]) - skews(arm) @ alpha)[..., 0]
        moment = inertia @ alpha + turn @ (inertia @ w[:, :, None])
        return np.concatenate([self._mass[:, None] * (at_com - self._gravity), moment[..., 0]], axis=1)

    def _needed(self, solution: Solution, time: float) -> Array:
        """Wrenches about the world's origin that joints and loops bring to the bodies; the last is the world's."""
        motion, n = solution.motion, len(self._mass)
        R = motion.R_WB[:n]
        arm = (R @ self._com[:, :, None])[..., 0]
        acceleration = motion.J[:n] @ solution.acceleration + motion.bias[:n]
        inertia = R @ self._inertia @ R.transpose(0, 2, 1)
        wrenches = self._wrenches(acceleration, arm, inertia, motion.w_WB[:n])
        needed = np.zeros((n + 1, 6))
        needed[:n] = wrenches
        needed[:n, 3:] += cross(motion.p_WB[:n] + arm, wrenches[:, :3])
        for i, arm, force, moment in point_loads(self.mechanism, motion, time):
            needed[i] -= np.concatenate([force, moment + cross(motion.p_WB[i] + arm, force)])
        return needed
