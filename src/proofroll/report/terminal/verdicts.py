"""A comparison on the terminal: the answer, a line for each setting, and a short closing, within 80 columns."""

import math
import textwrap
from collections.abc import Iterator, Sequence

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import be, counted, error, number, spaced
from proofroll.core.verdict import SEVERITY, LimitResult, Verdict
from proofroll.report.answer.sentences import measure
from proofroll.report.comparison.closing import closing_notes
from proofroll.report.comparison.distances import Distances, distance_cells
from proofroll.report.comparison.records import (
    CoarserSteps,
    ReportedComparison,
    ReportedRow,
    ReportedRun,
    WorstJudgement,
)
from proofroll.report.comparison.spread import ALONE, Spread
from proofroll.report.labels import SYMBOLS, engine_title, omitted_lines, row_words, speed, symbol, unit, unjudged
from proofroll.report.terminal.screen import WIDTH, numeric, plain_table, unbroken
from proofroll.running.case import Status, host_sentences

_SETTING, _ERROR, _SPEED = 42, 27, 9  # characters of the columns behind the sign
_INDENT = 4
_WIDEST = 8  # largest number of spreads that are listed
_COMPILES = 10.0  # s before the first step, beyond which the time is told; to compile equations takes one or two
_HOLDS = (Verdict.AGREES, Verdict.UNCONFIRMED, Verdict.INCOMPLETE)
STYLES = {
    "agrees": "green", "unconfirmed": "yellow", "incomplete": "yellow", "converges": "yellow", "ill-posed": "cyan",
    "not-judged": "cyan", "another-scene": "cyan", "refused": "magenta", "differs": "red", "failed": "bold red",
}  # fmt: skip
# Verdict -> words of the closing count for one setting and for several.
_COUNTS = {
    Verdict.AGREES: ("agrees", "agree"),
    Verdict.UNCONFIRMED: ("agrees without a confirmed limit", "agree without a confirmed limit"),
    Verdict.INCOMPLETE: ("agrees in what it reports", "agree in what they report"),
    Verdict.CONVERGES: ("needs finer steps", "need finer steps"),
    Verdict.DIFFERS: ("differs", "differ"),
    Verdict.FAILED: ("fails", "fail"),
    Verdict.REFUSED: ("is refused", "are refused"),
    Verdict.ANOTHER_SCENE: ("is another model", "are other models"),
    Verdict.ILL_POSED: ("is ill-posed", "are ill-posed"),
    Verdict.NOT_JUDGED: ("is not judged", "are not judged"),
}
_LIMITS = {
    LimitResult.NO_LADDER: "one step only, so its limit is unknown",
    LimitResult.NOT_SHOWN: "smaller steps do not settle",
}


def verdict_parts(
    content: ReportedComparison, *, orders: bool = False, witnesses: bool = False
) -> Iterator[Table | Text | str]:
    """Parts of a comparison's text: the answer, its settings, spreads, closing sentences; or why no run was made.

    Args:
        content: of the comparison.
        orders: True to list all judged quantities with their orders and limits, equations and contact laws.
        witnesses: True to list the engines that cross-check the truth, too.
    """
    if content.unreached and content.budget is None:
        yield from (content.title, content.unreached, *omitted_lines(content.omitted))
        return
    rows = [(row, runs) for _, row, runs in content.lines()]
    engines = [pair for pair in rows if not pair[0].witness] or rows
    yield from answer_lines(content, [row for row, _ in engines])
    yield from omitted_lines(content.omitted)
    yield from [f"{content.step_bound}."] if content.step_bound else []
    listed = engines + [pair for pair in rows if witnesses and pair not in engines]
    yield from _presets_lines({row.preset for row, _ in listed})
    yield ""
    yield f"  {'setting':{_SETTING}}{'worst error of allowed':{_ERROR}}{'real time':>{_SPEED}}"
    ranks = {id(row): (row.witness, SEVERITY.index(verdict_of(row)), _cost(row) or math.inf) for row, _ in listed}
    for row, runs in sorted(listed, key=lambda pair: ranks[id(pair[0])]):
        yield from row_lines(row, runs, [item for item, _ in listed], orders=orders)
    for item in content.spread:
        yield from ("", *spread_parts(item))
    for distances in content.distances:
        yield from ("", *distance_parts(distances, content))
    yield ""
    yield from closing_lines(content, [row for row, _ in engines], orders=orders)


def _presets_lines(presets: set[str | None]) -> Iterator[str]:
    """Line on the words for settings in the rows, in those of an answer; none without presets."""
    clauses = ["as installed: the engine's own options"] if "default" in presets else []
    if documented := " and ".join(name for name in ("matched", "tuned") if name in presets):
        clauses.append(f"{documented}: documented options; an answer's best: the cheaper of matched, tuned")
    yield from [f"{'; '.join(clauses)}."] if clauses else []


