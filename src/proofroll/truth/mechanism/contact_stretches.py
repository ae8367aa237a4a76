"""Stretches of a mechanism whose bodies touch: what its two routes share, which is no equation and no decision."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.contacts.acting import FAINT, OPEN, Acting, ContactMode, across, changes
from proofroll.elements.mechanism.contacts.touching import Touching
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.signal import varies
from proofroll.truth.hybrid import Stretch, Transition, between
from proofroll.truth.mechanism.contact_guards import (
    AT_REST,
    STANDS,
    STOPPED,
    ContactGuard,
    Touchable,
    faint_time,
    guard_value,
    guards_of,
    noise_of,
    refuse_turning_onset,
)
from proofroll.truth.mechanism.stretches import Stretches, StretchLaw

_AHEAD = 1e-9  # of the natural time: after a stretch has begun, whether an effort is at its limit
_CLAMPED = 1e-9  # of a limit: an effort as near to it comes from it
# A slip that comes to rest: part by which its logarithm falls in a step, the most steps, and what is left at their end.
_DECAY, _MOST_DECAYS, _NOTHING = 0.25, 120, 1e-12


class SolvedContacts(NamedTuple):
    """Motion and forces at a state in a mode.

    Attributes:
        touching: of each contact.
        velocity, acceleration: of the route's own coordinates.
        slide_rate: rate of each slide, (contacts, 3).
        force: on body a of each contact, (contacts, 3).
        response: Painlevé's measure, 1 without friction.
    """

    touching: Sequence[Touching]
    velocity: Array
    acceleration: Array
    slide_rate: Array
    force: Array
    response: float


class _Equations(Protocol):
    mechanism: Mechanism
    contacts: tuple[Touchable, ...]

    def rate(self, state: Array, mode: ContactMode, /) -> Array: ...

    def eliminated(self, state: Array, mode: ContactMode, /) -> Array: ...

    def excess(self, state: Array, /) -> Array: ...


class ContactStretches(Stretches[ContactMode]):
    """Stretches, ends of them, and what follows; a state ends with the time.

    See :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    def __init__(self, equations: _Equations, length: int, tolerance: float, size: float) -> None:
        """Takes the length of a state without time, the tolerance of each step, the mechanism's size."""
        super().__init__(length + 1, tolerance)
        self._given, self.contacts, self._size = equations, equations.contacts, size
        self._timed = any(map(varies, equations.mechanism.signals))

    @abstractmethod
    def _solved(self, state: Array, mode: ContactMode) -> SolvedContacts:
        """Motion and forces at a state."""

    @abstractmethod
    def _touching(self, state: Array) -> Sequence[Touching]:
        """Each contact at a state."""

    @abstractmethod
    def _decided(self, state: Array, closed: Sequence[bool], still: Sequence[bool]) -> tuple[ContactMode, float]:
        """Mode that follows from the forces, and how far it is from another one, relative."""

    @abstractmethod
    def _torn(self, leg: Stretch[ContactMode]) -> Exception:
        """Refusal of a motion that is not unique from the end of a stretch on."""

    @abstractmethod
    def _leaving(self, state: Array, mode: ContactMode, k: int) -> Acting:
        """A slip that begins at the bound of friction, against the force that held."""

    @abstractmethod
    def _impact(self, leg: Stretch[ContactMode], hit: int) -> Transition[ContactMode]:
        """Transition of the motion by an impact."""

    def _law(self, state: Array, mode: ContactMode) -> StretchLaw:
        guards, equations = guards_of(self.contacts, mode), self._given
        # an effort comes to its limit, or back from it
        side = np.where(equations.excess(state + _AHEAD * equations.rate(state, mode)) > 0, 1.0, -1.0)
        noise = np.where(np.abs(excess := equations.excess(state)) < _CLAMPED, 2 * np.abs(excess), 0.0)
        return StretchLaw(
            lambda y: equations.rate(y, mode),
            lambda y: np.append(self._guards(y, mode, guards), -side * equations.excess(y)),
            lambda y: equations.eliminated(y, mode),
            np.append(noise_of(guards, self._size), noise),
        )

    def _guards(self, state: Array, mode: ContactMode, guards: Sequence[ContactGuard]) -> FloatArray:
        found, contacts = self._solved(state, mode), self.contacts
        return np.array(
            [guard_value(one, mode, contacts, found.touching, found.force, found.response) for one in guards]
        )

    def walk(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """See the protocol."""
        if self._stands(state, mode):
            return Stretch(time, until, mode, state, state, None)
        start, begun = self._kicked(time, state, mode)
        leg = super().walk(begun, start, mode, until)
        end, last = leg.end, leg.last
        guards = guards_of(self.contacts, mode)
        if leg.guard is not None and leg.guard < len(guards):
            k, kind = guards[leg.guard]
            if kind == "still":
                last = self._spent(last, mode, k)
                end += float(last[-1] - leg.last[-1])
        return replace(leg, start=time, first=state, end=end, last=last)

    def _spent(self, state: Array, mode: ContactMode, k: int) -> Array:
        """The state where a faint slip has ended, by the method of Runge and Kutta in the logarithm of what is left.

        A slip turns the faster the slower it is: its equations are smooth in the logarithm, and stiff in time.
        """
        if mode[k].along is not None:
            return state

        def decay(y: Array) -> Array:
            """Change of a state in the time that a straight line to rest takes."""
            found = self._touching(y)
            now = tuple(_headed(own, each) for own, each in zip(mode, found, strict=True))
            return faint_time(found[k], self._solved(y, now).slide_rate[k]) * self._given.rate(y, now)

        for _ in range(_MOST_DECAYS):
            if np.linalg.norm(across(self._touching(state)[k])) < _NOTHING:
                break
            one = decay(state)
            two = decay(state + _DECAY / 2 * one)
            three = decay(state + _DECAY / 2 * two)
            state = state + _DECAY / 6 * (one + 2 * two + 2 * three + decay(state + _DECAY * three))
        return np.asarray(state + decay(state))

    def _kicked(self, time: float, state: Array, mode: ContactMode) -> tuple[Array, float]:
        """The state and time a moment later where a slip begins from rest in two dimensions: with a direction."""
        found, wait = self._solved(state, mode), 0.0
        for k, own in enumerate(mode):
            begins = own.kind == "slip" and own.along is None and self.contacts[k].friction
            if begins and np.linalg.norm(across(found.touching[k])) < FAINT:
                wait = max(wait, 2 * FAINT / float(np.linalg.norm(found.slide_rate[k])))
        return (state, time) if not wait else (state + wait * self._given.rate(state, mode), time + wait)

    def within(self, leg: Stretch[ContactMode], times: FloatArray) -> FloatArray:
        """See the protocol."""
        if not leg.visited:
            return np.array([leg.first for _ in times])
        law = self._law(leg.first, leg.mode)
        return between(lambda _, y: law.rates(y), leg.visited, times, self._tolerance, law.corrected)

    def change(self, leg: Stretch[ContactMode]) -> Transition[ContactMode]:
        """See the protocol."""
        guards = guards_of(self.contacts, leg.mode)
        if leg.guard is None or leg.guard >= len(guards):  # a break, or the limit of an effort
            return Transition(leg.last, leg.mode, ())
        k, kind = guards[leg.guard]
        mode, name = list(leg.mode), self.contacts[k].name
        if kind == "tear":
            raise self._torn(leg)
        if kind == "lift":
            mode[k] = OPEN
            return Transition(leg.last, tuple(mode), (("lift_off", name),))
        if kind == "break":
            refuse_turning_onset(self.contacts[k], mode[k])
            mode[k] = self._leaving(leg.last, leg.mode, k)
            return Transition(leg.last, tuple(mode), (("slip", name),))
        return self._stopped(leg) if kind == "still" else self._impact(leg, k)

    def _stopped(self, leg: Stretch[ContactMode]) -> Transition[ContactMode]:
        """Transition where a slip comes to rest: alone, or with all others; what slides while it turns ends at once."""
        closed, found = [own.kind != "open" for own in leg.mode], self._solved(leg.last, leg.mode)
        slides = [k for k, own in enumerate(leg.mode) if own.kind == "slip"]
        slips = np.linalg.norm([across(found.touching[k]) for k in slides], axis=1)
        if slips.max() <= FAINT:
            ended = self._after(leg, leg.last, closed, (), stopped=FAINT)
            if ended.mode is not None and self._stands(ended.state, ended.mode):
                return replace(ended, blur=float((slips / np.linalg.norm(found.slide_rate[slides], axis=1)).max()))
        return self._after(leg, leg.last, closed, ())

    def _after(
        self,
        leg: Stretch[ContactMode],
        state: Array,
        closed: Sequence[bool],
        happened: tuple[tuple[str, str], ...],
        margin: float = np.inf,
        delay: float = 0.0,
        stopped: float = STOPPED,
    ) -> Transition[ContactMode]:
        """The mode that follows from the forces; what slips no faster than ``stopped`` is taken to stand."""
        slips = [float(np.linalg.norm(across(each))) for each in self._touching(state)]
        still = [shut and slip <= stopped for shut, slip in zip(closed, slips, strict=True)]
        state = self._given.eliminated(state, held(closed, still))
        mode, sure = self._decided(state, closed, still)
        changed = changes(self.contacts, leg.mode, mode, self._stands(state, mode))
        struck = {name for _, name in happened}
        said = (*happened, *(item for item in changed if item[1] not in struck))
        return Transition(state, mode, said, np.inf if delay else min(margin, sure), delay)

    def _stands(self, state: Array, mode: ContactMode) -> bool:
        """True if nothing moves, and nothing will."""
        if self._timed or any(own.kind == "slip" for own in mode):
            return False
        found = self._solved(state, mode)
        return float(np.abs(found.velocity).max()) <= AT_REST and float(np.abs(found.acceleration).max()) <= STANDS


def _headed(own: Acting, found: Touching) -> Acting:
    """A slip that may be faint with its direction now."""
    slip = across(found)
    if own.kind != "slip" or own.along is not None or not slip.any():
        return own
    x, y, z = (slip / np.linalg.norm(slip)).tolist()
    return own._replace(heading=(x, y, z))


def held(closed: Sequence[bool], still: Sequence[bool]) -> ContactMode:
    """Modes of closed contacts: stick for those that stand, slip for the others."""
    return tuple(
        Acting("stick" if stands else "slip" if shut else "open") for shut, stands in zip(closed, still, strict=True)
    )
