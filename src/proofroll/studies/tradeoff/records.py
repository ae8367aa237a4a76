"""Records of a trade-off, for its file, its text, its advice and its drawings."""

import math
from dataclasses import dataclass, field
from typing import Any

from proofroll.core.validation import FloatOrInf
from proofroll.running.case import Status
from proofroll.studies.claim_judgement import JudgedFile
from proofroll.studies.study_store import Measured


@dataclass(frozen=True, kw_only=True)
class MeasuredCost:
    """Cost of computing.

    Attributes:
        seconds_per_second: median of wall seconds per simulated second; None: not measured.
        interval: lowest and highest, with ``confidence``; None where it was measured once.
        rounds: the measurements, in the order of the rounds, which are those of all points: a ratio of two costs can
            be taken round by round.
        measurements: number of measurements.
    """

    seconds_per_second: float | None = None
    interval: tuple[float, float] | None = None
    confidence: float | None = None
    rounds: list[float] = field(default_factory=list)
    measurements: int = 0

    @property
    def cost(self) -> float:
        """``seconds_per_second``; infinite where it was not measured."""
        return math.inf if self.seconds_per_second is None else self.seconds_per_second


@dataclass(frozen=True)
class SparseRun:
    """The run of an adaptive step over few samples.

    Attributes:
        every: sampling interval [s].
        error: largest distance from the truth, by observable.
        dense_error: that of the run over many samples.
        message: last words of the run.
    """

    every: float
    error: dict[str, float | None]
    dense_error: dict[str, float | None]
    message: str


@dataclass(frozen=True)
class Corner:
    """One run of a point at other parameters.

    Attributes:
        parameters: where.
        errors: largest distance from the truth, by observable; empty if the run did not reach the end.
        relative: the same in parts of the observable's scale there.
        message: last words of the run.
    """

    parameters: dict[str, FloatOrInf]
    errors: dict[str, float]
    relative: dict[str, float]
    message: str

    def off(self, relative: bool) -> dict[str, float]:
        """Relative errors, or else ``errors``."""
        return self.relative if relative else self.errors


@dataclass(frozen=True, kw_only=True)
class MeasuredPoint(MeasuredCost):
    """One engine with complete settings.

    Attributes:
        id: number of the point in its study.
        engine, curve, level, settings, resolution, step, order, caveat, family, precision: which, and what it says of
            itself.
        status, message, host: end of the run, and the machine of a cluster that made it.
        error: largest distance from the truth, by observable; None: not finite.
        envelope: the largest of that and of the next finer runs.
        sparse: the run over few samples; None with a fixed step.
        corners: the runs over the range of parameters; None: there are none.
    """

    id: int
    engine: str
    curve: str
    level: str | None
    settings: dict[str, Any]
    resolution: str | None
    step: float | None
    order: int | None
    caveat: str = ""
    family: str = ""
    precision: str = "double"
    status: Status
    message: str
    host: str = ""
    error: dict[str, float | None]
    envelope: dict[str, float | None]
    sparse: SparseRun | None = None
    corners: list[Corner] | None

    def held(self, quantity: str) -> float:
        """Its envelope of an observable; infinite where that is not finite."""
        error = self.envelope.get(quantity)
        return math.inf if error is None else error


@dataclass(frozen=True)
class MeasuredQuantity:
    """Record of an observable: unit, size that a percentage refers to, and the truth's error bar; None: there is none.

    ``symbol`` is what heads its columns, and ``column`` is true if tables show it by
    default.
    """

    unit: str
    scale: float | None
    truth_error_bar: float | None
    symbol: str
    column: bool


@dataclass(frozen=True)
class DroppedStep:
    """A step or tolerance of an engine with which there is no run, and why."""

    engine: str
    step: float
    reason: str


@dataclass(frozen=True, kw_only=True)
class CurveBudget:
    """Makeup of the error of one quantity along a curve; lengths of error in the quantity's unit.

    Attributes:
        engine, curve, quantity: which.
        model_form: distance of the limit of small steps from the truth; None where too few runs reached the end.
        model_form_bar: uncertainty of that limit.
        order: observed order of the time step; None with an adaptive step or where no power law shows.
        order_low, order_high: its confidence interval of 95 %; None from too few runs.
        order_from, order_to: coarsest and finest step of the runs that follow that power law [s]; outside them the
            order is not claimed.
        declared: order that the engine declares.
        contradicts_declaration: whether the observed one lies below it or, of the motion, above what it has at best.
        floor: scatter of the finest runs, where refining them no longer helps; None: not reached.
        best_step: step of the most accurate run where finer ones are worse, for they round more often in single
            precision [s]; None: there is none.
        truth: error bar of the truth; None: it is not finite.
        coarse, fine: dominant part of the error at either end.
        coarse_step, fine_step: those ends.
        fine_error: error at the fine end.
        sentence: all this in one.
    """

    engine: str
    curve: str
    quantity: str
    model_form: float | None = None
    model_form_bar: float | None = None
    order: float | None = None
    order_low: float | None = None
    order_high: float | None = None
    order_from: float | None = None
    order_to: float | None = None
    declared: int | None = None
    contradicts_declaration: bool = False
    floor: float | None = None
    best_step: float | None = None
    truth: float | None = None
    coarse: str = ""
    coarse_step: float | None = None
    fine: str = ""
    fine_step: float | None = None
    fine_error: float | None = None
    sentence: str = ""


@dataclass(frozen=True, kw_only=True)
class TruthCost(MeasuredCost):
    """Cost of the truth, and its route."""

    route: str


@dataclass(frozen=True, kw_only=True)
class TradeoffStudy:
    """Error against cost.

    Attributes:
        scene, parameters, until, every, quantity: question of the sweep; every: interval between samples [s].
        quantities: the observables of the truth.
        points: of all curves, coarse first.
        dropped: runs that were left out.
        absent: engine -> why it has no curve.
        budgets: parts of the errors.
        pareto: observable -> numbers of the points that nothing beats, cheapest first.
        pareto_engines: the same without solutions of the scene's own equations.
        truth: its cost.
        over: parameter -> values; the range over which the best points were checked.
        findings: conclusions, as sentences.
        brief: whether speeds were measured less often.
        measured: when, where and with what.
        engines: those to which it is restricted; none: all.
        claims: judgements of the claims in its file.
    """

    study: str = "tradeoff"
    scene: str
    parameters: dict[str, FloatOrInf]
    until: float
    every: float
    quantity: str
    quantities: dict[str, MeasuredQuantity]
    points: list[MeasuredPoint]
    dropped: list[DroppedStep] = field(default_factory=list)
    absent: dict[str, str]
    budgets: list[CurveBudget]
    pareto: dict[str, list[int]]
    pareto_engines: dict[str, list[int]]
    truth: TruthCost
    over: dict[str, list[FloatOrInf]]
    findings: list[str]
    brief: bool
    measured: Measured
    engines: list[str] = field(default_factory=list)
    claims: JudgedFile = field(default_factory=JudgedFile)

    def front(self, key: str, quantity: str) -> list[MeasuredPoint]:
        """Points of the front ``pareto`` or ``pareto_engines`` for an observable, cheapest first."""
        numbers = {"pareto": self.pareto, "pareto_engines": self.pareto_engines}[key].get(quantity, [])
        by_number = {point.id: point for point in self.points}
        return [by_number[number] for number in numbers]
