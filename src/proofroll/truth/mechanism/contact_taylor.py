"""Stretches of bodies that touch by compiled Taylor series (heyoka, an extra): one integrator and its guards per mode.

A stretch that has no rule in symbols, as where contacts share a load, takes the path without compilation.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from threading import get_ident
from typing import Any, NamedTuple, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.event_location import locate_rise_within, lowest, points_within
from proofroll.core.stalling import StepCount, StepWatch
from proofroll.elements.mechanism.contacts.acting import ContactMode
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth.hybrid import Stretch, StretchLaw
from proofroll.truth.mechanism.contact_guards import Touchable, guards_of
from proofroll.truth.mechanism.contact_symbols import SolvedSymbols, Vector, guard_symbols, slip_symbols, turning_slip
from proofroll.truth.mechanism.maximal_equations import FUNCTIONS
from proofroll.truth.mechanism.run_time_constants import Constants, Symbol
from proofroll.truth.picard import Inside, PicardSteps
from proofroll.truth.scalars import Scalar

try:
    import heyoka
except ImportError:  # no wheel for this platform
    heyoka = None

# Least slip speed over that at the start of a step, below which it stops in the step; and part of the way to the stop
# after which the next step begins.
_STOPS, _BEFORE_STOP = 1e-3, 0.9
_KEPT = 8  # arrays of parameters
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
        clamped: Sequence[int],
        began: Sequence[Vector | None],
        functions: Any,
    ) -> SolvedSymbols:
        """Rates and forces at a state in a mode whose lines began as given; ``clamped``: signs of efforts at limits."""


@dataclass(frozen=True)
class CompiledStretch(Stretch[ContactMode]):
    """A stretch that a compiled mode integrated; its states come from the same mode."""

    by: CompiledMode | None = None


class _Step(NamedTuple):
    """A step: start and end [s], first and last state, states at times within, and guards at points of it."""

    start: float
    end: float
    first: Array
    last: Array
    inside: Inside
    guards: Array


class CompiledModes:
    """Compiled modes of one route; each is compiled when it first occurs."""

    def __init__(self, symbols: ModeSymbols, contacts: Sequence[Touchable], length: int, by_collocation: bool) -> None:
        self._symbols, self._contacts, self._length = symbols, contacts, length
        self._by_collocation = by_collocation
        self._covers = heyoka is not None and symbols.covers
        self._modes: dict[tuple[tuple[int, ...], tuple[tuple[str, bool], ...]], CompiledMode] = {}

    def of(self, mode: ContactMode, clamped: tuple[int, ...]) -> CompiledMode | None:
        """Compiled mode, by the signs of efforts at their limits.

        None: heyoka is missing, or a part of the mechanism has no rule in symbols.
        """
        if not self._covers:
            return None
        key = clamped, tuple((own.kind, own.along is not None) for own in mode)
        if key not in self._modes:
            self._modes[key] = CompiledMode(
                self._symbols, self._contacts, mode, clamped, self._length, self._by_collocation
            )
        return self._modes[key]


class _Compiled(NamedTuple):
    """Function of all values of a mode, and integrator of its rates, which are the last."""

    values: Any
    integrator: Any


_MODES: OrderedDict[tuple[int, ...], _Compiled] = OrderedDict()
_MOST_MODES = 128  # compiled modes that are kept


def _compiled(expressions: Sequence[Any], state: Sequence[Any], by_collocation: bool) -> _Compiled:
    """Compiled parts of a mode; the same for scenes that differ in numbers alone, in one thread.

    They are recognised by hashes: to compare expressions takes for ever where they share parts. Optimised code takes
    two to ten times as long to compile, which no run earns back.
    """
    key = (get_ident(), by_collocation, *map(hash, expressions))
    if key not in _MODES:
        values = heyoka.cfunc(expressions, state, compact_mode=True, opt_level=0)
        rates = list(zip(state, expressions[-len(state) :], strict=True))
        start = np.zeros(len(state))
        integrator = None if by_collocation else heyoka.taylor_adaptive(rates, start, compact_mode=True, opt_level=0)
        _MODES[key] = _Compiled(values, integrator)
        if len(_MODES) > _MOST_MODES:
            _MODES.popitem(last=False)
    _MODES.move_to_end(key)
    return _MODES[key]


class CompiledMode:
    """Integrator and guards of a mode, compiled."""

    def __init__(
        self,
        symbols: ModeSymbols,
        contacts: Sequence[Touchable],
        mode: ContactMode,
        clamped: Sequence[int],
        length: int,
        by_collocation: bool,
    ) -> None:
        lined = [k for k, own in enumerate(mode) if own.along is not None]
        constants = Constants(lambda index: heyoka.par[index], 3 * len(lined), heyoka.expression)
        state = [heyoka.make_vars(f"s{index}") for index in range(length)]
        functions = constants.functions({name: getattr(heyoka, name) for name in FUNCTIONS})
        began: list[Vector | None] = [None] * len(mode)
        for place, k in enumerate(lined):
            began[k] = [Symbol(heyoka.par[3 * place + axis], constants) for axis in range(3)]
        solved = symbols.solved([Symbol(each, constants) for each in state], mode, clamped, began, functions)
        slips = slip_symbols(mode, contacts, solved)
        guards = [*guard_symbols(guards_of(contacts, mode), contacts, solved, began, functions), *solved.within_limits]
        values = [*guards, *slips, *solved.rates, 1.0]
        self._by_collocation = by_collocation
        self._turning = [k for k, pair in enumerate(zip(mode, contacts, strict=True)) if turning_slip(*pair)]
        self._count, self._slips, self._lined = len(guards), len(slips), lined
        expressions = [constants.symbol(value) for value in values]
        self._constants = constants.values
        self._values, self._integrator = _compiled(expressions, state, by_collocation)
        self._pars: dict[tuple[ContactMode, int], Array] = {}

    def _at_points(self, mode: ContactMode, inside: Inside, start: float, end: float) -> tuple[Array, Array]:
        """Guards and numbers of slips at the points of a step, (points, …).

        Raises:
            Diverged: one is not finite.
        """
        guards, slips, _ = self.values(inside(points_within(start, end)), mode)
        if not np.isfinite(guards).all():
            raise Diverged(f"a guard is not finite near t = {start:.6g} s")
        return guards, slips

    def _parameters(self, mode: ContactMode) -> Array:
        """Run-time parameters: directions of the lines at the start of a mode, and the numbers of the scene."""
        return np.concatenate([[x for k in self._lined for x in mode[k].along or ()], self._constants])

    def values(self, states: Array, mode: ContactMode) -> tuple[Array, Array, Array]:
        """Guards, numbers of slips and rates of states (times, state), each (times, …)."""
        found = self._called(states, mode)
        first = self._count + self._slips
        return found[: self._count].T, found[self._count : first].T, found[first:].T

    def _called(self, states: Array, mode: ContactMode) -> Array:
        """Guards, numbers of slips and rates in rows, of states (times, state)."""
        inputs = np.ascontiguousarray(states.T)
        if not self._values.nparams:
            return np.asarray(self._values(inputs))
        key = mode if self._lined else (), len(states)
        if key not in self._pars:
            if len(self._pars) > _KEPT:
                self._pars.clear()
            pars = self._parameters(mode)[: self._values.nparams]
            self._pars[key] = np.repeat(pars[:, None], len(states), axis=1)
        return np.asarray(self._values(inputs, pars=self._pars[key]))

    def walk(self, law: StretchLaw, mode: ContactMode, time: float, state: Array, until: float) -> Stretch[ContactMode]:
        """Stretch from a time and state to the first rise of a guard, or to ``until`` [s].

        Raises:
            Diverged: the steps become too small or too many.
        """
        if not until > time:
            return Stretch(time, time, mode, state, state, None)
        count, watch = StepCount(time, until), StepWatch()
        visited, grazes = list[tuple[float, Array]](), list[float]()
        last = state
        for step in self._steps(mode, time, state, until):
            visited.append((step.start, step.first))
            count.took(step.end)
            watch.took(step.end, step.end - step.start, landing=step.end == until)
            rise = locate_rise_within(
                lambda times, step=step: self.values(step.inside(times), mode)[0],  # type: ignore[misc]
                step.start,
                step.end,
                law.noise,
                step.start == time,
                law.near,
                grazes,
                step.guards,
            )
            if rise is not None:
                last = law.corrected(step.inside(np.array([rise[0]]))[0])
                return CompiledStretch(time, rise[0], mode, state, last, rise[1], visited, grazes, self)
            last = step.last
        last = law.corrected(last)
        return CompiledStretch(time, until, mode, state, last, None, visited, grazes, self)

    def _steps(self, mode: ContactMode, time: float, state: Array, until: float) -> Iterator[_Step]:
        """Steps of the integrator; one that a slip would stop in ends before.

        Raises:
            Diverged: a step fails.
        """
        step = self._collocation(mode) if self._by_collocation else self._series(mode)
        while time < until:
            end, last, inside = step(time, state, until)
            guards, slips = self._at_points(mode, inside, time, end)
            if self._slips and (stop := self._stop(slips, time, end)) is not None:
                end = time + _BEFORE_STOP * (stop - time)
                last = inside(np.array([end]))[0]
                guards, _ = self._at_points(mode, inside, time, end)
            yield _Step(time, end, state, last, inside, guards)
            time, state = end, last

    def _collocation(self, mode: ContactMode) -> _TakeStep:
        return PicardSteps(lambda states: self.values(states, mode)[2]).step

    def _series(self, mode: ContactMode) -> _TakeStep:
        integrator = self._integrator
        powers = np.arange(integrator.order + 1)[:, None]
        if len(integrator.pars):
            integrator.pars[:] = self._parameters(mode)[: len(integrator.pars)]

        def step(time: float, state: Array, until: float) -> tuple[float, Array, Inside]:
            integrator.state[:], integrator.time = state, time
            integrator.step(max_delta_t=until - time, write_tc=True)
            end = float(integrator.time)
            if not np.isfinite(integrator.state).all() or not end > time:
                raise Diverged(f"Taylor series stop at t = {time:.6g} s")
            series = np.array(integrator.tc)

            def inside(times: Array) -> Array:
                return np.asarray((series @ (times - time) ** powers).T)

            return until if until - end < np.spacing(until) else end, np.array(integrator.state), inside

        return step

    def _stop(self, slips: Array, start: float, end: float) -> float | None:
        """Time within a step at which a slip in the plane stops [s], beyond which its series mean another friction.

        A slip that stops nearly straight reverses in its series, without any sign of it but its speed. ``slips``: their
        numbers at the points of the step.
        """
        found = (lowest(slips[:, number] / slips[0, number], start, end) for number in range(0, self._slips, 3))
        return min((stop[0] for stop in found if stop is not None and stop[1] < _STOPS**2), default=None)

    def decay(self, state: Array, mode: ContactMode, k: int) -> tuple[float, Array]:
        """Slip speed of a contact, and change of the state until that slip would stop at its present rate."""
        _, slips, rates = self.values(state[None], mode)
        square, along, rate = slips[0, (place := 3 * self._turning.index(k)) : place + 3]
        return float(np.sqrt(square)), max(0.0, -along / rate) * rates[0]

    def within(self, law: StretchLaw, stretch: Stretch[ContactMode], times: FloatArray) -> FloatArray:
        """States at increasing times [s] within a stretch that this mode integrated, shape (times, state)."""
        begun, first = stretch.visited[0]
        states = np.empty((len(times), len(first)))
        early = times <= begun
        states[early] = first + (times[early] - begun)[:, None] * self.values(first[None], stretch.mode)[2]
        at = int(early.sum())
        if at < len(times):
            for step in self._steps(stretch.mode, begun, first, float(times[-1])):
                stop = int(np.searchsorted(times, step.end, side="right"))
                if stop > at:
                    states[at:stop] = step.inside(times[at:stop])
                    at = stop
        return np.array([law.corrected(state) for state in states])
