"""Command ``report``: comparisons and further studies on pages."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.cli.answering import require_tolerances, search_answers
from proofroll.cli.comparing import exit_code, list_omitted_engines, outcomes_of

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from proofroll.core.comparison import Comparison
    from proofroll.report.changes import EarlierReport
    from proofroll.report.page.growing import Report
    from proofroll.report.page.records import ReportContent
    from proofroll.report.parts import Part
    from proofroll.running.runner import Runner
    from proofroll.studies.comparison.outcome import Outcome

# Part of the processor time that writing unfinished pages may take, and processor time after which further studies that
# were made are written [s].
_WRITING, _UNWRITTEN = 0.01, 30.0


def report(
    studies: Annotated[
        list[str] | None,
        typer.Argument(
            help="Comparisons, other studies, scenes, robot files; by default the main ones, see below.",
            callback=options.own_first,
        ),
    ] = None,
    engine: options.Engines = None,
    settings: options.Set = None,
    _root: options.Root = None,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    budget: Annotated[
        float | None,
        typer.Option(min=1, help="Processor-seconds; without names all comparisons there are, in folders too."),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(help="Groups of scenes or folders, as loops,peers: all comparisons of these, no studies."),
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            "--tolerance",
            help="Of the first screen: 1e-4 of the path, '0.1 %', '1 mm'; repeat. By default 1e-4 and 1e-2.",
        ),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(help="An earlier report.json: tells what changed; exit 1 if a verdict, an error or a cost did."),
    ] = None,
    comment: options.Comment = None,
    profile: Annotated[
        bool, typer.Option("--profile", help="Print processor-seconds by phase, workers included, at the end.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Run the comparisons and studies, and write a page of them. It is report.html, beside report.json.

    Without names it makes the main comparisons, which lie in the folder of studies itself, and all further studies but
    those on request. Comparisons in folders inside, as mechanisms/pendulum, are left out and named. The files are
    written after the first comparison, again now and then, after all comparisons and after each further study. If a
    report is stopped (Ctrl-C), finished comparisons are kept; the same command continues from there. A stored study
    that is valid is used; otherwise a brief one is made, as of a comparison marked brief, and the report names the
    command that makes it whole. With --budget every comparison is brief first and grows while there is time; when the
    budget is used, no further study begins. What is left out is named. --set is for scenes and robot files.

    For the first screen each engine is searched in each scene as by ``recommend``; 30 s of processor time at most each.
    """
    options.begin_workers()
    from dataclasses import replace

    from proofroll.core.errors import InputError
    from proofroll.files.comparison_file import comparison_names, further_comparison_names
    from proofroll.files.scene_sources import command_line
    from proofroll.report.page.growing import begun
    from proofroll.report.parts import all_parts, parts_of
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.report.terminal.tables import profile_lines, report_lines
    from proofroll.running.idle_workers import Workers
    from proofroll.running.store import alone_in
    from proofroll.studies.comparison.by_name import comparison_named

    begin, earlier, workers = _processor_seconds(), _earlier(against, comment), Workers()
    assigned = options.assignments(settings)
    if budget and scheduler:
        raise InputError("--budget", budget, "runs on a cluster have none; drop --scheduler")
    left_out = [] if studies or only or budget else further_comparison_names()
    all_names = [*comparison_names(), *([] if left_out else further_comparison_names())]
    names, parts = parts_of(studies, engine or [], out) if studies else (all_names, all_parts(engine or [], out))
    names, parts = (_of_groups(names, only), []) if only else (names, parts)
    if assigned and (parts or not studies):
        raise InputError(
            "--set", next(iter(assigned)), "studies have their own points; name scenes or robot files alone"
        )
    loaded = [comparison_named(name, assigned, workers, None, scheduler) for name in names]
    if budget or not studies:
        loaded = [replace(item, budget=None) if budget else item.briefly() for item in loaded]
    _require(tolerance or [], loaded)
    runner, chosen = options.new_runner(out, fresh, jobs, scheduler, workers), engine or []
    list_omitted_engines(loaded, chosen)
    total = len({part.key for part in parts}) + 2 * bool(loaded)
    command = command_line(
        "report", *(studies or []), engine=engine, set=settings, budget=budget, only=only, tolerance=tolerance, out=out
    )
    with alone_in(out, lambda: options.complain(f"another report is being made in {out}; this one waits for it")):
        growing = _Growing(loaded, parts, out, lambda ended, awaited: begun(ended, command, awaited, left_out), runner)
        with growing.resumable(), runner.profile.phase("comparisons"):
            outcomes: list[Outcome] = []
            if loaded:
                stage, spent = _begin(1, total, "comparisons"), _processor_seconds() - begin
                outcomes = outcomes_of(loaded, chosen, runner, stage, growing.add, budget, spent)
        with runner.profile.phase("page"):
            made = begun(outcomes, command, left_out=left_out)
            missing = _expected(made, earlier, parts, out, fresh=fresh)
        rest = (lambda: budget - _processor_seconds() + begin) if budget else None
        stage = _begin(2, total, "the cheapest of each engine") if outcomes else ""
        with runner.profile.phase("search"):
            search_answers(made, outcomes, tolerance or [], chosen, runner, out, rest, stage)
        unmade = _make_all(made, parts, missing, runner, out, rest)
        _comment(comment, made.content)
        options.show(made.content, as_json, lambda: report_lines(made.content, out), widest=WIDTH)
    _tell(profile_lines(runner.profile) if profile else ())
    raise typer.Exit(_exit_code(made.content, exit_code(outcomes), unmade))


