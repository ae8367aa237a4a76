"""What the sequence of sticking and slipping asks of whatever integrates its legs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Generic, Protocol, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.events import EventKind
from proofroll.elements.ball_on_surface.motion import BallMotion

State = TypeVar("State")


class End(Enum):
    """Why a leg ended."""

    TIME = auto()  # the last time was reached
    CONE = auto()  # sticking: the needed friction left the static cone
    STILL = auto()  # slipping: the contact point stands still
    HALT = auto()  # sticking with rolling resistance: the centre stands still
    LIFTOFF = auto()  # the normal force reached zero


@dataclass(frozen=True)
class Leg(Generic[State]):
    """One stretch of time in one mode.

    Attributes:
        start, end: [s].
        sticking: the mode.
        state: at the end; the slip velocity in it is zero unless the ball slips there.
        why: why it ended.
        motion: times within the leg [s], shape (n,) -> motion at these times.
    """

    start: float
    end: float
    sticking: bool
    state: State
    why: End
    motion: Callable[[FloatArray], BallMotion]


class Route(Protocol[State]):
    """One way of integrating the legs, in state variables of its own."""

    @property
    def name(self) -> str:
        """How the legs are integrated, for a person."""

    def start(self) -> State:
        """State at time 0; that the ball slips there is not part of it."""

    def at(self, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray) -> State:
        """State of a ball that touches the wall, with these place [m], velocity [m/s] and spin [rad/s]."""

    def impact(
        self, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray, e: float, e_t: float
    ) -> tuple[FloatArray, FloatArray]:
        """Velocity [m/s] and spin [rad/s] after an impact with these coefficients of restitution."""

    def excess(self, state: State) -> float:
        """(needed - available) / (needed + available) with the friction needed to stick and μs N [-]."""

    def ahead(self, state: State, span: float) -> State:
        """The state after sticking for a short ``span`` [s], to third order at least."""

    def stick(self, time: float, state: State, until: float) -> Leg[State]:
        """Roll without slip from ``time`` to ``until`` at the latest [s]."""

    def slip(self, time: float, state: State, until: float, slip: FloatArray | None = None) -> Leg[State]:
        """Slip from ``time`` to ``until`` at the latest [s].

        The contact point starts with the velocity ``slip`` in the world [m/s], shape (3,), or at rest (None).
        """

    def world(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
        """p_WB [m], v_WB [m/s], w_WB [rad/s] of the state, each shape (3,)."""

    def nudged(self, state: State, v_WB: FloatArray) -> State:
        """The state rolling with the centre's velocity ``v_WB`` [m/s], shape (3,), in place of its own."""


@dataclass(frozen=True)
class Path(Generic[State]):
    """The whole sequence.

    Attributes:
        legs: one after another from time 0.
        events: kind and time [s] of each change.
        lands: when a ball that has left the wall is back on it [s], where the path ends; None: not until the end.
    """

    legs: list[Leg[State]]
    events: list[tuple[EventKind, float]]
    lands: float | None = None

    def motion(self, times: FloatArray, route: str) -> tuple[BallMotion, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
        """Motion at ``times`` [s] and whether the ball sticks there; a time of an event belongs to the later leg."""
        index = np.searchsorted([leg.start for leg in self.legs], times, side="right") - 1
        columns = {key: np.empty((len(times), 3)) for key in ("p_WB", "v_WB", "w_WB", "force")}
        for number in np.unique(index):
            here = index == number
            part = self.legs[number].motion(times[here])
            for key, column in columns.items():
                column[here] = getattr(part, key)
        sticking = np.array([leg.sticking for leg in self.legs])[index]
        return BallMotion(**columns, route=route), sticking
