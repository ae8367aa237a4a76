"""Modes of joints by complementarity, for states that no route follows: starts without contacts, records of robots.

Motions that switch have their modes from :mod:`proofroll.elements.mechanism.contact.dynamics` in route 1 of the truth.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.dynamics.switches import REDUNDANT, Mode, SwitchedJoint, held_joints
from proofroll.elements.mechanism.scene.rotations import Array

ROUND_OFF = 1e-12  # of accelerations, in parts of what they are the sum of: no pivot, or round-off alternates for ever
_MOST_TRIED = 6  # largest number of joints at rest where some share one degree of freedom
_MOST_PIVOTS = 1000  # of the complementarity problem; usually about one for each joint
_UNDECIDED = (
    "pivots do not find which joints with friction or stops hold; rounding may decide it: "
    "change the parameters, or leave out the friction or the stop of one joint"
)


def complementary(free: Array, G: Array, low: Array, high: Array) -> tuple[NDArray[np.int_], Array, Array]:
    """Solves a = free + G f, with a = 0 where f is between its bounds.

    At the lower bound a ≥ 0, at the upper one a ≤ 0. G is positive definite; pivots by least index (Murty, 1974). Or
    it is singular, where joints share one degree of freedom: then all sides are tried, and these joints must move.

    Returns:
        Side of each force (-1 at its lower bound, 0 between, 1 at its upper bound), the forces f, the accelerations a.

    Raises:
        Refused: joints that share one degree of freedom are held, so that their forces are not determinate; or none are
            found.
    """
    scale = np.sqrt(np.maximum(np.diag(G), 0.0))
    if np.any(scale <= RANK * scale.max()):
        raise Refused(REDUNDANT)
    alike = G / np.outer(scale, scale)
    if np.linalg.matrix_rank(alike, tol=RANK) < len(G):
        if len(G) > _MOST_TRIED:
            raise Refused(REDUNDANT)
        return _turning(free, G, low, high, scale)
    side = np.zeros(len(free), dtype=int)
    for _ in range(_MOST_PIVOTS):
        f, a, beyond, rounded = _at_sides(free, G, low, high, scale, side)
        wrong = np.flatnonzero(beyond > rounded)
        if not len(wrong):
            return side, np.clip(f, low, high), np.where(side * a > 0, 0.0, a)
        k = int(wrong[0])
        side[k] = 0 if side[k] else (1 if f[k] > high[k] else -1)
    raise Refused(_UNDECIDED)


def _at_sides(
    free: Array, G: Array, low: Array, high: Array, scale: Array, side: Array
) -> tuple[Array, Array, Array, Array]:
    """Forces and accelerations with each force on its side; violation of each inequality, and its round-off."""
    held = side == 0
    f = np.where(side > 0, high, np.where(side < 0, low, 0.0))
    f[held] = -np.linalg.solve(G[np.ix_(held, held)], free[held] + G[np.ix_(held, ~held)] @ f[~held])
    a = np.where(held, 0.0, free + G @ f)
    beyond = np.where(held, np.maximum(f - high, low - f) * scale**2, side * a)
    return f, a, beyond, ROUND_OFF * (np.abs(free) + scale * (scale @ np.abs(f)))


def _turning(free: Array, G: Array, low: Array, high: Array, scale: Array) -> tuple[NDArray[np.int_], Array, Array]:
    """Solution where joints share one degree of freedom, if these move on; see :func:`complementary`."""
    for sides in itertools.product((-1, 0, 1), repeat=len(free)):
        side = np.array(sides)
        held = side == 0
        unbounded = np.isinf(np.where(side > 0, high, low)) & ~held
        alike = G[np.ix_(held, held)] / np.outer(scale[held], scale[held])
        if unbounded.any() or (held.any() and np.linalg.matrix_rank(alike, tol=RANK) < len(alike)):
            continue
        f, a, beyond, rounded = _at_sides(free, G, low, high, scale, side)
        # what moves does so by more than round-off, or it shares the degree of freedom of what is held
        if np.all(np.where(held, beyond <= rounded, beyond < -rounded)):
            return side, np.clip(f, low, high), a
    raise Refused(REDUNDANT)


def load_of(joints: Sequence[SwitchedJoint], mode: Mode, nv: int) -> Array:
    """Kinetic friction along the velocities of the tree [N, N m], (nv); modes of efforts come last and are ignored."""
    load = np.zeros(nv)
    for joint, joint_mode in zip(joints, mode, strict=False):
        load[joint.velocity] += joint.push(joint_mode)
    return load


class RestResponse(NamedTuple):
    """Response of some velocities to forces along them.

    Attributes:
        free: their rates without these forces, (forces,).
        by_force: response of each to a unit force along each, (forces, forces).
        moved: True where no force adds anything, for loops and motions alone move the joint, (forces,).
        least: size of each rate that is round-off, (forces,).
    """

    free: Array
    by_force: Array
    moved: NDArray[np.bool_]
    least: Array


# Function of a mode and some velocities.
Responses = Callable[[Mode, Sequence[int]], RestResponse]


def decided_mode(joints: Sequence[SwitchedJoint], q: Array, v: Array, responses: Responses) -> Mode:
    """Mode of the switched joints that follows from the forces.

    A joint at rest stays at rest if the force that this needs lies between its bounds. All joints at rest are solved
    together, for they affect each other. A joint that only loops and motions move slides as they begin to move it, and
    is free where they do not.
    """
    mode = [
        joint.resting(q[joint.coordinate]) if v[joint.velocity] == 0 else joint.moving(v[joint.velocity])
        for joint in joints
    ]
    resting = held_joints(tuple(mode))

    def released() -> RestResponse:
        """Response of the joints at rest, which are free for it."""
        of_rest: Mode = tuple("free" if number in resting else kind for number, kind in enumerate(mode))
        return responses(of_rest, [joints[number].velocity for number in resting])

    response = released() if resting else None
    if response is not None and response.moved.any():
        for number, moved, rate, least in zip(resting, response.moved, response.free, response.least, strict=True):
            if moved:
                mode[number] = joints[number].moving(rate) if abs(rate) > least else "free"
        resting = held_joints(tuple(mode))
        response = released() if resting else None
    if response is None:
        return tuple(mode)
    low, high = np.array([joints[number].bounds(mode[number]) for number in resting]).T
    state = complementary(response.free, response.by_force, low, high)[0]
    for number, side in zip(resting, state, strict=True):
        if side:
            mode[number] = joints[number].moving(-side)
    return tuple(mode)
