"""A tolerance as a person gives it at any command: ``1e-4``, ``0.1 %``, ``1 mm``, ``positions=1 mm``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from proofroll.core.comparison import Tolerance
from proofroll.core.errors import InputError
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.studies.judging.reference import Reference

FORMS = "write 1e-4 of the path, '0.1 %' of it, '1 mm', or QUANTITY='1 mm'"
DEFAULT = "1e-4"
_PART = re.compile(r"\s*(\d*\.?\d+\.?(?:[eE][-+]?\d+)?)\s*(?:of\s+(?:the\s+)?path)?\s*")
_LENGTH, _COMPONENTS = "m", "1"


@dataclass(frozen=True)
class AskedTolerance:
    """Largest errors that a person can bear.

    Attributes:
        text: as it was given.
        bounds: observable -> largest distance from the truth.
    """

    text: str
    bounds: dict[str, Tolerance]

    @property
    def relative(self) -> bool:
        """True if all bounds are parts of the size of their quantity."""
        return all(bound.relative for bound in self.bounds.values())

    @classmethod
    def of(cls, texts: Sequence[str], scene: Scene, *, forces: bool = False) -> AskedTolerance:
        """Tolerance from the texts of an option.

        Args:
            texts: a number or ``0.1 %`` bounds all judged quantities, ``1 mm`` those in metres, ``name=1 mm`` one.
            scene: whose observables are bounded.
            forces: True if a part of the size bounds the reactions, too.

        Raises:
            InputError: another form, no such quantity, or none in this unit.
        """
        bounds: dict[str, Tolerance] = {}
        for text in texts:
            name, equals, value = text.partition("=")
            if equals:
                item = scene.observable(name.strip())
                bounds[name.strip()] = Tolerance.of_quantity(f"tolerance: {name}", value, item.unit)
            else:
                bounds |= _common(text, scene, forces=forces)
        return cls(", ".join(text.strip() for text in texts), bounds)

    def allowed(self, reference: Reference) -> dict[str, float]:
        """Observable -> largest error in its unit; without those for which a part has no size to refer to."""
        sizes = {name: reference.scale(name) for name in self.bounds}
        return {
            name: bound.absolute(sizes[name] or 1.0)
            for name, bound in self.bounds.items()
            if name in reference.curves and (sizes[name] or not bound.relative)
        }


def judged_names(scene: Scene, *, forces: bool = False) -> list[str]:
    """Observables that a tolerance without a name bounds: the motion in summaries, and the place of every body.

    ``forces``: the reactions in summaries, too.
    """
    motion = {name: item for name, item in scene.observables.items() if item.role is Role.MOTION}
    names = [name for name, item in motion.items() if item.headline or (item.watched and item.unit == _LENGTH)] or [
        scene.deciding
    ]
    reactions = [name for name, item in scene.observables.items() if item.role is Role.REACTION and item.headline]
    return [*names, *(reactions if forces else [])]


def orientations_of(scene: Scene, names: Iterable[str]) -> list[str]:
    """Observables of orientation that are not among ``names``: a tolerance of lengths bounds none of them.

    They are the motion without a unit: components of quaternions.
    """
    judged = set(names)
    motion = {name: item for name, item in scene.observables.items() if item.role is Role.MOTION}
    return [name for name, item in motion.items() if item.unit == _COMPONENTS and name not in judged]


def in_percent(text: str) -> str:
    """Text of a tolerance without a name: a part of the path as a percentage, any other as it is."""
    part = _PART.fullmatch(text)
    return text if part is None else f"{100 * float(part[1]):.17g} %"


def _common(text: str, scene: Scene, *, forces: bool) -> Mapping[str, Tolerance]:
    """Bounds of all judged quantities by a text without a name."""
    units = {name: scene.observables[name].unit for name in judged_names(scene, forces=forces)}
    if (percentage := in_percent(text)).rstrip().endswith("%"):
        return dict.fromkeys(units, Tolerance.of_quantity("tolerance", percentage, "1"))
    bounds = {}
    for name, unit in units.items():
        try:
            bounds[name] = Tolerance.of_quantity("tolerance", text, unit)
        except InputError:
            continue
    if not bounds:
        told = ", ".join(f"{name} [{unit}]" for name, unit in units.items())
        raise InputError("tolerance", text, f"{FORMS}; judged here are {told}")
    return bounds
