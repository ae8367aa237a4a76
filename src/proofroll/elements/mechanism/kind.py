"""Tables of a mechanism in a scene file, and the mechanisms on which engines are checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from proofroll.core.errors import InputError
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene
from proofroll.core.validation import all_units_of
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.elements.mechanism.reader import KINDS, made_mechanism

if TYPE_CHECKING:
    from proofroll.core.diagnosis import Hypothesis


# A mechanism without laws of joints, and one of each that changes its motion by far more than any step does [SI].
_PLAIN = "double_pendulum"
_LAWS: Mapping[str, float] = {"damping": 2.0, "torque": 3.0, "armature": 0.3, "friction": 0.7}
_SPEED = 1.0  # rad/s, at which a damper acts


def _with_law(scene: Scene, law: str, value: float) -> Scene:
    """A scene of hinges whose joints all move, with the law in each."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)  # it is one of ours
    mechanism = element.mechanism
    changes: dict[str, Any] = {law: value, "v0": (_SPEED,)}
    joints = tuple(replace(joint, **changes) for joint in mechanism.joints)
    changed = replace(element, mechanism=replace(mechanism, joints=joints))
    return replace(scene, name=f"{scene.name}-{law}", elements=(changed,))


class MechanismKind:
    """See :class:`proofroll.core.element.ElementKind`."""

    name: ClassVar[str] = "mechanism"
    tables: ClassVar[tuple[str, ...]] = (
        *KINDS,
        "repeat",
        "published",
        "unmodelled",
    )
    units: ClassVar[Mapping[str, str]] = all_units_of(*KINDS.values())

    @staticmethod
    def read(
        tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, where: str
    ) -> Sequence[MechanismElement]:
        """All bodies, joints, loops and springs of a file are one mechanism."""
        x, y, z = gravity.vector.tolist()
        try:
            return [MechanismElement(made_mechanism(tables, (x, y, z), numbers))]
        except InputError as error:
            raise InputError(f"{where}: {error.field}", error.value, error.advice) from None

    @staticmethod
    def conformance_scenes() -> Mapping[str, Scene]:
        """A loop with inertia that changes, a chain, a top, a slide without a loop, a free body: the hardest first."""
        from proofroll.files.scene_file import load_scene

        names = ("slider_crank", "double_pendulum", "heavy_top", "pendulum", "oscillators", "free_body")
        return {name: load_scene(name) for name in names}

    @staticmethod
    def truth_scenes() -> Mapping[str, Scene]:
        """Mechanisms with a loop, oblique axes, a spinning body, springs, and each law of a joint."""
        from proofroll.files.scene_file import load_scene

        found = {name: load_scene(name) for name in ("slider_crank", "heavy_top", "oscillators")}
        return found | {f"{_PLAIN}-{law}": _with_law(load_scene(_PLAIN), law, value) for law, value in _LAWS.items()}

    @staticmethod
    def hypotheses() -> Sequence[Hypothesis]:
        """See :class:`proofroll.core.diagnosis.ExplainsRuns`."""
        from proofroll.elements.mechanism.diagnosis import HYPOTHESES

        return HYPOTHESES
