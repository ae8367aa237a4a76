"""A claim about engines on a scene: the runs, the compared observables, their tolerances and the expected verdicts."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from proofroll.core.errors import InputError
from proofroll.core.limits import TIME_LIMIT
from proofroll.core.verdict import Verdict

# SI prefixes before the unit of a tolerance; the second µ is the Greek letter.
_PREFIXES = {"k": 1e3, "m": 1e-3, "µ": 1e-6, "\u03bc": 1e-6, "u": 1e-6, "n": 1e-9}


@dataclass(frozen=True)
class Tolerance:
    """Largest allowed distance of an observable from the truth.

    Attributes:
        value: in the unit of the observable, or as a fraction of its scale.
        relative: True if the value is a fraction.
        unit: as it is written; ``%`` for a fraction.
    """

    value: float
    relative: bool
    unit: str = "%"

    def absolute(self, scale: float) -> float:
        """Tolerance in the unit of the observable."""
        return self.value * scale if self.relative else self.value

    @classmethod
    def of_quantity(cls, field_name: str, text: object, unit: str) -> Tolerance:
        """Reads ``1e-3``, ``1e-3 m``, ``1 mm`` or ``1 %`` for a quantity in this unit.

        Raises:
            InputError: another form or unit.
        """
        return cls.parse(field_name, text, unit).in_unit(field_name, unit)

    @classmethod
    def parse(cls, field_name: str, text: object, unit: str = "") -> Tolerance:
        """Reads ``6e-5 m``, ``1 mm`` or ``0.1 %``, in the unit that is written; a number alone has the given unit.

        Raises:
            InputError: another form, or no unit at all.
        """
        match = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*?)\s*", str(text))
        written = (match[2] or unit) if match else ""
        try:
            value = float(match[1]) if match and written else math.nan
        except ValueError:
            value = math.nan
        if not 0 < value < math.inf:
            advice = f"write a positive number and a unit: 1e-3 {unit or 'm'}, or 1 % of the scale"
            raise InputError(field_name, text, advice)
        return cls(value / 100, True) if written == "%" else cls(value, False, written)

    def in_unit(self, field_name: str, unit: str) -> Tolerance:
        """The same in a unit from which its own differs by a prefix at most: ``1 mm`` in m.

        Raises:
            InputError: another unit.
        """
        if self.relative or self.unit == unit:
            return self
        if self.unit[1:] != unit or self.unit[0] not in _PREFIXES:
            raise InputError(field_name, f"{self.value:g} {self.unit}", f"its unit is {unit}")
        return Tolerance(self.value * _PREFIXES[self.unit[0]], False, unit)


@dataclass(frozen=True)
class Band:
    """A set of tolerances by observable, with the reason for them."""

    because: str
    bounds: dict[str, Tolerance]


@dataclass(frozen=True)
class ExceptAt:
    """Points of the parameters at which a row has other expected verdicts.

    Attributes:
        where: parameter -> values; a point matches if it has one of the values of each parameter.
        expect: expected verdicts there.
    """

    where: dict[str, list[float]]
    expect: list[Verdict]


@dataclass(frozen=True)
class Row:
    """One engine with settings, and what is expected of it.

    Attributes:
        engine: ``name[key=value,…]``.
        tolerance: name of a band of tolerances.
        expect: expected verdicts on the row as a whole, which is the worst of its observables.
        except_at: points at which something else is expected; the first that fits counts.
        expect_for: observable -> expected verdicts on it alone.
        because: reason for another expectation than agreement.
        ladder: factors on the step, coarse first; 1 is the run itself. [1]: no ladder, so no limit of small steps.
            The usual one is [2, 1, 0.5] or [1, 0.5, 0.25] where its steps do not divide `every`.
        only: parameter -> values for which this row is run (all if absent); no values: points that do not give it.
        order: observable -> lowest and highest order that is expected.
        limit: observable -> largest expected distance of the limit of small steps from the truth.
        bound: observable -> tolerance that replaces the band's.
        short: why it does not hold a tolerance, or what it is, for the first screen: a clause of at most twelve words,
            or empty.
    """

    engine: str
    tolerance: str
    expect: list[Verdict] = field(default_factory=lambda: [Verdict.AGREES])
    except_at: list[ExceptAt] = field(default_factory=list)
    expect_for: dict[str, list[Verdict]] = field(default_factory=dict)
    because: str = ""
    ladder: list[float] = field(default_factory=lambda: [4.0, 2.0, 1.0])
    only: dict[str, list[float]] = field(default_factory=dict)
    order: dict[str, tuple[float, float]] = field(default_factory=dict)
    limit: dict[str, Tolerance] = field(default_factory=dict)
    bound: dict[str, Tolerance] = field(default_factory=dict)
    short: str = ""

    def expected(self, point: dict[str, float]) -> list[Verdict]:
        """Expected verdicts at a point of the parameters."""
        for exception in self.except_at:
            if _fits(point, exception.where):
                return exception.expect
        return self.expect


@dataclass(frozen=True)
class Edge:
    """Parameter value at which the time of an event jumps, to be searched for between two other values.

    Attributes:
        edge_between: the two values.
    """

    edge_between: tuple[float, float]


@dataclass(frozen=True)
class Comparison:
    """A claim about engines on a scene.

    Attributes:
        name: of the file, without ending.
        title: subject, in one line.
        question: question that the comparison answers.
        scene: name of the scene, or path of its folder.
        until: last time [s].
        every: sampling interval [s].
        vary: parameter -> values; every combination is run.
        points: further combinations, each with parameters of its own.
        bands: tolerances by name.
        rows: engines with settings.
        time_limit: wall seconds a case may take [s].
        timed: True if the speed of every run is measured, in clean runs of its own.
        order: rank in a report, the smallest first; those without come last, by name.
        brief: parameter -> values; a report without names has only the combinations that have one of them for each.
        asked: name or path by which a command finds the file; empty: there is none.
        left_out: number of combinations left out of a report without names.
        budget: processor time that all cases may take together [s]; cases beyond it are left out; None: no limit.
        cut: True if the budget suffices for a shorter time than was asked for.
        spent: part of the budget that was spent on asking the engines [s].
        unfit: installed engine without a row in a comparison of all engines -> why.
        absent: engine that is not installed, so has no row in a comparison of all engines -> why, and how to get it.
    """

    name: str
    title: str
    question: str
    scene: str
    until: float
    every: float
    vary: dict[str, list[float]] = field(default_factory=dict)
    points: list[dict[str, float | Edge]] = field(default_factory=list)
    bands: dict[str, Band] = field(default_factory=dict, metadata={"key": "tolerances"})
    rows: list[Row] = field(default_factory=list)
    time_limit: float = TIME_LIMIT
    timed: bool = True
    order: float = math.inf
    brief: dict[str, list[float]] = field(default_factory=dict)
    asked: str = ""
    left_out: int = 0
    budget: float | None = None
    cut: bool = False
    spent: float = 0.0
    absent: dict[str, str] = field(default_factory=dict)
    unfit: dict[str, str] = field(default_factory=dict)

    def briefly(self) -> Comparison:
        """The comparison reduced to its ``brief`` combinations."""
        vary = {name: [value for value in values if value in self.brief.get(name, values)]
                for name, values in self.vary.items()}  # fmt: skip
        kept = replace(self, vary=vary, points=[point for point in self.points if _fits(point, self.brief)])
        return replace(kept, left_out=len(self.combinations()) - len(kept.combinations()))

    def at(self, points: list[dict[str, float | Edge]]) -> Comparison:
        """The comparison with only the given combinations."""
        left_out = len(self.combinations()) - len(points)
        return replace(self, vary={}, points=points, left_out=left_out) if left_out else self

    def combinations(self, only: Mapping[str, list[float]] | None = None) -> list[dict[str, float | Edge]]:
        """All combinations of parameter values, or those that fit ``only``; one empty combination if nothing varies."""
        points: list[dict[str, float | Edge]] = [*self.points]
        if self.vary or not points:
            for values in itertools.product(*self.vary.values()):
                points.append(dict(zip(self.vary, values, strict=True)))
        return [point for point in points if _fits(point, only or {})]

    def variations(self, row: Row) -> list[dict[str, float]]:
        """The combinations of parameters for which the row is run, once every edge has been found."""
        points = self.combinations(row.only)
        return [{key: value for key, value in point.items() if isinstance(value, float)} for point in points]


def _fits(point: Mapping[str, object], allowed: Mapping[str, list[float]]) -> bool:
    return all(point.get(key) in values if values else key not in point for key, values in allowed.items())
