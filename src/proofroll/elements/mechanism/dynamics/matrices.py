"""Matrices of the equations of motion at the start: M v̇ + h + g = τ in the velocities of the tree."""

from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism.dynamics.held_signals import at_start
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array


class Matrices(NamedTuple):
    """Terms of M v̇ + h + g = τ, where τ is what joints, springs, drives, loads and constraints bring.

    Attributes:
        mass_matrix: M with the armature of joints, (nv, nv).
        velocity_forces: h, centrifugal, Coriolis and gyroscopic terms, (nv).
        gravity_forces: g, minus the weights along the velocities, (nv).
    """

    mass_matrix: Array
    velocity_forces: Array
    gravity_forces: Array


def matrices_of(mechanism: Mechanism) -> Matrices:
    """Matrices at the start of a mechanism, from its tree."""
    equations = JointCoordinates(at_start(mechanism), rank=0)
    q, v = mechanism.start()

    def loads(velocities: Array) -> tuple[Array, Array]:
        J, M, wrenches = equations.inertial(equations.tree.at(q, velocities))
        return M, wrenches.ravel() @ J.reshape(-1, mechanism.nv)

    (M, both), (_, resting) = loads(v), loads(np.zeros(mechanism.nv))
    return Matrices(M, both - resting, resting)


def velocity_names(mechanism: Mechanism) -> list[str]:
    """Name of each velocity: that of its joint, with a number where the joint has several."""
    return [
        joint.name if joint.nv == 1 else f"{joint.name}.{number}"
        for joint in mechanism.joints
        for number in range(joint.nv)
    ]
