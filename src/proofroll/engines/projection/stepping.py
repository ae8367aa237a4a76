"""Step by step instead of from sample to sample: what switching between modes asks of an integrator.

A step can be looked into. The state inside it comes from a shorter step of the same method from the same start, never
from interpolation, so that a located event is as accurate as the steps are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged
from proofroll.core.integrators import Accept, Rates, classical_step

# Part of a fixed step that is not worth a step of its own.
_SLIVER = 1e-9


class Stepper(Protocol):
    """Moves a state by single steps.

    Attributes:
        stability: largest h λ with which a component that decays like exp(-λ t) still decays.
        reach: part of the time in which a slip vanishes, doubles or turns by a radian that one step may take.
        t, y: present time [s] and state.
        t_before, y_before: where the last step started.
    """

    stability: ClassVar[float]
    reach: ClassVar[float]
    t: float
    y: FloatArray
    t_before: float
    y_before: FloatArray

    def __init__(self, resolution: float) -> None:
        """Stands at time 0; ``resolution`` is the step's size [s] or its relative tolerance."""

    def begin(self, t: float, y: FloatArray, rates: Rates, accept: Accept, scales: FloatArray) -> None:
        """Goes on with another state or other equations.

        Args:
            t: present time [s].
            y: the state.
            rates: ẏ of y.
            accept: called after each step, see :data:`proofroll.core.integrators.Accept`.
            scales: natural size of each component of y.
        """

    def aim(self, t: float) -> None:
        """Says that steps will have to end at the time t [s].

        Raises:
            InputError: the method's own steps do not end there.
        """

    def step(self, until: float, longest: float) -> None:
        """One step, at most of this length [s] and at most to the time ``until`` [s].

        Raises:
            Diverged: it gave up.
        """

    def inside(self, t: float) -> FloatArray:
        """The state at a time [s] within the last step."""

    def bracket(self, low: float, high: float) -> tuple[float, float]:
        """What this method can honestly say of an event found between two times [s]."""


class FixedSteps:
    """The classical Runge-Kutta method on a grid of times; after an event it goes to the next point of the grid."""

    stability: ClassVar[float] = 2.78
    reach: ClassVar[float] = 0.25  # nothing else keeps the error of such a step small

    def __init__(self, resolution: float) -> None:
        self._dt = resolution

    def begin(self, t: float, y: FloatArray, rates: Rates, accept: Accept, scales: FloatArray) -> None:  # noqa: ARG002 -- a fixed step needs no measure of error
        """See :class:`Stepper`."""
        self.t, self.y, self.t_before, self.y_before = t, y, t, y
        self._rates, self._accept = rates, accept

    def aim(self, t: float) -> None:
        """See :class:`Stepper`."""
        whole_steps(self.t, t, self._dt)

    def step(self, until: float, longest: float) -> None:
        """See :class:`Stepper`."""
        end = (math.floor(self.t / self._dt + _SLIVER) + 1) * self._dt
        if end > until - _SLIVER * self._dt:
            end = until
        if end - self.t > longest:
            end = self.t + longest
        if end == self.t:
            raise Diverged(f"the step size fell to nothing at t = {self.t:.6g} s")
        self.t_before, self.y_before = self.t, self.y
        self.y, self.t = self.inside(end), end

    def inside(self, t: float) -> FloatArray:
        """See :class:`Stepper`."""
        if t == self.t_before:
            return self.y_before
        return self._accept(t, classical_step(self._rates, self.y_before, t - self.t_before))

    def bracket(self, low: float, high: float) -> tuple[float, float]:
        """See :class:`Stepper`. The step of the grid: more could be told only by trusting the step's own error."""
        start = math.floor(low / self._dt + _SLIVER) * self._dt
        return min(start, low), max(start + self._dt, high)


class ControlledSteps:
    """Dormand and Prince's method of order 8 with error control, from scipy."""

    stability: ClassVar[float] = 6.3  # its step multiplies exp(-λ t) by less than 1 up to 6.39
    reach: ClassVar[float] = 0.6

    def __init__(self, resolution: float) -> None:
        self._rtol = resolution

    def begin(self, t: float, y: FloatArray, rates: Rates, accept: Accept, scales: FloatArray) -> None:
        """See :class:`Stepper`."""
        self.t, self.y, self.t_before, self.y_before = t, y, t, y
        self._rates, self._accept, self._atol = rates, accept, self._rtol * scales
        self._solver = self._solver_from(t, y, math.inf, None)

    def aim(self, t: float) -> None:
        """See :class:`Stepper`. Its steps end anywhere."""

    def step(self, until: float, longest: float) -> None:
        """See :class:`Stepper`."""
        solver = self._solver
        solver.t_bound, solver.status, solver.max_step = until, "running", longest
        wanted = solver.h_abs
        self.t_before, self.y_before = self.t, self.y
        if solver.step() is not None:
            raise Diverged(f"the step size fell to nothing at t = {solver.t:.6g} s")
        if solver.t == until:
            solver.h_abs = max(wanted, solver.h_abs)
        self.t, self.y = float(solver.t), self._accept(float(solver.t), solver.y)
        if self.y is not solver.y:
            # The rate that opens the next step must belong to the changed state, or the error control collapses.
            solver.y, solver.f = self.y, solver.fun(solver.t, self.y)

    def inside(self, t: float) -> FloatArray:
        """See :class:`Stepper`."""
        if t == self.t_before:
            return self.y_before
        if t == self.t:
            return self.y
        solver = self._solver_from(self.t_before, self.y_before, t, t - self.t_before)
        while solver.status == "running":
            if solver.step() is not None:
                raise Diverged(f"the step size fell to nothing at t = {solver.t:.6g} s")
        return self._accept(t, solver.y)

    def bracket(self, low: float, high: float) -> tuple[float, float]:
        """See :class:`Stepper`. As tight as it was located."""
        return low, high

    def _solver_from(self, t: float, y: FloatArray, bound: float, first: float | None) -> Any:
        from scipy.integrate import DOP853

        rates = self._rates
        return DOP853(lambda _, x: rates(x), t, np.array(y), bound, rtol=self._rtol, atol=self._atol, first_step=first)


STEPPERS: Mapping[str, type[Stepper]] = {"rk4": FixedSteps, "dop853": ControlledSteps}
