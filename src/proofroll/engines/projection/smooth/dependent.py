"""Blajer's projection method for a mechanism in dependent coordinates: those of its separate bodies.

With M u̇ = h + Cᵀλ and C u̇ = −γ, the constraints split the velocities u of the bodies into two subspaces, orthogonal
in the metric of M: the constrained one, spanned by M⁻¹Cᵀ, in which only the constraints act, and the tangent one,
spanned by D with C D = 0, in which only the applied forces act. Projection on the second, DᵀM D ν̇ = Dᵀ(h − M u̇₀) with
any u̇₀ that satisfies the constraints, gives the motion. The remainder, M u̇ − h, lies in the first and gives the
reactions, joint by joint from the tips of the tree.

D follows from elimination along the tree (see :mod:`.elimination`). Loops, couplings and
held joints are projected in a second stage, in the velocities ν, with one row each. The number of independent rows of
loops and couplings is determined at the start and kept.

Sources: W. Blajer, Math. Comput. Model. Dyn. Syst. 12(6), 2006, 543-553, for the projections; W. Blajer, Multibody
Syst. Dyn. 7, 2002, 265-284, for the elimination of constraint violations.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.arrays import cross
from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism, Tree
from proofroll.elements.mechanism.dynamics.switches import REDUNDANT
from proofroll.elements.mechanism.run.sampling import DEPENDENT, independent_anywhere
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array, quaternion_rate, to_quaternion
from proofroll.engines.projection.smooth.applied import Applied
from proofroll.engines.projection.smooth.connections import SKEW, Bodies, ConnectionRows, ProjectedConnections
from proofroll.engines.projection.smooth.elimination import Closing, Elimination, Loads, RowSplit, Space


class SolvedState(NamedTuple):
    """Accelerations of the bodies, with the quantities used to find them.

    Attributes:
        bodies: motion of the bodies.
        linear: accelerations of the centres of mass, world axes, (bodies, 3).
        angular: angular accelerations in the bodies' own axes, (bodies, 3).
        forces: forces needed in addition to weight, as accelerations of :meth:`Elimination.forces`.
        rates: ν̇, (nv,).
        multipliers: of the rows of loops, of couplings (forces on their second joints), of motions, of held joints.
    """

    bodies: Bodies
    linear: Array
    angular: Array
    forces: Array
    rates: Array
    multipliers: Array


class DependentCoordinates:
    """Equations of motion in the state (r, quaternions, v, ω), each for all bodies in order.

    Attributes:
        mass, inertia: of the bodies, about their centres of mass in their own axes.
        com: centres of mass in the bodies' frames.
        rank: number of independent rows.
        nq, nv: numbers of coordinates and of velocities of the tree.
        gravity: its acceleration.
        start: state at time 0.
        loop_rows, coupled: number of rows of loops, and of loops, couplings and motions together.
        moved: slice of the rows of prescribed motions.
        split: of the velocities by these rows at the last solution; None: without rows.
        regularity: smallest relevant over largest singular value of these rows at the last solution; 1 without rows.
    """

    def __init__(self, mechanism: Mechanism, elimination: type[Elimination] = Elimination) -> None:
        self.mass = np.array([body.mass for body in mechanism.bodies])
        self.inertia = np.array([body.inertia for body in mechanism.bodies])
        self.com = np.array([body.com for body in mechanism.bodies])
        self._count, self._joints = len(self.mass), len(mechanism.joints)
        self.nq, self.nv = mechanism.nq, mechanism.nv
        self.connections = connections = ProjectedConnections(mechanism)
        self.tree = elimination(mechanism, connections)
        self.applied = Applied(mechanism)
        self._loops_at = slice(self._joints, None)
        self._joint_rows = connections.constraints(slice(0, self._joints))
        self._loop_rows = connections.constraints(self._loops_at)
        ends = np.stack([connections.a, connections.b])[:, self._loops_at]
        self._loop_a, self._loop_b = ends[:, self._loop_rows.owner]
        self._between = self.tree.moves[self._loop_b] - self.tree.moves[self._loop_a]
        number = mechanism.joint_index
        self._couplings = [
            (np.array([number[name] for name, _ in c.terms]), np.array([factor for _, factor in c.terms]), c.place)
            for c in mechanism.couplings
        ]
        self._moved = [(number[joint.name], joint.motion or 0.0) for joint, _, _ in mechanism.prescribed]
        self._geared = np.zeros((len(self._couplings) + len(self._moved), self.nv))
        for row, (joints, factors, _) in zip(self._geared, self._couplings, strict=False):
            for joint, factor in zip(joints, factors, strict=True):
                row[mechanism.v_slices[joint]] = factor
        for row, (_, _, at_v) in zip(self._geared[len(self._couplings) :], mechanism.prescribed, strict=True):
            row[at_v] = 1.0
        self.loop_rows = len(self._loop_rows.owner)
        self.coupled = self.loop_rows + len(self._geared)
        self.moved = slice(self.coupled - len(self._moved), self.coupled)
        # the axes of other joints are fixed in one of the two bodies
        self._bent = any(joint.kind == JointKind.UNIVERSAL for joint in mechanism.joints)
        self.gravity = np.array(mechanism.gravity)
        self.regularity = 1.0
        self.split: RowSplit | None = None
        self._mean = np.full(self._count, 1.0 / self._count)
        self.start = self._start(mechanism)
        self._locked = _rank_of_loops(mechanism)
        self.rank = 6 * self._count - mechanism.nv + self._locked

    def _start(self, mechanism: Mechanism) -> Array:
        motion = Tree(mechanism).at(*mechanism.start())
        R, w = motion.R_WB[: self._count], motion.w_WB[: self._count]
        arm = np.einsum("nij,nj->ni", R, self.com)
        quaternions = np.array([to_quaternion(rotation) for rotation in R])
        v = motion.v_WB[: self._count] + cross(w, arm)
        r = motion.p_WB[: self._count] + arm
        return _joined(r, quaternions, v, np.einsum("nji,nj->ni", R, w))

    def parts(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Positions r, quaternions, v and ω (own axes) of a state, (bodies, …)."""
        n = self._count
        return (
            x[: 3 * n].reshape(n, 3),
            x[3 * n : 7 * n].reshape(n, 4),
            x[7 * n : 10 * n].reshape(n, 3),
            x[10 * n :].reshape(n, 3),
        )

    def bodies(self, x: Array) -> Bodies:
        """Motion of the bodies, and of the world."""
        n = self._count
        r, q, v, w = self.parts(x)
        origin, R = self._mean @ r, rotations(q)
        back = R.swapaxes(1, 2)
        pose, inverse, twist = np.zeros((3, n + 1, 4, 4), dtype=x.dtype)
        pose[:n, :3, :3], pose[:n, :3, 3], pose[n, :3, :3], pose[n, :3, 3] = R, r - origin, np.eye(3), -origin
        pose[:, 3, 3] = inverse[:, 3, 3] = 1.0
        inverse[:, :3, :3] = pose[:, :3, :3].swapaxes(1, 2)
        inverse[:, :3, 3:] = -inverse[:, :3, :3] @ pose[:, :3, 3:]
        twist[:n, :3, :3] = (w @ SKEW).reshape(n, 3, 3)
        twist[:n, :3, 3:] = back @ v[:, :, None]
        return Bodies(pose=pose, inverse=inverse, own=twist, twist=pose @ twist @ inverse, origin=origin)

    def solve(
        self, x: Array, drives: Array | float = 0.0, closing: Closing | None = None, held: Sequence[int] = ()
    ) -> SolvedState:
        """Solution of the projected equations of motion at a state.

        Args:
            x: the state.
            drives: additional forces along the velocities ν, (nv,); several at once, (…, nv), give as many
                accelerations.
            closing: solver for the velocities of the tree; None: with loops and held joints, if there are any.
            held: indices of velocities that do not change.
        """
        bodies, joints = self.bodies(x), self._joints
        pose, inverse, twist = bodies.pose[:-1], bodies.inverse[:-1], bodies.own[:-1]
        bent = twist @ twist
        bent[:, :3, 3:] -= inverse[:, :3, :3] @ self.gravity[:, None]
        of_a, of_b = bodies.twist[self.connections.a], bodies.twist[self.connections.b]
        # rates of relative twists that are constant in body a
        still = (of_a @ of_b - of_b @ of_a).reshape(-1, 16)
        relative, loads = still[:joints], Loads(bent, drives=drives)
        if self._bent or self.applied.laws:
            ends = self.connections.ends(bodies, slice(0, joints))
            if self._bent:
                rows = self._joint_rows.at(ends)
                relative = relative - self._joint_rows.twists(rows, self._joint_rows.bending(ends, rows))
            if self.applied.laws:
                loads = loads._replace(drives=drives + self.tree.of_joints(bodies, *self.applied.of_joints(ends)))
        if self.applied.of_points:
            loads = loads._replace(pulls=self.applied.pulls(bodies))
        if closing is None and (self._locked or held):
            ends = self.connections.ends(bodies, self._loops_at)
            rows = self._loop_rows.at(ends)
            drift = self._loop_rows.bending(ends, rows)
            drift -= (rows.form * still[joints:][self._loop_rows.owner]).sum(1)
            row_rates = self._with_zeros(-drift, held)
            for row, (_, signal) in zip(range(*self.moved.indices(self.coupled)), self._moved, strict=True):
                row_rates[row] = moved(signal, self.applied.now).acceleration
            closing = partial(self._closed, rows, row_rates, held)
        motions, velocities, multipliers = self.tree.motions(bodies, relative, loads, closing)
        rates = inverse @ motions[..., :-1, :, :] @ pose
        linear = (pose @ (rates + bent))[..., :3, 3] + self.gravity
        angular = 0.5 * rates[..., :3, :3].reshape(*rates.shape[:-2], 9) @ SKEW.T
        return SolvedState(
            bodies=bodies,
            linear=linear,
            angular=angular,
            forces=rates + bent,
            rates=velocities,
            multipliers=multipliers,
        )

    def _with_zeros(self, of_loops: Array, held: Sequence[int]) -> Array:
        """Right-hand sides of all rows, (…, rows), from those of loops; zero for the others."""
        more = len(self._geared) + len(held)
        return np.concatenate([of_loops, np.zeros((*of_loops.shape[:-1], more))], axis=-1) if more else of_loops

    def _closed(
        self, rows: ConnectionRows, row_rates: Array, held: Sequence[int], space: Space, free: Array, push: Array
    ) -> Any:
        """Velocities (…, nv) and multipliers that give the rows the rates ``row_rates``, (…, rows)."""
        flat = free.reshape(*free.shape[:-2], 16)
        C = rows.form @ space.S.T * self._between
        of_given = (rows.form * (flat[..., self._loop_b, :] - flat[..., self._loop_a, :])).sum(-1)
        if self.coupled > self.loop_rows or held:
            C, of_given = np.vstack([C, self._geared, np.eye(self.nv)[list(held)]]), self._with_zeros(of_given, held)
        split = RowSplit(space.H, C, self._locked + len(held))
        if not held:
            self.regularity, self.split = split.least, split
        elif split.least < DEPENDENT:
            raise Refused(REDUNDANT)
        velocities, multipliers = split(push.T, np.broadcast_to(row_rates - of_given, (*push.shape[:-1], len(C))).T)
        return velocities.T, multipliers.T

    def responses(self, x: Array, drives: Array, at: Sequence[int]) -> tuple[Array, Array]:
        """ν̇ at a state, (nv,), and its change due to unit forces along some of the velocities, (nv, forces)."""
        units = np.vstack([np.zeros(self.nv), np.eye(self.nv)[list(at)]])
        accelerations = self.solve(x, drives + units).rates
        return accelerations[0], (accelerations[1:] - accelerations[0]).T

    def pushed(self, x: Array, change: Array) -> Array:
        """State after a change of the velocities ν, (nv,)."""
        linear, angular = self.of_bodies(self.bodies(x), change)
        x = x.copy()
        _, _, v, w = self.parts(x)
        v += linear
        w += angular
        return x

    def pushed_rates(self, x: Array, free: SolvedState, change: Array) -> Array:
        """Time derivative ẋ after a change of the accelerations ν̇, (nv,), of a solution at x."""
        _, q, v, w = self.parts(x)
        linear, angular = self.of_bodies(free.bodies, change)
        return _joined(v, quaternion_rates(q, w), free.linear + linear, free.angular + angular)

    def of_bodies(self, bodies: Bodies, velocities: Array) -> tuple[Array, Array]:
        """Velocities and angular velocities (own axes) of the bodies for velocities ν, (bodies, 3) each."""
        motion = self.tree.twists(bodies, velocities)[:-1]
        pose, inverse = bodies.pose[:-1], bodies.inverse[:-1]
        turning = 0.5 * (inverse @ motion @ pose)[:, :3, :3].reshape(-1, 9) @ SKEW.T
        return (motion @ pose[:, :, 3:])[:, :3, 0], turning

    def watched(self, x: Array) -> dict[int, tuple[float, float]]:
        """Coordinate and velocity of each joint with dry friction, stops, a coupling or a motion, by its index."""
        return self.applied.watched(self.connections.ends(self.bodies(x), slice(0, self._joints)))

    def wanted(self, x: Array) -> list[float]:
        """Efforts that the actuators with a limit would apply without it, N or N m."""
        return self.applied.wanted(self.connections.ends(self.bodies(x), slice(0, self._joints)))

    def _apart(self, bodies: Bodies) -> Array:
        """Violations of couplings and motions in coordinates and in velocities, (2, couplings + motions)."""
        coordinates = self.applied.watched(self.connections.ends(bodies, slice(0, self._joints)))
        violations = [
            factors @ np.array([coordinates[joint] for joint in joints]) - (place, 0.0)
            for joints, factors, place in self._couplings
        ]
        violations += [
            np.array(coordinates[joint]) - moved(signal, self.applied.now)[:2] for joint, signal in self._moved
        ]
        return np.transpose(violations)

    def rates(self, x: Array, drives: Array | float = 0.0, held: Sequence[int] = ()) -> Array:
        """Time derivative ẋ; for the arguments see :meth:`solve`."""
        _, q, v, w = self.parts(x)
        solved = self.solve(x, drives, held=held)
        return _joined(v, quaternion_rates(q, w), solved.linear, solved.angular)

    def eliminated(self, x: Array, held: Sequence[int] = ()) -> Array:
        """State projected onto the constraints, quaternions normalised.

        Velocities with an index in ``held`` are kept.
        """
        x = self._with_unit_quaternions(x)
        if not self.rank and not held:
            return x
        bodies, closing = self.bodies(x), None
        rows = self._joint_rows.at(self.connections.ends(bodies, slice(0, self._joints)))
        # of positions and of velocities: motions that remove the violations, then without their components along D
        relative = -self._joint_rows.twists(rows, np.stack([rows.residual, rows.rate]))
        if self._locked or held:
            rows = self._loop_rows.at(self.connections.ends(bodies, self._loops_at))
            corrections = self._with_zeros(-np.stack([rows.residual, rows.rate]), held)
            if len(self._geared):
                corrections[:, self.loop_rows : self.coupled] = -self._apart(bodies)
            closing = partial(self._closed, rows, corrections, held)
        motion = self.tree.motions(bodies, relative, Loads(), closing)[0][:, :-1]
        pose, inverse = bodies.pose[:-1], bodies.inverse[:-1]
        linear = (motion @ pose[:, :, 3:])[:, :, :3, 0]
        angular = 0.5 * (inverse @ motion @ pose)[:, :, :3, :3].reshape(2, -1, 9) @ SKEW.T
        r, q, v, w = self.parts(x)
        v += linear[1]
        w += angular[1]
        q += quaternion_rates(q, angular[0])
        r += linear[0]
        return self._with_unit_quaternions(x)

    def reactions(self, solved: SolvedState) -> tuple[Array, Array]:
        """Forces and moments on the child of each joint, and on body b of each loop, at their points, world axes."""
        bodies = solved.bodies
        forces = self.tree.forces(bodies, solved.forces)
        if self.applied.of_points:
            forces -= self.applied.pulls(bodies)
        ends = self.connections.ends(bodies)
        force, torque = np.zeros((2, len(ends.d), 3))
        if self.loop_rows and solved.multipliers.size:  # there are none where loops take no freedom
            rows = self._loop_rows.at(self.connections.ends(bodies, self._loops_at))
            of_loops = solved.multipliers[: self.loop_rows, None]
            np.add.at(force, self._joints + self._loop_rows.owner, of_loops * rows.force)
            np.add.at(torque, self._joints + self._loop_rows.owner, of_loops * rows.torque)
            pulls = np.zeros((len(bodies.pose), 4, 4))
            on_b = (of_loops * rows.form).reshape(-1, 4, 4)
            np.add.at(pulls, self._loop_b, on_b)
            np.add.at(pulls, self._loop_a, -on_b)
            forces -= pulls[:-1]
        total = (self.tree.behind @ forces.reshape(-1, 16)).reshape(-1, 4, 4)
        joints = slice(0, self._joints)
        force[joints] = total[:, :3, 3]
        torque[joints] = total[:, :3, :3].reshape(-1, 9) @ SKEW.T - cross(ends.place[joints], force[joints])
        return force, torque

    def efforts(self, bodies: Bodies) -> Array:
        """Efforts of the actuators, N or N m, (actuators,)."""
        return self.applied.efforts(self.connections.ends(bodies, slice(0, self._joints)))

    def constraint_rows(self, bodies: Bodies) -> Array:
        """Jacobian of all connections, couplings and motions for the velocities of the bodies, (rows, 6 bodies)."""
        ends, every = self.connections.ends(bodies), self.connections.constraints()
        rows, on_bodies = every.at(ends), partial(self.connections.on_bodies, bodies, ends)
        blocks = [on_bodies(every.owner, rows.force, rows.torque)]
        for joints, factors, _ in self._couplings:
            push, turn = self.applied.along(joints.tolist(), ends)
            blocks.append(factors @ on_bodies(joints, push, turn)[None])
        for joint, _ in self._moved:
            blocks.append(on_bodies(np.array([joint]), *self.applied.along([joint], ends)))
        return np.concatenate(blocks)

    def accept(self, x: Array) -> None:
        """Notes a state from which the motion goes on, for forces that depend on turns."""
        if self.applied.remembers:
            self.applied.accept(self.connections.ends(self.bodies(x)))

    def _with_unit_quaternions(self, x: Array) -> Array:
        x = x.copy()
        q = self.parts(x)[1]
        q /= ((q * q).sum(1) ** 0.5)[:, None]
        return x


