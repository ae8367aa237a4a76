"""Runs every engine, formulation and preset over its usable range of steps or tolerances, on one scene."""

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.engine import whole_steps
from proofroll.core.engine_abilities import offered
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import EngineSpec, engine_names, parse_engine
from proofroll.core.verdict import round_off_of
from proofroll.running.case import Case, EngineDescription, EngineFacts, Result, Status
from proofroll.running.engine_questions import describe_each, resolve, resolve_with_truth
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.time_budget import TimeBudget
from proofroll.studies.judging.reference import Reference
from proofroll.studies.tradeoff.curve import Curve, CurvePoint, Question, judge_point

# Steps in sampling intervals: those of every curve, and those by which it may be extended.
_STEPS = (1.0, 1 / 2, 1 / 5, 1 / 10, 1 / 25, 1 / 50, 1 / 100, 1 / 250)
_COARSER = (2.0, 4.0, 8.0)
FINER = (1 / 500, 1 / 1000, 1 / 2500)
_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_LOOSER = (1.0, 10.0, 100.0)
# A run is broken if its error is at least this part of the quantity's scale; a curve is extended until a run breaks.
BROKEN = 0.1
# A curve is refined while each finer step removes at least this part of the error. The speed of the machine does not
# matter, only the list of steps ends it.
GAIN = 0.4
# With a budget, the part of the time left that runs may share (the rest is for timing), and the factor by which a
# tighter tolerance is assumed to take longer.
_OF_RUNS, _TIGHTER = 0.5, 2.0


Progress = Callable[[Case, Result], None]


def curves_of(
    engines: Iterable[str], workers: Workers | None = None, requires: frozenset[str] = frozenset()
) -> tuple[list[Curve], dict[str, str]]:
    """Empty curves, one for each formulation and preset of the engines; and engine without a curve -> reason.

    Formulations that provide nothing that the scene requires are for other kinds of scenes, and left out.

    Args:
        engines: ``name``, or ``name[key=value,…]`` for one formulation or setting; empty: all that are installed.
        workers: pool for the questions to engines; None: new workers.
        requires: capabilities that the scene requires.

    Raises:
        InputError: an unknown engine, formulation or setting.
    """
    engines_asked: list[str] = []
    absent: dict[str, str] = {}
    asked = [(text, parse_engine(text)) for text in list(engines) or engine_names()]
    descriptions = describe_each((spec.name for _, spec in asked), workers)
    for text, spec in asked:
        answer = descriptions[spec.name]
        if isinstance(answer, InputError):
            raise answer
        if isinstance(answer, ProofrollError):
            absent[spec.name] = str(answer)
            continue
        chosen, foreign = _chosen(spec, answer, requires)
        if foreign:
            absent.setdefault(spec.name, "none of its formulations is for scenes of this kind")
        engines_asked += chosen
        if any(parse_engine(name).name == spec.name for name in engines_asked):
            absent.pop(spec.name, None)
        elif spec.name not in absent:
            raise InputError("engine", text, f"{spec.name} has {', '.join(answer.presets)}")
    specs = [parse_engine(name) for name in engines_asked]
    curves = []
    resolved = resolve([(spec.name, spec.options) for spec in specs], workers)
    for name, facts in zip(engines_asked, resolved, strict=True):
        if isinstance(facts, InputError):
            raise facts
        if isinstance(facts, EngineFacts):
            curves.append(Curve(name, facts.on(requires)))
        else:
            absent[name] = str(facts)
    return curves, absent


