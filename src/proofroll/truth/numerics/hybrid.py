"""Hybrid motions: smooth stretches in one mode each, and transitions between them.

A route integrates one stretch and decides what comes next; :func:`follow` chains the stretches and knows no physics.
Two routes may share this module and its root finder of guards, and nothing else.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import NEAREST, controlled_step, corrected_by, go_on_from, integrated_to, solver_from
from proofroll.core.errors import Diverged, Refused
from proofroll.core.event_location import locate_rise
from proofroll.core.number_format import number
from proofroll.core.pace import PACE, OutOfTime
from proofroll.core.stalling import StepCount

State = FloatArray
ModeT = TypeVar("ModeT")
SpanT = TypeVar("SpanT", bound="Span")
# Start and end of a step [s] and its states inside, (state, times).
DenseStep = tuple[float, float, Callable[[FloatArray], FloatArray]]
# Successive stretches of zero length after which a route makes no progress.
_STUCK = 50
# A route makes no progress either after _MANY successive stretches, each shorter than _SHORT times the elapsed time,
# unless they have shrunk below _SHRUNK of their first length. Rebounds shrink by e each: 400 of them by a tenth for
# every e up to 0.9997.
_SHORT, _MANY, _SHRUNK = 1e-6, 400, 0.9
# After every _LOOK stretches the number still to come is estimated, unless they or their states shrink. _MOST:
# stretches of a path at most, a minute of work.
_LOOK, _MOST = 100, 1000
# Stretches of a path at most after a close decision, for nothing is known there.
_BEYOND = 50
# Parts of the time of a failure before it at which a path may end, where it fails at an end that is nearer.
_BEFORE = 1e-8, 1e-7, 1e-6, 1e-5, 1e-4


@dataclass(frozen=True)
class Happening:
    """A change of mode.

    Attributes:
        kind: kind of event, as the kind of element names it.
        name: name of the contact, joint or drive that changes.
        time: [s].
        blur: uncertainty of the time that all routes share [s].
    """

    kind: str
    name: str
    time: float
    blur: float = 0.0


class Span(Protocol):
    """Protocol of a stretch of time in one mode, as a kind of element describes it."""

    @property
    def start(self) -> float:
        """Start [s]."""

    @property
    def end(self) -> float:
        """End [s]."""

    @property
    def guard(self) -> object | None:
        """Guard that ended it; None: it reached its time limit."""


class StretchLaw(NamedTuple):
    """Equations of a mode.

    Attributes:
        rates: right-hand side, a function of the state, which has the time if they depend on it.
        guards: values that are negative while the mode lasts, shape (guards,).
        corrected: projects a state onto its constraints; applied after every step.
        noise: round-off of the guards at the start, shape (guards,); a guard counts as risen only above it.
        near: distance from zero of each guard's maximum below which a zero is uncertain, shape (guards,).
    """

    rates: Callable[[State], State]
    guards: Callable[[State], FloatArray]
    corrected: Callable[[State], State]
    noise: FloatArray
    near: FloatArray


@dataclass(frozen=True)
class Stretch(Generic[ModeT]):
    """A stretch of time in one mode.

    Attributes:
        start, end: [s].
        mode: active constraints and forces.
        first: state at the start.
        last: state at the end, before any transition.
        guard: index of the guard that ended it; None: it reached its time limit.
        visited: time [s] and state at the start of each step, if they were kept.
        grazes: times [s] of crests of guards at zero: a small change decides whether they rise above it.
        blur: uncertainty of the end by the error of a step in its guard, however slowly that reaches zero [s].
        dense: start and end of each step [s] and its states inside, (state, times), of an integrator that has them.
        exact: True if these have as many digits inside a step as at its ends.
        summed: True if it stands for infinitely many changes of the forces.
    """

    start: float
    end: float
    mode: ModeT
    first: State
    last: State
    guard: int | None
    visited: Sequence[tuple[float, State]] = ()
    grazes: Sequence[float] = ()
    blur: float = 0.0
    dense: Sequence[DenseStep] = ()
    exact: bool = False
    summed: bool = False

    @property
    def middle(self) -> float:
        """Time in the middle of its last part [s]."""
        return (self.start + self.end) / 2


def states_inside(steps: Sequence[DenseStep], times: FloatArray) -> FloatArray:
    """States at rising times [s] within successive steps, (state, times)."""
    numbers = np.searchsorted([end for _, end, _ in steps[:-1]], times)
    return np.concatenate([steps[k][2](times[numbers == k]) for k in np.unique(numbers)], axis=1)


@dataclass(frozen=True)
class Transition(Generic[ModeT]):
    """State and mode after a stretch, with the changes that led there.

    Attributes:
        state, mode: of the next stretch; mode None: the continuation is unknown and the path ends.
        happenings: kind and name of each change.
        margin: relative distance of the forces from another outcome; inf where nothing was decided.
        delay: time from the end of the stretch to the end of the changes [s]; infinitely many may follow each other
            meanwhile.
        blur: uncertainty of that delay that all routes share [s].
    """

    state: State
    mode: ModeT | None
    happenings: tuple[tuple[str, str], ...]
    margin: float = np.inf
    delay: float = 0.0
    blur: float = 0.0


class StoppedWithin(Diverged):
    """Failure of a walk at its ``time``; ``stretch``: the path before it; None: there is none."""

    def __init__(self, text: str, time: float | None = None, stretch: Any = None) -> None:
        super().__init__(text, time)
        self.stretch = stretch


class SwitchingRoute(Protocol[ModeT, SpanT]):
    """Protocol of a route: integrates stretches in its own state variables and decides the transitions."""

    def begin(self) -> Transition[ModeT]:
        """State and mode at time 0."""

    def walk(self, time: float, state: State, mode: ModeT, until: float) -> SpanT:
        """Integrates one stretch from ``time`` to its first guard, or to ``until`` [s]."""

    def change(self, stretch: SpanT) -> Transition[ModeT]:
        """Transition after a stretch that ended at a guard or at a break."""


class HybridRoute(SwitchingRoute[ModeT, Stretch[ModeT]], Protocol):
    """Protocol of a route that finds states within a stretch from the state at its start."""

    def within(self, stretch: Stretch[ModeT], times: FloatArray) -> FloatArray:
        """States at increasing times [s] within a stretch, shape (times, state)."""


@dataclass(frozen=True)
class HybridPath(Generic[SpanT]):
    """A whole motion.

    Attributes:
        stretches: in order, from time 0.
        happenings: changes of mode, in order of time.
        margins: time [s] and relative distance from another outcome, of each decision.
        known: True if the last stretch reaches the end time; otherwise its continuation is unknown.
        ended: error that ended the path early, as a clause; empty: none did.
        transitions: before each stretch, the first at time 0; one more at the end of a path without a next mode.
    """

    stretches: tuple[SpanT, ...]
    happenings: tuple[Happening, ...]
    margins: tuple[tuple[float, float], ...]
    known: bool = True
    ended: str = ""
    transitions: tuple[Transition[Any], ...] = ()

    def stretch_at(self, times: FloatArray) -> list[int]:
        """Index of the stretch at each time [s]; the time of a change belongs to the later stretch."""
        ends = [stretch.end for stretch in self.stretches[:-1]]
        return [int(k) for k in np.searchsorted(ends, times, side="right")]


def follow(
    route: SwitchingRoute[ModeT, SpanT],
    until: float,
    breaks: Sequence[float] = (),
    close: float = 0.0,
    edge: float = np.inf,
) -> HybridPath[SpanT]:
    """Path from time 0 to ``until`` [s]; stretches also end at ``breaks`` [s], rising, where the rates are not smooth.

    A refusal or failure at a later time than 0 ends the path; its text is kept, unless the path had come to a decision
    with a margin below ``close``, where round-off decides, or another route had by then, at the time ``edge`` [s].

    Raises:
        Diverged: the route fails, or makes no progress, at the start.
        Refused: by the route, at the start.
    """
    time, over, change, standstills = 0.0, 0.0, route.begin(), 0
    short, longest, since = 0, 0.0, 0
    stretches: list[SpanT] = []
    happenings: list[Happening] = []
    margins, transitions = list[tuple[float, float]](), list[Transition[ModeT]]()

    def path(complete: bool, ended: str = "") -> HybridPath[SpanT]:
        return HybridPath(
            stretches=tuple(stretches),
            happenings=tuple(happenings),
            margins=tuple(margins),
            known=complete,
            ended=ended,
            transitions=tuple(transitions),
        )

    while True:
        transitions.append(change)
        over = max(over, time + change.delay)  # no change is reported before the delay of an earlier one is over
        happenings += [Happening(*what, over, change.blur) for what in change.happenings]
        margins.append((time, change.margin))
        since = since + 1 if since or change.margin < close else 0
        if change.mode is None or since > _BEYOND:
            return path(complete=False)
        end = next((corner for corner in breaks if time < corner < until), until)
        try:
            PACE.reached(time)
            stretch = route.walk(time, change.state, change.mode, end)
        except (Diverged, Refused) as error:
            stretches += _known(error, partial(route.walk, time, change.state, change.mode), time, end, close)
            if not stretches:
                raise
            return path(complete=False, ended=str(error))
        stretches.append(stretch)
        if stretch.guard is None and end == until:
            return path(complete=True)
        standstills = standstills + 1 if stretch.end <= stretch.start else 0
        length = stretch.end - stretch.start
        if length > 0.0:
            if length > _SHORT * stretch.end or length < _SHRUNK * longest:
                short, longest = 0, length
            short += 1
        try:
            if standstills > _STUCK or short > _MANY:
                raise Diverged(
                    f"the truth makes no progress at t = {stretch.end:g} s, where {_latest(happenings)} follow each "
                    "other without end; ask for an earlier end of the run"
                )
            if short == 1:
                _refuse_many(stretches, until)
            time, change = stretch.end, route.change(stretch)
        except (Diverged, Refused) as error:
            undecided = stretch.end >= edge or min(margin for _, margin in margins) < close
            if not undecided and stretch.end <= 0:
                raise
            ended = "" if undecided else str(error)
            return path(complete=False, ended=ended)


def _known(error: Exception, walk: Callable[[float], SpanT], time: float, end: float, close: float) -> list[SpanT]:
    """Stretch from a time to just before the failure of a walk to an end [s]; none if nothing is known."""
    reached = error.time if isinstance(error, Diverged) else None
    if reached is None or not time < reached < end:
        return []
    if isinstance(error, StoppedWithin) and error.stretch is not None:
        return [error.stretch]
    for part in (close, *_BEFORE):
        with suppress(Diverged, Refused):
            if time < reached * (1 - part):
                return [walk(reached * (1 - part))]
    return []


def _latest(happenings: Sequence[Happening]) -> str:
    """Kinds of the last changes and what they happened to, for a sentence."""
    kinds: dict[str, dict[str, None]] = {}
    for change in happenings[-_STUCK:]:
        kinds.setdefault(change.name, {})[change.kind] = None
    return " and ".join(f"{', '.join(of)} of {name}" for name, of in sorted(kinds.items())) or "changes of mode"


def _refuse_many(stretches: Sequence[Span], until: float) -> None:
    """Refuses early a motion whose mode will change thousands of times.

    Raises:
        Diverged: the durations of the last stretches predict more than _MOST stretches until ``until`` [s].
    """
    stretches = [stretch for stretch in stretches if stretch.guard is not None]  # breaks are known, and no changes
    if not stretches or len(stretches) % _LOOK:
        return
    last, end = stretches[-_LOOK:], stretches[-1].end
    spans = [last[_LOOK // 2].start - last[0].start, end - last[_LOOK // 2].start]
    calm = sum(spans) < _SHRUNK * end * _LOOK / len(stretches)  # changes came slower before, and may again
    ahead = (until - end) * _LOOK / sum(spans) if sum(spans) > 0.0 else np.inf
    if len(stretches) + (0.0 if calm else ahead) > _MOST and min(spans) > _SHRUNK * max(spans) and not _narrows(last):
        raise Diverged(
            f"by t = {end:g} s there have been {len(stretches)} changes; at this pace {number(ahead, 1)} more follow "
            f"until t = {until:g} s, and the truth follows {_MOST}; ask for a shorter time"
        )


def _narrows(stretches: Sequence[Span]) -> bool:
    """True if the states at the starts of stretches contract; their last component, the time, does not count."""
    starts = np.array([stretch.first[:-1] for stretch in stretches if isinstance(stretch, Stretch)])
    if not len(starts):
        return False
    early, late = (np.linalg.norm(np.ptp(half, axis=0)) for half in np.array_split(starts, 2))
    return bool(late < _SHRUNK * early)


def integrate_to_guard(
    law: StretchLaw,
    mode: ModeT,
    time: float,
    state: State,
    until: float,
    tolerance: FloatArray,
    first_step: float | None = None,
) -> Stretch[ModeT]:
    """Stretch from a time and state by DOP853 to the first rise of a guard through zero, or to ``until`` [s].

    ``tolerance``: absolute, of each component of the state. ``first_step``: length of the first step at most [s], from
    the stretch before, as rebounds get shorter and shorter; None: chosen from the rates.

    Raises:
        Diverged: the rates fail, at its ``time``, or it would take too many steps.
        Refused: by the rates, at the start.
    """
    if not until > time:
        return Stretch(start=time, end=time, mode=mode, first=state, last=state, guard=None)
    solver = solver_from(lambda _, y: law.rates(y), time, state, float(np.min(tolerance)), tolerance)
    back, count, grazes = corrected_by(law.corrected), StepCount(time, until), list[float]()
    visited, dense = list[tuple[float, State]](), list[DenseStep]()

    def stretch(end: float, last: State, guard: int | None = None) -> Stretch[ModeT]:
        return Stretch(
            start=time,
            end=end,
            mode=mode,
            first=state,
            last=last,
            guard=guard,
            visited=visited,
            grazes=grazes,
            dense=dense,
        )

    if first_step is not None:
        solver.h_abs = min(solver.h_abs, max(first_step, 16 * float(np.spacing(time))))
    longest = np.inf
    while solver.t < until:
        begun, seen = (float(solver.t), solver.y.copy()), len(grazes)
        try:
            controlled_step(solver, None, until, longest)
            inside = _lazy_dense(solver)
            rise = len(law.noise) and locate_rise(
                solver, law.guards, law.noise, solver.t_old == time, law.near, grazes, dense=inside
            )
            reached = float(solver.t), solver.y
            if not rise:
                go_on_from(solver, back(*reached))
        except (Diverged, Refused) as stopped:  # the step leads where the motion does not
            longest = (float(solver.t) - begun[0] or min(solver.h_abs, longest, until - begun[0])) / 2
            del grazes[seen:]
            if longest > NEAREST * max(until - time, begun[0]):
                solver = solver_from(lambda _, y: law.rates(y), *begun, float(np.min(tolerance)), tolerance, longest)
                continue
            if begun[0] > time:
                raise StoppedWithin(str(stopped), begun[0], stretch(*begun)) from None
            if isinstance(stopped, Refused):
                raise
            raise StoppedWithin(str(stopped), begun[0]) from None
        longest *= 2.0
        visited.append(begun)
        dense.append((begun[0], reached[0], inside))
        if rise:
            return stretch(rise.time, law.corrected(rise.state), rise.guard)
        count.took(solver.t)
        try:
            PACE.reached(float(solver.t))
        except OutOfTime as stopped:
            raise StoppedWithin(str(stopped), float(solver.t), stretch(float(solver.t), solver.y.copy())) from None
    return stretch(until, np.asarray(solver.y))


def _lazy_dense(solver: Any) -> Callable[[FloatArray], FloatArray]:
    """Dense output of the last step of DOP853, (state, times); its three further rates wait for the first call."""
    step = copy(solver)
    step.K_extended = solver.K_extended.copy()
    output = cache(step.dense_output)
    return lambda times: np.asarray(output()(times))


def states_at(
    law: StretchLaw, visited: Sequence[tuple[float, State]], times: FloatArray, tolerance: FloatArray
) -> FloatArray:
    """States at rising times [s], each integrated from the start of the step that holds it, shape (times, state)."""
    starts = np.searchsorted([begun for begun, _ in visited], times, side="right") - 1
    steps, rtol = [visited[max(int(k), 0)] for k in starts], float(np.min(tolerance))
    return np.array(
        [
            law.corrected(integrated_to(lambda _, y: law.rates(y), begin, y, t, rtol, tolerance))
            for t, (begin, y) in zip(times.tolist(), steps, strict=True)
        ]
    )


def states_of(
    route: HybridRoute[ModeT], path: HybridPath[Stretch[ModeT]], times: FloatArray, stretches: Sequence[int]
) -> FloatArray:
    """States at rising times [s], each within the stretch of the given index or at an end, shape (times, state)."""
    indices, chosen = np.asarray(stretches), [path.stretches[number] for number in stretches]
    # beyond the end of a path that is not known further, rates may be of any size
    within = np.clip(times, [stretch.start for stretch in chosen], [stretch.end for stretch in chosen])
    parts = [route.within(path.stretches[number], within[indices == number]) for number in sorted(set(stretches))]
    return np.concatenate(parts)


def first_close(paths: Sequence[HybridPath[Any]], close: float) -> float:
    """Time [s] of the first graze, or decision whose margin is below ``close``; inf: there is none."""
    decisions = (time for path in paths for time, margin in path.margins if margin < close)
    grazes = (time for path in paths for stretch in path.stretches for time in getattr(stretch, "grazes", ()))
    return max(0.0, min([*decisions, *grazes], default=np.inf))
