"""Mistakes of a record's own columns: units, axes, points, orders and instants that are not those of their names."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.number_format import error, with_bar
from proofroll.robots.control.base_frames import BaseFrame
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import BASE, ControlRecord, Layer, LayerCause, in_world
from proofroll.robots.model import Array

_HELPS = 0.1  # part of what velocities contradict places by that a mistake may leave
_TELLS = 5e-3  # least part of the way by which velocities contradict places
_SAFETY = 10.0  # on the rounding of places
_DEGREE = np.pi / 180
_MILLI = 1e-3
_READINGS = 4  # of a record that are judged at most
_SCHEMES = (-1.0, 0.0, 1.0)  # places move by the velocity before a step, by the mean, by that after it
_OF_SCHEMES = 0.6  # intervals by which a method may move places before or after their rates
_FEWEST = 5  # rows of which a lag is told
_SURE = 5.0  # errors of a lag that it differs by
_NAMES = {"v": "v.JOINT"}

Changed = Callable[[ControlRecord], ControlRecord]


class ColumnMistake(NamedTuple):
    """A mistake of columns.

    Attributes:
        id: name of its kind.
        words: clause that names it.
        changed: record with the columns as their names say.
    """

    id: str
    words: str
    changed: Changed


class _Off(NamedTuple):
    """Distance between places and the integrals of their velocities, the way itself, and rounding [rad or m]."""

    off: float
    way: float
    rounding: float


_NONE = _Off(0.0, 0.0, 0.0)
_Measured = Callable[[ControlRecord], "_Contradiction | None"]


class StateReading(NamedTuple):
    """A record as its columns may have been meant.

    Attributes:
        record: with velocities that are the rates of its places.
        layer: the mistakes of the columns; None: there are none.
        frame: frame of the base in the program; None: the base's own.
        reported: the record with that frame.
    """

    record: ControlRecord
    layer: Layer | None
    frame: BaseFrame | None = None
    reported: ControlRecord | None = None


@dataclass(frozen=True)
class _Reading:
    """Mistakes of columns that were found so far, and the record without them; ``worst``: what contradicts most."""

    record: ControlRecord
    causes: tuple[LayerCause, ...] = ()
    worst: _Off = _NONE
    column: str = ""
    tried: int = 0

    def beside(self, record: ControlRecord, cause: LayerCause, off: _Off, column: str, tried: int) -> _Reading:
        """The reading with one mistake more, of those ``tried``, in a column that contradicts itself so much."""
        worst, column = max((self.worst, self.column), (off, column))
        causes, count = (*self.causes, cause), self.tried + tried
        return _Reading(record=record, causes=causes, worst=worst, column=column, tried=count)


def state_readings(record: ControlRecord, law: ControlLaw) -> list[StateReading]:
    """Records whose velocities are the rates of their places, with the layer that says what was wrong.

    There are several where mistakes explain a contradiction alike: rates of the other sign are coordinates of the
    other sign. A contradiction without a known cause is no layer: rows that are far apart contradict themselves, too.
    """
    readings = [_Reading(record)]
    for name, measured, known in (
        ("v", _of_joints, [*_of_joint_columns()]),
        ("w_WB", _of_spin, [*_of_spins()]),
        ("v_WB", _of_velocity, [*_of_velocities(law)]),
    ):
        readings = [item for reading in readings for item in _explained(reading, name, measured, known)][:_READINGS]
        readings = [_in_time(reading, name, measured) for reading in readings]
    return [StateReading(reading.record, _layer(reading)) for reading in readings]


def framed_readings(record: ControlRecord, law: ControlLaw, frames: Sequence[BaseFrame]) -> list[StateReading]:
    """Readings of a record whose program reports one of some frames for its base, or its own: that is no mistake."""
    readings = state_readings(record, law)
    for frame in frames:
        for reading in state_readings(frame.corrected(record), law):
            reported = record if reading.layer is None else frame.reported(reading.record)
            readings.append(reading._replace(frame=frame, reported=reported))
    return readings


def reading_in_degrees(record: ControlRecord) -> StateReading | None:
    """Record with joints in degrees and degrees per second, which no integral shows; None: no angle passes a turn."""
    places = _sizes(record, "q.")
    column = max(places, key=places.__getitem__, default="")
    if not column or places[column] <= 2 * np.pi:
        return None
    words = "q.JOINT and v.JOINT are in degrees: name them q.JOINT[deg] and v.JOINT[deg/s]"
    off = (1 - _DEGREE) * places[column]
    changed = _after(partial(_scaled, "q.", _DEGREE), partial(_scaled, "v.", _DEGREE))(record)
    return _silent(changed, "degrees", words, off, column)


def readings_by_frames(record: ControlRecord, frames: Sequence[BaseFrame]) -> Iterator[StateReading]:
    """Readings of a record that has one of some frames in place of the base's own; no integral shows that."""
    for frame in frames if "q_WB.w" in record.columns else ():
        off = float(np.linalg.norm(frame.place))
        reading = _silent(frame.corrected(record), "base_frame", frame.words, off, "p_WB")
        yield reading._replace(frame=frame, reported=record)


