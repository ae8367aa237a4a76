"""Time stepping on the configurations of Pinocchio."""

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import controlled_step, solver_from
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import Event
from proofroll.engines.pinocchio.ball_with_rows import BallWithRows, left_the_wall
from proofroll.engines.pinocchio.settings import PinocchioSettings


def require_tangent_map() -> None:
    """Raises Refused where this version has no rates of quaternions."""
    if not hasattr(pin, "tangentMap"):
        raise Refused(f"the rates of quaternions need tangentMap of pinocchio 4.0, and this is {pin.__version__}")


class TangentIntegrator(ABC):
    """Moves the state of a mechanism.

    Attributes:
        t, q, v: time [s], joint configuration and velocity now.
        turns: whether the orientation of the ball is integrated.
        events: so far; of a ball that cannot slip, that it left the wall.
        mu_static: largest |F|/N while sticking [1]; None: the rows of rolling hold always.
        sticking: whether the ball sticks now; None where it cannot slip.
    """

    mu_static: float | None = None
    sticking: bool | None = None

    def __init__(self, mechanism: BallWithRows, settings: PinocchioSettings) -> None:
        self._mechanism, self._settings = mechanism, settings
        self._model, self._data = mechanism.model, mechanism.model.createData()
        self.turns = bool(settings.orientation)
        self.events: list[Event] = []
        self.t, self.q, self.v = 0.0, mechanism.q0.copy(), mechanism.v0.copy()

    def advance(self, end: float) -> None:
        """Advances to ``end`` [s].

        Raises:
            Diverged: no step is small enough, the rows have become dependent, or the wall would have to pull.
        """
        start = self.t
        try:
            self._advance(start, end)
        except np.linalg.LinAlgError as error:
            raise Diverged(f"the equations became singular between {start:g} s and {end:g} s ({error})") from None
        self.t = end

    @abstractmethod
    def _advance(self, start: float, end: float) -> None:
        """Advances from ``start`` to ``end`` [s]."""

    def reaction(self, data: Any) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration, and force of the wall on the ball in the world [N], now."""
        return self._mechanism.reaction(data, self.q, self.v)


class FixedStep(TangentIntegrator):
    """Steps of ``dt``; subclasses say what one step is."""

    def __init__(self, mechanism: BallWithRows, settings: PinocchioSettings) -> None:
        super().__init__(mechanism, settings)
        # Factors on the joint velocity where it moves the configuration: 0 holds the ball's orientation. Isotropy: the
        # inertia of the ball is the same in any axes fixed in it, so at each instant axes may be chosen that coincide
        # with the carriage's (or the world's). In both formulations the spin is last.
        self._moving = np.ones(self._model.nv)
        self._moving[-3:] = float(self.turns)
        self._dt = float(settings.dt or 0.0)
        self._start: FloatArray | None = None

    def _advance(self, start: float, end: float) -> None:
        for number in range(whole_steps(start, end, self._dt)):
            self._advance_one(start + number * self._dt)

    def _advance_one(self, time: float) -> None:
        self._step(self._pressed(time) if self._start is None else self._start)
        if self._settings.projection:
            self.q, self.v = self._mechanism.project(self._data, self.q, self.v)
        self._start = self._pressed(time + self._dt)

    def _pressed(self, time: float) -> FloatArray:
        """Acceleration at the end of a step, with which the next one starts; ends the run if the wall would pull."""
        acceleration = self._acceleration(self.q, self.v)
        if self._mechanism.normal_force(self._data) < -self._mechanism.faint:
            self.events.append(Event("lift_off", time - 0.5 * self._dt, time - self._dt, time))
            raise left_the_wall(f"before {time:.6g} s")
        return acceleration

    def _acceleration(self, q: FloatArray, v: FloatArray) -> FloatArray:
        return np.array(self._mechanism.accelerate(self._data, q, v))

    @abstractmethod
    def _step(self, acceleration: FloatArray) -> None:
        """One step; the acceleration is that at its start."""


class SemiImplicitEuler(FixedStep):
    """Velocity first, then the configuration with the new velocity."""

    def _step(self, acceleration: FloatArray) -> None:
        self.v = self.v + self._dt * acceleration
        self.q = pin.integrate(self._model, self.q, self._dt * self._moving * self.v)


class TangentRungeKutta4(FixedStep):
    """The classical scheme; displacements within a step are tangent vectors at its start.

    As usually written, the displacement's rate is taken to be the joint velocity. That is so only where
    configurations form a vector space: with rotations the rate is dexp⁻¹ times the velocity (Munthe-Kaas 1998), and
    without it the orientation is of order 2. ``rk4_dexpinv`` has the term.
    """

    def _rate(self, displacement: FloatArray, v: FloatArray) -> FloatArray:
        moving = self._moving * v
        if self._settings.integrator == "rk4":
            return moving
        dexp = pin.dIntegrate(self._model, self.q, displacement, pin.ARG1)
        return np.asarray(np.linalg.solve(dexp, moving))

    def _step(self, acceleration: FloatArray) -> None:
        h, rates, accelerations = self._dt, [self._moving * self.v], [acceleration]
        for reach in (0.5 * h, 0.5 * h, h):
            displacement = reach * rates[-1]
            q = pin.integrate(self._model, self.q, displacement)
            v = self.v + reach * accelerations[-1]
            rates.append(self._rate(displacement, v))
            accelerations.append(self._acceleration(q, v))
        q1, q2, q3, q4 = rates
        v1, v2, v3, v4 = accelerations
        self.q = pin.integrate(self._model, self.q, h / 6 * (q1 + 2 * (q2 + q3) + q4))
        self.v = self.v + h / 6 * (v1 + 2 * (v2 + v3) + v4)


# A step shorter than this part of the time in which the ball turns by a radian, this many times in a row, leads
# nowhere: ordinary steps are a hundred times longer, and one jump of the forces is passed in a few dozen.
SHORT = 1e-4
PATIENCE = 500
# Numbers of the ball's orientation in a configuration.
QUATERNION = 4


class Adaptive(TangentIntegrator):
    """DOP853 on configuration and velocity together, the quaternion by its rate (pin.tangentMap) if it is integrated.

    One solver lives from event to event. Its bound moves from sample to sample, so that a step ends at each: the dense
    output of DOP853 has a lower order.
    """

    def __init__(self, mechanism: BallWithRows, settings: PinocchioSettings) -> None:
        super().__init__(mechanism, settings)
        if self.turns:
            require_tangent_map()
        # In both formulations the orientation is last. Without it, see FixedStep, no more than the place is integrated,
        # and its rates are velocities of the joints.
        self._places = self._model.nq if self.turns else self._model.nq - QUATERNION
        self._rtol = float(settings.rtol or 0.0)
        # Components in the ball's turning axes pass through zero all the time: a hundredth of their natural size
        # keeps the tolerance relative to most of their range.
        self._atol = 1e-2 * self._rtol * np.concatenate([mechanism.q_scale[: self._places], mechanism.v_scale])
        self._turning_time = mechanism.q_scale[0] / mechanism.v_scale[0]
        self._solver: Any = None
        self._short_steps = 0
        self._q = mechanism.q0.copy()

    def _joined(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """State vector that is integrated."""
        return np.concatenate([q[: self._places], v])

    def _split(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Configuration and velocity; the next call overwrites the configuration."""
        n = self._places
        if self.turns:  # the rates must not depend on the length to which the quaternion has drifted
            return pin.normalize(self._model, y[:n]), y[n:]
        self._q[:n] = y[:n]
        return self._q, y[n:]

    def _moved(self, q: FloatArray, v: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Rates of what is integrated."""
        return np.concatenate(
            [pin.tangentMap(self._model, q).dot(v) if self.turns else v[: self._places], acceleration]
        )

    def _rates(self, _: float, y: FloatArray) -> FloatArray:
        if self.turns:
            q, v = self._split(y)
            return self._moved(q, v, self._mechanism.accelerate(self._data, q, v))
        # The same as plain statements, for it runs a dozen times a step.
        n, q = self._places, self._q
        v = y[n:]
        q[:n] = y[:n]
        return np.concatenate((v[:n], self._mechanism.accelerate(self._data, q, v)))

    def _solver_from(self, rates: Any, start: float, y: FloatArray) -> Any:
        return solver_from(rates, start, y, self._rtol, self._atol)

    def _advance(self, start: float, end: float) -> None:
        if end <= start:
            return
        self._short_steps = 0
        if self._solver is None:
            self._solver = self._solver_from(self._rates, start, self._joined(self.q, self.v))
        solver = self._solver
        while solver.t < end:
            self._make_step(solver, end)
            # The rates that were found last are those at the end of the step, with projection or without.
            if self._mechanism.normal_force(self._data) < -self._mechanism.faint:
                self.events.append(Event("lift_off", 0.5 * (solver.t_old + solver.t), solver.t_old, solver.t))
                raise left_the_wall(f"before {solver.t:.6g} s")
        self._keep(solver.y)

    def _keep(self, y: FloatArray) -> None:
        q, v = self._split(y)
        self.q, self.v = q.copy(), v.copy()

    def _make_step(self, solver: Any, end: float, most: float = math.inf) -> None:
        """One step, to ``end`` [s] at most and no longer than ``most`` [s]; ends the run if steps become too short."""
        controlled_step(solver, self._accepted, end, most)
        longest = SHORT * self._turning_time
        is_short = solver.step_size < longest
        if is_short:
            faster = float(np.max(np.abs(solver.y[self._places :]) / self._mechanism.v_scale))
            is_short = solver.step_size * max(1.0, faster) < longest
        self._short_steps = self._short_steps + 1 if is_short else 0
        if self._short_steps > PATIENCE:
            raise Diverged(
                f"the steps became too short at {solver.t:g} s: the forces jump there, as rolling resistance "
                "does when the ball comes to rest"
            )

    def _accepted(self, _: float, y: FloatArray) -> FloatArray:
        """The state after a step put back on the constraints, if that is wanted."""
        if not self._settings.projection:
            return y
        return self._joined(*self._mechanism.project(self._data, *self._split(y)))
