"""Time integration of a ball on Pinocchio's configurations."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import controlled_step, solver_from
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged
from proofroll.engines.pinocchio.smooth.joint_tree import require_tangent_map
from proofroll.papers.blajer_2006.pinocchio.composite import Composite
from proofroll.papers.blajer_2006.pinocchio.settings import CompositeSettings


class TangentIntegrator(ABC):
    """Integrator of a ball with constraint rows.

    Attributes:
        t, q, v: time [s], joint configuration and velocity now.
        turns: True if the orientation of the ball is integrated.
    """

    def __init__(self, mechanism: Composite, settings: CompositeSettings) -> None:
        self._mechanism, self._settings = mechanism, settings
        self._model, self._data = mechanism.model, mechanism.model.createData()
        self.turns = bool(settings.orientation)
        self.t, self.q, self.v = 0.0, mechanism.q0.copy(), mechanism.v0.copy()

    def advance(self, end: float) -> None:
        """Advances to ``end`` [s].

        Raises:
            Diverged: no step is small enough, or the rows have become dependent.
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
    """Base of methods with a fixed step ``dt``; subclasses define one step."""

    def __init__(self, mechanism: Composite, settings: CompositeSettings) -> None:
        super().__init__(mechanism, settings)
        # Factors on the joint velocity that moves the configuration: 0 freezes the ball's orientation. The ball's
        # inertia is the same in all axes, so at each instant axes may be chosen that coincide with the carriage's. The
        # spin comes last.
        self._moving = np.ones(self._model.nv)
        self._moving[-3:] = float(self.turns)
        self._dt = float(settings.dt or 0.0)

    def _advance(self, start: float, end: float) -> None:
        for _ in range(whole_steps(start, end, self._dt)):
            self._step(self._acceleration(self.q, self.v))
            if self._settings.projection:
                self.q, self.v = self._mechanism.project(self._data, self.q, self.v)

    def _acceleration(self, q: FloatArray, v: FloatArray) -> FloatArray:
        return np.array(self._mechanism.accelerate(self._data, q, v))

    @abstractmethod
    def _step(self, acceleration: FloatArray) -> None:
        """Makes one step from the state with this acceleration."""


class SemiImplicitEuler(FixedStep):
    """Semi-implicit Euler: first the velocity, then the configuration with the new velocity."""

    def _step(self, acceleration: FloatArray) -> None:
        self.v = self.v + self._dt * acceleration
        self.q = pin.integrate(self._model, self.q, self._dt * self._moving * self.v)


class TangentRungeKutta4(FixedStep):
    """Classical Runge-Kutta scheme; displacements within a step are tangent vectors at its start.

    As usually written, the rate of the displacement is the joint velocity. This holds only in vector spaces: with
    rotations the rate is dexp⁻¹ times the velocity (Munthe-Kaas 1998), and without it the orientation is of order 2.
    ``rk4_dexpinv`` has the term.
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


# Number of components of the orientation in a configuration.
QUATERNION = 4


class Adaptive(TangentIntegrator):
    """DOP853 on configuration and velocity together; an integrated quaternion by its rate (pin.tangentMap).

    The time limit of the solver moves to the next sample, so that a step ends there: the dense output of DOP853 has a
    lower order.
    """

    def __init__(self, mechanism: Composite, settings: CompositeSettings) -> None:
        super().__init__(mechanism, settings)
        if self.turns:
            require_tangent_map()
        # The orientation comes last. Without it (see FixedStep) only the position is integrated,
        # and its rates are joint velocities.
        self._count_q = self._model.nq if self.turns else self._model.nq - QUATERNION
        self._rtol = float(settings.rtol or 0.0)
        # Components in the ball's turning axes pass through zero often: with a hundredth of their natural size the
        # tolerance is relative over most of their range.
        self._atol = 1e-2 * self._rtol * np.concatenate([mechanism.q_scale[: self._count_q], mechanism.v_scale])
        self._solver: Any = None
        self._q = mechanism.q0.copy()

    def _joined(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Integrated state vector."""
        return np.concatenate([q[: self._count_q], v])

    def _split(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Configuration and velocity; the next call overwrites the configuration."""
        n = self._count_q
        if self.turns:  # the rates must not depend on the quaternion's length, which drifts
            return pin.normalize(self._model, y[:n]), y[n:]
        self._q[:n] = y[:n]
        return self._q, y[n:]

    def _rates(self, _: float, y: FloatArray) -> FloatArray:
        """Time derivative of the integrated state vector."""
        if self.turns:
            q, v = self._split(y)
            moved = pin.tangentMap(self._model, q).dot(v)
            return np.concatenate([moved, self._mechanism.accelerate(self._data, q, v)])
        # The same in plain statements, as it runs a dozen times per step.
        n, q = self._count_q, self._q
        v = y[n:]
        q[:n] = y[:n]
        return np.concatenate((v[:n], self._mechanism.accelerate(self._data, q, v)))

    def _advance(self, start: float, end: float) -> None:
        if end <= start:
            return
        if self._solver is None:
            y = self._joined(self.q, self.v)
            self._solver = solver_from(self._rates, start, y, self._rtol, self._atol)
        while self._solver.t < end:
            controlled_step(self._solver, self._accepted, end)
        q, v = self._split(self._solver.y)
        self.q, self.v = q.copy(), v.copy()

    def _accepted(self, _: float, y: FloatArray) -> FloatArray:
        """State after a step, projected onto the constraints if the settings say so."""
        if not self._settings.projection:
            return y
        return self._joined(*self._mechanism.project(self._data, *self._split(y)))
