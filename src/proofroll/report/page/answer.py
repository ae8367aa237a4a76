"""The answer to a reader's question: for each kind of scene the engine to take, its rivals, and what fails.

Chips, cards and tables of the page, the end of the terminal's text and ``proofroll recommend`` are all made of it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from proofroll.core.number_format import number
from proofroll.core.verdict import Verdict
from proofroll.report.page.choice_cell import CANNOT, NO_RUN, TIE, ChoiceCell, cell_of, speeds
from proofroll.report.page.choice_matrix import ChoiceColumn, ChoiceMatrix, ChoiceRow

# Lengths per metre of path, in words, by negative power of ten of the tolerance.
LENGTHS = {
    2: "1 cm", 3: "1 mm", 4: "0.1 mm", 5: "10 µm", 6: "1 µm", 7: "0.1 µm", 8: "10 nm",
}  # fmt: skip
# States that say nothing about an engine.
_SILENT = {Verdict.AGREES, Verdict.NOT_JUDGED, Verdict.ILL_POSED, Verdict.ANOTHER_SCENE, NO_RUN, CANNOT}
# States of what fails, the gravest first.
_STATES = (Verdict.FAILED, Verdict.DIFFERS, Verdict.CONVERGES, Verdict.REFUSED)
# Text in place of a choice where nothing has a result.
NOT_REACHED = "no run could be judged, for lack of time or of a truth"
# Most reasons on a card.
_REASONS = 2


@dataclass(frozen=True)
class ReaderQuestion:
    """Tolerance relative to path and largest force, and whether forces count."""

    tolerance: float
    forces: bool

    @property
    def words(self) -> str:
        """Question of a reader, as part of a sentence: ``motion within 0.1 mm per metre of path``."""
        return f"{self.motion}{f' and forces within {number(self.tolerance)} of the largest' if self.forces else ''}"

    @property
    def motion(self) -> str:
        """The tolerance of the motion in words."""
        decade = -math.log10(self.tolerance)
        length = LENGTHS.get(round(decade)) if abs(decade - round(decade)) < 1e-9 else None
        return f"{length} per metre of the true path" if length else f"{number(self.tolerance)} of the path"


@dataclass(frozen=True, eq=False)
class ColumnAnswer:
    """Answer for a kind of scenes or for one scene; ``engines``: among these alone, None: among all."""

    matrix: ChoiceMatrix
    column: ChoiceColumn
    asked: ReaderQuestion
    engines: Collection[str] | None = None

    @cached_property
    def standings(self) -> list[ChoiceCell]:
        """Cells of the engines that may be taken, the best first."""
        return self.matrix.standings(self.column, self.asked.tolerance, self.asked.forces, self.engines)

    @cached_property
    def scenes(self) -> list[ChoiceCell]:
        """Best cell of these in each scene of the column."""
        return [min(cells, key=_state_rank) for cells in zip(*(item.each for item in self.standings), strict=True)]

    @property
    def judged(self) -> bool:
        """False if what is asked for is judged in none of its scenes."""
        return not self.matrix.unjudged[self.asked.forces].issuperset(self.column.studies)

    @cached_property
    def both(self) -> ColumnAnswer:
        """Answer where forces count."""
        return self if self.asked.forces else replace(self, asked=replace(self.asked, forces=True))

    @property
    def taken(self) -> ChoiceCell | None:
        """The engine to take, for as many scenes as it holds; None: nothing holds the tolerance in any."""
        return self.standings[0] if self.standings and self.standings[0].held else None

    @property
    def tied(self) -> list[ChoiceCell]:
        """Engines whose costs overlap with that of the one to take in all scenes that it holds."""
        return [item for item in self.standings if self.taken and item.ties(self.taken)]

    @property
    def exceptions(self) -> list[str]:
        """Best or closest engine of each scene that the engine to take does not hold, or holds less cheaply."""
        taken = self.taken
        if taken is None or not taken.by_scene:
            return []
        alone = [item for item in self.matrix.columns if not item.whole and item.group == self.column.group]
        texts = []
        for column, cell in zip(alone, taken.each, strict=True):
            there = replace(self, column=column)
            if cell.holds and there.taken is not None and cell.cost <= TIE * there.taken.cost:
                continue
            if there.taken is not None:
                texts.append(f"{column.title}: {take_words(self.matrix, there.taken)}, {there.taken.text}")
            else:
                texts.append(f"{column.title}: {there.closest_words}")
        return texts

    @property
    def failures(self) -> list[ChoiceCell]:
        """Cells of settings that fail, one per formulation; ``name`` for a reader, ``why`` in at most twelve words.

        Where another setting of the formulation holds it, only a failing default has an entry, whose ``text`` is !.
        """
        entries: list[tuple[int, float, ChoiceCell, str]] = []
        for row in self.matrix.rows:
            if not row.setting or row.own_equations or (self.engines is not None and row.engine not in self.engines):
                continue
            for study in self.column.studies:
                asked = (study, self.asked.tolerance, self.asked.forces)
                mended = self.matrix.held(row.engine, row.formulation, *asked)
                if row.setting != "default" and mended:
                    continue
                for number_of_row, (expected, short) in self.matrix.studies[study].short.items():
                    steps = [item for item in row.found.get(study, ()) if item.row == number_of_row]
                    cell = cell_of(steps, self.asked.tolerance, self.asked.forces) if steps else None
                    if cell is None or cell.state in _SILENT:
                        continue
                    if cell.state == Verdict.REFUSED and Verdict.REFUSED not in expected:
                        continue  # the text is about other points
                    sizes = [size for item in steps if (size := item.tolerance(self.asked.forces)) is not None]
                    name, sign = f"{take_words(self.matrix, row)}, {row.setting}", "!" if mended else ""
                    failure = cell._replace(name=name, why=short, text=sign)
                    place = _STATES.index(cell.state) if cell.state in _STATES else len(_STATES)
                    entries.append((place, -min(sizes, default=0.0), failure, row.name))
        entries.sort(key=lambda item: item[:2])
        best_of = {name: item for *_, item, name in reversed(entries)}
        return [item for *_, item, name in entries if best_of[name] is item][:_REASONS]

    def _sizes(self, name: str, setting: str, *, own: bool) -> list[tuple[float, str]]:
        """Sizes that a method of candidates gives of settings that begin with ``setting``, and their names.

        ``own``: at the step of their row alone.
        """
        sizes = {}
        for row in self.matrix.rows:
            chosen = row.engine not in self.matrix.witnesses if self.engines is None else row.engine in self.engines
            if not chosen or row.own_equations or not row.setting.startswith(setting or row.setting or "-"):
                continue
            for study in self.column.studies:
                items = row.found.get(study, ())
                first = {item.row: item for item in reversed(items)}
                for item in first.values() if own else items:
                    size = getattr(item, name)(self.asked.forces)
                    if size is not None and math.isfinite(size):
                        sizes[size] = f"{take_words(self.matrix, row)}, {row.setting}"
        return sorted(sizes.items())

    @property
    def most_accurate(self) -> tuple[float, str] | None:
        """Least error that a setting keeps without luck, relative to the quantity's size, and the setting."""
        return next(iter(self._sizes("tolerance", "", own=False)), None)

    @property
    def worst_default(self) -> tuple[float, str] | None:
        """Largest error of an engine's default setting, relative to the quantity's size, and the setting."""
        return next(reversed(self._sizes("error", "default", own=True)), None)

    @property
    def next_words(self) -> str:
        """The next engine and what it costs relative to the one to take; or what it does not do."""
        best, second = self.taken, next((item for item in self.standings[1:2] if item.held), None)
        if second is None or best is None:
            return "no other engine holds it" if best else ""
        pairs = [(mine, other) for mine, other in zip(second.each, best.each, strict=True) if mine.holds]
        part = f" in {len(pairs)} of {second.scenes} scenes" if second.held < best.held else ""
        name = f"{take_words(self.matrix, second)}{part}"
        if second.ties(best):
            return f"{name}, a tie"
        ratios = sorted(float(f"{mine.cost / other.cost:.2g}") for mine, other in pairs if other.holds)
        if not ratios:
            return name
        ends = "–".join(f"{item:g}" for item in dict.fromkeys((ratios[0], ratios[-1])))
        is_open = any(mine.open for mine, other in pairs if other.holds)
        return f"{name}, {ends}× the cost{', lead open' if is_open else ''}"

    @property
    def closest_words(self) -> str:
        """Text in place of a choice where nothing holds the tolerance."""
        if not self.judged:
            return "not judged"
        ran = [standing for standing in self.standings if standing.state != NO_RUN]
        if not ran:
            return "no engine was run"
        if all(standing.state == Verdict.NOT_JUDGED for standing in ran):
            return NOT_REACHED
        best = self.standings[0]
        return f"none; closest {take_words(self.matrix, best)}: {best.why or best.state}"

    @property
    def forces_words(self) -> str:
        """Effect of forces on the answer for motion alone."""
        taken = self.both.taken
        if taken is None:
            return "✗ none" if self.both.judged else "not judged"
        # A kind of several scenes is held by settings that only the cells of these name.
        best, second = (
            item and (item.engine, item.name, [cell.name for cell in item.each]) for item in (self.taken, taken)
        )
        return "✓ the same choice" if best == second else f"{take_words(self.matrix, taken)}, {speed_words(taken)}"


