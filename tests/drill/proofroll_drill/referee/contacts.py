"""Event-driven motion of bodies that touch, in long doubles; only data of geometries and pairs is read.

Slips are followed in a variable that stretches time near their end: its rate is the sum of √(u² + U²)/u over the slip
speeds u, so that no slip speed passes zero within a step, and several that end at once do so exponentially.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from .contact_decisions import STILL, ContactDecisions, UndecidedError, root
from .contact_equations import SLIP, Mode, across, size_of
from .extrapolation import Long, one_step, tight_step
from .linear_algebra import cross, long

_SLOW = 0.05  # m/s, slip speed below which time is stretched
_STOPS = 1e-14  # m/s, slip speed from which the rest of a slip is a straight line
_STUCK = 1e-12  # m/s, slip speed that counts as none at an event
_TOUCHES = 1e-9  # m and m/s: gap, and speed along the normal, that count as none at the start
_TIGHT = 1e-16  # of each step
_LONGEST = 0.1  # of one step, so that no gap closes and opens within
_MOST_BOUNCES, _FAINT = 12, 1e-3  # impacts, and m/s of an impact with restitution, at which the account ends


@dataclass
class Told:
    """Account of the referee.

    Attributes:
        seen: state, contact forces and joints' wrenches at each time until the end of the account.
        events: kind, name and time [s].
        end: of the account [s].
        why: reason of an early end.
    """

    seen: list[dict[str, Any]] = field(default_factory=list)
    events: list[tuple[str, str, Any]] = field(default_factory=list)
    end: float = 0.0
    why: str = ""


class ContactReferee(ContactDecisions):
    """One mechanism with contacts of bodies, from its start on."""

    def follow(self, times: Sequence[float]) -> Told:
        """The account at growing times [s]."""
        told, left = Told(), list(times)
        y = self.start()
        touch = self.touching(y)
        closed = [bool(abs(t.gap) < _TOUCHES and abs(t.normal @ t.slide) < _TOUCHES) for t in touch]
        self._clamped_anew(y)
        try:
            modes = self.decided(y, closed, [bool(size_of(t.slip) < _TOUCHES) for t in touch])
            while left:
                if self._rests(y, modes):
                    while left:
                        self._look(told, y, modes, left.pop(0))
                    break
                y, modes = self._begun(y, modes), [SLIP if mode.kind == "slip" else mode for mode in modes]
                y, modes = self._until_event(told, y, modes, left)
        except (UndecidedError, ArithmeticError) as reason:
            told.why = str(reason)
        return told

    def _until_event(self, told: Told, y: Long, modes: list[Mode], left: list[float]) -> tuple[Long, list[Mode]]:
        """State and modes after the next event, or at the last time to look."""
        rate, step = self._stretched(modes), np.longdouble(0.005)
        slips = self._slips(modes)
        while left:
            guards = self._guards(modes, long(left[0]))
            most = 1 if SLIP in modes else min(np.longdouble(_LONGEST), max(left[0] - y[-1], np.longdouble(1e-9)))
            moved, length, step = tight_step(rate, y, min(step, np.longdouble(_LONGEST)), most, _TIGHT)
            passed = _passed(guards, rate, y, moved, length)
            if passed:
                length, which = min(passed)
                y = one_step(rate, y, length)[0]
                if which:
                    return self._changed(told, y, modes, *self._meaning(modes)[which - 1])
                y[-1] = left[0]
                self._look(told, y, modes, left.pop(0))
                continue
            y, touch = moved, self.touching(moved)
            if slips and min(size_of(touch[k].slip) for k in slips) < _STOPS:
                return self._stopped(told, y, modes)
        return y, modes

    def _slips(self, modes: list[Mode]) -> list[int]:
        return [k for k, mode in enumerate(modes) if mode.kind == "slip" and self.pairs[k].friction > 0]

    def _meaning(self, modes: list[Mode]) -> list[tuple[int, str]]:
        """Contact and kind of each guard."""
        kinds = {"open": ["close"], "slip": ["lift"], "stick": ["lift", "break"]}
        found = [(k, kind) for k, mode in enumerate(modes) for kind in kinds[mode.kind]]
        for k, motor in enumerate(self.mechanism.actuators):
            if motor.limit is not None:
                found += [(k, "release")] if self.clamped.get(motor.name) else [(k, "above"), (k, "below")]
        return found

    def _guards(self, modes: list[Mode], aim: Any) -> Callable[[Long], list[Any]]:
        """Values that are positive while the modes last, and the time to look first."""

        def values(y: Long) -> list[Any]:
            touch, found, room = self.touching(y), [aim - y[-1]], self._room(y)
            forces = self.accelerated(y, modes).force
            for k, kind in self._meaning(modes):
                if kind in {"above", "below", "release"}:
                    found.append(room[self.mechanism.actuators[k].name, kind])
                    continue
                n = touch[k].normal
                N = n @ forces[k]
                if kind == "break":
                    found.append(self.pairs[k].friction * N - size_of(forces[k] - N * n))
                else:
                    found.append(touch[k].gap if kind == "close" else N)
            return found

        return values

    def _room(self, y: Long) -> dict[tuple[str, str], Any]:
        """Distance of each limited effort from a change of its law, by actuator and change."""
        found = dict[tuple[str, str], Any]()
        joints = {joint.name: (q, rate) for q, rate, joint in self._coordinates(*self._parts(y))}
        for motor in self.mechanism.actuators:
            if motor.limit is not None:
                effort, bound = self.wanted(motor, y[-1], *joints[motor.joint]), long(motor.limit)
                beyond = self.clamped.get(motor.name, 0) * effort - bound
                found |= {(motor.name, kind): value for kind, value in
                          (("above", bound - effort), ("below", bound + effort), ("release", beyond))}  # fmt: skip
        return found

    def _clamped_anew(self, y: Long) -> None:
        """Clamps efforts beyond their limits, after a change of velocities."""
        self.clamped = {}
        signs = {"above": 1, "below": -1}
        self.clamped = {name: signs[kind] for (name, kind), room in self._room(y).items() if kind in signs and room < 0}

    def _stretched(self, modes: list[Mode]) -> Callable[[Long], Long]:
        slips = self._slips(modes)

        def rate(y: Long) -> Long:
            touch, wait = self.touching(y), np.longdouble(not slips)
            for k in slips:
                u = size_of(touch[k].slip)
                wait += np.sqrt(u * u + _SLOW**2) / u
            return self._in_time(y, modes) / wait

        return rate

    def _in_time(self, y: Long, modes: list[Mode]) -> Long:
        """Rate of a state and its time."""
        found = self.accelerated(y, modes)
        return self.rate(y, found.linear, found.angular)

    def _begun(self, y: Long, modes: list[Mode]) -> Long:
        """State shortly after slips from rest began, when they have a speed."""
        touch, wait = self.touching(y), np.longdouble(0)
        for k, mode in enumerate(modes):
            if mode.kind == "slip" and mode.heading is not None and size_of(touch[k].slip) < 2 * _STOPS:
                slide = self.accelerated(y, modes).slide[k]
                wait = max(wait, 4 * _STOPS / size_of(across(slide, touch[k].normal)))
        return y + wait * self._in_time(y, modes) if wait else y

    def _stopped(self, told: Told, y: Long, modes: list[Mode]) -> tuple[Long, list[Mode]]:
        """State and modes at the end of the slowest slip."""
        touch, found = self.touching(y), self.accelerated(y, modes)
        k = min(self._slips(modes), key=lambda k: size_of(touch[k].slip))
        y = y + size_of(touch[k].slip) / size_of(across(found.slide[k], touch[k].normal)) * self._in_time(y, modes)
        after = self.decided(y, [mode.kind != "open" for mode in modes], self._still(y, modes))
        self._happened(told, y, modes, after)
        return y, after

    def _still(self, y: Long, modes: list[Mode]) -> list[bool]:
        """True for each contact that does not slip."""
        return [mode.kind == "stick" or (mode.kind == "slip" and bool(size_of(t.slip) < _STUCK))
                for t, mode in zip(self.touching(y), modes, strict=True)]  # fmt: skip

    def _changed(self, told: Told, y: Long, modes: list[Mode], k: int, kind: str) -> tuple[Long, list[Mode]]:
        """State and modes after a contact closes, lifts off or breaks loose, or an effort meets or leaves its limit."""
        if kind == "close":
            return self._struck(told, y, modes, k)
        if kind in {"above", "below", "release"}:
            motor = self.mechanism.actuators[k].name
            self.clamped[motor] = {"above": 1, "below": -1, "release": 0}[kind]
            return y, modes
        closed = [mode.kind != "open" and not (kind == "lift" and i == k) for i, mode in enumerate(modes)]
        after = self.decided(y, closed, self._still(y, modes))
        self._happened(told, y, modes, after)
        return y, after

    def _struck(self, told: Told, y: Long, modes: list[Mode], k: int) -> tuple[Long, list[Mode]]:
        """State and modes after an impact."""
        touch = self.touching(y)
        speeds = [t.normal @ t.slide for t in touch]
        if any(mode.kind == "open" and i != k and speeds[i] < 0 and touch[i].gap <= -speeds[i] * 1e-9
               for i, mode in enumerate(modes)):  # fmt: skip
            raise UndecidedError("several impacts at once")
        if self.pairs[k].restitution and -speeds[k] < _FAINT:
            raise UndecidedError("a faint rebound")
        if sum(event == "impact" for event, *_ in told.events) == _MOST_BOUNCES:
            raise UndecidedError("many impacts")
        closed = [mode.kind != "open" or i == k for i, mode in enumerate(modes)]
        aims = [np.zeros(3, np.longdouble) for _ in modes]
        aims[k][0] = -self.pairs[k].restitution * min(speeds[k], long(0))
        found, _ = self.tried(y, closed, [True] * len(modes), aims)
        y, n = y.copy(), self.n
        y[7 * n : 10 * n], y[10 * n : 13 * n] = found.linear.ravel(), found.angular.ravel()
        self._clamped_anew(y)
        now = self.touching(y)
        stays = [shut and bool(t.normal @ t.slide < 1e-11) for t, shut in zip(now, closed, strict=True)]
        still = [stay and bool(size_of(t.slip) < _STUCK) for t, stay in zip(now, stays, strict=True)]
        after = self.decided(y, stays, still)
        told.events.append(("impact", self.pairs[k].name, y[-1]))
        self._happened(told, y, modes, after, but=k)
        return y, after

    def _happened(self, told: Told, y: Long, before: list[Mode], after: list[Mode], but: int = -1) -> None:
        """Appends the events of all contacts but one."""
        for k, (was, now) in enumerate(zip(before, after, strict=True)):
            if now.kind == "stick" and was.kind != "stick":
                kind = "stick"
            elif was.kind == "stick" and now.kind == "slip":
                kind = "slip"
            elif was.kind != "open" and now.kind == "open":
                kind = "lift_off"
            elif was.kind == now.kind == "slip" and now.heading is not None:
                kind = "turn"
            else:
                continue
            if k != but:
                told.events.append((kind, self.pairs[k].name, y[-1]))

    def _rests(self, y: Long, modes: list[Mode]) -> bool:
        n = self.n
        driven = bool(self.mechanism.actuators)
        if driven or any(mode.kind == "slip" for mode in modes) or np.abs(y[7 * n : 13 * n]).max() > STILL:
            return False
        found = self.accelerated(y, modes)
        return bool(max(np.abs(found.linear).max(), np.abs(found.angular).max()) < 1e-10)

    def _look(self, told: Told, y: Long, modes: list[Mode], time: float) -> None:
        n = self.n
        r, R, v, w, _ = self._parts(y)
        arms = np.einsum("nij,nj->ni", R, self._com)
        found = self.accelerated(y, modes)
        wrench = self.wrenches(y, self.system(y), found.multipliers)
        placed = {"p_WB": (r - arms)[:n], "v_WB": (v - cross(w, arms))[:n], "w_WB": w[:n], "R_WB": R[:n]}
        told.seen.append({**placed, "pressed": found.force, "wrench": wrench})
        told.end = float(time)


def _passed(
    guards: Callable[[Long], list[Any]], rate: Callable[[Long], Long], y: Long, moved: Long, length: Any
) -> list[tuple[Any, int]]:
    """Places in a step where guards pass zero, with the number of each guard."""

    def value(k: int, h: Any) -> Any:
        return guards(one_step(rate, y, h)[0])[k]

    none = np.longdouble(0)
    return [
        (root(partial(value, k), none, length, was, now), k)
        for k, (was, now) in enumerate(zip(guards(y), guards(moved), strict=True))
        if now <= 0 < was or (now < 0 and now < was <= 0)
    ]
