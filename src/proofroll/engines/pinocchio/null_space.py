"""Formulation ``null_space``: Pinocchio's terms of the joint tree, loops by projection on their rows' null space."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.elements.mechanism.rotations import Array
from proofroll.engines.pinocchio.joint_tree import JointTree
from proofroll.engines.pinocchio.loop_rows import LoopRows, RowsAtState


class NullSpace:
    """Accelerations and reactions of a tree with loops."""

    def __init__(self, tree: JointTree, rows: LoopRows) -> None:
        self._tree, self._model, self._rows = tree, tree.model, rows
        self._rest = np.zeros(tree.model.nv)

    def acceleration(self, data: Any, q: Array, v: Array) -> Array:
        """Of the joints, shape (nv,), which the next call may overwrite."""
        tree, model = self._tree, self._model
        tau = tree.drives(q, v)
        if not tree.loops:
            if not tree.springs:
                found: Array = pin.aba(model, data, q, v, tau)
                return found
            pin.forwardKinematics(model, data, q, v)
            pin.updateFramePlacements(model, data)
            return np.array(pin.aba(model, data, q, v, tau, tree.pulls(data)))
        return self._solved(data, q, v, tau)[0]

    def _solved(self, data: Any, q: Array, v: Array, tau: Array) -> tuple[Array, RowsAtState, Array]:
        """Acceleration, rows and multipliers, the smallest in norm where rows depend on each other."""
        tree, model = self._tree, self._model
        rows = self._rows.at(data, q, v)
        pulls = tree.pulls(data) if tree.springs else None
        M = pin.crba(model, data, q).copy()
        bias = pin.rnea(model, data, q, v, self._rest, pulls) if pulls else pin.rnea(model, data, q, v, self._rest)
        split = self._rows.split(M, rows.C)
        free = split.into @ (split.into.T @ (tau - bias))
        normal = -split.back @ (rows.drift + rows.C @ free)
        return free + split.locked @ normal, rows, split.back.T @ normal

    def reactions(self, data: Any, q: Array, v: Array) -> tuple[Array, Any, Array]:
        """Acceleration; forces on Pinocchio's joints of springs and loops; force and moment on body_b of each loop."""
        tree = self._tree
        on_loops = np.zeros((2, len(tree.loops), 3))
        if not tree.loops:
            acceleration = self.acceleration(data, q, v).copy()
            pin.forwardKinematics(self._model, data, q, v)
            pin.updateFramePlacements(self._model, data)
            return acceleration, tree.pulls(data), on_loops
        acceleration, rows, multipliers = self._solved(data, q, v, tree.drives(q, v))
        forces = tree.pulls(data)
        np.add.at(on_loops[0], rows.loop, multipliers[:, None] * rows.force)
        np.add.at(on_loops[1], rows.loop, multipliers[:, None] * rows.torque)
        for (a, b), force, torque in zip(tree.loops, *on_loops, strict=True):
            place = data.oMf[b].translation
            tree.put(forces, data, b, place, force, torque)
            tree.put(forces, data, a, place, -force, -torque)
        return acceleration, forces, on_loops

    def constraint_rows(self, data: Any, q: Array, v: Array) -> Array:
        """Rows of the loops on the velocities of the joints."""
        return self._rows.at(data, q, v).C if self._tree.loops else np.zeros((0, self._model.nv))
