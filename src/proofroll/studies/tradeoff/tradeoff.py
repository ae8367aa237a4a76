"""Speed against accuracy: the curves of all engines, the parts of their errors, and the Pareto front.

Three phases: the sweep, whose runs may be parallel; the check of the best points over a range of the scene's
parameters; and the timing, in which one process at a time advances an engine while all others are idle.
"""

import dataclasses
import hashlib
import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from proofroll.core.errors import Missing
from proofroll.core.plugins import parse_engine
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import resolve_with_truth
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.stopwatch import Stopwatch
from proofroll.running.time_budget import TimeBudget
from proofroll.running.timing import ROUNDS, Timing, time_in_rounds
from proofroll.studies.judging.reference import Reference
from proofroll.studies.tradeoff.curve import Curve, CurvePoint, Question, judge_point
from proofroll.studies.tradeoff.pareto import front
from proofroll.studies.tradeoff.records import Corner
from proofroll.studies.tradeoff.sweep import FINER, GAIN, curves_of, sweep

# Timing takes most of a study. A brief study has BRIEF_ROUNDS rounds, measures each speed for BRIEF_SECONDS, and
# measures a run of more than BRIEF_ONCE [s per simulated s] only once, as it warms itself up. Any study measures a run
# of more than ONCE [s per simulated s] only once: seven rounds of it would take longer than all others.
BRIEF_ROUNDS, BRIEF_ONCE, BRIEF_SECONDS, ONCE = 2, 0.1, 0.02, 10.0
# The finest steps take as long as all others together and hardly affect a choice. A brief study refines to BRIEF_FINER
# of a sampling interval (BRIEF_CLAIMED for curves with a claim), and only while each step removes BRIEF_GAIN of the
# error, as methods of order 2 do; a curve of order 1 can be extrapolated.
BRIEF_FINER, BRIEF_CLAIMED, BRIEF_GAIN = 2e-3, 1e-3, 0.65
# A brief study drops runs that are expected to take longer [s of processor time].
BRIEF_LONGEST = 3.0


@dataclass(frozen=True)
class Extent:
    """Extent of a trade-off: engines, range of parameters, and thoroughness.

    Attributes:
        engines: names or ``name[key=value,…]``; all that are installed if empty.
        over: parameter -> values; every combination is a corner of the range over which the best points are checked.
        rounds: number of measurements of every speed.
        brief: True to measure every speed :data:`BRIEF_ROUNDS` times at most, and to leave out most of the finest
            steps.
        claimed: engines, ``name[key=value,…]``, whose curves are refined further in a brief study.
        budget: processor time of the sweep and the timing [s]; the study is brief then, and runs beyond it are dropped.
    """

    engines: Sequence[str] = ()
    over: Mapping[str, Sequence[float]] = field(default_factory=dict)
    rounds: int = ROUNDS
    brief: bool = False
    claimed: Sequence[str] = ()
    budget: float | None = None

    @property
    def is_brief(self) -> bool:
        """True if the study is brief, as any with a budget is."""
        return self.brief or bool(self.budget)


@dataclass
class Tradeoff:
    """Trade-off before it is summarised.

    Attributes:
        question: of the sweep.
        curves: with their points.
        absent: engine -> why it has no curve.
        references: sampling interval [s] -> truth.
        extent: as it was asked for.
        truth_timing: time of the truth itself, measured in the rounds of the points; None if it failed.
    """

    question: Question
    curves: list[Curve]
    absent: dict[str, str]
    references: dict[float, Reference]
    extent: Extent
    truth_timing: Timing | None = None

    @property
    def reference(self) -> Reference:
        """The truth at the sampling interval of the question."""
        return self.references[self.question.every]

    @property
    def points(self) -> list[CurvePoint]:
        """Every point of every curve."""
        return [point for curve in self.curves for point in curve.points]

    @property
    def quantities(self) -> list[str]:
        """Observables of the truth that a recommendation may be asked for."""
        return [name for name in self.reference.curves if self.reference.scene.observables[name].asked_for]


Progress = Callable[[str, int], None]


@dataclass
class StudyProgress:
    """Progress of a study whose runs decide which runs follow.

    Attributes:
        tell: called after each run and each measurement with a short text and the total.
        total: number of runs and measurements of the whole study, as far as they are known by now.
    """

    tell: Progress
    total: int = 0

    def announce(self, count: int) -> None:
        """Adds runs or measurements that are asked next."""
        self.total += count

    def arrived(self, case: Case, _: Result) -> None:
        """Tells that a run has ended."""
        self.tell(case.engine.name, self.total)

    def timed(self, case: Case) -> None:
        """Tells that a measurement has ended."""
        self.tell(f"timing {case.engine.name}", self.total)


def tradeoff(question: Question, runner: Runner, extent: Extent, progress: Progress | None = None) -> Tradeoff:
    """Runs the study.

    Args:
        question: the scene, the length of runs, and the quantity that decides how far each curve goes.
        runner: runs the cases.
        extent: engines, range of parameters, and thoroughness.
        progress: called after every run and every measurement, see :class:`StudyProgress`.

    Raises:
        InputError: an unknown scene, parameter, quantity or engine.
        Missing: no engine can be asked.
    """
    limit = TimeBudget(extent.budget) if extent.budget else None
    scene = question.loaded
    scene.observable(question.quantity)
    curves, absent = curves_of(extent.engines, runner.workers, scene.requires)
    if not curves:
        raise Missing("there is no engine to measure: " + "; ".join(f"{name}: {why}" for name, why in absent.items()))
    question = question.sampled_for(curves)
    told = StudyProgress(progress or (lambda *_: None))
    finer, gain = (partial(_briefly, extent.claimed), BRIEF_GAIN) if extent.is_brief else (lambda _: FINER, GAIN)
    longest = BRIEF_LONGEST if extent.is_brief else None
    references = sweep(question, curves, runner, told.arrived, finer, gain, limit, longest, told.announce)
    study = Tradeoff(question=question, curves=curves, absent=absent, references=references, extent=extent)
    _, truth = resolve_with_truth([], runner.workers)
    _time(study, question.case(truth, question.every), runner.workers, told, limit)
    if extent.over:
        _check(study, truth, runner, told)
    return study


