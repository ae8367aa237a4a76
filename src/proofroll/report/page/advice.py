"""Advice in words: the answer for each kind of scenes and each scene as sentences, and the best for all scenes."""

import math
from dataclasses import dataclass

from proofroll.core.number_format import counted, number
from proofroll.core.verdict import Verdict
from proofroll.report.page.answer import (
    NOT_REACHED,
    ColumnAnswer,
    answer,
    speed_words,
    take_words,
    told,
)
from proofroll.report.page.choice_cell import CANNOT, NO_RUN
from proofroll.report.page.choice_matrix import ASKED, ChoiceColumn, ChoiceMatrix


@dataclass(frozen=True)
class Advised:
    """Advice for some scenes.

    Attributes:
        of: name of the group or scene; ``all``: all scenes.
        sentence: for a person.
        choice: setting and step, or formulation; None: nothing holds the tolerance.
        cost: of the choice, wall seconds per simulated second at the slowest scene that it holds; None: without a
            choice, or for ``all``.
        judged: False: motion is judged in none of the scenes, so that nothing can be chosen.
    """

    of: str
    sentence: str
    choice: str | None = None
    cost: float | None = None
    judged: bool = True


@dataclass(frozen=True)
class QuestionAnswer:
    """Answer to a question: a tolerance relative to the path, whether forces count, a sentence, and all advice."""

    tolerance: float
    forces: bool
    sentence: str
    advice: list[Advised]


def answers_to_all(matrix: ChoiceMatrix) -> list[QuestionAnswer]:
    """Answers to every question that a page offers."""
    return [
        QuestionAnswer(tolerance, forces, answer(matrix, tolerance, forces).sentence, advice(matrix, tolerance, forces))
        for forces, tolerance in ASKED
    ]


def advice(matrix: ChoiceMatrix, tolerance: float, forces: bool) -> list[Advised]:
    """Advice for each column of the matrix, then for all scenes.

    Where forces are asked for and are not judged, the advice is for motion alone and says so.
    """
    columns = answer(matrix, tolerance, False).columns
    return [*(_of_column(matrix, item, forces) for item in columns), over_all(matrix, tolerance, forces)]


def _of_column(matrix: ChoiceMatrix, motion: ColumnAnswer, forces: bool) -> Advised:
    """Advice for a column in the words of the answer's table; ``motion``: the answer without forces."""
    column, both = motion.column, motion.both
    item = both if forces and both.judged else motion
    head = f"{column.title}{'' if column.whole else f' ({column.meaning})'}"
    if not motion.judged:
        return Advised(column.name, f"{head}: motion is not judged there.", judged=False)
    alone = ": forces are not judged; for motion alone" if forces and not both.judged else ""
    head = f"{head}{alone} to {number(motion.asked.tolerance)}{' with forces' if item is both else ''}"
    taken = item.taken
    if taken is None:
        return Advised(column.name, f"{head}: {item.closest_words}.")
    sentence = f"{head}: take {told(matrix, taken)} ({speed_words(taken)} real time); next: {item.next_words}"
    sentence += "".join(f"; {text}" for text in item.exceptions)
    sentence += "." if forces else f"; if forces count: {motion.forces_words}."
    return Advised(column.name, sentence, taken.name or take_words(matrix, taken), taken.cost)


def over_all(matrix: ChoiceMatrix, tolerance: float, forces: bool) -> Advised:
    """Advice over all scenes: fewest formulations that hold the tolerance in most of them, the most useful first."""
    alone = {(column.group, column.name): column for column in matrix.columns if not column.whole}
    judged = {name: item for name, item in alone.items() if not matrix.unjudged[forces].issuperset(item.studies)}
    columns = {name: item for name, item in judged.items() if _was_judged(matrix, item, tolerance, forces)}
    if judged and not columns:
        return Advised("all", f"Over all: {NOT_REACHED}.")
    if alone and not columns:
        return Advised("all", f"Over all: {'forces are' if forces else 'motion is'} judged in no scene.")
    costs = {
        row.name: {
            name: cell.cost
            for name, column in columns.items()
            if (cell := matrix.cell(row, column, tolerance, forces)).holds
        }
        for row in matrix.models
    }
    named = {row.name: take_words(matrix, row) for row in matrix.models}
    missing = set(columns)
    steps: list[str] = []
    chosen: list[str] = []
    while missing and (best := max(costs, key=lambda name: _use(costs[name], missing), default="")):
        gained = missing & costs[best].keys()
        if not gained:
            break
        missing -= gained
        chosen.append(best)
        steps.append(f"{named[best]} {'holds it in' if not steps else 'brings it to'} {len(columns) - len(missing)}")
    asked = f"Over all, {counted(len(columns), 'scenes')}, to {number(tolerance)}{' with forces' if forces else ''}"
    left = ", ".join(item.title for name, item in columns.items() if name in missing)
    told_steps = "; ".join(steps) or "nothing that was run and timed holds it"
    sentence = f"{asked}: {told_steps}{f'; nothing holds it for {left}' if steps and left else ''}."
    return Advised("all", sentence, ", ".join(chosen) or None)


def _use(costs: dict[tuple[str, str], float], missing: set[tuple[str, str]]) -> tuple[int, float]:
    """Ranking of a formulation: number of scenes that it adds, then its cheapness there."""
    gained = missing & costs.keys()
    return len(gained), -sum(math.log(costs[name]) for name in gained if costs[name] > 0)


def _was_judged(matrix: ChoiceMatrix, column: ChoiceColumn, tolerance: float, forces: bool) -> bool:
    """False if every formulation was left out there, say for lack of time."""
    cells = (matrix.cell(row, column, tolerance, forces) for row in matrix.models)
    return any(cell.state not in {NO_RUN, CANNOT, Verdict.NOT_JUDGED} for cell in cells)
