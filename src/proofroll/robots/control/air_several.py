"""Several numbers of a robot in the air that close its accelerations together, of all joints, links and the whole."""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from scipy.special import gammaincc

from proofroll.core.diagnosis.fitting import least_squares_parameters
from proofroll.core.errors import Diverged, Refused
from proofroll.core.number_format import error, with_bar
from proofroll.elements.mechanism.dynamics.linear_balance import numbers_of
from proofroll.robots.control.air_rows import (
    BY_JOINT,
    NUMBERS,
    ROUND_OFF,
    SAFETY,
    VECTORS,
    AirRows,
    AirTable,
    StepScheme,
    motion_of,
    right_numbers,
    rms,
)
from proofroll.robots.control.bookkeeping.air import AirRobot, HeldRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.differences import efforts_of
from proofroll.robots.control.record import BASE, FITTED, ControlRecord, Layer, LayerCause
from proofroll.robots.model import Array

_MOST = 0.5  # part of the equations that numbers may be
_OF_A_POINT = 4  # numbers of a mass at a point
_LISTED = 4  # joints whose numbers are told one by one
_WIDTHS, _DEGREE = (161, 81, 41, 21, 11), 3  # rows that are smoothed together, and degree of the polynomials
_PARTS = 60  # such stretches in a record at least
_WHITE = 6.0  # errors of an estimate of noise by which two differ: of neighbouring rows, and of what smoothing takes
_QUIET = 1e-4  # part of a column's range up to which it counts as smooth
_OF_DIFFERENCES = 20.0  # variance of third differences of white noise of variance 1
_CHANCE, _BARS = 1e-3, 3.0  # chance of a number that is told and is not there; standard deviations in a bar
_EACH = 2  # equations for each number at least
_SPREAD = 5.0  # standard deviations of a sum of squares within which numbers leave as little as all of them do
_CLEAR, _SHARE = 10.0, 0.03  # least part of a number's forces that no others make: what is left of less is their noise
_STRETCH, _TO_AND_FRO = 60, -0.25  # rows that show noise at least; correlation of its steps with the next ones at most
_MEDIAN = 0.455  # median of the square of a normal number
_LARGEST = 6.0  # standard deviations of the largest of thousands
_EFFORTS = ("effort", "efforts")  # parts of the efforts that act, of all joints or of each
_REST = "torque"  # number of a joint that a spring needs, too: its rest is not known


@dataclass(frozen=True, eq=False)
class _Group:
    """Numbers that are tried together.

    Attributes:
        kind: of the numbers.
        columns: forces that one more of each takes away, (equations, numbers).
        where: joint of each number, or the body, or nothing.
    """

    kind: str
    columns: Array
    where: tuple[str, ...]


def several_causes(rows: AirRows, joints: Sequence[str], right: dict[str, float]) -> list[LayerCause]:
    """Causes with which, all together, no more than rounding is left; empty without such a set.

    Of the sets of one group of numbers or two the one with the fewest numbers counts; what lies within its error is
    dropped.

    Args:
        rows: forces at rows of the record.
        joints: driven joints.
        right: number -> its right value, for those that are parts of the right ones.
    """
    rows, groups = _moving(rows, joints)
    carried: list[LayerCause] | None = None
    for chosen in _closing(groups, rows):
        columns = _columns(chosen)
        if columns.shape[1] > _OF_A_POINT and carried is None and (carried := _carried(rows)):
            return carried
        values, remainder = _solved(columns, rows.left)
        kinds = [group.kind for group in chosen for _ in group.where]
        parts = _EFFORTS if FITTED in kinds else _EFFORTS[:1]
        scales = [value for value, kind in zip(values, kinds, strict=True) if kind in parts]
        if any(
            abs(scale + 1) <= ROUND_OFF for scale in scales
        ):  # without efforts, masses of nothing explain any motion
            continue
        if columns.shape[1] <= _MOST * len(rows.left) and rms(remainder) <= SAFETY * rows.rounding:
            return [*_told(rows, chosen, columns, values, right)]
    return []


def may_be_explained(rows: AirRows, joints: Sequence[str]) -> bool:
    """True if two groups of numbers may leave no more than rounding."""
    rows, groups = _moving(rows, joints)
    return next(_closing(groups, rows), None) is not None


def _moving(rows: AirRows, joints: Sequence[str]) -> tuple[AirRows, list[_Group]]:
    """Rows without those near rest, at which dry friction is none that a sign tells, with their groups of numbers."""
    rows = rows.without(rows.slow) if rows.slow.any() and not rows.slow.all() else rows
    return rows, [*_groups(rows, joints)]