def _rank_of_loops(mechanism: Mechanism) -> int:
    if not (mechanism.loops or mechanism.couplings or mechanism.prescribed):
        return 0
    tree, (q, v) = Tree(mechanism), mechanism.start()

    def of_loops(q: Array) -> tuple[Array, Array]:
        rows = tree.loop_rows(tree.at(q, 0.0 * v))
        return rows.residual, rows.C

    return independent_anywhere(q, of_loops, tree.moved)


def _joined(*parts: Array) -> Array:
    """Joined state, or its rates, from r, quaternions, v and ω."""
    return np.concatenate([part.ravel() for part in parts])


def _rotation(p: Array, q: Array) -> Array:
    """Ten numbers for each pair of quaternions (w, x, y, z), bilinear in the two; shape (pairs, 10).

    For p = q: the rotation matrix times |q|², row by row, then |q|².
    """
    (a, b, c, d), (w, x, y, z) = p.T, q.T
    rows = (
        (a * w + b * x - c * y - d * z, 2 * (b * y - a * z), 2 * (b * z + a * y)),
        (2 * (b * y + a * z), a * w - b * x + c * y - d * z, 2 * (c * z - a * x)),
        (2 * (b * z - a * y), 2 * (c * z + a * x), a * w - b * x - c * y + d * z),
    )
    return np.array([*rows[0], *rows[1], *rows[2], a * w + b * x + c * y + d * z]).T


# Both for all pairs of units: with the products of all pairs of elements this takes three calls of numpy, not thirty.
_ROTATION = _rotation(np.repeat(np.eye(4), 4, axis=0), np.tile(np.eye(4), (4, 1)))
_RATE = quaternion_rate(np.repeat(np.eye(4), 3, axis=1), np.tile(np.eye(3), 4)).T


def rotations(q: Array) -> Array:
    """Rotation matrices of quaternions (w, x, y, z) of any nonzero length, (bodies, 3, 3)."""
    squared = (q[:, :, None] * q[:, None, :]).reshape(-1, 16) @ _ROTATION
    return np.asarray((squared[:, :9] / squared[:, 9:]).reshape(-1, 3, 3))


def quaternion_rates(q: Array, w: Array) -> Array:
    """Half the product of quaternions and angular velocities in the bodies' own axes, (bodies, 4)."""
    return np.asarray((q[:, :, None] * w[:, None, :]).reshape(-1, 12) @ _RATE)