def _briefly(claimed: Sequence[str], curve: Curve) -> list[float]:
    """Finer steps of a curve in a brief study, in sampling intervals."""
    named = any(parse_engine(text).means(curve.facts.name, curve.facts.settings) for text in claimed)
    return [part for part in FINER if part >= (BRIEF_CLAIMED if named else BRIEF_FINER)]


def _time(tradeoff: Tradeoff, truth: Case, workers: Workers, told: StudyProgress, budget: TimeBudget | None) -> None:
    """Measures the speed of every point that reached the end, and of the truth."""
    cases = {point.case.key: point.case for point in tradeoff.points if point.result.status == Status.DONE}
    cases[truth.key] = truth
    rounds, brief = tradeoff.extent.rounds, tradeoff.extent.is_brief
    rounds = min(rounds, BRIEF_ROUNDS) if brief else rounds
    seconds = BRIEF_SECONDS if brief else None
    told.announce(len(cases) * (rounds + 1))
    with Stopwatch(workers) as stopwatch:
        timings = time_in_rounds(
            {key: partial(stopwatch, case, seconds) for key, case in cases.items()},
            rounds,
            once_above=BRIEF_ONCE if brief else ONCE,
            progress=lambda key: told.timed(cases[key]),
            enough=lambda: budget is not None and not budget.left,
        )
    tradeoff.truth_timing = timings.get(truth.key)
    for point in tradeoff.points:
        point.timing = timings.get(point.case.key)


def _check(tradeoff: Tradeoff, truth: EngineFacts, runner: Runner, told: StudyProgress) -> None:
    """Runs the best points at every corner of the range.

    These are the points on the Pareto front of each formulation, for each quantity: a question about one kind of model
    must not lose a formulation that another one of the same engine dominates.
    """
    formulations: dict[tuple[str, object], list[Curve]] = {}
    for curve in tradeoff.curves:
        formulations.setdefault((curve.facts.name, curve.facts.settings.get("formulation")), []).append(curve)
    chosen = {
        point.case.key: point
        for curves in formulations.values()
        for quantity in tradeoff.quantities
        for point in front(pareto_entries(curves, quantity))
    }
    asked = []
    for values in itertools.product(*tradeoff.extent.over.values()):
        corner = dict(zip(tradeoff.extent.over, map(float, values), strict=True))
        question = dataclasses.replace(tradeoff.question, parameters={**tradeoff.question.parameters, **corner})
        runs = {key: question.cases(point.case.engine, point.case.every) for key, point in chosen.items()}
        true = question.truth(truth, [case for both in runs.values() for case in both])
        asked.append((corner, question, true, runs))
    cases = [case for _, _, true, runs in asked for case in (true, *itertools.chain(*runs.values()))]
    told.announce(len(cases))
    results = runner.run(cases, told.arrived)
    corners: dict[str, list[Corner]] = {key: [] for key in chosen}
    for corner, question, true, runs in asked:
        if results[true.key].status != Status.DONE:
            lost = Corner(corner, {}, {}, f"there is no truth: {results[true.key].message}")
            for answers in corners.values():
                answers.append(lost)
            continue
        dataset = runner.store.stored(true).dataset
        intervals = {case.every for both in runs.values() for case in both}
        references = {every: question.reference(dataset, every) for every in intervals}
        for key, both in runs.items():
            point = judge_point([CurvePoint(case, results[case.key]) for case in both], references, runner)
            corners[key].append(_corner(corner, point, references[both[0].every]))
    for point in tradeoff.points:
        point.corners = corners.get(point.case.key)


def _corner(parameters: dict[str, float], point: CurvePoint, reference: Reference) -> Corner:
    errors = {name: error for name, error in point.errors.items() if np.isfinite(error)}
    relative = {name: error / (reference.scale(name) or 1.0) for name, error in errors.items()}
    ended = point.sparse or point
    return Corner(parameters, errors, relative, (point if not point.errors else ended).result.message)


def pareto_entries(curves: Iterable[Curve], quantity: str) -> list[tuple[CurvePoint, float, float]]:
    """Timed points with their costs and the envelopes of their errors, at least the truth's error bar."""
    entries = []
    for curve in curves:
        for point, error in zip(curve.points, curve.envelope(quantity), strict=True):
            if point.timing is not None and np.isfinite(error):
                entries.append((point, point.timing.interval.value, max(error, point.bars.get(quantity, 0.0))))
    return entries


def study_path(folder: Path, question: Question, engines: Sequence[str] = (), *, brief: bool = False) -> Path:
    """File of a question's study below the folder of results; brief and restricted studies have their own."""
    scene = question.loaded
    parts = [[scene.digest, question.until], *([sorted(engines)] if engines else [])]
    digests = (hashlib.sha256(json.dumps(part).encode()).hexdigest()[:10] for part in parts)
    return folder / "tradeoff" / f"{'-'.join([scene.name, *digests])}{'-brief' if brief else ''}.json"
