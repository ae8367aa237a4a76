"""Command ``compare``, and the runs of comparisons for ``report``."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from proofroll.cli import options
from proofroll.cli.own_step import answer_steps, stored_sentences
from proofroll.core.number_format import number as written

if TYPE_CHECKING:
    from proofroll.core.comparison import Comparison
    from proofroll.running.case import Case, EngineFacts, Result
    from proofroll.running.runner import Runner
    from proofroll.running.time_budget import TimeBudget
    from proofroll.studies.comparison.outcome import Outcome
    from proofroll.studies.comparison.planning import Plan, Planned

    # Parts of comparisons that are run together: the number of a comparison and cases of it.
    _Phase = list[tuple[int, list[Case]]]

# Processor time that is reserved for the last page and for the start of Python [s].
_PAGE = 8.0


def compare(
    comparison: Annotated[
        str,
        typer.Argument(
            help="A comparison file or its name, e.g. stick_slip; or a scene, a robot file.",
            autocompletion=options.compared_like,
            callback=options.own_first,
        ),
    ],
    engine: Annotated[
        list[str] | None,
        typer.Option(
            help="Only this engine: its name, or name[key=value,…]; repeat.", autocompletion=options.engines_like
        ),
    ] = None,
    settings: options.Set = None,
    _root: options.Root = None,
    control: options.Control = None,
    ground: options.Ground = None,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    budget: options.Budget = None,
    until: options.Until = None,
    tolerance: options.Tolerances = None,
    like: Annotated[
        Path | None,
        typer.Option(help="Your own MuJoCo model, *.xml: are its integrator, step and cone good enough for the scene?"),
    ] = None,
    every: Annotated[
        float | None, typer.Option(help="Interval between samples [s]; by default about a fiftieth of --until.")
    ] = None,
    orders: Annotated[
        bool, typer.Option("--orders", help="Below each setting all judged quantities, with orders and limits.")
    ] = False,
    witnesses: Annotated[
        bool, typer.Option("--witnesses", help="List the solvers that only cross-check the truth, too.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Hold engines against the truth of a scene or comparison. Exit 1 if a verdict contradicts the file.

    Exit 3 if an engine is missing or failed, or if nothing could be judged or decided.

    For a scene or a robot file every formulation that can represent it is run, without claims. --set, --until, --every
    and --budget are for these; runs beyond 60 s of processor time are left out and named. An --engine without a row in
    the file gets a row without claims.

    With --tolerance a scene is judged by it. With --engine, too, the answer is one line for each: whether that step
    is good enough over the scene's own duration, by how much, and which one would do. With --like that is the step of
    your own model, to 1e-4 of the path by default, and the line to change is named.
    """
    options.begin_workers()
    from proofroll.report.comparison.summary import outcome_content
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.report.terminal.verdicts import verdict_parts
    from proofroll.running.idle_workers import Workers
    from proofroll.running.process import processor_seconds
    from proofroll.studies.comparison.by_name import comparison_named

    begin = processor_seconds()
    settings = options.with_ground(settings, control, ground)
    comparison, workers = options.controlled(comparison, control), Workers()
    assigned, bounds = options.assignments(settings), tolerance or []
    if like is not None or (engine and bounds):
        runner = options.new_runner(out, fresh, jobs, scheduler, workers)
        answer_steps(comparison, engine or [], bounds, assigned, until, runner, out, like=like, as_json=as_json)
    with options.spinner(comparison):
        loaded = comparison_named(comparison, assigned, workers, budget, scheduler, engine or [], until, every, bounds)
    mention_absent(loaded.absent)
    if control is not None or settings:
        options.doubt_numbers(comparison, settings)

    def show(outcome: Outcome) -> None:
        content = outcome_content(outcome)
        parts = partial(verdict_parts, content, orders=orders, witnesses=witnesses)
        options.show(content, as_json, lambda: [*cheapest, *parts()], widest=WIDTH)

    runner = options.new_runner(out, fresh, jobs, scheduler, workers)
    cheapest = stored_sentences(loaded, bounds, engine or [], out)
    outcomes = outcomes_of([loaded], engine or [], runner, watched=_Watched(show, moves=not as_json))
    show(outcomes[0])
    if not (engine or as_json):
        from proofroll.studies.comparison.own_path import own_path

        spent = processor_seconds() - begin
        options.show_lines(own_path(outcomes[0], runner, spent), widest=WIDTH)
    raise typer.Exit(exit_code(outcomes))