@dataclass(frozen=True)
class Chip:
    """One clause of the answer in a line: engines whose costs tie, for kinds of scenes.

    Attributes:
        engines: code names; empty: no engine holds the tolerance, or it is not judged.
        title: engines by name, or the text in place of one.
        words: kinds of scenes.
        judged: False: what is asked for is judged in none of them.
    """

    engines: tuple[str, ...]
    title: str
    words: str
    judged: bool = True


@dataclass(frozen=True)
class FirstAnswer:
    """Answer to a question: for each column of the matrix, a kind of scenes or one scene."""

    question: ReaderQuestion
    columns: list[ColumnAnswer]
    chips: list[Chip]

    @property
    def kinds(self) -> list[ColumnAnswer]:
        """Answers for kinds of scenes."""
        return [item for item in self.columns if item.column.whole]

    @property
    def scenes(self) -> list[ColumnAnswer]:
        """Answers for single scenes."""
        return [item for item in self.columns if not item.column.whole]

    def chips_of(self, group: str) -> list[Chip]:
        """Chips of one kind of scenes."""
        return [chip for item in self.kinds if item.column.group == group for chip in _chips(item.matrix, [item])]

    @property
    def sentence(self) -> str:
        """The chips as one sentence."""
        if not self.chips:
            return "Nothing was run that could be advised."
        clauses = "; ".join(f"{chip.title} {chip.words}" for chip in self.chips)
        return f"The cheapest that holds {self.question.words}: {clauses}."


