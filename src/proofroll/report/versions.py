"""Comparison of two versions of an engine for readers: a table, sentences, and a page."""

from collections.abc import Iterator

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import counted, number
from proofroll.report.labels import SYMBOLS, engine_title
from proofroll.report.pages import environment, rendered
from proofroll.report.terminal.screen import plain_table, unbroken
from proofroll.running.case import host_sentences
from proofroll.studies.versions.difference import NumberKind
from proofroll.studies.versions.versions import SettingDifference, VersionsStudy

_MOST = 12  # most sentences of a kind on the terminal; the JSON document has all


def heading(content: VersionsStudy) -> str:
    """Subject of the comparison, in one line."""
    old, new = content.old.version, content.new.version
    return f"{engine_title(content.engine)} {old} → {new}: {', '.join(content.comparisons)}"


def answer(content: VersionsStudy) -> str:
    """Summary of the changes, in one sentence."""
    cases = content.cases
    changed = sum(bool(case.changed) for case in cases)
    kinds = [case.numbers.kind for case in cases if case.numbers]
    parts = [f"{count} with {what}" for what, count in (
        ("the same bits", kinds.count(NumberKind.SAME_BITS)),
        ("differences of round-off", kinds.count(NumberKind.ROUND_OFF)),
        ("other numbers", kinds.count(NumberKind.CHANGED)),
        ("no numbers in one or both", len(cases) - len(kinds)),
    ) if count]  # fmt: skip
    verdicts = f"{changed} of {len(cases)} cases have another verdict" if changed else "no verdict changed"
    return f"{counted(len(cases), 'cases')}: {', '.join(parts)}; {verdicts}."


def cells(row: SettingDifference) -> list[str]:
    """Cells of a row: setting, verdicts then and now, largest difference, declared orders, and ratio of times."""
    old_words, new_words = (
        " ".join(f"{SYMBOLS[word]}{row.verdicts[side][word]}" for word in SYMBOLS if word in row.verdicts[side])
        for side in ("old", "new")
    )
    numbers, speed = row.numbers, row.speed
    old, new = (", ".join(map(str, row.declared_order[side])) or "–" for side in ("old", "new"))
    if numbers is None:
        largest = "–"
    else:
        same = numbers.kind == NumberKind.SAME_BITS
        largest = "same" if same else f"{number(numbers.relative)} {numbers.quantity}"
    return [
        short_setting(row.setting),
        old_words if old_words == new_words else f"{old_words} → {new_words}",
        largest,
        old if old == new else f"{old} → {new}",
        "" if speed is None else f"{speed.value:.2f} [{speed.low:.2f}, {speed.high:.2f}]",
    ]


def table(content: VersionsStudy) -> Table:
    """Table with a line for each setting of each comparison."""
    made = plain_table(
        Column("setting", overflow="fold", min_width=16),
        Column("verdicts"),
        Column("numbers", justify="right"),
        *unbroken("declared\norder", *(["time"] if any(row.speed for row in content.rows) else [])),
    )
    last_name = ""
    for row in content.rows:
        if row.comparison != last_name and len(content.comparisons) > 1:
            made.add_row(Text(row.comparison, style="bold"))
        last_name = row.comparison
        style = "red" if row.changed else "yellow" if row.numbers and row.numbers.kind == NumberKind.CHANGED else ""
        made.add_row(*(Text(cell, style=style) for cell in cells(row)[: len(made.columns)]))
    return made


def short_setting(setting: str) -> str:
    """Short text of a setting: formulation and preset without their keys."""
    parts = (part.split("=", 1) for part in setting.split(", "))
    return " ".join(part[-1] if part[0] in {"formulation", "preset"} else "=".join(part) for part in parts)


def lines(content: VersionsStudy, most: int | None = _MOST) -> Iterator[str]:
    """Sentences on the changes; ``!!`` precedes those that decide the exit code."""
    yield from _some([f"!! {sentence}" for sentence in _changes(content)], most)
    orders = [
        f"{row.comparison}: {short_setting(row.setting)}: observed order of "
        f"{order.quantity} {order.old:.2f} → {order.new:.2f}"
        for row in content.rows
        for order in row.orders[:1]
    ]
    yield from _some(orders, most)
    came, went = ([item for item in content.defaults if getattr(item, side) is None] for side in ("old", "new"))
    stayed = [item for item in content.defaults if item not in came and item not in went]
    yield from _some([f"default {item.name}: {item.old} → {item.new}" for item in stayed], most)
    if came or went:
        yield f"{len(came)} options are new and {len(went)} are gone, renamed ones among them."
    yield from (f"?? {sentence}" for sentence in content.lost)
    yield from host_sentences(content.hosts)
    yield answer(content)


def _changes(content: VersionsStudy) -> list[str]:
    """Sentences on changed verdicts, each once with its points."""
    points: dict[tuple[str, str, str], list[str]] = {}
    for case in content.cases:
        for sentence in case.changed:
            points.setdefault((case.comparison, short_setting(case.setting), sentence), []).append(case.point)
    return [
        f"{comparison}: {setting}: {what}"
        + (
            f", at {len(where_changed)} points"
            if len(where_changed) > 1
            else f", at {where_changed[0]}" * bool(where_changed[0])
        )
        for (comparison, setting, what), where_changed in points.items()
    ]


def _some(sentences: list[str], most: int | None) -> Iterator[str]:
    yield from sentences[:most]
    if most is not None and len(sentences) > most:
        yield f"   and {len(sentences) - most} more"


def page(content: VersionsStudy) -> str:
    """HTML page of the study; text from engines and files is escaped."""
    return rendered(
        environment(),
        "versions.html",
        content=content,
        engine=engine_title(content.engine),
        heading=heading(content),
        answer=answer(content),
        rows=[(row, cells(row)) for row in content.rows],
        sentences=list(lines(content, None)),
    )
