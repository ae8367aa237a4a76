"""Spread of the results where no motion is unique: the end of each run and the range of all, without a ranking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.number_format import counted, number
from proofroll.core.observable import Role
from proofroll.report.labels import unit

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.studies.comparison.outcome import ComparedPoint

# Clause on how such runs are judged.
ALONE = "judged by laws of mechanics alone, as there is no unique truth"
# Relative range below which a number counts as equal in all settings and is not listed.
ALIKE = 1e-6


@dataclass(frozen=True)
class SpreadLine:
    """A number at the end of the runs.

    Attributes:
        name: as a column of a CSV file: ``v_WB/rod/x``.
        unit: of all numbers.
        values: of each row; None: it has no result.
        low: least of them.
        high: largest of them.
        part: range relative to the largest number of the observable.
    """

    name: str
    unit: str
    values: list[float | None]
    low: float
    high: float
    part: float


@dataclass(frozen=True)
class Spread:
    """Ends of the runs, at ``time`` [s], at a point without a unique truth; ``because``: reason why there is none."""

    point: str
    because: str
    time: float
    lines: list[SpreadLine]

    @property
    def sentence(self) -> str:
        """Sentence on the number that spreads most."""
        place = f"At {self.point} there" if self.point else "There"
        head = f"{place} is no unique motion, so no setting is called the closest"
        if not self.lines:
            return f"{head}."
        widest = max(self.lines, key=lambda line: line.part)
        size = f"{number(widest.low)} to {number(widest.high)} {unit(widest.unit)}".rstrip()
        many = counted(sum(value is not None for value in widest.values), "settings")
        return f"{head}: at {number(self.time)} s the {many} spread most in {widest.name}, from {size}."


def spread_of(name: str, point: ComparedPoint, runs: Mapping[int, xr.Dataset], rows: int) -> Spread:
    """Spread at a point without a unique truth; ``runs`` by number of their row, ``rows``: count of rows."""
    from proofroll.files.csv_table import column_names  # imports xarray, which no other comparison needs by now

    assert point.reference is not None  # points without a truth have no judged laws
    truth, lines = point.reference.dataset, list[SpreadLine]()
    end = max((float(run["time"].to_numpy()[-1]) for run in runs.values()), default=0.0)
    whole = {row: run for row, run in runs.items() if run["time"].to_numpy()[-1] == end}
    for key, item in point.scene.observables.items():
        if item.role is not Role.MOTION or not (item.headline or item.watched) or key not in truth:
            continue
        last = {row: np.ravel(run[key].to_numpy()[-1]) for row, run in whole.items() if key in run}
        finite = {row: values for row, values in last.items() if np.all(np.isfinite(values))}
        size = max((float(np.max(np.abs(values))) for values in finite.values()), default=0.0)
        for index, column in enumerate(column_names(truth[key]) if size else ()):
            values = {row: float(numbers[index]) for row, numbers in finite.items()}
            low, high = min(values.values()), max(values.values())
            if high - low > ALIKE * size:
                shown = [values.get(row) for row in range(rows)]
                lines.append(
                    SpreadLine(name=column, unit=item.unit, values=shown, low=low, high=high, part=(high - low) / size)
                )
    return Spread(name, point.reference.ill_posed or point.reference.ended, end, lines)
