"""Three sentences for the whole report, written from its data: what agrees, what does not, and what to use."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import log
from typing import Any

from proofroll.core.number_format import counted, number
from proofroll.report.comparison.records import ReportedComparison
from proofroll.report.comparison.scores import EVERYDAY, cheapest, closest, furthest_off, scores
from proofroll.report.labels import name_of, off_by, step, symbol, unit, with_caveat
from proofroll.report.parts import PartEntry
from proofroll.studies.stability.records import StabilityStudy
from proofroll.studies.tradeoff.recommend import Answer
from proofroll.studies.tradeoff.records import TradeoffStudy


def three_sentences(comparisons: Sequence[ReportedComparison], entries: Mapping[str, Sequence[PartEntry]]) -> list[str]:
    """Three sentences: the best agreement, silent disagreement, and advice.

    Args:
        comparisons: of the report.
        entries: of its further studies by the key of their kind; ``tradeoffs`` and ``stability`` count.
    """
    maps = [entry.study for entry in entries.get("stability", ()) if entry.study is not None]
    return [_agrees(comparisons), _silent(comparisons, maps), _use(comparisons, entries.get("tradeoffs", ()))]


def _agrees(comparisons: Sequence[ReportedComparison]) -> str:
    if not comparisons:
        return "Nothing was compared with the truth in this report."
    rows = [row for comparison in comparisons for row in comparison.rows]
    counts = Counter(row.verdict.value for row in rows)
    agree = "agrees" if counts["agrees"] == 1 else "agree"
    where = "one comparison" if len(comparisons) == 1 else f"{len(comparisons)} comparisons"
    said = f"Of {counted(len(rows), 'settings')} in {where}, {counts['agrees']} {agree} with the truth everywhere"
    rest = {
        "unconfirmed": "at this step, with a limit that is not confirmed",
        "incomplete": "without reporting all that is judged",
        "converges": "with a finer step",
    }
    parts = [f"{counts[verdict]} {words}" for verdict, words in rest.items() if counts[verdict]]
    if parts:
        said += f", {' and '.join(parts)}"
    if counts["refused"]:
        said += f"; {counts['refused']} {'refuses' if counts['refused'] == 1 else 'refuse'} the scene or a case of it"
    best = closest(comparisons[0])
    if best is None:
        return f"{said}; none gave motion and forces in every case of the first comparison."
    first = " in the first" if len(comparisons) > 1 else ""
    return (
        f"{said}; closest{first} is {best.name}, whose motion stays within {number(best.motion)} of its range and "
        f"whose forces within {number(best.forces)} of the largest."
    )


def _silent(comparisons: Sequence[ReportedComparison], maps: Sequence[StabilityStudy]) -> str:
    """Sentence on settings that are silently wrong, and on boundaries of stability passed in silence."""
    found = [item for comparison in comparisons for item in _wrong(comparison)]
    silent, boundaries = (sum(getattr(study, key) for study in maps) for key in ("silent", "boundaries"))
    passed = f"{silent} of {boundaries} boundaries of stability and accuracy are passed without a word"
    if not found:
        nothing = "No setting that ran to its end differs from the truth"
        if not comparisons:
            return f"{passed}." if maps else "Nothing that was run could be silently wrong: nothing was compared."
        return f"{nothing}; {passed}." if maps else f"{nothing}."
    _, name, text = max(found)
    verbs = ("differ", "run") if len(found) > 1 else ("differs", "runs")
    said = f"{len(found)} {verbs[0]} from the truth and {verbs[1]} to the end without a word, worst {name}: {text}"
    return f"{said}; {passed}." if maps else f"{said}."


def _wrong(comparison: ReportedComparison) -> list[tuple[float, str, str]]:
    """Rows that differ though each of their runs ended as done: relative error, name, and text of the error."""
    found = []
    for name, row, runs in comparison.lines():
        if row.verdict != "differs" or any(run.status != "done" for run in runs):
            continue
        worst = furthest_off(comparison, runs)
        relative = 0.0 if worst is None else worst.error / worst.scale
        text = "a reaction or an event is wrong" if worst is None else off_by(worst)
        found.append((relative, with_caveat(name, row.caveat), text))
    return found


def _use(comparisons: Sequence[ReportedComparison], tradeoffs: Sequence[Any]) -> str:
    """The cheapest that holds the usual tolerance, from the trade-off; else from the first comparison's timings."""
    for entry in tradeoffs:
        if entry.study is None:
            continue
        answers = [item.answer for item in entry.advice if item.answer.choice is not None]
        answer = min(answers, key=lambda item: _from_everyday(item, entry.study), default=None)
        if answer is not None:
            choice, least = answer.choice.point, answer.least_model
            wanted = f"{symbol(answer.quantity)} to {number(answer.tolerance)} {unit(answer.unit)}".strip()
            wanted += f" in {entry.study.scene}"
            size = step(choice.resolution, choice.step)
            said = f"For {wanted} use {with_caveat(name_of(choice), choice.caveat)}{f' at {size}' if size else ''}"
            said += f", at {number(choice.seconds_per_second)} s of computing per simulated second"
            if least:
                said += (
                    f"; where this scene is all there is, its own equations do it at "
                    f"{number(least.point.seconds_per_second)} s ({name_of(least.point)})"
                )
            return f"{said}."
    for comparison in comparisons:
        best = cheapest(scores(comparison), "worst", EVERYDAY)
        if best:
            return (
                f"For motion and forces to {100 * EVERYDAY:g} % in {comparison.scene} use {best.name}, at "
                f"{number(best.seconds_per_second)} s of computing per simulated second."
            )
    return f"Nothing that was timed holds motion and forces to {100 * EVERYDAY:g} %, so nothing can be recommended."


def _from_everyday(answer: Answer, study: TradeoffStudy) -> tuple[bool, float]:
    """Distance of a tolerance from the usual one: the study's own quantity first, then by its logarithm."""
    scale = study.quantities[answer.quantity].scale or 1.0
    return answer.quantity != study.quantity, abs(log(answer.tolerance / scale / EVERYDAY))
