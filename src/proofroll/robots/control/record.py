"""Record of a robot under a controller from any simulator or a real robot: states, actions and efforts; its layers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.errors import InputError, choices
from proofroll.core.unit_conversion import in_si
from proofroll.files.csv_table import read_csv
from proofroll.robots.model import Array

# Columns of the base with the names of their components, units and meaning.
BASE: Mapping[str, str] = {"p_WB": "xyz", "q_WB": "wxyz", "v_WB": "xyz", "w_WB": "xyz"}
OBSERVED = "observed"
FITTED = "payload"  # id of the cause that has a mass and an inertia of a body as fitted numbers
_SINGLE = 2.0**-24  # relative rounding of single precision
_DOUBLE = 2.0**-53
_DIGITS = 9  # decimal digits that single precision needs; a file of fewer was rounded to them
_MANY = 30  # different values that agree in their decimals by no accident
_DECIMALS = 8  # most decimals of a file that is written with a fixed number of them


@dataclass(frozen=True, eq=False)
class ControlRecord:
    """Columns of a record over time, in SI units.

    Attributes:
        path: of the file, for messages.
        columns: name -> values; ``q.JOINT``, ``v.JOINT``, ``p_WB.x``, ``q_WB.w``, ``v_WB.x``, ``w_WB.x`` (of the base,
            in world axes), ``observed.q.JOINT``, ``observed.gravity_B.x`` and so on, ``action.JOINT``,
            ``target.JOINT``, ``effort.JOINT``; ``v_WB_B.x``, ``w_WB_B.x`` are velocities of the base in its own axes.
        rounding: name -> largest rounding error of each value, with the shape of the column.
        time: [s].
    """

    path: Path
    columns: Mapping[str, Array]
    rounding: Mapping[str, Array]
    time: Array

    def stacked(self, kind: str, names: Sequence[str]) -> Array | None:
        """Columns ``kind.name`` beside each other, (times, names); None: the record has none of them.

        Raises:
            InputError: some of them are there, and others are not.
        """
        columns = [f"{kind}.{name}" for name in names]
        absent = [name for name in columns if name not in self.columns]
        if len(absent) == len(columns):
            return None
        if absent:
            raise InputError(
                str(self.path), absent[0], f"the record has no such column; it has {choices(list(self.columns))}"
            )
        return np.stack([self.columns[name] for name in columns], axis=1)

    def rounding_of(self, kind: str, names: Sequence[str]) -> Array:
        """Rounding errors of the columns of :meth:`stacked`, (times, names)."""
        return np.stack([self.rounding[f"{kind}.{name}"] for name in names], axis=1)

    def rounded(self, generator: np.random.Generator) -> ControlRecord:
        """The record with values, but not times, moved at random within their rounding, equal successive ones alike."""
        moved = {}
        for name, values in self.columns.items():
            runs = np.concatenate([[0], np.cumsum(np.diff(values) != 0)])
            moved[name] = values + self.rounding[name] * generator.uniform(-1, 1, values.shape)[runs]
        return replace(self, columns=moved)

    def part(self, rows: Array) -> ControlRecord:
        """The record at some rows."""
        part = self.changed(lambda name, values: (name, values[rows]))
        return replace(part, time=self.time[rows])

    def changed(self, change: Callable[[str, Array], tuple[str, Array] | None]) -> ControlRecord:
        """The record with other names and values of columns; None: without a column. Rounding changes by its size."""
        columns, rounding = (
            dict(filter(None, (change(name, item) for name, item in part.items())))
            for part in (self.columns, self.rounding)
        )
        return replace(self, columns=columns, rounding={name: np.abs(item) for name, item in rounding.items()})


def read_record(path: Path, names: Mapping[str, str]) -> ControlRecord:
    """Record in a CSV file with the column ``time``; units of its header are converted to SI units.

    ``names``: column of the file -> its name here, perhaps with its unit, ``q.hip[deg]``.

    Raises:
        InputError: there is no such file, or it is no table of numbers.
    """
    try:
        dataset = read_csv(path.read_text(encoding="utf-8"), names)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("record", path, f"the file cannot be read: {error}") from None
    except ValueError as error:
        raise InputError("record", path, str(error)) from None
    columns = {str(name): item.to_numpy().astype(float) for name, item in dataset.data_vars.items()}
    units = {str(name): str(item.attrs["units"]) for name, item in dataset.variables.items() if "units" in item.attrs}
    return record_of(dataset["time"].to_numpy().astype(float), columns, path, units)


def record_of(
    time: Array,
    columns: Mapping[str, Array],
    path: Path = Path("record"),
    units: Mapping[str, str] | None = None,
    digits: float | None = None,
) -> ControlRecord:
    """Record of columns.

    Args:
        time: [s], or in the unit of ``time``.
        columns: name -> values.
        path: of the file, for messages.
        units: column, or ``time`` -> its unit, where that need not be an SI unit.
        digits: relative rounding of the numbers that the columns were computed from, beside the decimals that they
            show; None: the columns show it.

    Raises:
        InputError: times do not grow, or a value is not finite.
    """
    if len(time) < 2 or not np.all(np.diff(time) > 0):
        raise InputError(str(path), "time", "give two or more times that grow")
    for name, values in columns.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            rows = f" and in {len(bad) - 1} of the {len(values)} rows besides" if len(bad) > 1 else ""
            advice = f"it is not finite at t = {time[bad[0]]:g} s{rows}"
            raise InputError(f"{path}: {name}", float(values[bad[0]]), advice)
    factors = {name: in_si(unit)[1] for name, unit in (units or {}).items()}
    if digits is None:
        rounding = _roundings(columns)  # of the digits that are written
    else:
        decimals = _decimal_roundings(columns, digits)
        rounding = {
            name: np.full(item.shape, 2 * digits * np.abs(item).max() + decimals[name])
            for name, item in columns.items()
        }
    converted, rounding = (
        {name: item * factors.get(name, 1.0) for name, item in part.items()} for part in (columns, rounding)
    )
    record = ControlRecord(path, converted, rounding, time * factors.get("time", 1.0))
    attitude = record.stacked("q_WB", "wxyz")
    if attitude is not None:  # a program that keeps a quaternion to fewer digits than it writes shows it by its length
        off = np.abs(np.linalg.norm(attitude, axis=1) - 1)
        for axis in "wxyz":
            rounding[f"q_WB.{axis}"] = np.maximum(rounding[f"q_WB.{axis}"], off)
    return in_world(record)


def in_world(record: ControlRecord) -> ControlRecord:
    """The record with velocities of the base along the world's axes, which it may have along those of the base."""
    columns, rounding = dict(record.columns), dict(record.rounding)
    attitude = record.stacked("q_WB", "wxyz")
    for name in ("v_WB", "w_WB"):
        vectors = record.stacked(f"{name}_B", "xyz")
        if vectors is None or attitude is None or f"{name}.x" in columns:
            continue
        turned = Rotation.from_quat(attitude, scalar_first=True).apply(vectors)
        bars = record.rounding_of(f"{name}_B", "xyz").sum(axis=1)
        bars = bars + 2 * record.rounding_of("q_WB", "wxyz").sum(axis=1) * np.linalg.norm(vectors, axis=1)
        for k, axis in enumerate("xyz"):
            columns[f"{name}.{axis}"], rounding[f"{name}.{axis}"] = turned[:, k], bars
    return replace(record, columns=columns, rounding=rounding)


