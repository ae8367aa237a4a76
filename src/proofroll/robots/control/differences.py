"""Differences of the layers of a record of a robot under a controller from what the layers before them give."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from proofroll.elements.mechanism.scene.policy import Observation
from proofroll.robots.control.bookkeeping.law import VECTORS, ControlLaw, RobotState
from proofroll.robots.control.record import BASE, OBSERVED, ControlRecord
from proofroll.robots.model import Array

# Least residual that counts, in parts of the largest number of its column: round-off of a sum of some terms.
ROUND_OFF = 1e-9
SAME_TIME = 1e-6  # part of the time between instants that is round-off
_OFTEN = 3  # times as many rows at which targets change as actions do, at which they are no targets of instants
_NEAR = 0.1  # part of it by which an instant may be off and is the same


@dataclass(frozen=True)
class LayerDifferences:
    """Differences of a layer with its columns: ``difference`` (times, columns), in their units, and their sizes."""

    columns: tuple[str, ...]
    time: Array
    recorded: Array
    difference: Array
    sizes: Array


def _compared(columns: list[str], time: Array, recorded: Array, computed: Array) -> LayerDifferences:
    sizes = np.maximum(np.abs(recorded).max(axis=0, initial=0.0), np.abs(computed).max(axis=0, initial=0.0))
    sizes = np.maximum(sizes, 1e-3 * sizes.max(initial=0.0))
    return LayerDifferences(
        columns=tuple(columns),
        time=time,
        recorded=recorded,
        difference=recorded - computed,
        sizes=np.where(sizes > 0, sizes, 1.0),
    )


def _of_instants(record: ControlRecord) -> list[str]:
    """Columns that change at instants; actions alone where targets change far more often, along ramps."""
    names = [name for name in record.columns if name.startswith(("action.", "target."))]
    actions = [name for name in names if name.startswith("action.")]
    often = _changes(record, names)
    return actions if 0 < _OFTEN * _changes(record, actions) < often else names if often else []


def _changes(record: ControlRecord, names: Sequence[str]) -> int:
    """Number of rows at which one of some columns changes; 0 without columns."""
    values = np.stack([record.columns[name] for name in names], axis=1) if names else np.zeros((1, 1))
    return int(np.any(np.diff(values, axis=0) != 0, axis=1).sum())


def instant_rows(record: ControlRecord, law: ControlLaw) -> Any:
    """Rows at which a record's action or target changes, and the first row if an instant can lie there."""
    return _instant_rows(record, law.rate)


@lru_cache(maxsize=16)
def _instant_rows(record: ControlRecord, rate: float) -> Any:
    names = _of_instants(record)
    if not names:
        near = np.abs(record.time * rate - np.round(record.time * rate)) < SAME_TIME
        return np.flatnonzero(near)
    values = np.stack([record.columns[name] for name in names], axis=1)
    changes = np.any(np.abs(np.diff(values, axis=0)) > 0, axis=1)
    later = 1 + np.flatnonzero(changes)
    if record.time[0] != 0 and len(later):  # a record may begin between two instants
        periods = (record.time[later[0]] - record.time[0]) * rate
        if abs(periods - np.round(periods)) > SAME_TIME:
            return later
    return np.concatenate([[0], later])


def passed_instants(record: ControlRecord, law: ControlLaw) -> str:
    """Reason why a record does not show what is at instants: its rows pass between them; empty: they do not.

    Each change is then at the first row after an instant.
    """
    numbers = record.time * law.rate
    passing = np.diff(np.floor(numbers + SAME_TIME)) > 0
    at_rows = np.abs(numbers - np.round(numbers)) < SAME_TIME
    rows = instant_rows(record, law)
    if at_rows[1:][passing].all() or not passing[rows[rows > 0] - 1].all():
        return ""
    every = float(np.diff(record.time).mean())
    return f"rows every {every:.4g} s pass the controller's instants, every {1 / law.rate:.4g} s: log a row at each"


