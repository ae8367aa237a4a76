"""Events of contacts, found between the samples of a run from its forces, gaps and slip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray
from proofroll.core.bounces import Bounce, Course, bounces_along
from proofroll.core.columns import Columns
from proofroll.core.element_abilities import SeenInRun
from proofroll.core.events import IMPACTS, Event, EventKind, events_of, wrong_bracket
from proofroll.elements.mechanism.contact.coulomb import largest_friction
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.observables import (
    PRESSES,
    Followed,
    follow_contacts,
    given_forces,
    normal_forces,
)
from proofroll.elements.mechanism.run.contacts.step_events import StepEvent
from proofroll.elements.mechanism.run.dataset import placed_from
from proofroll.elements.mechanism.scene.model import Mechanism

if TYPE_CHECKING:
    from proofroll.elements.mechanism.run.element import MechanismElement
    from proofroll.elements.mechanism.run.sampling import MechanismSample


def bouncing_bodies(mechanism: Mechanism) -> dict[str, int]:
    """Name of a contact -> index of the body that bounces: that of the first geometry, unless it is the world's.

    Empty without gravity, which says what height is.
    """
    if not np.any(mechanism.gravity):
        return {}
    index = mechanism.body_index
    pairs = {contact.name: (index[contact.body_a], index[contact.body_b]) for contact in mechanism.contacts}
    return {name: a if a >= 0 else b for name, (a, b) in pairs.items()}


def course_of(placed: Placed) -> Course:
    """Energy along a motion, and heights of the centres of mass against gravity."""
    mechanism = placed.mechanism
    gravity = np.array(mechanism.gravity)
    up = -gravity / (np.linalg.norm(gravity) or 1.0)
    places = [placed.point(body.name, body.com) @ up for body in mechanism.bodies]
    rates = [placed.velocity(body.name, body.com) @ up for body in mechanism.bodies]
    return Course(placed.time, placed.energy(), np.stack(places, axis=1), np.stack(rates, axis=1))


def sampled_bounces(mechanism: Mechanism, columns: Columns) -> Sequence[Bounce]:
    """Energy and height of each impact in the samples of a run; empty where it does not give orientations."""
    events = events_of(columns)
    if "q_WB" not in columns or not any(event.kind in IMPACTS for event in events):
        return ()
    placed = Placed(mechanism, *(columns[name].values for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB")))
    return bounces_along(course_of(placed), events, bouncing_bodies(mechanism))


_States = NDArray[np.bool_]
# Slip speed of a contact that counts as sticking, relative to the mechanism's speed: softened contacts creep.
_CREEPS = 1e-3
# Parts of the bound of friction: what is at the cone, and what may be at a pyramid within it.
_ON_CONE, _ON_PYRAMID = 0.99, 0.7
# Rate of a gap that is none, relative to the mechanism's speed: round-off of a body that slides has a sign.
_ROUND_OFF = 1e-10
# Gap at the start that counts as closed, relative to the mechanism's size.
_CLOSED = 1e-6
# Room of a time in which a gap closes, relative: digits of its samples.
_ROUNDED = 1.01
# Cosine between the slips of two samples below which one line of slip has turned: the line may turn with its bodies.
_REVERSED = -0.9
_HOPS = (EventKind.IMPACT, EventKind.LIFT_OFF)  # within an engine's steps and in no sample, a contact hops
# Kinds of events that samples cannot distinguish from others: a resting contact may still begin to move, and a settling
# one may go on rebounding.
_ALIKE: Mapping[str, str] = {EventKind.REST: EventKind.STICK, EventKind.SETTLE: EventKind.IMPACT}


class Sighting(NamedTuple):
    """An event in the samples of a run.

    Attributes:
        event: the event, with a bracket of its own.
        since: time from which it may have been going on [s].
        low, high: times of the samples around it [s].
    """

    event: Event
    since: float
    low: float
    high: float


class ContactWatch:
    """Events of all contacts of a run. See :class:`proofroll.core.element_abilities.RunWatch`.

    A state that lasts for one sample only does not count: a contact that presses at a single sample between two open
    ones rebounds, and one that does not slip at a single sample changes its direction of slip. Two impacts between
    samples count as one. A contact whose gap stays closed has not lifted off, though another may bear its load, and one
    whose gap cannot close between two samples has no impact there, though its speed changes sign. A slip ends where its
    speed would reach zero as it fell before, to what the change of its fall leaves open; all else lies anywhere between
    two samples.
    """

    def __init__(self, element: MechanismElement) -> None:
        self._element = element

    def over(self, sample: MechanismSample) -> bool:  # noqa: ARG002 -- the protocol's
        """False: bodies may leave each other."""
        return False

    def conclude(
        self, times: FloatArray, samples: Sequence[MechanismSample], located: Sequence[Event] | None
    ) -> SeenInRun:
        """Events of the contacts; None for the events if forces of contact are not known at all times.

        Without contacts they are those of joints and efforts that the engine itself locates.
        """
        count, mechanism = len(samples), self._element.mechanism
        if not mechanism.contacts:
            return SeenInRun(count, located if mechanism.has_events else None, None)
        if located and wrong_bracket(located):  # whoever keeps the record says so
            return SeenInRun(count, located, None)
        if self._element.lacks(samples, ()):
            return SeenInRun(count, None, None)
        pressed = given_forces(mechanism, samples)
        if count < 3 or np.isnan(pressed[1:]).any():
            return SeenInRun(count, None, None)
        placed = placed_from(self._element, times[:count], samples)
        turning = np.abs(placed.w_WB).max(axis=(1, 2)) * self._element.length
        speeds = np.maximum(np.abs(placed.v_WB).max(axis=(1, 2)), turning)
        seen = self._events(times[:count], follow_contacts(placed), pressed, speeds, located)
        return SeenInRun(count, self._reconciled(located or (), seen), None)

    def bounces(self, columns: Columns) -> Sequence[Bounce]:
        """See :class:`proofroll.core.element_abilities.TellsBounces`."""
        return sampled_bounces(self._element.mechanism, columns)

    def _reconciled(self, located: Sequence[Event], seen: Sequence[Sighting]) -> Sequence[Event]:
        """Events that samples show, each as the engine locates it, and what it locates between them.

        Of a contact whose samples show an event that the engine does not tell, nothing else that it tells is believed.

        Args:
            located: the engine's own.
            seen: events in the samples.
        """
        place = {id(event): number for number, event in enumerate(located)}  # of events at one time
        ordered: list[tuple[float, int, Event]] = []
        for contact in self._element.mechanism.contacts:
            left = [event for event in located if event.name == contact.name]
            told = True
            for sighting in (item for item in seen if item.event.name == contact.name):
                event = next((candidate for candidate in left if _alike(candidate, sighting)), None)
                if event is None:
                    told = False
                    ordered.append((sighting.event.time, len(located), sighting.event))
                else:
                    left.remove(event)
                    ordered.append((event.time, place[id(event)], _as_seen(event, sighting)))
            for event in left if told else ():
                if not (isinstance(event, StepEvent) and event.kind in _HOPS):
                    ordered.append((event.time, place[id(event)], event))
        return [event for *_, event in sorted(ordered, key=lambda item: item[:2])]

    def _events(
        self,
        times: FloatArray,
        followed: Followed,
        pressed: FloatArray,
        speeds: FloatArray,
        located: Sequence[Event] | None,
    ) -> list[Sighting]:
        """Events in order."""
        presses = normal_forces(followed, pressed) > PRESSES * self._element.force
        # Several engines have forces only after a first step, and a slip from rest is slow at first
        presses[0] |= presses[1] & (followed.gap[0] <= _CLOSED * self._element.length)
        forces, presses = presses, _without_lone(presses)
        u_n = np.sum(followed.normal * followed.slide, axis=-1)
        u_n[np.abs(u_n) <= _ROUND_OFF * self._element.speed] = 0.0
        for c in range(presses.shape[1]):
            room, moves = _CLOSED * self._element.length, _CREEPS * self._element.speed
            presses[:, c] |= _stays_closed(presses[:, c], followed.gap[:, c], u_n[:, c], room, moves)
        slips = presses & self._slips(times, followed, pressed, located)
        slips[0] |= presses[0] & slips[1]
        slips = presses & _without_lone(slips)
        stands = (speeds <= _CREEPS * self._element.speed) & ~slips.any(axis=1)
        events: list[Sighting] = []
        for c, contact in enumerate(self._element.mechanism.contacts):
            states = forces[:, c], presses[:, c], slips[:, c]
            for k in range(len(times) - 1):
                kind, moment, doubt = _change(times, followed, u_n[:, c], states, k, c)
                if kind == EventKind.STICK and stands[k + 1]:
                    kind = EventKind.REST
                if kind:
                    low, high = float(times[k]), float(times[k + 1])
                    time = min(max(moment, low), high)
                    doubt += abs(time - moment)
                    bracket = max(time - doubt, low), min(time + doubt, high)
                    event = Event(kind, time, *bracket, contact.name)
                    slip = followed.slip[:, c]  # one that grazes first creeps
                    rises_from = next((j for j in range(k, 0, -1) if slip[j - 1] >= slip[j]), 0)
                    since = float(times[rises_from]) if kind == EventKind.SLIP else low
                    events.append(Sighting(event, since, low, high))
        return sorted(events, key=lambda sighting: sighting.event.time)

    def _slips(
        self, times: FloatArray, followed: Followed, pressed: FloatArray, located: Sequence[Event] | None
    ) -> _States:
        """True where a contact moves along its surfaces with friction at its bound, shape (time, contacts).

        Contacts that creep while they stick have less friction, and unbounded friction never slips. Whether friction
        below the cone is at its bound the engine's own events say, as that of a pyramid is.
        """
        contacts = self._element.mechanism.contacts
        friction = np.array([contact.friction for contact in contacts])
        normal, u_n = (np.sum(followed.normal * vectors, axis=-1) for vectors in (pressed, followed.slide))
        rubbing = pressed - followed.normal * normal[..., None]
        slip = followed.slide - followed.normal * u_n[..., None]
        moves = np.isfinite(friction) & (followed.slip > _CREEPS * self._element.speed)
        moves &= (np.sum(rubbing * slip, axis=-1) <= 0) | (friction == 0)  # without friction round-off has a sign
        size, bound = np.linalg.norm(rubbing, axis=-1), largest_friction(friction, normal)
        on_cone, near = moves & (size >= _ON_CONE * bound), moves & (size >= _ON_PYRAMID * bound)
        if located is None:
            return np.asarray(near)
        slips = on_cone.copy()
        for c, contact in enumerate(contacts):
            told = _told_slips(times, [event for event in located if event.name == contact.name])
            told_mask = np.isfinite(told)
            claims = np.where(told_mask, told > 0, near[:, c]) if told_mask.any() else np.any(on_cone[:, c])
            slips[:, c] |= moves[:, c] & claims
        return np.asarray(slips)


def _told_slips(times: FloatArray, located: Sequence[Event]) -> FloatArray:
    """1 where an engine tells that a contact slips, 0 where it sticks, NaN where neither; shape (time,)."""
    states = np.full(len(times), np.nan)
    slips = {str(EventKind.SLIP): 1.0, EventKind.TURN: 1.0, EventKind.STICK: 0.0, EventKind.REST: 0.0}
    if located and located[0].kind in slips:
        states[:] = float(located[0].kind != EventKind.SLIP)
    for event in located:
        states[times >= event.time] = slips.get(event.kind, np.nan)
    return states


def _alike(located: Event, sighting: Sighting) -> bool:
    """True if an event may be the one seen in the samples: same contact and kind, at most one interval off."""
    seen, wide = sighting.event, sighting.high - sighting.low
    near = sighting.since - wide <= located.time <= sighting.high + wide
    return (
        near
        and located.name == seen.name
        and _ALIKE.get(located.kind, located.kind) == _ALIKE.get(seen.kind, seen.kind)
    )


def _as_seen(located: Event, sighting: Sighting) -> Event:
    """The engine's event; whether what it holds also rests is seen in the samples where its steps do not tell."""
    if not isinstance(located, StepEvent):
        return located
    return replace(sighting.event, time=located.time, time_low=located.time_low, time_high=located.time_high)


