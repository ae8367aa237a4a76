"""Events of contacts, found between the samples of a run from its forces, gaps and slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray
from proofroll.core.element_abilities import SeenInRun
from proofroll.core.events import Event
from proofroll.elements.mechanism.contacts.observables import (
    PRESSES,
    Followed,
    follow_contacts,
    given_forces,
    normal_forces,
)
from proofroll.elements.mechanism.dataset import placed_from

if TYPE_CHECKING:
    from proofroll.elements.mechanism.element import MechanismElement
    from proofroll.elements.mechanism.sampling import MechanismSample

_States = NDArray[np.bool_]
# Slip speed of a contact that counts as sticking, relative to the mechanism's speed: softened contacts creep.
_CREEPS = 1e-3
# Gap at the start that counts as closed, relative to the mechanism's size.
_CLOSED = 1e-6
# Kinds of events that samples cannot distinguish from others: a resting contact may still begin to move, and a settling
# one may go on rebounding.
_ALIKE = {"rest": "stick", "settle": "impact"}


class ContactWatch:
    """Events of all contacts of a run. See :class:`proofroll.core.element_abilities.RunWatch`.

    A state that lasts for one sample only does not count: a contact that presses at a single sample between two open
    ones rebounds, and one that does not slip at a single sample changes its direction of slip. Two impacts between
    samples count as one.
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
        if any(sample.q_WB is None for sample in samples):
            return SeenInRun(count, None, None)
        pressed = given_forces(mechanism, samples)
        if count < 3 or np.isnan(pressed[1:]).any():
            return SeenInRun(count, None, None)
        placed = placed_from(self._element, times[:count], samples)
        turning = np.abs(placed.w_WB).max(axis=(1, 2)) * self._element.length
        speeds = np.maximum(np.abs(placed.v_WB).max(axis=(1, 2)), turning)
        seen = self._events(times[:count], follow_contacts(placed), pressed, speeds)
        return SeenInRun(count, self._reconciled(located or (), seen), None)

    def _reconciled(self, located: Sequence[Event], seen: Sequence[Event]) -> Sequence[Event]:
        """The engine's own events of contacts, unless its samples show one that is not among them."""
        names = {contact.name for contact in self._element.mechanism.contacts}
        own = [event for event in located if event.name in names]
        left = list(own)
        for event in seen:
            match = next((one for one in left if _alike(one, event)), None)
            if match is None:
                return seen
            left.remove(match)
        return own

    def _events(self, times: FloatArray, found: Followed, pressed: FloatArray, speeds: FloatArray) -> list[Event]:
        presses = normal_forces(found, pressed) > PRESSES * self._element.force
        # Several engines have forces only after a first step, and a slip from rest is slow at first
        presses[0] |= presses[1] & (found.gap[0] <= _CLOSED * self._element.length)
        presses = _without_lone(presses)
        slips = presses & (found.slip > _CREEPS * self._element.speed)
        slips[0] |= presses[0] & slips[1]
        slips = presses & _without_lone(slips)
        stands = (speeds <= _CREEPS * self._element.speed) & ~slips.any(axis=1)
        events = []
        for c, contact in enumerate(self._element.mechanism.contacts):
            u_n = np.sum(found.normal[:, c] * found.slide[:, c], axis=-1)
            for k in range(len(times) - 1):
                kind, at = _change(times, found, u_n, presses[:, c], slips[:, c], k, c)
                if kind == "stick" and stands[k + 1]:
                    kind = "rest"
                if kind:
                    low, high = float(times[k]), float(times[k + 1])
                    events.append(Event(kind, min(max(at, low), high), low, high, contact.name))
        return sorted(events, key=lambda event: event.time)


def _alike(one: Event, seen: Event) -> bool:
    """True if an event may be the one seen in the samples: same contact and kind, at most one interval off."""
    wide = seen.time_high - seen.time_low
    near = seen.time_low - wide <= one.time <= seen.time_high + wide
    return near and one.name == seen.name and _ALIKE.get(one.kind, one.kind) == _ALIKE.get(seen.kind, seen.kind)


def _without_lone(states: _States) -> _States:
    """States along time without runs of one sample, which take the value of their neighbours."""
    lone = (states[:-2] == states[2:]) & (states[1:-1] != states[2:])
    return np.concatenate([states[:1], np.where(lone, states[2:], states[1:-1]), states[-1:]])


def _change(
    times: FloatArray, found: Followed, u_n: FloatArray, presses: _States, slips: _States, k: int, c: int
) -> tuple[str, float]:
    """Kind and time [s] of the event of contact c between samples k and k + 1; the kind is empty without an event."""
    start, middle = float(times[k]), float(times[k] + times[k + 1]) / 2
    if not presses[k]:
        closing = float(u_n[k])
        if presses[k + 1] or closing < 0 < u_n[k + 1]:
            return "impact", start + float(found.gap[k, c]) / -closing if closing < 0 else middle
        return "", start
    if not presses[k + 1]:
        return "lift_off", middle
    if slips[k] and not slips[k + 1]:
        before = float(found.slip[k - 1, c]) if k and slips[k - 1] else np.inf
        slip, lost = float(found.slip[k, c]), before - float(found.slip[k, c])
        whole = start + slip / lost * float(times[k] - times[k - 1]) if 0 < lost < np.inf else middle
        return "stick", whole
    if slips[k + 1] and not slips[k]:
        return "slip", middle
    turned = slips[k] and float(found.slide[k, c] @ found.slide[k + 1, c]) < 0
    return ("turn", middle) if turned else ("", start)
