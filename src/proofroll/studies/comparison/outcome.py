"""Outcome of a comparison: runs with their judgements."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby

from proofroll.core.comparison import Comparison, Row
from proofroll.core.diagnosis.scene_diagnosis import Diagnosis
from proofroll.core.number_format import number, spaced
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.verdict import SEVERITY, Judgement, Verdict
from proofroll.files.scene_file import SceneFile
from proofroll.files.trajectory_file import StoredTrajectory
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.studies.comparison.planning import point_name
from proofroll.studies.judging.reference import Reference
from proofroll.studies.result_table import gauge, html_table, text_table

# Verdict on runs that were not made for a good reason, or cannot be judged; all others that are not done failed.
_UNJUDGED = {
    Status.REFUSED: Verdict.REFUSED,
    Status.ANOTHER_SCENE: Verdict.ANOTHER_SCENE,
    Status.NO_TRUTH: Verdict.NOT_JUDGED,
    Status.LEFT_OUT: Verdict.NOT_JUDGED,
}

_COLUMNS = ("", "verdict", "furthest", "off by", "allowed", "s/s", "why")
_BROKEN = frozenset({Status.MISSING, Status.CRASHED, Status.TIMEOUT})


def worst(judgements: Sequence[Judgement], missing: Collection[str] = ()) -> Verdict:
    """Worst verdict of the observables, missing ones included; failed if there is no judgement."""
    verdicts = [judgement.verdict for judgement in judgements]
    return max(
        [*verdicts, *([Verdict.INCOMPLETE] if verdicts and missing else [])], key=SEVERITY.index, default=Verdict.FAILED
    )


@dataclass(frozen=True)
class ComparedPoint:
    """One point of the parameters: the scene there and its truth, loaded once for all reports.

    Attributes:
        scene: with the parameters of the point.
        case: of the truth.
        result: of the truth.
        trajectory: of the truth.
    """

    scene: Scene
    case: Case
    result: Result
    trajectory: StoredTrajectory

    @cached_property
    def reference(self) -> Reference | None:
        """The truth, read at the first access; None: there is none."""
        return Reference.of(self.scene, self.trajectory.dataset) if self.trajectory.file.is_file() else None


@dataclass(frozen=True)
class LadderRun:
    """A further run of a row's ladder, with another step or tolerance.

    Attributes:
        value: of the step [s] or tolerance.
        result: of the run.
        errors: observable -> largest distance from the truth, samples off the grid included; empty without a
            trajectory.
    """

    value: float
    result: Result
    errors: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Run:
    """One row of the comparison at one point of its parameters.

    Attributes:
        row: the claim.
        parameters: the point.
        facts: the engine with complete settings, or None if it could not be asked.
        result: of the run itself.
        judgements: one per observable; empty if there is no trajectory or no truth, and for another scene.
        contradictions: sentences about unexpected results.
        case: the run's case, or None.
        missing: observables that the claim's tolerances judge and the run does not report.
        shared: clause that names the route of the truth with the same equations; empty: there is none.
        diagnosis: proven causes of a difference.
        rungs: the other runs of its ladder.
        trajectory: of the run, read at the first access; None: there is none.
    """

    row: Row
    parameters: dict[str, float]
    facts: EngineFacts | None
    result: Result
    judgements: list[Judgement] = field(default_factory=list)
    contradictions: list[str] = field(default_factory=list)
    case: Case | None = None
    missing: list[str] = field(default_factory=list)
    shared: str = ""
    diagnosis: list[Diagnosis] = field(default_factory=list)
    rungs: list[LadderRun] = field(default_factory=list)
    trajectory: StoredTrajectory | None = None

    @property
    def verdict(self) -> Verdict:
        """Worst verdict of the observables; incomplete if all reported ones agree but some are missing."""
        if self.result.status != Status.DONE:
            return _UNJUDGED.get(self.result.status, Verdict.FAILED)
        return worst(self.judgements, self.missing)


@dataclass(frozen=True, repr=False)
class Outcome:
    """Outcome of a comparison.

    Attributes:
        comparison: the comparison that was run.
        scene: with its default parameters.
        file: of the scene, for its texts.
        runs: with their judgements, row by row.
        points: by :func:`proofroll.studies.comparison.planning.point_name`.
        beyond_budget: texts of the cases that were left out for lack of processor time.
    """

    comparison: Comparison
    scene: Scene
    file: SceneFile
    runs: list[Run]
    points: dict[str, ComparedPoint]
    beyond_budget: list[str] = field(default_factory=list)

    @cached_property
    def rows(self) -> list[list[Run]]:
        """Runs of each row of the comparison file, in the file's order."""
        return [list(of_row) for _, of_row in groupby(self.runs, key=lambda run: id(run.row))]

    @property
    def contradictions(self) -> list[str]:
        """Unexpected results of the comparison, as sentences."""
        return [sentence for run in self.runs for sentence in run.contradictions]

    @cached_property
    def laws_alone(self) -> list[str]:
        """Names of points without a unique motion, where only residuals (laws of mechanics) are judged."""
        names = []
        for name, point in self.points.items():
            runs = [run for run in self.runs if point_name(run.parameters) == name]
            judged = {item.observable for run in runs for item in run.judgements}
            roles = {point.scene.observables[key].role for key in judged}
            if roles == {Role.RESIDUAL} and (of := point.reference) is not None and (of.ill_posed or of.ended):
                names.append(name)
        return names

    @property
    def no_contact(self) -> str:
        """Sentence on a time that the budget cut before anything touches; empty: something does, or nothing was cut."""
        references = [point.reference for point in self.points.values()]
        if not self.comparison.cut or not any(item is not None and item.untouched for item in references):
            return ""
        enough = f"the budget suffices for {self.comparison.until:g} s, in which nothing touches"
        return f"No contact was reached: {enough}; give a larger --budget."

    @property
    def lost(self) -> list[Run]:
        """Runs whose engine is missing, crashed or hung, unless the comparison claims that it fails, or whose truth is.

        Where nothing is claimed also runs that failed in another way, or all of them if none was judged. A witness,
        which cross-checks the truth, counts there only if no engine was compared.
        """
        engines = any(run.facts is not None and not run.facts.witness for run in self.runs)
        lost = []
        for run in self.runs:
            verdicts = set(run.row.expected(run.parameters))
            claims = verdicts != set(Verdict)
            if engines and not claims and run.facts is not None and run.facts.witness:
                continue
            if (point := self.points.get(point_name(run.parameters))) is not None and point.result.status in _BROKEN:
                lost.append(run)
            elif run.result.status in _BROKEN:
                lost += [run] * (Verdict.FAILED not in verdicts or not claims)
            elif not claims and run.verdict is Verdict.FAILED:
                lost.append(run)
        return lost or self._unjudged

    @property
    def _unjudged(self) -> list[Run]:
        """All runs, if none has a claim and none of them could be judged."""
        free = all(set(run.row.expected(run.parameters)) == set(Verdict) for run in self.runs)
        return self.runs if free and all(run.verdict in set(_UNJUDGED.values()) for run in self.runs) else []

    @property
    def _cells(self) -> list[tuple[str, ...]]:
        """Cells of each run: its name, verdict, the observable furthest beyond its tolerance, errors, cost, reason."""
        rows = []
        for run in self.runs:
            worst_of = max(run.judgements, key=lambda item: item.of_allowed, default=None)
            cells = ["", "", "", run.result.message]
            if worst_of is not None:
                off = [number(value) + spaced(worst_of.unit) for value in (worst_of.error, worst_of.tolerance)]
                cells = [worst_of.observable, *off, worst_of.reason]
            name = " ".join([run.row.engine, *(f"{key}={value:g}" for key, value in run.parameters.items())])
            cost = run.result.seconds_per_second
            rows.append((name, str(run.verdict), *cells[:3], "" if cost is None else number(cost), cells[3]))
        return rows

    @property
    def _notes(self) -> list[str]:
        left = f"Left out for lack of time: {', '.join(self.beyond_budget)}"
        return [*self.contradictions, *([left] if self.beyond_budget else [])]

    def __repr__(self) -> str:
        """Table for a terminal, with the rows of that for a notebook."""
        return "\n".join([self.comparison.title, *text_table(_COLUMNS, self._cells), *self._notes])

    def _repr_html_(self) -> str:
        """HTML table for a notebook: a row for each run, with the observable that is furthest beyond its tolerance."""
        gauges = []
        for run in self.runs:
            worst_of = max(run.judgements, key=lambda item: item.of_allowed, default=None)
            gauges.append("" if worst_of is None else gauge(worst_of.error, worst_of.tolerance))
        return html_table(self.comparison.title, _COLUMNS, self._cells, self._notes, gauges=gauges)