def _without_lone(states: _States) -> _States:
    """States along time without runs of one sample, which take the value of their neighbours."""
    lone = (states[:-2] == states[2:]) & (states[1:-1] != states[2:])
    return np.concatenate([states[:1], np.where(lone, states[2:], states[1:-1]), states[-1:]])


def _stays_closed(presses: _States, gap: FloatArray, u_n: FloatArray, room: float, moves: float) -> _States:
    """Samples without force at which one contact is closed nevertheless, shape (time,).

    These are whole stretches without force in which the gap does not open, and at the end of the run is not opening.

    Args:
        presses: True where the contact has a force, shape (time,).
        gap: distance [m], shape (time,).
        u_n: rate of the gap [m/s], shape (time,).
        room: gap that counts as closed [m].
        moves: speed that does not count as rest [m/s].
    """
    closed = np.zeros_like(presses)
    edges = np.flatnonzero(np.diff(presses)) + 1
    for low, high in zip([0, *edges.tolist()], [*edges.tolist(), len(presses)], strict=True):
        opens = high == len(presses) and u_n[-1] > moves
        closed[low:high] = not presses[low] and bool(np.any(presses)) and not opens and gap[low:high].max() <= room
    return closed


def _strikes(times: FloatArray, gap: FloatArray, u_n: FloatArray, pressed: _States, k: int) -> bool:
    """True if an open contact touches between samples k and k + 1, where its gap begins to grow.

    It does if it presses at one of them. Otherwise its gap must be able to close within the interval and to open again
    to what it is afterwards. Nor does its speed change as it does in the intervals beside it, as that of a body which
    swings past without a touch.
    """
    if pressed[k] or pressed[k + 1]:
        return True
    h = float(times[k + 1] - times[k])
    beside = [j for j in (k - 1, k + 1) if 0 <= j < len(times) - 1]
    rates = [float((u_n[j + 1] - u_n[j]) / (times[j + 1] - times[j])) for j in beside]
    falls = max([-rate for rate in rates if rate < 0], default=0.0)
    there, back = (
        _fall_time(max(float(g), 0.0), abs(float(u)), falls) for g, u in ((gap[k], u_n[k]), (gap[k + 1], u_n[k + 1]))
    )
    smooth = len(rates) == 2 and min(rates) > 0 and float(u_n[k + 1] - u_n[k]) <= sum(rates) * h
    return there <= _ROUNDED * h and there + back <= 2 * h and not smooth


