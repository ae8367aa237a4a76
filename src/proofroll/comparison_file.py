"""Reads ``comparisons/*.toml``: what is claimed about engines on a scene, with a reason for every tolerance."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from proofroll.agreement import Verdict
from proofroll.errors import InputError
from proofroll.folders import data_folder
from proofroll.metrics import OBSERVABLES
from proofroll.scene_file import first_problem, load_scene

_LADDER_RUNGS = 3


@dataclass(frozen=True)
class Tolerance:
    """How far an observable may be from the truth.

    Attributes:
        value: in the unit of the observable, or as a fraction of its scale.
        relative: whether it is a fraction.
    """

    value: float
    relative: bool

    def absolute(self, scale: float) -> float:
        """In the unit of the observable."""
        return self.value * scale if self.relative else self.value

    @classmethod
    def parse(cls, field_name: str, text: object) -> Tolerance:
        """Reads ``"6e-5 m"`` or ``"0.1 %"``.

        Raises:
            InputError: the text has another form.
        """
        number, _, unit = str(text).partition(" ")
        try:
            value = float(number)
        except ValueError:
            raise InputError(field_name, text, 'write a number and a unit, "6e-5 m", or "0.1 %" of the scale') from None
        if not (math.isfinite(value) and value > 0 and unit.strip()):
            raise InputError(field_name, text, 'write a positive number and a unit, "6e-5 m", or "0.1 %" of the scale')
        return cls(value / 100, True) if unit.strip() == "%" else cls(value, False)


@dataclass(frozen=True)
class Band:
    """A set of tolerances by observable, with the reason for them."""

    because: str
    bounds: dict[str, Tolerance]


@dataclass(frozen=True)
class Row:
    """One engine with settings, and what is expected of it.

    Attributes:
        engine: ``name[key=value,…]``.
        tolerance: name of a band of tolerances.
        expect: expected verdicts on the row as a whole, which is the worst of its observables.
        expect_for: observable -> expected verdicts on it alone.
        because: why something else than agreement is expected.
        ladder: factors on the step, coarse first; 1 is the run itself. [1]: no ladder, so no limit of small steps.
        only: parameter -> values for which this row is run (all if absent).
        order: observable -> lowest and highest order that is expected.
        limit: observable -> largest expected distance of the limit of small steps from the truth.
        bound: observable -> tolerance that replaces the band's.
    """

    engine: str
    tolerance: str
    expect: list[Verdict] = field(default_factory=lambda: [Verdict.AGREES])
    expect_for: dict[str, list[Verdict]] = field(default_factory=dict)
    because: str = ""
    ladder: list[float] = field(default_factory=lambda: [4.0, 2.0, 1.0])
    only: dict[str, list[float]] = field(default_factory=dict)
    order: dict[str, tuple[float, float]] = field(default_factory=dict)
    limit: dict[str, Tolerance] = field(default_factory=dict)
    bound: dict[str, Tolerance] = field(default_factory=dict)


@dataclass(frozen=True)
class Edge:
    """A value of a parameter at which the time of the first slip jumps, to be found between two others.

    Attributes:
        edge_between: the two values.
    """

    edge_between: tuple[float, float]


@dataclass(frozen=True)
class Axis:
    """Equally spaced values.

    Attributes:
        low, high: first and last.
        count: how many.
    """

    low: float
    high: float
    count: int


@dataclass(frozen=True)
class Regimes:
    """A map of what becomes of the ball.

    Attributes:
        speed, mu_static: the axes.
        rolling_resistance: f [m]; one map for each.
        until: length of each run [s].
    """

    speed: Axis
    mu_static: Axis
    rolling_resistance: list[float]
    until: float

    @property
    def count(self) -> int:
        """Number of runs of all maps."""
        return self.speed.count * self.mu_static.count * len(self.rolling_resistance)


@dataclass(frozen=True)
class Comparison:
    """A claim about engines on a scene.

    Attributes:
        name: of the file, without ending.
        title, question: for a person.
        scene: name of the scene.
        until, every: last time and sampling interval [s].
        vary: parameter -> values; every combination is run.
        points: further combinations, each with parameters of its own.
        bands: tolerances by name.
        rows: engines with settings.
        time_limit: wall seconds a case may take [s].
        regimes: a map that goes with the comparison, or None.
    """

    name: str
    title: str
    question: str
    scene: str
    until: float
    every: float
    vary: dict[str, list[float]] = field(default_factory=dict)
    points: list[dict[str, float | Edge]] = field(default_factory=list)
    bands: dict[str, Band] = field(default_factory=dict)
    rows: list[Row] = field(default_factory=list)
    time_limit: float = 120.0
    regimes: Regimes | None = None

    def combinations(self) -> list[dict[str, float | Edge]]:
        """Every combination of parameters."""
        found: list[dict[str, float | Edge]] = [*self.points]
        if self.vary:
            for values in itertools.product(*self.vary.values()):
                found.append(dict(zip(self.vary, values, strict=True)))
        return found

    def variations(self, row: Row) -> list[dict[str, float]]:
        """The combinations of parameters for which the row is run, once every edge has been found."""
        numbers = [{k: v for k, v in point.items() if isinstance(v, float)} for point in self.combinations()]
        return [point for point in numbers if all(point.get(key) in allowed for key, allowed in row.only.items())]


def comparison_names() -> list[str]:
    """Names of all comparisons, sorted."""
    return sorted(path.stem for path in data_folder("comparisons").glob("*.toml"))


def load_comparison(name: str) -> Comparison:
    """Reads a comparison.

    Args:
        name: path of a file, or name of one under ``comparisons/``, with or without ``.toml``.

    Raises:
        InputError: no such file, or it is broken.
    """
    path = next(
        (p for p in (Path(name), data_folder("comparisons") / f"{name}.toml", data_folder("comparisons") / name)
         if p.is_file()),
        None,
    )  # fmt: skip
    if path is None:
        raise InputError(
            "comparison", name, f"there is no such comparison; choose one of {', '.join(comparison_names())} or a file"
        )
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(str(path), "TOML", f"the file is broken: {error}") from None
    except OSError as error:
        raise InputError(str(path), "TOML", f"the file cannot be read: {error.strerror}") from None
    return _comparison(path, content)


def _comparison(path: Path, content: dict[str, Any]) -> Comparison:
    where = path.name
    tolerances = _table(f"{where}: tolerances", content.pop("tolerances", {}))
    bands = {name: _band(f"{where}: tolerances.{name}", table) for name, table in tolerances.items()}
    given = content.pop("rows", None)
    if not isinstance(given, list) or not given:
        raise InputError(f"{where}: rows", given, "give at least one engine; write [[rows]] before each")
    rows = [_prepared(f"{where}: rows.{index}", row) for index, row in enumerate(given)]
    try:
        comparison = TypeAdapter(Comparison).validate_python(
            {**content, "name": path.stem, "bands": bands, "rows": rows}
        )
    except ValidationError as error:
        raise first_problem(error, where) from None
    for name, band in comparison.bands.items():
        _check_observables(f"{where}: tolerances.{name}", comparison, band.bounds)
    for index, row in enumerate(comparison.rows):
        _check(f"{where}: rows.{index}", row, comparison)
    return comparison


def _table(where: str, value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(where, value, "this must be a table of names and values")
    return dict(value)


def _band(where: str, content: object) -> Band:
    table = _table(where, content)
    because = table.pop("because", "")
    if not because:
        raise InputError(f"{where}.because", "nothing", "every tolerance needs its reason; add it")
    return Band(because, {name: Tolerance.parse(f"{where}.{name}", text) for name, text in table.items()})


def _prepared(where: str, content: object) -> dict[str, Any]:
    """The row's table in the form that the typed check wants."""
    row = _table(where, content)
    for key in ("limit", "bound"):
        if key in row:
            bounds = _table(f"{where}.{key}", row[key])
            row[key] = {name: Tolerance.parse(f"{where}.{key}.{name}", text) for name, text in bounds.items()}
    if isinstance(row.get("expect"), str):
        row["expect"] = [row["expect"]]
    if "expect_for" in row:
        expected = _table(f"{where}.expect_for", row["expect_for"])
        row["expect_for"] = {k: [v] if isinstance(v, str) else v for k, v in expected.items()}
    return row


