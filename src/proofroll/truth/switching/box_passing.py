"""Borders between two boxes that a corner or a crossing of edges passes: contacts that end and begin there."""

from collections.abc import Callable, Sequence

import numpy as np

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism.contact.modes import REST, ContactMode, Features, closed_in, features_of
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.box_features import BoxSlot
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact

# Gap, relative to the mechanism's size, with which a contact is closed.
_TOUCHES = 1e-9


def passed_boxes(
    contacts: Sequence[BodyContact],
    mode: ContactMode,
    guard: tuple[int, int],
    touching: Callable[[Array, Features | None], Sequence[Touching]],
    states: tuple[Array, Array],
    size: float,
) -> tuple[list[bool], Features]:
    """True for each closed contact, and all features, after a border between two boxes.

    Args:
        contacts: of all bodies.
        mode: before.
        guard: number of the contact, and of its border.
        touching: contacts at a state, with given features or the nearest.
        states: at the border, and shortly after it.
        size: of the mechanism.

    Raises:
        NotUnique: other faces meet while the boxes touch, or a corner meets a side below an edge.
    """
    (k, border), (state, ahead) = guard, states
    closed_mask, features, time = closed_in(mode), list(features_of(mode)), float(state[-1])
    group = [number for number, contact in enumerate(contacts) if contact.pair == contacts[k].pair]
    nearest = touching(ahead, None)
    if isinstance(contacts[k].box_slot, BoxSlot):
        touching_beyond = touching(ahead, tuple(bits | (number in group) for number, bits in enumerate(features)))
        inside = {number for number in group if touching_beyond[number].borders[0].left_by > 0}
        if border and any(closed_mask[number] for number in inside):
            raise NotUnique(
                f"the boxes of {contacts[k].pair} have turned so far at t = {time:.6g} s that other faces meet than "
                "those that touch, and what their corners and edges do then is not followed; end before"
            )
        same = {number: (features[number] | 1) ^ (number in inside) for number in group}
    for number in group:
        of_boxes = isinstance(contacts[k].box_slot, BoxSlot) and not border
        features[number] = same[number] if of_boxes else nearest[number].feature
    touching_now = touching(state, tuple(features))
    for number in group:
        touch = touching_now[number]
        if touch.absent:
            closed_mask[number] = False
        elif not closed_mask[number]:
            slot = contacts[number].box_slot
            assert slot is not None  # as of all of the pair
            if not slot.strikes_sides and touch.gap < -_TOUCHES * size:
                raise NotUnique(
                    f"a corner of {contacts[k].pair} meets a side of the other box at t = {time:.6g} s, below its "
                    "edge, which is not followed; end before"
                )
            parting = abs(float(touch.normal @ touch.slide))
            closed_mask[number] = abs(touch.gap) <= _TOUCHES * size and parting <= REST
    return list(np.array(closed_mask, dtype=bool).tolist()), tuple(features)


def beside_border(
    contacts: Sequence[BodyContact],
    mode: ContactMode,
    k: int,
    touching: Callable[[Array, Features | None], Sequence[Touching]],
    ahead: Array,
) -> bool:
    """True if a contact ``k`` of two boxes is absent at a state a little ahead, with the same faces."""
    if isinstance(contacts[k].box_slot, BoxSlot):
        features = tuple(bits | (number == k) for number, bits in enumerate(features_of(mode)))
        return bool(touching(ahead, features)[k].borders[0].left_by <= 0)
    return touching(ahead, None)[k].absent
