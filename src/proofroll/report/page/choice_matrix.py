"""Matrix of engines and groups of scenes: the cheapest run that holds a tolerance, or the reason why none does."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby, product
from types import MappingProxyType
from typing import NamedTuple

from proofroll.core.number_format import error, number
from proofroll.core.verdict import LimitResult, Verdict
from proofroll.report.long_table import TableLine
from proofroll.report.page.candidates import Candidate, candidates
from proofroll.report.pages import packed

# Tolerances that a reader can choose: negative powers of ten, relative to the path or the largest force.
DECADES = range(2, 9)
# The tolerance that a reader sees first, and for which sentences name a setting.
FIRST = 4
FIRST_TOLERANCE = 10.0**-FIRST
# All questions that a reader can ask: with forces or not, and the tolerance.
ASKED = [(forces, 10.0**-decade) for forces, decade in product((False, True), DECADES)]
NEEDS = ("motion to {0} of the path", "motion to {0} of the path and forces to {0} of the largest")
UNIT = "in seconds of computing per second of motion"
WITH_FORCES = "With forces to {0} of the largest, too"
SAME = "the same for"
UNJUDGED_FORCES = "forces are not judged for"
NOTHING = "nothing that was run and timed holds it for"
UNJUDGED = "that is judged in no scene that was run"
NO_RUN = "none"
SEVERITY = list(map(str, Verdict))
# Number of groups beside which scenes find room on a screen of 1400 px.
FEW = 5
_WHY = {
    LimitResult.WITHIN: "finer steps come closer",
    LimitResult.NO_LADDER: "the closest of what was run",
    LimitResult.NOT_SHOWN: "no limit of small steps is shown",
    LimitResult.ANOTHER: "its limit of small steps is another",
}


class ChoiceCell(NamedTuple):
    """Cell of an engine in a group of scenes at a tolerance.

    Attributes:
        state: verdict, for colour and glyph; ``none``: nothing was run.
        text: cost [s/s] if the tolerance is held, else the least error, or the number of scenes that hold it.
        title: the same in sentences.
        href: HTML id of the evidence; empty: there is none.
        cost: of the slowest scene; infinite unless the tolerance is held in all and costs were measured.
        name: setting and step; for several scenes the ones that they share, or empty.
        slowest: the scene whose cost it is and its setting and step, where scenes need different ones; else empty.
        why: short reason why the tolerance is not held; empty: it is.
        scenes, lacking: numbers of the column's scenes in which it was judged, and of those in which only others were.
        absent: number of the latter without a run of it, as it may be unable to represent them; others were left out.
    """

    state: str
    text: str
    title: str
    href: str = ""
    cost: float = math.inf
    name: str = ""
    slowest: tuple[str, str] = ("", "")
    why: str = ""
    scenes: int = 1
    lacking: int = 0
    absent: int = 0

    @property
    def share(self) -> str:
        """Words for the part of the column's scenes in which it was judged; empty: in all."""
        return f" in {self.scenes} of {self.scenes + self.lacking} scenes" if self.lacking else ""


class ChoiceStudy(NamedTuple):
    """A study in the matrix: title, HTML id of its evidence, and those of its runs by row and place."""

    title: str
    href: str
    runs: Mapping[tuple[int, str], str] = MappingProxyType({})


@dataclass(frozen=True)
class ChoiceColumn:
    """Column of a group of scenes (``whole``), or of one study in it."""

    group: str
    title: str
    href: str
    studies: tuple[str, ...]
    whole: bool = True

    @property
    def name(self) -> str:
        """Name of the group or of the study."""
        return self.group if self.whole else self.studies[0]


