"""Mechanisms whose moments, weights, springs or starts an author has put in the wrong place."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from proofroll.elements.mechanism import BodyMotion, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll_drill.mutants.mechanism_models import (
    CRANK,
    PENDULUM,
    JointsMutant,
    MechanismMutant,
    of_bodies,
    of_joints,
)


class OrderOfMoments(MechanismMutant):
    """The moments of inertia about y and z change places."""

    fault = "moments of inertia in another order"
    scene: ClassVar[Any] = ("free_body", {})
    named = ("moments of inertia",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism with permuted moments of every body."""
        order = [0, 2, 1]
        return of_bodies(
            mechanism, lambda body: dataclasses.replace(body, inertia=np.array(body.inertia)[np.ix_(order, order)])
        )


class WeightAtOrigin(JointsMutant):
    """Each body's weight acts at the origin of its frame; its inertia is right."""

    fault = "weight at the origin of the body's frame"
    scene = PENDULUM
    named = ("weight",)

    def faulty(self, mechanism: Mechanism) -> JointCoordinates:
        """Weights moved by force."""
        found = JointCoordinates(mechanism)
        whole, g = found.inertial, np.array(mechanism.gravity)

        def inertial(motion: BodyMotion) -> tuple[Array, Array, Array]:
            J, M, loads = whole(motion)
            n = len(mechanism.bodies)
            arms = np.einsum("nij,nj->ni", motion.R_WB[:n], [body.com for body in mechanism.bodies])
            moments = np.cross(arms, [body.mass * g for body in mechanism.bodies])
            moved = loads.copy()
            moved[:n, 3:] += moments
            return J, M, moved

        found.inertial = inertial  # type: ignore[method-assign]  # that is the fault
        return found


class SpringUndamped(MechanismMutant):
    """A spring's stiffness is taken, its damping is not."""

    fault = "damping of a spring ignored"
    scene: ClassVar[Any] = ("gyroscope_cart", {})
    until, every = 0.3, 0.01  # what the damping does grows slowly
    named = ("damping of the springs left out",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """None."""
        springs = tuple(dataclasses.replace(spring, damping=0.0) for spring in mechanism.springs)
        return dataclasses.replace(mechanism, springs=springs)


class Backwards(MechanismMutant):
    """The crank sets off the other way."""

    fault = "initial velocities with the wrong sign"
    scene = CRANK
    named = ("wrong sign",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism with every joint's velocity reversed."""
        return of_joints(mechanism, lambda joint: dataclasses.replace(joint, v0=tuple(-x for x in joint.v0)))
