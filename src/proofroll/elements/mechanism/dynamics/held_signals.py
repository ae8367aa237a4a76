"""Held signals of a mechanism: their values at the instants of one run, from tables, formulas or a policy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Sample
from proofroll.core.errors import Diverged, InputError
from proofroll.elements.mechanism.dynamics.kinematics import Tree
from proofroll.elements.mechanism.dynamics.placed import TURN, Placed
from proofroll.elements.mechanism.scene.checks import WORLD
from proofroll.elements.mechanism.scene.control import EFFORT, constant
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.policy import Observation
from proofroll.elements.mechanism.scene.rotations import to_quaternion
from proofroll.elements.mechanism.scene.signal import Held, Table, is_held, value_at

if TYPE_CHECKING:
    import xarray as xr

# Distance from an instant, relative to the time and to a natural microsecond, up to which a time is that instant.
_SAME = 1e-9
_STARTS = 1e-3  # s


def has_held(mechanism: Mechanism) -> bool:
    """True if values are held between instants."""
    return mechanism.control is not None or any(map(is_held, mechanism.signals))


def same_instant(time: float, rival: float) -> bool:
    """True if two times [s] are one, to the round-off of their computation; no time is inf, which comes never."""
    return math.isclose(time, rival, rel_tol=_SAME, abs_tol=_SAME * _STARTS)


def with_values(mechanism: Mechanism, values: Sequence[Any]) -> Mechanism:
    """Mechanism without a controller whose held signals are numbers, or what holds them.

    ``values``: of the controller's actuators, then of each further held target and drive, as :meth:`Commands.values`.
    """
    remaining = iter(values)
    control = mechanism.control
    controlled = {} if control is None else {name: next(remaining) for name in control.actuators}
    effort = control is not None and control.held == EFFORT
    actuators = []
    for item in mechanism.actuators:
        if item.name in controlled:
            value = controlled[item.name]
            actuators.append(constant(item, value) if effort else replace(item, target=value))
        else:
            actuators.append(replace(item, target=next(remaining)) if is_held(item.target) else item)
    joints = tuple(
        replace(joint, torque=next(remaining)) if is_held(joint.torque) else joint for joint in mechanism.joints
    )
    values_of_forces = [
        {"value": tuple(next(remaining) if is_held(part) else part for part in force.value)}
        for force in mechanism.forces
    ]
    forces = tuple(replace(old, **new) for old, new in zip(mechanism.forces, values_of_forces, strict=True))  # type: ignore[arg-type]  # held values answer as signals do
    return replace(mechanism, actuators=tuple(actuators), joints=joints, forces=forces, control=None)


def values_of(mechanism: Mechanism, filled: Mechanism) -> list[Any]:
    """Values that a mechanism got by :func:`with_values`, in their order."""
    targets = {item.name: item.target for item in filled.actuators}
    names = () if mechanism.control is None else mechanism.control.actuators
    held = [item.name for item in mechanism.actuators if item.name not in names and is_held(item.target)]
    drives = [(old.torque, new.torque) for old, new in zip(mechanism.joints, filled.joints, strict=True)]
    for old, new in zip(mechanism.forces, filled.forces, strict=True):
        drives += zip(old.value, new.value, strict=True)
    return [targets[name] for name in (*names, *held)] + [value for signal, value in drives if is_held(signal)]


def count_of(mechanism: Mechanism) -> int:
    """Number of held values."""
    control = mechanism.control
    names = () if control is None else control.actuators
    tables = [item.target for item in mechanism.actuators if item.name not in names]
    tables += [joint.torque for joint in mechanism.joints]
    tables += [part for force in mechanism.forces for part in force.value]
    return len(names) + sum(map(is_held, tables))


def celled(mechanism: Mechanism) -> Mechanism:
    """Mechanism whose held signals :func:`drive` sets; without any, the mechanism itself."""
    cells = () if mechanism.cells else tuple(Held() for _ in range(count_of(mechanism)))
    return replace(with_values(mechanism, cells), cells=cells) if cells else mechanism


def begun(mechanism: Mechanism) -> Mechanism:
    """Mechanism of :func:`celled` with the values of time 0, as an engine needs it to build a consistent start."""
    cells = celled(mechanism)
    if cells is not mechanism:
        drive(cells, _first(mechanism))
    return cells


def _first(mechanism: Mechanism) -> list[float]:
    """Held values at time 0."""
    values: list[float] = Commands(mechanism).values(0.0, placed_start(mechanism)).tolist()
    return values


def check_commands(mechanism: Mechanism) -> None:
    """Raises InputError if a policy fails at the start, or does not answer one observation always alike."""
    control = mechanism.control
    if control is None or control.policy is None:
        return
    try:
        answer, repeated = (_first(mechanism) for _ in range(2))
    except Diverged as error:
        raise InputError("policy.call", control.policy.name, str(error)) from None
    if answer != repeated:
        advice = (
            "two of them, newly made, answer one observation differently; every engine and both routes of the truth "
            "have to meet the same policy: fix its random numbers, and clear its memory in make or reset"
        )
        raise InputError("policy.call", control.policy.name, advice)


def along(mechanism: Mechanism, run: xr.Dataset | None) -> Mechanism | None:
    """Mechanism whose controller is replaced by the tables of what it set in a run.

    None: the policy needs the state at an instant at which the run has no sample. Without a run: the values of time 0.
    """
    control = mechanism.control
    if control is None:
        return mechanism
    if run is None:
        return at_start(mechanism)
    commands, sampled = Commands(mechanism), run["time"].to_numpy()
    states = {name: run[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB", "q_WB")}
    times, values = [0.0], list[FloatArray]()
    while (t := commands.next_instant(times[-1])) <= sampled[-1] or same_instant(t, float(sampled[-1])):
        times.append(t)
    for t in times:
        nearest = int(np.argmin(np.abs(sampled - t)))
        if commands.looks and not same_instant(t, float(sampled[nearest])):
            return None
        sample = Sample(**{name: array[nearest] for name, array in states.items()})
        values.append(commands.values(t, sample)[: len(control.actuators)])
    tables = [Table(tuple(times), tuple(column), hold=True) for column in np.array(values).T.tolist()]
    return with_values(mechanism, [*tables, *commands.tables])


def drive(mechanism: Mechanism, values: Iterable[float]) -> None:
    """Sets the held values of a mechanism from :func:`celled`, in the order of :meth:`Commands.values`."""
    for cell, value in zip(mechanism.cells, values, strict=True):
        cell.value = float(value)


def placed_start(mechanism: Mechanism) -> Placed:
    """Motion of a mechanism at time 0."""
    motion = Tree(mechanism).at(*mechanism.start())
    quaternions = to_quaternion(motion.R_WB[:-1])
    state = (motion.p_WB[:-1], motion.v_WB[:-1], motion.w_WB[:-1], quaternions)
    return Placed(mechanism, np.zeros(1), *(part[None] for part in state))


def at_start(mechanism: Mechanism) -> Mechanism:
    """Mechanism whose held signals are the numbers that they are at time 0; cells that :func:`drive` sets stay."""
    if mechanism.cells or not has_held(mechanism):
        return mechanism
    return with_values(mechanism, _first(mechanism))


class Commands:
    """Values of all held signals at the instants of one run; the policy, if there is one, is made for this run.

    See :class:`proofroll.core.element_abilities.HeldValues`.

    Attributes:
        tables: held signals that are tables, targets first.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism, self._control = mechanism, mechanism.control
        control = self._control
        names = () if control is None else control.actuators
        by_name = {item.name: item for item in mechanism.actuators}
        self._actuators = [by_name[name] for name in names]
        self._joints = [mechanism.joints[mechanism.joint_index[item.joint]] for item in self._actuators]
        others = [item.target for item in mechanism.actuators if item.name not in names and is_held(item.target)]
        others += [joint.torque for joint in mechanism.joints if is_held(joint.torque)]
        others += [part for force in mechanism.forces for part in force.value if is_held(part)]
        self.tables = [table for table in others if isinstance(table, Table)]
        self._times = sorted({time for table in self.tables for time in table.times})
        self._base = next((joint.child for joint in mechanism.joints if joint.kind == JointKind.FREE), WORLD)
        gravity = np.array(mechanism.gravity)
        size = float(np.linalg.norm(gravity))
        self._down = gravity / size if size else gravity
        self._answer: Callable[[Observation], FloatArray] | None = None
        if control is not None:
            if control.policy is not None:
                self._answer = control.policy.made([joint.name for joint in self._joints])
            self._waiting = [np.array(control.pose)] * control.delay
            self._last, self._next = np.zeros(len(names)), 0
            self._held = np.array(control.pose)
            self._turned = np.array([joint.q0[0] for joint in self._joints])
            self._seen = 0.0

    @property
    def looks(self) -> bool:
        """True if its values depend on the state."""
        return self._control is not None and (self._answer is not None or self._control.held == EFFORT)

    def next_instant(self, t: float) -> float:
        """First instant after a time [s]; inf: there is none."""
        times = [time for time in self._times if time > t and not same_instant(time, t)][:1]
        if self._control is not None:
            k = math.floor(t * self._control.rate * (1 - _SAME))
            times.append(
                next(
                    instant
                    for n in range(4)
                    if (instant := self._control.instant(k + n)) > t and not same_instant(instant, t)
                )
            )
        return min(times, default=math.inf)

    def instants(self, until: float) -> list[float]:
        """All instants after 0 and before a time [s]."""
        times, t = list[float](), 0.0
        while (t := self.next_instant(t)) < until and not same_instant(t, until):
            times.append(t)
        return times

    def values(self, t: float, sample: Any) -> FloatArray:
        """Values from the instant ``t`` [s] on; to be called at every instant in turn, 0 among them.

        Args:
            t: the instant.
            sample: state of the bodies then, see :class:`~proofroll.elements.mechanism.run.sampling.MechanismSample`.

        Raises:
            Diverged: the policy's action is not finite.
            InputError: the policy fails.
        """
        control = self._control
        # a time of a table is the given one but for round-off
        on = [next((time for time in table.times if same_instant(t, time)), t) for table in self.tables]
        tables = [float(value_at(table, at)) for table, at in zip(self.tables, on, strict=True)]
        if control is None:
            return np.array(tables)
        if same_instant(t, control.instant(self._next)):
            self._held = self._commanded(control.instant(self._next), sample)
            self._next += 1
        return np.concatenate([self._held, tables])

    def _commanded(self, t: float, sample: Any) -> FloatArray:
        """Targets, or efforts, that a controller sets at its instant."""
        control = self._control
        assert control is not None  # the caller has it
        q, v, state = self._seen_at(t, sample)
        if self._answer is None:
            targets = np.array([float(value_at(item.target, t)) for item in self._actuators])
        else:
            action = self._answer(self._observed(t, q, v, state))
            if not np.isfinite(action).all():
                raise Diverged(f"the policy's action is not finite at t = {t:.6g} s")
            self._last = action
            gears = np.array([item.gear for item in self._actuators])
            targets = gears * (np.array(control.pose) + control.scale * action)
        self._waiting.append(targets)
        acting = self._waiting.pop(0)
        if control.held != EFFORT:
            return acting
        pairs = zip(self._actuators, acting.tolist(), q.tolist(), v.tolist(), strict=True)
        return np.array([replace(item, target=target).effort(t, place, rate) for item, target, place, rate in pairs])

    def _seen_at(self, t: float, sample: Any) -> tuple[FloatArray, FloatArray, Placed]:
        """Coordinates and rates of the driven joints, angles with their whole turns, and the state of all bodies."""
        count = len(self._mechanism.bodies)
        shapes = {"p_WB": 3, "v_WB": 3, "w_WB": 3, "q_WB": 4}
        arrays = (np.reshape(getattr(sample, name), (1, count, width)) for name, width in shapes.items())
        placed = Placed(self._mechanism, np.array([t]), *(np.array(array, dtype=np.float64) for array in arrays))
        pairs = [placed.along(joint) for joint in self._joints]
        q, v = (np.array([float(pair[part][0, 0]) for pair in pairs]) for part in (0, 1))
        expected = self._turned + v * (t - self._seen)
        turns = np.array([TURN if joint.kind == JointKind.REVOLUTE else np.inf for joint in self._joints])
        q = np.where(np.isfinite(turns), q + TURN * np.round((expected - q) / TURN), q)
        self._turned, self._seen = q, t
        return q, v, placed

    def _observed(self, t: float, q: FloatArray, v: FloatArray, placed: Placed) -> Observation:
        index = self._mechanism.body_index[self._base]
        rest = np.zeros(3)
        R = placed.R_WB[0, index].copy()
        p, velocity, spin = (
            rest if index < 0 else np.array(array[0, index]) for array in (placed.p_WB, placed.v_WB, placed.w_WB)
        )
        return Observation(
            time=t,
            q=q.copy(),
            v=v.copy(),
            p_WB=p,
            R_WB=R,
            v_WB_W=velocity,
            w_WB_B=R.T @ spin,
            gravity_B=R.T @ self._down,
            last=self._last.copy(),
        )