def due_rows(record: ControlRecord, law: ControlLaw) -> Any:
    """Rows at instants of a law at which the action, or the target, should change but for rounding."""
    begin = record.time[instant_rows(record, law)[0]]  # a clock may begin at any time
    periods = (record.time - begin) * law.rate
    rows: Any = np.flatnonzero(np.abs(periods - np.round(periods)) < SAME_TIME)
    rows = rows[rows > 0]
    if not len(rows) or law.extra_steps:
        return rows[:0]
    part = record.part(rows)
    for kind, computed in (("action", _actions), ("target", targets_of)):
        recorded = record.stacked(kind, law.joints)
        values = None if recorded is None or (kind == "action" and law.policy is None) else computed(part, law)
        if recorded is not None and values is not None and not isinstance(values, str):
            previous, rounding = recorded[rows - 1], 4 * record.rounding_of(kind, law.joints)[rows]
            values = np.clip(values, recorded.min(axis=0), recorded.max(axis=0))  # what is clipped does not change
            return rows[np.any(np.abs(values - previous) > rounding + ROUND_OFF, axis=1)]
    return rows[:0]


def _instants(record: ControlRecord, law: ControlLaw) -> LayerDifferences | str:
    if not _of_instants(record):
        return "the record has no columns action.JOINT or target.JOINT, which change at instants"
    time = record.time[instant_rows(record, law)]
    if len(time) < 2:
        return "nothing in the record changes at instants"
    step = law.extra_steps * float(np.diff(record.time).min())
    period = 1 / law.rate + step
    expected = time[0] + period * np.round((time - time[0]) / period)
    rounding = 2 * max(SAME_TIME * period, float(np.abs(np.diff(record.time) - np.diff(record.time).mean()).max()))
    sizes = np.full(1, min(rounding, 0.1 * float(np.diff(record.time).min())) / ROUND_OFF)
    due = record.time[due_rows(record, law)]
    due = due[due <= time[-1] + (1 + SAME_TIME) * period]  # what comes later may hold on purpose
    lacking = np.array([np.abs(time - instant).min() for instant in due])
    instants = np.concatenate([time[1:], due])
    apart = np.concatenate([(time - expected)[1:], lacking])[:, None]
    return LayerDifferences(columns=("time",), time=instants, recorded=instants[:, None], difference=apart, sizes=sizes)


def at_instants(record: ControlRecord, law: ControlLaw) -> ControlRecord:
    """Rows of a record at instants, with the state that the policy sees there."""
    return _at_instants(record, law.rate, law.observed_lag)


@lru_cache(maxsize=16)
def _at_instants(record: ControlRecord, rate: float, lag: int) -> ControlRecord:
    rows = _instant_rows(record, rate)
    part = record.part(rows)
    if not lag:
        return part
    states = record.part(np.maximum(rows - lag, 0))
    kinds = ("q.", "v.", *(f"{name}." for name in BASE))
    columns = {name: (states if name.startswith(kinds) else part).columns[name] for name in part.columns}
    return ControlRecord(record.path, columns, part.rounding, part.time)


def held_rows(record: ControlRecord, law: ControlLaw) -> Any:
    """True at rows at which no action or target changes."""
    mask = np.ones(len(record.time), bool)
    if _of_instants(record) or law.policy is not None:
        mask[instant_rows(record, law)[1:]] = False
    return mask


def states(record: ControlRecord, law: ControlLaw) -> RobotState | str:
    """States at all rows of a record, or the reason why it has none; without columns of the base it is fixed."""
    q, v = record.stacked("q", law.joints), record.stacked("v", law.joints)
    if q is None or v is None:
        return f"the record has no columns {'q' if q is None else 'v'}.JOINT"
    fixed = vars(RobotState(time=0.0, q=q, v=v))
    parts = {name: record.stacked(name, tuple(axes)) for name, axes in BASE.items()}
    base = {name: np.tile(fixed[name], (len(q), 1)) if item is None else item for name, item in parts.items()}
    return RobotState(time=record.time, q=q, v=v, **base)


