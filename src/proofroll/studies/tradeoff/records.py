"""Records of a trade-off: for its file, its texts, its advice and its drawings."""

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
        seconds_per_second: median of wall time per simulated second; None: not measured.
        interval: lowest and highest; None if it was measured once.
        confidence: of the interval.
        rounds: cost measured in each round [s/s]; all points share the rounds, so that a ratio of two costs can be
            taken round by round.
        measurements: their number.
    """

    seconds_per_second: float | None = None
    interval: tuple[float, float] | None = None
    confidence: float | None = None
    rounds: list[float] = field(default_factory=list)
    measurements: int = 0

    @property
    def cost(self) -> float:
        """``seconds_per_second``; infinite if it was not measured."""
        return math.inf if self.seconds_per_second is None else self.seconds_per_second


@dataclass(frozen=True, kw_only=True)
class SweptSetting:
    """Engine with settings along a curve.

    Attributes:
        engine: name of the engine.
        curve: ``name[formulation=…,preset=…]``.
        level: rung on the ladder of models; None: not declared.
        settings, resolution, caveat, family, precision: the engine's facts.
    """

    engine: str
    curve: str
    level: str | None
    settings: dict[str, Any]
    resolution: str | None
    caveat: str = ""
    family: str = ""
    precision: str = "double"


@dataclass(frozen=True)
class SparseRun:
    """Run of an engine with an adaptive step over few samples.

    Attributes:
        every: sampling interval [s].
        error: observable -> largest distance from the truth.
        dense_error: observable -> largest distance of the run over many samples.
        message: of the run.
    """

    every: float
    error: dict[str, float | None]
    dense_error: dict[str, float | None]
    message: str


@dataclass(frozen=True)
class Corner:
    """Run of a point at a corner of the range of parameters.

    Attributes:
        parameters: the corner.
        errors: observable -> largest distance from the truth; empty if the run did not reach the end.
        relative: observable -> error divided by the observable's scale there.
        message: of the run.
    """

    parameters: dict[str, FloatOrInf]
    errors: dict[str, float]
    relative: dict[str, float]
    message: str

    def off(self, relative: bool) -> dict[str, float]:
        """Errors, divided by the scales if ``relative``."""
        return self.relative if relative else self.errors


@dataclass(frozen=True, kw_only=True)
class MeasuredPoint(SweptSetting, MeasuredCost):
    """One engine with complete settings.

    Attributes:
        id: number of the point in its study.
        step, order: step or tolerance, and declared order of convergence.
        status, message, host: end of the run, and the machine of a cluster that made it.
        error: observable -> largest distance from the truth; None: not finite.
        envelope: observable -> largest error of this run and of the next finer ones.
        sparse: the run over few samples; None with a fixed step.
        corners: runs at the corners of the range of parameters; None: there are none.
    """

    id: int
    step: float | None
    order: int | None
    status: Status
    message: str
    host: str = ""
    error: dict[str, float | None]
    envelope: dict[str, float | None]
    sparse: SparseRun | None = None
    corners: list[Corner] | None

    def envelope_of(self, quantity: str) -> float:
        """Envelope of an observable; infinite if it is not finite."""
        error = self.envelope.get(quantity)
        return math.inf if error is None else error


@dataclass(frozen=True)
class MeasuredQuantity:
    """Record of an observable.

    Attributes:
        unit: of its values.
        scale: size to which a percentage refers; None: there is none.
        truth_error_bar: None: it is not finite.
        symbol: heading of its columns.
        column: True if tables show it by default.
    """

    unit: str
    scale: float | None
    truth_error_bar: float | None
    symbol: str
    column: bool


@dataclass(frozen=True)
class DroppedStep:
    """A step or tolerance of an engine that was not run, and the reason."""

    engine: str
    step: float
    reason: str


@dataclass(frozen=True, kw_only=True)
class CurveBudget:
    """Parts of the error of one quantity along a curve, in the quantity's unit.

    Attributes:
        engine, curve, quantity: names of the curve and of its observable.
        model_form: distance of the limit of small steps from the truth; None if too few runs reached the end.
        model_form_bar: uncertainty of that limit.
        order: observed order of the time step; None with an adaptive step or if no power law shows.
        order_low, order_high: its confidence interval of 95 %; None from too few runs.
        order_from, order_to: coarsest and finest step of the runs that follow that power law [s].
        declared: order that the engine declares.
        contradicts_declaration: True if the observed order is below the declared one or, for a motion, above its
            highest.
        floor: scatter of the finest runs, where refinement no longer helps; None: not reached.
        best_step: step of the most accurate run if finer ones are worse by round-off in single precision [s]; None:
            there is none.
        truth: error bar of the truth; None: it is not finite.
        coarse, fine: dominant part of the error at the coarse and the fine end.
        coarse_step, fine_step: steps at these ends.
        fine_error: error at the fine end.
        sentence: the budget in words.
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

    @property
    def doubt(self) -> float:
        """Uncertainty of the limit's distance from the truth: bar of the limit, error bar of the truth, scatter."""
        return (self.model_form_bar or 0.0) + (self.truth or 0.0) + (self.floor or 0.0)


@dataclass(frozen=True, kw_only=True)
class TruthCost(MeasuredCost):
    """Cost of the truth, and its route."""

    route: str


@dataclass(frozen=True, kw_only=True)
class TradeoffStudy:
    """Error against cost.

    Attributes:
        scene, parameters, until, every, quantity: question of the sweep; every: sampling interval [s].
        quantities: the observables of the truth.
        points: of all curves, coarse first.
        dropped: runs that were left out.
        absent: engine -> why it has no curve.
        budgets: parts of the errors.
        pareto: observable -> ids of the points on the Pareto front, cheapest first.
        pareto_engines: the fronts without equations derived by hand for the scene.
        truth: its cost.
        over: parameter -> values; the range over which the best points were checked.
        findings: conclusions, as sentences.
        brief: True if speeds were measured less often.
        measured: time, machine and versions.
        engines: names of a restricted study; empty: all.
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
