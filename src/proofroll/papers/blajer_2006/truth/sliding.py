"""Slip by magnitude and direction, from start to end; shared by two implementations of the first route."""

from abc import abstractmethod
from typing import Protocol

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.motion import BallMotion
from proofroll.papers.blajer_2006.truth.route import BallStretch, End, Route, World, join_motions

_FLOOR = 1e-6  # |u| below which the rest of a slip is extrapolated, relative to |u| at the handover
_ROUNDS = 50  # Newton iterations for τ at a given time


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

    def steps(self) -> tuple[FloatArray, FloatArray]:
        """Independent variable at the ends of all steps, from the start on, shape (n,), and states, shape (n, k)."""

    def at(self, places: FloatArray) -> FloatArray:
        """States, shape (n, k), at values of the independent variable within the run."""


class Sliding(Route):
    """Route in five variables; while slipping also ln|u|, φ and the time t, integrated over τ with dt = |u| dτ.

    Over τ the end of a slip, |u| → 0, is a smooth decay to infinity. The start of a slip is stiff: the smaller |u|, the
    tighter its direction follows the drive b, the rate of slip without friction. So until |u| reaches ``handover`` |b|
    T, where T = |b|/|ḃ| is the time in which b changes, the direction is computed from b (slaved slip) and not
    integrated.
    """

    def __init__(self, body: RollingBall, handover: float = 1e-5) -> None:
        self._body, self._handover = body, handover

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
    def _slaved(self, states: FloatArray) -> FloatArray:
        """Directions φ [rad] of a slaved slip, from states with |u|: shape (n, 6) -> (n,)."""

    @abstractmethod
    def _stood_still(self, last: FloatArray) -> FloatArray:
        """State at |u| = 0, extrapolated linearly from a tiny |u|."""

    @abstractmethod
    def _motion(self, y: FloatArray, size: FloatArray, phi: FloatArray | None) -> BallMotion:
        """Motion of states, shape (n, 5), with slip ``size`` [m/s] and direction ``phi`` [rad]; phi None: sticking."""

    @override
    def world(self, state: FloatArray) -> World:
        motion = self._motion(state[None, :5], np.zeros(1), None)
        return motion.p_WB[0], motion.v_WB[0], motion.w_WB[0]

    @override
    def stick(self, time: float, state: FloatArray, until: float) -> BallStretch:
        run = self._stick(time, state, until)

        def motion(times: FloatArray) -> BallMotion:
            return self._motion(run.at(times), np.zeros(len(times)), None)

        return BallStretch(start=time, end=run.end, sticking=True, state=run.last, why=run.why, motion=motion)

    @override
    def slip(self, time: float, state: FloatArray, until: float) -> BallStretch:
        handover = self._grown(time, state, until)
        creep = self._creep(time, state, until, handover)

        def creeping(times: FloatArray) -> BallMotion:
            y = creep.at(times)
            return self._motion(y[:, :5], y[:, 5], self._slaved(y))

        if creep.why is not End.GROWN:  # the time limit, or the slip stops before
            return BallStretch(
                start=time, end=creep.end, sticking=False, state=creep.last[:5], why=creep.why, motion=creeping
            )
        small, phi = creep.last, self._slaved(creep.last[None, :])[0]
        start_state = np.array([*small[:5], np.log(small[5]), phi, creep.end])
        run = self._slide(start_state, np.log(_FLOOR * handover), until)

        def slipping(times: FloatArray) -> BallMotion:
            y = _at_clock(run, times)
            return self._motion(y[:, :5], np.exp(y[:, 5]), y[:, 6])

        def motion(times: FloatArray) -> BallMotion:
            return join_motions(times, [(-np.inf, creeping), (creep.end, slipping)], self.name)

        y = self._stood_still(run.last) if run.why is End.STILL else run.last
        if run.why is End.TIME or y[7] >= until:
            return BallStretch(start=time, end=until, sticking=False, state=y[:5], why=End.TIME, motion=motion)
        return BallStretch(start=time, end=float(y[7]), sticking=False, state=y[:5], why=run.why, motion=motion)


def _at_clock(run: IntegratedRun, times: FloatArray) -> FloatArray:
    """States of a slip at times [s], shape (n, 8): Newton's method for τ."""
    knots, states = run.steps()
    tau = np.interp(times, states[:, 7], knots)
    for _ in range(_ROUNDS):
        y = run.at(tau)
        late = times - y[:, 7]
        if np.all(np.abs(late) <= 4 * np.finfo(float).eps * np.abs(times)):
            break
        tau = np.clip(tau + late / np.exp(y[:, 5]), knots[0], knots[-1])
    return run.at(tau)
