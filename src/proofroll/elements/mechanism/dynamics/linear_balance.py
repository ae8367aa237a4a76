"""Forces along the velocities of a tree that one more of each number of bodies and joints needs.

Numbers of a body are its mass, first moment [kg m], and inertia about its origin (xx, yy, zz, xy, xz, yz) [kg m²].
"""

from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array, skews

_HAS = np.array([[1, 0, 0, 1, 1, 0], [0, 1, 0, 1, 0, 1], [0, 0, 1, 0, 1, 1]])  # moments that a component multiplies


class BodyColumns(NamedTuple):
    """Forces along the velocities that numbers of bodies need, (..., bodies, nv, 10), from the bodies' motion.

    Attributes:
        R_WB, w_WB: rotation and angular velocity of each body, (..., bodies, 3, 3), (..., bodies, 3).
        J: derivative of (v_WB, w_WB) by the velocities of the tree, (..., bodies, 6, nv).
    """

    R_WB: Array
    w_WB: Array
    J: Array

    def moved(self, linear: Array, angular: Array) -> Array:
        """Columns for accelerations (linear, angular) of the origins without spin, or for velocities: of momenta."""
        back = np.swapaxes(self.R_WB, -1, -2)
        a, alpha = ((back @ vector[..., None])[..., 0] for vector in (linear, angular))
        wrench = np.zeros((*a.shape[:-1], 6, 10))
        wrench[..., :3, 0], wrench[..., 3:, 1:4] = a, -skews(a)
        wrench[..., :3, 1:4], wrench[..., 3:, 4:] = skews(alpha), _inertial(alpha)
        return self._along(wrench)

    def spun(self) -> Array:
        """Columns for the turning of the bodies at constant angular velocities."""
        w = (np.swapaxes(self.R_WB, -1, -2) @ self.w_WB[..., None])[..., 0]
        wrench, across = np.zeros((*w.shape[:-1], 6, 10)), skews(w)
        wrench[..., :3, 1:4], wrench[..., 3:, 4:] = across @ across, across @ _inertial(w)
        return self._along(wrench)

    def _along(self, wrench: Array) -> Array:
        """Columns for wrenches at the origins in body axes, (..., bodies, 6, 10)."""
        turned = np.swapaxes(self.J, -1, -2)
        parts = (turned[..., k : k + 3] @ self.R_WB @ wrench[..., k : k + 3, :] for k in (0, 3))
        return np.asarray(sum(parts))


def _inertial(a: Array) -> Array:
    """Matrices that turn an inertia (xx, yy, zz, xy, xz, yz) into its products with vectors (..., 3), (..., 3, 6)."""
    return np.asarray(a[..., [[0, 0, 0, 1, 2, 0], [0, 1, 0, 0, 0, 2], [0, 0, 2, 0, 0, 1]]] * _HAS)


def steiner(mass: Array, com: Array) -> Array:
    """Inertia of points of some masses, (bodies), about the origins, (bodies, 3, 3)."""
    squares = np.einsum("ni,ni->n", com, com)[:, None, None] * np.eye(3)
    return np.asarray(mass[:, None, None] * (squares - com[:, :, None] * com[:, None, :]))


def body_numbers(mass: Array, com: Array, inertia: Array) -> Array:
    """Numbers of bodies of some masses, centres of mass and inertias about these, (bodies, 10)."""
    about = inertia + steiner(mass, com)
    six = about[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return np.concatenate([mass[:, None], mass[:, None] * com, six], axis=1)


def forces_of(columns: Array, numbers: Array) -> Array:
    """Forces along the velocities for numbers of all bodies, (..., nv)."""
    return np.asarray(np.einsum("...bvk,bk->...v", columns, numbers))


def joint_columns(q: Array, v: Array, rates: Array, signs: Array) -> dict[str, Array]:
    """Forces that act along single velocities for one more of each law of a joint, in the shape of all arguments.

    Args:
        q: coordinates from the rest of springs.
        v: velocities at which damping acts.
        rates: accelerations.
        signs: of the velocities, against which dry friction acts.
    """
    columns = {"torque": np.ones(v.shape), "friction": -signs, "damping": -v, "stiffness": -q, "armature": -rates}
    return {name: np.asarray(item) for name, item in columns.items()}
