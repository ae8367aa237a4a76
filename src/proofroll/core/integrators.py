"""Integrators of ẋ = rates(x): one class each, added to INTEGRATORS. None uses values interpolated inside a step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar, Literal, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged

Rates = Callable[[FloatArray], FloatArray]
# Called after each step with its time and state; returns the state to go on from, the very same object if unchanged.
Accept = Callable[[float, FloatArray], FloatArray]

# scipy accepts no relative tolerance below 100 machine epsilons.
TIGHTEST = 100 * float(np.finfo(float).eps)


def classical_step(rates: Rates, x: FloatArray, h: float) -> FloatArray:
    """One step [s] of the classical Runge-Kutta method."""
    k1 = rates(x)
    k2 = rates(x + h / 2 * k1)
    k3 = rates(x + h / 2 * k2)
    k4 = rates(x + h * k3)
    return np.asarray(x + h / 6 * (k1 + 2 * (k2 + k3) + k4))


class Integrator(Protocol):
    """Moves a state in time.

    Attributes:
        resolution: the setting that trades speed for accuracy.
        order: of convergence in ``dt``; None with an adaptive step.
        t, x: present time [s] and state.
    """

    resolution: ClassVar[Literal["dt", "rtol"]]
    order: ClassVar[int | None]
    t: float
    x: FloatArray

    def __init__(self, rates: Rates, accept: Accept, x: FloatArray, scales: FloatArray, resolution: float) -> None:
        """Starts at time 0.

        Args:
            rates: ẋ of x.
            accept: see :data:`Accept`.
            x: initial state.
            scales: natural size of each component of x.
            resolution: value of the setting of that name.
        """

    def advance(self, t: float) -> None:
        """Moves to time t [s] by steps of which the last ends there.

        Raises:
            Diverged: it gave up.
        """


class RungeKutta4:
    """The classical Runge-Kutta method with a fixed step."""

    resolution: ClassVar[Literal["dt", "rtol"]] = "dt"
    order: ClassVar[int | None] = 4

    def __init__(
        self,
        rates: Rates,
        accept: Accept,
        x: FloatArray,
        scales: FloatArray,  # noqa: ARG002 -- a fixed step needs no measure of error
        resolution: float,
    ) -> None:
        self.t, self.x = 0.0, x
        self._rates, self._accept, self._dt = rates, accept, resolution

    def advance(self, t: float) -> None:
        """See :class:`Integrator`."""
        rates, h, start, x = self._rates, self._dt, self.t, self.x
        for step in range(1, whole_steps(start, t, h) + 1):
            x = self._accept(start + step * h, classical_step(rates, x, h))
        self.t, self.x = t, x


class DormandPrince853:
    """Dormand and Prince's method of order 8 with error control, from scipy.

    One solver lives through the whole run. Its bound moves from sample to sample, so that a step ends at each (scipy's
    interpolant is of order 7 only), and the step size that the error control wants survives the shortened last step.
    """

    resolution: ClassVar[Literal["dt", "rtol"]] = "rtol"
    order: ClassVar[int | None] = None

    def __init__(self, rates: Rates, accept: Accept, x: FloatArray, scales: FloatArray, resolution: float) -> None:
        from scipy.integrate import DOP853

        self.t, self.x = 0.0, x
        self._accept = accept
        self._solver = DOP853(lambda _, y: rates(y), 0.0, x, np.inf, rtol=resolution, atol=resolution * scales)

    def advance(self, t: float) -> None:
        """See :class:`Integrator`."""
        solver = self._solver
        if t <= self.t:
            return
        solver.t_bound, solver.status = t, "running"
        while solver.status == "running":
            wanted = solver.h_abs
            message = solver.step()
            if message is not None:
                raise Diverged(f"the step size fell to nothing at t = {solver.t:.6g} s")
            if solver.t == t:
                solver.h_abs = max(wanted, solver.h_abs)
            accepted = self._accept(float(solver.t), solver.y)
            if accepted is not solver.y:
                # The rate that opens the next step must belong to the changed state, or the error control collapses.
                solver.y = accepted
                solver.f = solver.fun(solver.t, accepted)
        self.t, self.x = t, solver.y


INTEGRATORS: Mapping[str, type[Integrator]] = {"rk4": RungeKutta4, "dop853": DormandPrince853}
