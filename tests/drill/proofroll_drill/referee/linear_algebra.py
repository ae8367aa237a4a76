"""Rotations and small linear systems in long doubles, for which numpy has no solver."""

from __future__ import annotations

from typing import Any

import numpy as np

from .extrapolation import Long

_DEPENDENT = 1e-12  # of a squared row: what others leave of a dependent one is round-off, 1e-30
_ONE = np.eye(3, dtype=np.longdouble)
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


def long(values: Any) -> Long:
    """The values as an array of long doubles."""
    return np.asarray(values, dtype=np.longdouble)


def cross(one: Long, other: Long) -> Long:
    """Cross products along the last axis; numpy's own takes ten times as long for a few vectors."""
    return one[..., _NEXT] * other[..., _LAST] - one[..., _LAST] * other[..., _NEXT]


def turn(axis: Any, angle: Any) -> Long:
    """Rotation about a unit vector (Rodrigues)."""
    K = long([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return _ONE + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


def of_quaternion(p: Long) -> Long:
    """Rotations of unit quaternions wxyz, (..., 3, 3)."""
    w, u = p[..., :1, None], p[..., 1:]
    twice = np.einsum("...i,...j->...ij", u, u)
    skewed = cross(u[..., None, :], _ONE)  # rows u × e
    return (2 * w**2 - 1) * _ONE + 2 * twice + 2 * w * np.swapaxes(skewed, -1, -2)


def of_rpy(rpy: Any) -> Long:
    """Rotation of roll, pitch, yaw about fixed axes."""
    r, p, y = long(rpy)
    return turn((0, 0, 1), y) @ turn((0, 1, 0), p) @ turn((1, 0, 0), r)


def inverse(matrix: Long) -> Long:
    """Inverse of a 3×3 matrix by cross products."""
    a, b, c = matrix
    adjoint = np.array([cross(b, c), cross(c, a), cross(a, b)])
    return adjoint.T / (a @ adjoint[0])


def quaternion(R: Long) -> Long:
    """Unit quaternion wxyz of a rotation, from its largest component."""
    squares = np.array([1 + np.trace(R), *(1 - np.trace(R) + 2 * np.diag(R))])
    k = int(np.argmax(squares))
    skewed = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    if k == 0:
        found = np.array([squares[0], *skewed])
    else:
        found = np.array([skewed[k - 1], *(R[k - 1] + R[:, k - 1])])
        found[k] = squares[k]
    return found / np.sqrt(found @ found)


def semidefinite_solve(A: Long, right: Long) -> Long:
    """A solution of A x = right by Cholesky factors with pivots; zero in what depends on the rest."""
    A, b, order = A.copy(), right.copy(), []
    size = np.diag(A).copy()
    size[size == 0] = 1
    left = np.ones(len(b), bool)
    factors = []
    for _ in range(len(b)):
        ratio = np.where(left, np.diag(A) / size, -1)
        pivot = int(np.argmax(ratio))
        if ratio[pivot] < _DEPENDENT:
            break
        left[pivot] = False
        column = np.where(left, A[:, pivot], 0) / A[pivot, pivot]
        b = b - column * b[pivot]
        factors.append((pivot, column, A[pivot, pivot]))
        A = A - np.outer(column, A[pivot])
        order.append(pivot)
    x = np.zeros_like(b)
    for pivot, column, diagonal in reversed(factors):
        x[pivot] = b[pivot] / diagonal - column @ x
    return x


def eliminated_solve(A: Long, right: Long) -> Long:
    """A solution of A x = right by elimination with full pivots; zero in what depends on the rest."""
    A, b, left = A.copy(), right.copy(), []
    rows, columns = list(range(len(b))), list(range(len(b)))
    scale = np.sqrt(np.abs(np.diag(A)))
    scale[scale == 0] = 1
    A, b = A / np.outer(scale, scale), b / scale
    while rows:
        part = np.abs(A[np.ix_(rows, columns)])
        i, j = np.unravel_index(int(np.argmax(part)), part.shape)
        if part[i, j] < _DEPENDENT:
            break
        row, column = rows.pop(int(i)), columns.pop(int(j))
        factors = A[rows, column] / A[row, column]
        A[rows] -= np.outer(factors, A[row])
        b[rows] -= factors * b[row]
        left.append((row, column))
    x = np.zeros_like(b)
    known: list[int] = []
    for row, column in reversed(left):
        x[column] = (b[row] - A[row, known] @ x[known]) / A[row, column]
        known.append(column)
    return x / scale
