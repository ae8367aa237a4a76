"""Integration of a model whose rolling constraint is off while the ball slips, with located events.

Exudyn integrates with its fixed step; a function that it calls after each step stops it when the needed friction
leaves the static cone, or the slip reverses. The step is then repeated in parts that end at the event, which keeps the
integrator's order; a fresh solver starts on either side with consistent accelerations.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, NamedTuple

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged
from proofroll.core.events import Event, EventKind
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.exudyn.ball.friction import Touch, mobility, slip_direction
from proofroll.engines.exudyn.integration import Integration
from proofroll.engines.exudyn.native import exu
from proofroll.engines.exudyn.settings import ExudynSettings

if TYPE_CHECKING:  # which drives itself by what is here
    from proofroll.engines.exudyn.ball.generic import Generic

# An event is located to this part of a step, far below the error of one step of the integrator.
LOCATED = 1e-6
# A ball that friction would stop within this part of a step is at rest.
AT_REST = 1e-2


class ContactState(NamedTuple):
    """Coordinates, their rates, and the contact forces and slip at them."""

    q: FloatArray
    q_t: FloatArray
    touch: Touch


class SwitchedIntegration:
    """Integrates :class:`~proofroll.engines.exudyn.ball.generic.Generic` with stick and slip; see :class:`Integration`.

    Attributes:
        t: present time [s].
        sticking: True if the ball rolls without slip.
        direction: unit direction of slip in the present step (e2, e3).
        events: events so far.
    """

    def __init__(self, model: Generic, body: RollingBall, settings: ExudynSettings) -> None:
        """Starts at time 0, in the state of the system's initial configuration."""
        self.model, self.system, self.settings = model, model.system, settings
        data = self.system.systemData
        self._q, self._q_t = data.GetODE2Coordinates, data.GetODE2Coordinates_t  # looked up once: asked at every step
        self._needed = model.needed
        self.mu_static, self.mu_kinetic = body.contact.mu_static, body.contact.mu_kinetic
        self.beta = mobility(body)
        self.t = 0.0
        self.events: list[Event] = []
        self.sticking, self.direction = True, (1.0, 0.0)
        self.state = self._state(exu.ConfigurationType.Initial)
        self._before, self._before_t = self.state, 0.0
        self._last_step: tuple[Touch, Touch, float] | None = None  # its end, its start and its length [s]
        # Time, coordinates and rates after the last step and the one before it; rates stand for unused coordinates.
        self._latest: tuple[float, FloatArray, FloatArray] = (0.0, self.state.q, self.state.q_t)
        self._earlier: tuple[float, FloatArray, FloatArray] | None = None
        self._place_matters, self._shortest = model.place_matters, 0.5 * settings.dt
        self._watching, self._stopped = False, False
        self.system.SetPostStepUserFunction(self._watch)
        if self._margin(self.state.touch) < 0:
            self._switch(EventKind.SLIP, 0.0, 0.0, 0.0)
        self._restart()

    def advance(self, t: float) -> None:
        """Moves the system to time ``t`` [s]; see :class:`proofroll.core.engine.Engine`."""
        while whole_steps(self.t, t, self.settings.dt) > 0:
            self._watching, self._stopped = True, False
            try:
                self.integration.advance(t)
            finally:
                self._watching = False
            if self.sticking and not self._stopped:
                self.state = self._state(exu.ConfigurationType.Current)
            if self.state.touch.N <= 0:
                self.events.append(Event(EventKind.LIFT_OFF, 0.5 * (self._before_t + self.t), self._before_t, self.t))
                raise Diverged(f"the ball leaves the wall at {self.t:g} s")
            if self._stopped:
                self._divide()
                self._restart()
        self.t = self.integration.t = t

    def _watch(self, system: Any, t: float) -> bool:  # noqa: ARG002 -- Exudyn's signature
        """Updates the contact; Exudyn calls it after each step and once at the start. False: stop, at an event."""
        if not self._watching:
            return True
        elapsed = t - self.t
        if self.sticking:  # with as few calls as possible, for a step takes microseconds
            if elapsed <= self._shortest:
                return True
            q_t = self._q_t()
            q = self._q() if self._place_matters else q_t
            N, need2, need3 = self._needed(q, q_t)
            if self.mu_static * N > math.hypot(need2, need3) and N > 0:
                self._earlier, self._latest, self.t = self._latest, (t, q, q_t), t
                return True
            return self._begin_to_slip(t)
        if elapsed > 0.5 * self.settings.dt:
            self._before, self._before_t = self.state, self.t
            self.state, self.t = self._state(exu.ConfigurationType.Current), t
            self.model.reached()
            touch = self.state.touch
            if self._margin(touch) <= 0 or touch.N <= 0:
                self._stopped = True
                return False
            self._last_step = touch, self._before.touch, elapsed
        self._aim(self.settings.dt)
        return True

    def _begin_to_slip(self, t: float) -> bool:
        """Stops Exudyn after the step in which the needed friction exceeds the static bound; returns False."""
        if self._earlier is not None:
            (now, *latest), (last_time, *earlier) = self._latest, self._earlier
            self._last_step = self.model.touch(*latest), self.model.touch(*earlier), now - last_time
        self._before, self._before_t = self._state(exu.ConfigurationType.StartOfStep), self.t
        self.state, self.t = self._state(exu.ConfigurationType.Current), t
        self._stopped = True
        return False

    def _margin(self, touch: Touch) -> float:
        """Event function, positive before an event: unused static friction [N], or slip along its direction [m/s]."""
        if self.sticking:
            return self.mu_static * touch.N - math.hypot(touch.need2, touch.need3)
        return touch.u2 * self.direction[0] + touch.u3 * self.direction[1]

    def _aim(self, dt: float, *, inside: bool = False) -> None:
        """Sets the direction of slip for the coming step of length ``dt`` [s].

        A running solver evaluates forces at the end of a step, having those of its start: it needs the direction at the
        end. A fresh solver uses one direction at both ends: the mean one ``inside`` the step.
        """
        friction = self.mu_kinetic * self.state.touch.N
        self.direction = slip_direction(self.state.touch, self._need_rate(), friction, self.beta, dt, inside=inside)
        self.model.hold(self.direction)

    def _need_rate(self) -> tuple[float, float]:
        """Rate of the needed friction over the last undivided step [N/s], along e2 and e3; used for slip only."""
        if self._last_step is None:
            return 0.0, 0.0
        touch, old, elapsed = self._last_step
        return (touch.need2 - old.need2) / elapsed, (touch.need3 - old.need3) / elapsed

    def _divide(self) -> None:
        """Repeats the last step in parts that end where the contact changes."""
        now, end = self._before_t, self.t
        self.state = self._before
        while (left := end - now) > LOCATED * self.settings.dt:
            if not self.sticking:
                self._aim(left, inside=True)
            beyond = self._part(left)
            if self._margin(beyond.touch) > 0:
                self.state = beyond
                break
            if self.sticking and self._margin(self.state.touch) <= 0:
                self._switch(EventKind.SLIP, now, self._before_t, end)
                continue
            if not self.sticking and (self._begun(now) or self._margin(self.state.touch) <= 0):
                # The force only touched the cone: the ball does not slip after all, and the step ends sticking.
                self._take_back(now)
                self.state = self._part(left)
                break
            part = self._crossing(beyond, left)
            if part > 0:
                self.state, now = self._part(part), now + part
            self._land(now, end)

    def _crossing(self, beyond: ContactState, left: float) -> float:
        """Time from the present state until the contact changes [s], at most ``left`` [s]."""
        from scipy.optimize import brentq

        ends = {0.0: self._margin(self.state.touch), left: self._margin(beyond.touch)}

        def margin(part: float) -> float:
            return ends[part] if part in ends else self._margin(self._part(part).touch)

        return float(brentq(margin, 0.0, left, xtol=LOCATED * left))

    def _land(self, now: float, end: float) -> None:
        """Switches the contact in the present state, which is at an event."""
        touch = self.state.touch
        if self.sticking:
            self._switch(EventKind.SLIP, now, self._before_t, end)
            return
        holds = touch.needed <= self.mu_static * touch.N
        if holds:
            self._switch(EventKind.STICK, now, self._before_t, end)
        if holds or touch.slip <= AT_REST * self.settings.dt * self.beta * self.mu_kinetic * touch.N:
            q, q_t = self.state.q, self.model.without_slip(self.state.q_t)
            self.state = ContactState(q, q_t, self.model.touch(q, q_t))

    def _switch(self, kind: EventKind, now: float, low: float, high: float) -> None:
        self.events.append(Event(kind, now, low, high))
        self.sticking = kind == EventKind.STICK

    def _begun(self, now: float) -> bool:
        """True if the ball began to slip at this very time [s]."""
        return bool(self.events) and self.events[-1].kind == EventKind.SLIP and self.events[-1].time == now

    def _take_back(self, now: float) -> None:
        if self._begun(now):
            self.events.pop()
            self.sticking = True
        else:
            self._switch(EventKind.STICK, now, self._before_t, now)

    def _part(self, dt: float) -> ContactState:
        """The state after one step of another size [s] from the present one."""
        self._set_initial()
        self.model.hold(None if self.sticking else self.direction)
        Integration(self.system, dataclasses.replace(self.settings, dt=dt)).advance(dt)
        return self._state(exu.ConfigurationType.Current)

    def _set_initial(self) -> None:
        data, initial = self.system.systemData, exu.ConfigurationType.Initial
        data.SetODE2Coordinates(self.state.q, initial)
        data.SetODE2Coordinates_t(self.state.q_t, initial)

    def _state(self, configuration: Any) -> ContactState:
        q, q_t = self._q(configuration), self._q_t(configuration)
        return ContactState(q, q_t, self.model.touch(q, q_t))

    def _restart(self) -> None:
        """Starts a fresh solver in the present state."""
        self._set_initial()
        if self.sticking:
            self.model.hold(None)
        else:
            self._aim(0.0)
        self.model.reached()
        self._latest, self._earlier = (self.t, self.state.q, self.state.q_t), None
        self.integration = Integration(self.system, self.settings, at=self.t)
