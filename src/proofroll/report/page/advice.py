"""Advice in words: the cheapest setting for each group of scenes and each scene, alternatives, and the best for all."""

import json
import math
from dataclasses import dataclass

from proofroll.core.number_format import counted, number
from proofroll.core.verdict import Verdict
from proofroll.report.page.choice_matrix import ASKED, NO_RUN, SEVERITY, ChoiceCell, ChoiceColumn, ChoiceMatrix

NOTHING = "nothing that was run and timed holds it"
NOT_REACHED = "no run could be judged, for lack of time or of a truth"


@dataclass(frozen=True)
class Advised:
    """Advice for some scenes.

    Attributes:
        of: name of the group or study; ``all``: all studies.
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


def advice(matrix: ChoiceMatrix, tolerance: float, forces: bool) -> list[Advised]:
    """Advice for each column of the matrix, then for all studies."""
    return [
        *(of_column(matrix, column, tolerance, forces) for column in matrix.columns),
        over_all(matrix, tolerance, forces),
    ]


def words(matrix: ChoiceMatrix) -> str:
    """JSON of the sentences for every tolerance in :data:`ASKED`, and of parts for sentences on some engines.

    The parts are the heads of the sentences, and for each column its engines, the cheapest first: engine, cost (null:
    the tolerance is not held), name or the clause why the tolerance is not held, and what the cost is said to be.
    """
    answers = []
    for forces, tolerance in ASKED:
        heads, engines = [], []
        for column in matrix.columns:
            head, judged = _asked(matrix, column, tolerance, forces)
            found = {} if judged is None else _engines(matrix, column, tolerance, judged)
            heads.append(head)
            engines.append(
                [
                    (engine, cell.cost, _told(name, cell), _spent(name, cell))
                    if math.isfinite(cell.cost)
                    else (engine, None, _other(name, cell, cell), "")
                    for engine, (name, cell) in found.items()
                ]
            )
        sentences = [item.sentence for item in advice(matrix, tolerance, forces)]
        answers.append({"said": sentences, "heads": heads, "engines": engines})
    return json.dumps(answers, ensure_ascii=False, separators=(",", ":"))


def of_column(matrix: ChoiceMatrix, column: ChoiceColumn, tolerance: float, forces: bool) -> Advised:
    """Advice for a column: the cheapest that holds the tolerance, the best of other engines, the effect of forces.

    Where forces are asked for and are not judged, the advice is for motion alone and says so.
    """
    asked, judged = _asked(matrix, column, tolerance, forces)
    engines = _engines(matrix, column, tolerance, bool(judged))
    if not engines:
        return Advised(column.title, f"{asked} no engine was run.")
    first, *others = engines.values()
    if judged is None:
        return Advised(column.title, f"{asked}: motion is not judged there.", judged=False)
    if not _was_judged(matrix, column, tolerance, judged):
        return Advised(column.title, f"{asked}: {NOT_REACHED}.")
    clauses = [_other(name, cell, first[1]) for name, cell in others]
    held = math.isfinite(first[1].cost)
    if held:
        clauses.insert(0, f"take {_told(*first)} ({_spent(*first)})")
    else:
        clauses = [NOTHING, _other(*first, first[1]), *clauses]
    changed = "" if forces else _with_forces(matrix, column, tolerance, first[1])
    choice = (_named(*first), first[1].cost) if held else (None, None)
    return Advised(column.title, f"{asked} {'; '.join(clauses)}.{changed}", *choice)


def over_all(matrix: ChoiceMatrix, tolerance: float, forces: bool) -> Advised:
    """Advice over all studies: fewest formulations that hold the tolerance in most of them, the most useful first."""
    alone = {column.studies[0]: column for column in matrix.columns if len(column.studies) == 1}
    judged = {name: column for name, column in alone.items() if name not in matrix.unjudged[forces]}
    columns = {name: column for name, column in judged.items() if _was_judged(matrix, column, tolerance, forces)}
    if judged and not columns:
        return Advised("all", f"Over all: {NOT_REACHED}.")
    if alone and not columns:
        return Advised("all", f"Over all: {'forces are' if forces else 'motion is'} judged in no study.")
    costs = {
        row.name: {
            name: cell.cost
            for name, column in columns.items()
            if math.isfinite((cell := matrix.cell(row, column, tolerance, forces)).cost)
        }
        for row in matrix.models
    }
    missing = set(columns)
    steps: list[str] = []
    chosen: list[str] = []
    while missing and (best := max(costs, key=lambda name: _use(costs[name], missing), default="")):
        gained = missing & costs[best].keys()
        if not gained:
            break
        missing -= gained
        chosen.append(best)
        steps.append(f"{best} {'holds it in' if not steps else 'brings it to'} {len(columns) - len(missing)}")
    asked = f"Over all, {counted(len(columns), 'studies')}, to {number(tolerance)}{' with forces' if forces else ''}"
    left = ", ".join(matrix.titles[name] for name in columns if name in missing)
    sentence = f"{asked}: {'; '.join(steps) or NOTHING}{f'; nothing holds it for {left}' if steps and left else ''}."
    return Advised("all", sentence, ", ".join(chosen) or None)


def _use(costs: dict[str, float], missing: set[str]) -> tuple[int, float]:
    """Ranking of a formulation: number of studies that it adds, then its cheapness there."""
    gained = missing & costs.keys()
    return len(gained), -sum(math.log(costs[name]) for name in gained if costs[name] > 0)


def _asked(matrix: ChoiceMatrix, column: ChoiceColumn, tolerance: float, forces: bool) -> tuple[str, bool | None]:
    """Head of a sentence, and whether the answer is about forces, too; None: motion is not judged."""
    title = column.title if column.whole else f"{column.name} (“{column.title}”)"
    if column.whole and len(column.studies) == 1:
        title += f" ({column.studies[0]})"
    size = number(tolerance)
    if _unjudged(matrix, column, False):
        return f"For {title} to {size}", None
    if forces and _unjudged(matrix, column, True):
        return f"For {title} forces are not judged; for motion alone to {size}", False
    return f"For {title} to {size}{' with forces' if forces else ''}", forces


def _unjudged(matrix: ChoiceMatrix, column: ChoiceColumn, forces: bool) -> bool:
    return matrix.unjudged[forces].issuperset(column.studies)


def _was_judged(matrix: ChoiceMatrix, column: ChoiceColumn, tolerance: float, forces: bool) -> bool:
    """False if every formulation was left out there, say for lack of time."""
    cells = (matrix.cell(row, column, tolerance, forces) for row in matrix.models)
    return any(cell.state not in {NO_RUN, Verdict.NOT_JUDGED} for cell in cells)


def _engines(
    matrix: ChoiceMatrix, column: ChoiceColumn, tolerance: float, forces: bool
) -> dict[str, tuple[str, ChoiceCell]]:
    """Best formulation of each engine, the best engine first: cheapest that holds the tolerance, else the closest."""
    best_of: dict[str, tuple[str, ChoiceCell]] = {}
    for row in matrix.models:
        cell = matrix.cell(row, column, tolerance, forces)
        if row.found.keys() & set(column.studies):
            best = best_of.setdefault(row.engine, (row.name, cell))
            if _standing(cell) < _standing(best[1]):
                best_of[row.engine] = (row.name, cell)
    return dict(sorted(best_of.items(), key=lambda item: _standing(item[1][1])))


def _standing(cell: ChoiceCell) -> tuple[float, float, int]:
    held = math.isfinite(cell.cost)
    return cell.absent if held else math.inf, cell.cost, SEVERITY.index(cell.state)


def _named(name: str, cell: ChoiceCell) -> str:
    return cell.name or name


def _told(name: str, cell: ChoiceCell) -> str:
    return f"{_named(name, cell)}{cell.share}"


def _spent(name: str, cell: ChoiceCell, more: str = "") -> str:
    """Cost, and the scene that it is of with its setting, where scenes need different ones."""
    study, setting = cell.slowest
    return f"{cell.text} s/s{more}{f'; {study} needs most: {setting.removeprefix(name).strip()}' if study else ''}"


def _other(name: str, cell: ChoiceCell, first: ChoiceCell) -> str:
    """Clause on another engine: its cost relative to the cheapest, or the reason why it does not hold the tolerance."""
    if math.isfinite(cell.cost):
        return f"{_told(name, cell)} costs {_times(cell.cost, first.cost)}"
    if cell.state == Verdict.NOT_JUDGED:
        return f"{name} was not judged"
    return f"{name} does not get there ({cell.why})" if cell.why else f"{_named(name, cell)} holds it, not timed"


def _with_forces(matrix: ChoiceMatrix, column: ChoiceColumn, tolerance: float, without: ChoiceCell) -> str:
    """Sentence on the effect of forces for an answer about motion alone."""
    if _unjudged(matrix, column, True):
        return " Forces are not judged there."
    name, cell = next(iter(_engines(matrix, column, tolerance, True).values()))
    judged = [study for study in column.studies if study not in matrix.unjudged[True]]
    if len(judged) < len(column.studies) and math.isfinite(cell.cost):
        taken = f"{_named(name, cell)} ({_spent(name, cell)})"
        return f" In {', '.join(judged)}, where forces are judged, take {taken} for both."
    if not math.isfinite(cell.cost):
        return " If forces count, too, nothing that was run and timed holds it."
    if cell.cost == without.cost:
        return " It holds the forces, too."
    more = f", {_times(cell.cost, without.cost)}" if math.isfinite(without.cost) else ""
    return f" If forces count, too, take {_named(name, cell)} ({_spent(name, cell, more)})."


def _times(cost: float, of: float) -> str:
    """Cost relative to another one in words: ``as much``, ``3.4 times that``."""
    times = float(f"{cost / of:.2g}") if of else math.inf
    return "as much" if times == 1 else f"{times:g} times that"