def readings_of_early_rates(record: ControlRecord) -> Iterator[StateReading]:
    """Readings of a record with velocities of after a step beside places of before it, which a scheme may imitate."""
    rates = {kind: _sizes(record, kind) for kind in ("v.", "v_WB.", "w_WB.")}
    kinds_of_record = tuple(kind for kind, sizes in rates.items() if sizes)
    several = [kinds_of_record] if len(kinds_of_record) > 1 else []
    for kinds in (*several, *((kind,) for kind in kinds_of_record)):
        told = ", ".join(_NAMES.get(kind[:-1], kind[:-1]) for kind in kinds)
        words = f"{told}: one row early, as velocities after a step beside places before it"
        size = max(max(rates[kind].values()) for kind in kinds)
        yield _silent(_moved(kinds, -1, record), "early", words, size, kinds[0][:-1])


def untold_lags(record: ControlRecord) -> Iterator[str]:
    """Names of the rates that may be a row late by the digits of a record."""
    for name, measured in (("v", _of_joints), ("w_WB", _of_spin), ("v_WB", _of_velocity)):
        if (compared := measured(record)) is not None:
            lag = compared.lag_fit()
            if lag.square and _SURE * lag.bar(compared.rounding / np.sqrt(3)) > 1 - _OF_SCHEMES:
                yield _NAMES.get(name, name)


def readings_of_late_efforts(record: ControlRecord) -> Iterator[StateReading]:
    """Reading of a record with efforts that are a row late, as where a program returns those of its last step."""
    if efforts := _sizes(record, "effort."):
        words = "the columns effort.JOINT are one row late: each row has those of the step before it"
        column = max(efforts, key=efforts.__getitem__)
        yield _silent(_moved("effort.", 1, record), "late_effort", words, efforts[column], column)


def _sizes(record: ControlRecord, kind: str) -> dict[str, float]:
    """Columns of a kind, each with its largest size."""
    return {name: float(np.abs(item).max()) for name, item in record.columns.items() if name.startswith(kind)}


def _silent(record: ControlRecord, name: str, words: str, off: float, column: str) -> StateReading:
    """Reading by a mistake that only the layers behind it show."""
    cause = LayerCause(name, f"{words} (the layers behind it tell so)", None, 0.0)
    return StateReading(record, Layer("state", off, 0.0, column, causes=(cause,)))


def _explained(reading: _Reading, name: str, measured: _Measured, mistakes: Sequence[ColumnMistake]) -> list[_Reading]:
    """The reading with each of the known mistakes that explain best what its velocities contradict."""
    compared = measured(reading.record)
    apart = None if compared is None else compared.off()
    if apart is None or apart.off <= max(_TELLS * apart.way, _SAFETY * apart.rounding):
        return [reading]
    trials = []
    for mistake in mistakes:
        trial = mistake.changed(reading.record)
        compared = measured(trial)
        left = None if compared is None else compared.off()
        if left is not None and left.off <= _HELPS * min(apart.off, left.way):
            trials.append((left.off, mistake, trial))
    if not trials:
        return [replace(reading, tried=reading.tried + len(mistakes))]
    most = 2 * min(leaves for leaves, _, _ in trials) + _SAFETY * apart.rounding
    readings = []
    for leaves, mistake, trial in (item for item in trials if item[0] <= most):
        proof = f"places off by {error(apart.off)}, by {error(leaves, 1)} with that"
        cause = LayerCause(mistake.id, f"{mistake.words} ({proof})", None, leaves)
        readings.append(reading.beside(trial, cause, apart, name, len(mistakes)))
    return readings


