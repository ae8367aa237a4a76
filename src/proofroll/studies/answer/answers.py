"""Makes and stores answers: the search of all engines for a tolerance in a scene, and the speeds of what it found."""

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from proofroll.core.observable import Role
from proofroll.core.plugins import EngineSpec, parse_engine
from proofroll.files.json_data import plain, record
from proofroll.running.case import Status
from proofroll.running.engine_questions import on_scene, resolve_with_truth
from proofroll.running.identity import libraries
from proofroll.running.process import processor_seconds
from proofroll.running.runner import Runner
from proofroll.running.time_budget import TIMING
from proofroll.running.timing import time_in_rounds
from proofroll.studies.answer.judged_run import JudgedRun
from proofroll.studies.answer.question import AnswerQuestion
from proofroll.studies.answer.records import (
    AllowedError,
    AnsweredScene,
    EngineAnswer,
    SceneAnswer,
    SettingTried,
    StepTried,
    ranked,
)
from proofroll.studies.answer.search import (
    EngineSearch,
    SearchesAbreast,
    at_step,
    curves_to_search,
    searching,
    settings_of,
)
from proofroll.studies.answer.setting_search import BRIEF, WHOLE, SearchCaps, SettingSearch, State
from proofroll.studies.judging.asked_tolerance import AskedTolerance, orientations_of
from proofroll.studies.judging.reference import OWN_STEPS, Reference
from proofroll.studies.study_store import conditions_now, keep_study, valid_study
from proofroll.studies.swept_settings import Curve

# Speeds of the cheapest and of all within this factor of it are measured again, one at a time.
_NEAR = 3.0
# Rounds and length of such a measurement [s]; a slower run is measured once.
_ROUNDS, _SECONDS, _ONCE = 2, 0.05, 0.1

Tell = Callable[[EngineAnswer, float], None]
_Answer = TypeVar("_Answer")


def answer(
    question: AnswerQuestion,
    asked: Sequence[AskedTolerance],
    engines: Sequence[str],
    runner: Runner,
    begins: Callable[[Sequence[str]], None] = lambda _: None,
    tell: Tell = lambda _, __: None,
    ran: Callable[[str], None] = lambda _: None,
    caps: SearchCaps = WHOLE,
) -> list[SceneAnswer]:
    """Answers for several tolerances, one after another: what was run for one is not run again for the next.

    Args:
        question: scene, duration and samples.
        asked: tolerances.
        engines: names or ``name[key=value,…]``; empty: all that are installed, without those that check the truth.
        runner: runs the cases.
        begins: called with the names of the engines before the first run.
        tell: called with the answer of an engine as soon as its search has ended, and with the length of its runs [s].
        ran: called with the name of an engine after each of its runs.
        caps: processor time of a run, and of the search of an engine [s].

    Raises:
        InputError: an unknown engine or setting.
        ProofrollError: there is no truth.
    """
    begin = processor_seconds()
    curves, absent = curves_to_search(question, engines, runner.workers)
    begins(list(dict.fromkeys(curve.facts.name for curve in curves)))
    _, truth = resolve_with_truth([], runner.workers)
    truth = on_scene(truth, question.loaded, runner.workers)
    question, references = question.well_posed(truth, runner)
    abreast = SearchesAbreast(references, runner, ran)
    answers = []
    for tolerance in asked:
        spent = processor_seconds() - begin
        answers.append(_answered(question, tolerance, curves, absent, abreast, tell, spent, caps))
        begin = processor_seconds()
    return answers


def _answered(
    question: AnswerQuestion,
    tolerance: AskedTolerance,
    curves: Sequence[Curve],
    absent: Mapping[str, str],
    abreast: SearchesAbreast,
    tell: Tell,
    spent: float,
    caps: SearchCaps,
) -> SceneAnswer:
    """Answer for one tolerance; ``spent``: processor time before it that counts as its own [s]."""
    begin = processor_seconds() - spent
    reference = abreast.references[question.every]
    answered = answered_scene(question, tolerance, reference)
    bounds = answered.bounds
    searches = [] if answered.open else settings_of(question, curves, answered.allowed, answered.sizes, caps)
    for search in searches:
        others = [item for item in search.settings if item.facts.formulated != reference.by_steps]
        if len(others) < len(search.settings):
            search.settings, search.cannot = others, OWN_STEPS
    lacking = [EngineSearch(engine=name, settings=[], cannot=why) for name, why in absent.items()]
    generators = [searching(search, question) for search in searches]
    abreast.run(generators, lambda number: tell(engine_answer(searches[number], bounds), question.until))
    speeds = _speeds(searches, question, abreast)
    return SceneAnswer(
        **vars(answered),
        engines=ranked([engine_answer(search, bounds, speeds) for search in [*searches, *lacking]]),
        spent=processor_seconds() - begin,
        measured=conditions_now(),
        omitted=list(question.loaded.omitted),
    )


