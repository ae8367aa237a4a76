"""The first screen: rows and cells of the matrix, pictures of scenes, and what a change of question needs."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

from proofroll.core.verdict import Verdict
from proofroll.report.page.answer import Chip, FirstAnswer, answer
from proofroll.report.page.choice_cell import CANNOT, NO_RUN, PARTLY, ChoiceCell
from proofroll.report.page.choice_matrix import (
    ASKED,
    FIRST_TOLERANCE,
    ChoiceColumn,
    ChoiceMatrix,
    ChoiceRow,
)
from proofroll.report.page.profile import Profile, profile
from proofroll.report.pages import addressed, packed, unbroken
from proofroll.report.parts import Part, PartEntry, part_kinds
from proofroll.report.pen import Disc, Lettering, Picture, Polyline

if TYPE_CHECKING:
    import jinja2

    from proofroll.report.page.records import ReportContent

# State -> glyph, word, and what the legend says of it; several verdicts look alike.
STATES: Mapping[str, tuple[str, str, str]] = {
    "agrees": ("✓", "holds", "The error is within the tolerance, and smaller steps do not contradict it."),
    "partly": ("◐", "holds some scenes", "The tolerance is held in some scenes of this kind, or in what is reported."),
    "converges": ("↘", "finer steps needed", "Beyond the tolerance at the steps that were run; smaller come closer."),
    "differs": ("✗", "differs", "Small steps lead elsewhere, or nowhere that could be shown; or there is no result."),
    "refused": ("⊘", "refused", "The engine was asked, declined the scene and says why."),
    "unjudged": ("?", "not judged", "It ran; the requested quantities are not judged there."),
    "cannot": ("—", "cannot", "The formulation lacks an element that the scene needs; nothing to run."),
    "none": ("·", "not run", "It could represent the scene, but this report did not try."),
}  # fmt: skip
_LOOKS = {
    Verdict.UNCONFIRMED: "converges", Verdict.INCOMPLETE: "partly", Verdict.FAILED: "differs",
    Verdict.ILL_POSED: "unjudged", Verdict.NOT_JUDGED: "unjudged", Verdict.ANOTHER_SCENE: "unjudged",
}  # fmt: skip
# Most engines of which every choice has an answer of its own; of more, all but one, and each alone.
_ALL_CHOICES = 4
# Fastest speed of the bars.
FASTEST = 1000.0
# Looks of marks that a small picture leaves out: arrows of gravity and of forces.
_NOT_SMALL = ("force", "force-head", "axis")


def look(state: str) -> str:
    """Key of :data:`STATES` for the state of a cell."""
    return str(_LOOKS.get(Verdict(state), state)) if state in list(Verdict) else state


def word(state: str) -> str:
    """Word for the state of a cell, which may differ from that of a state that looks alike."""
    return state if state in {Verdict.INCOMPLETE, Verdict.FAILED} else STATES[look(state)][1]


class CellView(NamedTuple):
    """A cell of the matrix as it is shown: look, text, second line, tooltip, address of the evidence, dots by scene."""

    look: str
    main: str
    sub: str
    title: str
    href: str
    dots: tuple[bool, ...] = ()


@dataclass(frozen=True)
class MatrixRow:
    """A row of the matrix: an engine, one of its formulations, or one of that one's settings.

    Attributes:
        level: ``engine``, ``formulation`` or ``setting``.
        name: by which rows below it know it.
        of: name of the row above it, in whose fold it lies; empty for an engine.
        label: for a reader.
        count: number of rows below it.
        row: of the choice matrix; None for an engine.
    """

    level: str
    engine: str
    name: str
    of: str
    label: str
    count: int
    witness: bool
    row: ChoiceRow | None = None


@dataclass(frozen=True)
class FirstScreen:
    """Content of the first screen, from a report's matrix."""

    content: ReportContent

    @property
    def matrix(self) -> ChoiceMatrix:
        """The choice matrix of the report."""
        return self.content.choice

    @cached_property
    def first(self) -> FirstAnswer:
        """The answer that a reader sees first."""
        return answer(self.matrix, FIRST_TOLERANCE, False)

    @property
    def first_profile(self) -> Profile:
        """Profile of that answer."""
        return profile(self.matrix, self.first)

    @cached_property
    def rows(self) -> list[MatrixRow]:
        """Rows of the matrix: engines that may be taken, then witnesses, each with formulations and settings."""
        rows: list[MatrixRow] = []
        for engine in self.matrix.engines:
            models, title = self.matrix.formulations(engine), self.matrix.title(engine)
            title = title[:1].upper() + title[1:]
            row_of = partial(MatrixRow, engine=engine, witness=engine in self.matrix.witnesses)
            rows.append(row_of(level="engine", name=engine, of="", label=title, count=len(models)))
            for model in models:
                settings = [
                    row
                    for row in self.matrix.rows
                    if row.setting and (row.engine, row.formulation) == (model.engine, model.formulation)
                ]
                name, label = f"{engine} {model.formulation}", model.formulation.replace("_", " ") or title
                count = len(settings)
                rows.append(row_of(level="formulation", name=name, of=engine, label=label, count=count, row=model))
                rows += [
                    row_of(level="setting", name=f"{name} {row.setting}", of=name, label=row.setting, count=0, row=row)
                    for row in settings
                ]
        return rows

    def cell(self, row: MatrixRow, column: ChoiceColumn, tolerance: float, forces: bool) -> CellView:
        """Cell of a row as it is shown."""
        if row.row is not None:
            return self._view(row, column, self.matrix.cell(row.row, column, tolerance, forces))
        standing = self.matrix.standing(row.engine, column, tolerance, forces)
        view = self._view(row, column, standing)
        dots = tuple(cell.holds for cell in standing.by_scene) if len(standing.by_scene) > 1 else ()
        if view.look in {CANNOT, NO_RUN, "unjudged"}:
            return view
        if standing.state == PARTLY and standing.by_scene:
            pairs = zip(column.scenes, standing.by_scene, strict=True)
            return view._replace(sub=", ".join(f"{s.words} {c.text}" for s, c in pairs if c.holds), dots=dots)
        words = standing.formulation.replace("_", " ")
        finer = ", finer steps" if view.look == "converges" else ""
        return view._replace(sub=f"{words}{finer}", dots=dots)

    def _view(self, row: MatrixRow, column: ChoiceColumn, cell: ChoiceCell) -> CellView:
        kind = look(cell.state)
        glyph, says_state = STATES[kind][0], word(cell.state)
        title = self.matrix.title(row.engine)
        says = cell.title.replace(f"{row.engine} ", f"{title} ")
        if cell.state in {NO_RUN, CANNOT}:
            formulation = f", {row.row.formulation.replace('_', ' ')}" if row.row else ""
            says = f"{title}{formulation}: {says}."
        counted = " of " in cell.text
        text = {
            "agrees": cell.text, **dict.fromkeys(("unjudged", "cannot", "none"), says_state),
        }.get(kind, cell.text if counted or not cell.text[:1].isdigit() else f"off {cell.text}")  # fmt: skip
        sub = cell.ladder
        if cell.holds and row.row is not None:
            sub = cell.name.removeprefix(row.row.name).strip() if cell.name else "by scene"
        place = f"{column.title}{cell.share}"
        return CellView(
            look=kind, main=f"{glyph} {text}", sub=sub, title=f"{glyph} {says_state}: {place}\n{says}", href=cell.href
        )

    def best(self, answered: FirstAnswer) -> list[int]:
        """Number of the row of each column's engine to take; -1 where nothing holds the tolerance."""
        place = {row.name: number for number, row in enumerate(self.rows) if row.level == "engine"}
        taken = (item.taken for item in answered.columns)
        return [-1 if item is None else place[item.engine] for item in taken]

    def kind_title(self, group: str) -> str:
        """Title of a kind of scenes."""
        return next(column.title for column in self.matrix.kinds if column.group == group)

    def scene_of(self, kind: ChoiceColumn, place: int) -> ChoiceColumn:
        """Column of one scene of a kind."""
        return [column for column in self.matrix.columns if not column.whole and column.group == kind.group][place]

    @property
    def chapters(self) -> dict[str, list[tuple[type[Part], PartEntry, int]]]:
        """Further studies of each scene: their kind, their entry, and its number among those of the kind."""
        chapters: dict[str, list[tuple[type[Part], PartEntry, int]]] = {}
        for kind in part_kinds():
            for index, entry in enumerate(self.content.entries[kind.key]):
                chapters.setdefault(entry.scene, []).append((kind, entry, index))
        return chapters

    @cached_property
    def pictures(self) -> dict[str, Picture]:
        """Small picture of each scene that is drawn, by its name."""
        return {name: small(sheet.drawings[0]) for name, sheet in self.content.sheets.items() if sheet.drawings}

    @property
    def choices(self) -> list[tuple[str, ...]]:
        """Sets of engines that a reader may choose."""
        rivals = [name for name in self.matrix.engines if name not in self.matrix.witnesses]
        sizes = range(1, len(rivals) + 1)
        if len(rivals) > _ALL_CHOICES:
            sizes = range(0)
            alone = [(name,) for name in rivals]
            return [tuple(rivals), *(tuple(x for x in rivals if x != name) for name in rivals), *alone]
        return [chosen for size in reversed(sizes) for chosen in combinations(rivals, size)]

    def packed(self, templates: jinja2.Environment) -> str:
        """Cells and parts of the screen for every question, compressed."""
        macros = templates.get_template("first_screen.html").module
        pool: dict[CellView, int] = {}
        grid = [
            [
                [pool.setdefault(self.cell(row, column, tolerance, need), len(pool)) for need, tolerance in ASKED]
                for column in self.matrix.columns
            ]
            for row in self.rows
        ]
        cells = [[view.look, str(macros.inner(view))] for view in pool]  # type: ignore[attr-defined]
        screens = {}
        for chosen in self.choices:
            answers = [answer(self.matrix, tolerance, need, chosen) for need, tolerance in ASKED]
            screens[" ".join(chosen)] = [
                {
                    "asked": answered.question.words,
                    "chips": {
                        group: str(macros.chips(chips))  # type: ignore[attr-defined]
                        for group, chips in _chips_by_kind(answered).items()
                    },
                    "one": {
                        group: unbroken(str(macros.one(self, item)))  # type: ignore[attr-defined]
                        for item in answered.kinds
                        for group in [item.column.group, *([""] if len(answered.kinds) == 1 else [])]
                    },
                    "cards": unbroken(str(macros.cards(self, answered))),  # type: ignore[attr-defined]
                    "profile": str(macros.profile(profile(self.matrix, answered, chosen))),  # type: ignore[attr-defined]
                    "use": unbroken(addressed(str(macros.use(self, answered)))),  # type: ignore[attr-defined]
                    "best": self.best(answered),
                }
                for answered in answers
            ]
        groups = ["", *(column.group for column in self.matrix.kinds)]
        facts = {group: str(macros.facts(self.content.kept(group))) for group in groups}  # type: ignore[attr-defined]
        texts: dict[str, int] = {}
        models = [
            {
                f"{column.group} {column.name}": {
                    cell.engine: texts.setdefault(
                        str(macros.model(self, column, cell, tolerance)),  # type: ignore[attr-defined]
                        len(texts),
                    )
                    for cell in self.matrix.standings(column, tolerance, need)
                    if cell.holds
                }
                for column in self.matrix.columns
                if not column.whole
            }
            for need, tolerance in ASKED
        ]
        content = {"cells": cells, "grid": grid, "screens": screens, "facts": facts}
        content |= {"models": models, "texts": [*texts]}
        return packed(json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode("utf-8", "replace"))