def _observed(record: ControlRecord, law: ControlLaw) -> tuple[dict[str, Array], list[str]]:
    """Recorded parts of observations, each (times, entries), and all of their columns."""
    parts = {name: record.stacked(f"{OBSERVED}.{name}", law.joints) for name in ("q", "v", "last")}
    parts |= {name: record.stacked(f"{OBSERVED}.{name}", tuple("xyz")) for name in VECTORS}
    recorded = {name: item for name, item in parts.items() if item is not None}
    labels = {name: law.joints if name in {"q", "v", "last"} else tuple("xyz") for name in recorded}
    return recorded, [f"{OBSERVED}.{name}.{label}" for name in recorded for label in labels[name]]


def _observation(record: ControlRecord, law: ControlLaw) -> LayerDifferences | str:
    record = at_instants(record, law)
    recorded, columns = _observed(record, law)
    actions = record.stacked("action", law.joints)
    if actions is None or record.time[0] != 0:
        recorded.pop("last", None)
        columns = [name for name in columns if not name.startswith(f"{OBSERVED}.last.")]
    if not recorded:
        return f"the record has no columns {OBSERVED}.…"
    instants = states(record, law)
    if isinstance(instants, str):
        return instants
    if not len(record.time):
        return "no row lies at an instant of the controller"
    seen = law.observed(instants, _before(actions, instants.q))
    computed = np.concatenate([getattr(seen, name) for name in recorded], axis=1)
    return _compared(columns, record.time, np.concatenate([*recorded.values()], axis=1), computed)


def _actions(record: ControlRecord, law: ControlLaw) -> Array | str:
    """Actions of the policy at the rows of a record of instants, from recorded observations where there are some."""
    answer = law.answer()
    assert answer is not None  # the caller knows that there is a policy
    observed = _observed(record, law)[0]
    instants = states(record, law)
    if isinstance(instants, str):
        return instants
    recorded = record.stacked("action", law.joints)
    seen = vars(law.observed(instants, _before(recorded, instants.q))) | observed
    actions: list[Array] = []
    place = dict(zip(law.exchanged, reversed(law.exchanged), strict=True)).get("last", "last")
    for row in range(len(record.time)):
        last = {place: law.factors[-1] * actions[-1]} if row and recorded is None and place not in observed else {}
        observation = Observation(**{name: item[row] for name, item in seen.items()} | last)
        actions.append(np.clip(answer(observation), -law.clip, law.clip))
    return np.array(actions)


def _before(actions: Array | None, places: Array) -> Array:
    """Actions of the instant before each one, zero at the first and where none is recorded, as many as places."""
    return np.zeros(places.shape) if actions is None else np.concatenate([np.zeros((1, places.shape[1])), actions[:-1]])


def _of_joints(
    kind: str, record: ControlRecord, law: ControlLaw, recorded: Array, computed: Array | str, counts: Any = True
) -> LayerDifferences | str:
    """Differences of ``kind.JOINT`` at the rows that count and are computed, or the reason why none is."""
    if isinstance(computed, str):
        return computed
    rows = counts & np.isfinite(computed).all(axis=1)
    return _compared([f"{kind}.{name}" for name in law.joints], record.time[rows], recorded[rows], computed[rows])


def _action(record: ControlRecord, law: ControlLaw) -> LayerDifferences | str:
    record = at_instants(record, law)
    recorded = record.stacked("action", law.joints)
    if law.policy is None or recorded is None:
        return "the controller has no policy" if law.policy is None else "the record has no columns action.JOINT"
    counts = np.ones(len(record.time), bool)
    counts[:1] = record.time[0] == 0 or f"{OBSERVED}.last.{law.joints[0]}" in record.columns
    return _of_joints("action", record, law, recorded, _actions(record, law), counts)


