"""Events of a run, each with a bracket in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.columns import Columns, Variable

if TYPE_CHECKING:
    import xarray as xr

# Name of an observable that any kind of element may declare whose runs have events: how many of these are of another
# kind than the truth's, missing or too many.
EVENT_ORDER = "event_order"


@dataclass(frozen=True)
class Event:
    """One change of what acts in a run.

    Attributes:
        kind: as its kind of element names it, e.g. ``slip``.
        time: best value [s].
        time_low, time_high: the event lies between these [s].
        name: of what it happens to, where an element has several; may be empty.
    """

    kind: str
    time: float
    time_low: float
    time_high: float
    name: str = ""


def event_columns(events: Sequence[Event]) -> dict[str, Variable]:
    """``event_kind`` and ``event_time``, ``event_low``, ``event_high`` [s] along ``event``."""
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
        name: Variable(("event",), _texts(values), {"units": "1", "long_name": meaning})
        for name, (meaning, values) in texts.items()
    } | {
        name: Variable(("event",), np.array(values, dtype=np.float64), {"units": "s", "long_name": meaning})
        for name, (meaning, values) in columns.items()
    }


def with_events(dataset: xr.Dataset, events: Sequence[Event]) -> xr.Dataset:
    """The dataset with the events, see :func:`event_columns`."""
    return dataset.assign(event_columns(events))


def events_of(dataset: xr.Dataset | Columns) -> list[Event]:
    """The events that :func:`with_events` stored; none if there are no such variables."""
    if "event_kind" not in dataset:
        return []
    said = dataset.variables  # xarray makes a new array of each item, which takes longer than all the rest
    columns = [said[f"event_{name}"].values.tolist() for name in ("kind", "time", "low", "high")]
    named = "event_name" in dataset  # files of earlier runs have none
    names = said["event_name"].values.tolist() if named else [""] * len(columns[0])
    return [Event(*row) for row in zip(*columns, names, strict=True)]


def _texts(values: Sequence[str]) -> np.ndarray[tuple[int], np.dtype[np.str_]]:
    return np.array(values, dtype=str) if values else np.zeros(0, dtype="<U1")
