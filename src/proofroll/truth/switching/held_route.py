"""Route of the truth under held signals: at each instant its own state gives the values that hold from there on."""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Sample
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.held_signals import (
    Commands,
    celled,
    count_of,
    drive,
    same_instant,
    values_of,
    with_values,
)
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import Table
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, HybridRoute, State, Stretch, Transition

ModeT = TypeVar("ModeT")
# Places, velocities, unit quaternions and angular velocities of the bodies' frames, world axes, (bodies, 3 or 4) each.
BodyStates = tuple[Array, Array, Array, Array]


class JumpingRoute(HybridRoute[ModeT], Protocol):
    """Protocol of a route that decides its mode anew after forces have jumped."""

    @property
    def start(self) -> State:
        """State at time 0."""

    def bodies(self, state: State) -> BodyStates:
        """States of all bodies."""

    def jumped(self, stretch: Stretch[ModeT]) -> Transition[ModeT]:
        """Transition at the end of a stretch, where held values have changed."""


class HeldPath:
    """Held values of a mechanism in natural units along one path.

    Attributes:
        own: mechanism in natural units, whose held signals follow.
    """

    def __init__(self, si: Mechanism, units: Units, mechanism: Mechanism) -> None:
        """Takes the mechanism in SI units, and in natural units."""
        self.own, self._si, self._units = celled(mechanism), si, units
        ones = units.mechanism(with_values(si, [1.0] * count_of(si)))
        self._factors = np.array(values_of(si, ones))
        self._commands, self._times, self._past = Commands(si), list[float](), list[FloatArray]()

    def again(self) -> None:
        """Begins another path."""
        self._commands, self._times, self._past = Commands(self._si), [], []
        self.resume()

    def resume(self) -> None:
        """Lets held signals have their present values again, after :meth:`finish`."""
        for cell in self.own.cells:
            cell.past = None

    def breaks(self, until: float) -> list[float]:
        """Instants after 0 and before a time, in natural units."""
        return [time / self._units.time for time in Commands(self._si).instants(until * self._units.time)]

    def reach(self, time: float, state: Callable[[], BodyStates]) -> bool:
        """Sets the values from ``time`` on; True if that is an instant. ``state``: of all bodies, natural units."""
        if not self.due(time):
            self.recall(time)
            return False
        due = self._next()
        p, v, q, w = state()
        length, second = self._units.length, self._units.time
        sample = Sample(p_WB=p * length, v_WB=v * (length / second), w_WB=w / second, q_WB=q)
        self._times.append(time)
        self._past.append(self._commands.values(due, sample) * self._factors)
        drive(self.own, self._past[-1])
        return True

    def due(self, time: float) -> bool:
        """True if the next instant has come."""
        seconds, due = time * self._units.time, self._next()
        return same_instant(seconds, due) or seconds > due

    def _next(self) -> float:
        return self._commands.next_instant(self._times[-1] * self._units.time) if self._times else 0.0

    def recall(self, time: float) -> None:
        """Sets the values that hold from an earlier time on."""
        drive(self.own, self._past[max(bisect_right(self._times, time) - 1, 0)])

    def finish(self) -> None:
        """Lets held signals answer by the time, after the path is known."""
        for number, cell in enumerate(self.own.cells):
            cell.past = Table(tuple(self._times), tuple(float(values[number]) for values in self._past), hold=True)

    def on_instants(self, times: Array) -> Array:
        """Times in natural units; those that are instants but for round-off are these instants."""
        return np.array(
            [
                next((instant for instant in self._near(time) if same_instant(time, instant)), time)
                for time in times.tolist()
            ]
        )

    def _near(self, time: float) -> list[float]:
        place = bisect_right(self._times, time)
        return self._times[max(place - 1, 0) : place + 1]


class HeldRoute(Generic[ModeT]):
    """Route whose held values change at instants; implements :class:`proofroll.truth.numerics.hybrid.HybridRoute`."""

    def __init__(self, route: JumpingRoute[ModeT], values: HeldPath) -> None:
        self._route, self._values = route, values

    def begin(self) -> Transition[ModeT]:
        """See the protocol."""
        self._values.reach(0.0, lambda: self._route.bodies(self._route.start))
        return self._route.begin()

    def walk(self, time: float, state: State, mode: ModeT, until: float) -> Stretch[ModeT]:
        """See the protocol."""
        self._values.recall(time)
        return self._route.walk(time, state, mode, until)

    def completed(self, path: HybridPath[Stretch[ModeT]]) -> HybridPath[Stretch[ModeT]]:
        """Path that ends after the jump at its last time, if that is an instant."""
        last = path.stretches[-1]
        if not path.known or not self._values.due(last.end):
            return path
        change = self.change(last)
        if change.mode is None:
            return path
        stretch = Stretch(
            start=last.end, end=last.end, mode=change.mode, first=change.state, last=change.state, guard=None
        )
        return replace(path, stretches=(*path.stretches, stretch))

    def change(self, stretch: Stretch[ModeT]) -> Transition[ModeT]:
        """See the protocol."""
        reached = self._values.reach(stretch.end, lambda: self._route.bodies(stretch.last))
        if stretch.guard is None and reached:
            return self._route.jumped(stretch)
        return self._route.change(stretch)

    def within(self, stretch: Stretch[ModeT], times: FloatArray) -> FloatArray:
        """See the protocol."""
        self._values.recall(stretch.start)
        return self._route.within(stretch, times)
