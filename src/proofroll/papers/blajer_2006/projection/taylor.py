"""Equations of the projection method, solved symbolically, as compiled Taylor series (heyoka)."""

from collections.abc import Callable

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.heyoka_library import require_heyoka
from proofroll.papers.blajer_2006.ball.compiled.projection import Formulation, parameters, projected, structure
from proofroll.papers.blajer_2006.ball.compiled.series import Renewed, Series, still_moving
from proofroll.papers.blajer_2006.ball.model import RollingBall


class TaylorSeries(Series):
    """Motion of a ball that rolls without slip, in the state x = [q, s], with steps as long as the tolerance allows.

    A step is exact to the last digits, and the equations keep C v constant, so only round-off violates the constraints.
    It accumulates over thousands of oscillations, and is removed like any other violation.
    """

    def __init__(
        self,
        body: RollingBall,
        formulation: Formulation,
        x: FloatArray,
        rtol: float,
        check: Callable[..., None],
        accepted: Renewed,
    ) -> None:
        """Starts at time 0 in the state x, with the relative tolerance ``rtol`` of a step [1].

        After each step ``check`` is called with time [s] and state, and raises Diverged if it is not reliable;
        ``accepted`` gives the state from which the motion goes on, see ``Renewed`` of :mod:`compiled.series`.

        Raises:
            Missing: heyoka is not installed.
        """
        require_heyoka("integrator=taylor")
        model = projected(structure(body, formulation), rtol)
        self._pars, self._evaluate = parameters(body), model.evaluate
        self._trust, self._resistance = check, body.contact.rolling_resistance > 0
        self._scales, self._mass = np.array(body.surface.length_scales), body.ball.mass
        pars = np.array(self._pars[: len(model.integrator.pars)])
        super().__init__(model.integrator, pars, x, self._look, accepted)

    def _look(self, old_state: FloatArray, t: float, x: FloatArray) -> None:
        self._trust(t, x)
        if self._resistance:
            still_moving(self._along(old_state), t, self._along(x))

    def _along(self, x: FloatArray) -> FloatArray:
        """Velocity of the centre along the coordinates [m/s], shape (2,)."""
        return np.asarray(x[-5:-3] * self._scales)

    @property
    def rates(self) -> FloatArray:
        """Present time derivative ẋ."""
        return self._evaluate(self.x, self._pars)[:-3]

    @property
    def force(self) -> FloatArray:
        """Present force of the wall on the ball in local axes, (-N, -λ1, -λ2) [N], shape (3,)."""
        return -self._mass * self._evaluate(self.x, self._pars)[-3:]
