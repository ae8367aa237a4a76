"""Natural units of a mechanism: in these, the thresholds of switching routes are relative to the scene's own scale.

Units are powers of two, so conversions do not round.
"""

import math
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.errors import Diverged, Refused
from proofroll.core.parameters import Unit
from proofroll.core.quantity import OR, powers_of
from proofroll.core.validation import units_of_kind
from proofroll.elements.mechanism import Joint, Mechanism
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, Formula, Table
from proofroll.elements.mechanism.scene.spring_law import SpringLaw

_TIME = re.compile(r"(?<=\bt = )[\d.e+-]+(?= s\b)")  # times in messages of routes


@dataclass(frozen=True)
class _InUnits(Formula):
    """A formula with time and value in other units."""

    second: float = 1.0
    factor: float = 1.0

    def at(self, time: Any, functions: Any = FUNCTIONS) -> Any:
        return self.factor * super().at(self.second * time, functions)


class Units(NamedTuple):
    """Units of length [m], mass [kg] and time [s]."""

    length: float
    mass: float
    time: float

    @property
    def force(self) -> float:
        """Unit of force [N]."""
        return self.size("N")

    def size(self, unit: str) -> float:
        """Unit of a quantity, in the SI unit that scene files give it."""
        base = {"m": self.length, "kg": self.mass, "s": self.time}
        return math.prod((base[name] ** power for name, power in powers_of(unit).items()), start=1.0)

    def mechanism(self, si: Mechanism) -> Mechanism:
        """Mechanism in these units, from one in SI units."""
        slides = {joint.name: joint.kind == JointKind.PRISMATIC for joint in si.joints}

        def each(parts: Iterable[Any]) -> tuple[Any, ...]:
            return tuple(self._own(part) for part in parts)

        couplings = []
        for coupling in si.couplings:
            slide, *others = (slides[name] for name, _ in coupling.terms)
            if coupling.joints:
                scales = [self.length ** (power - slide) for power in (slide, *others)]
                sizes = tuple(factor * scale for (_, factor), scale in zip(coupling.terms, scales, strict=True))
                scaled = self._own(replace(coupling, offset=coupling.place, coefficients=sizes), slide)
            else:
                ratio = coupling.ratio * self.length ** (others[0] - slide)
                scaled = replace(self._own(coupling, slide), ratio=ratio)
            couplings.append(scaled)
        return replace(
            si,
            bodies=each(si.bodies),
            joints=each(si.joints),
            loops=each(si.loops),
            springs=each(si.springs),
            bushings=each(si.bushings),
            forces=each(si.forces),
            points=each(si.points),
            geometries=each(si.geometries),
            pairs=each(si.pairs),
            actuators=tuple(self._own(actuator, slides[actuator.joint]) for actuator in si.actuators),
            couplings=tuple(couplings),
            gravity=self._valued(si.gravity, "m/s^2"),
        )

    def _own(self, part: Any, slides: bool = False) -> Any:
        """Part of a mechanism in these units; a unit with a choice is that of a joint that turns, or ``slides``."""
        units = units_of_kind(type(part), getattr(part, "kind", None))
        field_units = {
            name: unit.split(OR)[slides] if isinstance(unit, str) and OR in unit else unit
            for name, unit in units.items()
        }
        return replace(
            part, **{name: self._valued(getattr(part, name), unit) for name, unit in field_units.items() if unit}
        )

    def _valued(self, value: Any, unit: Unit) -> Any:
        """SI value in these units: a number, a tuple of numbers with one unit or one each, a signal; None stays."""
        if isinstance(unit, tuple):
            return tuple(self._valued(number, number_unit) for number, number_unit in zip(value, unit, strict=True))
        if isinstance(value, tuple):
            return tuple(self._valued(number, unit) for number in value)
        if isinstance(value, Formula):
            second, factor = (value.second, value.factor) if isinstance(value, _InUnits) else (1.0, 1.0)
            return _InUnits(value.text, value.numbers, second * self.time, factor / self.size(unit))
        if value is None or isinstance(value, SpringLaw):
            return value and value.scaled(self.length, self.length / self.time, self.size(unit))
        if isinstance(value, Table):
            return Table(self._valued(value.times, "s"), self._valued(value.values, unit), value.hold)
        return value / self.size(unit)

    def record(self, mechanism: Mechanism, natural: Record) -> Record:
        """Record in SI units, from one in these units; ``mechanism`` is in SI units."""
        moment = self.force * self.length
        q, v = (np.array(self._along(mechanism, name)) for name in ("q0", "v0"))
        named = [self.force if item.unit == "N" else moment for item in named_forces(mechanism)]
        return Record(
            time=natural.time * self.time,
            p_WB=natural.p_WB * self.length,
            v_WB=natural.v_WB * (self.length / self.time),
            q_WB=natural.q_WB,
            w_WB=natural.w_WB / self.time,
            q=natural.q * q[: natural.q.shape[1]],
            v=natural.v * v[: natural.v.shape[1]],
            wrench=natural.wrench * np.repeat([self.force, moment], 3),
            named=natural.named * np.array(named[: natural.named.shape[1]]),
            residual=natural.residual,
        )

    @contextmanager
    def errors_in_seconds(self) -> Iterator[None]:
        """Context that converts the times in error messages from these units to seconds."""
        try:
            yield
        except Refused as error:
            raise type(error)(self.text_in_seconds(str(error))) from None
        except Diverged as error:
            time = None if error.time is None else error.time * self.time
            raise type(error)(self.text_in_seconds(str(error)), time) from None

    def text_in_seconds(self, text: str) -> str:
        """A message with its times in seconds instead of these units."""
        return _TIME.sub(lambda match: f"{float(match[0]) * self.time:.6g}", text)

    def _along(self, mechanism: Mechanism, name: str) -> list[float]:
        """Units of all coordinates (``q0``) or velocities (``v0``) of a mechanism's tree."""
        sizes: list[float] = []
        for joint in mechanism.joints:
            unit, count = units_of_kind(Joint, joint.kind)[name], len(getattr(joint, name))
            sizes += map(self.size, (unit,) * count if isinstance(unit, str) else unit)
        return sizes


def natural_units(mechanism: Mechanism) -> Units:
    """Units near the mechanism's own size, mass and time, see :func:`.natural_scale`."""
    length, rate = natural_scale(mechanism)
    mass = mechanism.mass
    return Units(length, 2.0 ** round(np.log2(mass)), 1 / rate)
