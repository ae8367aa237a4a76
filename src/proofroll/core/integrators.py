"""Integrators of ẋ = rates(x): one class each, added to INTEGRATORS. None uses values interpolated inside a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged
from proofroll.core.stalling import StepWatch

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


def controlled_step(solver: Any, accept: Accept, until: float, longest: float = math.inf) -> None:
    """One step of a solver of scipy, at most of a length [s] and at most to the time ``until`` [s].

    The step size that the error control wants survives a step that was shortened to end there.

    Raises:
        Diverged: no step is small enough.
    """
    solver.t_bound, solver.status, solver.max_step = until, "running", longest
    wanted = solver.h_abs
    if solver.step() is not None:
        raise Diverged(f"the step size fell to nothing at t = {solver.t:.6g} s")
    if solver.t == until:
        solver.h_abs = max(wanted, solver.h_abs)
    accepted = accept(float(solver.t), solver.y)
    if accepted is not solver.y:
        # The rate that opens the next step must belong to the changed state, or the error control collapses.
        solver.y, solver.f = accepted, solver.fun(solver.t, accepted)


def inside_last_step(solver: Any, t: float) -> FloatArray:
    """The state at a time [s] within the last step of a DOP853 solver, integrated from where that step began.

    Raises:
        Diverged: no step is small enough.
    """
    if t <= solver.t_old:
        return np.asarray(solver.y_old)
    from scipy.integrate import DOP853

    h, options = t - solver.t_old, {"rtol": solver.rtol, "atol": solver.atol}
    part = DOP853(solver.fun, solver.t_old, solver.y_old, t, first_step=h, **options)
    while part.status == "running":
        controlled_step(part, lambda _, y: y, t)
    return np.asarray(part.y)


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
        """Moves to time t [s]; the last step ends there.

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

    One solver lives through the whole run. Its bound moves from sample to sample, so that a step ends at each: scipy's
    interpolant is of order 7 only.
    """

    resolution: ClassVar[Literal["dt", "rtol"]] = "rtol"
    order: ClassVar[int | None] = None

    def __init__(self, rates: Rates, accept: Accept, x: FloatArray, scales: FloatArray, resolution: float) -> None:
        from scipy.integrate import DOP853

        self.t, self.x = 0.0, x
        self._accept, self._watch = accept, StepWatch()
        self._solver = DOP853(lambda _, y: rates(y), 0.0, x, np.inf, rtol=resolution, atol=resolution * scales)

    def advance(self, t: float) -> None:
        """See :class:`Integrator`."""
        solver = self._solver
        if t <= self.t:
            return
        while solver.t < t:
            begun = solver.t
            controlled_step(solver, self._accept, t)
            self.x = solver.y
            self._watch.took(float(solver.t), float(solver.t - begun), solver.t == t)
        self.t, self.x = t, solver.y


INTEGRATORS: Mapping[str, type[Integrator]] = {"rk4": RungeKutta4, "dop853": DormandPrince853}
