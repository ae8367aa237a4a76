"""Analysis of a mechanism's constraints: rank, redundancy, mobility, and determinate reactions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import uneven
from proofroll.core.last_results import kept
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion, Rows, Tree
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array, cross, skews

SINGULAR = 1e-12  # least eigenvalue of a mass matrix scaled to a diagonal of ones; below, it counts as singular


def lacks_inertia(mechanism: Mechanism) -> bool:
    """True if the tree alone, without its loops and couplings, can move at the start without kinetic energy."""
    light = any(not body.mass or not np.any(body.inertia) for body in mechanism.bodies)
    if not light or not (mechanism.loops or mechanism.couplings):
        return False
    motion = Tree(mechanism).at(*mechanism.start())
    rows = [np.diag(np.sqrt([joint.armature for joint in mechanism.joints for _ in range(joint.nv)]))]
    for number, body in enumerate(mechanism.bodies):
        R, J = motion.R_WB[number], motion.J[number]
        arm = (R @ np.array(body.com))[None]
        moments, axes = np.linalg.eigh(np.array(body.inertia))
        rows.append(np.sqrt(body.mass) * (J[:3] - skews(arm)[0] @ J[3:]))
        rows.append(np.sqrt(np.maximum(moments, 0.0))[:, None] * ((R @ axes).T @ J[3:]))
    speeds = np.concatenate(rows)
    sizes = np.linalg.norm(speeds, axis=0)
    values = np.linalg.svd(speeds / np.where(sizes > 0, sizes, 1.0), compute_uv=False)
    return bool(values.min(initial=1.0) ** 2 < SINGULAR)


# At a pose closed to 1e-12 a dependent row shows as a relative singular value near 1e-12 or below, an independent one
# of the mechanisms seen so far above 1e-3; 1e-8 lies between, with room on both sides.
RANK = 1e-8
_LEAST = 1e-6  # m, 1: largest singular value of rows below which these are compared with it
# Response of a coordinate or slide to forces, relative to that without loops and motions, up to which it is round-off:
# loops and motions alone move it.
NO_RESPONSE = 1e-13
NEARBY = 0.05  # rad or m: far enough from a singular start to see the rank that holds in general
# A pose counts as singular if the least singular value of its rows, relative to the usual one, is below this. It is
# the root of 1e-9: a length changed by 1e-9 of itself makes such a pose singular, and no file is surer of a length.
BRANCHES = 3e-5
Start = TypeVar("Start")
_FOLLOWED = 0.3  # least determinant between bases of a space at two poses; 1: unchanged, 0: a direction left it
_ZERO = 1e-9  # relative: a component of a null vector that is zero but for round-off


@dataclass(frozen=True)
class Analysis:
    """Result of :func:`analyse`.

    Attributes:
        rows: number of constraint rows of all loops.
        rank: rank of the rows at a general pose; what a solver should fix.
        redundant: rows that follow from the others.
        mobility: degrees of freedom at a general pose.
        singular_start: True if the start is a singular pose, or too near to one for lengths to tell.
        determinate: True where the equations of motion alone determine a component (Fx, Fy, Fz, Mx, My, Mz in world
            axes, at the joint) of the wrench of each joint and then each loop, (joints + loops, 6).
    """

    rows: int
    rank: int
    redundant: int
    mobility: int
    singular_start: bool
    determinate: NDArray[np.bool_]


@kept
def analyse(mechanism: Mechanism) -> Analysis:
    """Rank, redundancy, mobility and determinate reactions, at the start and at a general pose near it."""
    tree = Tree(mechanism)
    q, v = mechanism.start()
    motion = tree.at(q, v)
    rows = tree.loop_rows(motion)
    values = singular_values(rows.C)
    at_start = rank_of(values)
    rest = np.zeros(mechanism.nv)

    def of_loops(q: Array) -> tuple[Array, Array]:
        rows = tree.loop_rows(tree.at(q, rest))
        return rows.residual, rows.C

    near = tree.at(general_place(q, of_loops, tree.moved), rest)
    near_rows = tree.loop_rows(near)
    near_values = singular_values(near_rows.C)
    rank = max(at_start, rank_of(near_values))
    mask = determinate(tree, near, near_rows, rank)
    if at_start == rank:
        mask &= determinate(tree, motion, rows, rank)
    return Analysis(
        rows=len(rows.residual),
        rank=rank,
        redundant=len(rows.residual) - rank,
        mobility=mechanism.nv - rank,
        # nearby, a least value that starts at zero has come to NEARBY of its usual size
        singular_start=bool(rank and values[rank - 1] < BRANCHES / NEARBY * near_values[rank - 1]),
        determinate=mask,
    )


def singular_values(C: Array) -> Array:
    """Singular values of constraint rows, largest first; none where there are no rows."""
    return np.asarray(np.linalg.svd(C, compute_uv=False) if C.size else np.zeros(0), dtype=np.float64)


def least_norm_solution(matrix: Array, right: Array) -> Array:
    """Vector x of least norm that minimises abs(matrix·x − right).

    Singular values below RANK times the largest count as zero.
    """
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=RANK)[0], dtype=np.float64)


def rank_of(values: Array) -> int:
    """Number of singular values above round-off, which is all there is of rows that hold nothing in a turned frame."""
    return int((values > RANK * values.max(initial=_LEAST)).sum())


def _inverse(C: Array) -> Array:
    """Generalised inverse of constraint rows, in which round-off counts as zero as in :func:`rank_of`."""
    values = singular_values(C)
    least = RANK * values.max(initial=_LEAST)
    return np.asarray(np.linalg.pinv(C, least / values[0] if values[:1].any() else 1.0), dtype=np.float64)


class RowSign:
    """Sign that constraint rows have along a motion; it changes where they lose rank.

    It is that of the product of their singular values, whose vectors are followed continuously from pose to pose: for
    one matrix alone all singular values are positive. ``rank`` is that of the rows at a general pose.
    """

    def __init__(self, rank: int) -> None:
        self._rank, self._before = rank, (np.zeros((0, 0)), np.zeros((0, 0)))
        self._usual, self.least = 0.0, 1.0

    def changes(self, C: Array) -> bool:
        """True if the rows, (rows, velocities), lost rank between the pose before and this one.

        Also False where the singular vectors turned too far to be followed. Sets ``least``: the least singular value
        relative to its largest so far.
        """
        U, S, Vt = np.linalg.svd(C, full_matrices=False)
        self._usual = max(self._usual, float(S[self._rank - 1]))
        self.least = float(S[self._rank - 1]) / self._usual if self._usual else 0.0
        left, right = U[:, : self._rank], Vt[: self._rank].T
        (left_before, right_before), self._before = self._before, (left, right)
        if not left_before.size:
            return False
        turned = np.linalg.det(left_before.T @ left), np.linalg.det(right_before.T @ right)
        return bool(turned[0] * turned[1] < 0 and min(map(abs, turned)) > _FOLLOWED)


def determinate(tree: Tree, motion: BodyMotion, rows: Rows, rank: int) -> NDArray[np.bool_]:
    """Mask of wrench components that no null vector of Cᵀ changes, joints before loops, (joints + loops, 6)."""
    mask: NDArray[np.bool_] = freedom(tree, motion, rows, rank) <= _ZERO
    return mask


def freedom(tree: Tree, motion: BodyMotion, rows: Rows, rank: int) -> Array:
    """Change of each wrench component by all null vectors of Cᵀ together, relative to the most changed.

    It does not depend on the basis of the null vectors. Shape (joints + loops, 6).
    """
    mechanism = tree.mechanism
    squares = np.zeros((len(mechanism.joints) + len(mechanism.loops), 6))
    if len(rows.residual) > rank:
        for null in np.linalg.svd(rows.C, full_matrices=True)[0][:, rank:].T:
            none = np.zeros((len(mechanism.bodies) + 1, 6))
            squares += np.concatenate(reactions(tree, motion, rows, null, none)) ** 2
    return np.asarray(np.sqrt(squares / (squares.max(initial=0.0) or 1.0)), dtype=np.float64)


def reactions(tree: Tree, motion: BodyMotion, rows: Rows, multipliers: Array, loads: Array) -> tuple[Array, Array]:
    """Wrenches that joints and loops transmit, from the other loads on the bodies.

    Args:
        tree: the mechanism's.
        motion: pose of all bodies.
        rows: constraints of the loops there.
        multipliers: one per row.
        loads: force and moment about the world's origin that joints and loops together must bring to each body (its
            inertial wrench minus gravity and springs), N and N m, (bodies + 1, 6).

    Returns:
        Force and moment in world axes on the child at the joint (joints, 6), on body_b at the loop's point (loops, 6).
    """
    mechanism = tree.mechanism
    needed = loads.copy()
    of_loops = np.zeros((len(mechanism.loops), 6))
    for number, loop in enumerate(mechanism.loops):
        mine = rows.loop == number
        force, torque = multipliers[mine] @ rows.force[mine], multipliers[mine] @ rows.torque[mine]
        of_loops[number] = np.concatenate([force, torque])
        place = tree.point(motion, loop.body_b, np.array(loop.position_b))[0]
        about_origin = np.concatenate([force, torque + cross(place, force)])
        needed[mechanism.body_index[loop.body_b]] -= about_origin
        needed[mechanism.body_index[loop.body_a]] += about_origin
    of_joints = np.zeros((len(mechanism.joints), 6))
    for k in reversed(range(len(mechanism.joints))):
        wrench = needed[tree.children[k]]
        needed[tree.parents[k]] += wrench
        of_joints[k, :3] = wrench[:3]
        of_joints[k, 3:] = wrench[3:] - cross(motion.p_joint[k], wrench[:3])
    return of_joints, of_loops


def general_place(
    start: Start, rows: Callable[[Start], tuple[Array, Array]], moved: Callable[[Start, Array], Start]
) -> Start:
    """State near the start that fulfils the constraints and is in no special position; a start may be a singular pose.

    Args:
        start: a state, in any representation.
        rows: function of a state: residuals, (rows,), and constraint matrix, (rows, velocities).
        moved: the state after a small displacement, shape (velocities,).
    """
    _, C = rows(start)
    direction = uneven(C.shape[1])
    direction -= _inverse(C) @ (C @ direction)
    state = moved(start, NEARBY * direction / max(np.abs(direction).max(initial=0.0), 1e-300))
    for _ in range(10 if C.size else 0):  # Newton's method doubles the digits; four rounds do from so near
        residual, C = rows(state)
        state = moved(state, -_inverse(C) @ residual)
    return state