def _closing(groups: Sequence[_Group], rows: AirRows) -> Iterator[list[_Group]]:
    """One group or two, of fewest numbers first, that leave no more than rounding at every second equation.

    All groups but the scale of efforts leave least; with it, all of them together are the equations themselves.
    """
    others = [group for group in groups if group.kind not in _EFFORTS]
    sets = [*itertools.combinations(groups, 1), *itertools.combinations(groups, 2)]
    if not _close(others, rows):
        sets = [chosen for chosen in sets if any(group.kind in _EFFORTS for group in chosen)]
    sets.sort(key=lambda chosen: _columns(chosen).shape[1])
    sets.sort(key=lambda chosen: any(group.kind == "push" for group in chosen))  # they make a constant torque, too
    yield from ([*chosen] for chosen in sets if _close(chosen, rows))


def _columns(groups: Sequence[_Group]) -> Array:
    return np.concatenate([group.columns for group in groups], axis=1)


def _close(groups: Sequence[_Group], rows: AirRows) -> bool:
    columns = _columns(groups)
    every = 2 if len(rows.left) > 4 * columns.shape[1] else 1
    _, remainder = _solved(columns[::every], rows.left[::every])
    return rms(remainder) <= math.sqrt(every) * SAFETY * rows.rounding


def _groups(rows: AirRows, joints: Sequence[str]) -> Iterator[_Group]:
    """Groups of numbers: of the whole robot, of all joints, of springs with their rest, and of each link."""
    for name in NUMBERS:
        if rows.columns[name].any():
            yield _Group(name, rows.columns[name][:, None], ("",))
    for name, columns in rows.by_joint.items():
        rests = [rows.by_joint[_REST]] if name == "stiffness" else []
        whole = np.concatenate([columns, *rests], axis=1)
        yield _Group(name, whole, tuple(joints) * (1 + len(rests)))
    for body, columns in rows.added.items():
        yield _Group(FITTED, columns, (body,) * columns.shape[1])
    for body, columns in rows.pushed.items():
        yield _Group("push" if body else "pull", columns, (body,) * columns.shape[1])


def _scaled(columns: Array) -> tuple[Array, Array]:
    """Columns of size 1, and their sizes, infinite for columns of zeros."""
    sizes = np.linalg.norm(columns, axis=0)
    sizes = np.where(sizes > 0, sizes, np.inf)
    return columns / sizes, sizes


def _solved(columns: Array, left: Array) -> tuple[Array, Array]:
    """Numbers of least squares, and what they leave."""
    scaled, sizes = _scaled(columns)
    values = np.linalg.lstsq(scaled, left, rcond=ROUND_OFF)[0]
    return values / sizes, left - scaled @ values


def _errors(rows: AirRows, columns: Array, values: Array) -> Array:
    """Error of each number by the rounding of the record, and by noise of the columns, which makes numbers smaller."""
    scaled, sizes = _scaled(columns)
    spread = np.linalg.norm(np.linalg.pinv(scaled, rcond=ROUND_OFF), axis=1)
    return np.asarray(SAFETY * rows.rounding * spread / sizes + np.abs(values) * (rows.blur * spread) ** 2)


def _told(
    rows: AirRows, groups: Sequence[_Group], columns: Array, values: Array, right: dict[str, float]
) -> Iterator[LayerCause]:
    """A cause for each kind of number beyond its error."""
    bars, remainder = _errors(rows, columns, values) + ROUND_OFF, rms(rows.left - columns @ values)
    proof = rows.proof(remainder, "with all")
    begin = 0
    for group in groups:
        place = slice(begin, begin + len(group.where))
        begin = place.stop
        words = _words(group, values[place], bars[place], right)
        if words:
            weighs = group.kind == FITTED and abs(values[place][0]) > bars[place][0]
            size = float(values[place][0]) if weighs else None
            yield LayerCause(group.kind, f"{words} ({proof})", size, remainder / rows.size)