def verdict_of(row: ReportedRow) -> Verdict:
    """Verdict of a row; not judged if it would rest on steps that were not run, for they could show its limit."""
    worst = worst_of(row)
    left_out = worst is not None and Status.LEFT_OUT in worst.reason
    return Verdict.NOT_JUDGED if left_out and row.verdict is Verdict.DIFFERS else row.verdict


def _cost(row: ReportedRow) -> float | None:
    """Wall seconds per simulated second, of clean runs if there are any."""
    return row.rough_cost if row.seconds_per_second is None else row.seconds_per_second


def _speed(row: ReportedRow) -> str:
    """Speed of a row that holds its tolerances; a dash for others."""
    cost = _cost(row)
    if row.verdict not in _HOLDS or not cost:
        return "–"
    is_open = row.resolution is not None and row.coarser is not CoarserSteps.FAILED
    return speed(cost, row.seconds_per_second is not None, at_least=is_open)


def worst_of(row: ReportedRow) -> WorstJudgement | None:
    """Judgement of the row's worst quantity; None where none was judged."""
    return row.observables.get(row.worst)


def answer_lines(content: ReportedComparison, rows: Sequence[ReportedRow]) -> list[str]:
    """Answer in at most three sentences: what is wrong, how many agree, and what was not expected."""
    wrong = sorted((row for row in rows if verdict_of(row) is Verdict.DIFFERS), key=lambda row: -_ratio(row))
    agree = [row for row in rows if row.verdict is Verdict.AGREES]
    lines = []
    if wrong:
        title, off = ", ".join(row_words(wrong[0])), _off(wrong[0])
        several = f"{len(wrong)} settings are wrong; the worst, {title}: {off}."
        at_this_step = " at this step" if _is_open(wrong[0]) else ""
        lines.append(several if len(wrong) > 1 else f"{title}, is wrong{at_this_step}: {off}.")
    nearest = min((row for row in rows if row.observables), key=_ratio, default=None)
    if agree:
        some = "The engine setting agrees" if len(rows) == 1 else f"{len(agree)} of {len(rows)} engine settings agree"
        lines.append(f"All {len(rows)} engine settings agree." if len(agree) == len(rows) > 1 else f"{some}.")
    elif nearest is not None:
        lines.append(_nearest(nearest))
    else:
        lines.append(f"No setting of {content.name} could be judged.")
    if content.contradictions:
        more = f" (1 of {len(content.contradictions)})" if len(content.contradictions) > 1 else ""
        lines.append(f"Not as the file expects{more}: {content.contradictions[0].rstrip('.')}.")
    return lines


def _ratio(row: ReportedRow) -> float:
    worst = worst_of(row)
    return 0.0 if worst is None else worst.of_allowed


def _off(row: ReportedRow) -> str:
    """Clause on the worst quantity of a row: ``gap is off by 0.35 mm, at every step``."""
    worst = worst_of(row)
    if worst is None:
        return row.reason
    if not math.isfinite(worst.error):
        return f"{symbol(worst.observable)}: {worst.reason.partition(';')[0]}"
    at_every_step = ", at every step" if worst.limit is LimitResult.ANOTHER else ""
    return f"{symbol(worst.observable)} {be(worst.observable)} off by {measure(worst.error, worst.unit)}{at_every_step}"


def _nearest(row: ReportedRow) -> str:
    """Sentence on the setting closest to agreement, with the step that would suffice by its order."""
    worst = worst_of(row)
    assert worst is not None  # it was chosen by its judgement
    text = f"No setting agrees. Nearest: {', '.join(row_words(row))}"
    if row.verdict in {*_HOLDS, Verdict.NOT_JUDGED}:
        return f"{text}, {_why(row, []) or row.verdict}."
    text += f": {symbol(worst.observable)}, {error(worst.of_allowed)} times what is allowed"
    if row.verdict is not Verdict.CONVERGES or row.resolution != "dt" or not worst.order or worst.order < 0:
        return f"{text}."
    halvings = math.ceil(math.log2(worst.of_allowed) / worst.order)
    return f"{text}; the next step to try is dt {number((row.resolution_value or 0.0) / 2**halvings, 3)} s."


