"""Parts of an error by the options of a person's own file, each switched where that takes most of the error away."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from proofroll.core.number_format import number, spaced
from proofroll.core.observable import Role
from proofroll.core.plugins import parse_engine
from proofroll.core.verdict import Verdict
from proofroll.files.scene_sources import options_of, parts_of
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.engine_questions import resolve
from proofroll.running.runner import Runner
from proofroll.running.time_budget import TimeBudget
from proofroll.studies.comparison.default_comparison import OWN_OPTIONS
from proofroll.studies.comparison.outcome import Outcome, Run
from proofroll.studies.comparison.planning import point_name
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference

_MOST, _SECONDS = 20, 15.0  # runs, and processor time of them [s]
_LESS = 0.99  # part of an error that the last switch leaves at most; one that changes no more than the rest has no line
_JUDGED = {Verdict.AGREES, Verdict.DIFFERS, Verdict.CONVERGES, Verdict.UNCONFIRMED}


def own_path(outcome: Outcome, runner: Runner, spent: float) -> list[str]:
    """Lines on what the options of a scene's own file do to the quantity that is furthest off, and on the rest.

    Empty without a judged row of the file's options, and without contacts where that row does not differ. Each line has
    one further option switched, the one that takes most of the error away, or adds least. It takes what the
    comparison's budget leaves.

    Args:
        outcome: of the comparison.
        runner: of its cases.
        spent: processor time of the comparison [s].
    """
    run = next((run for run in outcome.runs if run.row.short.startswith(OWN_OPTIONS)), None)
    own_options = options_of(Path(parts_of(outcome.comparison.scene)[0])) if run else None
    if run is None or own_options is None or run.case is None or run.facts is None or run.verdict not in _JUDGED:
        return []
    reference = outcome.points[point_name(run.parameters)].reference
    of_contacts = own_options.of_contacts.keys() <= run.facts.settings.keys()
    if reference is None or not (of_contacts or run.verdict is Verdict.DIFFERS):
        return []
    left = {words: made for words, made in own_options.switches.items() if made.keys() <= run.facts.settings.keys()}
    off = _off(reference, run, runner)
    if off is None:
        return []
    quantity, error, bar = off
    given = outcome.comparison.budget
    seconds = _SECONDS if given is None else max(0.0, min(_SECONDS, given - spent))
    spec, runs, budget = parse_engine(run.row.engine), 0, TimeBudget(seconds)
    unit, options = spaced(reference.scene.observables[quantity].unit), dict(spec.options)
    steps, without_effect = list[tuple[str, float, float]](), list[str]()
    while left and error > bar and runs + len(left) <= _MOST:
        cases = _cases(run, spec.name, {words: {**options, **changes} for words, changes in left.items()}, runner)
        results = runner.run(cases.values(), budget=budget)
        # without those that mean nothing beside what was switched
        left = {words: left[words] for words in cases if results[cases[words].key].status is not Status.REFUSED}
        runs += sum(result.status is not Status.LEFT_OUT for result in results.values())
        errors = {
            words: _errors(reference, [quantity], case, runner)[quantity][0]
            for words, case in cases.items()
            if results[case.key].status is Status.DONE
        }
        best = min(errors, key=lambda words: errors[words], default="")
        if not best:
            break
        steps.append((best, error, errors[best]))
        options, error = {**options, **left.pop(best)}, errors[best]
    while steps and steps[-1][2] > _LESS * steps[-1][1]:
        words, error, _ = steps.pop()
        without_effect.append(words)
    without_effect += [words for words, before, after in steps if abs(after / before - 1) < 1 - _LESS]
    head = f"Options of the file, switched one after the other; worst error of {quantity} ({runs} runs):"
    told = [item for item in steps if item[0] not in without_effect]
    lines = [f"  {words}: {number(before, 2)} → {number(after, 2)}{unit}" for words, before, after in told]
    rest = f"  rest: {number(error, 2)}{unit}"
    for says, switches in (("no less by", without_effect), ("not tried", left)):
        rest += f"; {says}: {'; '.join(switches)}" if switches else ""
    return [head, *lines, rest + ("; within the reference's error bar" if error <= bar else "")]


def _cases(run: Run, name: str, trials: dict[str, dict[str, str]], runner: Runner) -> dict[str, Case]:
    """Cases of a run with other settings, those that exist."""
    assert run.case is not None  # by the caller
    facts = resolve([(name, options) for options in trials.values()], runner.workers)
    return {
        words: replace(run.case, engine=replace(item, lowered={}, families={}), timed=False)
        for words, item in zip(trials, facts, strict=True)
        if isinstance(item, EngineFacts)
    }


def _off(reference: Reference, run: Run, runner: Runner) -> tuple[str, float, float] | None:
    """Quantity that is furthest off by its size, with its error and the reference's bar; None: all are within bars.

    It is one that contradicts, or of a run that agrees a motion.
    """
    assert run.case is not None  # by the caller
    moves = [name for name, item in reference.scene.observables.items() if item.role is Role.MOTION and item.headline]
    wrong = [
        item.observable for item in run.judgements if item.verdict is Verdict.DIFFERS and math.isfinite(item.error)
    ]
    errors = _errors(reference, wrong or moves, run.case, runner)
    beyond = {name: error / (reference.scale(name) or 1.0) for name, (error, bar) in errors.items() if error > bar}
    if not beyond:
        return None
    worst = max(beyond, key=lambda name: beyond[name])
    return worst, *errors[worst]


def _errors(reference: Reference, names: Sequence[str], case: Case, runner: Runner) -> dict[str, tuple[float, float]]:
    """Largest distance of each quantity of a run from the reference, and the reference's error bar, in its unit."""
    dataset = runner.store.stored(case).dataset
    span, runs = reference.common_span({0: dataset})
    curves = run_values.observables_of(span, runs[0])
    return {
        name: (run_values.error(span, name, curves[name], runs[0]), span.true(name, curves[name]).error_bar)
        for name in names
        if name in curves and name in span.curves
    }
