"""Tables of a mechanism in a scene file, and the scenes of mechanisms on which engines are checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from proofroll.core.errors import InputError
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene
from proofroll.core.validation import all_units_of
from proofroll.elements.mechanism.reading.reader import KINDS, made_mechanism
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.elements.mechanism.scene.checks import WORLD
from proofroll.elements.mechanism.scene.control import Control
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.parts import Spring
from proofroll.elements.mechanism.scene.published import read_published
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.elements.mechanism.scene.spring_law import IN_LAWS

if TYPE_CHECKING:
    from proofroll.core.diagnosis import Hypothesis


# A mechanism without laws of joints, and a law of each kind, which changes its motion by far more than a step does
# [SI].
_PLAIN = "double_pendulum"
_LAWS: Mapping[str, float] = {"damping": 2.0, "torque": 3.0, "armature": 0.3, "friction": 0.7}
# Scenes of models/ that require what no scene below does, each in a run of a tenth of a second.
_SHOWN = (
    *("slider_crank", "heavy_top", "oscillators", "sled", "falling_rod", "joint_bench"),
    *("engine_on_mounts", "spatial_slider_crank"),
)
_SPEED = 1.0  # rad/s, at which a damper acts
_OVERFLOWING = 1e200  # rad/s, whose square no number holds


def _changed(scene: Scene, name: str, **parts: Any) -> Scene:
    """Copy of a scene with a new name and some parts of its mechanism replaced."""
    element = the_mechanism(scene)
    return replace(scene, name=name, elements=(replace(element, mechanism=replace(element.mechanism, **parts)),))


def _with_law(scene: Scene, law: str, value: float) -> Scene:
    """Copy of a scene of hinges with a law of that size in each joint, and all joints moving."""
    changes: dict[str, Any] = {law: value, "v0": (_SPEED,)}
    joints = tuple(replace(joint, **changes) for joint in the_mechanism(scene).mechanism.joints)
    return _changed(scene, f"{scene.name}-{law}", joints=joints)


def _falling(scene: Scene) -> Scene:
    """Copy of a scene of one free body with gravity and a centre of mass outside the origin of its frame."""
    (body,) = the_mechanism(scene).mechanism.bodies
    return _changed(scene, "falling_body", bodies=(replace(body, com=(0.1, -0.2, 0.3)),), gravity=(0.0, 0.0, -9.81))


def _with_drive(scene: Scene, drive: str) -> Scene:
    """Copy of a scene of two hinges, both moving, with an actuator at the second or a coupling of the two."""
    joints = joint_1, joint_2 = tuple(replace(joint, v0=(_SPEED,)) for joint in the_mechanism(scene).mechanism.joints)
    servo = Actuator("servo", joint_2.name, "position", 1.0, kp=30.0, kd=2.0, gear=2.0)
    of_time = replace(servo, target=Formula("cos(5*t)"))
    ends: dict[str, Any] = {"body_a": WORLD, "body_b": joint_2.child, "position_a": (0.3, 0.0, 0.4)}
    drives: Mapping[str, Mapping[str, Any]] = {
        "spring": {"springs": (Spring("spring", stiffness=40.0, damping=1.0, length=0.5, **ends),)},
        "servo": {"actuators": (servo,)},
        "limit": {"actuators": (replace(servo, limit=5.0),)},
        "target": {"actuators": (of_time,)},
        "coupling": {
            "couplings": (
                Coupling(
                    name="gear",
                    joint_a=joint_1.name,
                    joint_b=joint_2.name,
                    ratio=1.0,
                    offset=joint_2.q0[0] - joint_1.q0[0],
                ),
            )
        },
    }
    return _changed(scene, f"{scene.name}-{drive}", joints=joints, **drives[drive])


# s: the spheres then hit and stick at 0.03822 s, an impact that half a step resolves better than a step of 2e-3 s does.
_SOONER = 0.06178
_RATE = 50.0  # Hz, of a controller; common steps divide the time between its instants
_DRIVES = ("servo", "limit", "target", "coupling", "spring")


def _sooner(scene: Scene, time: float) -> Scene:
    """Copy of a scene of freely flying spheres that starts ``time`` [s] later on their path."""
    joints = tuple(
        replace(joint, q0=(*(x + time * v for x, v in zip(joint.q0[:3], joint.v0[:3], strict=True)), *joint.q0[3:]))
        for joint in the_mechanism(scene).mechanism.joints
    )
    return _changed(scene, scene.name, joints=joints)


class MechanismKind:
    """See :class:`proofroll.core.element.ElementKind`."""

    name: ClassVar[str] = "mechanism"
    tables: ClassVar[tuple[str, ...]] = (*KINDS, "repeat", "published", "unmodelled", "impacts", "control")
    units: ClassVar[Mapping[str, str]] = all_units_of(*KINDS.values()) | {unit: unit for unit in IN_LAWS}

    @staticmethod
    def read(
        tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, place: str
    ) -> Sequence[MechanismElement]:
        """One mechanism from all bodies, joints, loops, springs and other tables of a file."""
        x, y, z = gravity.vector.tolist()
        try:
            read_published(tables.get("published", []))
            return [MechanismElement(made_mechanism(tables, (x, y, z), numbers))]
        except InputError as error:
            raise InputError(f"{place}: {error.field}", error.value, error.advice) from None

    @staticmethod
    def conformance_scenes() -> Mapping[str, Scene]:
        """A loop with varying inertia, a chain, a top, a slide, a free body, sliding feet, a coin: the hardest first.

        Last come those that formulations of a ball that rolls in a cylinder build, without zero or symmetric values.
        """
        from proofroll.files.scene_file import load_scene

        names = ("slider_crank", "double_pendulum", "heavy_top", "pendulum", "oscillators", "free_body", "sled")
        scenes = {name: load_scene(name) for name in (*names, "rolling_coin")}
        cylinder: dict[str, Any] = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0}
        return scenes | {
            "cylinder-resisting": load_scene("sphere_in_cylinder", **cylinder, rolling_resistance=5e-4),
            "cylinder": load_scene("sphere_in_cylinder", **cylinder),
            "cylinder-oriented": load_scene("sphere_in_cylinder", **cylinder, asks=("orientation",)),
        }

    @staticmethod
    def truth_scenes() -> Mapping[str, Scene]:
        """Mechanisms with a loop, oblique axes, a top, springs, sliding feet, an impact, each law and each drive.

        In the two hinges, the falling body and the slow top every number of the model, gravity included, changes the
        first acceleration.
        """
        from proofroll.files.scene_file import load_scene

        scenes = {name: load_scene(name) for name in _SHOWN}
        scenes[_PLAIN] = plain = load_scene(_PLAIN)
        scenes["slow_top"] = load_scene("heavy_top", spin=2.0, tilt=1.2)
        scenes["falling_body"] = _falling(load_scene("free_body", w1=2.0, w3=1.0))
        scenes["two_spheres"] = _sooner(load_scene("two_spheres", friction=0.5), _SOONER)
        scenes |= {f"{_PLAIN}-{law}": _with_law(plain, law, value) for law, value in _LAWS.items()}
        return scenes | {f"{_PLAIN}-{drive}": _with_drive(plain, drive) for drive in _DRIVES}

    @staticmethod
    def contrasts() -> Mapping[str, tuple[Scene, Scene]]:
        """Scenes in whose run one law acts, each with the same scene without it; see :mod:`proofroll.conformance`."""
        from proofroll.files.scene_file import load_scene

        plain = load_scene(_PLAIN)
        held = _with_drive(plain, "target")
        (servo,) = the_mechanism(held).mechanism.actuators
        resting = _changed(held, f"{held.name}-still", actuators=(replace(servo, target=1.0),))
        spheres = [_sooner(load_scene("two_spheres", friction=0.0, restitution=e), _SOONER) for e in (0.8, 0.0)]
        sleds = [load_scene("sled", friction=mu, spin=0.0, cross_speed=0.0) for mu in (0.3, 0.0)]  # straight on
        driven, free = _with_drive(plain, "servo"), _with_law(plain, "damping", 0.0)
        weak = _changed(driven, f"{driven.name}-weak", actuators=(replace(servo, target=1.0, kp=servo.kp / 2),))
        first, last = the_mechanism(free).mechanism.joints
        stopped = replace(last, limits=(last.q0[0] - 1.0, last.q0[0] + 0.03))  # reached within the run
        return {
            "limit_of_efforts": (_with_drive(plain, "limit"), driven),
            "held_targets": (_changed(held, f"{held.name}-held", control=Control(_RATE, (servo.name,))), resting),
            "restitution": (spheres[0], spheres[1]),
            "stiffness_of_servos": (driven, weak),
            "damping": (_with_law(plain, "damping", _LAWS["damping"]), free),
            "stops": (_changed(free, f"{_PLAIN}-stopped", joints=(first, stopped)), free),
            "rebounds_from_stops": (
                _changed(free, f"{_PLAIN}-thrown", joints=(first, replace(stopped, restitution=0.8))),
                _changed(free, f"{_PLAIN}-caught", joints=(first, stopped)),
            ),
            "friction_of_contacts": (sleds[0], sleds[1]),
        }

    @staticmethod
    def alike_scenes() -> Mapping[str, Sequence[Scene]]:
        """Scenes for copies that move together; the last one's velocities are not finite after a few steps."""
        from proofroll.files.scene_file import load_scene

        plain = load_scene(_PLAIN)
        hinges = the_mechanism(plain).mechanism.joints
        fast = tuple(replace(joint, v0=(_OVERFLOWING,)) for joint in hinges)
        variant = load_scene(_PLAIN, angle=0.7, mass=1.6)
        return {_PLAIN: (plain, variant, _changed(plain, f"{_PLAIN}-overflowing", joints=fast))}

    @staticmethod
    def hypotheses() -> Sequence[Hypothesis]:
        """See :class:`proofroll.core.diagnosis.ExplainsRuns`."""
        from proofroll.elements.mechanism.diagnosis import hypotheses

        return hypotheses()
