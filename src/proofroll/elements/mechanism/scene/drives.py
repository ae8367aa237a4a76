"""Actuators of joints, and couplings of joints."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

import numpy as np

from proofroll.core.errors import InputError, require_known
from proofroll.elements.mechanism.scene import checks
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import LAWS
from proofroll.elements.mechanism.scene.signal import Formula, Held, Table, checked, value_at

ActuatorKind = Literal["torque", "velocity", "position"]
# Gains of each kind.
_GAINS: Mapping[str, tuple[str, ...]] = {"torque": (), "velocity": ("kd",), "position": ("kp", "kd")}
# Units of a turning and of a sliding motor; a gear may turn one motion into the other.
_EFFORT, _PLACE = {"unit": "N m or N"}, {"unit": "rad or m"}
_TARGET = {"unit": {"torque": _EFFORT["unit"], "velocity": "rad/s or m/s", "position": _PLACE["unit"]}}
MODES = ("least", "linear", "greatest")  # of an effort with a limit: at its lower limit, between, at its upper limit


_DEPENDENT = 1e-9  # singular value of rows of length 1 below which one follows from the others


@dataclass(frozen=True)
class Actuator:
    """A motor at a joint with one coordinate, through a gear: the motor's coordinate is n q.

    ``limit`` clamps its whole effort at the joint.

    Attributes:
        name: unique among actuators.
        joint: a revolute or prismatic joint.
        kind: meaning of its target r. Effort at the joint, n being the gear: n r (torque), n kd (r - n dq/dt)
            (velocity), n (kp (r - n q) - kd n dq/dt) (position).
        target: of the motor; a number, a formula ``"= 0.3*sin(2*pi*t)"``, or a table ``{times = [..], values = [..]}``.
        kp: gain of a position, at the motor.
        kd: gain of a velocity, at the motor.
        gear: turns of the motor per turn of the joint, n.
        limit: largest size of the whole effort at the joint; None: none.
    """

    name: str
    joint: str
    kind: ActuatorKind
    target: float | Formula | Table = field(default=0.0, metadata={**_TARGET, "signal": True})
    kp: float = field(default=0.0, metadata={"unit": "N m/rad or N/m"})
    kd: float = field(default=0.0, metadata={"unit": "N m s/rad or N s/m"})
    gear: float = field(default=1.0, metadata=checks.RATIO)
    limit: float | None = field(default=None, metadata=_EFFORT)

    def __post_init__(self) -> None:
        place = f"actuators.{checks.name(self.name, 'actuators')}"
        require_known(f"{place}.kind", self.kind, _GAINS)
        checks.assign(self, target=checked(f"{place}.target", self.target))
        for key in ("kp", "kd"):
            value = checks.number(f"{place}.{key}", getattr(self, key), at_least=0)
            if value and key not in _GAINS[self.kind]:
                advice = f"an actuator of kind {self.kind} has none; leave it out"
                raise InputError(f"{place}.{key}", value, advice)
            checks.assign(self, **{key: value})
        gain = next(iter(_GAINS[self.kind]), None)
        if gain and not getattr(self, gain):
            raise InputError(
                f"{place}.{gain}", 0.0, f"without it an actuator of kind {self.kind} does nothing; give it"
            )
        gear = checks.number(f"{place}.gear", self.gear)
        if not gear:
            raise InputError(f"{place}.gear", gear, "a motor that never turns does nothing; give a number other than 0")
        if not math.isfinite(gear * gear * max(self.kp, self.kd)):
            raise InputError(f"{place}.gear", gear, "its square times a gain is infinite; give smaller numbers")
        checks.assign(self, gear=gear)
        if self.limit is not None:
            limit = checks.number(f"{place}.limit", self.limit)
            if limit <= 0:
                advice = "an effort that is clamped to nothing does nothing; give a positive limit or leave it out"
                raise InputError(f"{place}.limit", limit, advice)
            checks.assign(self, limit=limit)

    @property
    def bound(self) -> float:
        """Largest size of the effort at the joint [N m, N]; inf: none."""
        return math.inf if self.limit is None else self.limit

    def wanted(self, time: Any, q: Any, v: Any, functions: Mapping[str, Any] | None = None) -> Any:
        """Effort at the joint before it is clamped [N m, N]; time, q and v are numbers, arrays or symbols.

        ``functions``: those that a formula of t may call, for symbols.
        """
        n, rest = self.gear, () if functions is None else (functions,)
        target = value_at(self.target, time, *rest)
        if self.kind == "torque":
            return n * target
        effort = (n * self.kd) * (target - n * v) if self.kind == "velocity" else (n * self.kp) * (target - n * q)
        return effort - (n * n * self.kd) * v if self.kind == "position" and self.kd else effort

    def effort(
        self, time: float, q: float, v: float, mode: str | None = None, functions: Mapping[str, Any] | None = None
    ) -> float:
        """Effort at the joint in a mode of :data:`MODES` [N m, N]; None: clamped to the limit."""
        if mode in {"least", "greatest"}:
            return -self.bound if mode == "least" else self.bound
        free = float(self.wanted(time, q, v, functions))
        return free if mode == "linear" else min(max(free, -self.bound), self.bound)

    def law(self) -> Callable[[float, float, float], float]:
        """:meth:`effort` at a time, coordinate and rate, with its numbers at hand, for engines that ask it often."""
        if self.kind != "position":
            return self.effort
        n, bound, target = self.gear, self.bound, self.target
        spring, damper = n * self.kp, n * n * self.kd
        target_at = target.at if isinstance(target, Table | Held) else partial(value_at, target)
        return lambda t, q, v: min(max(float(spring * (target_at(t) - n * q) - damper * v), -bound), bound)

    def mode(self, time: float, q: float, v: float) -> str:
        """Mode, of :data:`MODES`, at a time [s], for coordinate and rate of the joint."""
        return self.mode_of(float(self.wanted(time, q, v)))

    def mode_of(self, effort: float) -> str:
        """Mode, of :data:`MODES`, for an effort before it is clamped [N m, N]."""
        return "least" if effort < -self.bound else "greatest" if effort > self.bound else "linear"


@dataclass(frozen=True)
class Coupling:
    """Joints that move together, as by gears, a belt, a rope, a differential.

    Two joints: q_b = ratio q_a + offset. Any number: coefficients[0] q_0 + coefficients[1] q_1 + … = offset.

    Attributes:
        name: unique among couplings.
        joint_a, joint_b: revolute or prismatic joints.
        ratio: of the rate of joint_b to that of joint_a.
        offset: coordinate of joint_b where that of joint_a is zero; with ``joints`` the sum of their coordinates, each
            times its coefficient.
        joints: two or more revolute or prismatic joints, in place of joint_a, joint_b and ratio.
        coefficients: one for each of ``joints``, none of them zero.
    """

    name: str
    joint_a: str = ""
    joint_b: str = ""
    ratio: float = field(default=0.0, metadata={"unit": "1 or rad/m or m/rad"})
    offset: float = field(default=0.0, metadata=_PLACE)
    joints: tuple[str, ...] = ()
    coefficients: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        place = f"couplings.{checks.name(self.name, 'couplings')}"
        checks.read(self, place, checks.number, "ratio", "offset")
        if self.joints or self.coefficients:
            self._check_many(place)
            return
        for key in ("joint_a", "joint_b"):
            if not getattr(self, key):
                raise InputError(f"{place}.{key}", None, "name it; or give joints and coefficients")
        if not self.ratio:
            raise InputError(
                f"{place}.ratio", 0.0, "it would hold joint_b and leave joint_a free; fix the joint instead"
            )
        if self.joint_a == self.joint_b:
            raise InputError(f"{place}.joint_b", self.joint_b, "a coupling connects two joints; these are the same")

    def _check_many(self, place: str) -> None:
        names = tuple(checks.name(name, f"{place}.joints") for name in self.joints)
        factors = checks.numbers(f"{place}.coefficients", self.coefficients, len(names))
        checks.assign(self, joints=names, coefficients=factors)
        if self.joint_a or self.joint_b or self.ratio:
            raise InputError(f"{place}.joints", list(names), "give these, or joint_a, joint_b and ratio; not both")
        if len(names) < 2 or len(set(names)) < len(names):
            raise InputError(f"{place}.joints", list(names), "name two or more joints, each once")
        if not all(factors):
            raise InputError(f"{place}.coefficients", list(factors), "none may be zero; leave out that joint")

    @property
    def terms(self) -> tuple[tuple[str, float], ...]:
        """Joints with their coefficients in a sum that equals :attr:`place`; the first coefficient is 1."""
        if not self.joints:
            return (self.joint_b, 1.0), (self.joint_a, -self.ratio)
        return tuple(
            (name, factor / self.coefficients[0]) for name, factor in zip(self.joints, self.coefficients, strict=True)
        )

    @property
    def place(self) -> float:
        """Sum of the coordinates, each times its coefficient in :attr:`terms` [rad or m]."""
        return self.offset / self.coefficients[0] if self.joints else self.offset

    @property
    def between(self) -> str:
        """Names of its joints, as a clause."""
        return " to ".join((self.joint_a, self.joint_b)) if not self.joints else ", ".join(self.joints)


def check_drives(joints: Sequence[Joint], actuators: Sequence[Actuator], couplings: Sequence[Coupling]) -> None:
    """Checks that actuators and couplings act on joints with one coordinate and do not contradict each other.

    Raises:
        InputError: a joint is unknown or has several coordinates, has two servos, or couplings form a ring.
    """
    kinds = {joint.name: joint.kind for joint in joints}
    named = [(f"actuators.{item.name}.joint", item.joint) for item in actuators]
    named += [
        (f"couplings.{c.name}.{key}", getattr(c, key))
        for c in couplings
        for key in ("joint_a", "joint_b")
        if not c.joints
    ]
    named += [(f"couplings.{c.name}.joints", name) for c in couplings for name in c.joints]
    for field_name, name in named:
        require_known(field_name, name, sorted(kinds), "there is no such joint; choose from")
        if kinds[name] not in LAWS["torque"]:
            raise InputError(
                field_name, name, f"a {kinds[name]} joint has no single coordinate; it is for revolute, prismatic"
            )
    servos: dict[str, str] = {}
    for item in actuators:
        if item.kind == "torque":
            continue
        if rival := servos.get(item.joint):
            advice = (
                f"{rival} and {item.name} hold targets of the same joint and fight; make one of them, with kp and kd"
            )
            raise InputError(f"actuators.{item.name}.joint", item.joint, advice)
        servos[item.joint] = item.name
    columns = {name: number for number, name in enumerate(kinds)}
    rows = np.zeros((len(couplings), len(kinds)))
    for number, coupling in enumerate(couplings):
        for name, factor in coupling.terms:
            rows[number, columns[name]] = factor
        some = rows[: number + 1] / np.linalg.norm(rows[: number + 1], axis=1, keepdims=True)
        if np.linalg.matrix_rank(some, tol=_DEPENDENT) <= number:
            advice = "the couplings form a ring, so that one follows from the others; remove it"
            raise InputError(f"couplings.{coupling.name}", coupling.between, advice)
