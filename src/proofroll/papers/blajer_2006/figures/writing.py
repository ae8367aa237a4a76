"""Files of a study of figures, and its statements with their verdicts, as lines and rows of tables."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import number
from proofroll.files.atomic import replacing
from proofroll.files.json_data import plain
from proofroll.papers.blajer_2006.figures import style
from proofroll.papers.blajer_2006.figures.drawing import picture
from proofroll.papers.blajer_2006.figures.judging import judgements
from proofroll.papers.blajer_2006.figures.study import FigureRuns, study_content
from proofroll.papers.blajer_2006.report.regime_map import counts
from proofroll.papers.blajer_2006.report.regime_map import picture as map_picture
from proofroll.report.labels import unit
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll.running.store import write_text

if TYPE_CHECKING:
    import xarray as xr

    Maps = Mapping[str, Sequence[xr.Dataset]]

_MAP_HEIGHT = 3.6  # inch


def figures_content(study: FigureRuns, maps: Maps) -> dict[str, Any]:
    """Content of ``figures.json``: sources, captions, statements; ``maps``: regime maps by name of their study."""
    entries = []
    for figure in study.figures.figures:
        entry: dict[str, Any] = {"name": figure.name, "caption": figure.caption}
        if figure.regimes:
            entry["regimes"] = counts(maps[figure.regimes])
        else:
            entry["runs"] = list(dict.fromkeys(run for panel in figure.panels for run in panel.runs))
        entries.append(entry)
    return dict(plain(study_content(study) | {"figures": entries, "statements": judgements(study)}))


def write_figures(study: FigureRuns, maps: Maps, out: Path, forms: Sequence[str]) -> dict[str, Any]:
    """Writes every figure in every form, and ``figures.json``.

    Args:
        study: the runs.
        maps: regime maps by the name of their study.
        out: folder of the files.
        forms: formats, each ``svg``, ``png`` or ``pdf``.

    Returns:
        Content of the JSON file, with the names of the other files.

    Raises:
        Missing: matplotlib is not installed.
        ProofrollError: the folder cannot be written.
    """
    content = figures_content(study, maps)
    for figure, entry in zip(study.figures.figures, content["figures"], strict=True):
        entry["files"] = []
        for form in forms:
            if figure.regimes:
                drawn = map_picture(maps[figure.regimes], form, style.SETTINGS, (style.WIDTH, _MAP_HEIGHT))
            else:
                drawn = picture(figure, study, form)
            path = out / f"{figure.name}.{form}"
            with replacing(path) as temporary:
                temporary.write_bytes(drawn)
            entry["files"].append(path.name)
    write_text(out / "figures.json", json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    return content


def closing_lines(content: dict[str, Any], out: Path) -> list[str]:
    """Lines on the statements that hold, on lost runs, and on the places of the files."""
    verdicts = [item["holds"] for item in content["statements"]]
    lines = [f"{count(content['statements'])}."]
    if verdicts.count(None):
        why = dict.fromkeys(item["why"] for item in content["statements"] if item["holds"] is None)
        lines.append(f"{verdicts.count(None)} cannot be judged: {'; '.join(why)}.")
    files = [name for figure in content["figures"] for name in figure["files"]]
    return [*lines, f"{len(files)} figures and figures.json are in {out}: {', '.join(files)}."]


_SIGNS = {True: ("✓", "green"), False: ("✗", "bold red"), None: ("–", "")}


def count(statements: Sequence[Mapping[str, Any]]) -> str:
    """Count of the statements that hold, those of the article apart from this project's own."""
    parts = []
    for ours, whose in ((False, "statements"), (True, "of this project's own")):
        verdicts = [item["holds"] for item in statements if item["ours"] is ours]
        if verdicts:
            parts.append(f"{verdicts.count(True)} of {len(verdicts)} {whose}")
    return f"{' and '.join(parts)} hold"


def titled(name: str) -> str:
    """A figure's name as a heading: ``figure3`` is ``Figure 3``."""
    return re.sub(r"(?<=[a-z])(?=\d)", " ", name.replace("_", " ")).capitalize()


def rows(study: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of an article's statements and the runs' values, one line for each run."""
    lines, previous = [], None
    for item in study["statements"]:
        of = unit(item["unit"])
        lines.append(
            {
                **item,
                "first": item["says"] != previous,
                "runs": ", ".join(item["runs"]),
                "found": _said(item["found"], of),
                "truth": _said(item["truth"], of),
            }
        )
        previous = item["says"]
    return lines


def statement_table(content: dict[str, Any]) -> Table:
    """Table of statements, values and verdicts, one line for each."""
    found_column = Column("found", justify="right", max_width=24)
    table = plain_table(
        Column("statement"), *unbroken("run"), *numeric("stated"), found_column, *unbroken(""), title=content["title"]
    )
    previous = ""
    for item in content["statements"]:
        sign, look = _SIGNS[item["holds"]]
        # Several runs are compared by order: the numbers show it, and the names of runs are in the JSON.
        runs = item["runs"][0] if len(item["runs"]) == 1 else f"{len(item['runs'])} runs"
        table.add_row(
            Text("" if item["says"] == previous else item["says"]),
            Text(runs),
            Text(item["stated"]),
            Text(_said(item["found"], unit(item["unit"]))),
            Text(sign, style=look),
        )
        previous = item["says"]
    return table


def _said(value: Any, of: str) -> str:
    if value is None:
        return "–"
    if isinstance(value, list):
        parts = [part if isinstance(part, str) else number(part, 3) for part in value]
        return f"{', '.join(parts)} {of}".strip() if parts else "nothing"
    return f"{number(value, 7)} {of}".strip()