def _in_time(reading: _Reading, name: str, measured: _Measured) -> _Reading:
    """The reading with rates that are a row late or early moved to their rows.

    Places move by the velocity before a step, after it, or the mean: that is up to half an interval of lag.
    """
    compared = measured(reading.record)
    if compared is None:
        return reading
    lag, rounding, distance = compared.lag_fit(), compared.rounding / np.sqrt(3), compared.off()
    rows = 1 if lag.intervals > 0 else -1
    record = _moved(f"{name}.", rows, reading.record)
    right = measured(record) if len(record.time) > _FEWEST else None
    if right is None:
        return reading
    rest = right.lag_fit()
    noise = max(rest.rest, rounding)
    bar = _SURE * lag.bar(noise)
    explained = rest.rest <= max(2 * rounding, _HELPS * lag.size)
    if not explained or abs(lag.intervals) <= _OF_SCHEMES + bar or abs(rest.intervals) > _OF_SCHEMES + bar:
        return reading
    within_roundings = distance.off <= _SURE * distance.rounding
    if within_roundings and min(abs(rest.intervals - scheme / 2) for scheme in _SCHEMES) > bar:
        return reading  # rows that are late leave the lag of a scheme, errors that are not those of digits any
    remainder = right.off()
    words = f"{_NAMES.get(name, name)} is one row {'late' if rows > 0 else 'early'}"
    text, interval = with_bar(abs(lag.intervals), bar, 1)
    proof = f"places off by {error(distance.off)}, by {error(remainder.off, 1)} with that; {text} ± {interval} rows"
    cause = LayerCause("late" if rows > 0 else "early", f"{words} ({proof})", None, remainder.off)
    return reading.beside(record, cause, distance, name, 1)


def _layer(reading: _Reading) -> Layer | None:
    """Layer of a reading; None: nothing was wrong."""
    if not reading.causes:
        return None
    worst, tried = reading.worst, reading.tried
    bar = min(worst.rounding, 0.5 * worst.off)
    return Layer("state", worst.off, bar, reading.column, causes=reading.causes, tried=tried, known=tried)


class _Contradiction(NamedTuple):
    """Places minus the integrals of their rates, (rows, numbers): of trapezoids, and what one interval of lag adds."""

    left: Array
    lag: Array
    way: float
    rounding: float

    def off(self) -> _Off:
        """Largest difference by the scheme that suits best."""
        off = min(float(np.abs(self.left - part / 2 * self.lag).max()) for part in _SCHEMES)
        return _Off(off, self.way, self.rounding)

    def lag_fit(self) -> _Lag:
        """Intervals by which rates are late."""
        left, lag = self.left - self.left.mean(axis=0), self.lag - self.lag.mean(axis=0)
        square = float((lag * lag).sum())
        intervals = float((left * lag).sum()) / square if square else 0.0
        rest, size = (float(np.sqrt(np.mean(item**2))) for item in (left - intervals * lag, left))
        return _Lag(intervals=intervals, rest=rest, size=size, square=square)


class _Lag(NamedTuple):
    """Lag of rates behind their places.

    Attributes:
        intervals: rows by which they are late.
        rest: root mean square of what that leaves.
        size: the same without any lag.
        square: sum of squares of what one interval adds.
    """

    intervals: float
    rest: float
    size: float
    square: float

    def bar(self, noise: float) -> float:
        """Error of the intervals for a noise of the places."""
        return noise / np.sqrt(self.square) if self.square else np.inf


def _of_joints(record: ControlRecord) -> _Contradiction | None:
    names = [name[2:] for name in record.columns if name.startswith("q.") and f"v.{name[2:]}" in record.columns]
    q, v = record.stacked("q", names), record.stacked("v", names)
    return None if q is None or v is None else _of_places(record, q, v, record.rounding_of("q", names))


def _of_velocity(record: ControlRecord) -> _Contradiction | None:
    place, velocity = record.stacked("p_WB", "xyz"), record.stacked("v_WB", "xyz")
    if place is None or velocity is None:
        return None
    return _of_places(record, place, velocity, record.rounding_of("p_WB", "xyz"))