def _carried(rows: AirRows) -> list[LayerCause]:
    """Cause: the body that carries a mass at a point of it, if that leaves no more than rounding; empty: none does."""
    causes: list[tuple[float, LayerCause]] = []
    for body, columns in rows.added.items():
        sizes = np.linalg.norm(columns, axis=0)
        if sizes[0] <= ROUND_OFF * sizes.max():  # about a fixed axis no mass shows
            continue
        values, remainder = _solved(columns, rows.left)
        if rms(remainder) > SAFETY * rows.rounding:
            continue
        start = np.array([abs(values[0]) or 1.0, *values[1:4]])

        def left(numbers: Array, columns: Array = columns) -> Array:
            return rows.left - columns @ _point(numbers)

        numbers = least_squares_parameters(left, start, float(np.abs(start).max()))
        distance = rms(left(numbers))
        if distance <= SAFETY * rows.rounding and numbers[0] > 0:
            place = ", ".join(f"{x:.3g}" for x in (numbers[1:] / numbers[0]).round(4))
            words = f"{body} carries {numbers[0]:.4g} kg more, at ({place}) m"
            sentence = f"{words} ({rows.proof(distance)})"
            causes.append((distance, LayerCause(FITTED, sentence, float(numbers[0]), distance / rows.size)))
    return [cause for _, cause in sorted(causes, key=lambda item: item[0])[:1]]


def _point(numbers: Array) -> Array:
    """Mass, first moment and inertia (xx, yy, zz, xy, xz, yz) of a point of a mass with a first moment."""
    mass, com = numbers[:1], numbers[None, 1:] / (numbers[0] or np.inf)
    return np.array([*numbers, *numbers_of(mass, com)[0, 4:]])


def _words(group: _Group, values: Array, bars: Array, right: dict[str, float]) -> str:
    """Clause on the numbers of a group that lie beyond their errors; empty without one."""
    beyond = [k for k in range(len(values)) if abs(values[k]) > bars[k]]
    if not beyond:
        return ""
    if group.kind == FITTED:
        weight = ", {} ± {} kg more".format(*with_bar(values[0], bars[0], 1)) if beyond[0] == 0 else ""
        first = next(k for k, end in enumerate((1, 4, 10)) if beyond[0] < end)
        what = ("mass, centre and inertia of {} are others", "centre and inertia of {} are others")
        return (*what, "the inertia of {} is another")[first].format(group.where[0]) + weight
    if group.where == ("",):
        words, unit = NUMBERS[group.kind]
        text, interval = with_bar(right.get(group.kind, 0.0) + values[0], bars[0], 1)
        return f"{words} {text} ± {interval} {unit}"
    if group.kind in VECTORS:
        words, unit = VECTORS[group.kind]
        parts = ("{} ± {} {} along {}".format(*with_bar(values[k], bars[k], 1), unit, "xyz"[k]) for k in beyond)
        return words.format(", ".join(parts), body=group.where[0])
    count = len(values) if group.kind != "stiffness" else len(values) // 2
    beyond = [k for k in beyond if k < count]
    words, unit = BY_JOINT[group.kind]
    even = 1 < len(beyond) == count and np.ptp(values[:count]) <= 2 * bars[:count].max()
    if not beyond:
        return ""
    shown = [(f"all {count} joints", values[:count].mean(), bars[:count].max())] if even else []
    shown = shown or [(group.where[k], values[k], bars[k]) for k in beyond]
    texts = []
    for where, value, bar in shown[:_LISTED]:
        text, interval = with_bar(float(value) + (group.kind == "efforts"), float(bar), 1)
        texts.append(f"{text} ± {interval} at {where}")
    more = f" and at {len(shown) - _LISTED} more" if len(shown) > _LISTED else ""
    return f"joints have {words} {', '.join(texts)}{more} {unit}{' that is not told' * (group.kind != 'efforts')}"


class WhiteNoise(NamedTuple):
    """White noise of a record: the smooth record, and how it is smoothed."""

    record: ControlRecord
    part: float  # largest part of the range of a column
    clause: str  # on it
    smooth: Callable[[Array], Array]
    width: int  # rows that are smoothed together


def noisy_layer(record: ControlRecord, law: ControlLaw, held: HeldRobot, off: str) -> Layer | None:
    """Layer of accelerations that white noise hides, with the numbers beyond their bars; None: no such noise.

    Smoothing is linear. So the balance of forces holds between smoothed columns, too, as far as the masses change
    little within the rows that are smoothed together. The noise is what all numbers leave.

    Args:
        record: of states and efforts.
        law: the law as it should be.
        held: the robot.
        off: clause on what the right numbers leave without smoothing.
    """
    if (white := white_noise(record)) is None:
        return None
    robot, efforts = AirRobot.bare(held.mechanism, law), white.record.stacked("effort", law.joints)
    if isinstance(motion := motion_of(white.record, robot), str) or efforts is None:
        return None
    states, moving = motion
    table = AirTable(white.record, law, robot, states, efforts, held.links)
    table.signs = white.smooth(table.signs)
    instants: Any = np.arange(white.width, len(states) - white.width, white.width)
    try:
        rows = table.rows(instants, moving[0], StepScheme(), central=True)
        lag = rows.late / (np.linalg.norm(rows.late) or 1.0)  # of no interest: states and efforts of other instants
        rows, groups = _moving(rows.changed(lambda values: values - np.multiply.outer(lag, lag @ values)), law.joints)
        others = _columns([group for group in groups if group.kind not in _EFFORTS])
        count = int(np.linalg.matrix_rank(_scaled(others)[0], ROUND_OFF))
        if len(rows.left) < _EACH * count:
            return None
        rows = _in_noise(rows, _solved(others, rows.left)[1], count)
    except (Diverged, Refused, np.linalg.LinAlgError):  # the last: along a direction there is no noise
        return None
    if (chosen := _beyond_chance(rows, law.joints, count)) is None:
        return None
    columns = _columns(chosen) if chosen else np.zeros((len(rows.left), 0))
    causes = tuple(_told(rows, chosen, columns, _solved(columns, rows.left)[0], right_numbers(law)))
    numbers = "these numbers alone are" if causes else "no number is"
    reason = f"{off}; {white.clause}, and {numbers} off by more than their bars"
    return Layer("acceleration", reason=reason, causes=causes, undecided=True, noise=white.part)


