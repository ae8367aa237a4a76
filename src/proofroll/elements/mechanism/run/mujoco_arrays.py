"""MuJoCo's arrays of bodies as a sample and a built model of a mechanism, for engines that start from its model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array, from_quaternion


@dataclass(frozen=True)
class MujocoArrays:
    """Rows of a mechanism's bodies in arrays of MuJoCo's layout.

    Attributes:
        bodies: row of each body, (bodies,).
        roots: row of the body at the root of its tree, (bodies,).
    """

    bodies: Array
    roots: Array

    @classmethod
    def of(cls, mechanism: Mechanism, model: Any) -> MujocoArrays:
        """Rows in the ``MjModel`` of a mechanism, compiled from its ``mjspec``."""
        rows = np.array([model.body(body.name).id for body in mechanism.bodies])
        return cls(bodies=rows, roots=model.body_rootid[rows])

    def sample(self, read: Callable[[str], Any]) -> MechanismSample:
        """State of the bodies.

        Args:
            read: array of MjData by its name: ``xpos``, ``xquat``, ``cvel`` and ``subtree_com``, of one state or, with
                the copies in front, of a batch.
        """
        names = ("xpos", "xquat", "cvel", "subtree_com")
        origins, turned, twists, centres = (np.array(read(name), float) for name in names)
        p_WB, q_WB, twist = (values[..., self.bodies, :] for values in (origins, turned, twists))
        w_WB = twist[..., :3]
        v_WB = twist[..., 3:] + cross(w_WB, p_WB - centres[..., self.roots, :])
        return MechanismSample(p_WB, v_WB, w_WB, q_WB / np.linalg.norm(q_WB, axis=-1, keepdims=True))

    def built(self, read: Callable[[str], Any], gravity: Any) -> MechanismBuilt:
        """Masses, centres of mass, inertias and gravity [m/s²].

        Args:
            read: array of MjModel by its name: ``body_mass``, ``body_ipos``, ``body_iquat`` and ``body_inertia``.
            gravity: of the model's options.
        """
        names = ("body_mass", "body_ipos", "body_iquat", "body_inertia")
        mass, com, turned, moments = (np.array(read(name), float)[self.bodies] for name in names)
        R = np.array([from_quaternion(one) for one in turned])
        inertia = np.einsum("nij,nj,nkj->nik", R, moments, R)
        return MechanismBuilt(mass=mass, com=com, inertia=inertia, gravity=np.array(gravity, float))