def answer(matrix: ChoiceMatrix, tolerance: float, forces: bool, engines: Collection[str] | None = None) -> FirstAnswer:
    """Answer of a matrix to a question; ``engines``: of these alone."""
    asked = ReaderQuestion(tolerance, forces)
    columns = [ColumnAnswer(matrix, item, asked, engines) for item in matrix.columns]
    return FirstAnswer(asked, columns, _chips(matrix, [item for item in columns if item.column.whole]))


def _state_rank(cell: ChoiceCell) -> tuple[bool, bool]:
    return not cell.holds, cell.state in _SILENT


def _chips(matrix: ChoiceMatrix, kinds: Sequence[ColumnAnswer]) -> list[Chip]:
    """Kinds by the engine to take, engines with the most kinds first; then kinds that none holds or judges."""
    taken: dict[tuple[str, ...], list[str]] = {}
    nobody, silent = [], []
    for item in kinds:
        name = _lower(item.column.title)
        many = len(item.column.scenes)
        if item.taken is not None:
            equals = [tie.engine for tie in item.tied if tie.held == item.taken.held]
            engines = sorted([item.taken.engine, *equals], key=lambda engine: matrix.title(engine).lower())
            part = f"{item.taken.held} of {item.taken.scenes} scenes of " if item.taken.held < item.taken.scenes else ""
            taken.setdefault(tuple(engines), []).append(f"{part}{name}")
        elif not item.judged:
            silent.append(name)
        elif all(x.state in {NO_RUN, CANNOT, Verdict.NOT_JUDGED} for x in item.standings):
            silent.append(f"{name} (no result)")
        else:
            nobody.append(
                f"all {many} scenes of {name}" if many > 2 else f"both scenes of {name}" if many == 2 else name
            )
    ranked = sorted(taken.items(), key=lambda item: -len(item[1]))
    chips = [
        Chip(engines, " or ".join(matrix.title(engine) for engine in engines), f"for {listed(names)}")
        for engines, names in ranked
    ]
    chips += [Chip((), "No engine", f"for {listed(nobody)}")] if nobody else []
    return chips + ([Chip((), "Not judged", f"for {listed(silent)}", judged=False)] if silent else [])


def _lower(title: str) -> str:
    return title[:1].lower() + title[1:]


def listed(words: Sequence[str]) -> str:
    """Words as a list in a sentence; equal endings are written once: ``rolling and slipping balls``."""
    last = [word.rpartition(" ")[2] for word in words]
    for ending in dict.fromkeys(last):
        alike = [word for word in words if word.endswith(f" {ending}") and word.count(" ") == 1]
        if len(alike) > 1 and last.count(ending) == len(alike):
            joined = " and ".join(word.partition(" ")[0] for word in alike) + f" {ending}"
            words = [joined, *(word for word in words if word not in alike)]
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else words[0]


def take_words(matrix: ChoiceMatrix, taken: ChoiceCell | ChoiceRow) -> str:
    """Engine and formulation for a reader."""
    return f"{matrix.title(taken.engine)} {taken.formulation.replace('_', ' ')}".strip()


def speed_range(taken: ChoiceCell) -> str:
    """Speeds of the engine to take, from the slowest to the fastest scene that it holds."""
    return speeds([cell for cell in taken.each if cell.holds])


def speed_words(taken: ChoiceCell) -> str:
    """The same with the part of the scenes that it holds."""
    return f"{speed_range(taken)}{taken.share}"


def told(matrix: ChoiceMatrix, taken: ChoiceCell) -> str:
    """Engine, formulation, setting and step for a reader."""
    return ", ".join(filter(None, (take_words(matrix, taken), taken.setting)))
