"""Axes of a stability map, each a number that changes parameters of a scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from proofroll.core.errors import require_known
from proofroll.core.scene import Scene
from proofroll.core.validation import FloatOrInf


@dataclass(frozen=True)
class Effort:
    """Limits on the cost of a map.

    Attributes:
        periods: length of every run in natural times, unless the axis decides it.
        values: largest number of values per axis, or None.
        steps: largest number of fixed steps of a run. Steps are counted rather than seconds, so that every machine
            searches the same rungs.
        seconds: longest processor time of a run with a fixed step, as its coarsest run foretells [s].
        limit: wall time after which a run is ended [s], with the start of its worker; its outcome stays open.
        longest: longest run that an axis may have, in natural times; None: any.
        matched: True if only the matched settings of each formulation are mapped, or its first ones without matched.
    """

    periods: float = 3.0
    values: int | None = None
    steps: int = 75_000
    seconds: FloatOrInf = math.inf
    limit: float = 15.0
    longest: float | None = None
    matched: bool = False

    def values_of(self, axis: Axis) -> list[float]:
        """Values of an axis that are mapped."""
        cut = axis.horizon and self.longest is not None
        values = [value for value in axis.values if value <= self.longest] if cut else axis.values  # type: ignore[operator]
        return evenly_chosen(values, self.values) if self.values else values


# A quick map leaves out the longest runs and the finest steps, which take most of the time. A step costs 5 microseconds
# in one engine and a millisecond in another, so that steps alone bound no time.
QUICK = Effort(values=3, steps=2_500, seconds=0.8, limit=3.0, longest=10.0, matched=True)


def evenly_chosen(values: Sequence[float], count: int) -> list[float]:
    """Selection of at most ``count`` of the values, evenly spread, with both ends."""
    if len(values) <= count:
        return list(values)
    last = len(values) - 1
    return [values[round(index * last / (count - 1))] for index in range(count)]


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
