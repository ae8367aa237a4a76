"""Stretches of bodies that touch by compiled Taylor series (heyoka, an extra): one integrator and its guards per mode.

A stretch that has no rule in symbols, as where contacts share a load, takes the path without compilation.

Where contacts slip in the plane, the variable of integration s makes time run slower as a slip u stops: dt = |u| ds; of
several, dt = ds / √(Σ u⁻²). A direction of slip turns ever faster in time before the stop; in s the motion is smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.event_location import locate_rise_within, points_within
from proofroll.core.pace import PACE, OutOfTime
from proofroll.core.stalling import StepCount, StepWatch
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.signal import SMOOTH
from proofroll.truth.followed_paths import TOLERANCES
from proofroll.truth.numerics.compiled_once import compiled_once, heyoka
from proofroll.truth.numerics.hybrid import StoppedWithin, Stretch, StretchLaw
from proofroll.truth.numerics.picard import PicardSteps
from proofroll.truth.numerics.run_time_constants import Constants, Symbol
from proofroll.truth.numerics.scalars import Scalar
from proofroll.truth.switching.contact_guards import Touchable, guards_of
from proofroll.truth.switching.contact_symbols import (
    SolvedSymbols,
    Vector,
    guard_symbols,
    led_symbols,
    slip_symbols,
    stated_symbols,
    turning_slip,
)
from proofroll.truth.switching.planar_slip import Led, LedValues

# Part of the way to a place where the rates have a kink, as at the tip of a cone: a step across it has no series.
_BEFORE = 0.99
_BACK = np.append(2.0 ** -np.arange(50.0), 0.0)  # places before the rise of a guard, in parts of the last step
_CORRECTIONS = 6  # of Newton's method for the variable of integration at a time, at most


class Inside(Protocol):
    """States within a step of an integrator."""

    def __call__(self, places: FloatArray, /) -> FloatArray:
        """States at values of the variable of integration, shape (state, places)."""

    def at_points(self) -> FloatArray:
        """States at :func:`proofroll.core.event_location.points_within` of the step, shape (state, points)."""


_TakeStep = Callable[[float, Array, float], tuple[float, Array, Inside]]


class ModeSymbols(Protocol):
    """Equations of a route in symbols."""

    @property
    def covers(self) -> bool:
        """True if all parts of the mechanism have a rule."""

    def solved(
        self,
        state: Sequence[Scalar],
        mode: ContactMode,
        clamped: Sequence[Scalar],
        began: Sequence[Vector | None],
        functions: Any,
    ) -> SolvedSymbols:
        """Rates and forces at a state in a mode whose lines began as given; ``clamped``: signs of efforts at limits."""


@dataclass(frozen=True)
class CompiledStretch(Stretch[ContactMode]):
    """A stretch that a compiled mode integrated, with its steps."""

    by: CompiledMode | None = None
    steps: Sequence[ModeStep] = ()


class ModeStep(NamedTuple):
    """A step.

    Attributes:
        start, end: values of the variable of integration.
        first, last: states.
        inside: states within.
        guards: values at points of the step, (points, guards).
    """

    start: float
    end: float
    first: Array
    last: Array
    inside: Inside
    guards: Array


class _Series(NamedTuple):
    """States within a step from a start, by Taylor series, shape (state, orders)."""

    start: float
    length: float
    series: Array
    powers: Array  # (orders, 1)

    def __call__(self, places: FloatArray) -> FloatArray:
        return np.asarray(self.series @ (places - self.start) ** self.powers)

    def at_points(self) -> FloatArray:
        """See the protocol."""
        return self(points_within(self.start, self.start + self.length))


class CompiledModes:
    """Compiled modes of one route; each is compiled when it first occurs."""

    def __init__(self, symbols: ModeSymbols, contacts: Sequence[Touchable], length: int, by_collocation: bool) -> None:
        self._symbols, self._contacts, self._length = symbols, contacts, length
        self._by_collocation = by_collocation
        self._covers = heyoka is not None and symbols.covers
        self._modes: dict[tuple[tuple[str, bool, bool, int], ...], CompiledMode] = {}

    def of(self, mode: ContactMode, clamped: tuple[int, ...]) -> CompiledMode | None:
        """Compiled mode with these signs of efforts at their limits, 0 of one within.

        None: heyoka is missing, or a part of the mechanism has no rule in symbols.
        """
        if not self._covers:
            return None
        key = tuple((acting.kind, acting.along is not None, acting.leads, acting.feature) for acting in mode)
        if key not in self._modes:
            self._modes[key] = CompiledMode(
                self._symbols, self._contacts, mode, len(clamped), self._length, self._by_collocation
            )
        return self._modes[key].at_limits(clamped)


class CompiledMode:
    """Integrator and guards of a mode, compiled."""

    def __init__(
        self,
        symbols: ModeSymbols,
        contacts: Sequence[Touchable],
        mode: ContactMode,
        limits: int,
        length: int,
        by_collocation: bool,
    ) -> None:
        lined = [k for k, acting in enumerate(mode) if acting.along is not None or acting.leads]
        constants = Constants(lambda index: heyoka.par[index], 3 * len(lined) + limits, heyoka.expression)
        clamped = [Symbol(heyoka.par[3 * len(lined) + number], constants) for number in range(limits)]
        self._clamped: tuple[int, ...] = (0,) * limits
        state = [heyoka.make_vars(f"s{index}") for index in range(length)]
        functions = constants.functions({name: getattr(heyoka, name) for name in SMOOTH})
        began: list[Vector | None] = [None] * len(mode)
        for place, k in enumerate(lined):
            began[k] = [Symbol(heyoka.par[3 * place + axis], constants) for axis in range(3)]
        solved = symbols.solved([Symbol(entry, constants) for entry in state], mode, clamped, began, functions)
        slips = slip_symbols(mode, contacts, solved)
        conditions = guards_of(contacts, mode)
        tips = {k for k, contact in enumerate(contacts) if isinstance(contact, BodyContact) and contact.has_tip}
        self._kinks = {
            number for number, guard in enumerate(conditions) if guard.kind == "flat" and guard.contact in tips
        }
        guards = [*guard_symbols(conditions, contacts, solved, began, functions), *solved.within_limits]
        stated, led = stated_symbols(solved), led_symbols(mode, solved)
        values = [*guards, *slips, *led, *stated, *solved.rates, 1.0]
        self._stated, self._first_rate = len(stated), len(guards) + len(slips) + len(led) + len(stated)
        self._by_collocation = by_collocation
        self._turning = [k for k, pair in enumerate(zip(mode, contacts, strict=True)) if turning_slip(*pair)]
        self._count, self._slips, self._lined = len(guards), len(slips), lined
        expressions = [constants.symbol(value) for value in values]
        self._constants = constants
        squares = expressions[len(guards) : len(guards) + len(slips) : 3]
        if squares:
            inverse = [1.0 / square for square in squares]
            pace = heyoka.sqrt(squares[0]) if len(squares) == 1 else 1.0 / heyoka.sqrt(heyoka.sum(inverse))
            expressions += [pace * rate for rate in expressions[-len(state) :]]
        # what leads is integrated by its nodes
        self._values, self._integrator = compiled_once(expressions, state, by_collocation or bool(led))

    def at_limits(self, clamped: tuple[int, ...]) -> Self:
        """The same mode with these signs of efforts at their limits."""
        limited_mode = copy(self)
        limited_mode._clamped = clamped
        return limited_mode

    def _guards(self, pars: Array, states: Array) -> Array:
        """Guards at states (state, places), (places, guards).

        Raises:
            Diverged: one is not finite.
        """
        guards = self._called(states, pars)[: self._count].T
        if not np.isfinite(guards).all():
            raise Diverged(f"a guard is not finite near t = {states[-1, 0]:.6g} s")
        return guards

    def _parameters(self, mode: ContactMode, time: float) -> Array:
        """Run-time parameters of a stretch: lines of contacts, signs of efforts, numbers, lines of signals."""
        lines = [x for k in self._lined for x in mode[k].along or mode[k].heading or ()]
        return np.concatenate([lines, self._clamped, self._constants.values(time)])[: self._values.nparams]

    def values(self, states: Array, mode: ContactMode) -> tuple[Array, Array, Array]:
        """Guards, numbers of slips and rates of states (times, state) of one stretch, each (times, …)."""
        pars = self._parameters(mode, float(states[0, -1]))
        outputs, start = self._called(states.T, pars), self._first_rate
        slips = outputs[self._count : self._count + self._slips].T
        return outputs[: self._count].T, slips, outputs[start : start + states.shape[1]].T

    def _called(self, states: Array, pars: Array) -> Array:
        """Guards, numbers of slips, rates and, last, rates in the variable of integration, of states (state, times).

        ``pars``: parameters of all states, or of each, (parameters, times).
        """
        inputs = np.ascontiguousarray(states)
        if not len(pars):
            return np.asarray(self._values(inputs))
        columns = pars if pars.ndim > 1 else np.repeat(pars[:, None], inputs.shape[1], axis=1)
        return np.asarray(self._values(inputs, pars=columns))

    def led(self, mode: ContactMode, time: float) -> Led:
        """Values at states in this mode, in which a slip leads, from a time [s] on."""
        pars, start = self._parameters(mode, time), self._count + self._slips
        places = [3 * place for place, k in enumerate(self._lined) if mode[k].leads]

        def led(states: Array, directions: Array) -> LedValues:
            columns = np.repeat(pars[:, None], len(states), axis=1)
            for place in places:
                columns[place : place + 3] = directions.T
            values = self._called(states.T, columns)
            normals, slides, slide_rates = (values[start + 3 * part : start + 3 * part + 3].T for part in range(3))
            return LedValues(
                rates=values[self._first_rate : self._first_rate + states.shape[1]].T,
                normals=normals,
                slides=slides,
                slide_rates=slide_rates,
                guards=values[: self._count].T,
            )

        return led

    def walk(self, law: StretchLaw, mode: ContactMode, time: float, state: Array, until: float) -> Stretch[ContactMode]:
        """Stretch from a time and state to the first rise of a guard, or to ``until`` [s].

        Raises:
            Diverged: the steps become too small or too many, or take too long.
        """
        if not until > time:
            return Stretch(start=time, end=time, mode=mode, first=state, last=state, guard=None)
        count, watch, pars = StepCount(time, until), StepWatch(), self._parameters(mode, time)
        steps, grazes, visited, rise = list[ModeStep](), list[float](), list[tuple[float, Array]](), None
        stopped = ""
        for step in self._steps(pars, state, until):
            leaving, crests = not steps, list[float]()
            steps.append(step)
            visited.append((float(step.first[-1]), step.first))
            count.took(float(step.last[-1]))
            watch.took(float(step.last[-1]), step.end - step.start, landing=step.last[-1] == until)
            rise = locate_rise_within(
                lambda places, step=step: self._called(step.inside(places), pars)[: self._count].T,  # type: ignore[misc]
                step.start,
                step.end,
                law.noise,
                leaving,
                law.near,
                crests,
                step.guards,
            )
            grazes += step.inside(np.array(crests))[-1].tolist() if crests else []
            if rise is None:
                try:
                    PACE.reached(float(step.last[-1]))
                except OutOfTime as out_of_time:
                    stopped = str(out_of_time)
                    break
            else:
                if rise[1] in self._kinks and not self._slips:
                    place = step.start + _BEFORE * (rise[0] - step.start)
                    shorter = [*self._steps(pars, step.first, float(step.inside(np.array([place]))[-1, 0]))]
                    if shorter:  # none where the stretch begins there
                        steps[-1:], rise = shorter, (shorter[-1].end, rise[1])
                break
        last = steps[-1].last if rise is None else steps[-1].inside(np.array([rise[0]]))[:, 0]
        end, guard = (until, None) if rise is None and not stopped else (float(last[-1]), rise and rise[1])
        blur = 0.0 if rise is None else self._blur(pars, steps[-1], *rise)
        stretch = CompiledStretch(
            start=time,
            end=end,
            mode=mode,
            first=state,
            last=law.corrected(last),
            guard=guard,
            visited=visited,
            grazes=grazes,
            blur=blur,
            by=self,
            steps=steps,
        )
        if stopped:
            raise StoppedWithin(stopped, end, stretch)
        return stretch

    def steps_of(self, stretch: CompiledStretch) -> Iterator[tuple[float, float, Inside]]:
        """Steps of a stretch up to its end: start and end of the variable of integration, states within."""
        pars = self._parameters(stretch.mode, stretch.start)
        for step in stretch.steps:
            end = step.end
            if step.last[-1] > stretch.end:
                (end,) = self._places(pars, step.start, step.end, step.inside, np.array([stretch.end]))
            if end > step.start:
                yield step.start, float(end), step.inside

    def record_of(self, mode: ContactMode, time: float) -> Callable[[Array], tuple[Array, Array]]:
        """Function of states (state, places) after a time [s]: :func:`stated_symbols`, rate of time by its variable."""
        pars, start = self._parameters(mode, time), self._first_rate

        def record(states: Array) -> tuple[Array, Array]:
            outputs = self._called(states, pars)
            return outputs[start - self._stated : start], outputs[-1] if self._slips else np.ones(states.shape[1])

        return record

    def _blur(self, pars: Array, step: ModeStep, place: float, guard: int) -> float:
        """Time before the rise of a guard [s] from which on it is within the error of a step below zero."""
        error = TOLERANCES[0] * max(1.0, float(np.abs(step.guards[:, guard]).max()))
        states = step.inside(place - (place - step.start) * _BACK)
        clear = self._called(states, pars)[guard] <= -error
        last = np.flatnonzero(clear).max(initial=0)  # a rebound is within it at its start, too
        return float(states[-1, -1] - states[-1, last])

    def _steps(self, pars: Array, state: Array, until: float) -> Iterator[ModeStep]:
        """Steps of the integrator to a time [s].

        Raises:
            Diverged: a step fails.
        """
        step = self._collocation(pars) if self._by_collocation else self._series(pars)
        place = float(state[-1])
        while state[-1] < until:
            end, last, inside = step(place, state, np.inf if self._slips else until)
            states = inside.at_points()
            lands = last[-1] >= until or (not self._slips and end >= until)
            if last[-1] > until and self._slips:
                (end,) = self._places(pars, place, end, inside, np.array([until]))
                last = inside(np.array([end]))[:, 0]
                states = inside(points_within(place, end))
            if lands:
                last[-1] = until  # but for round-off
            yield ModeStep(
                start=place, end=end, first=state, last=last, inside=inside, guards=self._guards(pars, states)
            )
            place, state = end, last

    def _places(self, pars: Array, start: float, end: float, inside: Inside, times: FloatArray) -> FloatArray:
        """Values of the variable of integration at times [s] within a step."""
        if not self._slips:
            return times
        places = np.interp(times, inside.at_points()[-1], points_within(start, end))
        for _ in range(_CORRECTIONS):
            states = inside(places)
            moved = np.clip(places + (times - states[-1]) / self._called(states, pars)[-1], start, end)
            done = np.abs(moved - places).max() <= 4 * np.spacing(np.abs(places).max())
            places = moved
            if done:
                break
        return np.asarray(places)

    def _collocation(self, pars: Array) -> _TakeStep:
        function, tiled = self._values, dict[int, dict[str, Array]]()

        def rates(states: Array) -> Array:
            count = states.shape[1]
            if count not in tiled:
                tiled[count] = {"pars": np.repeat(pars[:, None], count, axis=1)} if len(pars) else {}
            return np.asarray(function(np.ascontiguousarray(states), **tiled[count])[-len(states) :])

        return PicardSteps(rates).step

    def _series(self, pars: Array) -> _TakeStep:
        integrator = self._integrator
        powers = np.arange(integrator.order + 1)[:, None]
        if len(integrator.pars):
            integrator.pars[:] = pars[: len(integrator.pars)]

        def step(start: float, state: Array, until: float) -> tuple[float, Array, Inside]:
            integrator.state[:], integrator.time = state, start
            integrator.step(max_delta_t=until - start, write_tc=True)
            end = float(integrator.time)
            if not np.isfinite(integrator.state).all() or not end > start:
                raise Diverged(f"Taylor series stop at t = {state[-1]:.6g} s")
            inside = _Series(start, end - start, np.array(integrator.tc), powers)
            return until if until - end < np.spacing(until) else end, np.array(integrator.state), inside

        return step

    def decay_of(self, mode: ContactMode, k: int, time: float) -> Callable[[Array], tuple[Array, Array]]:
        """Function of states (state, places) after a time [s]: slip speeds, changes until the slip would stop so."""
        pars, place = self._parameters(mode, time), self._count + 3 * self._turning.index(k)
        start = self._first_rate

        def decay(states: Array) -> tuple[Array, Array]:
            outputs = self._called(states, pars)
            square, product, rate = outputs[place : place + 3]
            change = np.maximum(0.0, -product / rate) * outputs[start : start + len(states)]
            # a slip that round-off has stopped has no direction, and changes nothing
            return np.sqrt(square), np.where(square, change, 0.0)

        return decay

    def within(self, law: StretchLaw, stretch: CompiledStretch, times: FloatArray) -> FloatArray:
        """States at increasing times [s] within a stretch that this mode integrated, shape (times, state)."""
        begun, start = stretch.visited[0]
        states = np.empty((len(times), len(start)))
        early, pars = times <= begun, self._parameters(stretch.mode, stretch.start)
        left = (begun - times[early]) / ((begun - stretch.start) or 1.0)  # of the line in which a slip gets a direction
        states[early] = start + left[:, None] * (stretch.first - start)
        number = int(early.sum())
        for step in stretch.steps:
            stop = int(np.searchsorted(times, step.last[-1], side="right"))
            if stop > number:
                places = self._places(pars, step.start, step.end, step.inside, times[number:stop])
                states[number:stop] = step.inside(places).T
                number = stop
        states[number:] = stretch.last
        return np.array([law.corrected(state) for state in states])
