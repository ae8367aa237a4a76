"""A report that grows: written after the comparisons, and again after each further study."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path

from proofroll.core.errors import ProofrollError
from proofroll.files.json_data import plain
from proofroll.report.changes import EarlierReport, against
from proofroll.report.comparison.plots import PointCurves, point_curves
from proofroll.report.kinds import kind_of
from proofroll.report.page.first_screen import ReportedAnswer
from proofroll.report.page.html import page, studies_page
from proofroll.report.page.records import ReportContent, report_content
from proofroll.report.parts import Part, PartEntry, absent, attempt
from proofroll.report.replay.records import Replay
from proofroll.report.replay.replay import joined, replay_content
from proofroll.running.store import write_text
from proofroll.studies.comparison.outcome import Outcome


@dataclass
class Report:
    """Content of the report's files.

    Attributes:
        compared: content about the comparisons.
        curves: of each comparison, for the figures.
        replay: of the comparisons, or None.
        parts: the further studies, in the order of the content's lists.
        pictures: markup by name.
        earlier: earlier report to compare this one with, or None.
        answers: of the scenes, see :class:`ReportContent`.
    """

    compared: ReportContent
    curves: list[list[PointCurves]]
    replay: Replay | None
    parts: list[Part] = field(default_factory=list)
    pictures: dict[str, str] = field(default_factory=dict)
    earlier: EarlierReport | None = None
    answers: list[ReportedAnswer] = field(default_factory=list)
    _made: dict[int, tuple[Part, PartEntry]] = field(default_factory=dict)

    @cached_property
    def content(self) -> ReportContent:
        """Content of the report, with the further studies that have an entry so far; made anew after each."""
        made = [self._made[id(part)] for part in self.parts if id(part) in self._made]
        entries = {key: [entry for part, entry in made if part.key == key] for key in self.compared.entries}
        environment = self.compared.environment
        for _, entry in made:
            if isinstance(entry.study, dict):  # a stored study was made with the present versions
                environment = replace(environment, versions=environment.versions | entry.study.get("versions", {}))
        answered = replace(self.compared, answers=[*self.answers])
        content = replace(answered, entries=entries, environment=environment).summarised
        if self.earlier is None:
            return content
        lines, machine = content.table.lines, environment.machine
        return replace(content, against=against(self.earlier, lines, machine, environment.versions))

    def expect(self, parts: Sequence[Part], out: Path, *, fresh: bool = False) -> list[Part]:
        """Lists further studies with their stored results under ``out``, which are ignored if ``fresh``.

        Returns:
            Studies that must be made.
        """
        self.parts = sorted(parts, key=lambda part: part.order)
        missing = []
        for part in self.parts:
            entry = attempt(part, partial(part.keeps, out)) if not fresh else None
            if entry is None:
                missing.append(part)
                entry = absent(part, "It has not been made yet")
            self._put(part, entry)
        return missing

    def add_answer(self, item: ReportedAnswer) -> None:
        """Adds the answer of a scene for a tolerance."""
        self.answers.append(item)
        self.__dict__.pop("content", None)

    def make(self, part: Part, how: Callable[[], None]) -> PartEntry:
        """Makes a further study and returns its entry, which tells of a failure, too."""
        entry = attempt(part, how)
        assert entry is not None  # only ``keeps`` returns False
        self._put(part, entry)
        return entry

    def leave_out(self, part: Part, reason: str) -> None:
        """Gives a further study that is not made the reason as its entry."""
        self._put(part, absent(part, reason))

    def write(self, out: Path) -> None:
        """Writes ``report.html``, ``report.json`` and ``report.csv``; ``studies.html`` if there are further studies.

        Raises:
            ProofrollError: the folder cannot be written.
        """
        content = self.content
        content_json = plain(content)
        del content_json["table"]
        table = plain(content.table)
        rows = ",\n  ".join(json.dumps(row, allow_nan=False) for row in table.pop("data"))
        head = json.dumps(table).removesuffix("}")
        text = json.dumps(content_json, indent=1, allow_nan=False).removesuffix("\n}")
        write_text(out / "report.json", f'{text},\n "table": {head}, "data": [{rows}]}}\n}}\n')
        write_text(out / "report.csv", content.table.csv)
        if content.further:
            write_text(out / "studies.html", studies_page(content, self.pictures))
        write_text(out / "report.html", page(content, self.curves, self.replay))

    def _put(self, part: Part, entry: PartEntry) -> None:
        self._made[id(part)] = part, entry
        self.__dict__.pop("content", None)
        if entry.study is not None:
            alike = [id(rival) for rival in self.parts if rival.key == part.key]
            prefix = f"{part.key}{alike.index(id(part))}-"
            try:
                self.pictures |= {f"{prefix}{name}": markup for name, markup in part.pictures(prefix).items()}
            except ProofrollError as error:  # the reason, in place of pictures
                self.pictures[f"{prefix}problem"] = str(error)


def begun(outcomes: list[Outcome], command: str, awaited: Sequence[str] = (), left_out: Sequence[str] = ()) -> Report:
    """Report of comparisons, to which further studies can be added.

    Args:
        outcomes: results of the comparisons.
        command: command that makes the report again.
        awaited: titles of comparisons that are still being run.
        left_out: names of comparisons that the report leaves out.
    """
    content = report_content(outcomes, command)
    replay = _replay(outcomes, content.engines)
    described = [case.described for case in replay.cases] if replay else []
    content = replace(content, replay=described, awaited=list(awaited), left_out=list(left_out))
    return Report(content, [point_curves(outcome) for outcome in outcomes], replay)


def _replay(outcomes: list[Outcome], engines: Sequence[str]) -> Replay | None:
    """Replay of the comparisons, kind by kind; None if nothing can be drawn."""
    kinds = {id(item): kind_of(item.scene) for item in outcomes}
    drawn_by = dict.fromkeys(kind for kind in kinds.values() if kind is not None)
    drawn = {kind: [item for item in outcomes if kinds[id(item)] is kind] for kind in drawn_by}
    return joined([replay_content(of_kind, kind.replay(), engines) for kind, of_kind in drawn.items()])
