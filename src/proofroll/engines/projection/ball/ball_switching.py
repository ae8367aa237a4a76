"""Sequence of sticking and slipping of a ball: the present mode, its end, and the next mode."""

from collections.abc import Callable

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.events import Event, EventKind
from proofroll.core.integrators import Integrator
from proofroll.elements.ball_on_surface.mechanics import natural_speed
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.projection.ball.ball_modes import BallMode, Exit, FreeSlip, Pace, Rest, SlavedSlip, Stick, Survey
from proofroll.engines.projection.ball.friction import Friction
from proofroll.engines.projection.ball.method import ProjectedBall
from proofroll.engines.projection.contact.alternating import WITHOUT_PROGRESS

# Accuracy of located times, relative to the time scale of the motion; at least the round-off of the time.
_LOCATED = 1e-12


class Switching:
    """Motion of a ball under bounded friction or rolling resistance.

    Attributes:
        friction: friction law between ball and wall.
        mode: present mode.
        stepper: integrator, with the present state.
        events: so far.
    """

    def __init__(
        self,
        ball: ProjectedBall,
        body: RollingBall,
        stepper: Integrator,
        x: FloatArray,
        scales: FloatArray,
        check: Callable[[float, FloatArray], None],
        renewed: Callable[[float, FloatArray], FloatArray | None],
        eliminate: bool,
    ) -> None:
        """Starts at time 0 in the mode that follows from the state x.

        Args:
            ball: equations of motion.
            body: the ball.
            stepper: a new integrator.
            x: coordinates and velocities.
            scales: natural size of each component of x.
            check: called with time [s] and x after each step; raises Diverged if x is not reliable.
            renewed: called with time and x where the motion goes on; returns the same state in other coordinates, or
                None.
            eliminate: make C v consistent with the slip after each step.
        """
        self.stepper = stepper
        self.events: list[Event] = []
        speed = natural_speed(body)
        self._pace = pace = Pace(speed, body.ball.radius / speed, stepper.stability, stepper.reach)
        self.friction = friction = Friction(ball, body.contact)
        self._check, self._renewed, self._eliminate = check, renewed, eliminate
        self._scales = np.append(scales, [pace.speed, 1.0])
        self._stick, self._rest = Stick(friction, pace), Rest(friction)
        self._slaved, self._free = SlavedSlip(friction, pace), FreeSlip(friction, pace)
        self._idle = 0
        self._lost: str | None = None
        self.mode: BallMode = self._stick
        self._survey = Survey(())
        self._settle(0.0, 0.0, x, was_sticking=True)

    @property
    def x(self) -> FloatArray:
        """Present coordinates and velocities."""
        return self.mode.x(self.stepper.x)

    @property
    def t(self) -> float:
        """Present time [s]."""
        return self.stepper.t

    @property
    def rates(self) -> FloatArray:
        """Rates of the present state, those of x first."""
        return self.mode.rates(self.stepper.x)

    @property
    def force(self) -> FloatArray:
        """Present force of the wall on the ball in local axes [N], shape (3,)."""
        return self.mode.force(self.stepper.x)

    def advance(self, t: float) -> None:
        """Moves to time t [s].

        Raises:
            Diverged: the ball leaves the wall, or the integration fails.
        """
        if self._lost:
            raise Diverged(self._lost)
        stepper = self.stepper
        stepper.aim(t)
        while stepper.t < t:
            stepper.step(t, self._survey.longest)
            survey = self._look()
            ended = self._ended(survey)
            if ended is not None:
                self._switch(*ended)
            elif survey.slaved:
                self._enter(self._slaved, stepper.t, stepper.x[:-1])
            elif (renewed := self._renewed(stepper.t, self.x)) is not None:
                self._enter(self.mode, stepper.t, np.concatenate([renewed, stepper.x[len(renewed) :]]))
            else:
                self._survey, self._idle = survey, 0

    def _look(self) -> Survey:
        """Margins of the mode after a step."""
        stepper = self.stepper
        if self.mode is self._stick and self._stick.halts and not self.friction.bounded:
            return self._stick.glance(stepper.x, self._survey, stepper.t - stepper.t_before)
        return self.mode.survey(stepper.x)

    def _enter(self, mode: BallMode, t: float, y: FloatArray) -> None:
        def accept(time: float, state: FloatArray) -> FloatArray:
            self._check(time, mode.x(state))
            return mode.eliminated(state) if self._eliminate else state

        self.mode = mode
        self.stepper.begin(t, y, mode.rates, accept, self._scales[: len(y)])
        self._survey = mode.survey(y)

    def _ended(self, survey: Survey) -> tuple[Exit, float, float] | None:
        """First exit within the last step, and the times [s] between which it lies; None: the mode goes on."""
        from scipy.optimize import brentq

        ends = [
            (*self._crossing(index, self.stepper.t), exit_)
            for index, exit_ in enumerate(self.mode.exits)
            if survey.margins[index] < 0
        ]
        if not ends and self._survey.trend < 0 < survey.trend and self._may_dip(survey):
            now, begin = self.stepper.t, self.stepper.t_before
            lowest = float(brentq(lambda t: self._at(t).trend, begin, now, xtol=self._resolution(now)))
            if self._at(lowest).margins[survey.dips] < 0:
                ends = [(*self._crossing(survey.dips, lowest), self.mode.exits[survey.dips])]
        if not ends:
            return None
        low, high, exit_ = min(ends, key=lambda item: item[1])
        return exit_, low, high

    def _may_dip(self, survey: Survey) -> bool:
        """True if a margin with a minimum within the last step could, as a parabola, come near zero."""
        bend = (self.stepper.t - self.stepper.t_before) * (survey.trend - self._survey.trend)
        return min(self._survey.margins[survey.dips], survey.margins[survey.dips]) < bend

    def _at(self, t: float) -> Survey:
        return self.mode.survey(self.stepper.inside(t))

    def _resolution(self, t: float) -> float:
        return max(_LOCATED * self._pace.time, 4 * float(np.spacing(t)))

    def _crossing(self, index: int, high: float) -> tuple[float, float]:
        """Times [s] in the last step just before and after a margin became negative; at ``high`` it is negative."""
        return self.stepper.crossing(lambda y: self.mode.survey(y).margins[index], high, self._resolution(high))

    def _switch(self, exit_: Exit, low: float, high: float) -> None:
        self._idle = self._idle + 1 if high == self.stepper.t_before else 0
        if self._idle > WITHOUT_PROGRESS:
            raise Diverged(f"sticking and slipping alternate without end at t = {high:.6g} s")
        y = self.stepper.inside(high)
        x = self.mode.x(y)
        if exit_ is Exit.CONE:
            self._event(EventKind.SLIP, low, high)
            self._enter(self._slaved, high, np.append(x, 0.0))
        elif exit_ is Exit.CHANGE:
            self._enter(self._free, high, self._slaved.freed(y))
        elif exit_ is Exit.LIFTOFF:
            self._event(EventKind.LIFT_OFF, low, high)
            self._enter(self.mode, high, y)
            self._lost = f"the ball leaves the wall at t = {high:.6g} s; its flight is not modelled"
            raise Diverged(self._lost)
        else:
            self._settle(low, high, x, self.mode.sticking)

    def _settle(self, low: float, high: float, x: FloatArray, was_sticking: bool) -> None:
        """Next mode at standstill of the contact point, in the state x: sticking if the static cone allows it."""
        ball = self.friction.rolling
        if high > 0:
            x = ball.eliminated(x)
        speed = self.friction.rolling.speed(x) if self._stick.halts else np.inf
        mode: BallMode
        if speed <= self._pace.settled and self._rest.holds(x):
            mode, x = self._rest, self._rest.eliminated(x)
        else:
            if speed <= 2 * self._pace.still:
                x = self._rest.released(x, 10 * self._pace.still)
            holds = self.friction.reserve(ball.response_at(x)) >= 0
            mode = self._stick if holds else self._slaved
        if mode.sticking != was_sticking:
            self._event(EventKind.STICK if mode.sticking else EventKind.SLIP, low, high)
        self._enter(mode, high, x if mode.sticking else np.append(x, 0.0))

    def _event(self, kind: EventKind, low: float, high: float) -> None:
        bracket = self.stepper.bracket(low, high) if high > 0 else (0.0, 0.0)  # the initial mode needs no bracket
        self.events.append(Event(kind, 0.5 * (low + high), *bracket))
