"""Advice in words: the answer for each kind of scenes and each scene as sentences, and the best for all scenes."""

import math
from collections.abc import Collection
from dataclasses import dataclass

from proofroll.core.number_format import counted, number
from proofroll.core.verdict import Verdict
from proofroll.report.page.answer import ColumnAnswer, FirstAnswer, ReaderQuestion, answer, of_column, take_words
from proofroll.report.page.choice_cell import NO_RUN, PARTLY
from proofroll.report.page.choice_matrix import ChoiceColumn, ChoiceMatrix, EngineStanding

NOTHING = "nothing that was run and timed holds it"
NOT_REACHED = "no run could be judged, for lack of time or of a truth"


@dataclass(frozen=True)
class Advised:
    """Advice for some scenes.

    Attributes:
        of: name of the group or scene; ``all``: all scenes.
        sentence: for a person.
        choice: setting and step, or formulation; None: nothing holds the tolerance.
        cost: of the choice, wall seconds per simulated second at the slowest scene; None: without a choice, or for
        ``all``.
        judged: False: motion is judged in none of the scenes, so that nothing can be chosen.
    """

    of: str
    sentence: str
    choice: str | None = None
    cost: float | None = None
    judged: bool = True


def advice(
    matrix: ChoiceMatrix, tolerance: float, forces: bool, engines: Collection[str] | None = None
) -> list[Advised]:
    """Advice for each column of the matrix, then for all scenes; ``engines``: of these alone.

    Where forces are asked for and are not judged, the advice is for motion alone and says so.
    """
    answered = answer(matrix, tolerance, forces, engines)
    answers = {item.column.key: item for item in (*answered.kinds, *answered.scenes)}
    columns = [answers[column.key] for column in matrix.columns]
    return [*(_of_column(matrix, answered, item, engines) for item in columns), over_all(matrix, tolerance, forces)]


def _of_column(
    matrix: ChoiceMatrix, answered: FirstAnswer, item: ColumnAnswer, engines: Collection[str] | None
) -> Advised:
    """Advice for a column: the cheapest that holds the tolerance, the best of other engines, the effect of forces."""
    column, asked = item.column, answered.question
    name = column.name
    size = number(asked.tolerance)
    head = f"{column.title}{'' if column.whole else f' ({column.meaning})'} to {size}"
    if matrix.unjudged[False].issuperset(column.studies):
        return Advised(name, f"{head}: motion is not judged there.", judged=False)
    if asked.forces and not item.judged:
        head = f"{column.title}: forces are not judged; for motion alone to {size}"
        item = of_column(matrix, column, ReaderQuestion(asked.tolerance, False), engines)
    elif asked.forces:
        head += " with forces"
    ran = [standing for standing in item.standings if standing.cell.state != NO_RUN]
    if not ran:
        return Advised(name, f"{head}: no engine was run.")
    if all(standing.cell.state == Verdict.NOT_JUDGED for standing in ran):
        return Advised(name, f"{head}: {NOT_REACHED}.")
    taken = item.taken
    others = [_other(matrix, standing, taken) for standing in ran if standing is not taken]
    clauses = [f"take {_told(matrix, taken)} ({spent(taken)})" if taken else NOTHING, *others]
    changed = "" if asked.forces else _with_forces(matrix, column, asked.tolerance, taken, engines)
    sentence = f"{head}: {'; '.join(clauses)}.{changed}"
    if taken is None:
        return Advised(name, sentence)
    return Advised(name, sentence, taken.cell.name or f"{taken.engine} {taken.formulation}".strip(), taken.cell.cost)


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
    sentence = f"{asked}: {'; '.join(steps) or NOTHING}{f'; nothing holds it for {left}' if steps and left else ''}."
    return Advised("all", sentence, ", ".join(chosen) or None)


def _use(costs: dict[tuple[str, str], float], missing: set[tuple[str, str]]) -> tuple[int, float]:
    """Ranking of a formulation: number of scenes that it adds, then its cheapness there."""
    gained = missing & costs.keys()
    return len(gained), -sum(math.log(costs[name]) for name in gained if costs[name] > 0)


def _was_judged(matrix: ChoiceMatrix, column: ChoiceColumn, tolerance: float, forces: bool) -> bool:
    """False if every formulation was left out there, say for lack of time."""
    cells = (matrix.cell(row, column, tolerance, forces) for row in matrix.models)
    return any(cell.state not in {NO_RUN, "cannot", Verdict.NOT_JUDGED} for cell in cells)


def _told(matrix: ChoiceMatrix, standing: EngineStanding) -> str:
    setting = standing.setting
    return f"{take_words(matrix, standing)}{f', {setting}' if setting else ''}{standing.cell.share}"


def spent(standing: EngineStanding, more: str = "") -> str:
    """Speed, and the scene that it is of with its setting, where scenes need different ones."""
    study, setting = standing.cell.slowest
    words = setting.removeprefix(f"{standing.engine} {standing.formulation}").strip()
    return f"{standing.cell.text} real time{more}{f'; {study} needs most: {words}' if study else ''}"


def _other(matrix: ChoiceMatrix, standing: EngineStanding, cheapest: EngineStanding | None) -> str:
    """Clause on another engine: its cost relative to the cheapest, or the reason why it does not hold the tolerance."""
    name = take_words(matrix, standing)
    if standing.cell.holds and cheapest is not None:
        if standing.ties(cheapest):
            return f"{_told(matrix, standing)} is a tie"
        return f"{_told(matrix, standing)} costs {standing.cell.cost / cheapest.cell.cost:.2g} times that"
    if standing.cell.state == Verdict.NOT_JUDGED:
        return f"{name} was not judged"
    if standing.cell.state == "cannot":
        return f"{matrix.title(standing.engine)} cannot represent it"
    if standing.cell.state == PARTLY:
        return f"{name} {standing.cell.why}"
    return f"{name} does not get there ({standing.cell.why})" if standing.cell.why else f"{name} holds it, not timed"


def _with_forces(
    matrix: ChoiceMatrix,
    column: ChoiceColumn,
    tolerance: float,
    without: EngineStanding | None,
    engines: Collection[str] | None,
) -> str:
    """Sentence on the effect of forces for an answer about motion alone."""
    both = of_column(matrix, column, ReaderQuestion(tolerance, True), engines)
    if not both.judged:
        return " Forces are not judged there."
    judged = [scene.words for scene in column.scenes if not matrix.unjudged[True].issuperset(scene.studies)]
    if both.taken is None:
        return " If forces count, too, nothing that was run and timed holds it."
    taken = f"{_told(matrix, both.taken)} ({spent(both.taken)})"
    if len(judged) < len(column.scenes):
        return f" In {', '.join(judged)}, where forces are judged, take {taken} for both."
    if without is not None and both.taken.cell.cost == without.cell.cost:
        return " It holds the forces, too."
    return f" If forces count, too, take {taken}."
