"""Dry friction, stops and effort limits: modes, their ends, and transitions.

A held joint is locked: one more constraint row, whose multiplier is the holding force. Which of the joints at rest are
held follows from a quadratic program with bounds. Decisions and impacts are implemented here independently of
:mod:`proofroll.elements.mechanism.contact.tree_contacts`, which the truth uses: neither can hide an error of the
other.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import NotUnique, Refused
from proofroll.core.events import Event, EventKind
from proofroll.core.integrators import Integrator
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.dynamics.analysis import NO_RESPONSE
from proofroll.elements.mechanism.dynamics.named_forces import joint_force_shares
from proofroll.elements.mechanism.dynamics.switches import (
    HOLDING,
    REDUNDANT,
    STOPPED,
    Mode,
    changes,
    held_joints,
    switched_joints,
)
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import breaks
from proofroll.engines.projection.contact.alternating import AlternatingMotion, Excess, ends_of_efforts
from proofroll.engines.projection.smooth.dependent import DependentCoordinates, SolvedState
from proofroll.engines.projection.smooth.elimination import without_rows

_ROUND_OFF = 1e-12  # of accelerations, relative to the largest of their kinetic energy
_DEPENDENT = 1e-12  # Smallest over largest response below which joints hold one degree of freedom together.


class SwitchedMotion(AlternatingMotion[Mode]):
    """Motion of a mechanism with dry friction or stops in joints, effort limits, or drives with breaks.

    Attributes:
        mode: of each switched joint, then of each effort with a limit.
    """

    alternates = "friction, stops and limits of efforts"

    def __init__(
        self,
        equations: DependentCoordinates,
        mechanism: Mechanism,
        stepper: Integrator,
        accept: Callable[[float, Array, Sequence[int]], Array],
    ) -> None:
        super().__init__(equations, stepper, lambda t, x: accept(t, x, self._held), breaks(mechanism.signals))
        self._joints = switched_joints(mechanism)
        self._limited = {k: item for k, item in enumerate(mechanism.actuators) if item.limit is not None}
        scale = natural_scale(mechanism)
        slides = [mechanism.joints[joint.number].kind == JointKind.PRISMATIC for joint in self._joints]
        self._units = [scale.rate * (scale.length if slide else 1.0) for slide in slides]  # natural speeds
        self.mode: Mode = ("free",) * len(self._joints)
        start = np.append(equations.start, 0.0)
        q, v = self._joint_state(start)
        for k, joint in enumerate(self._joints):  # a start at a stop is accurate to the digits of a file
            q[k] = np.clip(q[k], joint.low, joint.high)
        self._enter(0.0, start, self._decided(start, q, v))

    def renew(self) -> None:
        """Decides the mode anew, now, after forces have jumped."""
        y, old_mode = self._stepper.x, self.mode
        q, v = self._joint_state(y)
        mode, count, t = self._decided(y, q, v), len(self._joints), self.t
        happened = [*changes(self._joints, old_mode, mode)]
        pairs = zip(self._limited.values(), old_mode[count:], mode[count:], strict=True)
        happened += [
            (EventKind.RELEASE if new == "linear" else EventKind.SATURATE, item.name)
            for item, old, new in pairs
            if new != old
        ]
        self.events += [
            Event(kind=kind, time=t, time_low=t, time_high=t, name=name) for kind, name in happened if t > 0
        ]
        self._enter(t, y, mode)

    def solve(self, y: Array | None = None) -> SolvedState:
        """Equations of motion solved in the present mode, now or at a state with its time."""
        x = self._at(self._stepper.x if y is None else y)
        return self._equations.solve(x, self._load(self.mode), held=self._held)

    def along_joints(self, count: int) -> dict[str, Array]:
        """Forces of dry friction and of stops along the coordinates of all joints, N or N m."""
        forces = self._holding(self.solve())
        by_law = {"friction": np.full(count, np.nan), "stop": np.full(count, np.nan)}
        for k, joint in enumerate(self._joints):
            side = self.mode[k]
            on = joint_force_shares(side in STOPPED, joint.friction, forces.get(k, joint.push(side)))
            by_law["friction"][joint.number], by_law["stop"][joint.number] = on
        return by_law

    def _holding(self, solved: SolvedState) -> dict[int, float]:
        """Holding forces of joints, by their indices among the switched ones."""
        return dict(zip(held_joints(self.mode), solved.multipliers[self._equations.coupled :].tolist(), strict=True))

    def _load(self, mode: Mode) -> Array:
        """Kinetic friction along the velocities ν."""
        load = np.zeros(self._equations.nv)
        for joint, side in zip(self._joints, mode[: len(self._joints)], strict=True):
            load[joint.velocity] = joint.push(side)
        return load

    def _enter(self, t: float, y: Array, mode: Mode) -> None:
        self._held = [self._joints[number].velocity for number in held_joints(mode)]
        self._push = self._load(mode)
        self._equations.applied.modes = dict(zip(self._limited, mode[len(self._joints) :], strict=True))
        super()._enter(t, y, mode)

    def _rates(self, y: Array) -> Array:
        return np.append(self._equations.rates(self._at(y), self._push, self._held), 1.0)

    def _joint_state(self, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of the switched joints, exact where held."""
        q, v = np.zeros((2, len(self._joints)))
        watched = self._equations.watched(self._at(y))
        for k, joint in enumerate(self._joints):
            place, rate = watched[joint.number]
            q[k] = {"low": joint.low, "high": joint.high}.get(self.mode[k], place)
            v[k] = 0.0 if self.mode[k] in HOLDING else rate
        return q, v

    def _decided(self, y: Array, q: Array, v: Array) -> Mode:
        """Mode that follows from the forces: a joint at rest is held if the force it needs is within bounds.

        All joints are decided at once, as they are coupled.
        """
        x, equations = self._at(y), self._equations
        equations.applied.modes = {}
        limited = zip(self._limited.values(), equations.wanted(x), strict=True)
        efforts = [actuator.mode_of(effort) for actuator, effort in limited]
        mode = [
            joint.moving(rate) if rate else joint.resting(place)
            for joint, place, rate in zip(self._joints, q.tolist(), v.tolist(), strict=True)
        ]
        resting = self._moved_on(x, mode)
        if resting:
            moving = tuple("free" if k in resting else joint_mode for k, joint_mode in enumerate(mode))
            velocities = [self._joints[k].velocity for k in resting]
            free, response = equations.responses(x, self._load(moving), velocities)
            low, high = np.array([self._joints[k].bounds(mode[k]) for k in resting]).T
            for k, side in zip(resting, _bounded(free[velocities], response[velocities], low, high)[1], strict=True):
                if side:
                    mode[k] = self._joints[k].moving(-side)
        return (*mode, *efforts)

    def _moved_on(self, x: Array, mode: list[str]) -> list[int]:
        """Joints at rest that forces may hold; one that loops or motions alone move on slides in ``mode`` from now on.

        Raises:
            Refused: one stands because of these, so that the force of its friction is any within its bound.
        """
        resting = held_joints(tuple(mode))
        if not resting:
            return resting
        moving = tuple("free" if k in resting else joint_mode for k, joint_mode in enumerate(mode))
        velocities = [self._joints[k].velocity for k in resting]
        load = self._load(moving)
        rates, split = self._equations.solve(x, load).rates, self._equations.split
        if split is None:
            return resting
        least = _ROUND_OFF * (split.reach(rates) + split.reach(self._equations.solve(x, load, without_rows).rates))
        for k, column, mobility in zip(resting, velocities, split.mobility()[velocities].tolist(), strict=True):
            if mobility > NO_RESPONSE:
                continue
            if abs(rates[column]) <= least[column]:
                raise Refused(REDUNDANT)
            mode[k] = self._joints[k].moving(rates[column])
        return held_joints(tuple(mode))

    def _struck(self, y: Array, q: Array, v: Array, hit: int) -> Array:
        """Change of all velocities ν by an impact of a joint on its stop, by Newton's law; updates ``v``.

        Other joints that rest at a stop are pressed on or leave; friction gives no impulse.

        Raises:
            NotUnique: the outcome depends on the order of several impacts.
        """
        rests = [k for k, joint in enumerate(self._joints) if not v[k] and joint.stop_at(q[k])]
        at_stop = sorted({hit, *rests})
        velocities = [self._joints[k].velocity for k in at_stop]
        _, response = self._equations.responses(self._at(y), np.zeros(self._equations.nv), velocities)
        elastic = np.array([self._joints[k].restitution for k in at_stop])
        below = np.array([self._joints[k].stop_at(q[k]) == "low" for k in at_stop])
        low, high = np.where(below, 0.0, -np.inf), np.where(below, np.inf, 0.0)
        impulse, side = _bounded((1 + elastic) * v[at_stop], response[velocities], low, high)
        if np.count_nonzero(impulse) > 1 and elastic.any():
            raise NotUnique(
                "an impact presses several stops at once: with restitution its outcome depends on their order"
            )
        change = np.asarray(response @ impulse)
        v += change[[joint.velocity for joint in self._joints]]
        for k, free, e in zip(at_stop, side, elastic, strict=True):
            if not free and not e:
                v[k] = 0.0
        return change

    def _excess(self, y: Array) -> list[Excess]:
        """Excess of each mode over each of its ends.

        ``up``, ``down``: the holding force exceeds its bound, and the joint moves in this direction; ``still``: a joint
        that moves against friction has turned; ``low``, ``high``: a joint is beyond a stop; ``least``, ``greatest``: an
        effort exceeds its limit; ``linear``: it is within its limits again.
        """
        q, v = self._joint_state(y)
        forces = self._holding(self.solve(y)) if self._held else {}
        ends = list[Excess]()
        for k, joint in enumerate(self._joints):
            side, place, rate = self.mode[k], float(q[k]), float(v[k])
            if k in forces:
                low, high = joint.bounds(side)
                ends += [Excess(k, "up", low - forces[k]), Excess(k, "down", forces[k] - high)]
                continue
            if side != "free":
                ends.append(Excess(k, "still", -rate if side == "forward" else rate))
            ends += [Excess(k, "low", joint.low - place, -rate), Excess(k, "high", place - joint.high, rate)]
        count, efforts = len(self._joints), self._equations.wanted(self._at(y))
        return ends + ends_of_efforts(self._limited.values(), self.mode[count:], efforts, count)

    def _next(self, y: Array, k: int, kind: str) -> tuple[Array, Mode, list[tuple[str, str]]]:
        old_mode, happened = self.mode, list[tuple[str, str]]()
        if k >= len(self._joints):
            actuator = list(self._limited.values())[k - len(self._joints)]
            happened = [(EventKind.RELEASE if kind == "linear" else EventKind.SATURATE, actuator.name)]
            mode = (*old_mode[:k], kind, *old_mode[k + 1 :])
        elif kind in {"up", "down"}:
            mode = (*old_mode[:k], self._joints[k].moving(1.0 if kind == "up" else -1.0), *old_mode[k + 1 :])
        else:
            y, mode = self._stopped(y, k, kind)
            happened = [(EventKind.IMPACT, self._joints[k].name)] if kind != "still" else []
        # a joint that stays where it hit has come to rest by its impact
        named = {name for _, name in happened}
        happened += [item for item in changes(self._joints, old_mode, mode) if item[1] not in named]
        return y, mode, happened

    def _stopped(self, y: Array, k: int, kind: str) -> tuple[Array, Mode]:
        """State and mode after a joint has turned (``still``) or hit a stop."""
        joint, (q, v) = self._joints[k], self._joint_state(y)
        column, change = joint.velocity, np.zeros(self._equations.nv)
        speed = float(v[k])
        if kind == "still":
            v[k], change[column] = 0.0, -speed
        else:
            q[k] = joint.low if kind == "low" else joint.high
            change = self._struck(y, q, v, k)
            if self._settles(k, abs(speed) / self._units[k], joint.restitution):
                v[k], change[column] = 0.0, -speed
        y = np.append(self._equations.pushed(self._at(y), change), y[-1])
        return y, self._decided(y, q, v)


def _bounded(free: Array, G: Array, low: Array, high: Array) -> tuple[Array, NDArray[np.int_]]:
    """Forces f within bounds that minimise ½ f·G f + free·f, so free + G f is zero unless f is at a bound.

    Returns:
        Forces, and for each -1, 0 or 1: at its lower bound, between, at its upper bound.

    Raises:
        Refused: G is singular.
    """
    from scipy.optimize import lsq_linear

    sizes = np.linalg.eigvalsh(G)
    if sizes[0] <= _DEPENDENT * sizes[-1]:
        raise Refused(REDUNDANT)
    L = np.linalg.cholesky(G)
    least = lsq_linear(L.T, -np.linalg.solve(L, free), (low, high), method="bvls", tol=np.finfo(float).tiny)
    return np.asarray(least.x), np.asarray(least.active_mask)
