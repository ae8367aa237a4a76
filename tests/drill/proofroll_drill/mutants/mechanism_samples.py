"""Mechanisms that move rightly and are reported wrongly."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll_drill.mutants.base import STEP, Mutant, OneStepBehind
from proofroll_drill.mutants.mechanism_models import CRANK, PENDULUM, TOP, MechanismMutant


class ToldMechanism(Mutant):
    """Samples that are made wrong."""

    formulation: ClassVar[str] = "dependent"
    scene: ClassVar[Any] = PENDULUM
    until: ClassVar[float] = MechanismMutant.until
    every: ClassVar[float] = MechanismMutant.every

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        mechanism = self.element.mechanism
        self.com = np.array([body.com for body in mechanism.bodies])
        self.ends = [(mechanism.body_index[each.b], np.array(each.position_b)) for each in mechanism.connections]

    def events(self) -> list[Any]:
        """None."""
        return []

    def of_children(self, sample: MechanismSample) -> Rotation:
        """Orientation of the child of each joint and loop."""
        turns = np.concatenate([_turns(sample).as_matrix(), np.eye(3)[None]])
        return Rotation.from_matrix(turns[[body for body, _ in self.ends]])


def _turns(sample: MechanismSample) -> Rotation:
    assert sample.q_WB is not None
    return Rotation.from_quat(sample.q_WB, scalar_first=True)


class BodyRates(ToldMechanism):
    """ω along each body's own axes."""

    fault = "body spin for world spin of a top"
    scene = TOP
    named = ("angular velocity in body axes",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Turned back, from the first step on."""
        return dataclasses.replace(sample, w_WB=_turns(sample).inv().apply(sample.w_WB)) if self.t else sample


class CentrePosition(ToldMechanism):
    """Positions of the centres of mass."""

    fault = "positions of the centres of mass"
    named = ("p_WB is the position of the centres of mass",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Shifted, from the first step on."""
        return dataclasses.replace(sample, p_WB=sample.p_WB + _turns(sample).apply(self.com)) if self.t else sample


class CentreVelocity(ToldMechanism):
    """Velocities of the centres of mass."""

    fault = "velocities of the centres of mass"
    named = ("v_WB is the velocity of the centres of mass",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Shifted, from the first step on."""
        arm = _turns(sample).apply(self.com)
        return dataclasses.replace(sample, v_WB=sample.v_WB + np.cross(sample.w_WB, arm)) if self.t else sample


class OnParent(ToldMechanism):
    """The wrench on the parent."""

    fault = "reaction on the wrong body"
    named = ("force has the wrong sign",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Minus."""
        assert sample.joint_force is not None
        assert sample.joint_torque is not None
        return dataclasses.replace(sample, joint_force=-sample.joint_force, joint_torque=-sample.joint_torque)


class BodyReaction(ToldMechanism):
    """The wrench along the child's axes."""

    fault = "reaction in body axes"
    named = ("joint in body axes",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Turned back."""
        assert sample.joint_force is not None
        return dataclasses.replace(sample, joint_force=self.of_children(sample).inv().apply(sample.joint_force))


class Swapped(ToldMechanism):
    """The joints' reactions in another order."""

    fault = "reactions in another order of joints"
    named = ("of another joint",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Reversed."""
        assert sample.joint_force is not None
        assert sample.joint_torque is not None
        return dataclasses.replace(sample, joint_force=sample.joint_force[::-1], joint_torque=sample.joint_torque[::-1])


class AboutCentre(ToldMechanism):
    """Moments about the centre of mass."""

    fault = "moment about the centre of mass"
    named = ("moment about the centre of mass",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Moment about the centre of mass of each child."""
        assert sample.joint_force is not None
        assert sample.joint_torque is not None
        coms = np.concatenate([self.com, np.zeros((1, 3))])
        arm = self.of_children(sample).apply(np.array([coms[body] - at for body, at in self.ends]))
        return dataclasses.replace(sample, joint_torque=sample.joint_torque - np.cross(arm, sample.joint_force))


class LoopReaction(BodyReaction):
    """Reactions of loops with the same fault; not every component is determined."""

    fault = "reactions of loops in body axes"
    scene = CRANK


class LoopSwapped(Swapped):
    """The same in loops."""

    fault = "reactions of loops in another order"
    scene = CRANK


class LoopAboutCentre(AboutCentre):
    """The same in loops."""

    fault = "moments of loops about the centres of mass"
    scene: ClassVar[Any] = ("andrews_squeezer", {})
    until, every, step = 0.012, 0.001, 5e-5  # it turns by 80 degrees in 2 ms


class Unnormalised(ToldMechanism):
    """The quaternion grows, and its matrix is taken as if it did not."""

    fault = "quaternion not normalised"
    scene = TOP
    named = ("q_WB has length",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Quaternions that grow by a twentieth per second."""
        assert sample.q_WB is not None
        return dataclasses.replace(sample, q_WB=sample.q_WB * (1 + 0.05 * self.t))


class MechanismScalarLast(ToldMechanism):
    """Another convention for quaternions."""

    fault = "quaternions of bodies with their scalar last"
    scene = CRANK
    named = ("scalar last",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """x, y, z, w, from the first step on."""
        assert sample.q_WB is not None
        return dataclasses.replace(sample, q_WB=np.roll(sample.q_WB, -1, axis=-1)) if self.t else sample


class LateReaction(OneStepBehind, ToldMechanism):
    """The reactions of the step before."""

    fault = "reactions of the step before"
    named = ("force is one step (0.002 s) late",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """The other's."""
        old = self.behind.sample()
        return dataclasses.replace(sample, joint_force=old.joint_force, joint_torque=old.joint_torque)


class LateMechanism(ToldMechanism):
    """A state of a step before."""

    fault = "a mechanism one step late"
    named = ("one step (0.002 s) late",)

    def clock(self, t: float) -> float:
        """Behind."""
        return t - STEP
