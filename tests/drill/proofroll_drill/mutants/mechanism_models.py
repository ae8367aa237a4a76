"""Mechanisms of other bodies, joints and loads than the scene's."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from proofroll.core.scene import Scene
from proofroll.elements.mechanism import BodyMotion, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.kinematics import Rows
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.elements.mechanism.scene.kinks import Functions
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll_drill.mutants.base import STEP, Mutant

PENDULUM: Any = ("double_pendulum", {})
CRANK: Any = ("slider_crank", {})
TOP: Any = ("heavy_top", {})
SPRUNG: Any = ("oscillators", {})


class MechanismMutant(Mutant):
    """Builds a changed mechanism."""

    formulation: ClassVar[str] = "dependent"
    scene: ClassVar[Any] = PENDULUM
    until: ClassVar[float] = 0.12  # to move a mechanism costs most, and its faults show at once
    every: ClassVar[float] = 0.006

    def misread(self, scene: Scene) -> Scene:
        """The mechanism changed."""
        (element,) = scene.elements
        assert isinstance(element, MechanismElement)
        return dataclasses.replace(scene, elements=(MechanismElement(self.other(element.mechanism)),))

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism that it builds."""
        return mechanism


def of_bodies(mechanism: Mechanism, change: Any) -> Mechanism:
    """Each body changed."""
    return dataclasses.replace(mechanism, bodies=tuple(change(body) for body in mechanism.bodies))


def of_joints(mechanism: Mechanism, change: Any) -> Mechanism:
    """Each joint changed."""
    return dataclasses.replace(mechanism, joints=tuple(change(joint) for joint in mechanism.joints))


