"""Stick and slip: laws of motion in turn, and the times at which they change.

With a fixed step the law changes between steps, and each event lies within one. With an adaptive step there are three
laws, and events are located.

While sticking, the rolling rows hold. While sliding, friction mu_kinetic N acts opposite to the slip velocity u. At the
start of a slip, called *creeping*, the direction u/|u| is at first undefined, and then stiff like 1/|u|; friction takes
the direction to which the stiff one converges. If b is the rate of u without friction, and G the rate by which friction
reduces |u|, this is the direction of b, lagging by |u| ω_b / (2|b| - G) while b turns at ω_b.
"""

import math
from enum import Enum, auto
from typing import Any

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.event_location import Rise, locate_rise
from proofroll.core.events import Event, EventKind
from proofroll.elements.mechanism.scene.balls import Contact
from proofroll.engines.pinocchio.ball.ball_with_rows import NOISE, BallWithRows, SlidingContact, left_the_wall, unit
from proofroll.engines.pinocchio.ball.integrators import Adaptive, FixedStep, SemiImplicitEuler, TangentRungeKutta4
from proofroll.engines.pinocchio.settings import PinocchioSettings

# |u| at which creeping ends, relative to |b|/ω_b; the error of its direction is of the order of the square.
_HANDOVER = 1e-4
# |u| below which the rest of a slip is extrapolated, relative to its value at the end of creeping.
_FLOOR = 1e-6
# Least values of both, relative to the speed that friction gives while the ball rolls by a radian: a slip that barely
# starts has no |b| as a scale, and |u| below round-off never ends.
_LEAST_HANDOVER, _LEAST_FLOOR = 1e-10, 1e-14
# Fraction of the time left until |u| = 0 that one step may take.
_APPROACH = 0.7
# Time span over which the turning of b is measured, relative to the time in which the ball rolls by a radian.
_SPAN = 1e-4
# Time, in the same unit, in which a steady b is taken to turn by a radian.
_STEADY = 100.0

# Excess at which slip starts. It is above round-off, so that a peak that only touches the cone cannot start a slip that
# ends at once and starts again; where the excess rises, it delays the slip by about as many seconds.
_GRAZE = 1e-12


class FrictionLaw(Enum):
    """Law of motion that holds now."""

    STICKING = auto()
    CREEPING = auto()
    SLIDING = auto()


