"""Protocol of a route: the sequence of sticking and slipping asks it to integrate the legs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.events import EventKind
from proofroll.elements.ball_on_surface.motion import BallMotion

# Place [m], velocity [m/s] and spin [rad/s] of a ball in the world, each shape (3,).
World = tuple[FloatArray, FloatArray, FloatArray]
# Rising times [s], shape (n,) -> motion at these times.
Motion = Callable[[FloatArray], BallMotion]


class End(Enum):
    """Reason that a leg ended."""

    TIME = auto()  # the last time was reached
    CONE = auto()  # sticking: the needed friction left the static cone
    STILL = auto()  # slipping: the contact point stands still
    HALT = auto()  # sticking with rolling resistance: the centre stands still
    LIFTOFF = auto()  # the normal force reached zero
    LANDED = auto()  # flying: the ball is on the wall again
    GROWN = auto()  # of the start of a slip, never of a leg: the slip has a direction of its own


@dataclass(frozen=True)
class Leg:
    """One stretch of time in one mode.

    Attributes:
        start, end: [s].
        sticking: the mode.
        state: at the end; the slip velocity in it is zero unless the ball slips there.
        why: reason of its end.
        motion: at times within the leg.
    """

    start: float
    end: float
    sticking: bool
    state: FloatArray
    why: End
    motion: Motion

    @property
    def guard(self) -> End | None:
        """Reason that it ended before the end of time; None: it did not."""
        return None if self.why is End.TIME else self.why

    def at_end(self) -> World:
        """Place, velocity and spin at the end, before anything changes there."""
        last = self.motion(np.array([self.end]))
        return last.p_WB[0], last.v_WB[0], last.w_WB[0]


class Route(ABC):
    """One way of integrating the legs, in state variables of its own.

    Attributes:
        name: method that integrates the legs, for a person.
        impact: law from velocity and spin before an impact to those after it, a function of
            :mod:`proofroll.truth.ball_on_surface.impact`.
    """

    name: ClassVar[str]
    impact: ClassVar[staticmethod[..., tuple[FloatArray, FloatArray]]]

    @abstractmethod
    def start(self) -> FloatArray:
        """State at time 0; that the ball slips there is not part of it."""

    @abstractmethod
    def at(self, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray) -> FloatArray:
        """State of a ball that touches the wall, with these place [m], velocity [m/s] and spin [rad/s]."""

    @abstractmethod
    def friction(self, state: FloatArray) -> tuple[float, float]:
        """The friction needed to stick, and μs N, in one unit."""

    @abstractmethod
    def rates(self, state: FloatArray) -> FloatArray:
        """Rates of the state while the ball sticks."""

    @abstractmethod
    def stick(self, time: float, state: FloatArray, until: float) -> Leg:
        """Roll without slip from ``time`` to ``until`` at the latest [s]."""

    @abstractmethod
    def slip(self, time: float, state: FloatArray, until: float, slip: FloatArray | None = None) -> Leg:
        """Slip from ``time`` to ``until`` at the latest [s].

        The contact point starts with the velocity ``slip`` in the world [m/s], shape (3,), or at rest (None).
        """

    @abstractmethod
    def world(self, state: FloatArray) -> World:
        """Place, velocity and spin of a state in the world."""

    @abstractmethod
    def nudged(self, state: FloatArray, v_WB: FloatArray) -> FloatArray:
        """The state rolling with the centre's velocity ``v_WB`` [m/s], shape (3,), in place of its own."""

    def excess(self, state: FloatArray) -> float:
        """(needed - available) / (needed + available) of the friction to stick [1]."""
        needed, available = self.friction(state)
        return (needed - available) / max(needed + available, np.finfo(float).tiny)

    def ahead(self, state: FloatArray, span: float) -> FloatArray:
        """The state after sticking for a short ``span`` [s], by one classic Runge-Kutta step."""
        k1 = self.rates(state)
        k2 = self.rates(state + span / 2 * k1)
        k3 = self.rates(state + span / 2 * k2)
        k4 = self.rates(state + span * k3)
        return np.asarray(state + span / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


def joined(times: FloatArray, parts: Sequence[tuple[float, Motion]], route: str) -> BallMotion:
    """Motion at rising times [s], each by the last part that has begun; parts with their beginnings [s]."""
    index = np.searchsorted([start for start, _ in parts], times, side="right") - 1
    columns = {key: np.empty((len(times), 3)) for key in ("p_WB", "v_WB", "w_WB", "force")}
    for number in np.unique(index):
        here = index == number
        part = parts[number][1](times[here])
        for key, column in columns.items():
            column[here] = getattr(part, key)
    return BallMotion(**columns, route=route)


@dataclass(frozen=True)
class Path:
    """Legs and events of a motion from its start to its end.

    Attributes:
        legs: one after another from time 0.
        events: kind and time [s] of each change.
        lands: when a ball that has left the wall is back on it [s], where the path ends; None: not until the end.
        blurs: uncertainty [s] of events at a time [s] that both routes find by the same method.
    """

    legs: list[Leg]
    events: list[tuple[EventKind, float]]
    lands: float | None = None
    blurs: dict[float, float] = field(default_factory=dict)

    def motion(self, times: FloatArray, route: str) -> BallMotion:
        """Motion at rising ``times`` [s]; a time of an event belongs to the later leg."""
        return joined(times, [(leg.start, leg.motion) for leg in self.legs], route)

    def sticking(self, times: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Mask of the ``times`` [s] at which the ball sticks."""
        index = np.searchsorted([leg.start for leg in self.legs], times, side="right") - 1
        return np.array([leg.sticking for leg in self.legs])[index]
