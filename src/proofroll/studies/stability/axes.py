"""Axes of a stability map, each a number that changes parameters of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from proofroll.core.errors import require_known
from proofroll.core.scene import Scene
from proofroll.core.validation import FloatOrInf


@dataclass(frozen=True)
class AxisTerm:
    """A parameter as a function of the axis's value x: ``times`` · x^``power``.

    Attributes:
        times: a number, or the name of a parameter, whose default is taken.
        power: exponent of x.
    """

    times: float | str = 1.0
    power: float = 1.0


@dataclass(frozen=True)
class Axis:
    """One direction in which a scene is taken to its extremes.

    Attributes:
        name: as the user writes it.
        unit: of its values.
        meaning: effect of the axis, for a person.
        values: usually spaced logarithmically.
        parameters: parameter -> its dependence on the value; the others keep their defaults.
        horizon: True if the value is the length of the run in natural times.
        scale_free: True if the dimensionless problem is the same at every value, so that no boundary may depend on it.
    """

    name: str
    unit: str
    meaning: str
    values: list[FloatOrInf]
    parameters: dict[str, AxisTerm] = field(default_factory=dict)
    horizon: bool = False
    scale_free: bool = False

    def at(self, scene: Scene, value: float) -> dict[str, float]:
        """Parameters of a scene at a value of the axis, from the scene's own as defaults.

        Raises:
            InputError: the axis names a parameter that the scene does not have.
        """
        parameters = {}
        for name, term in self.parameters.items():
            for parameter in (name, *([term.times] if isinstance(term.times, str) else ())):
                advice = f"{scene.name} has no such parameter; choose from"
                require_known(f"axes: {self.name}", parameter, scene.parameters, advice)
            factor = scene.parameters[term.times] if isinstance(term.times, str) else term.times
            parameters[name] = factor * value**term.power
        return parameters


def chosen(axes: Sequence[Axis], names: Sequence[str]) -> list[Axis]:
    """Axes of these names; all if no names are given. Raises InputError if there is no such axis."""
    by_name = {axis.name: axis for axis in axes}
    for name in names:
        require_known("axis", name, by_name, "there is no such axis; choose from")
    return [by_name[name] for name in dict.fromkeys(names)] if names else list(axes)