def _decimal_roundings(columns: Mapping[str, Array], digits: float) -> dict[str, float]:
    """Rounding of each column to a number of decimals that all columns of its kind show; 0 where they show none.

    Velocities of a base may have been computed from rounded numbers: they have at least the rounding of its attitude.
    A kind with few different values, as constant targets, has the rounding of the joints' columns if its values fit it.
    """
    kinds: dict[str, list[Array]] = {}
    for name, values in columns.items():
        kinds.setdefault(name.partition(".")[0], []).append(values)
    different = {kind: np.unique(np.concatenate(values)) for kind, values in kinds.items()}
    shown = {kind: _decimals(values, digits) for kind, values in different.items()}
    written = [kind for kind in ("q", "v", "action", "effort") if len(different.get(kind, ())) >= _MANY]
    common = min((shown[kind] for kind in written), default=0.0)  # a base's velocities may be computed from others
    for kind in [kind for kind, values in different.items() if common and len(values) < _MANY]:
        steps = different[kind] / (2 * common)
        shown[kind] = common * float(np.allclose(steps, np.round(steps), rtol=4 * digits, atol=1e-9))
    for kind in shown.keys() & {"v_WB", "w_WB"}:
        shown[kind] = max(shown[kind], shown.get("q_WB", 0.0))
    return {name: shown[name.partition(".")[0]] for name in columns}