def _require(tolerances: list[str], comparisons: list[Comparison]) -> None:
    """Reads the templates before the work, during which their files may change.

    Raises:
        InputError: no scene takes a tolerance.
        Missing: a package that draws pages is not installed.
    """
    from proofroll.report.page.html import templates

    require_tolerances(tolerances, comparisons)
    options.require_pages()
    templates()


def _tell(lines: Iterable[str]) -> None:
    for line in lines:
        options.complain(line)


def _expected(made: Report, earlier: EarlierReport | None, parts: list[Part], out: Path, *, fresh: bool) -> list[Part]:
    """Writes a report of comparisons, with the stored further studies; returns those that must be made."""
    made.earlier = earlier
    missing = made.expect(parts, out, fresh=fresh)
    made.write(out)
    return missing


def _comment(comment: Path | None, content: ReportContent) -> None:
    """Writes the changes since an earlier report in Markdown, if that is asked for."""
    if comment is not None and content.against is not None:
        from proofroll.running.store import write_text

        write_text(comment, content.against.markdown)


def _earlier(against: Path | None, comment: Path | None) -> EarlierReport | None:
    """Earlier report, or None. Raises InputError for a comment without one, or one that cannot be written."""
    from proofroll.core.errors import InputError
    from proofroll.report.changes import EarlierReport

    if comment is not None:
        if against is None:
            raise InputError("--comment", comment, "it is for changes since an earlier report: give --against, too")
        options.require_writable(comment, "--comment")
    return EarlierReport.read(against) if against else None


def _processor_seconds() -> float:
    from proofroll.running.process import processor_seconds

    return processor_seconds()


class _Growing:
    """Page of a report while its comparisons run: written when the first has ended, and repeatedly after that."""

    def __init__(
        self,
        comparisons: list[Comparison],
        parts: list[Part],
        out: Path,
        made: Callable[[list[Outcome], list[str]], Report],
        runner: Runner,
    ) -> None:
        self._runner = runner
        self._comparisons, self._parts, self._out, self._made = comparisons, parts, out, made
        self._ended: dict[int, Outcome] = {}
        self._start, self._spent = _processor_seconds(), 0.0

    def add(self, ended: dict[int, Outcome], last: bool) -> None:
        """Writes the page unless this was the last comparison or writing has taken too large a part of the time."""
        self._ended = ended
        if last or self._spent > _WRITING * (_processor_seconds() - self._start):
            return
        begin = time.process_time()
        self._write()
        if not self._spent:
            options.complain(f"the first of {len(self._comparisons)} comparisons is in {self._out / 'report.html'}")
        self._spent += time.process_time() - begin

    @contextmanager
    def resumable(self) -> Iterator[None]:
        """Context manager that, if interrupted, writes the comparisons that have ended and prints how to continue."""
        try:
            yield
        except KeyboardInterrupt:
            if self._ended:
                self._write()
                many = f"{len(self._ended)} of {len(self._comparisons)} comparisons are in {self._out / 'report.html'}"
                options.complain(f"stopped: {many}; the same command continues from there")
            raise

    def _write(self) -> None:
        ended = [self._ended[index] for index in sorted(self._ended)]
        awaited = [item.title for index, item in enumerate(self._comparisons) if index not in self._ended]
        with self._runner.profile.phase("page"):
            page = self._made(ended, awaited)
            page.expect(self._parts, self._out)
            page.write(self._out)


