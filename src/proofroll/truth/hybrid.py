"""Motions that switch: smooth stretches, and what happens at the instants between them.

A route integrates one stretch and decides what comes next; :func:`follow` puts the stretches together and knows no
physics. Two routes may share this module, which finds where guards rise through zero, and nothing else.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import controlled_step, corrected_by, go_on_from, integrated_to, located, solver_from
from proofroll.core.errors import Diverged, Refused
from proofroll.core.number_format import number

State = FloatArray
ModeT = TypeVar("ModeT")
LegT = TypeVar("LegT", bound="Span")
Rates = Callable[[float, State], FloatArray]
# Stretches without any length, one after the other, after which a route is taken to make no progress.
_STUCK = 50
# Stretches shorter than this part of the time that has passed, after which it makes none either unless they have shrunk
# to this part of what they were: rebounds shrink by e each, 400 by a tenth for every e up to 0.9997.
_SHORT, _MANY, _SHRUNK = 1e-6, 400, 0.9
# Stretches after which those to come are counted if neither they nor their states shrink; and the most of a path: a
# minute of work.
_LOOK, _MOST = 100, 1000


@dataclass(frozen=True)
class Happening:
    """A change of what acts.

    Attributes:
        kind: as the kind of element names its events.
        name: of what changes.
        time: [s].
        blur: uncertainty of the time, of every route [s].
    """

    kind: str
    name: str
    time: float
    blur: float = 0.0


class Span(Protocol):
    """A stretch of time in one mode, as a kind of element describes it."""

    @property
    def start(self) -> float:
        """Its start [s]."""

    @property
    def end(self) -> float:
        """Its end [s]."""

    @property
    def guard(self) -> object | None:
        """The guard that ended it; None: the end of time."""


@dataclass(frozen=True)
class Stretch(Generic[ModeT]):
    """A stretch of time in one mode.

    Attributes:
        start, end: [s].
        mode: names of the constraints and forces that act.
        first: the state at the start.
        last: the state at the end, before anything changes there.
        guard: number of the guard that ended it; None: the end of time.
        visited: time [s] and state at the start of each step, where they were kept.
    """

    start: float
    end: float
    mode: ModeT
    first: State
    last: State
    guard: int | None
    visited: Sequence[tuple[float, State]] = ()


@dataclass(frozen=True)
class Transition(Generic[ModeT]):
    """Transition of a route at the end of a leg.

    Attributes:
        state, mode: of the next leg; no mode: what follows is not known, and the path ends.
        happenings: changes of mode, by name.
        margin: relative distance of the forces from another outcome; inf where nothing was decided.
        delay: time after the leg's end at which the changes are over [s]: infinitely many may follow each other within.
        blur: uncertainty of that delay, of every route [s].
    """

    state: State
    mode: ModeT | None
    happenings: tuple[tuple[str, str], ...]
    margin: float = np.inf
    delay: float = 0.0
    blur: float = 0.0


class Legs(Protocol[ModeT, LegT]):
    """One way of integrating the legs, in state variables of its own."""

    def begin(self) -> Transition[ModeT]:
        """The state and mode at time 0."""

    def walk(self, time: float, state: State, mode: ModeT, until: float) -> LegT:
        """One leg from ``time`` to its first guard, or to ``until`` [s]."""

    def change(self, leg: LegT) -> Transition[ModeT]:
        """State and mode after a leg that a guard or a break ended."""


class HybridRoute(Legs[ModeT, Stretch[ModeT]], Protocol):
    """Legs as stretches with a state at their start, from which any time within is found."""

    def within(self, leg: Stretch[ModeT], times: FloatArray) -> FloatArray:
        """States at rising times from the start of a leg on [s], shape (times, state)."""


@dataclass(frozen=True)
class HybridPath(Generic[LegT]):
    """The whole sequence.

    Attributes:
        legs: one after another from time 0.
        happenings: each change, with its time.
        margins: of each decision: time [s] and distance from another outcome, relative.
        known: the last leg reaches the end of time; else what follows it is not known.
    """

    legs: tuple[LegT, ...]
    happenings: tuple[Happening, ...]
    margins: tuple[tuple[float, float], ...]
    known: bool = True

    def leg_at(self, times: FloatArray) -> list[int]:
        """Number of the leg at each time [s]; a time of a change belongs to the later leg."""
        ends = [leg.end for leg in self.legs[:-1]]
        return [int(k) for k in np.searchsorted(ends, times, side="right")]


def follow(
    route: Legs[ModeT, LegT], until: float, breaks: Sequence[float] = (), close: float = 0.0
) -> HybridPath[LegT]:
    """Path from time 0 to ``until`` [s]; a leg ends at each of the rising ``breaks`` [s] of its rates.

    After a decision with a margin below ``close``, where round-off decides, what is refused ends the path.

    Raises:
        Diverged, Refused: by the route, or it makes no progress.
    """
    time, over, change, still = 0.0, 0.0, route.begin(), 0
    short, longest = 0, 0.0
    legs: list[LegT] = []
    happenings: list[Happening] = []
    margins = []
    while True:
        over = max(over, time + change.delay)  # nothing is told to happen before what led to it is over
        happenings += [Happening(*what, over, change.blur) for what in change.happenings]
        margins.append((time, change.margin))
        if change.mode is None:
            return HybridPath(tuple(legs), tuple(happenings), tuple(margins), known=False)
        end = next((at for at in breaks if time < at < until), until)
        leg = route.walk(time, change.state, change.mode, end)
        legs.append(leg)
        if leg.guard is None and end == until:
            return HybridPath(tuple(legs), tuple(happenings), tuple(margins))
        still = still + 1 if leg.end <= leg.start else 0
        length = leg.end - leg.start
        if length > 0.0:
            if length > _SHORT * leg.end or length < _SHRUNK * longest:
                short, longest = 0, length
            short += 1
        try:
            if still > _STUCK or short > _MANY:
                raise Diverged(f"the truth makes no progress at t = {leg.end:g} s, where its modes alternate at once")
            if short == 1:
                _refuse_many(legs, until)
            time, change = leg.end, route.change(leg)
        except (Diverged, Refused):
            if min(margin for _, margin in margins) < close:
                return HybridPath(tuple(legs), tuple(happenings), tuple(margins), known=False)
            raise


def _refuse_many(legs: Sequence[Span], until: float) -> None:
    """Refuses a motion whose modes change thousands of times, as soon as it can be seen.

    Raises:
        Diverged: they do, by what the last stretches lasted.
    """
    if len(legs) % _LOOK:
        return
    last, end = legs[-_LOOK:], legs[-1].end
    spans = [last[_LOOK // 2].start - last[0].start, end - last[_LOOK // 2].start]
    calm = sum(spans) < _SHRUNK * end * _LOOK / len(legs)  # what was calm before may be so again
    ahead = (until - end) * _LOOK / sum(spans) if sum(spans) > 0.0 else np.inf
    if len(legs) + (0.0 if calm else ahead) > _MOST and min(spans) > _SHRUNK * max(spans) and not _narrows(last):
        raise Diverged(
            f"by t = {end:g} s there have been {len(legs)} changes, some {number(ahead, 1)} are to come, "
            f"and the truth follows {_MOST}"
        )


def _narrows(legs: Sequence[Span]) -> bool:
    """True if the states between which stretches lead come nearer to each other; their last number is the time."""
    starts = np.array([leg.first[:-1] for leg in legs if isinstance(leg, Stretch)])
    if not len(starts):
        return False
    first, second = (np.linalg.norm(np.ptp(half, axis=0)) for half in np.array_split(starts, 2))
    return bool(second < _SHRUNK * first)


def walked(
    rates: Rates,
    time: float,
    state: State,
    until: float,
    *,
    tolerance: FloatArray,
    guards: Callable[[State], FloatArray],
    corrected: Callable[[State], State],
    first_step: float | None = None,
    noise: FloatArray | None = None,
    visited: list[tuple[float, State]] | None = None,
) -> tuple[float, State, int | None]:
    """Integrate by DOP853 to the first rise of a guard through zero, or to ``until`` [s].

    Args:
        rates: right-hand side.
        time: where the leg starts [s].
        state: there.
        until: its last end [s].
        tolerance: absolute, of each component of the state.
        guards: values that are negative while the mode lasts, shape (guards,).
        corrected: puts a state back on its constraints; applied after every step.
        first_step: [s], of the order of the leg before: rebounds get shorter and shorter. None: by the rates.
        noise: round-off of the guards, by which they must rise above zero to be seen, shape (guards,); None: none.
        visited: takes time and state at the start of each step, for :func:`between`.

    Returns:
        Time [s], state there, and number of the guard; None: the end of time.

    Raises:
        Diverged: the integration stops.
    """
    if not until > time:
        return time, state, None
    solver, back = solver_from(rates, time, state, float(np.min(tolerance)), tolerance), corrected_by(corrected)
    if first_step is not None:
        solver.h_abs = min(solver.h_abs, max(first_step, 16 * float(np.spacing(time))))
    while solver.t < until:
        if visited is not None:
            visited.append((solver.t, solver.y.copy()))
        controlled_step(solver, None, until)
        if rise := located(solver, guards, 0.0 if noise is None else noise, leaving=solver.t_old == time):
            return rise.time, corrected(rise.state), rise.guard
        go_on_from(solver, back(solver.t, solver.y))
    return until, np.asarray(solver.y), None


def between(
    rates: Rates,
    visited: Sequence[tuple[float, State]],
    times: FloatArray,
    tolerance: FloatArray,
    corrected: Callable[[State], State],
) -> FloatArray:
    """States at rising times [s], each from the start of the step that holds it, shape (times, state)."""
    starts = np.searchsorted([begun for begun, _ in visited], times, side="right") - 1
    steps = [visited[max(int(k), 0)] for k in starts]
    rtol = float(np.min(tolerance))
    return np.array(
        [
            corrected(integrated_to(rates, at, y, t, rtol, tolerance))
            for t, (at, y) in zip(times.tolist(), steps, strict=True)
        ]
    )


def states_of(
    route: HybridRoute[ModeT], path: HybridPath[Stretch[ModeT]], times: FloatArray, legs: Sequence[int]
) -> FloatArray:
    """States at rising times [s], each within the leg of the given number, shape (times, state)."""
    at = np.asarray(legs)
    parts = [route.within(path.legs[number], times[at == number]) for number in sorted(set(legs))]
    return np.concatenate(parts)


def first_close(paths: Sequence[HybridPath[Any]], close: float) -> float:
    """Time [s] of the first decision that is nearer to another outcome than ``close``; inf: there is none."""
    return min((time for path in paths for time, margin in path.margins if margin < close), default=np.inf)
