"""Records of a comparison in a report: the only content that the HTML page and the terminal show."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from proofroll.core.comparison import Band, Row
from proofroll.core.diagnosis.scene_diagnosis import Diagnosis
from proofroll.core.number_format import counted
from proofroll.core.observable import Role
from proofroll.core.verdict import Judgement, Verdict
from proofroll.files.json_data import MERGED
from proofroll.report.comparison.distances import Distances
from proofroll.report.comparison.spread import Spread
from proofroll.report.labels import names
from proofroll.report.pages import section_id, slug
from proofroll.running.case import Result, Status
from proofroll.running.timing import Interval, Timing

if TYPE_CHECKING:
    from proofroll.report.page.records import ComparisonEvidence


def clean_cost(result: Result) -> Interval | None:
    """Wall seconds per simulated second over clean runs, with their interval [s/s]; None without such runs."""
    return Timing(tuple(result.timings)).interval if result.timings else None


def rough_cost(result: Result, until: float) -> float | None:
    """Seconds of computing per simulated second of a sampled run, which other processes disturbed; None: unknown.

    While others have the processor wall time passes and processor time does not; of several threads it is the longer.
    """
    spent = min(result.wall_seconds, result.processor.get("advance") or math.inf)
    return spent / until if result.status == Status.DONE and not result.host and spent else None


class CoarserSteps(StrEnum):
    """Result of the steps of a ladder that are coarser than the run's own, from the least to the most telling."""

    NOT_RUN = "not run"
    HELD = "held"  # all of them hold all tolerances
    FAILED = "failed"


@dataclass(frozen=True, kw_only=True)
class Setting:
    """An engine with settings: ``engine`` as the comparison file writes it, other fields for readers.

    ``witness``: True if the engine only cross-checks the truth.
    """

    engine: str
    name: str
    formulation: str | None
    preset: str | None
    setting: str
    resolution: str | None
    resolution_value: float | None
    declared_order: int | None
    caveat: str
    family: str
    precision: str
    scheme: str
    witness: bool


@dataclass(frozen=True, kw_only=True)
class WorstJudgement(Judgement):
    """Judgement with the worst verdict over all points; of equal verdicts the one furthest beyond its tolerance.

    Attributes:
        point: the point at which it was judged.
        largest: largest error of all points; as tolerances may differ, it may belong to another point.
    """

    point: str
    largest: float


@dataclass(frozen=True, kw_only=True)
class ReportedRow(Setting):
    """Summary of a row over the points of the parameters: the worst of everything.

    ``claim`` is what is expected; ``worst`` names the quantity with the worst verdict, of equal ones the one nearest to
    its limit or furthest beyond it, empty where none was judged.
    """

    verdict: Verdict
    verdicts: dict[str, int]
    reason: str
    limit: str
    shared: str
    missing: list[str]
    remarks: list[str]
    diagnosis: list[Diagnosis]
    claim: Row
    as_expected: bool
    observables: dict[str, WorstJudgement]
    worst: str
    seconds_per_second: float | None
    rough_cost: float | None
    message: str
    coarser: CoarserSteps


@dataclass(frozen=True, kw_only=True)
class ReportedRun(Setting):
    """Record of one run; ``row``: number of its row; ``own``: record that its kind of element adds."""

    row: int
    settings: dict[str, Any]
    point: str
    parameters: dict[str, float]
    status: Status
    message: str
    verdict: Verdict
    reason: str
    limit: str
    contradictions: list[str]
    missing: list[str]
    shared: str
    diagnosis: list[Diagnosis]
    judgements: list[Judgement]
    certificate: list[dict[str, Any]]
    seconds_per_second: float | None
    rough_cost: float | None
    build_seconds: float | None
    timings: list[float]
    cost: Interval | None
    versions: dict[str, str]
    trajectory: str | None
    host: str
    coarser: CoarserSteps
    own: Any = field(default=None, metadata=MERGED)


@dataclass(frozen=True)
class ShownObservable:
    """An observable of the scene, with the words that a reader sees."""

    unit: str
    symbol: str
    role: str
    headline: bool
    audit: bool