def row_lines(
    row: ReportedRow, runs: Sequence[ReportedRun], rows: Sequence[ReportedRow], *, orders: bool = False
) -> Iterator[Text | str]:
    """A row in one line, below it the reason of its verdict; ``orders``: and a line for each quantity."""
    worst, left_out = worst_of(row), row.reason.startswith(Status.LEFT_OUT)
    away = row.verdict is Verdict.FAILED and all(run.status == Status.MISSING for run in runs)
    sign = "·" if left_out or away else SYMBOLS[verdict_of(row)]
    if worst is not None and math.isfinite(worst.error):
        excess = f"{symbol(worst.observable)} {number(worst.error)} of {number(worst.tolerance)}{spaced(worst.unit)}"
    else:
        excess = "not run" if left_out else "missing" if away else str(row.verdict)
    room = _SETTING + _ERROR - max(_ERROR, len(excess) + 1)
    title = _cut(row, rows, room - 1)
    numbers = f"{excess:{_SETTING + _ERROR - room}}{_speed(row):>{_SPEED}}"
    line = Text(f"{sign} {title:{room}}{numbers}" if len(title) < room else f"{sign} {title}")
    line.stylize(STYLES[row.verdict], 0, 1)
    yield line
    if len(title) >= room:
        yield f"  {'':{room}}{numbers}"
    notes = [_why(row, runs), *(f"{told.sentence}: {told.cause.remedy}" for told in row.diagnosis)]
    if not row.as_expected:
        expected = " or ".join(row.claim.expect)
        notes.insert(0, f"!! expected: {expected}{f' ({row.claim.because})' if row.claim.because else ''}")
    if orders:
        notes += [_judged(item) for item in row.observables.values()]
        notes += [remark for remark in row.remarks if remark != row.shared]
    build = max((run.build_seconds or 0.0 for run in runs), default=0.0)
    notes += [f"{number(build)} s before its first step"] if build > _COMPILES else []
    for note in filter(None, notes):
        yield indented(note)


def indented(note: str) -> str:
    """A note below a row, wrapped."""
    lines = textwrap.wrap(note, WIDTH - _INDENT, break_long_words=False, break_on_hyphens=False)
    return textwrap.indent("\n".join(lines), " " * _INDENT)


def _cut(row: ReportedRow, rows: Sequence[ReportedRow], room: int) -> str:
    """Name of a row; where it is too long without its step, or its preset, unless others then have the same name."""
    words = [row_words(item) for item in rows]
    mine = row_words(row)
    for count in range(len(mine), 0, -1):
        text = ", ".join(mine[:count])
        if len(text) <= room and sum(item[:count] == mine[:count] for item in words) == 1:
            return text
    return ", ".join(mine)


def _why(row: ReportedRow, runs: Sequence[ReportedRun]) -> str:
    """Reason of a row in one clause: the share of cases, the words of its file, and its limit of small steps."""
    worst = worst_of(row)
    clauses = [row.claim.short] if row.verdict is not Verdict.AGREES or row.verdict in row.claim.expect else []
    limit = f"order {worst.order:.3g}, " if worst is not None and worst.order is not None else ""
    match row.verdict:
        case Verdict.CONVERGES:
            clauses.append(f"{limit}its limit is right")
        case Verdict.DIFFERS if verdict_of(row) is Verdict.NOT_JUDGED:
            clauses = ["its other steps were not run"]
        case Verdict.DIFFERS if worst is not None:
            text = _LIMITS.get(worst.limit) or f"{limit}smaller steps stay {_limit_off(worst)} off"
            text = f"{limit}its limit needs smaller steps" if limit and _is_open(row) else text
            clauses.append(text if math.isfinite(worst.error) else worst.reason.partition(";")[0])
        case Verdict.UNCONFIRMED:
            clauses.append("smaller steps do not confirm it")
        case Verdict.INCOMPLETE:
            clauses.append(f"does not report {', '.join(symbol(name) for name in row.missing)}")
        case Verdict.AGREES:
            clauses += [_limit_note(row)]
        case _ if not row.reason.startswith(Status.LEFT_OUT):
            clauses.append(row.reason)
    cases = sum(row.verdicts.values())
    place = worst.point if worst is not None else ""
    if runs and row.verdict in {Verdict.CONVERGES, Verdict.DIFFERS} and row.verdicts[row.verdict] < cases:
        clauses.insert(0, f"at {row.verdicts[row.verdict]} of {cases} cases, as {place}")
    return "; ".join(filter(None, clauses))


def _limit_note(row: ReportedRow) -> str:
    """Clause on the quantity of an agreeing row whose limit of small steps is furthest off; empty without one."""
    shown = [item for item in row.observables.values() if item.remarks]
    if not shown:
        return ""
    item = max(shown, key=lambda item: (item.limit_error or 0.0) / item.tolerance)
    more = f" ({len(shown) - 1} more: --orders)" if len(shown) > 1 else ""
    return f"{symbol(item.observable)} agrees at this step only, its limit is {_limit_off(item)} off{more}"


def _is_open(row: ReportedRow) -> bool:
    """True if the limit of small steps is known too badly to exclude the truth."""
    worst = worst_of(row)
    if worst is None or worst.limit is not LimitResult.NOT_SHOWN:
        return False
    return worst.limit_error is not None and worst.limit_error <= worst.tolerance + (worst.limit_doubt or 0.0)


