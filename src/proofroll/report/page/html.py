"""The report's page: one HTML file without external resources."""

from __future__ import annotations

import functools
import inspect
import json
import shlex
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from proofroll.core import number_format
from proofroll.files.json_data import plain
from proofroll.files.scene_sources import command_line
from proofroll.report import labels
from proofroll.report.answer import picture, sentences
from proofroll.report.comparison import tables, verdict_matrix
from proofroll.report.comparison.closing import closing_notes
from proofroll.report.comparison.distances import distance_cells
from proofroll.report.comparison.spread import ALONE
from proofroll.report.kinds import ReportKind, report_kinds
from proofroll.report.page import first_screen, model_lines, verdict_strips
from proofroll.report.pages import environment, folded, packed, rendered, slug
from proofroll.report.parts import Part, part_kinds
from proofroll.report.styles import OUTLINES, engine_colours, styles
from proofroll.running.case import host_sentences

if TYPE_CHECKING:
    import jinja2

    from proofroll.report.comparison.plots import PointCurves
    from proofroll.report.comparison.records import ReportedComparison, ReportedRun
    from proofroll.report.page.records import ReportContent
    from proofroll.report.replay.records import Replay


def studies_page(content: ReportContent, pictures: Mapping[str, str]) -> str:
    """HTML page of the further studies, from a report's content and markup of their pictures by name."""
    screen = first_screen.FirstScreen(content)
    whole = rendered(
        templates(), "studies_page.html", content=content, pictures=pictures, screen=screen, datatables=_datatables()
    )
    return folded(whole)


def page(content: ReportContent, curves: Sequence[Sequence[PointCurves]], replay: Replay | None = None) -> str:
    """HTML page from content, curves of each comparison, and the replay if any."""
    drawn = {
        "engines": content.engines,
        "titles": {name: labels.engine_title(name) for name in content.engines},
        "rows": [_drawn_rows(comparison, content.engines) for comparison in content.comparisons],
        "points": [_marked(*pair) for pair in zip(content.comparisons, curves, strict=True)],
    }
    whole = rendered(
        templates(),
        "page.html",
        content=content,
        curves=curves,
        screen=first_screen.FirstScreen(content),
        styles=[styles(comparison.rows, content.engines) for comparison in content.comparisons],
        replay=replay,
        replay_scripts=[kind.replay_script for kind in report_kinds().values() if kind.replay_script],
        data=packed(json.dumps(plain(drawn), allow_nan=False, separators=(",", ":")).encode()),
        datatables=_datatables(),
    )
    return folded(whole)


def _marked(comparison: ReportedComparison, curves: Sequence[PointCurves]) -> Sequence[PointCurves]:
    """Curves with the marks of the scene's kind of element."""
    kind = report_kinds().get(comparison.shown_by)
    return curves if kind is None else kind.mark(comparison, curves)


@functools.cache
def _datatables() -> str:
    """Source of DataTables (as itables ships it), which sorts, filters and downloads tables; compressed."""
    return packed((resources.files("itables") / "html" / "dt_bundle.js").read_bytes())


def _drawn_rows(comparison: ReportedComparison, engines: Sequence[str]) -> list[dict[str, object]]:
    rows = comparison.rows
    looks = zip(labels.names(rows), rows, styles(rows, engines), strict=True)
    return [
        {"name": name, "label": f"{labels.engine_title(row.name)} {labels.setting(row)}", **vars(style)}
        for name, row, style in looks
    ]


def templates() -> jinja2.Environment:
    """Templates of the report with the names that they use; each is compiled once in a process."""
    return _templates((*part_kinds(), *report_kinds().values()))


@functools.cache
def _templates(kinds: tuple[type[Part] | type[ReportKind], ...]) -> jinja2.Environment:
    made = environment(*(Path(inspect.getfile(kind)).parent / "templates" for kind in kinds))
    made.filters |= {
        "number": number_format.number,
        "error": number_format.error,
        "symbol": labels.symbol,
        "unit": labels.unit,
        "bound": labels.bound_words,
        "full_stop": lambda text: text if text.endswith((".", "!", "?")) else f"{text}.",
        "engine": labels.engine_title,
        "values": labels.values,
        "settings": labels.settings_text,
        "name_of": labels.name_of,
        "plain": plain,
        "quoted": shlex.quote,
    }
    made.globals |= {
        "tables": tables,
        "verdict_matrix": verdict_matrix,
        "strips": verdict_strips,
        "names": labels.names,
        "curve_names": labels.curve_names,
        "step": labels.step,
        "detail": labels.detail,
        "verdict_text": labels.verdict_text,
        "setting": labels.setting,
        "closing_notes": closing_notes,
        "distance_cells": distance_cells,
        "alone_words": ALONE,
        "symbols": labels.SYMBOLS,
        "meanings": labels.MEANINGS,
        "outlines": OUTLINES,
        "first_screen": first_screen,
        "answer_words": sentences,
        "answer_picture": picture.svg,
        "colours_of": engine_colours,
        "model_lines": model_lines,
        "loop_key": slug,
        "scene_words": labels.scene_words,
        "again": _again,
        "host_sentences": host_sentences,
        "report_kinds": report_kinds(),
    }
    for kind in kinds:
        made.globals |= kind.names
    return made


def _again(comparison: ReportedComparison, run: ReportedRun) -> str:
    """Command that repeats one run."""
    values = run.parameters.items()
    settings = [f"{name}={number_format.exact(item) if isinstance(item, float) else item}" for name, item in values]
    times = {"until": comparison.until, "every": comparison.every}
    return command_line("run", comparison.scene, engine=run.engine, set=settings, **times)
