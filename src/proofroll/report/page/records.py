"""Records of a report: truths, evidence of comparisons, and the whole content."""

from __future__ import annotations

import dataclasses
import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from typing import Any

import proofroll
from proofroll.core.dataset import LAWS
from proofroll.files.json_data import MERGED, OPTIONAL
from proofroll.report.changes import Against
from proofroll.report.comparison.conclusions import Conclusions, conclusions
from proofroll.report.comparison.growth import Growth, growth
from proofroll.report.comparison.lines import lines_of
from proofroll.report.comparison.records import ReportedComparison
from proofroll.report.comparison.summary import outcome_content
from proofroll.report.kinds import kind_of
from proofroll.report.long_table import LongTable
from proofroll.report.page.first_screen import ReportedAnswer
from proofroll.report.page.first_sentences import Kept, kept, three_sentences
from proofroll.report.page.scene_sheet import SceneSheet, sheet_of
from proofroll.report.parts import PartEntry, part_kinds
from proofroll.running.environments import shown_name
from proofroll.running.timing import machine
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.findings import load_findings


@dataclass(frozen=True)
class ErrorBar:
    """Error bar of a quantity of the truth, in its unit."""

    value: float
    unit: str


@dataclass(frozen=True)
class ReportedTruth:
    """Routes and error bars of the truth at a point; ``own``: facts from the kind of element.

    ``laws``: outcome of its law check, None without one; ``route``, ``second_route`` and ``error_bars`` are None if
    there is no truth.
    """

    point: str
    parameters: dict[str, float]
    trajectory: str
    wall_seconds: float | None
    route: str | None = field(default=None, metadata=OPTIONAL)
    second_route: str | None = field(default=None, metadata=OPTIONAL)
    laws: str | None = field(default=None, metadata=OPTIONAL)
    error_bars: dict[str, ErrorBar] | None = field(default=None, metadata=OPTIONAL)
    own: Any = field(default=None, metadata=MERGED)


@dataclass(frozen=True)
class ComparisonEvidence:
    """Evidence of a comparison besides its verdicts: truths, sheet of the scene, conclusions, growth of cost."""

    truths: list[ReportedTruth]
    sheet: SceneSheet
    findings: Conclusions
    growth: Growth | None


@dataclass(frozen=True)
class MadeWith:
    """Command, machine and versions that made a report."""

    command: str
    machine: str
    versions: dict[str, str]


@dataclass(frozen=True)
class KnownFinding:
    """Known finding about an engine."""

    name: str
    engine: str
    title: str
    seen: str
    gone: str


# Of report.json: 2 has no lines of records in its table; 3 has what a file claims, costs and causes in its own
# words; 4 has answers from searches; 5 has no trade-offs.
FORMAT = 5


@dataclass(frozen=True)
class ReportContent:
    """Content of a report.

    Attributes:
        format: version of the structure of ``report.json``.
        date: of its writing.
        comparisons: in their order.
        awaited: titles of comparisons that are still being run.
        left_out: names of the comparisons that a report of all studies leaves out.
        engine_findings: known faults and surprises of engines.
        entries: of further studies, by the key of their kind.
        names: code name of each engine -> its name for readers.
        provides: engine -> formulation -> capabilities.
        environment: command, machine and versions that made it.
        findings: three sentences on the whole report.
        table: every quantity of every run.
        answers: cheapest engine of each scene that holds a tolerance, from a search; by tolerance, then by scene.
        against: changes since an earlier report.
        replay: its cases without their numbers, which can be computed from the named trajectories.
    """

    date: str
    comparisons: list[ReportedComparison]
    awaited: list[str]
    left_out: list[str]
    engine_findings: list[KnownFinding]
    entries: Mapping[str, Sequence[PartEntry]] = field(metadata=MERGED)
    names: dict[str, str]
    provides: dict[str, dict[str, list[str]]]
    environment: MadeWith
    findings: list[str]
    table: LongTable
    format: int = FORMAT
    replay: Sequence[Any] | None = field(default=None, metadata=OPTIONAL)
    answers: list[ReportedAnswer] = field(default_factory=list)
    against: Against | None = field(default=None, metadata=OPTIONAL)

    @cached_property
    def witnesses(self) -> set[str]:
        """Names of the engines that only cross-check the truth."""
        return {row.name for comparison in self.comparisons for row in comparison.rows if row.witness}

    @cached_property
    def engines(self) -> list[str]:
        """Names of the engines in the page's order: those that may be taken, then witnesses."""
        compared = {row.name for comparison in self.comparisons for row in comparison.rows}
        searched = {engine.engine for item in self.answers for engine in item.answer.engines}
        return sorted(compared | searched, key=lambda name: (name in self.witnesses, name))

    @property
    def further(self) -> list[PartEntry]:
        """Entries of all further studies."""
        return [item for kind in part_kinds() for item in self.entries.get(kind.key, ())]

    @property
    def summarised(self) -> ReportContent:
        """Content with its three sentences made anew."""
        return dataclasses.replace(self, findings=three_sentences(self.comparisons, self.entries, self.answers))

    @property
    def sheets(self) -> dict[str, SceneSheet]:
        """Sheet of each scene by its name."""
        return {item.scene: item.evidence.sheet for item in reversed(self.comparisons) if item.evidence is not None}

    def kept(self, group: str = "") -> Kept:
        """Facts of all scenes, or of a group's: agreement, silent errors, limits passed, statements that hold."""
        comparisons = [item for item in self.comparisons if group in {"", item.group}]
        scenes = {item.scene for item in comparisons}
        entries = {
            key: [item for item in items if not group or item.scene in scenes] for key, items in self.entries.items()
        }
        return kept(comparisons, entries)

    @property
    def beyond_budget(self) -> str:
        """Sentence on the cases that a budget of processor time did not suffice for; empty if there are none."""
        left = sum(len(item.beyond_budget) for item in self.comparisons)
        nothing = all(item.unreached for item in self.comparisons)  # so that a repeated command might not get on
        next_step = "Too little for any truth: give more" if nothing else "The same command goes on with them"
        return f"Runs left out for lack of processor time: {left}. {next_step}." if left else ""

    @property
    def omission_sentences(self) -> str:
        """Sentences on the comparisons that a report of all studies leaves out; empty if there are none."""
        if not self.left_out:
            return ""
        folders = Counter(name.partition("/")[0] for name in self.left_out)
        many = f"{len(self.left_out)} ({', '.join(f'{folder} {count}' for folder, count in folders.items())})"
        ways = f"--only loops,contact those of some kinds of scenes; proofroll report {self.left_out[0]} one"
        return f"Comparisons left out: {many}. proofroll report --budget 3600 runs all, each briefly first; {ways}."