@dataclass(frozen=True)
class ChoiceRow:
    """Formulation with one setting, or with all (``setting`` is empty); ``found``: its candidates by study."""

    engine: str
    formulation: str
    setting: str
    own_equations: bool
    found: dict[str, list[Candidate]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Engine and formulation."""
        return f"{self.engine} {self.formulation}".strip()

    @property
    def is_model(self) -> bool:
        """True for an engine's own model with all its settings, False for equations derived for a scene."""
        return not self.setting and not self.own_equations


@dataclass(frozen=True)
class ChoiceMatrix:
    """Matrix of engines and scenes; ``titles``: of studies, by name."""

    columns: list[ChoiceColumn]
    rows: list[ChoiceRow]
    titles: dict[str, str]

    @property
    def unfolded(self) -> list[str]:
        """Groups whose scenes are columns from the start: those of at most two, unless there are many groups."""
        groups = [column for column in self.columns if column.whole]
        return [column.group for column in groups if len(column.studies) <= 2] if len(groups) <= FEW else []

    @property
    def engines(self) -> list[str]:
        """Names of the engines, in the order of the rows."""
        return list(dict.fromkeys(row.engine for row in self.rows))

    def cell(self, row: ChoiceRow, column: ChoiceColumn, tolerance: float, forces: bool) -> ChoiceCell:
        """Cell of a row and column at a tolerance relative to the quantities' size."""
        own = [name for name in column.studies if name in row.found]
        judged = [name for name in own if name not in self.unjudged[forces]]
        if own and not judged:
            what = "no forces" if forces else "no motion"
            return ChoiceCell(Verdict.NOT_JUDGED, what, f"{what} judged here", why=f"{what} judged")
        # A study without any judgement, say for lack of time, does not count against the studies that ran.
        known = [name for name in judged if any(item.blame != Verdict.NOT_JUDGED for item in row.found[name])]
        cells = {name: _cell(row.found[name], tolerance, forces) for name in known or judged}
        if not cells:
            return ChoiceCell(NO_RUN, "", "not run")
        lacking = self.judged[forces].intersection(column.studies).difference(known)
        return _joined(cells, self.titles)._replace(
            scenes=len(cells), lacking=len(lacking), absent=len(lacking - row.found.keys())
        )

    @cached_property
    def judged(self) -> tuple[set[str], set[str]]:
        """Studies in which motion is judged, and those in which forces are judged, too."""
        items = [(name, item) for row in self.rows for name, own in row.found.items() for item in own]
        motion = {name for name, item in items if item.motion is not None}
        return motion, motion & {name for name, item in items if item.forces is not None}

    @cached_property
    def unjudged(self) -> tuple[set[str], set[str]]:
        """Studies that ran without judged motion, and those that lack judged motion or forces."""
        found = [(name, own) for row in self.rows for name, own in row.found.items()]
        ran = {name for name, own in found if any(item.blame is None for item in own)}
        return ran - self.judged[False], ran - self.judged[True]

    @property
    def models(self) -> list[ChoiceRow]:
        """Rows for which :attr:`ChoiceRow.is_model` is true."""
        return [row for row in self.rows if row.is_model]

    def ranked(self, column: ChoiceColumn, tolerance: float, forces: bool) -> list[tuple[int, ChoiceCell]]:
        """Formulations that hold a tolerance: number of the row, and its cell.

        Those with runs in the most scenes come first, for scenes differ in cost, and of these the cheapest. What was
        left out, say for lack of time, does not count here.
        """
        rows = [(place, row) for place, row in enumerate(self.rows) if row.is_model]
        cells = [(place, self.cell(row, column, tolerance, forces)) for place, row in rows]
        held = [item for item in cells if math.isfinite(item[1].cost)]
        return sorted(held, key=lambda item: (item[1].absent, item[1].cost))

    def best(self, tolerance: float, forces: bool) -> list[int | None]:
        """Number of the row of each column's cheapest formulation; None where none holds the tolerance."""
        ranks = (self.ranked(column, tolerance, forces) for column in self.columns)
        return [found[0][0] if found else None for found in ranks]

    def answer(self, tolerance: float, forces: bool) -> str:
        """Sentence with the cheapest formulation of each group that holds the tolerance in all scenes it ran."""
        groups = [column for column in self.columns if column.whole]
        ranks = [self.ranked(column, tolerance, forces) for column in groups]
        held = [self._phrase(column, *found[0]) for column, found in zip(groups, ranks, strict=True) if found]
        without = [
            column.group
            for column, found in zip(groups, ranks, strict=True)
            if not found and column.group in self.judged_groups[forces]
        ]
        nothing = f"{NOTHING} {', '.join(without)}" if without else ""
        asked = NEEDS[forces].format(number(tolerance))
        if not held:
            return f"To hold {asked}: {nothing or (UNJUDGED if groups else 'nothing was run')}."
        return f"The cheapest to hold {asked}, {UNIT}: {', '.join(held)}{f'; {nothing}' if nothing else ''}."

    def with_forces(self, tolerance: float) -> str:
        """Sentence that follows an answer about motion: changes if forces count; empty if forces are judged nowhere."""
        motion_judged, judged = self.judged_groups
        whole = [column for column in self.columns if column.whole]
        groups = [column for column in whole if column.group in judged]
        silent = [column.group for column in whole if column.group in set(motion_judged).difference(judged)]
        other: list[str] = []
        same: list[str] = []
        without: list[str] = []
        for column in groups:
            motion, both = (self.ranked(column, tolerance, forces) for forces in (False, True))
            if not both:
                without.append(column.group)
            elif motion and self._phrase(column, *motion[0]) == self._phrase(column, *both[0]):
                same.append(column.group)
            else:
                other.append(self._phrase(column, *both[0]))
        lists = (SAME, same), (NOTHING, without), (UNJUDGED_FORCES, silent)
        rest = [f"{words} {', '.join(names)}" for words, names in lists if names]
        clauses = [", ".join(other), *rest] if other else rest
        return f"{WITH_FORCES.format(number(tolerance))}: {'; '.join(clauses)}." if groups else ""

    def step(self, row: ChoiceRow, cell: ChoiceCell) -> str:
        """Setting and step of a cell, without the formulation of its row; empty if scenes need different ones."""
        return cell.name.removeprefix(row.name).strip()

    def _phrase(self, column: ChoiceColumn, place: int, cell: ChoiceCell) -> str:
        return f"{cell.name or self.rows[place].name} for {column.name} ({cell.text}{cell.share})"

    @cached_property
    def judged_groups(self) -> tuple[list[str], list[str]]:
        """Groups and studies in which motion is judged, and those in which forces are judged, too."""
        motion, both = (
            [item.name for item in self.columns if not lacking.issuperset(item.studies)] for lacking in self.unjudged
        )
        return motion, both

    @cached_property
    def data(self) -> str:
        """JSON of all cells at all tolerances: distinct cells once, and for each row and column their numbers."""
        pool: dict[tuple[str, str, str, str], int] = {}
        grid = [
            [
                [pool.setdefault(self.cell(row, column, at, need)[:4], len(pool)) for need, at in ASKED]
                for column in self.columns
            ]
            for row in self.rows
        ]
        ranks = [
            [
                [
                    (place, self._phrase(column, place, cell), self.step(self.rows[place], cell))
                    for place, cell in self.ranked(column, at, need)
                ]
                for column in self.columns
            ]
            for need, at in ASKED
        ]
        names = [column.name for column in self.columns]
        groups = [column.group if column.whole else "" for column in self.columns]
        content = {
            "cells": list(pool),
            "grid": grid,
            "ranks": ranks,
            "groups": groups,
            "names": names,
            "judged": self.judged_groups,
        }
        return json.dumps(content, separators=(",", ":"))

    @property
    def packed(self) -> str:
        """The JSON of :attr:`data`, compressed for a page."""
        return packed(self.data.encode())


def choice_matrix(lines: Iterable[TableLine], studies: Mapping[str, ChoiceStudy]) -> ChoiceMatrix:
    """Matrix of the lines of some studies, in their order; cheapest formulations first, by column."""
    order = {name: number for number, name in enumerate(studies)}
    chosen = sorted((line for line in lines if line.study in order), key=lambda x: (order[x.study], x.row, x.engine))
    rows: dict[tuple[str, str, str], ChoiceRow] = {}
    groups: dict[str, dict[str, None]] = {}
    derived = {(line.engine, line.formulation) for line in chosen if line.own_equations}
    for (name, _, _), own in groupby(chosen, key=lambda x: (x.study, x.row, x.engine)):
        of_row, (_, href, runs) = list(own), studies[name]
        first, found = of_row[0], candidates(of_row, href, runs)
        groups.setdefault(first.group, {})[name] = None
        for setting in ("", first.setting or "as it is"):
            key = (first.engine, first.formulation, setting)
            row = rows.setdefault(key, ChoiceRow(*key, own_equations=key[:2] in derived))
            row.found.setdefault(name, []).extend(found)
    columns = []
    for group, names in groups.items():
        members = [ChoiceColumn(group, studies[name].title, studies[name].href, (name,), whole=False) for name in names]
        columns.append(ChoiceColumn(group, group, members[0].href if len(members) == 1 else "", tuple(names)))
        columns += members if len(members) > 1 else []
    orders = [list(dict.fromkeys(key[:end] for key in rows)) for end in (1, 2, 3)]
    keys = sorted(rows, key=lambda key: [known.index(key[: end + 1]) for end, known in enumerate(orders)])
    titles = {name: item.title for name, item in studies.items()}
    matrix = ChoiceMatrix(columns, [rows[key] for key in keys], titles)
    best = zip(*(matrix.best(FIRST_TOLERANCE, forces) for forces in (False, True)), strict=True)
    useful = dict.fromkeys(matrix.rows[at].name for pair in best for at in pair if at is not None)
    ranks = {name: rank for rank, name in enumerate(useful)}
    return ChoiceMatrix(columns, sorted(matrix.rows, key=lambda row: ranks.get(row.name, len(ranks))), titles)


def _cell(steps: Sequence[Candidate], tolerance: float, forces: bool) -> ChoiceCell:
    """Cell of one study: the cheapest candidate that holds the tolerance, else the closest, else why there is none."""
    whole = [item for item in steps if item.blame is None]
    known = [(size, item) for item in whole if (size := item.tolerance(forces)) is not None]
    held = [(item.cost if item.cost is not None else math.inf, size, item) for size, item in known if size <= tolerance]
    if held:
        cost, size, item = min(held, key=lambda entry: entry[:2])
        text = "not timed" if math.isinf(cost) else f"{'' if item.clean else '~'}{number(cost)}"
        spent = text if math.isinf(cost) else f"{text} s of computing per simulated second"
        title = f"{item.name}: within {number(size)}, {spent}"
        return ChoiceCell(Verdict.AGREES, text, title, item.href, cost, item.name)
    if known:
        size, item = min(known, key=lambda entry: entry[0])
        limit, own = item.limit(forces, tolerance), item.error(forces)
        state = Verdict.CONVERGES if limit == LimitResult.WITHIN else Verdict.DIFFERS
        luck = own is not None and own <= tolerance
        size = own if own is not None and not luck else size
        off = _beyond(size, tolerance)
        by = f"its error of {number(own)} is luck, finer steps or their limit are off by" if luck else "off by"
        title, why = f"{item.name}: {by} {_beyond(size, tolerance, 2)}; {_WHY[limit]}", f"{by} {off}, {_WHY[limit]}"
        return ChoiceCell(state, off, title, item.href, name=item.name, why=why)
    if whole:
        lacking = "no forces" if whole[0].motion is not None else "no motion"
        title = f"{whole[0].name}: reports {lacking}"
        return ChoiceCell(Verdict.INCOMPLETE, lacking, title, whole[0].href, why=f"reports {lacking}")
    item = steps[0]
    state = item.blame or Verdict.FAILED
    word = "missing" if item.status == "missing" else str(state)  # its engine is not installed
    return ChoiceCell(state, word, f"{item.name}: {item.message}".rstrip(": "), item.href, why=word)


def _beyond(size: float, tolerance: float, digits: int = 1) -> str:
    """Text of an error with enough digits to show that it exceeds the tolerance."""
    text = error(size, digits)
    return (
        text
        if digits > 4 or not math.isfinite(size) or float(text) > tolerance
        else _beyond(size, tolerance, digits + 1)
    )


def _joined(cells: Mapping[str, ChoiceCell], titles: Mapping[str, str]) -> ChoiceCell:
    """One cell for several studies: the worst; its cost is that of the slowest if all hold the tolerance."""
    study, worst = max(cells.items(), key=lambda item: (SEVERITY.index(item[1].state), item[1].cost))
    if len(cells) == 1:
        return worst
    title = "; ".join(f"{titles[name]}: {cell.title}" for name, cell in cells.items())
    held = sum(cell.state == Verdict.AGREES for cell in cells.values())
    shared = len({cell.name for cell in cells.values()}) == 1
    worst = worst._replace(title=title, name=worst.name if shared else "")
    if held == len(cells):
        return worst if shared else worst._replace(slowest=(study, cells[study].name))
    why = f"{worst.why}; holds {held} of {len(cells)}"
    return worst._replace(text=f"{held} of {len(cells)}", cost=math.inf, why=why)
