"""The search of an engine over all its settings and steps, and the searches of several engines side by side."""

import heapq
import math
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from proofroll.core.multi_element import represents
from proofroll.core.plugins import parse_engine
from proofroll.files.json_data import plain
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.studies.answer.judged_run import JudgedRun, judged_run
from proofroll.studies.answer.question import AnswerQuestion
from proofroll.studies.answer.setting_search import LOOSEST, SearchCaps, SettingSearch, State
from proofroll.studies.judging.reference import Reference
from proofroll.studies.swept_settings import Curve, curves_of

# Wall time of a run over its cap of processor time, and least limit of a run that should be cheap [s].
_LIMIT, _LEAST_LIMIT = 1.6, 6.0
# Doublings of a preset's own step with which a search begins: a bound from a quarter of the steps may be enough.
_COARSER = 2
# A coarser step may take this many times as long as the one that holds.
_DEARER = 3.0

Asking = Generator[Case, JudgedRun, None]


@dataclass
class EngineSearch:
    """Search of one engine for one tolerance.

    Attributes:
        engine: its name.
        settings: searches along its settings; empty if none can represent the scene.
        cannot: why there is no setting.
        spent: processor time of the runs that it used [s].
    """

    engine: str
    settings: list[SettingSearch]
    cannot: str = ""
    spent: float = 0.0

    @property
    def found(self) -> SettingSearch | None:
        """Cheapest setting with a step that holds, confirmed ones first; None: there is none."""
        holding = [item for item in self.settings if item.state in {State.HOLDS, State.UNCONFIRMED} and item.chosen]
        sure = [item for item in holding if item.state is State.HOLDS]
        return min(sure or holding, key=lambda item: item.chosen.cost if item.chosen else math.inf, default=None)


def settings_of(
    question: AnswerQuestion,
    curves: Sequence[Curve],
    allowed: Mapping[str, float],
    sizes: Mapping[str, float],
    caps: SearchCaps,
) -> list[EngineSearch]:
    """Searches of engines, not yet begun, over the settings that can represent the scene.

    Settings that differ in the name of their preset alone are one.

    Args:
        question: of the answer.
        curves: one for each formulation and preset.
        allowed: observable -> largest error.
        sizes: observable -> size.
        caps: processor time of a run, and of the search of an engine [s].
    """
    scene = question.loaded
    searches: dict[str, EngineSearch] = {}
    seen: set[str] = set()
    for curve in curves:
        facts = curve.facts
        of_engine = searches.setdefault(facts.name, EngineSearch(facts.name, []))
        formulation = str(facts.settings.get("formulation"))
        if not represents(scene, formulation, facts.provides):
            lacking = sorted(scene.requires - set(facts.provides.get(formulation, ())))
            of_engine.cannot = of_engine.cannot or f"{formulation.replace('_', ' ')} lacks {', '.join(lacking)}"
            continue
        alike = {key: value for key, value in facts.settings.items() if key not in {"preset", facts.resolution}}
        if (key := f"{facts.name} {plain(alike)!r}") in seen:
            continue
        seen.add(key)
        item = SettingSearch(
            spec=curve.engine,
            facts=facts,
            first=question.every if facts.resolution == "dt" else LOOSEST,
            until=question.until,
            allowed=allowed,
            sizes=sizes,
            caps=caps,
            given=float(facts.settings[facts.resolution]) if facts.resolution and curve.fixed else None,
        )
        if facts.step is not None and item.given is None:
            item.start = max(0, round(math.log2(question.every / facts.step)) - _COARSER)
        of_engine.settings.append(item)
    return list(searches.values())


def curves_to_search(
    question: AnswerQuestion, engines: Sequence[str], workers: Workers
) -> tuple[list[Curve], dict[str, str]]:
    """Formulations and presets of engines, and engine without one -> reason.

    Engines that only cross-check the truth are left out unless they are named.

    Args:
        question: of the answer.
        engines: names or ``name[key=value,…]``; empty: all that are installed.
        workers: pool for the questions to engines.

    Raises:
        InputError: an unknown engine, formulation or setting.
    """
    curves, absent = curves_of(engines, workers, question.loaded.requires)
    curves = [curve for curve in curves if engines or not curve.facts.witness]
    names = {curve.facts.name for curve in curves}
    reasons = {parse_engine(text).name: why for text, why in absent.items()}
    reasons = {name: why for name, why in reasons.items() if name not in names}
    described = zip(reasons, resolve([(name, {}) for name in reasons], workers), strict=True)
    witnesses = {name for name, facts in described if isinstance(facts, EngineFacts) and facts.witness}
    return curves, {name: why for name, why in reasons.items() if engines or name not in witnesses}