def _of_places(record: ControlRecord, places: Array, rates: Array, rounding: Array) -> _Contradiction:
    steps, way = np.diff(record.time)[:, None], places[1:] - places[0]
    mean = np.cumsum(steps * (rates[1:] + rates[:-1]) / 2, axis=0)
    lag = np.cumsum(steps * np.diff(rates, axis=0), axis=0)
    return _Contradiction(way - mean, lag, float(np.abs(way).max()), float(rounding.max()))


def _of_spin(record: ControlRecord) -> _Contradiction | None:
    attitude, spin = record.stacked("q_WB", "wxyz"), record.stacked("w_WB", "xyz")
    if attitude is None or spin is None:
        return None
    turned = Rotation.from_quat(attitude, scalar_first=True)
    steps, lefts = np.diff(record.time)[:, None], []
    for part in _SCHEMES:
        turns = Rotation.from_rotvec(steps * ((1 - part) * spin[:-1] + (1 + part) * spin[1:]) / 2)
        reached, left = turned[0], []
        for k in range(len(steps)):
            reached = turns[k] * reached
            left.append((turned[k + 1] * reached.inv()).as_rotvec())
        lefts.append(np.array(left))
    sooner, mean, later = lefts
    way = float((turned[1:] * turned[0].inv()).magnitude().max())
    return _Contradiction(mean, sooner - later, way, float(record.rounding_of("q_WB", "wxyz").max()))


def _of_joint_columns() -> Iterator[ColumnMistake]:
    swapped = "the columns q.JOINT and v.JOINT are each the other"
    others = {"q.": "v.", "v.": "q."}
    renamed = partial(
        ControlRecord.changed, change=lambda name, item: (others.get(name[:2], name[:2]) + name[2:], item)
    )
    yield ColumnMistake("swapped", swapped, renamed)
    yield ColumnMistake("degrees", "q.JOINT is in degrees: name it q.JOINT[deg]", partial(_scaled, "q.", _DEGREE))
    rates = "v.JOINT is in degrees per second: name it v.JOINT[deg/s]"
    yield ColumnMistake("degrees", rates, partial(_scaled, "v.", _DEGREE))
    yield ColumnMistake("sign", "v.JOINT has the other sign", partial(_scaled, "v.", -1.0))
    yield ColumnMistake("sign", "q.JOINT has the other sign", partial(_scaled, "q.", -1.0))
    words = "the times are in milliseconds: name them time[ms]"
    yield ColumnMistake("milliseconds", words, lambda record: replace(record, time=_MILLI * record.time))


def _of_spins() -> Iterator[ColumnMistake]:
    last = "q_WB is x, y, z, w under the names of w, x, y, z"
    inverse = "q_WB is of the inverse rotation, of the world in the base"
    both = f"{last}, and of the inverse rotation, of the world in the base"
    yield ColumnMistake("base_axes", "w_WB is along the axes of the base: name it w_WB_B", partial(_along_base, "w_WB"))
    yield ColumnMistake("sign", "w_WB has the other sign", partial(_scaled, "w_WB.", -1.0))
    yield ColumnMistake("quaternion", last, partial(_requaternioned, _SCALAR_LAST))
    yield ColumnMistake("quaternion", inverse, partial(_requaternioned, _INVERSE))
    yield ColumnMistake("quaternion", both, partial(_requaternioned, {**_SCALAR_LAST, **_INVERSE}))
    for words, change in ((last, _SCALAR_LAST), (inverse, _INVERSE)):
        sentence = f"{words}, and w_WB is along the axes of the base"
        changed = _after(partial(_requaternioned, change), partial(_along_base, "w_WB"))
        yield ColumnMistake("quaternion", sentence, changed)


def _of_velocities(law: ControlLaw) -> Iterator[ColumnMistake]:
    yield ColumnMistake("base_axes", "v_WB is along the axes of the base: name it v_WB_B", partial(_along_base, "v_WB"))
    if law.centre.any():
        at_centre = "v_WB is the velocity of the base's centre of mass, not of its origin"
        yield ColumnMistake("point", at_centre, partial(_to_origin, law.centre))
        change = _after(partial(_along_base, "v_WB"), partial(_to_origin, law.centre))
        yield ColumnMistake("point", f"{at_centre}, along the axes of the base", change)


