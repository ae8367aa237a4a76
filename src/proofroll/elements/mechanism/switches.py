"""Dry friction and stops of joints: what holds, what pushes, and which of it follows from the forces.

A switched joint has one coordinate. Its mode is ``free``; ``forward`` or ``backward`` where it moves against dry
friction; ``stick`` where friction holds it; ``low`` or ``high`` where a stop does, with its friction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.rotations import Array

Mode = tuple[str, ...]
_MOST_PIVOTS = 1000  # of the complementarity problem; a few joints take as many as they are
HOLDING = frozenset({"stick", "low", "high"})


@dataclass(frozen=True)
class SwitchedJoint:
    """A joint with dry friction, or with a stop.

    Attributes:
        name: of the joint.
        number: its place among the joints.
        coordinate, velocity: its places in q and v.
        friction: N or N m; 0: none.
        low, high: rad or m; infinite: no stop.
        restitution: of an impact on a stop.
    """

    name: str
    number: int
    coordinate: int
    velocity: int
    friction: float
    low: float
    high: float
    restitution: float

    def bounds(self, mode: str) -> tuple[float, float]:
        """Least and greatest force on the coordinate by which this mode can hold it, N or N m."""
        low = -math.inf if mode == "high" else -self.friction
        return low, math.inf if mode == "low" else self.friction

    def moving(self, direction: float) -> str:
        """The mode in which the joint moves in a direction."""
        if not self.friction:
            return "free"
        return "forward" if direction > 0 else "backward"

    def resting(self, q: float) -> str:
        """The mode that holds the joint at a coordinate, if any can."""
        return "low" if q <= self.low else "high" if q >= self.high else "stick" if self.friction else "free"

    def push(self, mode: str) -> float:
        """Force of kinetic friction on the coordinate, N or N m."""
        return {"forward": -self.friction, "backward": self.friction}.get(mode, 0.0)


def switched_joints(mechanism: Mechanism) -> tuple[SwitchedJoint, ...]:
    """The joints of a mechanism that have dry friction or limits.

    Raises:
        Refused: dry friction in a joint with several coordinates, which has no direction of its own.
    """
    found = []
    for number, joint in enumerate(mechanism.joints):
        if not joint.friction and joint.limits is None:
            continue
        if joint.nq != 1:
            raise Refused(f"joint {joint.name} has dry friction along several coordinates, which no route follows")
        q, v = mechanism.q_slices[number].start, mechanism.v_slices[number].start
        low, high = joint.limits or (-math.inf, math.inf)
        found.append(SwitchedJoint(joint.name, number, q, v, joint.friction, low, high, joint.restitution))
    return tuple(found)


def complementary(free: Array, G: Array, low: Array, high: Array) -> tuple[NDArray[np.int_], Array, Array]:
    """Forces that hold where they can: a = free + G f is zero where f lies between its bounds.

    At the lower bound a ≥ 0, at the upper one a ≤ 0. G is positive definite; pivots by least index (Murty, 1974).

    Returns:
        Of each force -1, 0, 1: at its lower bound, between, at its upper bound; the forces; the accelerations.

    Raises:
        Refused: G is singular, so that forces which hold are not determinate.
    """
    state = np.zeros(len(free), dtype=int)
    for _ in range(_MOST_PIVOTS):
        held = state == 0
        f = np.where(state > 0, high, np.where(state < 0, low, 0.0))
        try:
            f[held] = -np.linalg.solve(G[np.ix_(held, held)], free[held] + G[np.ix_(held, ~held)] @ f[~held])
        except np.linalg.LinAlgError:
            raise Refused("several joints hold one degree of freedom: their forces are not determinate") from None
        a = free + G @ f
        wrong = np.flatnonzero((held & ((f > high) | (f < low))) | ((state > 0) & (a > 0)) | ((state < 0) & (a < 0)))
        if not len(wrong):
            return state, f, a
        k = int(wrong[0])
        state[k] = 0 if state[k] else (1 if f[k] > high[k] else -1)
    raise Refused("which joints hold is not found: the complementarity problem has no solution by pivots")


def margin(free: Array, G: Array, low: Array, high: Array, f: Array, a: Array) -> float:
    """How far a solution of :func:`complementary` is from another one, relative to the forces in play.

    Of a force between its bounds the distance from the nearer one, of one at a bound the force that would stop it.
    """
    least = math.inf
    for k in range(len(free)):
        inertia = 1.0 / G[k, k]
        size = abs(f[k]) + abs(free[k]) * inertia + sum(abs(x) for x in (low[k], high[k]) if math.isfinite(x))
        apart = max(abs(a[k]) * inertia, min(high[k] - f[k], f[k] - low[k]))
        if size > 0:
            least = min(least, apart / size)
    return least


def load_of(joints: Sequence[SwitchedJoint], mode: Mode, nv: int) -> Array:
    """Kinetic friction along the velocities of the tree, (nv)."""
    load = np.zeros(nv)
    for joint, own in zip(joints, mode, strict=True):
        load[joint.velocity] += joint.push(own)
    return load


def held_by(mode: Mode) -> list[int]:
    """Numbers, among the switched joints, of those that are held."""
    return [number for number, own in enumerate(mode) if own in HOLDING]