def targets_of(record: ControlRecord, law: ControlLaw) -> Array | str:
    """Targets at the rows of a record of instants, from recorded actions where there are some."""
    counts: list[Array | None] = [None] * len(record.time)
    if law.policy is not None:
        actions = record.stacked("action", law.joints)
        computed = _actions(record, law) if actions is None else actions
        if isinstance(computed, str):
            return computed
        smoothed = np.zeros(len(law.joints)) if record.time[0] == 0 else computed[0]
        for row, action in enumerate(computed):
            counts[row] = smoothed = law.smoothed(action, smoothed)
    times, source = record.time, sources(record, law)
    targets = [law.pose if row < 0 else law.target(counts[row], float(times[row])) for row in source.tolist()]
    return np.array(targets)


def sources(record: ControlRecord, law: ControlLaw) -> Any:
    """Instant of a record of instants whose action acts at each of them; -1: one before the record."""
    # An action that equals the one before has no row of its own; times of few digits are off by a part of a step.
    return np.searchsorted(record.time, record.time - (law.delay - _NEAR) / law.rate, side="right") - 1


def _target(record: ControlRecord, law: ControlLaw) -> LayerDifferences | str:
    record = at_instants(record, law)
    recorded = record.stacked("target", law.joints)
    if recorded is None:
        return "the record has no columns target.JOINT"
    late = record.time - record.time[0] > (law.delay - 0.5) / law.rate
    counts = np.ones(len(late), bool) if record.time[0] == 0 else late
    return _of_joints("target", record, law, recorded, targets_of(record, law), counts)


def efforts_of(record: ControlRecord, law: ControlLaw) -> Array | str:
    """Efforts at all rows, from recorded targets where there are some; NaN where the record does not reach back."""
    servos = servo_rows(record, law)
    if isinstance(servos, str):
        return servos
    target, q, v, known = servos
    efforts = law.effort(target, q, v)
    efforts[~known] = np.nan
    return efforts


def servo_rows(record: ControlRecord, law: ControlLaw) -> tuple[Array, Array, Array, Any] | str:
    """Targets, coordinates and rates that servos have at all rows; True at rows to which the record reaches back."""
    q, v = record.stacked("q", law.joints), record.stacked("v", law.joints)
    if q is None or v is None:
        return "the record has no columns q.JOINT and v.JOINT"
    target, rows, instants = record.stacked("target", law.joints), np.arange(len(q)), instant_rows(record, law)
    places = np.searchsorted(instants, rows, side="right") - 1
    if (target is None or law.hold_effort) and (reason := passed_instants(record, law)):
        return reason
    if target is None:
        if record.time[0] != 0 or (law.policy is None and not _of_instants(record) and not len(instants)):
            return "the record has no columns target.JOINT"
        computed = targets_of(at_instants(record, law), law)
        if isinstance(computed, str):
            return computed
        target = computed[places]
    seen = np.where(places < 0, -1, instants[places]) if law.hold_effort else rows
    seen = seen - law.lag
    return target, q[seen], v[seen], seen >= 0


def _effort(record: ControlRecord, law: ControlLaw) -> LayerDifferences | str:
    recorded = record.stacked("effort", law.joints)
    if recorded is None:
        return "the record has no columns effort.JOINT"
    return _of_joints("effort", record, law, recorded, efforts_of(record, law))


# Layer -> its differences, or the reason why there are none.
DIFFERENCES: Mapping[str, Callable[[ControlRecord, ControlLaw], LayerDifferences | str]] = {
    "instants": _instants,
    "observation": _observation,
    "action": _action,
    "target": _target,
    "effort": _effort,
}


def rows_are_steps(record: ControlRecord, law: ControlLaw) -> bool:
    """True if places move by the velocity after each row and not by that before, as in steps of semi-implicit Euler."""
    q, v = record.stacked("q", law.joints), record.stacked("v", law.joints)
    if q is None or v is None:
        return False
    h = np.diff(record.time)[:, None]
    rounding = 2 * record.rounding_of("q", law.joints)[1:] + h * record.rounding_of("v", law.joints)[1:]
    bars = rounding + ROUND_OFF * np.abs(q).max()
    moved = np.diff(q, axis=0)
    return bool(np.all(np.abs(moved - h * v[1:]) <= bars) and np.any(np.abs(moved - h * v[:-1]) > 2 * bars))
