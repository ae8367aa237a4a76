"""Rows of joints between separate bodies: independent ones, and motions that rows leave or force."""

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.maximal_coordinates import RANK


def independent(C: Array, bias: Array, most: int) -> tuple[Array, Array]:
    """Independent rows equivalent to all, at ``most`` so many; those of a planar body in its plane are round-off."""
    if not C.size:
        return C, bias
    U, values, Vt = np.linalg.svd(C, full_matrices=False)
    rank = min(most, int((values > RANK * values[0]).sum()))
    return Vt[:rank], (U[:, :rank].T @ bias) / values[:rank]


def least_motion(mass: Array, C: Array, K: Array, violation: Array) -> Array:
    """Motion of least kinetic energy that produces these violations of rows K, and none of rows C."""
    root = np.linalg.cholesky(mass)
    into = np.linalg.solve(root, np.concatenate([K, C]).T)
    aims = np.concatenate([violation, np.zeros(len(C))])
    return np.asarray(np.linalg.solve(root.T, np.linalg.lstsq(into.T, aims, rcond=RANK)[0]))


def accelerated_by(mass: Array, load: Array, C: Array, aims: Array) -> Array:
    """Solution x of M x − Cᵀλ = load, C x = aims, for independent rows C."""
    root = np.linalg.cholesky(mass)
    free = np.linalg.solve(root, load)
    if len(C):
        basis, R = np.linalg.qr(np.linalg.solve(root, C.T))
        free = free + basis @ (np.linalg.solve(R.T, aims) - basis.T @ free)
    return np.asarray(np.linalg.solve(root.T, free))
