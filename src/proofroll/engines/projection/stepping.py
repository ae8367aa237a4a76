"""Step by step instead of from sample to sample: what switching between modes asks of an integrator.

A step can be looked into. The state inside it comes from a shorter step of the same method from the same start, never
from interpolation, so that a located event is as accurate as the steps are.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged
from proofroll.core.integrators import Accept, Rates, classical_step, controlled_step, inside_last_step

# Part of a fixed step that is not worth a step of its own.
_SLIVER = 1e-9


class Stepper(ABC):
    """Moves a state by single steps.

    Attributes:
        stability: largest h λ with which a component that decays like exp(-λ t) still decays.
        reach: part of the time in which a slip vanishes, doubles or turns by a radian that one step may take.
        t, y: present time [s] and state.
        t_before, y_before: where the last step started.
    """

    stability: ClassVar[float]
    reach: ClassVar[float]

    def __init__(self, resolution: float) -> None:
        """Stands at time 0; ``resolution`` is the step's size [s] or its relative tolerance."""
        self._resolution = resolution

    def begin(self, t: float, y: FloatArray, rates: Rates, accept: Accept, scales: FloatArray) -> None:  # noqa: ARG002 -- a fixed step needs no measure of error
        """Goes on with another state or other equations.

        Args:
            t: present time [s].
            y: the state.
            rates: ẏ of y.
            accept: called after each step, see :data:`proofroll.core.integrators.Accept`.
            scales: natural size of each component of y.
        """
        self.t, self.y, self.t_before, self.y_before = t, y, t, y
        self._rates, self._accept = rates, accept

    def aim(self, t: float) -> None:  # noqa: B027 -- the steps of most methods end anywhere
        """Says that steps will have to end at the time t [s].

        Raises:
            InputError: the method's own steps do not end there.
        """

    @abstractmethod
    def step(self, until: float, longest: float) -> None:
        """One step, at most of this length [s] and at most to the time ``until`` [s].

        Raises:
            Diverged: it gave up.
        """

    @abstractmethod
    def inside(self, t: float) -> FloatArray:
        """The state at a time [s] within the last step."""

    def crossing(self, margin: Callable[[FloatArray], float], high: float, width: float) -> tuple[float, float]:
        """Times [s] within the last step before and after a margin of the state became negative.

        Args:
            margin: negative at the time ``high``. One that starts at zero and rises first (a slip starts with none, a
                rebound at its stop) is followed to where it comes back.
            high: [s].
            width: to which the time is located [s].
        """
        from scipy.optimize import brentq

        def at(t: float) -> float:
            return margin(self.inside(t))

        start = low = self.t_before
        if at(low) <= 0:
            low = 0.5 * (start + high)
            while low - start > width and at(low) <= 0:
                low, high = 0.5 * (start + low), low
            if low - start <= width:
                return start, start
        root = float(brentq(at, low, high, xtol=width, rtol=4 * np.finfo(float).eps))
        while True:  # what the root search says, with a state on either side
            before, after = max(low, root - width), min(high, root + width)
            if (at(before) > 0 or before == low) and (at(after) < 0 or after == high):
                return before, after
            width *= 4

    def bracket(self, low: float, high: float) -> tuple[float, float]:
        """Bracket of an event located between two times [s]: as tight as it was located."""
        return low, high


class FixedSteps(Stepper):
    """The classical Runge-Kutta method on a grid of times; after an event it goes to the next point of the grid."""

    stability = 2.78
    reach = 0.25  # nothing else keeps the error of such a step small

    def aim(self, t: float) -> None:
        """See :class:`Stepper`."""
        whole_steps(self.t, t, self._resolution)

    def step(self, until: float, longest: float) -> None:
        """See :class:`Stepper`."""
        dt = self._resolution
        end = (math.floor(self.t / dt + _SLIVER) + 1) * dt
        if end > until - _SLIVER * dt:
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
        """See :class:`Stepper`. The step of the grid: a narrower one would trust the step's own error."""
        start = math.floor(low / self._resolution + _SLIVER) * self._resolution
        return min(start, low), max(start + self._resolution, high)


class ControlledSteps(Stepper):
    """Dormand and Prince's method of order 8 with error control, from scipy."""

    stability = 6.3  # its step multiplies exp(-λ t) by less than 1 up to 6.39
    reach = 0.6

    def begin(self, t: float, y: FloatArray, rates: Rates, accept: Accept, scales: FloatArray) -> None:
        """See :class:`Stepper`."""
        from scipy.integrate import DOP853

        super().begin(t, y, rates, accept, scales)
        rtol = self._resolution
        self._solver = DOP853(lambda _, x: rates(x), t, np.array(y), math.inf, rtol=rtol, atol=rtol * scales)

    def step(self, until: float, longest: float) -> None:
        """See :class:`Stepper`."""
        self.t_before, self.y_before = self.t, self.y
        controlled_step(self._solver, self._accept, until, longest)
        self.t, self.y = float(self._solver.t), self._solver.y

    def inside(self, t: float) -> FloatArray:
        """See :class:`Stepper`."""
        if t == self.t_before:
            return self.y_before
        return self.y if t == self.t else self._accept(t, inside_last_step(self._solver, t))


STEPPERS: Mapping[str, type[Stepper]] = {"rk4": FixedSteps, "dop853": ControlledSteps}
