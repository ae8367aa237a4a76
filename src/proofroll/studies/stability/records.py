"""Records of a stability map, for its file, its text, its verdict and its drawings."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from proofroll.core.number_format import number
from proofroll.core.validation import FloatOrInf
from proofroll.studies.claim_judgement import JudgedFile
from proofroll.studies.stability.axes import Axis, Effort
from proofroll.studies.stability.step_numbers import Explanation
from proofroll.studies.study_store import Measured

BOUNDARIES = ("stable", "accurate")
# Boundaries this factor apart count as the same: two rungs of the ladder of steps, one of that of tolerances.
_SAME = {True: 2.3, False: 15.0}


@dataclass(frozen=True)
class Boundary:
    """Boundary at which a curve stops being stable, or accurate, at one place.

    Attributes:
        largest: step [s] or tolerance that holds; None: none that is affordable does.
        reached: something holds, and something beyond it fails.
        numbers: dimensionless numbers of that step, by name.
        beyond: the next step or tolerance, which fails.
        failure: kind of failure there.
        silent: the engine does not report it.
        error: of the deciding observable there, in parts of its range.
        time: when the failure shows [s].
        message: last words of the run there.
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


@dataclass(frozen=True)
class BoundaryPoint:
    """One engine with its settings at one value of an axis.

    Attributes:
        engine, settings, curve, level, caveat, family, precision, resolution: which.
        axis, value, parameters: where.
        until: length of every run [s].
        period: natural time of the scene there [s].
        largest_stable, largest_accurate: of the two boundaries.
        boundary: name of the one to show; ``failure``, ``silent`` and ``message`` are its own.
        sides: both, ``stable`` and ``accurate``.
        least_error: of all stable runs.
        finest: the finest step or tolerance that was run.
        too_slow: the first that was not, for its many steps or for runs that met the limit of time.
        timed_out: a run met that limit.
        runs: how many there were.
        problem: reason for which there is no truth here.
        reproducer: path of a program that shows the failure.
        reproducer_needs: packages that it imports.
        reproducer_note: reason for which it needs proofroll, or for which there is none.
    """

    engine: str
    settings: dict[str, Any]
    curve: str
    level: str | None
    caveat: str
    family: str
    resolution: str | None
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
    precision: str = "double"

    @property
    def shown(self) -> Boundary:
        """The boundary that is to be shown."""
        return self.sides[self.boundary]

    @property
    def cut(self) -> bool:
        """True if the search ended for runs that were too slow: a missing boundary then proves nothing."""
        return self.too_slow is not None


@dataclass(frozen=True, kw_only=True)
class ExplainedBoundary(Explanation):
    """The number that changes least among the boundaries of a curve along an axis."""

    curve: str
    axis: str
    boundary: str


@dataclass(frozen=True)
class MappedPlace:
    """Place on an axis: its value, the scene's parameters there, and the reason if it has no truth."""

    axis: str
    value: FloatOrInf
    parameters: dict[str, FloatOrInf]
    problem: str | None


@dataclass(frozen=True, kw_only=True)
class StabilityStudy:
    """A map with counts on top.

    Attributes:
        scene, axes, periods, effort: question of the study.
        accurate: part of the range that an accurate run holds.
        runs: how many there were.
        boundaries: number of points with a failure beyond them.
        silent: number of these that the engine did not report.
        refused: points that the engine refused before the run.
        wrong_model: points that were not run, for what the engine built is not the scene.
        failures: kind of failure -> how many points.
        never_accurate: points at which nothing affordable holds.
        meanings: kind of failure -> what it is.
        step_symbols: dimensionless number of a step -> its symbol.
        points: every engine at every place.
        explanations: numbers that explain boundaries.
        findings: conclusions, as sentences.
        places: the values of the axes.
        absent: engine -> why it is not on the map.
        hosts: machine of a cluster -> how many of the results it made.
        measured: when, where and with what.
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
    places: list[MappedPlace]
    absent: dict[str, str]
    hosts: dict[str, int] = field(default_factory=dict)
    effort: Effort
    measured: Measured
    claims: JudgedFile = field(default_factory=JudgedFile)


def dependence(points: Sequence[BoundaryPoint], name: str) -> str:
    """Change of a boundary, in parts of the natural time, along an axis; empty if there is none.

    The points are those of one curve. Where the search was cut for its many steps, a missing boundary proves nothing.
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
    said = f"{number(max(sizes)[0])}{what} at {max(sizes)[1]:g}"
    if without:
        places = ", ".join(f"{point.value:g} ({point.sides[name].failure})" for point in without)
        return f"{said}, but nowhere at {places}"
    return f"{said}, but {number(min(sizes)[0])}{what} at {min(sizes)[1]:g}"


def silent_ranking(study: StabilityStudy) -> list[BoundaryPoint]:
    """The silent failures, the worst first: wrong at any step, then by how wrong the run beyond the boundary was.

    Searches that were cut because finer runs have too many steps come last: a finer step might have been right.
    """

    def badness(point: BoundaryPoint) -> tuple[bool, bool, bool, float]:
        never, error = point.shown.largest is None, point.shown.error
        return not (never and point.cut), never, point.boundary == "stable", error if error is not None else 0.0

    return sorted((point for point in study.points if point.silent), key=badness, reverse=True)
