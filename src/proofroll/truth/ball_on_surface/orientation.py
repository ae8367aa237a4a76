"""Orientation of the ball from its spin over time, by two quadratures that share nothing: one for each route.

The orientation R(t) from the ball's axes to the world's obeys Ṙ = [ω]× R, and as a quaternion q̇ = (0, ω) q / 2, with
the identity at time 0. Both quadratures take steps between the kinks of the spin and multiply the rotations of the
steps.
"""

from collections.abc import Callable, Iterable

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.truth.numerics import collocation

# Rotation of the ball per step [rad], so small that the error of the spin dominates that of the step.
_TURN = 2.0
_IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])

# Nodes in (0, 1), and a function: step lengths [s] (n,), spins at the nodes (n, nodes, 3) -> rotations of the steps as
# quaternions (n, 4).
Quadrature = tuple[FloatArray, Callable[[FloatArray, FloatArray], FloatArray]]


def orientation(
    spin: Callable[[FloatArray], FloatArray], times: FloatArray, kinks: Iterable[float], quadrature: Quadrature
) -> FloatArray:
    """q_WB at rising times [s], scalar first, continuous, shape (n, 4).

    Args:
        spin: w_WB [rad/s] at rising times [s], shape (n, 3).
        times: from 0 on.
        kinks: times at which the spin is not smooth [s].
        quadrature: :data:`QUATERNIONS` or :data:`MATRICES`.
    """
    nodes, turns = quadrature
    knots = np.union1d(np.append(times, 0.0), [time for time in kinks if 0 < time < times[-1]])
    fastest = float(np.max(np.linalg.norm(spin(knots), axis=-1)))
    parts = np.maximum(np.ceil(np.diff(knots) * fastest / _TURN), 1).astype(int)
    h = np.repeat(np.diff(knots) / parts, parts)
    starts = np.repeat(knots[:-1], parts) + h * (np.arange(len(h)) - np.repeat(np.cumsum(parts) - parts, parts))
    q = [_IDENTITY]
    if len(h):
        # The end of a step belongs to that step, and the time of a kink to the step after it: an impact may let the
        # spin jump.
        instants = np.minimum(starts[:, None] + h[:, None] * nodes, np.nextafter(starts + h, 0)[:, None])
        at_nodes = spin(instants.ravel()).reshape(len(h), len(nodes), 3)
        for step in turns(h, at_nodes):
            q.append(_left(step) @ q[-1])
    ends = np.concatenate([[0], np.cumsum(parts)])[np.searchsorted(knots, times)]
    return np.asarray(np.array(q)[ends])


def _left(q: FloatArray) -> FloatArray:
    """Matrices that multiply by quaternions (..., 4) from the left, shape (..., 4, 4)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]
    return np.asarray(np.moveaxis(np.array(rows), (0, 1), (-2, -1)))


def _quaternions(h: FloatArray, spin: FloatArray) -> FloatArray:
    """Rotation of each step by collocation of the quaternion at Gauss points, which keeps its length: order 16."""
    s = len(_GAUSS)
    rates = _left(np.concatenate([np.zeros((*spin.shape[:2], 1)), spin / 2], axis=-1)) * h[:, None, None, None]
    stages = _stages(rates, rates[..., :1], _GAUSS_MATRIX).reshape(-1, s, 4)
    return np.asarray(_IDENTITY + np.einsum("j,njr->nr", _WEIGHTS, stages))


def _matrices(h: FloatArray, spin: FloatArray) -> FloatArray:
    """Rotation of each step by collocation of its matrix, :mod:`proofroll.truth.numerics.collocation`: order 25."""
    from scipy.spatial.transform import Rotation  # slow to load, and few truths need it

    x, y, z = np.moveaxis(spin * h[:, None, None], -1, 0)
    zero = np.zeros_like(x)
    rates = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), (0, 1), (-2, -1))
    stages = _stages(rates, rates, collocation.MATRIX).reshape(len(h), -1, 3, 3)
    turned = np.eye(3) + np.einsum("j,njrc->nrc", collocation.MATRIX[-1], stages)
    q = np.roll(Rotation.from_matrix(turned).as_quat(), 1, axis=-1)
    return np.asarray(q * np.where(q[:, :1] < 0, -1.0, 1.0))  # the sign: a step rotates by less than half a turn


def _stages(rates: FloatArray, right: FloatArray, matrix: FloatArray) -> FloatArray:
    """Stage derivatives X_i = h A_i (1 + Σ_j a_ij X_j) of collocation, from h A of shape (n, nodes, k, k).

    ``right`` holds h A times the initial columns, shape (n, nodes, k, columns); the result has shape (n, nodes·k,
    columns).
    """
    n, s, k = rates.shape[:3]
    system = np.eye(s * k) - np.einsum("nirc,ij->nirjc", rates, matrix).reshape(n, s * k, s * k)
    return np.asarray(np.linalg.solve(system, right.reshape(n, s * k, -1)))


_POINTS, _SIZES = np.polynomial.legendre.leggauss(8)
_GAUSS, _WEIGHTS = np.asarray(0.5 + _POINTS / 2), np.asarray(_SIZES / 2)
_POWERS = np.arange(1, 9)
_MOMENTS = _GAUSS[:, None] ** _POWERS / _POWERS
_GAUSS_MATRIX = np.asarray(np.linalg.solve(np.vander(_GAUSS, increasing=True).T, _MOMENTS.T).T, dtype=np.float64)

QUATERNIONS: Quadrature = (_GAUSS, _quaternions)
MATRICES: Quadrature = (collocation.nodes(1.0), _matrices)
