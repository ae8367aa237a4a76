"""Slip followed by its size and direction, shared by the routes: its beginning, course and end."""

from abc import abstractmethod
from typing import Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface.impact import by_coefficients
from proofroll.truth.ball_on_surface.route import End, Leg, Route, World, joined

_FLOOR = 1e-4  # |u| at which the rest of a slip is extrapolated, relative to where it began
_BEGUN = 1e-8  # the same of a slip that does not begin from rest, relative to its initial |u|
_ROUNDS = 50  # of Newton's method for the clock


class IntegratedRun(Protocol):
    """A run of an integrator until something ends it: where, the state there, and the reason."""

    end: float
    last: FloatArray
    why: End

    def steps(self) -> tuple[FloatArray, FloatArray]:
        """Ends of its steps from the start on, shape (n,), and the states there, shape (n, k)."""

    def at(self, where: FloatArray) -> FloatArray:
        """States, shape (n, k), at values of the independent variable within the run."""


class Sliding(Route):
    """Route in five variables, joined while slipping by (ln|u|, φ) and the time t, against τ with dt = |u| dτ.

    Against τ the end of a slip, |u| → 0, is a smooth decay to infinity. The start of a slip is not: there the direction
    follows the drive b, against which sticking would need friction, ever more stiffly. Until |u| reaches ``handover``
    |b| T, with T = |b|/|ḃ| the time in which b changes, the direction is slaved to it.
    """

    impact = staticmethod(by_coefficients)

    def __init__(self, body: RollingBall, handover: float = 1e-5) -> None:
        self._body, self._handover = body, handover

    @abstractmethod
    def _stick(self, time: float, state: FloatArray, until: float) -> IntegratedRun:
        """Rolling without slip."""

    @abstractmethod
    def _creep(self, time: float, state: FloatArray, until: float, handover: float) -> IntegratedRun:
        """The start of a slip, with |u| as sixth state, until that has grown to ``handover`` [m/s]."""

    @abstractmethod
    def _slide(self, first: FloatArray, floor: float, until: float) -> IntegratedRun:
        """The slip against τ, of eight states, until ln|u| falls to ``floor``."""

    @abstractmethod
    def _grown(self, time: float, state: FloatArray, until: float) -> float:
        """The size |u| of a slip from rest [m/s] from which on its direction is a state."""

    @abstractmethod
    def _slaved(self, states: FloatArray) -> FloatArray:
        """Directions φ of the slaved slip in states with |u|, shape (n, 6) -> (n,)."""

    @abstractmethod
    def _stood_still(self, last: FloatArray) -> FloatArray:
        """The state at |u| = 0, linearly from a |u| so small that nothing else is seen."""

    @abstractmethod
    def _axes(self, state: FloatArray) -> FloatArray:
        """The surface's frame at a state, shape (3, 3)."""

    @abstractmethod
    def _motion(self, y: FloatArray, size: FloatArray, phi: FloatArray | None) -> BallMotion:
        """Motion in states, shape (n, 5), slipping with speed ``size`` [m/s] in direction ``phi`` (None: sticking)."""

    def world(self, state: FloatArray) -> World:
        """See :class:`Route`."""
        motion = self._motion(state[None, :5], np.zeros(1), None)
        return motion.p_WB[0], motion.v_WB[0], motion.w_WB[0]

    def stick(self, time: float, state: FloatArray, until: float) -> Leg:
        """See :class:`Route`."""
        run = self._stick(time, state, until)

        def motion(times: FloatArray) -> BallMotion:
            return self._motion(run.at(times), np.zeros(len(times)), None)

        return Leg(time, run.end, True, run.last, run.why, motion)

    def slip(self, time: float, state: FloatArray, until: float, slip: FloatArray | None = None) -> Leg:
        """See :class:`Route`."""
        handover = self._grown(time, state, until)
        # One that does not begin from rest has no such start.
        creep = self._creep(time, state, until if slip is None else time, handover)

        def creeping(times: FloatArray) -> BallMotion:
            y = creep.at(times)
            return self._motion(y[:, :5], y[:, 5], self._slaved(y))

        if slip is None:
            if creep.why is not End.GROWN:  # the time is over, or the ball stands still before
                return Leg(time, creep.end, False, creep.last[:5], creep.why, creeping)
            small, phi = creep.last, self._slaved(creep.last[None, :])[0]
        else:
            _, e2, e3 = self._axes(state).T
            small, phi = np.append(state, np.linalg.norm(slip)), np.arctan2(slip @ e3, slip @ e2)
            handover = max(handover, _BEGUN * small[5])
        first = np.array([*small[:5], np.log(small[5]), phi, creep.end])
        run = self._slide(first, np.log(_FLOOR * handover), until)

        def slipping(times: FloatArray) -> BallMotion:
            y = _at_clock(run, times)
            return self._motion(y[:, :5], np.exp(y[:, 5]), y[:, 6])

        def motion(times: FloatArray) -> BallMotion:
            return joined(times, [(-np.inf, creeping), (creep.end, slipping)], self.name)

        y = self._stood_still(run.last) if run.why is End.STILL else run.last
        if run.why is End.TIME or y[7] >= until:
            return Leg(time, until, False, y[:5], End.TIME, motion)
        return Leg(time, float(y[7]), False, y[:5], run.why, motion)


def _at_clock(run: IntegratedRun, times: FloatArray) -> FloatArray:
    """States of a slip, shape (n, 8), where its clock shows the times: Newton's method for τ."""
    knots, states = run.steps()
    tau = np.interp(times, states[:, 7], knots)
    for _ in range(_ROUNDS):
        y = run.at(tau)
        late = times - y[:, 7]
        if np.all(np.abs(late) <= 4 * np.finfo(float).eps * np.abs(times)):
            break
        tau = np.clip(tau + late / np.exp(y[:, 5]), knots[0], knots[-1])
    return run.at(tau)