def searching(search: EngineSearch, question: AnswerQuestion) -> Asking:
    """Search of an engine as a generator: it yields cases, and is sent their runs.

    What can still be cheapest is run next. As soon as a confirmed step is cheaper than all bounds, the other settings
    are dearer, without a further run.
    """
    queue = [(0.0, 0, number) for number in range(len(search.settings))]  # of equal bounds the one with fewer runs
    best = math.inf
    while queue:
        least, _, number = heapq.heappop(queue)
        item = search.settings[number]
        if least >= best:
            item.decide(State.DEARER, "any step that may hold costs more than this engine's choice")
            continue
        divisor = item.next_divisor(item.caps.engine - search.spent)
        if divisor is None:
            if item.state is State.HOLDS and item.chosen is not None:
                best = min(best, item.chosen.cost)
            continue
        run = yield from _run(item, divisor, question)
        search.spent += run.spent
        item.runs[divisor] = run
        heapq.heappush(queue, (item.least, len(item.runs), number))


def _run(item: SettingSearch, divisor: int, question: AnswerQuestion) -> Generator[Case, JudgedRun, JudgedRun]:
    """Run of a setting with a step; of a scheme that adapts its steps with the larger error of few samples, too."""
    facts = at_step(item.facts, item.step(divisor))
    limit = _LIMIT * item.caps.run
    least = min((run.cost for run in item.runs.values() if run.status is Status.DONE), default=math.inf)
    if all(divisor < finer for finer in item.runs) and math.isfinite(least):
        limit = min(limit, max(_LEAST_LIMIT, _DEARER * least * question.until))
    run = yield question.case(facts, question.every, limit, item.allowed)
    if facts.resolution in {None, "dt"} or run.status is not Status.DONE:
        return run
    return run.with_sparse((yield question.case(facts, question.sparse, limit, item.allowed)))


def at_step(facts: EngineFacts, step: float) -> EngineFacts:
    """Facts of an engine with another step or relative tolerance."""
    if facts.resolution is None:
        return facts
    return replace(facts, settings=facts.settings | {facts.resolution: step})


@dataclass
class SearchesAbreast:
    """Generators of cases whose runs are made side by side, each by its own next case.

    Args:
        references: sampling interval [s] -> truth.
        runner: runs the cases.
        ran: called after each run with the name of its engine.

    Attributes:
        known: key of a case -> its run, also from earlier searches.
        speeds: setting with its step -> seconds per simulated second, as far as they were measured alone.
    """

    references: Mapping[float, Reference]
    runner: Runner
    ran: Callable[[str], None] = lambda _: None
    known: dict[str, JudgedRun] = field(default_factory=dict)
    speeds: dict[str, float] = field(default_factory=dict)

    def run(self, generators: Sequence[Asking], ended: Callable[[int], None] = lambda _: None) -> None:
        """Runs generators to their ends.

        Args:
            generators: of cases.
            ended: called with the number of each generator that has ended.
        """
        waiting: dict[str, int] = {}

        def advance(number: int, run: JudgedRun | None) -> list[Case]:
            generator = generators[number]
            try:
                case = next(generator) if run is None else generator.send(run)
                while case.key in self.known:
                    case = generator.send(self.known[case.key])
            except StopIteration:
                ended(number)
                return []
            waiting[case.key] = number
            return [case]

        def arrived(case: Case, result: Result) -> list[Case]:
            run = judged_run(case, result, self.references[case.every], self.runner.store)
            self.known[case.key] = run
            self.ran(case.engine.name)
            return advance(waiting.pop(case.key), run)

        self.runner.follow([case for number in range(len(generators)) for case in advance(number, None)], arrived)