def _decimals(values: Array, digits: float) -> float:
    """Rounding of different values to the fewest decimals that they all have; 0 if there are few of them, or none."""
    for decimals in range(1, _DECIMALS if len(values) >= _MANY else 1):
        scaled = values * 10.0**decimals
        round_off = 4 * digits * np.abs(scaled) + 1e-9
        if np.all(np.abs(scaled - np.round(scaled)) <= round_off) and round_off.max() < 0.1:
            return 0.5 * 10.0**-decimals
    return 0.0


def _roundings(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Largest rounding error of each value: of the decimals, digits or precision in which the file is written."""
    values = np.concatenate([*columns.values(), np.zeros(1)])
    written = [Decimal(repr(value)).normalize().as_tuple() for value in values.tolist()]
    places = max(-int(number.exponent) for number in written)
    digits = max(len(number.digits) for number in written)
    decimals = 0.5 * 10.0**-places if places <= _DECIMALS else 0.0
    singles = {name: _is_single(column) for name, column in columns.items()}
    all_single = all(singles.values())

    def rounding(name: str, column: Array) -> Array:
        sizes = np.abs(column)
        if digits < _DIGITS:
            first = np.floor(np.log10(np.where(sizes > 0, sizes, 1.0)))
            relative = np.where(sizes > 0, 0.5 * 10.0 ** (first - digits + 1), 0.0)
        elif decimals:
            relative = np.zeros(column.shape)
        else:
            is_single = all_single or (singles[name] and len(np.unique(column)) >= _MANY)
            relative = (_SINGLE if is_single else _DOUBLE) * sizes
        return np.maximum(decimals, relative)

    return {name: rounding(name, column) for name, column in columns.items()}


def _is_single(values: Array) -> bool:
    """True if all values are of single precision, written in full, to a number of digits or to the fewest that do."""
    with np.errstate(over="ignore"):
        singles = values.astype(np.float32)
    digits = max(len(Decimal(repr(value)).normalize().as_tuple().digits) for value in values.tolist())
    for value, single in zip(values.tolist(), singles.tolist(), strict=True):
        if value != single and value not in {float(str(np.float32(single))), float(f"{single:.{digits}g}")}:
            return False
    return True


@dataclass(frozen=True)
class LayerCause:
    """Mistake that explains a layer.

    Attributes:
        id: its name.
        sentence: clause for a person.
        size: its size; None: it has none.
        after: residual with it.
        numbers: count of fitted numbers.
    """

    id: str
    sentence: str
    size: float | None
    after: float
    numbers: int = 0

    def with_rest(self, part: float) -> LayerCause:
        """The cause, which says which part of the difference it leaves."""
        rest = f"{self.sentence}; a cause is missing: {part:.2g} of the difference is left"
        return replace(self, sentence=rest)


@dataclass(frozen=True)
class Layer:
    """A layer of a record.

    Attributes:
        name: of :data:`~proofroll.robots.control.bookkeeping.mistakes.LAYERS`.
        residual: largest difference between the record and what the layers before give; None: not looked at.
        bar: residual that the rounding of the record explains.
        column: column with the largest difference in parts of its bar.
        time: of that difference [s].
        reason: reason why it was not looked at, or a remark.
        causes: mistakes that explain it, the best first.
        tried: number of mistakes that were tried, of those that are ``known``.
        undecided: True if it differs and the record does not tell whether that counts.
        noise: size of what hides it, white noise in parts of a column's range, or soft friction or rounding in parts
            of the largest forces; causes then are what it shows.
    """

    name: str
    residual: float | None = None
    bar: float = 0.0
    column: str = ""
    time: float = math.nan
    reason: str = ""
    causes: tuple[LayerCause, ...] = ()
    tried: int = 0
    known: int = 0
    undecided: bool = False
    noise: float = 0.0

    @property
    def holds(self) -> bool:
        """True if the layer was not looked at, or its residual is rounding."""
        return self.residual is None or self.residual <= self.bar
