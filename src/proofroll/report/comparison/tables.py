"""Rows of the report's tables: verdicts, expectations, costs, tolerances, and evidence for each row."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from proofroll.core.certificate import Standing, not_reported
from proofroll.core.comparison import Row
from proofroll.core.number_format import number
from proofroll.core.verdict import Judgement
from proofroll.report.comparison.records import ReportedComparison, ReportedRow, ReportedRun
from proofroll.report.comparison.spread import Spread
from proofroll.report.labels import bound_words, names, symbol
from proofroll.running.timing import Interval


def observables(content: ReportedComparison) -> dict[str, str]:
    """Judged observables with their units; observables of the row that has most come first."""
    units: dict[str, str] = {}
    for row in sorted(content.rows, key=lambda row: -len(row.observables)):
        for name, judgement in row.observables.items():
            units.setdefault(name, judgement.unit)
    return units


@dataclass(frozen=True)
class Expectation:
    """Settings that share one expectation; ``further``: claims besides the verdict."""

    names: list[str]
    tolerance: str
    expected: str
    because: str
    further: tuple[str, ...]


def expectations(rows: Sequence[ReportedRow]) -> list[Expectation]:
    """Expectations, each with all settings that share it."""
    groups: dict[tuple[str, str, str, tuple[str, ...]], list[str]] = {}
    for name, row in zip(names(rows), rows, strict=True):
        claim = row.claim
        text = " or ".join(claim.expect)
        for observable, verdicts in claim.expect_for.items():
            text += f"; {symbol(observable)}: {' or '.join(verdicts)}"
        groups.setdefault((claim.tolerance, text, claim.because, tuple(_further(claim))), []).append(name)
    return [Expectation(settings, *shared) for shared, settings in groups.items()]


def _further(claim: Row) -> list[str]:
    """Claims of a row besides its verdict, as sentences without a full stop."""
    sentences = [f"{symbol(name)} within {bound_words(bound)}" for name, bound in claim.bound.items()]
    sentences += [f"order of {symbol(name)} {low:g} to {high:g}" for name, (low, high) in claim.order.items()]
    sentences += [f"limit of {symbol(name)} within {bound_words(bound)}" for name, bound in claim.limit.items()]
    sentences += [f"{' or '.join(item.expect)} at {_where(item.where)}" for item in claim.except_at]
    return [*sentences, f"run only at {_where(claim.only)}"] if claim.only else sentences


def _where(values: Mapping[str, Sequence[float]]) -> str:
    """Values of parameters: ``speed=2, mu_static=0.35 or 0.4``."""
    return ", ".join(f"{name}={' or '.join(number(v, 6) for v in numbers)}" for name, numbers in values.items())


def costs(content: ReportedComparison) -> list[tuple[str, ReportedRun, ReportedRun]]:
    """Name of each timed row with its slowest and its fastest case."""
    lines = []
    for name, _, runs in content.lines():
        timed = sorted((run.cost.value, index, run) for index, run in enumerate(runs) if run.cost)
        if timed:
            lines.append((name, timed[-1][-1], timed[0][-1]))
    return lines


def cost_interval(cost: Interval | None) -> str:
    """Interval of a cost, as ``0.011 to 0.013``; a dash where it was measured once or never."""
    return f"{number(cost.low)} to {number(cost.high)}" if cost and cost.confidence else "–"


def cost_title(run: ReportedRun) -> str:
    """Sentence that describes the cost of a run."""
    if not run.cost:
        return "not timed"
    if not run.cost.confidence:
        return "one clean run, so no interval is known"
    percent = f"{100 * run.cost.confidence:.3g} %"
    return f"median of {len(run.timings)} clean runs; {cost_interval(run.cost)} s/s holds it with {percent}"


def reasons(certificate: Iterable[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Reasons for quantities of a certificate to differ by more than round-off: reason -> quantities."""
    quantities: dict[str, list[str]] = {}
    for line in certificate:
        if line["because"]:
            quantities.setdefault(line["because"], []).append(line["quantity"])
    return quantities


@dataclass(frozen=True)
class Belief:
    """Evidence from a row's certificates: lines that hold, all lines, and the largest difference over its allowance.

    ``largest``: certificate line with the largest difference relative to what it may be, its ``point`` empty for the
    scene as it is; None: no line has a finite one.
    ``soft``: quantities that may differ, for a reason; ``silent``: quantities that the engine does not report;
    ``audit``: worst judgement of the audit of reactions.
    """

    name: str
    held: int
    total: int
    largest: Mapping[str, Any] | None
    soft: list[str]
    silent: list[str]
    audit: Judgement | None


def belief(content: ReportedComparison) -> list[Belief]:
    """Evidence for each row: its certificates and its audit of reactions, the worst over all points."""
    lines = []
    audits = [name for name, item in content.observables.items() if item.audit]
    for name, row, runs in content.lines():
        lines_of_all = [{**line, "point": run.point} for run in runs for line in run.certificate]
        certificate = [line for line in lines_of_all if line["standing"] != Standing.NOT_REPORTED]
        finite = [line for line in certificate if line["difference"] is not None and math.isfinite(line["difference"])]
        lines.append(
            Belief(
                name=name,
                held=sum(bool(line["holds"]) for line in certificate),
                total=len(certificate),
                largest=max(finite, key=_part_taken, default=None),
                soft=list(dict.fromkeys(line["quantity"] for line in certificate if line["because"])),
                silent=list(dict.fromkeys(not_reported(lines_of_all))),
                audit=next((row.observables[item] for item in audits if item in row.observables), None),
            )
        )
    return lines


def _part_taken(line: Mapping[str, Any]) -> float:
    """Part of its allowance that a certificate line takes; infinite for a difference where none is allowed."""
    difference, allowed = abs(line["difference"]), line["tolerance"]
    return difference / allowed if allowed else math.inf if difference else 0.0


def with_results(content: ReportedComparison, spread: Spread) -> list[tuple[int, str]]:
    """Number and name of each row that has numbers in a spread."""
    rows = {row for line in spread.lines for row, value in enumerate(line.values) if value is not None}
    return [(row, name) for row, name in enumerate(names(content.rows)) if row in rows]