def _of_groups(names: list[str], only: str) -> list[str]:
    """Comparisons whose scene belongs to one of the groups, each given by its name, a word of it, or their folder."""
    from proofroll.core.errors import InputError
    from proofroll.files.comparison_file import load_comparison
    from proofroll.report.kinds import group_of
    from proofroll.studies.comparison.planning import scene_at

    groups = {}
    for name in names:
        comparison = load_comparison(name)
        groups[name] = group_of(scene_at(comparison, next(iter(comparison.variations(comparison.rows[0])), {})))
    chosen: set[str] = set()
    for word in (item.strip() for item in only.split(",")):
        matching = {name for name, group in groups.items() if word == group or word in group.split()}
        matching |= {name for name in names if name.startswith(f"{word}/")}
        if not matching:
            raise InputError("--only", word, f"groups are {', '.join(dict.fromkeys(groups.values()))}")
        chosen |= matching
    return [name for name in names if name in chosen]


def _begin(number: int, total: int, words: str) -> str:
    """Prints on standard error which of several stages begins; returns the prefix of its progress bar."""
    if total == 1:
        return ""
    options.complain(f"{number} of {total}, {words}")
    return f"{number} of {total}: "


def _make_all(
    made: Report, parts: list[Part], missing: list[Part], runner: Runner, out: Path, rest: Callable[[], float] | None
) -> set[str]:
    """Makes the further studies that are missing; returns names of those for which a budget left no ``rest`` [s]."""
    keys = {part.key: part.words for part in parts}
    start, unmade, written = 1 + 2 * bool(made.content.comparisons), set(), runner.profile.total
    for number, (key, words) in enumerate(keys.items(), start=start):
        to_make = [part for part in missing if part.key == key]
        stage = _begin(number, len(keys) + start - 1, words if to_make else f"{words}: kept from before")
        for part in to_make:
            if rest and rest() <= 0:
                unmade.add(part.head["name"])
                made.leave_out(part, "Not run: the budget is used")
            else:
                if runner.profile.total - written > _UNWRITTEN:
                    written = _write(made, runner, out)
                with runner.profile.phase(part.kind):
                    _make(made, part, runner, out, stage)
    if missing:
        _write(made, runner, out)
    return unmade


def _write(made: Report, runner: Runner, out: Path) -> float:
    """Writes the report; returns the processor time at its end [s]."""
    with runner.profile.phase("page"):
        made.write(out)
    return runner.profile.total


def _make(made: Report, part: Part, runner: Runner, out: Path, stage: str) -> None:
    """Makes one further study with a progress bar; prints a sentence on standard error if that failed."""
    with options.progress_bar(f"{stage}{part.words}") as advance:
        entry = made.make(part, lambda: part.make(runner, out, lambda text, count: advance(f"{stage}{text}", count)))
    if entry.missing:
        options.complain(f"{part.head['title']}: {entry.missing}")


def _exit_code(content: ReportContent, compared: int, unmade: Collection[str]) -> int:
    """Exit code of a report whose comparisons give ``compared``; further studies in ``unmade`` do not count."""
    entries = content.further
    lost = any((entry.missing and entry.name not in unmade) or entry.lost for entry in entries)
    if compared == options.ENGINE or lost:
        return options.ENGINE
    changed = content.against is not None and content.against.changed
    contradicted = compared or changed or any(entry.contradictions for entry in entries)
    return options.CONTRADICTED if contradicted else options.OK