class AdaptiveStickSlip(Adaptive):
    """DOP853 from event to event."""

    mu_static: float

    def __init__(self, mechanism: BallWithRows, settings: PinocchioSettings, contact: Contact) -> None:
        super().__init__(mechanism, settings)
        self.mu_static = contact.mu_static
        self._span = _SPAN * self._turning_time
        self._handover = self._floor = self._least = 0.0
        self._mode = FrictionLaw.STICKING
        self._monitored = 0.0, 0.0, 0.0
        y = self._joined(self.q, self.v)
        if self._excess(y) > 0:
            self._record(EventKind.SLIP, 0.0, 0.0)
            self._creep(y)

    @property
    def sticking(self) -> bool:  # type: ignore[override]  # True if the ball sticks now.
        """True if the ball sticks now."""
        return self._mode is FrictionLaw.STICKING

    @override
    def reaction(self, data: Any) -> tuple[FloatArray, FloatArray]:
        if self.sticking:
            return super().reaction(data)
        direction = self._direction(data, self._joined(self.q, self.v))
        return self._mechanism.sliding_reaction(data, self.q, self.v, direction)

    def _advance(self, start: float, end: float) -> None:
        while start < end:
            start = self._stretch(start, end)

    # -- the laws ---------------------------------------------------------------------------------------------------

    def _slide(self, data: Any, y: FloatArray, direction: FloatArray) -> SlidingContact:
        return self._mechanism.slide(data, *self._split(y), direction)

    def _excess(self, y: FloatArray) -> float:
        return self._mechanism.excess(self._data, *self._split(y), self.mu_static)[0]

    def _turning(self, data: Any, y: FloatArray) -> tuple[SlidingContact, FloatArray]:
        """Frictionless motion, and the rate at which the direction of its slip_rate turns [1/s], shape (3,)."""
        free = self._slide(data, y, np.zeros(3))
        direction = unit(free.slip_rate)
        ahead = y + self._span * self._sliding_rates(data, y, direction)[0]
        return free, (unit(self._slide(data, ahead, np.zeros(3)).slip_rate) - direction) / self._span

    def _direction(self, data: Any, y: FloatArray) -> FloatArray:
        """Direction of slip, which friction opposes, as a unit vector, shape (3,)."""
        if self._mode is FrictionLaw.SLIDING:
            return unit(self._slide(data, y, np.zeros(3)).slip)
        free, turning = self._turning(data, y)
        direction, strength = unit(free.slip_rate), math.sqrt(free.slip_rate @ free.slip_rate)
        grip = strength - direction @ self._slide(data, y, direction).slip_rate
        size = max(float(free.slip @ direction), 0.0)
        lag = size / (2 * strength - grip) if 2 * strength > grip else 0.0
        tangential = turning - (turning @ free.e1) * free.e1
        return unit(direction - lag * tangential)

    def _sliding_rates(self, data: Any, y: FloatArray, direction: FloatArray) -> tuple[FloatArray, SlidingContact]:
        q, v = self._split(y)
        sliding = self._mechanism.slide(data, q, v, direction)
        return self._moved(q, v, sliding.acceleration), sliding

    def _law(self, _: float, y: FloatArray) -> FloatArray:
        """Rates of the integrated state while the ball slips."""
        return self._sliding_rates(self._data, y, self._direction(self._data, y))[0]

    def _speed(self, y: FloatArray) -> tuple[float, float, float]:
        """Slip speed |u| [m/s], signed while creeping, its rate [m/s²], and normal force N [N]."""
        direction = self._direction(self._data, y)
        sliding = self._slide(self._data, y, direction)
        return float(sliding.slip @ direction), float(sliding.slip_rate @ direction), sliding.normal_force

    # -- from event to event ----------------------------------------------------------------------------------------

    def _stretch(self, start: float, end: float) -> float:
        """Integrates in the present mode until it changes or to ``end``; returns that time [s]."""
        if self._solver is None:
            y = self._joined(self.q, self.v)
            law = self._rates if self._mode is FrictionLaw.STICKING else self._law  # one solver for each mode
            self._solver, self._short_steps = self._solver_from(law, start, y), 0
            self._monitored = self._monitor(y)
        solver, monitor = self._solver, self._monitored
        while solver.t < end:
            longest = math.inf
            if self._mode is FrictionLaw.SLIDING:
                left = monitor[0] / -monitor[1] if monitor[1] < 0 else math.inf
                if monitor[0] <= self._floor and left < math.inf:
                    stop = solver.t + left
                    if stop > end:
                        return self._rest_of_slip(solver, end)
                    return self._switch(stop, left, solver.y + left * solver.f)
                longest = max(_APPROACH * left, 1e-300)
            self._make_step(solver, end, longest)
            last_monitor, monitor = monitor, self._after_step(solver.y)
            stop = self._stop(solver, last_monitor, monitor)
            if monitor[2] < -self._mechanism.faint:
                self._leave(solver, stop)
            if stop is not None:
                return self._switch(*stop[:3])
        self._monitored = monitor
        self._keep(solver.y)
        return end

    def _rest_of_slip(self, solver: Any, end: float) -> float:
        """Extrapolates to ``end`` [s] a slip that is almost over and ends later."""
        self._keep(solver.y + (end - solver.t) * solver.f)
        self._solver = None
        return end

    def _after_step(self, y: FloatArray) -> tuple[float, float, float]:
        """Values of :meth:`_monitor` after a step."""
        if self._mode is not FrictionLaw.STICKING:
            return self._speed(y)
        # The last evaluated rates belong to the end of the step, with or without projection.
        beyond, normal_force = self._mechanism.last_excess(self._data, self.mu_static)
        return beyond, 0.0, normal_force

    def _accepted(self, t: float, y: FloatArray) -> FloatArray:
        if self._mode is FrictionLaw.STICKING or not self._settings.projection:
            return super()._accepted(t, y)
        q, v = self._split(y)
        back = self._mechanism.project_sliding(self._data, q, v)
        return y if back[1] is v else self._joined(*back)

    def _monitor(self, y: FloatArray) -> tuple[float, float, float]:
        """Margin of the mode (sticking: excess of needed friction, 0; else |u| and its rate), and N [N]."""
        if self._mode is not FrictionLaw.STICKING:
            return self._speed(y)
        beyond, normal_force = self._mechanism.excess(self._data, *self._split(y), self.mu_static)
        return beyond, 0.0, normal_force

    def _stop(self, solver: Any, old: tuple[float, float, float], new: tuple[float, float, float]) -> Rise | None:
        """End of the mode within the last step; None: it goes on."""
        if self._mode is FrictionLaw.STICKING:
            # The excess lies in [-1, 1] and its peaks are many steps wide, so far below zero no event is missed.
            if max(old[0], new[0]) < -0.1 - abs(new[0] - old[0]):
                return None
            return locate_rise(solver, lambda y: np.array([self._excess(y) - _GRAZE]))
        if self._mode is FrictionLaw.CREEPING:
            if new[0] >= self._handover:
                return locate_rise(solver, lambda y: np.array([self._speed(y)[0] - self._handover]))
            # Below zero by more than round-off, or the zero at the start would be found again.
            if new[0] < -self._least and new[1] < 0:
                return locate_rise(solver, lambda y: np.array([-self._speed(y)[0] - self._least]))
        return None

    def _leave(self, solver: Any, stop: Rise | None) -> None:
        """Ends the run if N falls through zero and the ball leaves the wall before the mode ends."""
        lift = locate_rise(solver, lambda y: np.array([-self._monitor(y)[2]]))
        time, width = lift[:2] if lift else (float(solver.t), float(solver.step_size))
        if stop is None or time <= stop[0]:
            self._record(EventKind.LIFT_OFF, time, width)
            raise left_the_wall(f"at {time:.6g} s")

    def _switch(self, time: float, width: float, y: FloatArray) -> float:
        """Enters the mode that follows from the state at the end of the last one; returns the time [s]."""
        self._solver = None
        self._keep(y)
        was = self._mode
        if was is FrictionLaw.CREEPING and self._speed(y)[0] > 0.5 * self._handover:
            self._mode = FrictionLaw.SLIDING
            return time
        # The contact point is at rest within round-off; the ball sticks if it can.
        self.q, self.v = self._mechanism.project(self._data, self.q, self.v)
        y = self._joined(self.q, self.v)
        if was is FrictionLaw.STICKING:
            self._record(EventKind.SLIP, time, width)
            self._creep(y)
        elif self._excess(y) <= NOISE:
            self._mode = FrictionLaw.STICKING
            self._record(EventKind.STICK, time, width)
        else:
            self._creep(y)
        return time

    def _creep(self, y: FloatArray) -> None:
        self._mode = FrictionLaw.CREEPING
        free, turning = self._turning(self._data, y)
        rate = max(math.sqrt(turning @ turning), 1.0 / (_STEADY * self._turning_time))
        direction, strength = unit(free.slip_rate), math.sqrt(free.slip_rate @ free.slip_rate)
        grip = strength - float(direction @ self._slide(self._data, y, direction).slip_rate)
        self._handover = max(_HANDOVER * strength / rate, _LEAST_HANDOVER * grip * self._turning_time)
        self._least = _LEAST_FLOOR * grip * self._turning_time
        self._floor = max(_FLOOR * self._handover, self._least)

    def _record(self, kind: EventKind, time: float, width: float) -> None:
        width += 4 * float(np.spacing(time))
        self.events.append(Event(kind, time, max(time - width, 0.0), time + width))