def answered_scene(question: AnswerQuestion, asked: AskedTolerance, reference: Reference) -> AnsweredScene:
    """Scene and tolerance of an answer, with the bounds of the judged quantities that the truth knows."""
    observables = reference.scene.observables
    bounds = [
        AllowedError(
            quantity=name,
            unit=observables[name].unit,
            allowed=allowed,
            size=reference.scale(name),
            truth_bar=reference.true(name, reference.curves[name]).error_bar,
            relative=asked.bounds[name].relative,
        )
        for name, allowed in asked.allowed(reference).items()
    ]
    forces = any(observables[bound.quantity].role is Role.REACTION for bound in bounds)
    return AnsweredScene(
        scene=question.scene,
        parameters=question.parameters,
        until=min(question.until, float(reference.dataset.variables["time"].values[-1])),
        every=question.every,
        tolerance=asked.text,
        bounds=bounds,
        unjudged=orientations_of(question.loaded, [bound.quantity for bound in bounds]),
        changes=reference.changes.tolist() if forces else [],
        beyond=question.beyond,
        open=unanswerable_because(bounds, reference),
    )


def unanswerable_because(bounds: Sequence[AllowedError], reference: Reference) -> str:
    """Reason why no engine can be judged; empty: they can."""
    if reference.ill_posed:
        return reference.ill_posed
    if not bounds:
        return "the truth has none of the quantities that are asked for"
    blurred = next((bound for bound in bounds if bound.truth_bar > bound.allowed), None)
    if blurred is None:
        return ""
    return f"the truth itself is known to {blurred.truth_bar:.1g} {blurred.unit} of {blurred.quantity} only"


def _speeds(searches: Sequence[EngineSearch], question: AnswerQuestion, abreast: SearchesAbreast) -> dict[str, float]:
    """Setting with its step -> seconds per simulated second, of the cheapest and those near it, measured alone.

    Runs so short that most of their time in the search may be that of a start are measured, too.
    """
    chosen = {
        spec_of(item): (item, run)
        for search in searches
        for item in search.settings
        if item.state in {State.HOLDS, State.UNCONFIRMED} and (run := item.chosen) is not None
    }
    most = max(_NEAR * min((run.cost for _, run in chosen.values()), default=math.inf), _ONCE / question.until)
    near = {spec: pair for spec, pair in chosen.items() if pair[1].cost <= most}
    return speeds_alone(near, question, abreast)


def speeds_alone(
    runs: Mapping[str, tuple[SettingSearch, JudgedRun]], question: AnswerQuestion, abreast: SearchesAbreast
) -> dict[str, float]:
    """Setting with its step -> seconds per simulated second of its run, measured with no other run beside it.

    It is the least wall time, or the processor time of the search where that is less: others may have the processor.
    What was measured for another tolerance is not measured again.
    """
    speeds, runner, tasks = abreast.speeds, abreast.runner, {}
    with runner.profile.phase(TIMING):
        for spec, (item, run) in runs.items():
            if spec in speeds:
                continue
            facts = at_step(item.facts, run.step)
            case = question.case(facts, question.every, item.caps.run, item.allowed)
            tasks[spec] = partial(runner.workers.speed, case, _SECONDS)
        timings = time_in_rounds(tasks, _ROUNDS, once_above=_ONCE) if tasks else {}
    speeds |= {spec: min(*timing.values, runs[spec][1].cost) for spec, timing in timings.items()}
    return {spec: speeds[spec] for spec in runs if spec in speeds}


def spec_of(item: SettingSearch, run: JudgedRun | None = None) -> str:
    """Setting with the step of its chosen run, or of another run, as a command takes it."""
    spec, run = parse_engine(item.spec), run or item.chosen
    if item.facts.resolution is None or run is None:
        return str(spec)
    return str(EngineSpec(spec.name, {**spec.options, item.facts.resolution: repr(run.step)}))


def engine_answer(
    search: EngineSearch, bounds: Sequence[AllowedError], speeds: Mapping[str, float] | None = None
) -> EngineAnswer:
    """Answer of one engine from its search; ``speeds``: of settings that were measured alone."""
    title = next((item.facts.title for item in search.settings if item.facts.title), search.engine)
    settings = [_setting_tried(item) for item in search.settings]
    nothing = partial(EngineAnswer, engine=search.engine, title=title, spent=search.spent, settings=settings)
    if not search.settings:
        return nothing(state=State.CANNOT, why=search.cannot)
    choice = _fastest(search, speeds or {}) or search.found
    if choice is not None and (run := choice.chosen) is not None:
        return _of_setting(nothing, choice, run, bounds, choice.state, choice.why, speeds or {})
    ran = [item for item in search.settings if item.state in {State.FINER, State.ELSEWHERE}]
    if not ran:
        item = min(search.settings, key=lambda item: _ORDER.index(item.state) if item.state in _ORDER else len(_ORDER))
        return nothing(state=item.state, why=item.why)
    state = State.FINER if any(item.state is State.FINER for item in ran) else State.ELSEWHERE
    pairs = [(item, run) for item in ran if item.state is state for run in item.levels.values()]
    item, nearest = min(pairs, key=lambda pair: (pair[0].size(_divisor(*pair)), pair[1].step))
    return _of_setting(nothing, item, nearest, bounds, state, item.why, {})


