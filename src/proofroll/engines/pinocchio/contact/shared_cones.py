"""Contacts whose cones sliding and turning share: rows of turning beside those of Pinocchio's point contacts."""

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree

BY_BLOCKS = "Pinocchio's solvers have no cone shared by sliding and turning; proofroll solves its matrices by blocks"


class SharedCones:
    """Cones of all contacts of a mechanism; false if turning shares none.

    Attributes:
        turns: number of rows of turning of each contact: of spin about the normal, then of rolling about two axes.
    """

    def __init__(self, tree: JointTree, settings: PinocchioSettings) -> None:
        """Raises Refused for settings that ask for a solver of Pinocchio's or for the convex problem."""
        self._tree, self._contacts = tree, tree.mechanism.contacts
        self._arms = [np.array(contact.shared_arms) for contact in self._contacts]
        self.turns = [len(arms) for arms in self._arms]
        if self and (settings.solver != "admm" or settings.convex):
            raise Refused(f"{BY_BLOCKS}, in place of solver=admm with convex=false: set both")

    def __bool__(self) -> bool:
        return any(self.turns)

    @property
    def rolling(self) -> list[float]:
        """Coefficient of rolling in the cone of each contact [m]."""
        pairs = zip(self._contacts, self._arms, strict=True)
        return [contact.friction * float(arms[-1]) if len(arms) > 1 else 0.0 for contact, arms in pairs]

    def rows(self, data: pin.Data, k: int, frame: Array) -> Array:
        """Derivatives by joint velocities of a contact's turning times its arms, (turns, nv), from ``data``.

        ``frame``: of its normal.
        """
        contact, model, turning = self._contacts[k], self._tree.model, np.zeros((3, self._tree.model.nv))
        for body, sign in ((contact.body_a, 1.0), (contact.body_b, -1.0)):
            number = self._tree.mechanism.body_index[body]
            if self.turns[k] and number >= 0:
                of_body = pin.getFrameJacobian(model, data, self._tree.body[number], pin.LOCAL_WORLD_ALIGNED)
                turning += sign * of_body[3:]
        return np.asarray((self._axes(k, frame) * self._arms[k]).T @ turning)

    def moment(self, k: int, frame: Array, impulses: Array) -> Array:
        """Impulsive moment on body a of a contact by the impulses of its rows [N m s]."""
        return np.asarray(self._axes(k, frame) @ (self._arms[k] * impulses))

    def _axes(self, k: int, frame: Array) -> Array:
        """Axes of a contact's turning in columns: the normal, and those across it."""
        return np.roll(frame, 1, axis=1)[:, : self.turns[k]]

    def require_none(self, time: float) -> None:
        """Raises Diverged at a time [s] if another solver than blocks is asked for such a cone."""
        if self:
            raise Diverged(f"sweeps over blocks do not settle at t = {time:.6g} s; a larger solver_tolerance may do")
