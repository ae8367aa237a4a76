"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from proofroll.core.number_format import number
from proofroll.core.verdict import Verdict
from proofroll.report.answer.sentences import reason, setting_words, speed, tolerance_words
from proofroll.report.comparison.closing import closing_notes
from proofroll.report.comparison.records import ReportedComparison
from proofroll.report.comparison.tables import observables
from proofroll.report.labels import SYMBOLS, engine_title, engine_words, step, verdict_text
from proofroll.studies.answer.records import EngineAnswer, SceneAnswer
from proofroll.studies.answer.setting_search import State

# What a sign of the matrix means.
CHOICE_MEANINGS = {
    "agrees": "held",
    "unconfirmed": "held at one step, its limit not confirmed",
    "incomplete": "motion not told whole",
    "converges": "finer steps come closer",
    "differs": "another limit or none",
    "ill-posed": "ill-posed",
    "another-scene": "of another scene",
    "not-judged": "not judged",
    "refused": "refused",
    "failed": "no result",
}


def choice_table(groups: Mapping[str, Mapping[str, Sequence[str]]]) -> str:
    """One line per formulation, one column per group of scenes, from the standing in each of its scenes.

    All scenes held: the sign alone; some: how many of how many that are judged; none: the sign of the best standing.
    The style sheet knows the table by its container, and makes it as narrow as a phone.
    """
    order = [str(item) for item in Verdict]
    rows = dict.fromkeys(name for rows in groups.values() for name in rows)
    lines = ["| engine | " + " | ".join(groups) + " |", "|---" * (len(groups) + 1) + "|"]
    for name in rows:
        cells = []
        for group in groups.values():
            states = group.get(name, [])
            states = [state for state in states if state != Verdict.NOT_JUDGED] or states
            held = sum(state == Verdict.AGREES for state in states)
            sign = SYMBOLS[min(states, key=order.index)] if states else ""
            cells.append(f"{sign} {held}/{len(states)}" if 0 < held < len(states) else sign)
        engine, _, formulation = name.partition(" ")
        shown_name = engine_words(engine, formulation).replace("_", "_<wbr>")
        lines.append(f"| {shown_name} | " + " | ".join(cells) + " |")
    scenes = max((len(states) for rows in groups.values() for states in rows.values()), default=0)
    held_in = " (4/7: in 4 of 7 scenes)" if scenes > 1 else ""
    shown = [word for word in CHOICE_MEANINGS if any(SYMBOLS[word] in line for line in lines)]
    said = ", ".join(f"{SYMBOLS[word]} {CHOICE_MEANINGS[word]}{held_in if word == 'agrees' else ''}" for word in shown)
    table = "\n".join(["```{container} matrix", *lines, "```"])
    return f"{table}\n\nMotion to 1e-4 of the path with some setting and step that was run: {said}; empty: not run.\n"


def columns(content: ReportedComparison) -> list[tuple[str, str]]:
    """(name, unit) of the observables of the table: headline motions, and the first headline reaction."""
    units = observables(content)
    shown = [name for name in content.headlines("motion") if name in units]
    shown += [name for name in content.headlines("reaction") if name in units][:1]
    return [(name, units[name]) for name in shown]


def verdict_table(content: ReportedComparison) -> str:
    """One line per engine with settings: the worst verdict and the largest errors over all points of the parameters."""
    names = columns(content)
    head = ["engine", "formulation", "setting", "step", "verdict", *(f"{n} [{unit}]" for n, unit in names), "s/s"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in content.rows:
        errors = [row.observables[name].largest if name in row.observables else None for name, _ in names]
        cells = [engine_title(row.name), row.formulation or "", row.setting, step(row.resolution, row.resolution_value)]
        cells.append(f"{SYMBOLS[row.verdict]} {verdict_text(row)}")
        cells += [number(error) for error in errors]
        cells.append(number(row.seconds_per_second))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def caveat_list(content: ReportedComparison) -> str:
    """Notes on all settings of a comparison, a line each."""
    return "".join(f"- {line}\n" for line in closing_notes(content))


def remarks(content: ReportedComparison) -> list[tuple[str, str]]:
    """(row, remark) for each remark but the one on equations of the truth, which is a closing note."""
    return [(name, text) for name, row, _ in content.lines() for text in row.remarks if text != row.shared]


def remark_list(content: ReportedComparison) -> str:
    """What is remarked of settings with a star, a line each."""
    return "".join(f"- {name}: {text}\n" for name, text in remarks(content))


def cheapest_table(answers: Sequence[SceneAnswer]) -> str:
    """One line per tolerance: what each engine needs to hold it, and how fast that is."""
    names = sorted({item.engine for made in answers for item in made.engines})
    lines = ["| to | " + " | ".join(map(engine_title, names)) + " |", "|---" * (1 + len(names)) + "|"]
    for made in answers:
        of_engine = {item.engine: item for item in made.engines}
        cells = [tolerance_words(made), *(_cell(of_engine[name]) if name in of_engine else "" for name in names)]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(item: EngineAnswer) -> str:
    """Setting, step and speed of an engine that holds a tolerance, or why none is shown to."""
    if not item.holds:
        return reason(item)
    name = setting_words(item).removeprefix(f"{engine_title(item.engine)} ")
    return f"{name}: {speed(item.seconds_per_second)}{' (not confirmed)' if item.state is State.UNCONFIRMED else ''}"
