"""Natural units of a mechanism: in these, the thresholds of switching routes are relative to the scene's own scale.

Units are powers of two, so conversions do not round.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism.contacts.start import natural_scale
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.named_forces import named_forces
from proofroll.elements.mechanism.record import Record
from proofroll.elements.mechanism.signal import FUNCTIONS, Formula, Signal, Table

_COORDINATES = {"planar": (1, 1, 0), "free": (1, 1, 1, 0, 0, 0, 0), "prismatic": (1,)}  # powers of the length
_VELOCITIES = _COORDINATES | {"free": (1, 1, 1, 0, 0, 0)}
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
        return self.mass * self.length / self.time**2

    def mechanism(self, si: Mechanism) -> Mechanism:
        """Mechanism in these units, from one in SI units."""
        to, joints = Units(1 / self.length, 1 / self.mass, 1 / self.time), {j.name: j for j in si.joints}
        length, stiffness = to.length, to.force / to.length

        def placed(item: Any, *names: str) -> Any:
            return replace(item, **{name: _times(getattr(item, name), length) for name in names})

        bodies = [
            replace(
                placed(body, "com"),
                mass=body.mass * to.mass,
                inertia=tuple(_times(row, to.mass * length**2) for row in body.inertia),
            )
            for body in si.bodies
        ]
        springs = [
            replace(
                placed(spring, "position_a", "position_b", "length"),
                stiffness=spring.stiffness * stiffness,
                damping=spring.damping * stiffness * to.time,
            )
            for spring in si.springs
        ]
        actuators = []
        for item in si.actuators:
            way, effort = to._along(joints[item.joint])
            target = {"torque": effort, "velocity": way / to.time, "position": way}[item.kind]
            actuators.append(
                replace(
                    item,
                    target=self._signal(item.target, target),
                    kp=item.kp * effort / way,
                    kd=item.kd * effort / way * to.time,
                    limit=None if item.limit is None else item.limit * effort,
                )
            )
        couplings = []
        for coupling in si.couplings:
            (a, _), (b, _) = (to._along(joints[name]) for name in (coupling.joint_a, coupling.joint_b))
            couplings.append(replace(coupling, ratio=coupling.ratio * b / a, offset=coupling.offset * b))
        return replace(
            si,
            bodies=tuple(bodies),
            joints=tuple(self._joint(to, placed(joint, "position", "child_position")) for joint in si.joints),
            loops=tuple(placed(loop, "position_a", "position_b") for loop in si.loops),
            springs=tuple(springs),
            points=tuple(placed(point, "position") for point in si.points),
            geometries=tuple(placed(item, "position", "radius", "axes", "size") for item in si.geometries),
            actuators=tuple(actuators),
            couplings=tuple(couplings),
            gravity=_times(si.gravity, length / to.time**2),
        )

    def record(self, mechanism: Mechanism, own: Record) -> Record:
        """Record in SI units, from one in these units; ``mechanism`` is in SI units."""
        speed, moment = self.length / self.time, self.force * self.length
        q = [
            self.length**power for joint in mechanism.joints for power in _COORDINATES.get(joint.kind, (0,) * joint.nq)
        ]
        v = [self.length**power for joint in mechanism.joints for power in _VELOCITIES.get(joint.kind, (0,) * joint.nv)]
        named = [self.force if item.unit == "N" else moment for item in named_forces(mechanism)]
        return Record(
            time=own.time * self.time,
            p_WB=own.p_WB * self.length,
            v_WB=own.v_WB * speed,
            q_WB=own.q_WB,
            w_WB=own.w_WB / self.time,
            q=own.q * np.array(q[: own.q.shape[1]]),
            v=own.v * (np.array(v[: own.v.shape[1]]) / self.time),
            wrench=own.wrench * np.repeat([self.force, moment], 3),
            named=own.named * np.array(named[: own.named.shape[1]]),
            residual=own.residual,
        )

    @contextmanager
    def errors_in_seconds(self) -> Iterator[None]:
        """Context that converts the times in error messages from these units to seconds."""
        try:
            yield
        except (Refused, Diverged) as error:
            message = _TIME.sub(lambda match: f"{float(match[0]) * self.time:.6g}", str(error))
            raise type(error)(message) from None

    def _along(self, joint: Joint) -> tuple[float, float]:
        """Units of a joint's coordinate and of an effort along it."""
        return (self.length, self.force) if joint.kind == "prismatic" else (1.0, self.force * self.length)

    def _joint(self, to: Units, joint: Joint) -> Joint:
        way, effort = to._along(joint)
        q, v = _COORDINATES.get(joint.kind, (0,) * joint.nq), _VELOCITIES.get(joint.kind, (0,) * joint.nv)
        return replace(
            joint,
            q0=tuple(value * to.length**power for value, power in zip(joint.q0, q, strict=True)),
            v0=tuple(value * to.length**power / to.time for value, power in zip(joint.v0, v, strict=True)),
            stiffness=joint.stiffness * effort / way,
            rest=joint.rest * way,
            damping=joint.damping * effort / way * to.time,
            friction=joint.friction * effort,
            torque=self._signal(joint.torque, effort),
            armature=joint.armature * effort / way * to.time**2,
            limits=_times(joint.limits, way),
        )

    def _signal(self, signal: Signal, factor: float) -> Signal:
        if isinstance(signal, _InUnits):
            return replace(signal, second=signal.second * self.time, factor=signal.factor * factor)
        if isinstance(signal, Formula):
            return _InUnits(signal.text, signal.numbers, self.time, factor)
        if isinstance(signal, Table):
            return Table(_times(signal.times, 1 / self.time), _times(signal.values, factor))
        return signal * factor


def natural_units(mechanism: Mechanism) -> Units:
    """Units near the mechanism's own size, mass and time, see :func:`.natural_scale`."""
    length, rate = natural_scale(mechanism)
    mass = mechanism.mass
    return Units(length, 2.0 ** round(np.log2(mass)), 1 / rate)


def _times(value: Any, factor: float) -> Any:
    """Product of a number, or of each number of a tuple, with a factor; None stays None."""
    if value is None or isinstance(value, float | int):
        return value if value is None else value * factor
    return tuple(item * factor for item in value)