@dataclass(frozen=True, kw_only=True)
class ReportedComparison:
    """Content of a comparison: ``rows`` summarise each engine with settings, ``runs`` have all details of each run.

    Attributes:
        asked: name or path by which a command finds its file; empty: it has none.
        group: of its scene (:func:`proofroll.report.kinds.group_of`).
        shown_by: name of the kind of element that adds to its report.
        requires: capabilities that its scene requires of a formulation, sorted.
        spread: of the points where only laws of mechanics are judged.
        distances: of the points whose truth is a reference by steps.
        step_bound: clause on the longest stable step and on those of the rows; empty: nothing bounds it.
        omitted: clauses on what the scene's file describes and the comparison leaves out.
        unjudged: reactions that a comparison without a file does not judge.
        unfit: installed engine without a row -> why.
    """

    name: str
    asked: str
    title: str
    question: str
    scene: str
    group: str
    shown_by: str
    requires: list[str]
    observables: dict[str, ShownObservable]
    until: float
    every: float
    vary: dict[str, list[float]]
    points: list[Any]
    left_out: int
    as_expected: bool
    contradictions: list[str]
    tolerances: dict[str, Band]
    rows: list[ReportedRow]
    runs: list[ReportedRun]
    hosts: dict[str, int]
    budget: float | None = None
    beyond_budget: list[str] = field(default_factory=list)
    truth_ends: list[str] = field(default_factory=list)
    spread: list[Spread] = field(default_factory=list)
    distances: list[Distances] = field(default_factory=list)
    step_bound: str = ""
    omitted: list[str] = field(default_factory=list)
    unjudged: list[str] = field(default_factory=list)
    unfit: dict[str, str] = field(default_factory=dict)
    evidence: ComparisonEvidence | None = field(default=None, metadata=MERGED)

    @property
    def claims(self) -> bool:
        """False if every verdict is expected of every row, as in the default comparison of a scene."""
        return any(len(row.claim.expect) < len(Verdict) for row in self.rows)

    @property
    def section(self) -> str:
        """HTML id of its evidence in a page."""
        return section_id("evidence", self.name)

    def is_residual(self, observable: str) -> bool:
        """True if an observable is a residual, and not all that is judged are."""
        return not self.laws_alone and self.observables[observable].role == Role.RESIDUAL

    def point_id(self, point: str) -> str:
        """HTML id of the evidence at a point."""
        return f"{self.section}.at-{slug(point)}"

    def run_id(self, row: int, point: str) -> str:
        """HTML id of the evidence of a row at a point: it stays where other rows and points are left out."""
        engine = self.rows[row].engine
        again = [item.engine for item in self.rows[:row]].count(engine)
        words = slug(engine) + (f"-{again + 1}" if again else "")
        return ".".join(filter(None, (self.section, words, slug(point))))

    @property
    def unreached(self) -> str:
        """Sentence shown instead of rows if processor time did not suffice for the truth; else empty."""
        lacking = any(name.startswith("the truth") for name in self.beyond_budget)
        if not lacking or any(row.verdict != Verdict.NOT_JUDGED for row in self.rows):
            return ""
        many = counted(len(self.rows), "settings")
        return f"Not judged: the processor time did not suffice for the truth: {many}."

    @property
    def laws_alone(self) -> bool:
        """True if at every point only laws of mechanics are judged, for no motion is unique."""
        return bool(self.spread) and {run.point for run in self.runs} == {item.point for item in self.spread}

    def runs_of(self, row: int) -> list[ReportedRun]:
        """Runs of one row."""
        return [run for run in self.runs if run.row == row]

    def lines(self) -> Iterator[tuple[str, ReportedRow, list[ReportedRun]]]:
        """Rows with a unique short name each and their runs."""
        for index, (name, row) in enumerate(zip(names(self.rows), self.rows, strict=True)):
            yield name, row, self.runs_of(index)

    def headlines(self, role: str) -> list[str]:
        """Names of the observables of a role (:class:`proofroll.core.observable.Role`) that summaries show."""
        return [name for name, item in self.observables.items() if item.role == role and item.headline]