def report_content(outcomes: list[Outcome], command: str) -> ReportContent:
    """Content of a report of comparisons; paths of files are relative to its folder."""
    lines = [line for outcome in outcomes for line in lines_of(outcome)]
    asked = [run.facts for outcome in outcomes for run in outcome.runs if run.facts is not None]
    names = {item.name.partition("@")[0]: item.title or item.name for item in asked}
    comparisons = [_comparison(outcome) for outcome in outcomes]
    facts = machine()
    versions = {"proofroll": proofroll.__version__, "python": platform.python_version()}
    for run in (run for outcome in outcomes for run in outcome.runs):
        versions |= run.result.versions
    entries: dict[str, list[PartEntry]] = {kind.key: [] for kind in part_kinds()}
    provides = {shown_name(item.name): item.provides for item in asked if item.provides}
    content = ReportContent(
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        comparisons=comparisons,
        awaited=[],
        left_out=[],
        engine_findings=[
            KnownFinding(name=item.name, engine=item.engine, title=item.title, seen=item.seen, gone=item.gone)
            for item in load_findings()
        ],
        entries=entries,
        names=names,
        provides=provides,
        environment=MadeWith(command, f"{facts['system']}, {facts['processor']}", versions),
        findings=[],
        table=LongTable(lines),
    )
    return content.summarised


def _comparison(outcome: Outcome) -> ReportedComparison:
    """Content of a comparison with its evidence: truths, facts from the kind of element, conclusions, costs."""
    content, truths = outcome_content(outcome), _truths(outcome)
    kind = kind_of(outcome.scene)
    facts = kind.run_facts(truths, outcome.runs) if kind is not None else [None] * len(outcome.runs)
    runs = [
        dataclasses.replace(run, trajectory=made.trajectory.shown if made.trajectory else None, own=fact)
        for run, made, fact in zip(content.runs, outcome.runs, facts, strict=True)
    ]
    content = dataclasses.replace(content, runs=runs)
    points = outcome.points.values()
    sheet = sheet_of(outcome.file, [item.case.parameters for item in points], [item.scene for item in points])
    evidence = ComparisonEvidence(truths, sheet, conclusions(content, truths, kind), growth(content, truths))
    return dataclasses.replace(content, evidence=evidence)


def _truths(outcome: Outcome) -> list[ReportedTruth]:
    """Routes and error bars of the truth at each point."""
    truths = []
    for name, point in outcome.points.items():
        entry = ReportedTruth(name, point.case.parameters, point.trajectory.shown, point.result.wall_seconds)
        if point.reference is not None:
            dataset, scene = point.reference.dataset, point.scene
            observables, kind = scene.observables, kind_of(scene)
            entry = dataclasses.replace(
                entry,
                route=dataset.attrs.get("route", ""),
                second_route=dataset.attrs.get("second_route", ""),
                laws=dataset.attrs.get(LAWS),
                error_bars={
                    str(key): ErrorBar(float(curve.attrs["error_bar"]), curve.attrs["units"])
                    for key, curve in dataset.data_vars.items()
                    if (curve.dims == ("time",) or key in observables) and "error_bar" in curve.attrs
                },
                own=kind.truth_facts(scene, dataset) if kind is not None else None,
            )
        truths.append(entry)
    return truths
