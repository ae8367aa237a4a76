"""Conclusions of a comparison as sentences, drawn from its records alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from proofroll.core.events import EVENT_ORDER
from proofroll.core.number_format import counted
from proofroll.report.comparison.records import ReportedComparison, ReportedRow
from proofroll.report.comparison.spread import ALONE
from proofroll.report.kinds import ReportKind
from proofroll.report.labels import names, unjudged


@dataclass(frozen=True)
class Conclusions:
    """Conclusions of a comparison: one paragraph that answers its question, and further sentences."""

    answer: str
    sentences: list[str]


def conclusions(content: ReportedComparison, truths: Sequence[Any], kind: type[ReportKind] | None) -> Conclusions:
    """Conclusions of a comparison; its kind of scene adds a sentence about its truths."""
    return Conclusions(
        _answer(content),
        [
            *(item.sentence for item in content.spread),
            *_order(content),
            *(kind.sentences(truths) if kind is not None else ()),
            _surprises(content),
        ],
    )


def _answer(content: ReportedComparison) -> str:
    """Sentence: counts of verdicts, and whether they were expected."""
    rows, alone = content.rows, content.laws_alone
    unexpected = len(content.contradictions)
    expected = f" Not expected: {counted(unexpected, 'results')}."
    if content.as_expected:
        expected = " Nothing of it was unexpected." if unjudged(content) else " All of this was expected."
    text = f"Of {counted(len(rows), 'engine settings')}, {standings(rows, alone)}.{expected if content.claims else ''}"
    return f"{ALONE[0].upper()}{ALONE[1:]}. {text}" if alone else text


def standings(rows: Sequence[ReportedRow], alone: bool) -> str:
    """Clause that counts the rows by verdict; ``alone``: only laws of mechanics are judged."""
    words = {
        "agrees": ("agrees", "agree", "with the truth in every observable and every case"),
        "unconfirmed": ("agrees", "agree", "at this step with a limit that is not confirmed"),
        "incomplete": ("agrees", "agree", "without reporting all that is judged"),
        "converges": ("needs", "need", "a finer step"),
        "ill-posed": ("is", "are", "not judged at some points: the question is ill-posed there"),
        "another-scene": ("is", "are", "a different model than the scene's, so not judged"),
        "not-judged": ("is", "are", "not judged: there is no truth, or it is not exact enough for the tolerance"),
        "refused": ("refuses", "refuse", "the scene, or some case of it, with the reason"),
        "differs": ("differs", "differ", "at some points, with no limit of small steps shown to be the truth"),
        "failed": ("gives", "give", "no result at some points"),
    }
    if alone:
        words["agrees"] = ("keeps", "keep", "the laws that are judged in every case")
        words["differs"] = ("breaks", "break", "a law at some points, with no limit of small steps shown to keep it")
    parts = []
    for verdict, (singular, many, rest) in words.items():
        count = sum(row.verdict == verdict for row in rows)
        if count:
            parts.append(f"{count} {singular if count == 1 else many} {rest}")
    return _joined(parts)


def _joined(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1]


def _order(content: ReportedComparison) -> list[str]:
    """Sentence on rows whose events differ from the truth's in kind or order; empty where no order was judged."""
    judged = [
        (run, judgement)
        for run in content.runs
        for judgement in run.judgements
        if judgement.observable.partition(".")[0] == EVENT_ORDER and judgement.verdict != "ill-posed"
    ]
    if not judged:
        return []
    wrong: dict[int, int] = {}
    for run, judgement in judged:
        if judgement.verdict not in {"agrees", "unconfirmed"}:
            wrong[run.row] = wrong.get(run.row, 0) + 1
    if not wrong:
        return ["Every setting has the truth's events in the truth's order, at all well-posed points."]
    shown = names(content.rows)
    cases = {row: sum(run.row == row for run, _ in judged) for row in wrong}
    rows = _joined([f"{shown[row]} ({count} of {cases[row]} cases)" for row, count in wrong.items()])
    return [f"Events missing, added or of another kind than the truth's: {rows}."]


def _surprises(content: ReportedComparison) -> str:
    """Sentence on results that contradict the comparison's expectations, or on their absence."""
    contradictions = content.contradictions
    if contradictions:
        more = f" (and {len(contradictions) - 1} more, listed below)" if len(contradictions) > 1 else ""
        return f"Not expected: {contradictions[0]}{more}."
    unlike = [row for row in content.rows if row.verdict != "agrees"]
    if not content.claims:
        return "No file states expectations here, so nothing can contradict them."
    if not unlike:
        nothing = "no law is broken" if content.laws_alone else "nothing disagrees with the truth"
        return f"Nothing contradicts the comparison's expectations, and {nothing}."
    agree = "show that they keep the laws" if content.laws_alone else "agree"
    return (
        f"Nothing contradicts the comparison's expectations; {len(unlike)} of {counted(len(content.rows), 'settings')} "
        f"do not {agree}, each for the reason in its row."
    )
