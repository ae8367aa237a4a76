"""Conditioning of a sequence of events: its change with slightly changed parameters.

Which events come, and in which order, may hang on less than round-off: a crest of the needed friction that just reaches
the friction there is, a slip that all but stops. The arithmetic decides there, not the question. So the same
motion is followed with its parameters moved down and up by a part :data:`MOVE`, far above round-off: the question is
well posed where the same events come, and where they and the motion between them move evenly.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray

# Part by which parameters are moved. Round-off is 1e-6 of it, and a route that stops refining a slip too early is wrong
# within 1e-10 of an edge.
MOVE = 1e-9
# Part of the scale of the motion by which the moves down and up may differ. What is smooth differs by the square of a
# move; beyond an edge another slip, landing or impact comes.
_UNEVEN = 1e-4
# The same of the times of events, in parts of the pace: far less than between one crest of the needed friction and the
# next, far more than the error of the end of a slip that is all but none. So near its end a run may lack an event.
_SAME = 1e-2
# Where between two events the motion is looked at: no simple part of the way, at which a bounce too low to be told is.
_BETWEEN = 0.381966

Events = Sequence[tuple[str, float]]


@dataclass(frozen=True)
class Story:
    """Sequence of events: kind and time [s] of each, and states at times, each relative to its scale, shape (n, k)."""

    events: Events
    states: Callable[[FloatArray], FloatArray]


def in_common(first: Events, second: Events, pace: float, until: float) -> tuple[int, bool]:
    """Number of leading events that two routes agree about, and whether these are all until ``until`` [s].

    ``pace`` is the time [s] in which the motion goes on by its own scale.
    """
    return _shared([first, second], pace, until, lambda times: abs(times[0] - times[1]) <= _SAME * pace)


def unmoved(own: Story, moved: Sequence[Story], pace: float, until: float) -> tuple[int, bool]:
    """Number of leading events that stay as they are when parameters move down and up, and whether all is well posed.

    The motion is looked at between events: friction that an impact just uses up makes no event of its own.
    """
    stories = [own, *moved]
    number, alike = _shared(
        [story.events for story in stories], pace, until, lambda times: _uneven(*times) <= _SAME * pace
    )
    knots = np.array([0.0, *(time for _, time in own.events[:number]), *([until] if alike else [])])
    between = knots[:-1] + _BETWEEN * np.diff(knots)
    off = np.max(_uneven(*(story.states(between) for story in stories)), axis=-1) > _UNEVEN
    off &= np.diff(knots) > 0  # two events at once have nothing between them, and an impact may be one
    return (int(np.argmax(off)), False) if np.any(off) else (number, alike)


def _uneven(own: Any, less: Any, more: Any) -> Any:
    """Difference of what a move down and a move up do."""
    return np.abs(less + more - 2 * own)


def _shared(
    lists: Sequence[Events], pace: float, until: float, close: Callable[[Sequence[float]], bool]
) -> tuple[int, bool]:
    shortest = min(len(events) for events in lists)
    late = all(until - time < _SAME * pace for events in lists for _, time in events[shortest:])
    longest = shortest if late else max(len(events) for events in lists)
    for number, same in enumerate(zip(*lists, strict=False)):
        if len({kind for kind, _ in same}) > 1 or not close([time for _, time in same]):
            return number, False
    return shortest, shortest == longest