def _check(where: str, row: Row, comparison: Comparison) -> None:
    """What types cannot say."""
    if row.tolerance not in comparison.bands:
        raise InputError(f"{where}.tolerance", row.tolerance, f"choose one of {', '.join(comparison.bands)}")
    if row.ladder != [1.0]:
        _check_ladder(where, row.ladder)
    verdicts = {*row.expect, *itertools.chain.from_iterable(row.expect_for.values())}
    if verdicts - {Verdict.AGREES} and not row.because:
        raise InputError(f"{where}.because", "nothing", "an expectation other than agreement needs its reason; add it")
    _check_observables(where, comparison, [*row.expect_for, *row.order, *row.limit, *row.bound])
    given: dict[str, list[float]] = {}
    for point in comparison.combinations():
        for key, value in point.items():
            if isinstance(value, float):
                given.setdefault(key, []).append(value)
    for key, values in row.only.items():
        if key not in given:
            raise InputError(f"{where}.only", key, f"the comparison varies {', '.join(given)}")
        for value in values:
            if value not in given[key]:
                known = ", ".join(f"{item:g}" for item in dict.fromkeys(given[key]))
                raise InputError(f"{where}.only.{key}", value, f"the comparison has only {known}")


def _check_ladder(where: str, ladder: list[float]) -> None:
    falling = all(0 < finer < coarser < math.inf for coarser, finer in itertools.pairwise(ladder))
    if len(ladder) != _LADDER_RUNGS or not falling or 1.0 not in ladder:
        raise InputError(f"{where}.ladder", ladder, "give three positive factors, largest first, one of them 1; or [1]")
    if not math.isclose(ladder[0] / ladder[1], ladder[1] / ladder[2]):
        raise InputError(f"{where}.ladder", ladder, "neighbouring factors must have the same ratio")


def _check_observables(where: str, comparison: Comparison, names: Iterable[str]) -> None:
    known = (*load_scene(comparison.scene).rolling.surface.coordinates, *OBSERVABLES)
    for name in names:
        if name not in known:
            raise InputError(
                f"{where}: observable", name, f"there is no such observable; choose from {', '.join(known)}"
            )


for _typed in (Comparison, Row):
    setattr(_typed, "__pydantic_config__", ConfigDict(extra="forbid"))  # noqa: B010 -- the name is pydantic's, not the class's
