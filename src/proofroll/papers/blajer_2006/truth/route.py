"""Protocol of a route, which integrates one stretch of sticking or slipping at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.motion import BallMotion

# Position [m], velocity [m/s] and spin [rad/s] of a ball in the world, each shape (3,).
World = tuple[FloatArray, FloatArray, FloatArray]
# Rising times [s], shape (n,) -> motion at these times.
Motion = Callable[[FloatArray], BallMotion]


class End(Enum):
    """Reason that a stretch ended."""

    TIME = auto()  # the time limit was reached
    CONE = auto()  # sticking: the needed friction left the static cone
    STILL = auto()  # slipping: the contact point stopped
    HALT = auto()  # slipping with rolling resistance: the rolling all but stopped
    GROWN = auto()  # of the start of a slip, never of a stretch: its direction can be integrated from here on


@dataclass(frozen=True)
class BallStretch:
    """A stretch of time in one mode.

    Attributes:
        start, end: [s].
        sticking: True: the ball rolls without slip; False: it slips.
        state: at the end, in the route's variables; its slip velocity is zero unless the ball slips there.
        why: reason for its end.
        motion: motion at rising times [s] within the stretch.
    """

    start: float
    end: float
    sticking: bool
    state: FloatArray
    why: End
    motion: Motion

    @property
    def guard(self) -> End | None:
        """Reason for its end; None: it reached its time limit."""
        return None if self.why is End.TIME else self.why


class Route(ABC):
    """A way of integrating stretches, in state variables of its own.

    Attributes:
        name: method of integration, shown to people.
    """

    name: ClassVar[str]

    @abstractmethod
    def start(self) -> FloatArray:
        """State at time 0."""

    @abstractmethod
    def friction(self, state: FloatArray) -> tuple[float, float]:
        """Friction needed to stick, and available friction μs N, both in the same unit."""

    @abstractmethod
    def rates(self, state: FloatArray) -> FloatArray:
        """Time derivative of the state while the ball sticks."""

    @abstractmethod
    def stick(self, time: float, state: FloatArray, until: float) -> BallStretch:
        """Rolls without slip from ``time`` to ``until`` at the latest [s]."""

    @abstractmethod
    def slip(self, time: float, state: FloatArray, until: float) -> BallStretch:
        """Slips from rest from ``time`` to ``until`` at the latest [s]."""

    @abstractmethod
    def world(self, state: FloatArray) -> World:
        """Position, velocity and spin of a state in the world."""

    def excess(self, state: FloatArray) -> float:
        """Relative excess of the friction needed to stick: (needed - available) / (needed + available) [1]."""
        needed, available = self.friction(state)
        return (needed - available) / max(needed + available, np.finfo(float).tiny)

    def ahead(self, state: FloatArray, span: float) -> FloatArray:
        """State after sticking for a short ``span`` [s], by one classic Runge-Kutta step."""
        k1 = self.rates(state)
        k2 = self.rates(state + span / 2 * k1)
        k3 = self.rates(state + span / 2 * k2)
        k4 = self.rates(state + span * k3)
        return np.asarray(state + span / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


def join_motions(times: FloatArray, parts: Sequence[tuple[float, Motion]], route: str) -> BallMotion:
    """Motion at rising times [s]: each by the last part that has started; parts are (start [s], motion)."""
    index = np.searchsorted([start for start, _ in parts], times, side="right") - 1
    columns = {key: np.empty((len(times), 3)) for key in ("p_WB", "v_WB", "w_WB", "force")}
    for number in np.unique(index):
        inside = index == number
        part = parts[number][1](times[inside])
        for key, column in columns.items():
            column[inside] = getattr(part, key)
    return BallMotion(**columns, route=route)