def _chosen(spec: EngineSpec, described: EngineDescription, requires: frozenset[str]) -> tuple[list[str], bool]:
    """Formulations and presets that a specification selects, as ``name[key=value,…]``.

    The second value is True if some were left out because they are for other kinds of scenes.
    """
    chosen: list[str] = []
    foreign = False
    for formulation, presets in described.presets.items():
        if spec.options.get("formulation", formulation) != formulation:
            continue
        able = not requires or requires & set(described.provides[formulation])
        fits = "formulation" in spec.options or offered(formulation, requires, described.made_for)
        if not able or not fits:
            foreign = True
            continue
        for preset in presets:
            if spec.options.get("preset", preset) == preset:
                options = {"formulation": formulation, "preset": preset, **spec.options}
                chosen.append(str(EngineSpec(spec.name, options)))
    return chosen, foreign


def sweep(
    question: Question,
    curves: list[Curve],
    runner: Runner,
    progress: Progress | None = None,
    finer: Callable[[Curve], Sequence[float]] = lambda _: FINER,
    gain: float = GAIN,
    budget: TimeBudget | None = None,
    longest: float | None = None,
    announce: Callable[[int], None] = lambda _: None,
) -> dict[float, Reference]:
    """Fills the curves with points, and returns sampling interval [s] -> truth.

    Every curve begins with the same steps. It is then extended to coarser ones until it breaks, and to finer ones while
    each removes the part ``gain`` of the error. With a budget or a longest run the coarsest runs of all curves come
    first, and runs that would take longer than their share, or than the longest, are dropped.

    Args:
        question: of the sweep.
        curves: without points.
        runner: runs the cases.
        progress: called with each case and result.
        finer: curve -> its finer steps, in sampling intervals.
        gain: see above.
        budget: processor time of all runs, or None.
        longest: processor time of a run but the first two of its curve [s], or None.
        announce: called with the number of runs that are asked next, before they begin.
    """
    references: dict[float, Reference] = {}
    for is_first in (True, False, False, False):
        asked = [
            (curve, value)
            for curve in curves
            for value in (
                _first(question, curve) if is_first else _further(question, curve, references, finer(curve), gain)
            )
        ]
        if not asked:
            break
        _run(question, asked, runner, references, progress, budget, longest, announce)
        for curve in curves:
            curve.points.sort(key=lambda point: -(point.step or 0.0))
    return references


def _first(question: Question, curve: Curve) -> list[float]:
    if curve.facts.resolution is None:
        return [0.0]  # a closed form
    usual = float(curve.facts.settings[curve.facts.resolution])
    if curve.fixed:
        return [usual]
    if curve.fixed_step:
        return [question.step(factor) for factor in _STEPS]
    return list(dict.fromkeys([*_TOLERANCES, usual]))


def _further(
    question: Question,
    curve: Curve,
    references: Mapping[float, Reference],
    finer_steps: Sequence[float] = FINER,
    gain: float = GAIN,
) -> list[float]:
    """Next steps of a curve: a coarser one unless the coarsest is broken, and one of ``finer_steps`` if that pays.

    Refinement ends at the truth's error bar, or at the round-off of double precision.
    """
    if curve.fixed or not curve.points:
        return []
    values = []
    scale = references[question.every].scale(question.quantity) or 1.0
    coarsest, finest = curve.points[0], curve.points[-1]
    ladder = [question.step(factor) for factor in _COARSER] if curve.fixed_step else _LOOSER
    coarser = next((value for value in ladder if value not in curve.tried), None)
    whole = coarsest.errors.get(question.quantity, np.inf) < BROKEN * scale
    if coarser is not None and whole and not curve.saturated(question.quantity):
        values.append(coarser)
    if not curve.fixed_step:
        return values
    finer = next((step for step in map(question.step, finer_steps) if step not in curve.tried), None)
    if finer is not None and len(curve.points) > 1:
        now, coarser_error = (point.errors.get(question.quantity, np.inf) for point in (finest, curve.points[-2]))
        reached = max(
            finest.bars.get(question.quantity, 0.0),
            round_off_of("double", references[question.every].magnitude(question.quantity)),
        )
        if reached < now < (1 - gain) * coarser_error:
            values.append(finer)
    return values