def mention_absent(absent: Mapping[str, str]) -> None:
    """Prints on standard error which engines are not installed, and how to get them; those of proofroll in one line.

    ``absent``: engine -> why it cannot be loaded.
    """
    ours = [name for name, why in absent.items() if why.endswith(f"pip install 'proofroll[{name}]'")]
    if ours:
        line = f"not installed here, so not compared: {', '.join(ours)}"
        options.complain(f"{line}; pip install 'proofroll[{','.join(ours)}]'")
    for name, why in absent.items():
        if name not in ours:
            options.complain(why)


def list_omitted_engines(comparisons: Sequence[Comparison], engines: Sequence[str]) -> None:
    """Prints a line on standard error for each engine that has no rows in some of the comparisons."""
    from proofroll.core.plugins import parse_engine, plain_name

    rows = {item.name: {parse_engine(row.engine).name for row in item.rows} for item in comparisons}
    asked_for = {name: {name, plain_name(name)} for name in engines}
    asked = set(chain(*asked_for.values()))  # a comparison without any of them is refused elsewhere
    for name, either in asked_for.items():
        without = [comparison for comparison, present in rows.items() if present & asked and not present & either]
        if without:
            warning = f"{name} is left out of {', '.join(without)}: no row is of it"
            options.complain(f"{warning}; proofroll new comparison writes a file with one")


def outcomes_of(
    comparisons: list[Comparison],
    engines: list[str],
    runner: Runner,
    stage: str = "",
    finished: Callable[[dict[int, Outcome], bool], None] | None = None,
    budget: float | None = None,
    spent: float = 0.0,
    *,
    watched: _Watched | None = None,
) -> list[Outcome]:
    """Runs all comparisons with one progress bar, one after the other as far as that leaves no worker idle.

    First the brief parts of all comparisons are run, then their further combinations.

    Args:
        comparisons: in the order of running.
        engines: to which they are restricted; empty: all.
        runner: runs their cases.
        stage: prefix of the bar's text.
        finished: called when a comparison has ended, brief or whole, with all ended ones by number, and True if it is
            the last.
        budget: processor time of all of them [s]. All runs then come before the first ladder, and each comparison has
            an equal share of the time left; what it does not use is for later ones.
        spent: part of the budget that was used before [s].
        watched: shows a single comparison while it runs, and what has ended if the user ends the command.
    """
    from proofroll.running.process import processor_seconds
    from proofroll.running.time_budget import TimeBudget
    from proofroll.studies.comparison.compare import affordable, run_within_budget
    from proofroll.studies.comparison.planning import plan

    begin = processor_seconds() - spent
    with options.spinner(f"{stage}cases"), runner.profile.phase("planning"):
        plans = [affordable(plan(item, engines, runner.workers), runner) for item in comparisons]
    brief = [item.brief for item in plans]
    grown = [(index, item.cases) for index, item in enumerate(plans) if len(item.truths) > len(brief[index].truths)]
    if budget:
        ladders = [(index, item.ladders) for index, item in enumerate(brief)]
        later = {case.key for _, cases in ladders for case in cases}
        runs = [(index, [case for case in item.cases if case.key not in later]) for index, item in enumerate(brief)]
        phases = [phase for phase in (runs, ladders, grown) if phase]
    else:
        phases = [[*((index, item.cases) for index, item in enumerate(brief)), *grown]]
    owner = {case.key: index for index, item in reversed([*enumerate(plans)]) for case in item.cases}
    limit = TimeBudget(budget, processor_seconds() - begin, owner) if budget else None
    if limit and finished:
        limit.after += _PAGE
    running = _Comparing(plans, runner, limit, finished)
    try:
        with watched.screen(running) if watched else options.progress_bar(f"{stage}cases", total=len(owner)) as advance:
            running.tell = lambda text: advance(f"{stage}{text}", total=len(running.keys))
            for item in plans:
                running.results |= run_within_budget(item, runner, running.add)
            for phase in phases:
                running.run(phase, last=phase is phases[-1])
    except KeyboardInterrupt:
        if watched:
            running.show_ended(watched.show)
        raise
    if not finished:
        for index in range(len(plans)):
            running.judge(index)
    if runner.damaged:
        options.complain(f"{len(runner.damaged)} stored results were damaged and have been run again")
    return [running.ended[index] for index in range(len(plans))]


