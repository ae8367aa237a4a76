"""Null space of the constraints, by elimination along the tree of joints, and the part of it that loops allow.

A joint determines the twist of its child except along a few directions S, so velocities ν along these give the twists
of all bodies: V = Σ S ν over the joints between a body and the world. This is the null space D of the joints' rows.
DᵀMD needs only sums over the bodies behind each joint: with a body's inertia matrix Σ, the integral of p pᵀ over its
mass, p = [position; 1], its element (k, l) is ⟨S_k, S_l Σ_l⟩, where Σ_l sums the bodies behind l. Rows of loops act on
differences of two twists, and are few; their singular vectors in the metric of DᵀMD allow for dependent rows.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.projection.smooth.connections import SKEW, Bodies, ProjectedConnections

# Velocities of each kind of joint: (rotation?, axis of the frame on its carrier, is the carrier body b?).
_TURN_B, _SLIDE_A = [(True, k, True) for k in range(3)], [(False, k, False) for k in range(3)]
DIRECTIONS: dict[str, list[tuple[bool, int, bool]]] = {
    JointKind.FIXED: [],
    JointKind.REVOLUTE: [_TURN_B[2]],
    JointKind.PRISMATIC: [_SLIDE_A[2]],
    JointKind.CYLINDRICAL: [_SLIDE_A[2], _TURN_B[2]],
    JointKind.UNIVERSAL: [(True, 2, False), _TURN_B[0]],
    JointKind.SPHERICAL: _TURN_B,
    JointKind.PLANAR: [*_SLIDE_A[:2], _TURN_B[2]],
    JointKind.FREE: [*_SLIDE_A, *_TURN_B],
}


class Space(NamedTuple):
    """Null space of the joints at a state, and the mass matrix in it.

    Attributes:
        S: twists of unit velocities, (nv, 16).
        H: DᵀMD, upper triangle, (nv, nv).
    """

    S: Array
    H: Array


class Loads(NamedTuple):
    """Forces on the bodies, and accelerations that act like forces.

    Attributes:
        bent: accelerations at constant twists, minus gravity, in the bodies' own axes, (bodies, 4, 4).
        pulls: forces on the bodies, as matrices f pᵀ, (bodies, 4, 4).
        drives: forces along the joints' velocities, (nv,).
    """

    bent: Array | float = 0.0
    pulls: Array | float = 0.0
    drives: Array | float = 0.0


# Function of null space, given twists, and forces along the velocities (…, nv): velocities (…, nv) and multipliers.
Closing = Callable[[Space, Array, Array], tuple[Array, Array]]


class Elimination:
    """Tree of a mechanism.

    Attributes:
        behind: 1 where a joint carries a body, (joints, bodies).
        joint: index of the joint of each velocity.
        turns: True for each velocity that is a rotation.
        moves: 1 where a velocity moves a body, the world last, (bodies + 1, nv).
        armature: inertia of the drive along each velocity.
    """

    def __init__(self, mechanism: Mechanism, connections: ProjectedConnections) -> None:
        joints, n = mechanism.joints, len(mechanism.bodies)
        self.behind = np.zeros((len(joints), n))
        child = {int(body): number for number, body in enumerate(connections.b[: len(joints)])}
        for body in range(n):
            above = child.get(body)
            while above is not None:
                self.behind[above, body] = 1.0
                above = child.get(int(connections.a[above]))
        ways = [(number, *way) for number, joint in enumerate(joints) for way in DIRECTIONS[joint.kind]]
        self.joint = np.array([way[0] for way in ways], dtype=np.intp)
        self.turns = np.array([way[1] for way in ways], dtype=bool)
        self._own = np.zeros((len(ways), 4, 4))
        carriers = []
        for column, (number, turns, axis, by_child) in zip(self._own, ways, strict=True):
            ends = connections.at_b if by_child else connections.at_a
            carriers.append(int((connections.b if by_child else connections.a)[number]))
            direction, place = ends[number, :3, axis], ends[number, :3, 3]
            if turns:
                column[:3, :3] = (direction @ SKEW).reshape(3, 3)
                column[:3, 3] = -column[:3, :3] @ place
            else:
                column[:3, 3] = direction
        self.armature = np.array([joints[number].armature for number in self.joint.tolist()])
        self._carrier = np.array(carriers, dtype=np.intp)
        # bodies behind each velocity, and velocities before each body; none for the world
        self._sums = self.behind[self.joint]
        self.moves = np.vstack([self._sums.T, np.zeros(len(ways))])
        self._steps = np.vstack([self.behind.T, np.zeros(len(joints))])
        related = np.array([[self.behind[k, connections.b[m]] for m in self.joint] for k in self.joint])
        self._related = np.triu(related.reshape(len(ways), len(ways)))
        self._inertia = np.zeros((n, 4, 4))
        for sigma, solid in zip(self._inertia, mechanism.bodies, strict=True):
            sigma[:3, :3] = 0.5 * np.trace(solid.inertia) * np.eye(3) - np.asarray(solid.inertia)
            sigma[3, 3] = solid.mass

    def directions(self, bodies: Bodies) -> Array:
        """Twists of unit velocities, (nv, 4, 4)."""
        c = self._carrier
        return np.asarray(bodies.pose[c] @ self._own @ bodies.inverse[c])

    def inertia(self, bodies: Bodies) -> Array:
        """Matrices Σ (mass, first and second moments) of the bodies in world axes, (bodies, 4, 4)."""
        pose = bodies.pose[:-1]
        return np.asarray(pose @ self._inertia @ pose.swapaxes(1, 2))

    def space(self, bodies: Bodies) -> Space:
        """Null space at a state."""
        S, inertia = self.directions(bodies), self.inertia(bodies).reshape(-1, 16)
        moved = (S @ (self._sums @ inertia).reshape(-1, 4, 4)).reshape(-1, 16)
        flat = S.reshape(-1, 16)
        return Space(flat, (flat @ moved.T) * self._related + np.diag(self.armature))

    def forces(self, bodies: Bodies, acceleration: Array) -> Array:
        """Forces needed for accelerations [α× a; 0 0] of the bodies in their own axes, (…, bodies, 4, 4).

        A force f at p is the matrix f pᵀ, a moment half of its cross-product matrix. Only the antisymmetric part of
        moments is kept: it vanishes exactly for a body that spins about a principal axis.
        """
        moments = acceleration @ self._inertia
        turning = moments[..., :3, :3]
        moments[..., :3, :3] = 0.5 * (turning - turning.swapaxes(-1, -2))
        pose = bodies.pose[:-1]
        return np.asarray(pose @ moments @ pose.swapaxes(1, 2))

    def motions(
        self, bodies: Bodies, relative: Array, loads: Loads, closing: Closing | None = None
    ) -> tuple[Array, Array, Array]:
        """Projected motions of the bodies: rates of their twists; or twists, for the removal of violations.

        Args:
            bodies: their motion.
            relative: twists of children minus those of their parents that the joints prescribe, (…, joints, 16).
            loads: forces on the bodies.
            closing: solver for the velocities under additional rows; None: no such rows.

        Returns:
            Motions (…, bodies + 1, 4, 4), velocities (…, nv), and multipliers of the additional rows.
        """
        space = self.space(bodies)
        matrices = _matrices(self._steps @ relative)
        needed = self.forces(bodies, bodies.inverse[:-1] @ matrices[..., :-1, :, :] @ bodies.pose[:-1] + loads.bent)
        push = loads.drives - (space.S * (self._sums @ _flat(needed - loads.pulls))).sum(-1)
        velocities, multipliers = (closing or without_rows)(space, matrices, push)
        return matrices + _matrices(self.moves @ (space.S * velocities[..., None])), velocities, multipliers

    def twists(self, bodies: Bodies, velocities: Array) -> Array:
        """Twists of the bodies for velocities (nv,), (bodies + 1, 4, 4)."""
        return _matrices(self.moves @ (_flat(self.directions(bodies)) * velocities[:, None]))

    def of_joints(self, bodies: Bodies, force: Array, torque: Array) -> Array:
        """Forces along the velocities, (nv,), from forces and moments of joints on their children, (joints, 3) each."""
        S = self.directions(bodies)
        turning = 0.5 * (S[:, :3, :3].reshape(-1, 9) @ SKEW.T) * torque[self.joint]
        return np.asarray(np.where(self.turns[:, None], turning, S[:, :3, 3] * force[self.joint]).sum(1))


def _flat(matrices: Array) -> Array:
    return matrices.reshape(*matrices.shape[:-2], 16)


def _matrices(flat: Array) -> Array:
    return flat.reshape(*flat.shape[:-1], 4, 4)


class RowSplit:
    """Velocities that rows lock, and those they allow, in the metric of the mass matrix H.

    Attributes:
        least: smallest relevant singular value of the rows, relative to the largest.
    """

    def __init__(self, H: Array, C: Array, rank: int) -> None:
        from scipy.linalg.lapack import dgesdd, dpotrf, dtrtri  # imported here, as balls do not need it

        upper, failed = dpotrf(H)
        if failed:
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        self._into, self._C = dtrtri(upper)[0], C
        U, values, Vt, failed = dgesdd(C @ self._into, full_matrices=0)
        if failed:
            raise np.linalg.LinAlgError("the singular values were not found")
        if rank > len(values):
            raise np.linalg.LinAlgError("more rows hold than there are velocities")
        self.least = float(values[rank - 1] / values[0])
        self._locked, self._back = self._into @ Vt[:rank].T, U[:, :rank].T / values[:rank, None]

    def mobility(self) -> Array:
        """Response of each velocity to a force along it, relative to that without the rows, (nv,)."""
        return np.asarray(1 - (self._locked**2).sum(axis=1) / (self._into**2).sum(axis=1))

    def reach(self, velocities: Array) -> Array:
        """Largest value of each velocity with the kinetic energy of these, (nv,)."""
        energetic = float(np.linalg.norm(np.linalg.solve(self._into, velocities)))
        return np.asarray(energetic * np.linalg.norm(self._into, axis=1))

    def __call__(self, push: Array, rates: Array) -> tuple[Array, Array]:
        """Solution ν, λ of H ν = push + Cᵀλ and C ν = wanted, for several right-hand sides (nv, …) and (rows, …)."""
        free = self._into @ (self._into.T @ push)
        normal = self._back @ (rates - self._C @ free)
        return free + self._locked @ normal, self._back.T @ normal


def without_rows(space: Space, _: Array, push: Array) -> tuple[Array, Array]:
    """Velocities without loops, couplings, motions and held joints, and no multipliers."""
    if not push.size:  # only fixed joints
        return push, np.zeros(0)
    return solved(space.H, push.T).T, np.zeros(0)


def solved(H: Array, push: Array) -> Array:
    """Solution ν of H ν = push, for right-hand sides (nv, …); H, positive definite, by its upper triangle."""
    from scipy.linalg.lapack import dposv  # imported here, as balls do not need it

    _, velocities, failed = dposv(H, push)
    if failed:
        raise np.linalg.LinAlgError("the mass matrix is not positive definite")
    return np.asarray(velocities)