def _run(
    question: Question,
    asked: list[tuple[Curve, float]],
    runner: Runner,
    references: dict[float, Reference],
    progress: Progress | None,
    budget: TimeBudget | None,
    longest: float | None,
    announce: Callable[[int], None],
) -> None:
    """Runs curves with these steps or tolerances, and the truths that are still missing."""
    options: list[tuple[str, dict[str, Any]]] = []
    for curve, value in asked:
        facts = curve.facts
        options.append((facts.name, facts.settings | ({facts.resolution: value} if facts.resolution else {})))
    resolved, truth_facts = resolve_with_truth(options, runner.workers)
    cases: list[tuple[Curve, tuple[Case, ...]]] = []
    for (curve, value), resolved_facts in zip(asked, resolved, strict=True):
        try:
            if isinstance(resolved_facts, ProofrollError):
                raise resolved_facts
            if resolved_facts.step is not None:
                whole_steps(0.0, question.until, resolved_facts.step)
            cases.append((curve, question.cases(resolved_facts, max(question.every, resolved_facts.step or 0.0))))
        except ProofrollError as error:
            curve.dropped[value] = str(error)
    runs = [case for _, both in cases for case in both]
    pending = [] if references else [question.truth(truth_facts, runs)]
    announce(len(pending) + len(runs))
    for stage in _stages(cases) if budget or longest else [cases]:
        kept = [(curve, both) for curve, both in stage if _affordable(curve, both[0], budget, longest, len(stage))]
        cases_now = [*pending, *(case for _, both in kept for case in both)]
        results = runner.run(cases_now, progress, budget, {case.key: -1 for case in pending})  # the truth begins first
        for case in pending:
            if results[case.key].status != Status.DONE:
                raise ProofrollError(f"there is no truth here: {results[case.key].message}")
            references[question.every] = question.reference(runner.store.stored(case).dataset, question.every)
        pending = []
        for every in {case.every for _, both in kept for case in both} - references.keys():
            references[every] = question.reference(references[question.every].dataset, every)
        for curve, both in kept:
            points = [CurvePoint(case, results[case.key]) for case in both]
            lost = next((point for point in points if point.result.status is Status.LEFT_OUT), None)
            if lost is None:
                curve.points.append(judge_point(points, references, runner))
            else:
                curve.dropped[lost.step or 0.0] = lost.result.message


def _stages(cases: Sequence[tuple[Curve, tuple[Case, ...]]]) -> list[list[tuple[Curve, tuple[Case, ...]]]]:
    """Runs in turns: the first of every curve, then the second of every curve, and so on."""
    turns: dict[str, list[tuple[Curve, tuple[Case, ...]]]] = {}
    for curve, both in cases:
        turns.setdefault(curve.engine, []).append((curve, both))
    return [[item for item in turn if item] for turn in itertools.zip_longest(*turns.values())]


def too_long(longest: float) -> str:
    """Reason why a step is dropped whose run would take more than ``longest`` [s]."""
    return f"runs of more than {longest:g} s of processor time are left out of a brief study"


def _affordable(curve: Curve, case: Case, budget: TimeBudget | None, longest: float | None, abreast: int) -> bool:
    """True if a run is expected to fit its share of the budget and the longest run, from the time of the curve's last.

    Otherwise its step is dropped with a reason. The longest run bounds none of the first two, as the first may compile.
    """
    if not curve.points:
        return not (budget and curve.dropped)
    last, step = curve.points[-1], CurvePoint(case, curve.points[-1].result).step
    finer = (last.step or 1.0) / (step or 1.0)
    expected = last.result.processor.get("advance", 0.0) * (finer if curve.fixed_step or finer < 1 else _TIGHTER)
    if longest and expected > longest and len(curve.points) > 1:
        curve.dropped[step or 0.0] = too_long(longest)
    elif budget and expected > _OF_RUNS * budget.left / abreast:
        curve.dropped[step or 0.0] = budget.sentence
    else:
        return True
    return False
