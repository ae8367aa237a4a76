"""Mechanisms whose joints have other laws than the scene's: friction, stops, armature, actuators, couplings."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, ClassVar

from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.engines.pinocchio import Pinocchio
from proofroll_drill.mutants.mechanism_models import MechanismMutant, of_joints

SERVO: Any = ("servo", {})
ARM: Any = ("arm_pd", {})
CLAMPED: Any = ("saturated_servo", {})


class OfJoint(MechanismMutant):
    """Base of mutants of one number of joints.

    Attributes:
        key, factor: field of the joints, and the factor on it.
    """

    scene: ClassVar[Any] = ("pendulum_friction", {})
    until: ClassVar[float] = 0.4
    every: ClassVar[float] = 0.02
    key: ClassVar[str] = "friction"
    factor: ClassVar[float] = 1.0

    def other(self, mechanism: Mechanism) -> Mechanism:
        """The field of each joint times the factor."""
        return of_joints(mechanism, lambda j: dataclasses.replace(j, **{self.key: self.factor * getattr(j, self.key)}))


class RoughJoint(OfJoint):
    """A tenth too much."""

    fault = "dry friction 1.1 times"
    named = ("dry friction of the joints 1.1 times",)
    factor = 1.1


class RoughAgain(RoughJoint):
    """A tenth too much over half swings that each end at a switch, fifteen samples apart."""

    fault = "dry friction 1.1 times, over many turns"
    scene: ClassVar[Any] = ("spring_friction", {})
    until = 1.0


class RoughElbow(OfJoint):
    """A tenth too much in one of two joints."""

    fault = "dry friction of one joint 1.1 times"
    scene: ClassVar[Any] = (str(Path(__file__).parent / "rough_arm"), {})
    until = 0.3
    every = 0.01
    named = ("dry friction of the joint elbow 1.1 times",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """The elbow alone."""
        return of_joints(
            mechanism, lambda j: dataclasses.replace(j, friction=(1.1 if j.name == "elbow" else 1.0) * j.friction)
        )


class PushingJoint(OfJoint):
    """Friction along the motion, as a drive of the same size: the pendulum swings one way in this time."""

    fault = "dry friction with the wrong sign"
    named = ("dry friction of the joints with the wrong sign",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """A drive down, where it falls."""
        return of_joints(mechanism, lambda j: dataclasses.replace(j, friction=0.0, torque=-j.friction))


class MovedStop(MechanismMutant):
    """The stop lies farther below than two steps reach: nearer ones are where a step may end.

    Attributes:
        by: shift [m].
    """

    fault = "stop at another place"
    scene: ClassVar[Any] = ("stop", {})
    until: ClassVar[float] = 0.6
    every: ClassVar[float] = 0.02
    named = ("rests at",)
    by: ClassVar[float] = 0.03

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Both limits lower."""
        moved = [None if j.limits is None else (j.limits[0] - self.by, j.limits[1] - self.by) for j in mechanism.joints]
        joints = zip(mechanism.joints, moved, strict=True)
        return dataclasses.replace(mechanism, joints=tuple(dataclasses.replace(j, limits=at) for j, at in joints))


class MovedStopWithRebounds(MovedStop):
    """Rebounds from there with half of its speed, without coming to rest in this time."""

    fault = "stop at another place, with rebounds"
    scene: ClassVar[Any] = ("stop", {"restitution": 0.5})
    until = 1.0
    named = ("turns back at -0.03,",)


class MovedStopWithOneRebound(MovedStopWithRebounds):
    """Rebounds from there once."""

    fault = "stop at another place, with one rebound"
    until = 0.8


class Driven(MechanismMutant):
    """Base of mutants with actuators and couplings, which are built in Pinocchio.

    Attributes:
        change: fields of each actuator, from the actuator.
    """

    formulation: ClassVar[str] = "null_space"
    provides = Pinocchio.provides
    settings = Pinocchio.settings
    presets = Pinocchio.presets
    scene: ClassVar[Any] = SERVO
    until: ClassVar[float] = 0.4
    every: ClassVar[float] = 0.01

    def __init__(self, scene: Scene, settings: Any) -> None:
        self.element = scene.elements[0]
        self.claimed: Any = Pinocchio.build(scene, settings)
        self.inner = Pinocchio.build(self.misread(scene), settings)
        self.t = 0.0

    def actuator(self, actuator: Any) -> Any:
        """An actuator as it is built."""
        return actuator

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Each actuator changed."""
        return dataclasses.replace(mechanism, actuators=tuple(map(self.actuator, mechanism.actuators)))

    events = None  # type: ignore[assignment]  # this formulation locates none


class SwappedGains(Driven):
    """The arguments of a servo in the wrong order."""

    fault = "kp and kd swapped"
    scene = ARM
    named = ("kp and kd swapped",)

    def actuator(self, actuator: Any) -> Any:
        """Servo with its gains exchanged."""
        return dataclasses.replace(actuator, kp=actuator.kd, kd=actuator.kp)


class Undamped(Driven):
    """The default of an engine that has none."""

    fault = "kd left out"
    named = ("kd of the actuators left out",)

    def actuator(self, actuator: Any) -> Any:
        """Without its damping."""
        return dataclasses.replace(actuator, kd=0.0)


class NoClamp(Driven):
    """The limit is read and forgotten."""

    fault = "limit of an effort ignored"
    scene = CLAMPED
    named = ("no limit on the efforts",)

    def actuator(self, actuator: Any) -> Any:
        """Without its limit."""
        return dataclasses.replace(actuator, limit=None)


class TightClamp(Driven):
    """An actuator that is half as strong."""

    fault = "limit of an effort halved"
    scene = CLAMPED
    named = ("the limits of the actuators halved",)

    def actuator(self, actuator: Any) -> Any:
        """Servo with half of its limit."""
        return dataclasses.replace(actuator, limit=0.5 * actuator.limit)


class NoArmature(Driven):
    """Motors without inertia."""

    fault = "armature left out"
    scene = ARM
    named = ("armature of the joints left out",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """None."""
        return of_joints(mechanism, lambda joint: dataclasses.replace(joint, armature=0.0))


class InverseGear(Driven):
    """The ratio of joint_a's rate to joint_b's."""

    fault = "ratio of a gear the other way round"
    scene: ClassVar[Any] = ("gear_pair", {})
    named = ("the coupling gear has the ratio -2",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """One over each ratio."""
        turned = tuple(dataclasses.replace(item, ratio=1 / item.ratio) for item in mechanism.couplings)
        return dataclasses.replace(mechanism, couplings=turned)


class CoarseGear(Driven):
    """A ratio that is rounded."""

    fault = "ratio of a gear 1 % off"
    scene: ClassVar[Any] = ("arm_rotor", {})
    named = ("the coupling gear has the ratio 50.5",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """A hundredth more."""
        turned = tuple(dataclasses.replace(item, ratio=1.01 * item.ratio) for item in mechanism.couplings)
        return dataclasses.replace(mechanism, couplings=turned)