def _limit_off(item: WorstJudgement) -> str:
    return "another number" if item.limit_error is None else measure(item.limit_error, item.unit)


def _judged(item: WorstJudgement) -> str:
    """A quantity of a row with its error, what is allowed, its order and its limit."""
    of = unit(item.unit)
    text = f"{symbol(item.observable)} {error(item.error)} of {number(item.tolerance)} {of}".rstrip()
    text += f" at {item.point}" if item.point and item.verdict is not Verdict.AGREES else ""
    if item.order is not None:
        text += f", order {item.order:.3g}"
    if item.limit_error is not None:
        text += f", limit off by {error(item.limit_error)} ± {error(item.limit_error_bar, 1)} {of}".rstrip()
    return text


def spread_parts(spread: Spread) -> Iterator[Table | str]:
    """Table of the spread of final values at a point without a unique truth, the widest first."""
    place = f" at {spread.point}" if spread.point else ""
    yield f"{ALONE[0].upper()}{ALONE[1:]}{place}: {spread.because}."
    if spread.lines:
        table = plain_table(Column("spread of the settings"), *numeric("lowest", "highest"), *unbroken("unit"))
        for line in sorted(spread.lines, key=lambda line: -line.part)[:_WIDEST]:
            table.add_row(line.name, number(line.low, 4), number(line.high, 4), unit(line.unit))
        yield table
    if len(spread.lines) > _WIDEST:
        yield f"Narrower spreads, in the report and its JSON: {len(spread.lines) - _WIDEST}."


def distance_parts(distances: Distances, content: ReportedComparison) -> Iterator[Table | str]:
    """Table of the distances from a reference by steps."""
    place = f" at {distances.point}" if distances.point else ""
    yield f"Largest distance from the reference{place}, of any body [mm] and its attitude [rad]:"
    table = plain_table(Column("up to"), *numeric(*(f"{time:.3g} s" for time in distances.times), "s/s"))
    for cells in distance_cells(distances, content.rows, content.runs):
        table.add_row(*cells)
    yield table


def closing_lines(content: ReportedComparison, engines: Sequence[ReportedRow], *, orders: bool = False) -> list[str]:
    """Closing lines: counts, whether the file expects them, what was not run or judged, and caveats."""
    others = [row for row in content.rows if row not in engines]
    counts = f"{_counts(engines, of=True)}{f'; {_counts(others, noun=True)}' if others else ''}."
    counts += f" {_expected(content)}" if content.claims and not content.contradictions else ""
    lines = [counts, *content.truth_ends, *(line for line in content.contradictions[1:5])]
    if content.unjudged:
        told = ", ".join(content.unjudged)
        lines.append(f"Not judged: {told} (a comparison file judges them: proofroll new comparison).")
    unfit = "; ".join(f"{engine_title(name)} ({why})" for name, why in content.unfit.items())
    lines += [f"Not in the table: {unfit}."] if unfit else []
    notes = [note for note in closing_notes(content) if orders or note.startswith(("Same", "Caveats"))]
    return [*lines, *budget_lines(content), *notes, *host_sentences(content.hosts)]


def _counts(rows: Sequence[ReportedRow], *, of: bool = False, noun: bool = False) -> str:
    """Counts of rows by verdict: ``7 of 9 agree, 1 differs``; ``noun``: of witnesses."""
    parts: list[str] = []
    for verdict, (singular, plural) in _COUNTS.items():
        if count := sum(verdict_of(row) is verdict for row in rows):
            share = f" of {counted(len(rows), 'settings')}" if of and not parts and len(rows) > 1 else ""
            what = f" witness{'es' if count > 1 else ''}" if noun and not parts else ""
            parts.append(f"{count}{share}{what} {singular if count == 1 else plural}")
    return ", ".join(parts)


def _expected(content: ReportedComparison) -> str:
    """Sentence on a comparison file that no result contradicts."""
    left = unjudged(content)
    if left:
        return f"Nothing contradicts the file; {left} of its runs could not be judged."
    return "As the file expects."


def budget_lines(content: ReportedComparison) -> list[str]:
    """Lines on cases left out for lack of processor time, and the command that runs them."""
    left = content.beyond_budget
    if not left:
        return []
    more = f" and {len(left) - 1} more" if len(left) > 1 else ""
    if content.budget is None:
        return [f"Not run, for lack of processor time: {left[0]}{more}."]
    again = "" if left[0].startswith("the truth") else "The same command continues with the rest; "
    used = f"Not run (budget of {content.budget:g} s used up): {left[0]}{more}."
    return [f"{used} {again}--budget {10 * content.budget:g} gives it more time."]
