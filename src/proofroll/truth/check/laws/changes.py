"""Laws of events: each lies where the motion changes, and each change of the motion has its event."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from proofroll.truth.check.laws.record import Modes, PublishedEvent, PublishedValues
from proofroll.truth.check.laws.residuals import INSTANT, STRUCK, LawResiduals
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.tiled import changed_velocity
from proofroll.truth.check.laws.tiles import Tiles

_GROWTH = 1e3  # natural accelerations by which velocities may grow in the instant before a slip has a direction
_ROOM = 1e-11  # accuracy of the time of an event, relative to it and to a second
_LAST_REBOUNDS = 1e-4  # natural times that rebounds take which are summed, where their ratio is not known
_BEFORE_END = 1e-6  # part of the time before the end of a motion in which an event may be left out


def changes_of(scene: LawScene, tiles: Tiles, published: PublishedValues, residuals: LawResiduals, last: float) -> None:
    """Checks all events before a ``last`` time [s]."""
    borders = np.flatnonzero(tiles.stretch[1:] != tiles.stretch[:-1])
    ends, begins, jumps = tiles.time[borders, -1], tiles.time[borders + 1, 0], changed_velocity(scene, tiles)[borders]
    hits = list[PublishedEvent]()
    for number, end, begin, jump in zip(borders.tolist(), ends.tolist(), begins.tolist(), jumps.tolist(), strict=True):
        if end >= last * (1 - _BEFORE_END):
            continue
        room = _ROOM * (1 + begin)
        near = [
            item
            for item in published.changes
            if item.low - room - _summed(scene, published.changes, item) <= begin
            and end <= item.high + room + (INSTANT / scene.rate if item.jumps else 0.0)  # a rebound that is none
        ]
        time = np.array([[begin]])
        least = STRUCK + _GROWTH * scene.rate * max(begin - end, 0.0)
        if jump > least and not any(item.jumps for item in near):
            residuals.note("change", "a jump of velocities", np.ones((1, 1)), 1.0, time)
        names = _changed(scene, tiles.modes[number], tiles.modes[number + 1])
        if names and not any(_of(item.name, name) for item in near for name in names):
            residuals.note("change", min(names), np.ones((1, 1)), 1.0, time)
        hits += near if jump > least else []
    contacts = {contact.name for contact in scene.contacts if contact.alone}
    for item in published.changes:
        if item.of_effort or item.time >= last * (1 - _BEFORE_END):
            continue
        apart = np.maximum(
            np.maximum(ends - item.high, item.low - _summed(scene, published.changes, item) - begins), 0.0
        )
        apart = np.append(apart, abs(item.time) if item.time <= 0 else np.inf)
        off = min(float(apart.min()), 1 + item.time)
        residuals.note("change", item.name, np.array([[off]]), 1 + abs(item.time), np.array([[item.time]]))
        if item.strikes and item.name in contacts and item not in hits:
            residuals.note("change", item.name, np.ones((1, 1)), 1.0, np.array([[item.time]]))


def _summed(scene: LawScene, changes: Sequence[PublishedEvent], item: PublishedEvent) -> float:
    """Time before a settling, and what follows it at once, at which the motion may rest already [s].

    That is twice the time that rebounds take in their last ratio.
    """
    if not any(other.settles and abs(other.time - item.time) <= _ROOM * (1 + item.time) for other in changes):
        return 0.0
    hits = [other.time for other in changes if other.strikes and other.name == item.name and other.time < item.time]
    spans, least = np.diff(hits[-3:]), _LAST_REBOUNDS / scene.rate
    if len(spans) < 2 or not 0 < spans[1] < spans[0]:
        return least
    ratio = float(spans[1] / spans[0])
    return max(least, 2 * float(spans[1]) * ratio / (1 - ratio))


def _of(event: str, place: str) -> bool:
    """True if an event of a pair or joint is that of a place, which may be one of several."""
    return place == event or place.startswith(f"{event}.")


def _changed(scene: LawScene, sooner: Modes, later: Modes) -> set[str]:
    """Names of contacts and joints whose modes differ."""
    places = zip(scene.contacts, sooner.contacts, later.contacts, strict=True)
    names = {contact.name for contact, mode, next_mode in places if mode != next_mode}
    for number, joint in enumerate(scene.mechanism.joints):
        modes = [(item.friction[number], item.stops[number]) for item in (sooner, later)]
        names |= {joint.name} if modes[0] != modes[1] else set()
    return names