def action_mistakes(law: ControlLaw, instants: Array) -> Iterator[ColumnMistake]:
    """Mistakes of the columns of actions; ``instants``: rows at which the controller acts."""
    pose = {f"action.{joint}": place for joint, place in zip(law.joints, law.pose.tolist(), strict=True)}

    def from_pose(record: ControlRecord) -> ControlRecord:
        return replace(record, columns={name: item - pose.get(name, 0.0) for name, item in record.columns.items()})

    scaled = partial(_scaled, "action.", 1 / law.scale)
    if law.scale != 1:
        yield ColumnMistake("scaled_action", "the columns of actions have the scale of the controller already", scaled)
    words = "the columns of actions are targets, the default pose and the scale included"
    yield ColumnMistake("action_target", words, _after(from_pose, scaled))

    def sooner(record: ControlRecord) -> ControlRecord:
        """The record up to its last instant, with the actions of the next one."""
        rows: Any = np.arange(int(instants[-1]))
        following = np.searchsorted(instants, rows, side="right")
        part = record.part(rows)
        columns, rounding = dict(part.columns), dict(part.rounding)
        for name in (name for name in columns if name.startswith("action.")):
            columns[name] = record.columns[name][instants[following]]
            rounding[name] = record.rounding[name][instants[following]]
        return replace(part, columns=columns, rounding=rounding)

    if len(instants) > 2:
        yield ColumnMistake("late_action", "the columns of actions are one instant late", sooner)


_SCALAR_LAST: Mapping[str, str] = {"w": "z", "x": "w", "y": "x", "z": "y"}  # component -> the column that has it
_INVERSE: Mapping[str, str] = {"inverse": ""}


def _requaternioned(change: Mapping[str, str], record: ControlRecord) -> ControlRecord:
    """The record with other columns of quaternions, and of what was turned by them."""
    axes = {f"q_WB.{change.get(axis, axis)}": axis for axis in BASE["q_WB"]}

    def renamed(name: str, item: Array) -> tuple[str, Array]:
        axis = axes.get(name, "")
        sign = -1.0 if "inverse" in change and axis in {"x", "y", "z"} else 1.0
        return f"q_WB.{axis}" if axis else name, sign * item

    record = record.changed(renamed)  # velocities that it has along the axes of its base are turned anew
    turned = tuple(f"{name}." for name in ("v_WB", "w_WB") if f"{name}_B.x" in record.columns)
    return in_world(record.changed(lambda name, item: None if name.startswith(turned) else (name, item)))


def _along_base(kind: str, record: ControlRecord) -> ControlRecord:
    """The record with velocities that are along the axes of the base."""
    return in_world(record.changed(lambda name, item: (name.replace(f"{kind}.", f"{kind}_B."), item)))


def _to_origin(centre: Array, record: ControlRecord) -> ControlRecord:
    """The record with velocities of the origin in place of those of a point [m, in the base's axes]."""
    attitude, velocity, spin = (record.stacked(name, tuple(BASE[name])) for name in ("q_WB", "v_WB", "w_WB"))
    if attitude is None or velocity is None or spin is None:
        return record
    moved = velocity - np.cross(spin, Rotation.from_quat(attitude, scalar_first=True).apply(centre))
    columns = dict(record.columns) | {f"v_WB.{axis}": moved[:, k] for k, axis in enumerate("xyz")}
    return replace(record, columns=columns)


def _scaled(start: str, factor: float, record: ControlRecord) -> ControlRecord:
    return record.changed(lambda name, item: (name, factor * item if name.startswith(start) else item))


def _moved(start: str | tuple[str, ...], rows: int, record: ControlRecord) -> ControlRecord:
    """The record with columns that are a row late, 1, or early, -1, in time; the row for which there is none goes."""
    kept: Any = np.arange(max(0, -rows), len(record.time) - max(0, rows))
    part = record.part(kept)
    moved = {name: item[kept + rows] for name, item in record.columns.items() if name.startswith(start)}
    return replace(part, columns={**part.columns, **moved})


def _after(*changes: Changed) -> Changed:
    """Change by several ones, one after another."""
    return lambda record: functools.reduce(lambda changed, change: change(changed), changes, record)
