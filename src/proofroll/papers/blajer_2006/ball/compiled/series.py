"""A compiled Taylor integrator with dense output, which samples between the ends of its steps."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged

# Function of the state at the begin of the step, a time [s] in that step, and the state then; raises Diverged if the
# state is not valid.
Check = Callable[[FloatArray, float, FloatArray], None]

# Function of time [s] and state, called every few steps; returns a state to continue from instead, or None.
Renewed = Callable[[float, FloatArray], FloatArray | None]

# Number of steps between two of these calls. A call after each step would cost a third of the run for round-off alone;
# within a few steps the step size control bounds the change of the angles.
_RENEWAL = 4

# Longest step [s]: needed only for a motion that is a polynomial of time, whose steps nothing else bounds.
_LONGEST = 1e3


class Series:
    """Integrates a state by steps as long as the tolerance allows.

    The polynomial of a step is as accurate inside the step as at its end, so that samples cost no steps.

    Attributes:
        t, x: present time [s] and state.
    """

    def __init__(
        self, integrator: Any, pars: FloatArray, x: FloatArray, check: Check, renewed: Renewed | None = None
    ) -> None:
        """Starts at time 0, with a copy of heyoka's integrator, for the original holds a shared state."""
        self.t, self.x = 0.0, np.array(x, dtype=np.float64)
        self._integrator, self._check, self._renewed = copy.copy(integrator), check, renewed
        self._steps = 0
        self._integrator.time = 0.0
        self._integrator.pars[:] = pars
        self._integrator.state[:] = x
        self._before = self.x

    def advance(self, t: float) -> None:
        """Integrates up to time t [s]. Raises Diverged if the state is not finite or fails the check."""
        if t <= self.t:
            return
        series = self._integrator
        while series.time < t:
            self._trusted(float(series.time), series.state)
            self._steps += 1
            if self._renewed is not None and self._steps % _RENEWAL == 0:
                renewed = self._renewed(float(series.time), series.state.copy())
                if renewed is not None:
                    series.state[:] = renewed
            self._before = series.state.copy()
            series.step(_LONGEST, write_tc=True)
        x = series.update_d_output(t).copy()
        self._trusted(t, x)
        self.t, self.x = t, x

    def _trusted(self, t: float, x: FloatArray) -> None:
        """Checks a state at the requested time only, not at the end of the step beyond it.

        Raises Diverged if it is not finite or fails the check.
        """
        if not np.all(np.isfinite(x)):
            raise Diverged(f"the state is not finite (NaN or overflow) at t = {t:.6g} s")
        self._check(self._before, t, x)


def still_moving(start_velocity: FloatArray, t: float, now: FloatArray) -> None:
    """Raises Diverged if the centre came to rest within a step, where the direction of rolling resistance reverses.

    The equations are smooth beyond rest on a straight path, so that a series may step across it. A reversal differs
    from a mere turn of the velocity by its angle: within a step a velocity turns by less than a right angle, for its
    turning bounds the step.

    Args:
        start_velocity: velocity at the begin of the step [m/s], shape (k,).
        t: a time in the step [s].
        now: velocity at ``t`` [m/s], shape (k,).
    """
    if float(start_velocity @ now) < 0 or not np.any(now):
        raise Diverged(
            f"the ball comes to rest by {t:.6g} s, where rolling resistance has no direction; "
            "with a finite mu_static, however large, engines that can slip go on past that"
        )
