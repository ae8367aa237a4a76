"""Events of a run, each with a bracket in time; closed lists of texts, as their kinds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.columns import Columns, Variable

if TYPE_CHECKING:
    import xarray as xr


class Kind(StrEnum):
    """A text of a closed list; it equals the plain text, and programs, JSON and messages show it as that."""

    def __repr__(self) -> str:
        return repr(self.value)


# Name of an observable for kinds of elements with events: how many events differ in kind from the truth's, are missing
# or are too many.
EVENT_ORDER = "event_order"


class EventKind(Kind):
    """Kinds of events of our own elements; other packages may add their own."""

    SLIP = "slip"  # a contact or a joint begins to slip
    STICK = "stick"  # friction holds it again
    REST = "rest"  # it is held, and nothing of the mechanism moves any more
    TURN = "turn"  # its slip reverses
    LIFT_OFF = "lift_off"  # the normal force reaches zero
    IMPACT = "impact"  # a gap closes, or a joint strikes a stop
    BOUNCE = "bounce"  # a ball strikes a wall
    SETTLE = "settle"  # the last of infinitely many impacts
    SATURATE = "saturate"  # an effort reaches its limit
    RELEASE = "release"  # it leaves its limit


# After the last of infinitely many impacts nothing bounces.
IMPACTS = frozenset({EventKind.IMPACT, EventKind.BOUNCE})
# Velocities jump at these.
JUMPS = IMPACTS | {EventKind.SETTLE}
# Room of a time beside its bracket, relative to it: round-off.
_ROUNDED = 1e-9


@dataclass(frozen=True)
class Event:
    """One change of what acts in a run: a contact, friction, a stop.

    Attributes:
        kind: as its kind of element names it, e.g. ``slip``.
        time: best estimate [s].
        time_low, time_high: bracket of the event [s].
        name: of the part of the element that it happens to; empty if there is only one.
    """

    kind: str
    time: float
    time_low: float
    time_high: float
    name: str = ""


def wrong_bracket(events: Sequence[Event]) -> str:
    """Sentence on the first event whose bracket is not finite or does not contain its time; empty: there is none."""
    for event in events:
        room = _ROUNDED * abs(event.time)
        inside = event.time_low - room <= event.time <= event.time_high + room
        if not (inside and -np.inf < event.time_low <= event.time_high < np.inf):
            return (
                f"the event {' '.join(filter(None, (event.kind, event.name)))} at {event.time:g} s has the bracket "
                f"{event.time_low:g} to {event.time_high:g} s; both are finite, time_low comes before time_high, "
                "and the time lies between them"
            )
    return ""


def event_columns(events: Sequence[Event]) -> dict[str, Variable]:
    """Variables ``event_kind``, ``event_name``, ``event_time``, ``event_low``, ``event_high`` [s] along ``event``."""
    columns = {
        "event_time": ("when it happened", [event.time for event in events]),
        "event_low": ("not before", [event.time_low for event in events]),
        "event_high": ("not after", [event.time_high for event in events]),
    }
    texts = {
        "event_kind": ("what happened", [event.kind for event in events]),
        "event_name": ("to what", [event.name for event in events]),
    }
    return {
        name: Variable(
            ("event",), np.array(values, dtype=str if values else "<U1"), {"units": "1", "long_name": meaning}
        )
        for name, (meaning, values) in texts.items()
    } | {
        name: Variable(("event",), np.array(values, dtype=np.float64), {"units": "s", "long_name": meaning})
        for name, (meaning, values) in columns.items()
    }


def with_events(dataset: xr.Dataset, events: Sequence[Event]) -> xr.Dataset:
    """The dataset with variables for these events in place of any others, see :func:`event_columns`."""
    return dataset.drop_dims("event", errors="ignore").assign(event_columns(events))


def events_of(dataset: xr.Dataset | Columns) -> list[Event]:
    """Events stored by :func:`with_events`; none if there are no such variables."""
    if "event_kind" not in dataset:
        return []
    variables = dataset.variables  # indexing the dataset makes a new array of each item, which is slow
    columns = [variables[f"event_{name}"].values.tolist() for name in ("kind", "time", "low", "high")]
    named = "event_name" in dataset  # files of earlier runs have none
    names = variables["event_name"].values.tolist() if named else [""] * len(columns[0])
    return [Event(*row) for row in zip(*columns, names, strict=True)]
