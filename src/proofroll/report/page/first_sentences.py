"""Three sentences on the whole report, from its data: agreement, silent disagreement, and advice."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from proofroll.core.number_format import counted
from proofroll.core.verdict import Judgement
from proofroll.report.comparison.conclusions import standings
from proofroll.report.comparison.records import ReportedComparison, ReportedRun
from proofroll.report.comparison.spread import ALONE
from proofroll.report.labels import off_by, scene_words, with_caveat
from proofroll.report.page.first_screen import ReportedAnswer, answers_sentence
from proofroll.report.parts import PartEntry, part_kinds


@dataclass(frozen=True)
class Kept:
    """Sentences on the settings that agree, and on those that are wrong without a warning.

    Attributes:
        verdicts: number of settings by verdict, of all comparisons.
        silent: number of settings that are wrong though every run ended as done.
        worst: the one furthest off, and by how much; empty without any.
        passed, boundaries: limits of stability or accuracy that are passed without a warning, of how many.
        statements: count of the statements of each reproduced article that hold, and its section.
    """

    verdicts: dict[str, int]
    silent: int
    worst: str
    passed: int
    boundaries: int
    statements: list[tuple[str, str]]


def kept(comparisons: Sequence[ReportedComparison], entries: Mapping[str, Sequence[PartEntry]]) -> Kept:
    """Counts over the comparisons and the maps of stability in ``entries``."""
    counts = Counter(str(row.verdict) for comparison in comparisons for row in comparison.rows)
    wrong = [item for comparison in comparisons for item in _wrong(comparison)]
    _, name, text = max(wrong, default=(0.0, "", ""))
    maps = [entry.study for entry in entries.get("stability", ()) if entry.study is not None]
    return Kept(
        verdicts=dict(counts),
        silent=len(wrong),
        worst=f"{name}, {text}" if wrong else "",
        passed=sum(study.silent for study in maps),
        boundaries=sum(study.boundaries for study in maps),
        statements=[
            (kind.line(entry), entry.section)
            for kind in part_kinds()
            if kind.key == "figures"
            for entry in entries.get(kind.key, ())
            if entry.study is not None
        ],
    )


def three_sentences(
    comparisons: Sequence[ReportedComparison],
    entries: Mapping[str, Sequence[PartEntry]],
    answers: Sequence[ReportedAnswer],
) -> list[str]:
    """Three sentences: agreement, silent disagreement (also of the maps in ``entries``), and advice."""
    return [_agrees(comparisons), _silent(comparisons, kept(comparisons, entries)), answers_sentence(answers)]


def _agrees(comparisons: Sequence[ReportedComparison]) -> str:
    if not comparisons:
        return "Nothing was compared with the truth in this report."
    clauses = []
    for alone in (False, True):
        alike = [item for item in comparisons if item.laws_alone is alone]
        rows = [row for item in alike for row in item.rows]
        count = "one comparison" if len(alike) == 1 else f"{len(alike)} comparisons"
        place = f"{ALONE} ({', '.join(item.name for item in alike)})" if alone else f"in {count}"
        if alike:
            clauses.append(f"of {counted(len(rows), 'settings')} {place}, {standings(rows, alone)}")
    text = "; ".join(clauses)
    return f"{text[0].upper()}{text[1:]}."


def _silent(comparisons: Sequence[ReportedComparison], counts: Kept) -> str:
    """Sentence on settings that are silently wrong, and on boundaries of stability passed silently."""
    passed = f"{counts.passed} of {counts.boundaries} boundaries of stability and accuracy are passed without a warning"
    passed = passed if counts.boundaries else ""
    alone = [comparison.laws_alone for comparison in comparisons]
    laws, truth = "a law of mechanics" if any(alone) else "", "from the truth" if not all(alone) or not alone else ""
    differ, breaks, run = ("differs", "breaks", "runs") if counts.silent < 2 else ("differ", "break", "run")
    off = " or ".join(filter(None, (truth and f"{differ} {truth}", laws and f"{breaks} {laws}")))
    if counts.silent:
        many = counted(counts.silent, "settings")
        text = f"{many} {off} and {run} to the end without a warning, worst {counts.worst}"
    elif not comparisons:
        text = "" if passed else "No run could be silently wrong: nothing was compared"
    elif any(run.status == "done" for item in comparisons for run in item.runs):
        text = f"No setting that ran to its end {off}"
    else:
        text = "No run has ended that could be silently wrong"
    return f"{'; '.join(filter(None, (text, passed)))}."


def _wrong(comparison: ReportedComparison) -> list[tuple[float, str, str]]:
    """Rows that differ though all their runs ended as done: relative error, name, and text of the error."""
    wrong = []
    for name, row, runs in comparison.lines():
        if row.verdict != "differs" or any(run.status != "done" for run in runs):
            continue
        worst = furthest_off(comparison, runs)
        relative = 0.0 if worst is None else worst.error / worst.scale
        text = "a reaction or an event is wrong" if worst is None else off_by(worst)
        text = row.reason if comparison.laws_alone else text
        text = f"{text} in {scene_words(comparison.scene).lower()}"
        wrong.append((relative, with_caveat(name, row.caveat), text))
    return wrong


def furthest_off(content: ReportedComparison, runs: Sequence[ReportedRun]) -> Judgement | None:
    """Judgement of the coordinate with the largest finite relative error, ill-posed ones left out."""
    motion = content.headlines("motion")
    judged = (judgement for run in runs for judgement in run.judgements if judgement.observable in motion)
    finite = [item for item in judged if item.verdict != "ill-posed" and math.isfinite(item.error)]
    return max(finite, key=lambda item: item.error / item.scale, default=None)
