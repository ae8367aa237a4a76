"""Answer for a person's own step: whether it is good enough for a tolerance, and which one would do."""

import math
from collections.abc import Sequence
from dataclasses import replace

from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.multi_element import represents
from proofroll.core.number_format import number
from proofroll.core.plugins import EngineSpec, parse_engine
from proofroll.running.case import EngineFacts, Status
from proofroll.running.engine_questions import on_scene, resolve_with_truth
from proofroll.running.process import processor_seconds
from proofroll.running.runner import Runner
from proofroll.studies.answer.answers import answered_scene, engine_answer, spec_of, speeds_alone
from proofroll.studies.answer.question import AnswerQuestion
from proofroll.studies.answer.records import StepAnswer
from proofroll.studies.answer.search import EngineSearch, SearchesAbreast, searching
from proofroll.studies.answer.setting_search import SettingSearch, State
from proofroll.studies.judging.asked_tolerance import AskedTolerance
from proofroll.studies.judging.reference import OWN_STEPS
from proofroll.studies.study_store import conditions_now

# Halvings from the coarsest step that is run to the person's own: samples are at whole steps of its double and of four
# times it. A relative tolerance is made looser by as many decades, up to the loosest that asks for anything.
_COARSER = 2
_LOOSEST = 0.1


def engine_facts(engine: str, question: AnswerQuestion, runner: Runner) -> tuple[EngineFacts, EngineFacts]:
    """Complete settings of an engine for the scene of a question, and those of the truth.

    Raises:
        ProofrollError: an unknown engine or setting, or a missing engine.
    """
    spec = parse_engine(engine)
    requires = question.loaded.requires
    (facts,), truth = resolve_with_truth([(spec.name, spec.options)], runner.workers, requires)
    if isinstance(facts, ProofrollError):
        raise facts
    if facts.resolution is None:
        raise InputError("engine", engine, "it has no step that could be good enough; leave out --tolerance")
    return facts.on(requires), on_scene(truth, question.loaded, runner.workers)


def step_answer(
    question: AnswerQuestion, asked: AskedTolerance, engine: str, facts: Sequence[EngineFacts], runner: Runner
) -> StepAnswer:
    """Answer for the step of an engine: its error, and the coarsest step of the same setting that holds.

    Args:
        question: whose samples are at whole steps of it.
        asked: tolerance.
        engine: ``name[key=value,…]``.
        facts: complete settings of the engine, and those of the truth.
        runner: runs the cases.

    Raises:
        ProofrollError: there is no truth.
    """
    begin = processor_seconds()
    own, truth = facts
    resolution = own.resolution or ""
    question, references = question.well_posed(truth, runner)
    abreast = SearchesAbreast(references, runner)
    reference = abreast.references[question.every]
    answered = answered_scene(question, asked, reference)
    if own.formulated == reference.by_steps:
        answered = replace(answered, open=answered.open or OWN_STEPS)
    spec = parse_engine(engine)
    options = {key: value for key, value in spec.options.items() if key != resolution}
    size = float(own.settings[resolution])
    coarser = _COARSER if own.step is not None else max(0, min(_COARSER, round(math.log10(_LOOSEST / size))))
    item = SettingSearch(
        spec=str(EngineSpec(spec.name, options)),
        facts=own,
        first=size * (2.0 if own.step is not None else 10.0) ** coarser,
        until=question.until,
        allowed=answered.allowed,
        sizes=answered.sizes,
        start=coarser,
    )
    search = EngineSearch(own.name, [item])
    formulation = str(own.settings.get("formulation"))
    if not represents(question.loaded, formulation, own.provides):
        lacking = ", ".join(sorted(question.loaded.requires - set(own.provides.get(formulation, ()))))
        search = EngineSearch(own.name, [], f"{formulation.replace('_', ' ')} lacks {lacking}")
    elif not answered.open:
        abreast.run([searching(search, question)])
    run = item.runs.get(item.divisor(coarser))
    worst = run.worst(item.allowed) if run else ""
    error = run.errors.get(worst, math.inf) if run else math.inf
    within = run is not None and item.size(item.divisor(coarser)) <= 1
    compared = [(item, made) for made in (run, item.chosen) if item.chosen and made and made.status is Status.DONE]
    speeds = speeds_alone({spec_of(*pair): pair for pair in compared}, question, abreast)
    advised = engine_answer(search, answered.bounds, speeds)
    luck, finer = item.unsafe.get(coarser, "").rpartition("holds by luck: ")[2], item.divisor(coarser + 1)
    if not luck and finer in item.runs and item.size(finer) > 1:
        part = "half" if item.fixed_step else "a tenth"
        luck = f"{part} of it is off by {number(item.size(finer))} times what is allowed"
    cost = speeds.get(spec_of(item, run), run.cost) if run else math.inf
    return StepAnswer(
        **vars(answered),
        spec=engine,
        resolution=resolution,
        step=size,
        holds=within and not luck and item.state is State.HOLDS and (item.level or 0) <= coarser,
        luck=luck if within else "",
        bound=next((bound for bound in answered.bounds if bound.quantity == worst), None),
        error=error if math.isfinite(error) else None,
        status=str(run.status) if run else "",
        message=run.message if run else "",
        reached=run.reached if run else 0.0,
        held_until=run.held_until(item.allowed) if run else 0.0,
        seconds_per_second=cost if math.isfinite(cost) else None,
        advised=advised,
        spent=processor_seconds() - begin,
        measured=conditions_now(),
    )
