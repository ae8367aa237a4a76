"""Mechanisms whose joints have other laws than the scene's: friction, stops, armature, actuators, couplings."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.engines.pinocchio import Pinocchio
from proofroll_drill.mutants.base import planted
from proofroll_drill.mutants.mechanism_models import MechanismMutant, each, times

SERVO: Any = ("servo", {})
ARM: Any = ("arm_pd", {})
CLAMPED: Any = ("saturated_servo", {})


class Driven(MechanismMutant):
    """Base of mutants with actuators and couplings, which are built in Pinocchio."""

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

    events = None  # type: ignore[assignment]  # this formulation locates none


def _lowered(by: float) -> Callable[[Any, Mechanism], Mechanism]:
    """Stops lower by a length [m], farther than two steps reach: nearer ones are where a step may end."""
    return each("joints", limits=lambda joint: joint.limits and tuple(limit - by for limit in joint.limits))


_SWING = {"scene": ("pendulum_friction", {}), "until": 0.4, "every": 0.02}
_fault, _driven = partial(planted, MechanismMutant), partial(planted, Driven)
_stop = partial(planted, MechanismMutant, every=0.02, other=_lowered(0.03))
FAULTS = (
    _fault(
        "RoughJoint",
        "dry friction 1.1 times",
        "dry friction of the joints 1.1 times",
        other=each("joints", friction=times(1.1, "friction")),
        **_SWING,
    ),
    # half swings that each end at a switch, fifteen samples apart
    _fault(
        "RoughAgain",
        "dry friction 1.1 times, over many turns",
        "dry friction of the joints 1.1 times",
        other=each("joints", friction=times(1.1, "friction")),
        scene=("spring_friction", {}),
        until=1.0,
        every=0.02,
    ),
    _fault(
        "RoughElbow",
        "dry friction of one joint 1.1 times",
        "dry friction of the joint elbow 1.1 times",
        other=each("joints", "elbow", friction=times(1.1, "friction")),
        scene=(str(Path(__file__).parent / "rough_arm"), {}),
        until=0.3,
        every=0.01,
    ),
    # along the motion, as a drive of the same size: the pendulum swings one way in this time
    _fault(
        "PushingJoint",
        "dry friction with the wrong sign",
        "dry friction of the joints with the wrong sign",
        other=each("joints", torque=lambda joint: -joint.friction, friction=lambda _: 0.0),
        **_SWING,
    ),
    _stop("MovedStop", "stop at another place", "rests at", scene=("stop", {}), until=0.6),
    # with half of its speed, without coming to rest in this time
    _stop(
        "MovedStopWithRebounds",
        "stop at another place, with rebounds",
        "turns back at -0.03,",
        scene=("stop", {"restitution": 0.5}),
        until=1.0,
    ),
    _stop(
        "MovedStopWithOneRebound",
        "stop at another place, with one rebound",
        "turns back at -0.03,",
        scene=("stop", {"restitution": 0.5}),
        until=0.8,
    ),
    _driven(
        "SwappedGains",
        "kp and kd swapped",
        "kp and kd swapped",
        scene=ARM,
        other=each("actuators", kp=lambda servo: servo.kd, kd=lambda servo: servo.kp),
    ),
    _driven("UndampedServo", "kd left out", "kd of the actuators left out", other=each("actuators", kd=lambda _: 0.0)),
    _driven(
        "NoClamp",
        "limit of an effort ignored",
        "no limit on the efforts",
        scene=CLAMPED,
        other=each("actuators", limit=lambda _: None),
    ),
    _driven(
        "TightClamp",
        "limit of an effort halved",
        "the limits of the actuators halved",
        scene=CLAMPED,
        other=each("actuators", limit=times(0.5, "limit")),
    ),
    _driven(
        "NoArmature",
        "armature left out",
        "armature of the joints left out",
        scene=ARM,
        other=each("joints", armature=lambda _: 0.0),
    ),
    _driven(
        "InverseGear",
        "ratio of a gear the other way round",
        "the coupling gear has the ratio -2",
        scene=("gear_pair", {}),
        other=each("couplings", ratio=lambda gear: 1 / gear.ratio),
    ),
    _driven(
        "CoarseGear",
        "ratio of a gear 1 % off",
        "the coupling gear has the ratio 50.5",
        scene=("arm_rotor", {}),
        other=each("couplings", ratio=times(1.01, "ratio")),
    ),
)