class _Comparing:
    """Comparisons whose cases are being run in phases.

    Args:
        plans: of the comparisons.
        runner: runs their cases.
        limit: processor time of all of them, or None.
        finished: see :func:`outcomes_of`.

    Attributes:
        tell: called with the bar's text after each case.
        keys: of all cases that are run.
    """

    def __init__(
        self,
        plans: list[Plan],
        runner: Runner,
        limit: TimeBudget | None,
        finished: Callable[[dict[int, Outcome], bool], None] | None,
    ) -> None:
        self.plans, self.runner, self.limit, self.finished = plans, runner, limit, finished
        self.keys = {case.key for item in plans for case in item.cases}
        self.tell: Callable[[str], None] = lambda _: None
        self.results: dict[str, Result] = {}
        self.ended: dict[int, Outcome] = {}
        self._judged: dict[int, int] = {}
        self._judging = 0.0
        self._truths = {case.key for item in plans for case in item.truths.values()}
        self._start, self._reused = time.monotonic(), runner.reused
        self._budget = limit.left if limit else 0.0

    @property
    def so_far(self) -> dict[str, Result]:
        """Results by key; of cases that have not ended that they were left out."""
        from proofroll.running.case import Result, Status

        return dict.fromkeys(self.keys, Result(Status.LEFT_OUT, "it has not been run yet")) | self.results

    def judge(self, index: int) -> None:
        """Judges a comparison by the cases that have been run so far."""
        from proofroll.studies.comparison.compare import evaluate, left_out

        self._judged[index] = self._known(index)
        so_far = self.so_far
        with self.runner.profile.phase("judging"):
            outcome = evaluate(self.plans[index].ended(left_out(so_far)), so_far, self.runner)
        if self._judged[index] < len(self.plans[index].cases):
            outcome = replace(outcome, beyond_budget=[])  # missing cases are not left out yet
        self.ended[index] = outcome

    def add(self, case: Case, result: Result) -> None:
        """Keeps a result, and updates the bar's text."""
        self.results[case.key] = result
        self._tell(case)

    def show_ended(self, show: Callable[[Outcome], None]) -> None:
        """Shows each comparison with a run that has ended, judged by what there is."""
        for index, item in enumerate(self.plans):
            if any(case.key in self.results for run in item.runs for case in run.ladder.values()):
                self.judge(index)
                show(self.ended[index])

    def _known(self, index: int) -> int:
        """Number of a comparison's cases that have ended, also as cases of other comparisons."""
        return sum(case.key in self.results for case in self.plans[index].cases)

    def run(self, phase: _Phase, *, last: bool) -> None:
        """Runs the cases of one phase, in order, and judges each comparison when its cases have ended.

        ``last``: True if no phase follows.
        """
        from proofroll.running.case import Status
        from proofroll.studies.comparison.compare import settled

        priority, awaited = self._priorities(phase), self._awaited(phase)
        postponed: list[Case] = []

        def arrived(case: Case, result: Result) -> None:
            self.add(case, result)
            for _, keys in awaited:
                keys.discard(case.key)
            self._judge_ended(awaited, last=last)

        def arrived_first(case: Case, result: Result) -> None:
            if result.status is Status.LEFT_OUT:
                postponed.append(case)
            else:
                arrived(case, result)

        def run(keys: set[str]) -> None:
            wanted = keys - self.results.keys()
            cases = {case.key: case for _, items in phase for case in items if case.key in wanted}
            # Cases beyond their comparison's share are tried again with the time that the others left.
            self.runner.run(cases.values(), arrived_first if self.limit else arrived, self.limit, priority)
            self.runner.run(postponed, arrived, self.limit, priority)
            postponed.clear()

        run({case.key for item in self.plans for case in item.first_cases})
        self.plans = [settled(item, self.results, self.runner) for item in self.plans]
        self.keys = {case.key for item in self.plans for case in item.cases}
        for _, keys in awaited:
            keys.intersection_update(self.keys)
        run(self.keys)
        self._judge_ended(awaited, last=last)

    def _priorities(self, phase: _Phase) -> dict[str, int]:
        """Key of a case -> its priority: by comparison, truths first."""
        parts = reversed([*enumerate(phase)])
        return {case.key: 2 * number + (case.key not in self._truths) for number, (_, items) in parts for case in items}

    def _awaited(self, phase: _Phase) -> list[tuple[int, set[str]]]:
        """Number of each comparison that has to be judged in a phase, and keys of its cases without a result."""
        parts = [(index, {case.key for case in items} - self.results.keys()) for index, items in phase]
        return [(index, keys) for index, keys in parts if keys or self._judged.get(index) != self._known(index)]

    def _judge_ended(self, awaited: list[tuple[int, set[str]]], *, last: bool) -> None:
        """Judges comparisons that await no case any more, and removes them from ``awaited``."""
        if self.finished is None:
            return
        ended = [index for index, keys in awaited if not keys]
        awaited[:] = [part for part in awaited if part[1]]
        for number, index in enumerate(ended, start=1):
            begin = time.process_time()
            self.judge(index)
            self.finished(self.ended, last and not awaited and number == len(ended))
            self._judging += time.process_time() - begin
            self._keep_for_the_end()

    def _keep_for_the_end(self) -> None:
        """Reserves time in the budget for judging and writing everything once more, by the time per case so far."""
        if self.limit and (judged := sum(self._judged.values())):
            self.limit.after = max(self.limit.after, self._judging / judged * len(self.results))

    def _tell(self, case: Case) -> None:
        """Updates the bar's text: comparisons that have ended, estimated time left, engine that ran."""
        # Reused results are counted before their cases arrive here, so the difference may be negative.
        many, ran = len(self.plans), max(0, len(self.results) - (self.runner.reused - self._reused))
        left = (time.monotonic() - self._start) / ran * (len(self.keys) - len(self.results)) if ran else 0.0
        if self.limit and (used := self._budget - self.limit.left) > 0:
            # On a machine that does other things, too, processor time passes slower. The rest is judged in the end.
            left = min(left, (self.limit.left + self.limit.after) * (time.monotonic() - self._start) / used)
        ended = sum(self._known(index) == len(item.cases) for index, item in enumerate(self.plans))
        counts = f"{ended} of {many} comparisons ended, " if many > 1 else ""
        self.tell(f"{counts}{f'about {float(written(left, 1)):g} s left, ' if ran else ''}{_words(case.engine)}")


