"""A tolerance as a person gives it at any command: ``1e-4``, ``0.1 %``, ``1 mm``, ``positions=1 mm``."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from proofroll.core.comparison import Tolerance
from proofroll.core.errors import InputError
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.studies.judging.reference import Reference

FORMS = "write 1e-4 of the path, '0.1 %' of it, '1 mm', or QUANTITY='1 mm', above 0"
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
        units = {name: scene.observables[name].unit for name in judged_names(scene, forces=forces)}
        bounds = bounds_of(texts, units, lambda name: scene.observable(name).unit)
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


def bounds_of(texts: Sequence[str], units: Mapping[str, str], unit_of: Callable[[str], str]) -> dict[str, Tolerance]:
    """Quantity -> its tolerance, from the texts of an option.

    Args:
        texts: with a name before ``=``, or without.
        units: quantity that a text without a name bounds -> its unit.
        unit_of: unit of a quantity that a text names.

    Raises:
        InputError: another form, or a unit that none of the quantities has; and what ``unit_of`` raises.
    """
    bounds: dict[str, Tolerance] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if equals:
            bounds[name] = Tolerance.of_quantity(f"tolerance: {name}", value, unit_of(name))
        else:
            bounds |= _common(text, units)
    return bounds


def _common(text: str, units: Mapping[str, str]) -> dict[str, Tolerance]:
    """Bounds of all quantities in which a text without a name can be read; a bare number is a part of the path."""
    part, bounds = _PART.fullmatch(text), dict[str, Tolerance]()
    value = text if part is None else f"{100 * float(part[1]):.17g} %"
    for name, unit in units.items():
        with suppress(InputError):
            bounds[name] = Tolerance.of_quantity("tolerance", value, "1" if value.rstrip().endswith("%") else unit)
    if not bounds:
        told = ", ".join(f"{name} [{unit}]" for name, unit in units.items())
        raise InputError("tolerance", text, f"{FORMS}; judged here are {told}")
    return bounds
