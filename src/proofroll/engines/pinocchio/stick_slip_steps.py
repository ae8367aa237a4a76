"""Stick and slip with a fixed step: the law of motion changes between steps, and each event lies within one step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.events import Event
from proofroll.elements.ball_on_surface.model import Contact
from proofroll.engines.pinocchio.ball_with_rows import BallWithRows, SlidingContact, left_the_wall, unit
from proofroll.engines.pinocchio.integrators import FixedStep, SemiImplicitEuler, TangentRungeKutta4
from proofroll.engines.pinocchio.settings import PinocchioSettings


class FixedStickSlip(FixedStep):
    """Mixin for the schemes of :mod:`~proofroll.engines.pinocchio.integrators`.

    The time of an event is interpolated, its bracket is the step.
    """

    mu_static: float
    sticking: bool

    def __init__(self, mechanism: BallWithRows, settings: PinocchioSettings, contact: Contact) -> None:
        super().__init__(mechanism, settings)
        self.mu_static = contact.mu_static
        self._excess, self._normal_force = mechanism.excess(self._data, self.q, self.v, self.mu_static)
        self.sticking = self._excess <= 0 and not mechanism.slips0
        self._free = self._without_friction()
        if not self.sticking:
            self.events.append(Event("slip", 0.0, 0.0, 0.0))

    def reaction(self, data: Any) -> tuple[FloatArray, FloatArray]:
        """See :class:`~proofroll.engines.pinocchio.integrators.TangentIntegrator`."""
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
            before = self._excess
            self._excess, normal_force = self._mechanism.excess(self._data, self.q, self.v, self.mu_static)
            if self._excess <= 0:
                self._must_press(time + self._dt, normal_force)
                return
            part = min(max(before / (before - self._excess), 0.0), 1.0) if before < 0 else 0.0
            self.events.append(Event("slip", time + part * self._dt, time, time + self._dt))
            self.sticking = False
        self._free = self._without_friction()
        self._must_press(time + self._dt, self._free.normal_force)

    def _without_friction(self) -> SlidingContact:
        return self._mechanism.slide(self._data, self.q, self.v, np.zeros(3))

    def _must_press(self, time: float, normal_force: float) -> None:
        """Remembers N [N]; ends the run if it is gone.

        Raises:
            Diverged: the ball leaves the wall.
        """
        before, self._normal_force = self._normal_force, normal_force
        if normal_force >= -self._mechanism.faint:
            return
        low = max(time - self._dt, 0.0)
        best = low + (time - low) * before / (before - normal_force) if before > 0 else low
        best = max([best, *(event.time for event in self.events[-1:])])  # after the slip that comes with it
        self.events.append(Event("lift_off", best, low, time))
        raise left_the_wall(f"at {best:.6g} s")

    def _stick_if_it_can(self, time: float) -> None:
        """Sticks if friction can bring the contact point to rest within the step and keep it so."""
        free = self._free
        ahead = free.slip + self._dt * free.slip_rate
        # what friction takes from the slip velocity in a step if it acts along that velocity
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
        self.events.append(Event("stick", time + part * self._dt, time, time + self._dt))
        self.q, self.v, self._excess, self.sticking = q, v, needed, True

    def _direction(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Direction of friction's opposite, shape (3,).

        Where a step is longer than the time in which the direction of slip settles, the direction after a step
        without friction is taken, which is stable (Moreau 1988); else that of the slip velocity, which is exact.
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