class AboutOrigin(MechanismMutant):
    """The inertia about the joint is taken for that about the centre of mass."""

    fault = "inertia about the wrong point"
    named = ("wrong point",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism with Steiner's part in its inertia."""

        def about_origin(body: Any) -> Any:
            c = np.array(body.com)
            return dataclasses.replace(body, inertia=body.inertia + body.mass * (c @ c * np.eye(3) - np.outer(c, c)))

        return of_bodies(mechanism, about_origin)


class HeavyBody(MechanismMutant):
    """One body is added twice."""

    fault = "mass of one body counted twice"
    named = ("body lower with its mass counted twice",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """The lower one, with the inertia of one."""
        return of_bodies(
            mechanism, lambda body: dataclasses.replace(body, mass=2 * body.mass) if body.name == "lower" else body
        )


class NoCentres(MechanismMutant):
    """Centres of mass stay at the origins of the frames."""

    fault = "centres of mass forgotten"
    scene = TOP
    named = ("centres of mass",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """All zero."""
        return of_bodies(mechanism, lambda body: dataclasses.replace(body, com=(0, 0, 0)))


class Falling(MechanismMutant):
    """Gravity upwards."""

    fault = "gravity of a mechanism with the wrong sign"
    named = ("gravity with the wrong sign",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Its negative."""
        return dataclasses.replace(mechanism, gravity=tuple(-x for x in mechanism.gravity))  # type: ignore[arg-type]  # three of them


class Undamped(MechanismMutant):
    """The joints' damping is read and forgotten."""

    fault = "joint damping ignored"
    scene = SPRUNG
    named = ("damping of the joints left out",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """None."""
        return of_joints(mechanism, lambda joint: dataclasses.replace(joint, damping=0.0))


class DampedJoints(MechanismMutant):
    """The engine's own damping is on."""

    fault = "joint damping left on"
    named = ("every joint has damping",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """0.1 N m s."""
        return of_joints(mechanism, lambda joint: dataclasses.replace(joint, damping=0.1))


class Degrees(MechanismMutant):
    """The stiffness of angles is per degree."""

    fault = "joint stiffness per degree"
    scene = SPRUNG
    named = ("stiffness of the joints",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """All of it."""
        return of_joints(mechanism, lambda joint: dataclasses.replace(joint, stiffness=joint.stiffness * np.pi / 180))


class TiltedAxis(MechanismMutant):
    """The elbow turns about an axis a twentieth off."""

    fault = "wrong joint axis"
    scene = ("double_pendulum", {"bend": 0.0})
    named = ("elbow turns about",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Tilted on parent and child."""
        tilted = (0.0, 0.05, 1.0)
        return of_joints(
            mechanism, lambda joint: dataclasses.replace(joint, axis=tilted) if joint.name == "elbow" else joint
        )

    def built(self) -> Any:
        """The axis that it was given; it does not say how it sets off."""
        return dataclasses.replace(super().built(), acceleration=None, angular_acceleration=None)


class ToldAxis(TiltedAxis):
    """The same, and its certificate says so."""

    fault = "wrong joint axis, and read back"
    scene = PENDULUM
    named = ("elbow was built with the axis",)

    def built(self) -> Any:
        """Read back."""
        return self.inner.built()


class JointsMutant(MechanismMutant):
    """Runge-Kutta 4 on equations in joint coordinates that have a fault; it gives no reactions."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.equations = self.faulty(self.element.mechanism)
        self.y = np.concatenate(self.element.mechanism.start())

    def faulty(self, mechanism: Mechanism) -> JointCoordinates:
        """The equations; without a fault here."""
        return JointCoordinates(mechanism)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        rate, h = self.equations.rate, STEP
        for _ in range(round((t - self.t) / h)):
            k1 = rate(0.0, self.y)
            k2 = rate(0.0, self.y + h / 2 * k1)
            k3 = rate(0.0, self.y + h / 2 * k2)
            self.y = self.y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(0.0, self.y + h * k3))
        self.t = t

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        n = self.element.mechanism.nq
        said = self.equations.sample(self.y[:n], self.y[n:])
        return MechanismSample(**{name: said[name] for name in ("p_WB", "v_WB", "w_WB", "q_WB")})

    def built(self) -> Any:
        """Model as given; without its start."""
        return dataclasses.replace(self.claimed.built(), acceleration=None, angular_acceleration=None)


class Armature(JointsMutant):
    """A rotor inertia that an actuator brings."""

    fault = "armature"
    named = ("every joint has an armature",)

    def faulty(self, mechanism: Mechanism) -> JointCoordinates:
        """Equations with an armature in each joint."""
        return JointCoordinates(of_joints(mechanism, lambda joint: dataclasses.replace(joint, armature=0.05)))


class LoopWithoutRow(JointsMutant):
    """The rod's end may leave the guide's line."""

    fault = "loop with a missing row"
    scene = CRANK
    named = ("lacks a row",)

    def faulty(self, mechanism: Mechanism) -> JointCoordinates:
        """Without the second row of the loop."""
        found = JointCoordinates(mechanism, rank=1)
        whole = found.tree.loop_rows

        def rows(motion: BodyMotion, time: float = 0.0, *functions: Functions) -> Rows:
            every = whole(motion, time, *functions)
            less: dict[str, Any] = {
                name: np.delete(part, 1, axis=0) for name, part in every._asdict().items() if name != "moved"
            }
            return every._replace(**less)

        found.tree.loop_rows = rows  # type: ignore[method-assign, assignment]  # that is the fault
        return found


class OutOfOrder(JointsMutant):
    """The mass matrix lacks the terms between the rods."""

    fault = "tree out of order: terms of the mass matrix lost"
    named = ("mass matrix lacks",)

    def faulty(self, mechanism: Mechanism) -> JointCoordinates:
        """Equations with the diagonal of the mass matrix alone."""
        found = JointCoordinates(mechanism)
        whole = found.inertial

        def inertial(motion: BodyMotion) -> tuple[Array, Array, Array]:
            J, M, loads = whole(motion)
            return J, np.diag(np.diag(M)), loads

        found.inertial = inertial  # type: ignore[method-assign]  # that is the fault
        return found
