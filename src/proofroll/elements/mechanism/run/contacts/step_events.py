"""Events of contacts, from the state of each contact in the steps of an engine: open, sticking or slipping."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proofroll.core.events import Event, EventKind
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact

OPEN, STICK, SLIP = range(3)  # states of a contact
States = tuple[int, ...]


@dataclass(frozen=True)
class StepEvent(Event):
    """Event between two steps of an engine: contacts that close or part may only hop, and what sticks may rest."""


# Slip speed that does not count, in parts of what gravity adds to a speed in one step: bodies held by several contacts
# have friction at its bound in some of them, which creep at most.
_HELD = 1e-4


def least_slip(gravity: Sequence[float], dt: float) -> float:
    """Slip speed up to which a contact is held in steps ``dt`` [s] [m/s]."""
    return _HELD * dt * float(np.linalg.norm(gravity))


def state_of(normal: float, friction: float, bound: float) -> int:
    """State of a contact by the sizes of its force: friction at its ``bound``, which may be infinite, slips."""
    if normal <= 0.0:
        return OPEN
    return STICK if friction < bound else SLIP


class _KeptState(NamedTuple):
    """Steps in which a contact keeps its state: time before the first one, of it, and of the next run's first [s]."""

    low: float
    high: float
    end: float
    state: int


class StepEvents:
    """Events of the contacts of one run, see :class:`proofroll.core.engine_abilities.LocatesEvents`.

    A state that lasts for two steps or less does not count, as of contacts that hop where they begin to slip, unless it
    presses between two open states: then the contact rebounds. Nor do events of the first two steps count, in which
    engines that start without loads build them up.
    """

    def __init__(self, contacts: Sequence[BodyContact], dt: float) -> None:
        """Takes the longest step [s]."""
        self._dt = dt
        self._names = [contact.name for contact in contacts]
        self._rubs = any(0 < contact.friction < np.inf for contact in contacts)
        self._changes: list[tuple[float, float, States]] = []
        self._states: States = ()
        self._time = 0.0

    def __bool__(self) -> bool:
        """True if a contact may begin to slip; others are not worth a look at each step."""
        return self._rubs

    def observe(self, time: float, states: States) -> None:
        """Takes the states of all contacts in one step, whose forces belong to a ``time`` [s]."""
        if states != self._states:
            self._changes.append((self._time, time, states))
            self._states = states
        self._time = time

    def state(self, number: int) -> int:
        """State of a contact in the last step; one that is not watched sticks."""
        return self._states[number] if self._states else STICK

    def events(self) -> Sequence[StepEvent] | None:
        """Events so far, in order, each with a bracket from look to look; None if no contact may slip."""
        if not self:
            return None
        events = [event for number in range(len(self._names)) for event in self._events_of(number)]
        return sorted(events, key=lambda event: event.time)

    def _events_of(self, number: int) -> list[StepEvent]:
        ends = [*(high for _, high, _ in self._changes[1:]), np.inf]
        runs = [
            _KeptState(low, high, end, states[number])
            for (low, high, states), end in zip(self._changes, ends, strict=True)
        ]
        events = list[StepEvent]()
        short = 2.5 * self._dt
        for before, run in itertools.pairwise(_settled(_joined(runs), short)):
            kind = _kind(before, run, short)
            if kind and run.high > short:
                time, name = 0.5 * (run.low + run.high), self._names[number]
                events.append(StepEvent(kind, time=time, time_low=run.low, time_high=run.high, name=name))
        return events


def _kind(before: _KeptState, run: _KeptState, short: float) -> EventKind | None:
    """Event between two runs; a contact that presses for a ``short`` time [s] has rebounded: it makes no second one."""
    if run.state == OPEN:
        return None if before.end - before.high < short else EventKind.LIFT_OFF
    if before.state == OPEN:
        return EventKind.IMPACT
    return EventKind.SLIP if run.state == SLIP else EventKind.STICK


def _joined(runs: Sequence[_KeptState]) -> list[_KeptState]:
    """Runs with neighbours of the same state as one."""
    joined: list[_KeptState] = []
    for run in runs:
        if joined and joined[-1].state == run.state:
            joined[-1] = joined[-1]._replace(end=run.end)
        else:
            joined.append(run)
    return joined


def _settled(runs: list[_KeptState], short: float) -> list[_KeptState]:
    """Runs without those of a ``short`` time [s], whose steps go to the next run; rebounds and the last run stay."""
    kept: list[_KeptState] = []
    since: _KeptState | None = None  # first of the short runs since the last one kept
    for run, after in zip(runs, [*runs[1:], None], strict=True):
        rebounds = bool(kept) and kept[-1].state == OPEN and after is not None and after.state == OPEN
        if run.end - run.high > short or rebounds:
            kept.append(run if since is None else run._replace(low=since.low, high=since.high))
            since = None
        elif kept:
            since = since or run
    return _joined(kept)
