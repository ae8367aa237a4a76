"""Records of a stability map: for its file, its texts, the judgement of claims and drawings."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from proofroll.core.number_format import number
from proofroll.core.validation import FloatOrInf
from proofroll.studies.stability.axes import Axis, Effort
from proofroll.studies.stability.step_numbers import Explanation
from proofroll.studies.study_store import Measured
from proofroll.studies.swept_settings import SweptSetting


@dataclass(frozen=True)
class ClaimJudgement:
    """Judgement of a claim by a study.

    Attributes:
        claim: in one sentence.
        because: reason that the file gives for it.
        holds: True or False; None: the measurements do not decide.
        found: result of the study, in one sentence.
    """

    claim: str
    because: str
    holds: bool | None
    found: str


@dataclass(frozen=True)
class JudgedFile:
    """Judgement of all claims of a file, as sentences.

    Attributes:
        file: its path; None: no file was judged.
        contradictions: about claims that do not hold.
        undecided: about claims that the measurements do not decide.
    """

    file: str | None = None
    contradictions: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)


BOUNDARIES = ("stable", "accurate")
# Boundaries within this factor count as equal: two rungs of a ladder of steps (True), one of tolerances (False).
_SAME = {True: 2.3, False: 15.0}


@dataclass(frozen=True)
class Boundary:
    """Boundary at which a curve stops being stable, or accurate, at one value of an axis.

    Attributes:
        largest: largest step [s] or tolerance that holds; None: no affordable one does.
        reached: True if a step or tolerance holds, and a larger one fails.
        numbers: dimensionless number of a step -> its value at the boundary.
        beyond: the next larger step or tolerance, which fails.
        failure: kind of failure there.
        silent: True if the engine does not report it.
        error: of the deciding observable there, as a part of its range.
        time: of the failure [s].
        message: of the run there.
    """

    largest: float | None
    reached: bool
    numbers: dict[str, float]
    beyond: float | None
    failure: str | None
    silent: bool
    error: float | None
    time: float | None
    message: str | None


@dataclass(frozen=True, kw_only=True)
class BoundaryPoint(SweptSetting):
    """One engine with its settings, without step or tolerance, at one value of an axis.

    Attributes:
        axis, value, parameters: location on the map.
        until: length of every run [s].
        period: natural time of the scene there [s].
        largest_stable, largest_accurate: of the two boundaries.
        boundary: name of the one to show; ``failure``, ``silent`` and ``message`` belong to it.
        sides: ``stable`` and ``accurate`` -> boundary.
        least_error: of all stable runs.
        finest: the finest step or tolerance that was run.
        too_slow: first rung that was not run, for its many steps or for coarser runs that met the time limit.
        timed_out: True if a run met that limit.
        runs: number of runs.
        problem: reason why there is no truth here.
        reproducer: path of a program that shows the failure.
        reproducer_needs: packages that it imports.
        reproducer_note: reason why it needs proofroll, or why there is none.
    """

    axis: str
    value: FloatOrInf
    parameters: dict[str, FloatOrInf]
    until: float
    period: float
    largest_stable: float | None
    largest_accurate: float | None
    boundary: str
    failure: str | None
    silent: bool
    message: str | None
    sides: dict[str, Boundary]
    least_error: float | None
    finest: float | None
    too_slow: float | None
    timed_out: bool
    runs: int
    problem: str | None
    reproducer: str | None = None
    reproducer_needs: list[str] = field(default_factory=list)
    reproducer_note: str | None = None

    @property
    def shown(self) -> Boundary:
        """The boundary to show."""
        return self.sides[self.boundary]

    @property
    def cut(self) -> bool:
        """True if the search ended because finer runs were too slow: a missing boundary then proves nothing."""
        return self.too_slow is not None


@dataclass(frozen=True, kw_only=True)
class ExplainedBoundary(Explanation):
    """Dimensionless number that varies least among the boundaries of a curve along an axis."""

    curve: str
    axis: str
    boundary: str


@dataclass(frozen=True)
class MappedValue:
    """Value on an axis, the scene's parameters there, and the reason if there is no truth."""

    axis: str
    value: FloatOrInf
    parameters: dict[str, FloatOrInf]
    problem: str | None


@dataclass(frozen=True, kw_only=True)
class StabilityStudy:
    """A stability map with its counts and conclusions.

    Attributes:
        scene, axes, periods, effort: question of the study.
        accurate: largest error of an accurate run, as a part of the range.
        runs: number of runs.
        boundaries: number of points with a failure beyond them.
        silent: number of these that the engine did not report.
        refused: number of points that the engine refused before the run.
        wrong_model: number of points at which the engine built a different scene.
        failures: kind of failure -> number of points.
        never_accurate: number of points at which no affordable step is accurate.
        meanings: kind of failure -> its meaning.
        step_symbols: dimensionless number of a step -> its symbol.
        points: every engine at every value.
        explanations: numbers that explain boundaries.
        findings: conclusions, as sentences.
        places: the values of the axes.
        absent: engine -> why it is not on the map.
        hosts: machine of a cluster -> number of results that it made.
        measured: time, machine and versions.
        claims: judgements of the claims in its file.
    """

    study: str = "stability"
    scene: str
    axes: list[Axis]
    periods: float
    accurate: float
    runs: int
    boundaries: int
    silent: int
    refused: int
    wrong_model: int
    failures: dict[str, int]
    never_accurate: int
    meanings: dict[str, str]
    step_symbols: dict[str, str]
    points: list[BoundaryPoint]
    explanations: list[ExplainedBoundary]
    findings: list[str]
    places: list[MappedValue]
    absent: dict[str, str]
    hosts: dict[str, int] = field(default_factory=dict)
    effort: Effort
    measured: Measured
    claims: JudgedFile = field(default_factory=JudgedFile)


def dependence(points: Sequence[BoundaryPoint], name: str) -> str:
    """Text on the change of a boundary along an axis, in natural times; empty if it does not change.

    Args:
        points: of one curve; a point without a boundary does not count if its search was cut.
        name: of the boundary.
    """
    fixed_step = any(point.resolution == "dt" for point in points)
    sizes = [
        (largest / point.period if fixed_step else largest, point.value)
        for point in points
        if (largest := point.sides[name].largest) is not None
    ]
    without = [point for point in points if point.sides[name].largest is None and not point.cut]
    if not sizes or (not without and max(sizes)[0] <= _SAME[fixed_step] * min(sizes)[0]):
        return ""
    what = " of the natural time" if fixed_step else ""
    largest_of_all = f"{number(max(sizes)[0])}{what} at {max(sizes)[1]:g}"
    if without:
        values = ", ".join(f"{point.value:g} ({point.sides[name].failure})" for point in without)
        return f"{largest_of_all}, but nowhere at {values}"
    return f"{largest_of_all}, but {number(min(sizes)[0])}{what} at {min(sizes)[1]:g}"


def silent_ranking(study: StabilityStudy) -> list[BoundaryPoint]:
    """Silent failures, the worst first: wrong at any step, then by the error of the run beyond the boundary.

    Points whose search was cut come last: a finer step might have been right.
    """

    def badness(point: BoundaryPoint) -> tuple[bool, bool, bool, float]:
        never, error = point.shown.largest is None, point.shown.error
        return not (never and point.cut), never, point.boundary == "stable", error if error is not None else 0.0

    return sorted((point for point in study.points if point.silent), key=badness, reverse=True)
