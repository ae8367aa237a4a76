"""Mechanisms that move rightly and are reported wrongly."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll_drill.mutants.base import STEP, Mutant, OneStepBehind, planted
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


class BehindMechanism(OneStepBehind, ToldMechanism):
    """Base of mutants with reactions of the step before."""


def _told(name: str, fault: str, named: str, said: Mapping[str, Callable[..., Any]], **more: Any) -> type[Mutant]:
    """Mutant whose samples have other fields, each from the mutant and its right sample."""

    def misreport(self: Any, sample: MechanismSample) -> MechanismSample:
        return dataclasses.replace(sample, **{field: value(self, sample) for field, value in said.items()})

    return planted(ToldMechanism, name, fault, named, misreport=misreport, **more)


def _moving(value: Callable[..., Any], field: str) -> Mapping[str, Callable[..., Any]]:
    """Another field of a sample from the first step on."""
    return {field: lambda self, sample: value(self, sample) if self.t else getattr(sample, field)}


def _about_centre(self: Any, sample: Any) -> Any:
    """Moments about the centre of mass of each child."""
    coms = np.concatenate([self.com, np.zeros((1, 3))])
    arm = self.of_children(sample).apply(np.array([coms[body] - at for body, at in self.ends]))
    return sample.joint_torque - np.cross(arm, sample.joint_force)


def _late_reactions(self: Any, sample: MechanismSample) -> MechanismSample:
    """Sample with the reactions of the step before."""
    old = self.behind.sample()
    return dataclasses.replace(sample, joint_force=old.joint_force, joint_torque=old.joint_torque)


_WRENCH = ("joint_force", "joint_torque")
_MINUS, _REVERSED = (
    {name: lambda _, sample, name=name: -getattr(sample, name) for name in _WRENCH},
    {name: lambda _, sample, name=name: getattr(sample, name)[::-1] for name in _WRENCH},
)
_IN_BODY_AXES = {"joint_force": lambda self, sample: self.of_children(sample).inv().apply(sample.joint_force)}
_ABOUT_CENTRE = {"joint_torque": _about_centre}
LateReaction = planted(
    BehindMechanism,
    "LateReaction",
    "reactions of the step before",
    "force is one step (0.002 s) late",
    misreport=_late_reactions,
)
FAULTS = (
    _told(
        "BodyRates",
        "body spin for world spin of a top",
        "angular velocity in body axes",
        _moving(lambda _, sample: _turns(sample).inv().apply(sample.w_WB), "w_WB"),
        scene=TOP,
    ),
    _told(
        "CentrePosition",
        "positions of the centres of mass",
        "p_WB is the position of the centres of mass",
        _moving(lambda self, sample: sample.p_WB + _turns(sample).apply(self.com), "p_WB"),
    ),
    _told(
        "CentreVelocity",
        "velocities of the centres of mass",
        "v_WB is the velocity of the centres of mass",
        _moving(lambda self, sample: sample.v_WB + np.cross(sample.w_WB, _turns(sample).apply(self.com)), "v_WB"),
    ),
    _told("OnParent", "reaction on the wrong body", "force has the wrong sign", _MINUS),
    _told("BodyReaction", "reaction in body axes", "joint in body axes", _IN_BODY_AXES),
    _told("Swapped", "reactions in another order of joints", "of another joint", _REVERSED),
    _told("AboutCentre", "moment about the centre of mass", "moment about the centre of mass", _ABOUT_CENTRE),
    # of a loop's reactions not every component is determined
    _told("LoopReaction", "reactions of loops in body axes", "joint in body axes", _IN_BODY_AXES, scene=CRANK),
    _told("LoopSwapped", "reactions of loops in another order", "of another joint", _REVERSED, scene=CRANK),
    # it turns by 80 degrees in 2 ms
    _told(
        "LoopAboutCentre",
        "moments of loops about the centres of mass",
        "moment about the centre of mass",
        _ABOUT_CENTRE,
        scene=("andrews_squeezer", {}),
        until=0.012,
        every=0.001,
        step=5e-5,
    ),
    # by a twentieth per second, and its matrix is taken as if it did not grow
    _told(
        "Unnormalised",
        "quaternion not normalised",
        "q_WB has length",
        {"q_WB": lambda self, sample: sample.q_WB * (1 + 0.05 * self.t)},
        scene=TOP,
    ),
    _told(
        "MechanismScalarLast",
        "quaternions of bodies with their scalar last",
        "scalar last",
        _moving(lambda _, sample: np.roll(sample.q_WB, -1, axis=-1), "q_WB"),
        scene=CRANK,
    ),
    LateReaction,
    planted(
        ToldMechanism,
        "LateMechanism",
        "a mechanism one step late",
        "one step (0.002 s) late",
        clock=lambda _, t: t - STEP,
    ),
)
