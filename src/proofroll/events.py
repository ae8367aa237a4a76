"""What happens to a ball on a wall: it begins to slip, sticks again, leaves the wall. Each with a bracket in time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

EventKind = Literal["slip", "stick", "lift_off"]

# How long a wall must not press before that is a flight [s]: soft and corrected contacts let a ball hop for less.
_FLIGHT = 0.01


@dataclass(frozen=True)
class Event:
    """One change of the contact.

    Attributes:
        kind: ``slip`` begins, the ball ``stick``s again, or ``lift_off`` (the normal force reached zero).
        time: best value [s].
        time_low, time_high: the event lies between these [s].
    """

    kind: EventKind
    time: float
    time_low: float
    time_high: float


def with_events(dataset: xr.Dataset, events: Sequence[Event]) -> xr.Dataset:
    """The dataset with ``event_kind`` and ``event_time``, ``event_low``, ``event_high`` [s] along ``event``."""
    columns = {
        "event_time": ("when it happened", [event.time for event in events]),
        "event_low": ("not before", [event.time_low for event in events]),
        "event_high": ("not after", [event.time_high for event in events]),
    }
    kinds = np.array([event.kind for event in events], dtype=f"<U{max(map(len, get_args(EventKind)))}")
    result = dataset.assign(event_kind=("event", kinds, {"units": "1", "long_name": "what happened"}))
    return result.assign(
        {
            name: ("event", np.array(values, dtype=np.float64), {"units": "s", "long_name": meaning})
            for name, (meaning, values) in columns.items()
        }
    )


def between_samples(times: Sequence[float], sticking: Sequence[bool]) -> list[Event]:
    """Events as the samples tell them: somewhere between two samples [s] of which one sticks and the other slips."""
    return [
        Event("stick" if after else "slip", 0.5 * (low + high), low, high)
        for before, after, low, high in zip(sticking, sticking[1:], times, times[1:], strict=False)
        if before != after
    ]


def lift_off(times: Sequence[float], N: Sequence[float], faint: float) -> Event | None:
    """When the ball leaves the wall as samples tell it, between two of them; None: it does not.

    It has left where the wall would have to pull, or where for a hundredth of a second it does not press.

    Args:
        times: of the samples [s].
        N: normal force there [N]; that at time 0, which several engines do not know, does not count.
        faint: normal force that is round-off [N].
    """
    pressed = 0
    for index in range(1, len(times)):
        if not N[index] <= faint:  # also where nobody knows
            pressed = index
        elif N[index] < -faint or times[index] - times[pressed + 1] >= _FLIGHT * (1 - 1e-9):
            low, high = times[pressed], times[pressed + 1]
            before, after = N[pressed], N[pressed + 1]
            part = before / (before - after) if after < 0 < before else 0.5
            return Event("lift_off", low + part * (high - low), low, high)
    return None


def left_at(dataset: xr.Dataset) -> float:
    """When the ball first leaves the wall [s]; inf: it does not."""
    return min((event.time for event in events_of(dataset) if event.kind == "lift_off"), default=math.inf)


def events_of(dataset: xr.Dataset) -> list[Event]:
    """The events that :func:`with_events` stored; none if there are no such variables."""
    if "event_kind" not in dataset:
        return []
    columns = (dataset[f"event_{name}"].to_numpy().tolist() for name in ("kind", "time", "low", "high"))
    return [Event(*row) for row in zip(*columns, strict=True)]
