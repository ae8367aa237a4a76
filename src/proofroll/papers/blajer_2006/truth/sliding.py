"""Slip by magnitude and direction, from start to end; shared by two implementations of the route of first slips."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import ClassVar, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion
from proofroll.papers.blajer_2006.ball.model import RollingBall

_FLOOR = 1e-6  # |u| below which the rest of a slip is extrapolated, relative to |u| at the handover

# Position [m], velocity [m/s] and spin [rad/s] of a ball in the world, each shape (3,).
World = tuple[FloatArray, FloatArray, FloatArray]
# Rising times [s], shape (n,) -> motion of rolling at these times.
Motion = Callable[[FloatArray], BallMotion]


class End(Enum):
    """Reason that a stretch ended."""

    TIME = auto()  # the time limit was reached
    CONE = auto()  # sticking: the needed friction left the static cone
    STILL = auto()  # slipping: the contact point stopped
    GROWN = auto()  # of the start of a slip, never of a stretch: its direction can be integrated from here on


@dataclass(frozen=True)
class BallStretch:
    """A stretch of time in one mode.

    Attributes:
        start, end: [s].
        sticking: True: the ball rolls without slip; False: it slips.
        state: at the end, in the route's variables; its slip velocity is zero unless the ball slips there.
        why: reason for its end.
    """

    start: float
    end: float
    sticking: bool
    state: FloatArray
    why: End

    @property
    def guard(self) -> End | None:
        """Reason for its end; None: it reached its time limit."""
        return None if self.why is End.TIME else self.why


class IntegratedRun(Protocol):
    """Finished integration, over time or τ.

    Attributes:
        end: independent variable at the end.
        last: state at the end.
        why: reason for the end.
    """

    end: float
    last: FloatArray
    why: End

    def at(self, places: FloatArray) -> FloatArray:
        """States, shape (n, k), at values of the independent variable within the run."""


class Sliding(ABC):
    """Route in five variables; while slipping also ln|u|, φ and the time t, integrated over τ with dt = |u| dτ.

    Over τ the end of a slip, |u| → 0, is a smooth decay to infinity. The start of a slip is stiff: the smaller |u|, the
    tighter its direction follows the drive b, the rate of slip without friction. So until |u| reaches ``handover`` |b|
    T, where T = |b|/|ḃ| is the time in which b changes, the direction is computed from b (slaved slip) and not
    integrated.

    Attributes:
        name: method of integration, shown to people.
    """

    name: ClassVar[str]

    def __init__(self, body: RollingBall, handover: float = 1e-5) -> None:
        self._body, self._handover = body, handover

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
    def _stick(self, time: float, state: FloatArray, until: float) -> IntegratedRun:
        """Integrates rolling without slip from ``time`` to ``until`` [s]."""

    @abstractmethod
    def _creep(self, time: float, state: FloatArray, until: float, handover: float) -> IntegratedRun:
        """Integrates a slaved slip from rest, with |u| as sixth state, until |u| reaches ``handover`` [m/s]."""

    @abstractmethod
    def _slide(self, start_state: FloatArray, floor: float, until: float) -> IntegratedRun:
        """Integrates a slip over τ, with eight states, until ln|u| falls to ``floor`` or t reaches ``until`` [s]."""

    @abstractmethod
    def _grown(self, time: float, state: FloatArray, until: float) -> float:
        """Handover |u| of a slip from rest [m/s]: its direction is integrated above."""

    @abstractmethod
    def _slaved(self, state: FloatArray) -> float:
        """Direction φ [rad] of a slaved slip, from a state with |u|, shape (6,)."""

    @abstractmethod
    def _stood_still(self, last: FloatArray) -> FloatArray:
        """State at |u| = 0, extrapolated linearly from a tiny |u|."""

    @abstractmethod
    def _motion(self, states: FloatArray) -> BallMotion:
        """Motion of rolling at states, shape (n, 5)."""

    def world(self, state: FloatArray) -> World:
        """Position, velocity and spin of a state in the world."""
        motion = self._motion(state[None, :5])
        return motion.p_WB[0], motion.v_WB[0], motion.w_WB[0]

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

    def rolling(self, until: float) -> tuple[float, Motion]:
        """End of rolling without slip from time 0 on, ``until`` at the latest [s], and its motion."""
        run = self._stick(0.0, self.start(), until)
        return run.end, lambda times: self._motion(run.at(times))

    def stick(self, time: float, state: FloatArray, until: float) -> BallStretch:
        """Rolls without slip from ``time`` to ``until`` at the latest [s]."""
        run = self._stick(time, state, until)
        return BallStretch(start=time, end=run.end, sticking=True, state=run.last, why=run.why)

    def slip(self, time: float, state: FloatArray, until: float) -> BallStretch:
        """Slips from rest from ``time`` to ``until`` at the latest [s]."""
        handover = self._grown(time, state, until)
        creep = self._creep(time, state, until, handover)
        if creep.why is not End.GROWN:  # the time limit, or the slip stops before
            return BallStretch(start=time, end=creep.end, sticking=False, state=creep.last[:5], why=creep.why)
        small = creep.last
        start_state = np.array([*small[:5], np.log(small[5]), self._slaved(small), creep.end])
        run = self._slide(start_state, np.log(_FLOOR * handover), until)
        y = self._stood_still(run.last) if run.why is End.STILL else run.last
        if run.why is End.TIME or y[7] >= until:
            return BallStretch(start=time, end=until, sticking=False, state=y[:5], why=End.TIME)
        return BallStretch(start=time, end=float(y[7]), sticking=False, state=y[:5], why=run.why)
