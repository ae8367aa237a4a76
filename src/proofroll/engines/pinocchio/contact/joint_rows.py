"""Dry friction and stops of joints as Pinocchio's own constraints of one row each, for its contact solver."""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.elements.mechanism.dynamics.named_forces import joint_force_shares
from proofroll.elements.mechanism.dynamics.switches import SwitchedJoint, switched_joints
from proofroll.elements.mechanism.scene.joint import AT_STOP
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree


class JointRow(NamedTuple):
    """One constraint of a joint.

    Attributes:
        joint: the constrained joint.
        model: pin.ConstraintModel.
        sign: factor on the coordinate's velocity in the row; at a stop the row is positive away from it.
        limit: coordinate of the stop; None: friction.
    """

    joint: SwitchedJoint
    model: Any
    sign: float
    limit: float | None

    def gap(self, q: Array) -> float:
        """Distance from the stop, rad or m."""
        return self.sign * float(q[self.joint.coordinate] - (self.limit or 0.0))

    def closed(self, q: Array) -> bool:
        """True if the joint is at the stop."""
        return self.gap(q) <= AT_STOP * (self.joint.high - self.joint.low)


class JointRows:
    """Rows of all joints: friction first, then stops.

    Attributes:
        friction, stops: the rows of each sort.
        J: Jacobian of all rows for joint velocities, (rows, nv).
    """

    def __init__(self, tree: JointTree) -> None:
        self.switched = switched_joints(tree.mechanism)
        self._count = len(tree.mechanism.joints)
        self.friction = [self._friction(tree, joint) for joint in self.switched if joint.friction]
        self.stops = [
            self._stop(tree, joint, limit, sign)
            for joint in self.switched
            for limit, sign in ((joint.low, 1.0), (joint.high, -1.0))
            if np.isfinite(limit)
        ]
        self.J = np.zeros((len(self.friction) + len(self.stops), tree.model.nv))
        for row, item in zip(self.J, (*self.friction, *self.stops), strict=True):
            row[item.joint.velocity] = item.sign

    @staticmethod
    def _friction(tree: JointTree, joint: SwitchedJoint) -> JointRow:
        bound = np.full(tree.model.nv, joint.friction)  # for all coordinates; only those of the joints count
        model = pin.JointFrictionConstraintModel(tree.model, [tree.joint[joint.number]], -bound, bound)
        return JointRow(joint, pin.ConstraintModel(model), 1.0, None)

    @staticmethod
    def _stop(tree: JointTree, joint: SwitchedJoint, limit: float, sign: float) -> JointRow:
        low, high = np.full(tree.model.nq, -np.inf), np.full(tree.model.nq, np.inf)
        (low if sign > 0 else high)[joint.coordinate] = limit
        model = pin.JointLimitConstraintModel(tree.model, [tree.joint[joint.number]], low, high)
        model.makeSelectionMaximal()
        return JointRow(joint, pin.ConstraintModel(model), sign, limit)

    def along_joints(self, q: Array, force: Array) -> dict[str, Array]:
        """Forces of friction and stops along the coordinates of all joints, from those of the rows [N, N m].

        The force of a stop with an open gap is omitted: in a step that closes the gap it is an impulse.
        """
        forces = {"friction": np.full(self._count, np.nan), "stop": np.full(self._count, np.nan)}
        total = {joint.number: 0.0 for joint in self.switched}
        closed_joints = {item.joint.number for item in self.stops if item.closed(q)}
        for item, size in zip((*self.friction, *self.stops), force, strict=True):
            if item.limit is None or item.joint.number in closed_joints:
                total[item.joint.number] += item.sign * float(size)
        for joint in self.switched:
            on = joint_force_shares(joint.number in closed_joints, joint.friction, total[joint.number])
            forces["friction"][joint.number], forces["stop"][joint.number] = on
        return forces