class FixedStickSlip(FixedStep):
    """Mixin for the schemes of :mod:`~proofroll.engines.pinocchio.ball.integrators`.

    The time of an event is interpolated; its bracket is the step.
    """

    mu_static: float
    sticking: bool

    def __init__(self, mechanism: BallWithRows, settings: PinocchioSettings, contact: Contact) -> None:
        super().__init__(mechanism, settings)
        self.mu_static = contact.mu_static
        self._excess, self._normal_force = mechanism.excess(self._data, self.q, self.v, self.mu_static)
        self.sticking = self._excess <= 0
        self._free = self._without_friction()
        if not self.sticking:
            self.events.append(Event(EventKind.SLIP, 0.0, 0.0, 0.0))

    @override
    def reaction(self, data: Any) -> tuple[FloatArray, FloatArray]:
        if self.sticking:
            return super().reaction(data)
        direction = self._direction(data, self.q, self.v)
        return self._mechanism.sliding_reaction(data, self.q, self.v, direction)

    def _advance_one(self, time: float) -> None:
        if not self.sticking:
            self._stick_if_it_can(time)
        self._step(self._acceleration(self.q, self.v))
        if self._settings.projection:
            put_back = self._mechanism.project if self.sticking else self._mechanism.project_sliding
            self.q, self.v = put_back(self._data, self.q, self.v)
        if self.sticking:
            old_excess = self._excess
            self._excess, normal_force = self._mechanism.excess(self._data, self.q, self.v, self.mu_static)
            if self._excess <= 0:
                self._must_press(time + self._dt, normal_force)
                return
            part = min(max(old_excess / (old_excess - self._excess), 0.0), 1.0) if old_excess < 0 else 0.0
            self.events.append(Event(EventKind.SLIP, time + part * self._dt, time, time + self._dt))
            self.sticking = False
        self._free = self._without_friction()
        self._must_press(time + self._dt, self._free.normal_force)

    def _without_friction(self) -> SlidingContact:
        return self._mechanism.slide(self._data, self.q, self.v, np.zeros(3))

    def _must_press(self, time: float, normal_force: float) -> None:
        """Stores N [N]; ends the run if the wall would have to pull."""
        last_force, self._normal_force = self._normal_force, normal_force
        if normal_force >= -self._mechanism.faint:
            return
        low = max(time - self._dt, 0.0)
        best = low + (time - low) * last_force / (last_force - normal_force) if last_force > 0 else low
        best = max([best, *(event.time for event in self.events[-1:])])  # not before a slip in the same step
        self.events.append(Event(EventKind.LIFT_OFF, best, low, time))
        raise left_the_wall(f"at {best:.6g} s")

    def _stick_if_it_can(self, time: float) -> None:
        """Starts sticking if friction can stop the contact point within the step and then hold it."""
        free = self._free
        ahead = free.slip + self._dt * free.slip_rate
        # slip velocity that friction removes in a step if it acts along that velocity, divided by dt
        taken = free.slip_rate - self._mechanism.slide(self._data, self.q, self.v, unit(ahead)).slip_rate
        if math.sqrt(ahead @ ahead) > self._dt * math.sqrt(taken @ taken):
            return
        q, v = self._mechanism.project(self._data, self.q, self.v)
        needed, self._normal_force = self._mechanism.excess(self._data, q, v, self.mu_static)
        if needed > 0:
            return
        slowing = math.sqrt((free.slip_rate - taken) @ (free.slip_rate - taken))
        size = math.sqrt(free.slip @ free.slip)
        part = min(size / (slowing * self._dt), 1.0) if slowing > 0 else 0.0
        self.events.append(Event(EventKind.STICK, time + part * self._dt, time, time + self._dt))
        self.q, self.v, self._excess, self.sticking = q, v, needed, True

    def _direction(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Direction of slip, which friction opposes, as a unit vector, shape (3,).

        If a step is longer than the time in which the direction of slip settles, it is the direction after a step
        without friction, which is stable (Moreau 1988); otherwise that of the slip velocity, which is exact.
        """
        free = self._mechanism.slide(data, q, v, np.zeros(3))
        size, pull = math.sqrt(free.slip @ free.slip), math.sqrt(free.slip_rate @ free.slip_rate)
        if size > self._dt * pull:
            return unit(free.slip)
        return unit(free.slip + self._dt * free.slip_rate)

    def _acceleration(self, q: FloatArray, v: FloatArray) -> FloatArray:
        if self.sticking:
            return super()._acceleration(q, v)
        return self._mechanism.slide(self._data, q, v, self._direction(self._data, q, v)).acceleration


class StickSlipEuler(FixedStickSlip, SemiImplicitEuler):
    """Stick and slip by semi-implicit Euler."""


class StickSlipRungeKutta4(FixedStickSlip, TangentRungeKutta4):
    """Stick and slip by the classical scheme, of order 1 over an event."""
