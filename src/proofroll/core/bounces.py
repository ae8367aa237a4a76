"""Bounces: energy before and after each impact, and how high what bounced rises before its next impact."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import Columns, Variable
from proofroll.core.events import IMPACTS, JUMPS, Event, EventKind, events_of

if TYPE_CHECKING:
    import xarray as xr

# Samples between two impacts, or an impact and the end, of a motion that can be sampled at any time.
_BETWEEN = 3
# Parts of the time from an impact until its rebounds are over: one lies in the first of these.
_GRADED: FloatArray = 0.5 ** np.arange(3.0, 15.0)
# Distance of samples from the time of an event, relative to it: its round-off.
_BESIDE = 8 * float(np.finfo(float).eps)
# Most impacts whose energies and heights are found: a motion that comes to rest has hundreds, each lower.
_MOST = 100
# Most steps by which times of crests are improved, and change, relative to a time, by which they may end: each step has
# about a hundredth of the one before left, and a height has the square of it.
_IMPROVED, _STILL = 12, 1e-10
_COLUMNS = (
    ("event_energy_before", "energy_before", "J", "energy before an impact"),
    ("event_energy_after", "energy_after", "J", "energy after an impact"),
    ("event_height", "height", "m", "height of the next apex above the place at the impact"),
)


@dataclass(frozen=True)
class Bounce:
    """One impact and what follows it.

    Attributes:
        time: of the impact [s].
        name: of the part that struck; empty if there is only one.
        energy_before, energy_after: of everything that moves, beside the impact [J].
        height: height of the next apex of the centre of mass of what bounced, above its place at the impact [m]; NaN:
            it reaches none before its next impact or the end of the run, or there is no gravity.
        energy_bar, height_bar: error bars [J, m]; None: they are not known.
    """

    time: float
    name: str
    energy_before: float
    energy_after: float
    height: float
    energy_bar: float | None = None
    height_bar: float | None = None


class Course(NamedTuple):
    """Energy and heights along a motion.

    Attributes:
        time: rising [s], shape (time,).
        energy: kinetic and potential [J], shape (time,).
        height: of each centre of mass, against gravity [m], shape (time, bodies).
        climb: its rate [m/s], shape (time, bodies).
    """

    time: FloatArray
    energy: FloatArray
    height: FloatArray
    climb: FloatArray


def bounces_along(course: Course, events: Sequence[Event], bodies: Mapping[str, int]) -> list[Bounce]:
    """Bounces of a sampled motion, one for each impact in ``events``.

    Energies are those of the samples beside the bracket of an impact; between samples a height is a parabola.

    Args:
        course: of the motion.
        events: in order of time.
        bodies: name of an event -> index of the body that bounces; an event of another name has no height.
    """
    impacts = [event for event in events if event.kind in IMPACTS]
    bounces = []
    for event in impacts:
        ahead = np.flatnonzero((course.time <= event.time_low) & (course.time < event.time))
        behind = np.flatnonzero((course.time >= event.time_high) & (course.time > event.time))
        body, height = bodies.get(event.name), np.nan
        if body is not None and behind.size:
            later = (impact.time_low for impact in impacts if bodies.get(impact.name) == body)
            until = min((low for low in later if low > event.time_high), default=np.inf)
            height = _apex(course, body, event.time, behind[course.time[behind] <= until])[1]
        energy_before = float(course.energy[ahead[-1]]) if ahead.size else np.nan
        energy_after = float(course.energy[behind[0]]) if behind.size else np.nan
        bounces.append(
            Bounce(
                time=event.time, name=event.name, energy_before=energy_before, energy_after=energy_after, height=height
            )
        )
    return bounces


def _apex(course: Course, body: int, start: float, samples: np.ndarray[tuple[int], np.dtype[np.intp]]) -> FloatArray:
    """Time [s] of the first apex at these samples, and its height above the place at ``start`` [m]; NaN: none."""
    t, h, c = course.time[samples], course.height[samples, body], course.climb[samples, body]
    none = np.full(2, np.nan)
    if len(t) < 2:
        return none
    pulls = -np.diff(c) / np.diff(t)
    place = h[0] - c[0] * (t[0] - start) - pulls[0] * (t[0] - start) ** 2 / 2
    if c[0] <= 0:  # the apex lies before the first sample, or the body falls on
        rises = pulls[0] > 0 and c[0] + pulls[0] * (t[0] - start) > 0
        return np.array([t[0] + c[0] / pulls[0], h[0] + c[0] ** 2 / (2 * pulls[0]) - place]) if rises else none
    turned = np.flatnonzero((c[:-1] > 0) & (c[1:] <= 0))
    if not turned.size:
        return none
    k = int(turned[0])
    pull = pulls[k]
    k += abs(c[k + 1]) < abs(c[k])  # from the sample nearer to the apex
    return np.array([t[k] + c[k] / pull, h[k] + c[k] ** 2 / (2 * pull) - place])


def exact_bounces(
    sampled: Callable[[FloatArray], Course], events: Sequence[Event], bodies: Mapping[str, int], end: float
) -> list[Bounce]:
    """Bounces of a motion that can be sampled at any time up to ``end`` [s], of its first impacts, at most 100."""
    sharp = [replace(event, time_low=event.time, time_high=event.time) for event in events if event.kind in IMPACTS]
    many = len(sharp) > _MOST
    end, sharp = (sharp[_MOST].time, sharp[:_MOST]) if many else (end, sharp)
    hits = np.unique([event.time for event in sharp])
    if not hits.size:
        return []
    beside = [hits * (1 - _BESIDE), hits * (1 + _BESIDE)]
    stops = np.unique([*(event.time for event in events if event.kind in JUMPS and event.time <= end), end])
    # of rebounds that are summed the last is followed, and rests in a part of the time until all are over
    settled = np.array([event.time for event in events if event.kind == EventKind.SETTLE and event.time <= end])
    impacts = stops[np.searchsorted(stops, settled) - 1]
    rebounds = (impacts[:, None] + (settled - impacts)[:, None] * _GRADED).ravel()
    parts = np.arange(1, _BETWEEN + 1) / (_BETWEEN + 1)
    inside = (stops[:-1, None] + np.diff(stops)[:, None] * parts).ravel()
    times = np.unique(np.concatenate([*beside, inside, rebounds, [end]]))
    times = times[(times >= 0) & (times <= end)]
    course, last = sampled(times), np.zeros(0)
    for _ in range(_IMPROVED):
        crests = _crests(course, sharp, bodies)
        new = np.setdiff1d(crests[(crests > 0) & (crests < end)], course.time)
        if not new.size or (len(crests) == len(last) and np.allclose(crests, last, rtol=_STILL, atol=0.0)):
            break
        last = crests
        more = sampled(new)
        order = np.argsort(np.concatenate([course.time, more.time]), kind="stable")
        course = Course(*(np.concatenate(pair)[order] for pair in zip(course, more, strict=True)))
    return bounces_along(course, sharp, bodies)


def _crests(course: Course, events: Sequence[Event], bodies: Mapping[str, int]) -> FloatArray:
    """Times [s] of the apices after these events."""
    crests = []
    for event in events:
        body = bodies.get(event.name)
        until = min((o.time for o in events if o.time > event.time and bodies.get(o.name) == body), default=np.inf)
        samples = np.flatnonzero((course.time > event.time) & (course.time < until))
        if body is not None:
            crests.append(_apex(course, body, event.time, samples)[0])
    return np.unique([time for time in crests if np.isfinite(time)])


def with_bars(measured: Sequence[Bounce], two: Sequence[Bounce], safety: float, least: float) -> list[Bounce]:
    """Bounces of the first of two routes, with error bars from their difference.

    Args:
        measured: bounces by the first route.
        two: bounces by the second, for the same events.
        safety: factor of the difference.
        least: error that both may share, relative to the largest energy and height.
    """
    energies = [
        abs(value) for item in measured for value in (item.energy_before, item.energy_after) if np.isfinite(value)
    ]
    heights = [abs(item.height) for item in measured if np.isfinite(item.height)]
    floors = least * max(energies, default=0.0), least * max(heights, default=0.0)
    bounces = []
    for a, b in zip(measured, two, strict=True):
        off = max(abs(a.energy_before - b.energy_before), abs(a.energy_after - b.energy_after))
        height = a.height if np.isfinite(b.height) else np.nan  # only one route reaches an apex before the end
        energy_bar = safety * off + floors[0]
        height_bar = safety * abs(a.height - b.height) + floors[1] if np.isfinite(height) else None
        bounces.append(replace(a, height=height, energy_bar=energy_bar, height_bar=height_bar))
    return bounces


def with_bounces(dataset: xr.Dataset, bounces: Sequence[Bounce]) -> xr.Dataset:
    """Dataset with energies and heights of its impacts along ``event``, NaN for other events.

    Variables: ``event_energy_before``, ``event_energy_after`` [J], ``event_height`` [m].
    """
    events, left = events_of(dataset), list(bounces)
    rows = []
    for event in events:
        same = next((k for k, item in enumerate(left) if (item.time, item.name) == (event.time, event.name)), None)
        rows.append(None if same is None or event.kind not in IMPACTS else left.pop(same))
    if not any(rows):
        return dataset
    columns = {}
    for name, key, unit, meaning in _COLUMNS:
        values = np.array([np.nan if row is None else getattr(row, key) for row in rows])
        which = "energy_bar" if unit == "J" else "height_bar"
        bars = [bar for row in rows if row is not None and (bar := getattr(row, which)) is not None]
        attributes = {"units": unit, "long_name": meaning, "error_bar": max(bars, default=0.0)}
        columns[name] = Variable(("event",), values, attributes)
    return dataset.assign(columns)


def bounces_of(columns: xr.Dataset | Columns) -> list[Bounce] | None:
    """Bounces stored by :func:`with_bounces`; None: there are no such variables."""
    if _COLUMNS[0][0] not in columns:
        return None
    variables = columns.variables
    values = [variables[name].values.tolist() for name, *_ in _COLUMNS]
    energy_bar, height_bar = (float(variables[name].attrs["error_bar"]) for name in (_COLUMNS[1][0], _COLUMNS[2][0]))
    return [
        Bounce(
            time=event.time,
            name=event.name,
            energy_before=e_in,
            energy_after=e_out,
            height=height,
            energy_bar=energy_bar,
            height_bar=height_bar if np.isfinite(height) else None,
        )
        for event, (e_in, e_out, height) in zip(events_of(columns), zip(*values, strict=True), strict=True)
        if event.kind in IMPACTS
    ]
