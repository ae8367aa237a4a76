"""Dry friction and stops of joints: which holds, when that ends, and what comes next.

A joint that is held is locked: its direction leaves the null space of the constraints, and the force that holds it
follows as a reaction does. Between two switches the equations are smooth; a switch is located within a step by shorter
steps of the same method, so that it is as accurate as these. Modes follow by complementarity from the forces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from proofroll.core.errors import Diverged
from proofroll.core.events import Event
from proofroll.elements.mechanism.named_forces import on_joint
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import (
    HOLDING,
    STOPPED,
    Mode,
    SwitchedJoint,
    changes,
    decided,
    held_by,
    load_of,
    struck,
)
from proofroll.engines.projection.dependent import DependentCoordinates, SolvedState
from proofroll.engines.projection.elimination import Held
from proofroll.engines.projection.stepping import Stepper

# Speed of an impact, over that of the first one of this joint, below which what is left of the rebounds is left out.
SETTLED = 1e-6
# A mode that ends where it started is possible; as many in a row as this are an endless loop.
_WITHOUT_PROGRESS = 20
_ULPS = 4  # of the time, to which switches are located


class SwitchedMotion:
    """Motion of a tree whose joints rub or have stops.

    Attributes:
        t, x: present time [s] and state.
        mode: of each switched joint.
        events: of impacts, sticking and slipping, so far.
    """

    def __init__(
        self,
        equations: DependentCoordinates,
        joints: Sequence[SwitchedJoint],
        stepper: Stepper,
        accept: Callable[[float, Array], Array],
    ) -> None:
        self._equations, self._joints, self._stepper, self._accept = equations, tuple(joints), stepper, accept
        self._fastest: dict[int, float] = {}
        self._idle = 0
        self.events: list[Event] = []
        self.mode: Mode = ("free",) * len(self._joints)
        q, v = self._joint_state(equations.start)
        for joint in self._joints:  # a start at a stop is known to digits of a file
            q[joint.coordinate] = np.clip(q[joint.coordinate], joint.low, joint.high)
        self._enter(0.0, equations.start, self._decided(equations.start, q, v))

    @property
    def t(self) -> float:
        """Present time [s]."""
        return self._stepper.t

    @property
    def x(self) -> Array:
        """State now."""
        return self._stepper.y

    def solve(self, x: Array) -> tuple[SolvedState, Array]:
        """Equations of motion at a state in the present mode, and the forces that hold joints."""
        held = Held(self._held)
        return self._equations.solve(x, self._load(self.mode), held), held.force

    def along_joints(self, count: int) -> dict[str, Array]:
        """Forces of dry friction and of stops along the coordinates of all joints."""
        held = self.solve(self.x)[1]
        forces = dict(zip(held_by(self.mode), held.tolist(), strict=True))
        found = {"friction": np.full(count, np.nan), "stop": np.full(count, np.nan)}
        for k, (joint, own) in enumerate(zip(self._joints, self.mode, strict=True)):
            on = on_joint(own in STOPPED, joint.friction, forces.get(k, joint.push(own)))
            found["friction"][joint.number], found["stop"][joint.number] = on
        return found

    def _load(self, mode: Mode) -> Array:
        return load_of(self._joints, mode, self._equations.nv)

    def advance(self, t: float) -> None:
        """Moves to time t [s].

        Raises:
            Diverged: modes alternate without end, or the integration gave up.
        """
        stepper = self._stepper
        stepper.aim(t)
        while stepper.t < t:
            stepper.step(t, np.inf)
            ends = [self._crossing(k, kind) for k, kind in self._ended(stepper.y)]
            if ends:
                at, k, kind = min(ends)
                self._switch(at, k, kind)
            else:
                self._idle = 0

    def _enter(self, t: float, x: Array, mode: Mode) -> None:
        self.mode = mode
        self._held = [self._joints[number].velocity for number in held_by(mode)]
        rates = partial(self._equations.rates, drives=self._load(mode), closing=Held(self._held))
        self._stepper.begin(t, x, rates, self._accept, np.ones(len(x)))

    def _joint_state(self, x: Array) -> tuple[Array, Array]:
        """Coordinates and velocities of the tree, of switched joints alone, where held exactly."""
        q, v = np.zeros(self._equations.nq), np.zeros(self._equations.nv)
        found = self._equations.watched(x)
        for joint, own, (place, rate) in zip(self._joints, self.mode, found, strict=True):
            q[joint.coordinate] = {"low": joint.low, "high": joint.high}.get(own, place)
            v[joint.velocity] = 0.0 if own in HOLDING else rate
        return q, v

    def _decided(self, x: Array, q: Array, v: Array) -> Mode:
        return decided(self._joints, q, v, partial(self._responses, x))[0]

    def _responses(self, x: Array, mode: Mode, at: Sequence[int]) -> tuple[Array, Array]:
        return self._equations.responses(x, self._load(mode), at)

    def _ended(self, x: Array) -> list[tuple[int, str]]:
        """Joints whose mode has ended at a state, and how."""
        return [(k, kind) for k, kind, excess, closing in self._excess(x) if excess > 0 and closing]

    def _excess(self, x: Array) -> list[tuple[int, str, float, bool]]:
        """Excess of each mode over each of its ends, and whether it moves towards it.

        ``up``, ``down``: the force that holds is beyond its bound, and the joint moves so; ``still``: a joint that
        moves against friction has turned; ``low``, ``high``: it is beyond a stop.
        """
        q, v = self._joint_state(x)
        holding = self.solve(x)[1] if self._held else np.zeros(0)
        forces = dict(zip(held_by(self.mode), holding.tolist(), strict=True))
        found = []
        for k, (joint, own) in enumerate(zip(self._joints, self.mode, strict=True)):
            place, rate = float(q[joint.coordinate]), float(v[joint.velocity])
            if k in forces:
                low, high = joint.bounds(own)
                found += [(k, "up", low - forces[k], True), (k, "down", forces[k] - high, True)]
                continue
            if own != "free":
                found.append((k, "still", -rate if own == "forward" else rate, True))
            found += [(k, "low", joint.low - place, rate < 0), (k, "high", place - joint.high, rate > 0)]
        return found

    def _crossing(self, k: int, kind: str) -> tuple[float, int, str]:
        """Time just after a mode ended within the last step, with that mode's joint and end."""

        def margin(x: Array) -> float:
            return -next(excess for joint, end, excess, _ in self._excess(x) if (joint, end) == (k, kind))

        now = self._stepper.t
        return self._stepper.crossing(margin, now, _ULPS * float(np.spacing(now)))[1], k, kind

    def _switch(self, t: float, k: int, kind: str) -> None:
        stepper, joint = self._stepper, self._joints[k]
        self._idle = self._idle + 1 if t <= stepper.t_before else 0
        if self._idle > _WITHOUT_PROGRESS:
            raise Diverged(f"friction and stops of joints alternate without end at t = {t:.6g} s")
        x = stepper.inside(t)
        (q, v), was, happened = self._joint_state(x), self.mode, list[tuple[str, str]]()
        if kind in {"up", "down"}:
            leaves = joint.moving(1.0 if kind == "up" else -1.0)
            mode = tuple(leaves if number == k else own for number, own in enumerate(was))
        else:
            rates = v.copy()
            if kind == "still":
                v[joint.velocity] = 0.0
            else:
                happened = [("impact", joint.name)]
                q[joint.coordinate] = joint.low if kind == "low" else joint.high
                speed = abs(float(v[joint.velocity]))
                v = struck(self._joints, q, v, k, partial(self._responses, x))[0]
                if speed < SETTLED * self._fastest.setdefault(k, speed):
                    v[joint.velocity] = 0.0
            x = self._equations.pushed(x, v - rates)
            mode = self._decided(x, q, v)
        # a joint that stays where it hit has come to rest by its impact
        happened += [item for item in changes(self._joints, was, mode) if not happened or item[1] != joint.name]
        self.events += [
            Event(each, t, *stepper.bracket(max(stepper.t_before, t - _ULPS * float(np.spacing(t))), t), name)
            for each, name in happened
        ]
        self._enter(t, x, mode)