def _fall_time(gap: float, speed: float, acceleration: float) -> float:
    """Time [s] in which a gap [m] closes at a speed [m/s] that grows [m/s²]."""
    return 2 * gap / (speed + float(np.sqrt(speed**2 + 2 * acceleration * gap))) if gap else 0.0


def _change(
    times: FloatArray, followed: Followed, u_n: FloatArray, states: tuple[_States, _States, _States], k: int, c: int
) -> tuple[str, float, float]:
    """Kind, time and doubt of it [s] of contact c between samples k and k + 1; the kind is empty without an event.

    Args:
        times: of the samples [s].
        followed: the contacts along the motion.
        u_n: rate of its gap [m/s], shape (time,).
        states: truth values (pressed, touching, slipping) at each sample, each of shape (time,).
        k: number of the sample before.
        c: number of the contact.
    """
    pressed, presses, slips = states
    start, middle = float(times[k]), float(times[k] + times[k + 1]) / 2
    if not presses[k]:
        closing = float(u_n[k])
        if presses[k + 1] or (closing < 0 < u_n[k + 1] and _strikes(times, followed.gap[:, c], u_n, pressed, k)):
            return EventKind.IMPACT, start + float(followed.gap[k, c]) / -closing if closing < 0 else middle, np.inf
        return "", start, np.inf
    if not presses[k + 1]:
        return EventKind.LIFT_OFF, middle, np.inf
    if slips[k] and not slips[k + 1]:
        return EventKind.STICK, *_end_of_slip(times, followed.slip[:, c], slips, k)
    if slips[k + 1] and not slips[k]:
        return EventKind.SLIP, middle, np.inf
    product = float(followed.slide[k, c] @ followed.slide[k + 1, c])
    turned = slips[k] and product < _REVERSED * float(followed.slip[k, c] * followed.slip[k + 1, c])
    return (EventKind.TURN, middle, np.inf) if turned else ("", start, np.inf)


def _end_of_slip(times: FloatArray, slip: FloatArray, slips: _States, k: int) -> tuple[float, float]:
    """Time after sample k at which a slip ends, and doubt of it [s].

    Its speed falls on as between samples k - 1 and k. What the change of this fall since sample k - 2 makes of it is
    the doubt. The time is the middle of the interval, in infinite doubt, if the speed does not fall.
    """
    unknown = float(times[k] + times[k + 1]) / 2, np.inf
    if not k or not slips[k - 1] or slip[k - 1] <= slip[k]:
        return unknown
    t1, t2 = times[k - 1 : k + 1].tolist()
    rate = float(slip[k - 1] - slip[k]) / (t2 - t1)
    end = t2 + float(slip[k]) / rate
    if k == 1 or not slips[k - 2]:
        return end, np.inf
    t0 = float(times[k - 2])
    bend = (float(slip[k - 2] - slip[k - 1]) / (t1 - t0) - rate) / (t2 - t0)
    return end, abs(bend) * (end - t2) * (end - t1) / rate