def _chips_by_kind(answered: FirstAnswer) -> dict[str, list[Chip]]:
    """Chips of each kind of scenes by its name, and of all under the empty one."""
    return {"": answered.chips} | {item.column.group: answered.chips_of(item.column.group) for item in answered.kinds}


def bar(cell: ChoiceCell) -> int:
    """Length of the bar of a speed [%], logarithmic from 1× to 1000× real time; 0 where the tolerance is not held."""
    if not cell.holds or cell.cost <= 0:
        return 0
    part = math.log(max(1.0, 1 / cell.cost)) / math.log(FASTEST)
    return round(100 * min(1.0, max(0.02, part)))


def small(picture: Picture) -> Picture:
    """Picture without letters and forces, its box cut to what is left."""
    marks: list[Polyline | Disc] = [
        mark for mark in picture.marks if not isinstance(mark, Lettering) and mark.look not in _NOT_SMALL
    ]
    places = [point for mark in marks for point in _corners(mark)]
    if not places:
        return picture
    xs, ys = zip(*places, strict=True)
    box = [min(xs) - 2, min(ys) - 2, max(xs) - min(xs) + 4, max(ys) - min(ys) + 4]
    return Picture([round(value, 1) for value in box], [*marks], picture.label)


def _corners(mark: Polyline | Disc) -> list[list[float]]:
    if isinstance(mark, Polyline):
        return mark.points
    (x, y), r = mark.centre, mark.radius
    return [[x - r, y - r], [x + r, y + r]]
