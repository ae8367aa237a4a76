"""Result of a check as text for the terminal, within 80 columns."""

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import counted, error
from proofroll.report.labels import SYMBOLS, engine_title
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll.robots.check.layers import SHORT
from proofroll.robots.check.records import AgainstCheck, HeldLayer, ImporterRow, RobotCheck
from proofroll.robots.files.robot_file import LintRemark

WIDTH = 80
_MARKS = {"holds": "✓", "explained": "✗", "differs": "✗", "refused": SYMBOLS["refused"], "missing": " ", "fed": "◐"}
_COLOURS = {"holds": "green", "explained": "yellow", "differs": "red", "refused": "magenta"}


def check_parts(content: RobotCheck) -> Iterator[Table | str]:
    """Text of a check: the file, each engine's reading, and the causes."""
    yield from lines(content)
    yield table(content)
    yield from verdict_lines(content)
    if isinstance(content, AgainstCheck):
        yield from against_lines(content)


def table(content: RobotCheck) -> Table:
    """One line per engine: the difference at each layer that does not hold."""
    layers = numeric(*(SHORT[layer] for layer in content.layers))
    head = "file" if isinstance(content, AgainstCheck) else "engine"
    rows = plain_table(Column(head, no_wrap=True, max_width=20), *unbroken(""), *layers)
    for row in content.engines:
        style = _COLOURS.get(row.status, "bold red")
        # The path of an interpreter would fill the column; the version identifies the engine.
        name = engine_title(row.engine.partition("@")[0] if "/" in row.engine else row.engine)
        label = Text(one_line(f"{name} {row.version or ''}"), overflow="ellipsis")
        cells = (_cell(row.layers.get(layer)) for layer in content.layers)
        mark = _MARKS["fed"] if row.fed and row.status == "explained" else _MARKS.get(row.status, "!")
        rows.add_row(label, Text(mark, style=style), *cells)
    return rows


def _cell(layer: HeldLayer | None) -> Text:
    if layer is None:
        return Text("–", style="dim")
    return Text("✓", style="green") if layer.holds else Text(amount(layer.difference, 1), style="red")


def amount(value: float | None, digits: int = 2) -> str:
    """A difference as text; a whole number below 100 is a count, and is not rounded."""
    return f"{value:.0f}" if value in range(100) else error(value, digits)


def lines(content: RobotCheck) -> Iterator[str]:
    """Lines on the file, its truth, and its errors and warnings, of at most 80 characters."""
    truth = content.truth
    base = f", {content.base} base" if content.kind == "urdf" else ""
    moves, states = counted(truth.velocities, "velocities"), counted(truth.states, "states")
    yield from wrapped(f"{content.file}: {content.kind.upper()}{base}, {moves}, {states}")
    yield from wrapped(f"true is {truth.by}; its two formulations differ by {amount(truth.difference)}")
    yield from remark_lines([remark for remark in content.lint if remark.level != "note"])


def remark_lines(remarks: Sequence[LintRemark]) -> Iterator[str]:
    """Lines of remarks; equal ones at several places are one line with their number."""
    places: dict[tuple[str, str], list[str]] = {}
    for remark in remarks:
        places.setdefault((remark.level, remark.what), []).append(remark.where)
    for (level, what), found in places.items():
        spots = [
            where if found.count(where) == 1 else f"{found.count(where)} × {where}" for where in dict.fromkeys(found)
        ]
        more = f" and {len(spots) - 2} more" if len(spots) > 3 else ""
        yield from wrapped(f"{level}: {', '.join(spots[: 2 if more else 3])}{more}: {what}")


def verdict_lines(content: RobotCheck) -> Iterator[str]:
    """Lines on readings of the unchanged file, on each engine's reading with causes, and notes on the file."""
    written: dict[str, list[str]] = {}
    for row in content.engines:
        if row.as_written:
            written.setdefault(row.as_written, []).append(engine_title(row.engine))
    if written:
        readings = "; ".join(f"{', '.join(names)}: {words}" for words, names in written.items())
        yield from wrapped(f"The file as it is: {readings}.")
    for row in content.engines:
        for sentence in sentences(row):
            yield from wrapped(sentence)
    yield from remark_lines([remark for remark in content.lint if remark.level == "note"])


def against_lines(content: AgainstCheck) -> Iterator[str]:
    """Lines on partners of joints, joints that only one file has, and values that differ."""
    name_1, name_2 = (Path(name).name for name in (content.file, content.against))
    if name_1 == name_2:
        name_1, name_2 = content.file, content.against
    yield from wrapped(f"what {name_2} says is {content.against_by}")
    partners = [f"{ours} is {theirs}" for ours, theirs in content.matched.items() if ours != theirs]
    if partners:
        yield from wrapped(f"joints with another name there: {', '.join(partners)}")
    for name, alone in ((name_1, content.absent), (name_2, content.added)):
        if alone:
            yield from wrapped(f"only in {name}: {', '.join(alone)}")
    if content.proposed:
        pairs = ", ".join(f"{ours} is {theirs}" for ours, theirs in content.proposed_partners.items())
        yield from wrapped(f"kinds and tree fit, names differ: try --map '{content.proposed}' ({pairs})")
    elif content.absent and content.added:
        yield "joints of the same kind are matched by --map NAME=NAME"
    for value in content.values:
        pair = (
            f"{_value(value_there)} in {name}" for value_there, name in ((value.here, name_1), (value.there, name_2))
        )
        yield from wrapped(f"joint {value.joint}: {value.quantity} {', '.join(pair)}")
    if content.rounded:
        yield from wrapped(rounded_line(content))


def rounded_line(content: AgainstCheck) -> str:
    """Sentence on the values that differ by the rounding of their last written digit."""
    item = content.rounded[0]
    example = f"{item.joint} {item.quantity} {item.here!r} and {item.there!r}"
    return f"{counted(len(content.rounded), 'values')} differ by the last written digit alone: {example}"


def _value(value: float | str | None) -> str:
    return f"{value:.9g}" if isinstance(value, float) else value or "none"


def sentences(row: ImporterRow) -> Iterator[str]:
    """Sentences on one engine's reading: remarks, refusal, causes, place of the largest difference."""
    name = row.named
    if row.says and row.layers:
        yield f"{name}: {row.says}"
    yield from (f"{name}: {remark}." for remark in row.remarks)
    if row.message:
        yield f"{name} {_VERBS.get(row.status, row.status)}: {row.message}"
    for cause in row.causes:
        advice = f" Do: {cause.remedy}." if cause.remedy and not row.fed else ""
        yield (
            f"{name}{', as we feed it,' if row.fed else ''} differs in {cause.layer} by {amount(cause.before)}; "
            f"explained by: {cause.name}; with that hypothesis {amount(cause.after)}.{advice}"
        )
    if row.where:
        yield f"{name}: most at {row.where}."
    if row.accepted and row.causes:
        yield f"{name}: that is accepted."
    if row.unexplained:
        off = amount(row.layers[row.unexplained].difference)
        yield f"{name} differs in {row.unexplained} by {off}; no known cause explains it."


_VERBS = {"refused": "refuses the file", "missing": "is left out", "timeout": "took too long"}


def wrapped(text: str) -> list[str]:
    """Lines of a sentence, at most 80 characters wide; all but the first are indented."""
    return textwrap.wrap(one_line(text), WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def one_line(text: str) -> str:
    """Text from a file without control characters."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