def _words(engine: EngineFacts) -> str:
    """Engine, formulation and step of a case for a reader."""
    from proofroll.report.labels import engine_words, step

    size = step(engine.resolution, engine.settings.get(engine.resolution or ""))
    return ", ".join(filter(None, (engine_words(engine.name, engine.settings.get("formulation")), size)))


class _Watched:
    """A comparison on a terminal: each row when its runs have ended, above a line of progress that is overwritten.

    Both are removed at the end, when the whole answer takes their place. Elsewhere progress is a line now and then.

    Args:
        show: prints the comparison when it has ended, or the part of it that has.
        moves: False to show nothing before that.
    """

    def __init__(self, show: Callable[[Outcome], None], *, moves: bool) -> None:
        self.show, self._moves = show, moves
        self._lines: list[Any] = []
        self._told: set[int] = set()

    @contextmanager
    def screen(self, running: _Comparing) -> Iterator[Callable[..., None]]:
        """Context manager with the rows and the line on standard error; yields a function that updates them."""
        texts = ["starting"]

        def line() -> str:
            return f"{len(running.results)} of {len(running.keys)} runs, {texts[-1]}"

        with options.growing(lambda: self._lines, line, shown=self._moves) as moves:

            def update(text: str, **_: int) -> None:
                texts[:] = [text]
                if moves:
                    self._add_rows(running)

            yield update

    def _add_rows(self, running: _Comparing) -> None:
        """Adds the rows all of whose runs have ended, each once."""
        from proofroll.report.comparison.summary import outcome_content
        from proofroll.report.terminal.verdicts import row_lines
        from proofroll.studies.comparison.compare import evaluate

        (planned,) = running.plans
        rows: dict[int, list[Planned]] = {}
        for run in [run for run in planned.runs if not run.witness] or planned.runs:
            rows.setdefault(id(run.row), []).append(run)
        for key, runs in rows.items():
            if key in self._told or not all(run.keys(planned.truths) <= running.results.keys() for run in runs):
                continue
            self._told.add(key)
            content = outcome_content(evaluate(replace(planned, runs=runs), running.so_far, running.runner))
            self._lines += row_lines(content.rows[0], content.runs, content.rows)


def exit_code(outcomes: list[Outcome]) -> int:
    """Exit code: 3 if an engine was lost, nothing judged, or no contact reached; 1 if a verdict is wrong; else 0."""
    if any(outcome.lost or outcome.no_contact for outcome in outcomes):
        return options.ENGINE
    return options.CONTRADICTED if any(outcome.contradictions for outcome in outcomes) else options.OK
