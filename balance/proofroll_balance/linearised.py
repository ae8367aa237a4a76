"""Equilibrium of a mechanism near a pose, and eigenvalues of small motions about it, from accelerations alone."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import linear_sum_assignment

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates

# Displacement for derivatives by central differences, rad or m and per s: with Richardson's extrapolation from half of
# it the error is that power of four, 1e-12, and round-off of accelerations as large.
_STEP = 1e-3
_ROUNDS, _HALVINGS = 60, 30  # of Newton's method; from a fair start it needs five
_LONGEST = 0.5  # rad or m in one of its steps
# Accelerations at an equilibrium, relative to those of free bodies: round-off, and that of ill-conditioned loops.
_LEFT, _MOST_LEFT = 1e-13, 1e-9


class Displaced(Protocol):
    """A way to evaluate accelerations of a mechanism beside a pose."""

    def directions(self) -> Array:
        """Orthonormal velocities that all constraints allow at the pose, (velocities, freedom)."""

    def accelerations(self, displaced: Array, velocities: Array) -> Array:
        """Accelerations after a small displacement along the velocities [rad or m], at velocities; (velocities,)."""


class InTree:
    """Route 1: joint coordinates, beside the pose q, (nq)."""

    def __init__(self, equations: JointCoordinates, q: Array) -> None:
        self._equations, self._q = equations, q

    def pose(self, displaced: Array) -> Array:
        """Coordinates after a displacement, with all loops closed, (nq)."""
        nq, rest = self._equations.mechanism.nq, np.zeros(self._equations.mechanism.nv)
        state = np.concatenate([self._equations.tree.moved(self._q, displaced), rest])
        for _ in range(3):  # Newton's method doubles the number of digits
            state = self._equations.eliminated(state)
        return np.asarray(state[:nq])

    def directions(self) -> Array:
        """See :class:`Displaced`."""
        C = self._equations.rows(self._q).C
        return np.asarray(null_space(C, RANK)) if C.size else np.eye(self._equations.mechanism.nv)

    def accelerations(self, displaced: Array, velocities: Array) -> Array:
        """See :class:`Displaced`."""
        return self._equations.solve(self.pose(displaced), velocities).acceleration


class Apart:
    """Route 2: separate bodies, beside the start of their mechanism."""

    def __init__(self, route: MaximalCoordinates) -> None:
        self._lean, self._start = route.lean, route.lean.equations.start()

    def directions(self) -> Array:
        """See :class:`Displaced`."""
        C = self._lean.solve(self._start).C
        return np.asarray(null_space(C, RANK)) if C.size else np.eye(self._lean.equations.nu)

    def accelerations(self, displaced: Array, velocities: Array) -> Array:
        """See :class:`Displaced`."""
        e, state = self._lean.equations, self._start.copy()
        end = e.nx + e.nu
        state[e.nx : end] = displaced
        turned = self._lean.solve(state).equations.angle_rate
        state[: e.nx] += self._lean.moving(state[: e.nx], displaced)
        state[end:] += np.array(turned, dtype=float)
        state[e.nx : end] = 0.0
        for _ in range(3):
            state = self._lean.eliminated(state)
        state[e.nx : end] = velocities
        return self._lean.solve(state).acceleration


class Spectrum(NamedTuple):
    """Small motions about a pose at rest.

    Attributes:
        eigenvalues: of the first-order system [1/s], (2 · freedom), sorted by real and imaginary part.
        left: largest acceleration at the pose itself [m/s², rad/s²].
    """

    eigenvalues: NDArray[np.complex128]
    left: float


def spectrum(place: Displaced, step: float = _STEP) -> Spectrum:
    """Eigenvalues of small motions by central differences of accelerations."""
    D = place.directions()
    count, rest = D.shape[1], np.zeros(len(D))
    left = np.abs(place.accelerations(rest, rest)).max(initial=0.0)

    def slopes(size: float) -> Array:
        columns = []
        for which in range(2):
            for way in size * D.T:
                ends = [(s * way, rest) if which == 0 else (rest, s * way) for s in (1.0, -1.0)]
                ahead, back = (place.accelerations(*end) for end in ends)
                columns.append(D.T @ (ahead - back) / (2 * size))
        return np.reshape(columns, (2 * count, count)).T

    if not count:
        return Spectrum(np.zeros(0, dtype=complex), float(left))
    halves = (4 * slopes(step / 2) - slopes(step)) / 3
    matrix = np.vstack([np.hstack([np.zeros((count, count)), np.eye(count)]), halves])
    return Spectrum(np.asarray(np.sort_complex(np.linalg.eigvals(matrix)), dtype=np.complex128), float(left))


def apart(eigenvalues: NDArray[np.complex128], second: NDArray[np.complex128]) -> float:
    """Largest distance between eigenvalues of two spectra that are paired closest [1/s]."""
    distance = np.abs(eigenvalues[:, None] - second[None, :])
    return float(distance[linear_sum_assignment(distance)].max(initial=0.0))


def at_rest(equations: JointCoordinates) -> Array:
    """Coordinates of an equilibrium near the start, by Newton's method, (nq).

    Raises:
        Refused: none is found; the text has what accelerations are left.
    """
    mechanism = equations.mechanism
    q, rest = mechanism.start()[0], np.zeros(mechanism.nv)

    def pulled(pose: Array) -> tuple[Array, Array]:
        D = InTree(equations, pose).directions()
        return D, D.T @ equations.solve(pose, rest).acceleration

    free = _natural(mechanism, equations, q)
    D, pull = pulled(q)
    for _ in range(_ROUNDS):
        if np.abs(pull).max(initial=0.0) <= _LEFT * free:
            return q
        place = InTree(equations, q)
        columns = [
            D.T @ (place.accelerations(_STEP * way, rest) - place.accelerations(-_STEP * way, rest)) for way in D.T
        ]
        slope = np.array(columns).T / (2 * _STEP)
        change = -D @ np.linalg.lstsq(slope, pull, rcond=RANK)[0]
        change *= min(1.0, _LONGEST / max(float(np.abs(change).max(initial=0.0)), 1e-300))
        for _ in range(_HALVINGS):
            moved = place.pose(change)
            D_next, pull_next = pulled(moved)
            if np.linalg.norm(pull_next) < np.linalg.norm(pull):
                break
            change = change / 2
        else:
            break
        q, D, pull = moved, D_next, pull_next
    most = float(np.abs(pull).max(initial=0.0))
    if most <= _MOST_LEFT * free:
        return q
    raise Refused(
        f"no equilibrium near the start: accelerations of {most:.3g} rad/s² or m/s² are left; start nearer to one, or "
        "hold joints where they start with --hold JOINT"
    )


def _natural(mechanism: Mechanism, equations: JointCoordinates, q: Array) -> float:
    """Size of accelerations without constraints [m/s², rad/s²]: gravity, or what acts at the pose."""
    acceleration = float(np.abs(equations.solve(q, np.zeros(mechanism.nv)).acceleration).max(initial=0.0))
    return max(float(np.linalg.norm(mechanism.gravity)), acceleration, 1e-9)
