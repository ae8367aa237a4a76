"""Conditioning of a sequence of events: its change when parameters change slightly.

Round-off may decide which events occur, and in which order: a peak of the needed friction just reaches the available
friction, or a slip almost stops. So the same motion is computed again with its parameters decreased and increased by
the relative amount :data:`MOVE`, far above round-off. The problem is well-posed if the same events occur, and their
times and the states between them change linearly with the parameters.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray

# Relative change of the parameters. Round-off is 1e-6 of it, and a route that stops refining a slip too early is wrong
# only within 1e-10 of an edge.
MOVE = 1e-9
# Largest second difference of the states, relative to their scale. For a smooth motion it is of the order of MOVE
# squared; beyond an edge another slip, landing or impact occurs.
_UNEVEN = 1e-4
# Largest second difference of event times, relative to the pace: far below the time between two peaks of the needed
# friction, far above the error of the end of a very short slip. A run may lack events that close to its end.
_SAME = 1e-2
# Fraction of the interval between two events at which states are compared: no simple fraction, where a bounce too low
# to be an event might end.
_BETWEEN = 0.381966

Events = Sequence[tuple[str, float]]


@dataclass(frozen=True)
class Story:
    """Sequence of events: kind and time [s] of each.

    ``states`` gives the states at times [s], relative to their scale, shape (n, k).
    """

    events: Events
    states: Callable[[FloatArray], FloatArray]


def in_common(events: Events, second_events: Events, pace: float, until: float) -> tuple[int, bool]:
    """Number of leading events that two routes share, and True if there are no others until ``until`` [s].

    ``pace`` is the time [s] in which the motion changes by its own scale.
    """
    return _shared([events, second_events], pace, until, lambda times: abs(times[0] - times[1]) <= _SAME * pace)


def well_posed_events(followed: Story, moved: Sequence[Story], pace: float, until: float) -> tuple[int, bool]:
    """Number of leading events that small changes of the parameters keep, and True if the whole motion is well-posed.

    ``moved`` holds the stories with decreased and with increased parameters. States between events are compared too:
    friction that an impact just uses up makes no event of its own.
    """
    stories = [followed, *moved]
    number, alike = _shared(
        [story.events for story in stories], pace, until, lambda times: _uneven(*times) <= _SAME * pace
    )
    knots = np.array([0.0, *(time for _, time in followed.events[:number]), *([until] if alike else [])])
    between = knots[:-1] + _BETWEEN * np.diff(knots)
    off = np.max(_uneven(*(story.states(between) for story in stories)), axis=-1) > _UNEVEN
    off &= np.diff(knots) > 0  # simultaneous events have nothing between them, and one of them may be an impact
    return (int(np.argmax(off)), False) if np.any(off) else (number, alike)


def _uneven(value: Any, less: Any, more: Any) -> Any:
    """Second difference: deviation of a response to a decrease and an increase from a linear one."""
    return np.abs(less + more - 2 * value)


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