def _fastest(search: EngineSearch, speeds: Mapping[str, float]) -> SettingSearch | None:
    """Confirmed setting with the best speed among those that were measured alone; None: none was."""
    timed = [item for item in search.settings if item.state is State.HOLDS and spec_of(item) in speeds]
    return min(timed, key=lambda item: speeds[spec_of(item)], default=None)


_ORDER = (State.SILENT, State.REFUSED, State.NOT_RUN)


def _divisor(item: SettingSearch, run: JudgedRun) -> int:
    return next(divisor for divisor, rival in item.runs.items() if rival is run)


def _of_setting(
    nothing: Callable[..., EngineAnswer], item: SettingSearch, run: JudgedRun, bounds: Sequence[AllowedError],
    state: State, why: str, speeds: Mapping[str, float],
) -> EngineAnswer:  # fmt: skip
    """Answer that names one run of a setting."""
    spec = spec_of(item, run)
    worst = run.worst(item.allowed)
    bound = next((bound for bound in bounds if bound.quantity == worst), None)
    divisor = _divisor(item, run)
    cost = speeds.get(spec, run.cost)
    error = run.errors.get(worst, math.inf)
    return nothing(
        state=state,
        why=why,
        spec=spec,
        formulation=str(item.facts.settings.get("formulation") or ""),
        preset=str(item.facts.settings.get("preset") or ""),
        brought=item.facts.brought,
        caveat=item.facts.caveat,
        resolution=item.facts.resolution or "",
        step=run.step if item.facts.resolution else None,
        seconds_per_second=cost if math.isfinite(cost) else None,
        timed_alone=spec in speeds,
        bound=bound,
        error=error if math.isfinite(error) else None,
        held_until=run.held_until(item.allowed),
        coarser=_step_tried(item, divisor // item.base) if divisor % item.base == 0 else None,
        finer=_step_tried(item, divisor * item.base),
        needs_step=item.needs[0] if item.needs else None,
        needs_seconds=item.needs[1] if item.needs else None,
    )


def _setting_tried(item: SettingSearch) -> SettingTried:
    why = "; ".join(filter(None, [item.why, *item.unsafe.values()]))
    steps = [step for divisor in sorted(item.runs) if (step := _step_tried(item, divisor))]
    return SettingTried(spec=item.spec, state=item.state, why=why, steps=steps, resolution=item.facts.resolution or "")


def _step_tried(item: SettingSearch, divisor: int) -> StepTried | None:
    """Record of a step of a setting; None: it was not run."""
    run = item.runs.get(divisor)
    if run is None:
        return None
    size = run.of_allowed(item.allowed)
    return StepTried(
        step=run.step,
        status=str(run.status),
        of_allowed=size if size is not None and math.isfinite(size) else None,
        reached=run.reached,
        held_until=run.held_until(item.allowed),
        seconds_per_second=run.cost if math.isfinite(run.cost) else None,
        message="" if run.status is Status.DONE else run.message,
    )


def answer_path(
    folder: Path, question: AnswerQuestion, asked: AskedTolerance, engines: Sequence[str] = (), caps: SearchCaps = WHOLE
) -> Path:
    """File of an answer below the folder of results; another one when the program of an engine has changed."""
    programs = [libraries(parse_engine(name).name) for name in sorted(engines)]
    bounds = {name: [bound.value, bound.relative] for name, bound in asked.bounds.items()}
    content = [question.loaded.digest, question.until, question.every, bounds, sorted(engines), programs, *caps]
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:12]
    return folder / "answers" / f"{question.loaded.name}-{digest}.json"


def longest_stored(
    folder: Path, question: AnswerQuestion, asked: AskedTolerance, engines: Sequence[str] = (), *, whole: bool = False
) -> SceneAnswer | None:
    """Stored answer of the longest search, so that every command tells the same; None: there is none.

    ``whole``: not one of a report's briefer searches, unless a longer one would find no more.
    """
    paths = (answer_path(folder, question, asked, engines, caps) for caps in (WHOLE, BRIEF))
    longer, brief = (stored(path, SceneAnswer) for path in paths)
    return longer or (None if brief is not None and whole and brief.is_cut_short else brief)


def stored(path: Path, kind: type[_Answer]) -> _Answer | None:
    """Stored answer, if it is still valid here."""
    return valid_study(path, kind)[0]


def kept(made: SceneAnswer, path: Path) -> SceneAnswer:
    """Answer as it will be read, after it was stored."""
    keep_study(made, path)
    return record(SceneAnswer, plain(made))
