"""The least models behind one face: the motion at a time, and what an engine says of it.

They share their equations with the truth's first route; only its second route checks them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.errors import Diverged, Refused
from proofroll.core.integrators import DormandPrince853
from proofroll.elements.ball_on_surface.compiled.library import require_heyoka
from proofroll.elements.ball_on_surface.compiled.rolling import is_uniform, parameters, reduced, supports
from proofroll.elements.ball_on_surface.compiled.rolling import start as start_along_arc
from proofroll.elements.ball_on_surface.compiled.series import Series, still_moving
from proofroll.elements.ball_on_surface.mechanics import natural_speed
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion, world_motion
from proofroll.elements.ball_on_surface.rolling_equations import closed_form, placed, reduced_rates, start
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample, terms_held

# A step shorter than this part of the way to the next sample leads nowhere.
_STUCK = 1e-12


class ReducedModel(ABC):
    """A run of a model; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall) -> None:
        self._body = body

    @abstractmethod
    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""

    @abstractmethod
    def motion(self) -> BallMotion:
        """State and force now, each shape (1, 3)."""

    def spin_rate(self) -> float | None:
        """ω̇1 now [rad/s²]; None: the model has no equation for it."""
        return None

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`. The orientation is not followed: nothing needs it."""
        motion = self.motion()
        return BallSample(
            p_WB=motion.p_WB[0].copy(),
            v_WB=motion.v_WB[0].copy(),
            w_WB=motion.w_WB[0].copy(),
            force=motion.force[0].copy(),
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        body, motion = self._body, self.motion()
        ball, f = body.ball, body.contact.rolling_resistance
        acceleration = motion.force[0] / ball.mass + body.gravity
        return BallBuilt(
            mass=ball.mass,
            inertia=np.full(3, ball.inertia),
            gravity=body.gravity.copy(),
            ball_radius=ball.radius,
            rolling_resistance=f,
            acceleration=acceleration,
            angular_acceleration=self._turning(motion.p_WB[0], motion.v_WB[0], motion.w_WB[0], acceleration),
            terms=terms_held(resists=f),
        )

    def _turning(self, p: FloatArray, v: FloatArray, w: FloatArray, acceleration: FloatArray) -> FloatArray | None:
        """ω̇ [rad/s²], shape (3,): rate of ω = ω1 e1 - e1 × v / a."""
        spin_rate, surface = self.spin_rate(), self._body.surface
        if spin_rate is None:
            return None
        e1 = surface.normal(p)
        e1_rate, v0 = surface.normal_gradient(p) @ v, v
        if (W := self._body.wall_rate) is not None:  # the ball rolls on what the wall does not carry along
            v = v - cross(W, p + self._body.ball.radius * e1)
            acceleration = acceleration - cross(W, v0 + self._body.ball.radius * e1_rate)
        swung = cross(e1_rate, v) + cross(e1, acceleration)
        return np.asarray(spin_rate * e1 + (w @ e1) * e1_rate - swung / self._body.ball.radius)


class ClosedFormModel(ReducedModel):
    """The closed form."""

    def __init__(self, body: RollingBall) -> None:
        if body.contact.rolling_resistance > 0:
            raise Refused("there is no closed form with rolling resistance; take formulation=equations")
        super().__init__(body)
        motion = closed_form(body, np.zeros(1))
        if motion is None:
            raise Refused(
                "closed forms are known on a plane and in a cylinder along whose axis gravity points, not here; "
                "take formulation=equations"
            )
        self._motion = motion

    def advance(self, t: float) -> None:
        """See :class:`ReducedModel`."""
        motion = closed_form(self._body, np.array([t]))
        assert motion is not None  # whether there is one does not depend on time
        self._motion = motion

    def motion(self) -> BallMotion:
        """See :class:`ReducedModel`."""
        return self._motion


class Integrated(ReducedModel):
    """The reduced equations by Dormand and Prince's method of order 8; a step ends at each sample."""

    def __init__(self, body: RollingBall, rtol: float) -> None:
        super().__init__(body)
        self._span = 0.0
        speed = natural_speed(body)
        self._scales = np.array(body.surface.length_scales)
        a, per_metre = body.ball.radius, 1 / self._scales
        scales = np.concatenate([a * per_metre, speed * per_metre, [speed / a]])
        x = start(body)
        self._motion = DormandPrince853(rtol)
        self._motion.begin(0.0, x, lambda x: reduced_rates(body, x)[0], self._accepted, scales)
        self._last, self._until = (0.0, x), 0.0

    def advance(self, t: float) -> None:
        """See :class:`ReducedModel`."""
        self._span, self._until = t - self._motion.t, t
        self._motion.advance(t)

    def _accepted(self, t: float, x: FloatArray) -> FloatArray:
        (before, y), self._last = self._last, (t, x)
        if t < self._until and t - before < _STUCK * self._span:
            raise Diverged(f"the step size fell to nothing at t = {t:.6g} s")
        if not np.all(np.isfinite(x)):
            raise Diverged(f"the state is not finite (NaN or overflow) at t = {t:.6g} s")
        if self._body.contact.rolling_resistance > 0:
            still_moving(self._along(y), t, self._along(x))
        return x

    def _along(self, x: FloatArray) -> FloatArray:
        """Velocity of the centre along the coordinates [m/s], shape (2,)."""
        return np.asarray(x[2:4] * self._scales)

    def motion(self) -> BallMotion:
        """See :class:`ReducedModel`."""
        x = self._motion.x
        _, v, force = reduced_rates(self._body, x)
        return BallMotion(*placed(self._body, x[None, :], v[None, :]), force[None, :], "reduced equations")

    def spin_rate(self) -> float:
        """See :class:`ReducedModel`."""
        return float(reduced_rates(self._body, self._motion.x)[0][4])


class Compiled(ReducedModel):
    """The reduced equations on a cylinder or plane by compiled Taylor series."""

    def __init__(self, body: RollingBall, rtol: float) -> None:
        if not supports(body):
            raise Refused("integrator=taylor has equations of cylinders and planes only; take integrator=dop853")
        require_heyoka("integrator=taylor")
        super().__init__(body)
        self._pars = parameters(body)
        self._resistance = body.contact.rolling_resistance > 0
        model = reduced(self._resistance, is_uniform(body), rtol)
        pars = np.array(self._pars[: len(model.integrator.pars)])
        self._evaluate = model.evaluate
        self._series = Series(model.integrator, pars, start_along_arc(body), self._check)

    def _check(self, before: FloatArray, t: float, x: FloatArray) -> None:
        if self._resistance:
            still_moving(before[2:4], t, x[2:4])

    def advance(self, t: float) -> None:
        """See :class:`ReducedModel`."""
        self._series.advance(t)

    def motion(self) -> BallMotion:
        """See :class:`ReducedModel`."""
        x, ball = self._series.x, self._body.ball
        held2, held3, N = self._evaluate(x, self._pars)[5:]
        return world_motion(
            self._body,
            x[None, :2] / np.array(self._body.surface.length_scales),
            velocity=x[None, 2:4],
            spin=x[4:],
            slip=np.zeros((1, 2)),
            friction=-ball.mass * np.array([[held2, held3]]),
            press=ball.mass * np.array([N]),
            route="reduced equations, Taylor series",
        )

    def spin_rate(self) -> float:
        """See :class:`ReducedModel`."""
        return float(self._evaluate(self._series.x, self._pars)[4])