def commanded_layer(record: ControlRecord, law: ControlLaw, held: HeldRobot) -> Layer:
    """Layer of accelerations of a record without efforts, under those of the law where white noise hides it."""
    absent = "the record has no columns effort.JOINT"
    efforts = efforts_of(record, law) if white_noise(record) else absent
    if isinstance(efforts, str) or not np.isfinite(efforts).all():
        return Layer("acceleration", reason=absent)
    columns = {f"effort.{joint}": column for joint, column in zip(law.joints, efforts.T, strict=True)}
    record = replace(record, columns={**record.columns, **columns})
    clause = f"{absent}: they are the law's for its states"
    return noisy_layer(record, law, held, clause) or Layer("acceleration", reason=absent)


@lru_cache(maxsize=4)
def white_noise(record: ControlRecord, *, efforts: bool = True) -> WhiteNoise | None:
    """White noise of states, and of efforts if asked; None: they have other noise, or none.

    The widest smoothing counts that takes away no more of any column than white noise.
    """
    kinds = ("q.", "v.", *(f"{name}." for name in BASE), *(("effort.",) if efforts else ()))
    columns = {name: item for name, item in record.columns.items() if name.startswith(kinds) and np.ptp(item) > 0}
    if not columns:
        return None
    values = np.stack([*columns.values()], axis=1)
    ranges = np.ptp(values, axis=0)
    least = np.maximum(
        _QUIET * ranges, [record.rounding[name].max() if name in record.rounding else 0.0 for name in columns]
    )
    noise = np.sqrt(np.mean(np.diff(values, _DEGREE, axis=0) ** 2, axis=0) / _OF_DIFFERENCES)
    for width in (item for item in _WIDTHS if len(values) >= _PARTS * item):
        powers = np.vander(np.arange(width) - width // 2, _DEGREE + 1, increasing=True)
        weights = np.linalg.pinv(powers)[0]  # of rows in the middle of the polynomial through them (Savitzky and Golay)
        smooth = partial(np.apply_along_axis, partial(np.convolve, weights, mode="same"), 0)
        smoother, kept = smooth(values), float(weights[width // 2])
        taken = np.sqrt(np.mean((values - smoother)[width:-width] ** 2, axis=0) / (1 - kept))
        alike = 1 + _WHITE / math.sqrt(len(values))
        white = (taken <= alike * noise) & (noise <= alike * taken)
        if np.all(white | (taken <= _QUIET * ranges)) and np.any(white & (noise > least)):
            curves = dict(zip(columns, smoother.T, strict=True))
            smoothed = replace(record, columns={**record.columns, **curves})
            part = float((noise / ranges).max())
            words = f"white noise of up to {error(100 * part, 1)} % of a range, smoothed over {width} rows, explains it"
            return WhiteNoise(record=smoothed, part=part, clause=words, smooth=smooth, width=width)
    return None


class StateNoise(NamedTuple):
    """White noise of the states of a record: the record with it as its rounding, and the largest part of a range."""

    record: ControlRecord
    part: float

    @property
    def words(self) -> str:
        """Clause on it."""
        return f"white noise of {error(100 * self.part, 1)} % of a range"


@lru_cache(maxsize=4)
def noise_of_states(record: ControlRecord) -> StateNoise | None:
    """White noise of a record whose places have it; None: those of no joint have.

    Places then go to and fro about the integral of the velocities, from each row to the next.
    """
    h, noisy = np.diff(record.time), False
    for name, places in record.columns.items():
        velocities = record.columns.get(f"v.{name[2:]}")
        if name.startswith("q.") and velocities is not None and len(h) > _STRETCH:
            off = np.diff(places) - h * (velocities[1:] + velocities[:-1]) / 2
            off = off - off.mean()
            square, rounding = float(off @ off) or 1.0, 2 * record.rounding[name].max()
            next_one, one_after = (float(off[k:] @ off[:-k]) / square for k in (1, 2))
            noisy |= square > len(off) * rounding**2 and next_one < _TO_AND_FRO and abs(one_after) < -_TO_AND_FRO
    if not noisy:
        return None
    kinds = ("q.", "v.", *(f"{name}." for name in BASE))
    columns = {name: item for name, item in record.columns.items() if name.startswith(kinds) and np.ptp(item) > 0}
    squares = {name: np.mean(np.diff(item, _DEGREE) ** 2) / _OF_DIFFERENCES for name, item in columns.items()}
    bars = {name: np.maximum(record.rounding[name], math.sqrt(3 * square)) for name, square in squares.items()}
    part = max(math.sqrt(square) / float(np.ptp(columns[name])) for name, square in squares.items())
    return StateNoise(replace(record, rounding={**record.rounding, **bars}), part)


def noise_beside(curves: Array) -> Array:
    """Largest noise of each column (times, n) beside curves that may jump at some times."""
    if len(curves) <= _DEGREE:
        return np.zeros(curves.shape[1])
    median = np.median(np.diff(curves, _DEGREE, axis=0) ** 2, axis=0)
    return np.asarray(_LARGEST * np.sqrt(median / (_MEDIAN * _OF_DIFFERENCES)))


def _in_noise(rows: AirRows, remainder: Array, count: int) -> AirRows:
    """Rows in parts of their noise, which is what a number of independent columns leaves."""
    by_row = remainder.reshape(-1, rows.freedoms)
    into = np.linalg.inv(np.linalg.cholesky(by_row.T @ by_row / (len(by_row) - count / rows.freedoms)))

    def whitened(values: Array) -> Array:
        return np.asarray((into @ values.reshape(-1, rows.freedoms, values.size // len(values))).reshape(values.shape))

    blur = rms(remainder) / rows.size
    return replace(rows.changed(whitened), rounding=_BARS / SAFETY, size=1 / blur, blur=blur)


def _beyond_chance(rows: AirRows, joints: Sequence[str], count: int) -> list[_Group] | None:
    """Numbers that are there beyond chance, one by one; None: they leave more than noise.

    ``count``: independent numbers of the robot.
    """
    groups, chosen = [*_single(_groups(rows, joints), joints)], list[_Group]()
    basis, remainder = np.zeros((len(rows.left), 0)), rows.left
    while True:
        best, most = None, 0.0
        for group in (item for item in groups if item not in chosen):
            taken, numbers = _taken(group, basis, remainder)
            gain = taken - numbers * math.log(len(remainder))
            if numbers and gain > most and gammaincc(numbers / 2, taken / 2) * len(groups) < _CHANCE:
                best, most = group, gain
        if best is None:
            free = max(count - basis.shape[1], 1)
            more = float(remainder @ remainder) - (len(remainder) - count)
            return chosen if more <= free + _SPREAD * math.sqrt(2 * free) else None
        chosen.append(best)
        basis = np.linalg.qr(_columns(chosen))[0]
        remainder = rows.left - basis @ (basis.T @ rows.left)


def _single(groups: Iterable[_Group], joints: Sequence[str]) -> Iterator[_Group]:
    """Numbers of each joint and of each link, and those of the whole robot that are no sums over joints."""
    for group in groups:
        if group.kind not in BY_JOINT:
            yield group
        elif group.where != ("",):
            parts = ((joint, group.columns[:, k :: len(joints)]) for k, joint in enumerate(joints))
            yield from (_Group(group.kind, columns, (joint,) * columns.shape[1]) for joint, columns in parts)


def _taken(group: _Group, basis: Array, remainder: Array) -> tuple[float, int]:
    """Sum of squares that numbers take away beside a basis, and how many of them it leaves independent.

    Efforts have most of the noise, so that all but a multiple of it has to be left of them.
    """
    parts, sizes = _scaled(group.columns)
    least = _CLEAR * math.sqrt(len(remainder)) / sizes[0] if group.kind in _EFFORTS else _SHARE
    directions, values, _ = np.linalg.svd(parts - basis @ (basis.T @ parts), full_matrices=False)
    independent = directions[:, values > least]
    return float(np.sum((independent.T @ remainder) ** 2)), independent.shape[1]
