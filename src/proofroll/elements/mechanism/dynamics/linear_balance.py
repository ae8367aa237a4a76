"""Forces along the velocities of a tree that one more of each number of its bodies needs, (..., bodies, nv, 10).

Numbers of a body are its mass, first moment [kg m], and inertia about its origin (xx, yy, zz, xy, xz, yz) [kg m²]. The
motion is given by rotations R (..., bodies, 3, 3), derivatives J of (velocity, spin) by the velocities of the tree
(..., bodies, 6, nv), and vectors along the world's axes, (..., bodies, 3).
"""

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array, skews

_HAS = np.array([[1, 0, 0, 1, 1, 0], [0, 1, 0, 1, 0, 1], [0, 0, 1, 0, 1, 1]])  # moments that a component multiplies


def moved(R: Array, J: Array, linear: Array, angular: Array) -> Array:
    """Forces by accelerations of the origins and of the turning, without spin; for velocities they are momenta."""
    a, alpha = (_along_body(R, vector) for vector in (linear, angular))
    wrench = np.zeros((*a.shape[:-1], 6, 10))
    wrench[..., :3, 0], wrench[..., 3:, 1:4] = a, -skews(a)
    wrench[..., :3, 1:4], wrench[..., 3:, 4:] = skews(alpha), _inertial(alpha)
    return _along(R, J, wrench)


def spun(R: Array, J: Array, w: Array) -> Array:
    """Forces by the spin: centripetal and gyroscopic ones."""
    w = _along_body(R, w)
    wrench, across = np.zeros((*w.shape[:-1], 6, 10)), skews(w)
    wrench[..., :3, 1:4], wrench[..., 3:, 4:] = across @ across, across @ _inertial(w)
    return _along(R, J, wrench)


def _along_body(R: Array, vector: Array) -> Array:
    return np.asarray((np.swapaxes(R, -1, -2) @ vector[..., None])[..., 0])


def _along(R: Array, J: Array, wrench: Array) -> Array:
    """Forces along the velocities for wrenches at the origins, along the bodies' own axes."""
    turned = np.swapaxes(J, -1, -2)
    return np.asarray(turned[..., :3] @ R @ wrench[..., :3, :] + turned[..., 3:] @ R @ wrench[..., 3:, :])


def _inertial(a: Array) -> Array:
    """Matrices that turn an inertia (xx, yy, zz, xy, xz, yz) into its products with vectors (..., 3), (..., 3, 6)."""
    return np.asarray(a[..., [[0, 0, 0, 1, 2, 0], [0, 1, 0, 0, 0, 2], [0, 0, 2, 0, 0, 1]]] * _HAS)


def steiner(mass: Array, com: Array) -> Array:
    """Inertia of points of some masses, (bodies), about the origins, (bodies, 3, 3)."""
    squares = np.einsum("ni,ni->n", com, com)[:, None, None] * np.eye(3)
    return np.asarray(mass[:, None, None] * (squares - com[:, :, None] * com[:, None, :]))


def forces(columns: Array, mass: Array, com: Array, inertia: Array | float = 0.0) -> Array:
    """Forces along the velocities, (..., nv), for bodies of some masses, centres of mass and inertias about these."""
    return np.asarray(np.einsum("...bvk,bk->...v", columns, numbers_of(mass, com, inertia)))


def numbers_of(mass: Array, com: Array, inertia: Array | float = 0.0) -> Array:
    """Numbers of bodies of some masses, centres of mass and inertias about these, (bodies, 10)."""
    six = (inertia + steiner(mass, com))[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return np.concatenate([mass[:, None], mass[:, None] * com, six], axis=1)
