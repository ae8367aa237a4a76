"""Growth of cost with the only parameter that a comparison varies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.report.labels import names

if TYPE_CHECKING:
    from proofroll.report.comparison.records import ReportedComparison
    from proofroll.report.page.records import ReportedTruth

# Least number of points for an exponent.
_FEWEST = 3


@dataclass(frozen=True)
class GrowthLine:
    """Cost of one setting (per simulated second) or of the truth (in total) at each value of the parameter.

    Attributes:
        name: of the setting, or words for the truth.
        seconds: cost at each value [s]; None: unknown.
        exponent, bar: of its growth, with error bar, or None.
    """

    name: str
    seconds: list[float | None]
    exponent: float | None
    bar: float | None


@dataclass(frozen=True)
class Growth:
    """Cost over the values of one parameter, of each setting and of the truth."""

    parameter: str
    values: list[float]
    lines: list[GrowthLine]


def growth(content: ReportedComparison, truths: Sequence[ReportedTruth]) -> Growth | None:
    """Cost of each setting and of the truth over a varied parameter, and the exponent of its growth.

    The exponent is the slope of the least-squares line through the logarithms of value and cost; its error bar is the
    slope's standard error. Only the larger half of the values is used, for at small values a constant part of the cost
    hides the growth.

    None unless exactly one parameter is varied, over enough positive values, and something was timed.
    """
    if len(content.vary) != 1 or content.points:
        return None
    ((parameter, values),) = content.vary.items()
    if len(values) < _FEWEST or min(values) <= 0:
        return None
    rows = dict(enumerate(names(content.rows)))
    spent: dict[str, dict[float, float]] = {name: {} for name in rows.values()}
    for run in content.runs:
        if run.seconds_per_second is not None:
            spent[rows[run.row]][run.parameters[parameter]] = run.seconds_per_second
    if not any(spent.values()):
        return None
    spent["the truth, first run, compilation included"] = {
        truth.parameters[parameter]: truth.wall_seconds for truth in truths if truth.wall_seconds
    }
    lines = []
    for name, costs in spent.items():
        exponent, bar = _slope(costs, values)
        seconds = [costs.get(value) for value in values]
        lines.append(GrowthLine(name, seconds, exponent, bar))
    return Growth(parameter, values, lines)


def _slope(costs: dict[float, float], values: list[float]) -> tuple[float | None, float | None]:
    """Exponent and its standard error over the larger half of the values, at least three; None: too few values."""
    used = [value for value in values if value in costs][-max(_FEWEST, (len(values) + 1) // 2) :]
    if len(used) < _FEWEST:
        return None, None
    line, covariance = np.polyfit(np.log(used), np.log([costs[value] for value in used]), 1, cov="unscaled")
    rest = np.log([costs[value] for value in used]) - np.polyval(line, np.log(used))
    variance = float(rest @ rest) / max(1, len(used) - 2)
    return float(line[0]), float(np.sqrt(variance * covariance[0, 0]))
