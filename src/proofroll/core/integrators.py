"""Integrators of ẋ = rates(x), a class each, in INTEGRATORS. The state at any time inside a step is available.

It is computed by a shorter step of the same method from the same start, not interpolated, so that a located event is as
accurate as the steps.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar, Literal

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import Accept, controlled_step, integrated_to, solver_from
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged
from proofroll.core.stalling import StepWatch

Rates = Callable[[FloatArray], FloatArray]
# A remainder of a fixed step below this part of it is not taken as a step of its own.
_SLIVER = 1e-9


def classical_step(rates: Rates, x: FloatArray, h: float) -> FloatArray:
    """One step of length h [s] by the classical Runge-Kutta method."""
    k1 = rates(x)
    k2 = rates(x + h / 2 * k1)
    k3 = rates(x + h / 2 * k2)
    k4 = rates(x + h * k3)
    return np.asarray(x + h / 6 * (k1 + 2 * (k2 + k3) + k4))


class Integrator(ABC):
    """Moves a state in time, from sample to sample or by single steps.

    Attributes:
        resolution: the setting that trades speed for accuracy.
        order: of convergence in ``dt``; None with an adaptive step.
        stability: largest h λ with which a component that decays like exp(-λ t) still decays.
        reach: longest step, as a part of the time in which a slip vanishes, doubles or turns by a radian.
        t, x: present time [s] and state.
        t_before, x_before: time [s] and state at the start of the last single step.
    """

    resolution: ClassVar[Literal["dt", "rtol"]]
    order: ClassVar[int | None]
    stability: ClassVar[float]
    reach: ClassVar[float]

    def __init__(self, resolution: float) -> None:
        """Takes the value of ``dt`` [s] or ``rtol`` [1], as :attr:`resolution` says."""
        self._resolution = resolution

    def begin(self, t: float, x: FloatArray, rates: Rates, accept: Accept, scales: FloatArray) -> None:
        """Starts, or restarts with a new state or new equations.

        Args:
            t: present time [s].
            x: the state.
            rates: state -> its time derivative.
            accept: see :data:`proofroll.core.dop853.Accept`.
            scales: natural size of each component of x.
        """
        self.t, self.x, self.t_before, self.x_before = t, x, t, x
        self._rates, self._accept, self._scales = rates, accept, scales

    def restart(self) -> None:
        """Begins again at the present state, after the rates have jumped."""
        self.begin(self.t, self.x, self._rates, self._accept, self._scales)

    @abstractmethod
    def advance(self, t: float) -> None:
        """Moves to time t [s]; the last step ends there. Raises Diverged if no step succeeds."""

    def aim(self, t: float) -> None:  # noqa: B027 -- the steps of most methods end anywhere
        """Announces that single steps will have to end at the time t [s].

        Raises:
            InputError: the method's own steps do not end there.
        """

    @abstractmethod
    def step(self, until: float, longest: float) -> None:
        """Takes one step, at most ``longest`` [s] long and ending at ``until`` [s] at the latest.

        May raise Diverged.
        """

    @abstractmethod
    def inside(self, t: float) -> FloatArray:
        """The state at a time [s] within the last step."""

    def crossing(self, margin: Callable[[FloatArray], float], high: float, width: float) -> tuple[float, float]:
        """Times [s] within the last step just before and just after a margin of the state becomes negative.

        Args:
            margin: function of the state, negative at the time ``high``. If it starts at zero and first rises (a slip
                begins with speed zero, a rebound at its stop), its later fall through zero is found.
            high: end of the search [s].
            width: accuracy of the times [s].
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
        while True:  # widen around the root until the margin has different signs at both ends
            earlier, later = max(low, root - width), min(high, root + width)
            if (at(earlier) > 0 or earlier == low) and (at(later) < 0 or later == high):
                return earlier, later
            width *= 4

    def bracket(self, low: float, high: float) -> tuple[float, float]:
        """Error bracket [s] of an event located between two times [s]: by default these times."""
        return low, high


class RungeKutta4(Integrator):
    """The classical Runge-Kutta method on a fixed grid of times; after an event a shorter step returns to the grid."""

    resolution = "dt"
    order = 4
    stability = 2.78
    reach = 0.25  # nothing else keeps the error of such a step small

    @override
    def advance(self, t: float) -> None:
        rates, h, start, x = self._rates, self._resolution, self.t, self.x
        for step in range(1, whole_steps(start, t, h) + 1):
            x = self._accept(start + step * h, classical_step(rates, x, h))
        self.t, self.x = t, x

    @override
    def aim(self, t: float) -> None:
        whole_steps(self.t, t, self._resolution)

    @override
    def step(self, until: float, longest: float) -> None:
        dt = self._resolution
        end = (math.floor(self.t / dt + _SLIVER) + 1) * dt
        if end > until - _SLIVER * dt:
            end = until
        if end - self.t > longest:
            end = self.t + longest
        if end == self.t:
            raise Diverged(f"the step size fell to nothing at t = {self.t:.6g} s")
        self.t_before, self.x_before = self.t, self.x
        self.x, self.t = self.inside(end), end

    @override
    def inside(self, t: float) -> FloatArray:
        if t == self.t_before:
            return self.x_before
        return self._accept(t, classical_step(self._rates, self.x_before, t - self.t_before))

    def bracket(self, low: float, high: float) -> tuple[float, float]:
        """The whole step of the grid around the event, since within it the step's own error is unknown."""
        start = math.floor(low / self._resolution + _SLIVER) * self._resolution
        return min(start, low), max(start + self._resolution, high)


class DormandPrince853(Integrator):
    """Dormand and Prince's method of order 8 with error control, from scipy.

    One solver is used from :meth:`begin` on. A step ends at each sample, as scipy's interpolant is only of order 7.
    """

    resolution = "rtol"
    order = None
    stability = 6.3  # its step multiplies exp(-λ t) by less than 1 up to 6.39
    reach = 0.6

    @override
    def begin(self, t: float, x: FloatArray, rates: Rates, accept: Accept, scales: FloatArray) -> None:
        super().begin(t, x, rates, accept, scales)
        self._solver = solver_from(lambda _, y: rates(y), t, np.array(x), self._resolution, self._resolution * scales)
        self._watch = StepWatch()
        self._inside = [(t, x)]  # times within the last step, its start first, and states there

    @override
    def advance(self, t: float) -> None:
        while self.t < t:
            self.step(t, math.inf)
            self._watch.took(self.t, self.t - self.t_before, self.t == t)

    @override
    def step(self, until: float, longest: float) -> None:
        self.t_before, self.x_before, self._inside = self.t, self.x, [(self.t, self.x)]
        controlled_step(self._solver, self._accept, until, longest)
        self.t, self.x = float(self._solver.t), self._solver.y

    @override
    def inside(self, t: float) -> FloatArray:
        if t == self.t_before:
            return self.x_before
        if t == self.t:
            return self.x
        start, y = max(
            (entry for entry in self._inside if entry[0] <= t), key=lambda entry: entry[0]
        )  # near a stop it is stiff
        state = integrated_to(self._solver.fun, start, y, t, self._solver.rtol, self._solver.atol)
        self._inside.append((t, state))
        return self._accept(t, state)


INTEGRATORS: Mapping[str, type[Integrator]] = {"rk4": RungeKutta4, "dop853": DormandPrince853}
