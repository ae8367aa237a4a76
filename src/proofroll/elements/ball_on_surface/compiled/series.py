"""A compiled Taylor integrator that is read between the ends of its steps."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged

# Called with the state where the step began, and with a time in that step and the state there; raises Diverged if the
# state is not to be trusted.
Check = Callable[[FloatArray, float, FloatArray], None]

# Called before every few steps with the time [s] and state; the state from which to go on instead, or None.
Renewed = Callable[[float, FloatArray], FloatArray | None]

# Steps between two of these calls. Round-off is not worth one after each step, which would cost a third of the run;
# what happens to the angles in so few steps is bounded by their own step size control.
_RENEWAL = 4

# Longest step [s]: only a motion that is a polynomial of time has no other bound.
_LONGEST = 1e3


class Series:
    """Moves a state in time by steps as long as the tolerance allows.

    A step is a polynomial as accurate as its end, so that a sample costs no step.

    Attributes:
        t, x: present time [s] and state.
    """

    def __init__(
        self, integrator: Any, pars: FloatArray, x: FloatArray, check: Check, renewed: Renewed | None = None
    ) -> None:
        """Starts at time 0, with a copy of heyoka's integrator, for that holds a state."""
        self.t, self.x = 0.0, np.array(x, dtype=np.float64)
        self._integrator, self._check, self._renewed = copy.copy(integrator), check, renewed
        self._steps = 0
        self._integrator.time = 0.0
        self._integrator.pars[:] = pars
        self._integrator.state[:] = x
        self._before = self.x

    def advance(self, t: float) -> None:
        """Moves to time t [s]. Raises Diverged if the state is not finite, or fails the check."""
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
        """Only what was reached is looked at: a step may end beyond."""
        if not np.all(np.isfinite(x)):
            raise Diverged(f"the state is not finite (NaN or overflow) at t = {t:.6g} s")
        self._check(self._before, t, x)


def still_moving(before: FloatArray, t: float, now: FloatArray) -> None:
    """Notices that the centre stood still in a step: rolling resistance has no direction there, and reverses beyond.

    At the other side of rest on a straight path the equations are smooth, so a series may step across. A velocity that
    merely turns does not turn by more than a right angle in a step, for its own turning is what bounds the step.

    Velocities [m/s], shape (k,), are those where the step began and at a time ``t`` [s] in it.

    Raises:
        Diverged: it stood still.
    """
    if float(before @ now) < 0 or not np.any(now):
        raise Diverged(
            f"the ball comes to rest by {t:.6g} s, where rolling resistance has no direction; "
            "with a finite mu_static, however large, engines that can slip go on past that"
        )
