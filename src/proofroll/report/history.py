"""History of reports: verdicts, errors and costs of each engine by its versions, and changes from report to report."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.core.errors import InputError
from proofroll.core.verdict import Verdict
from proofroll.files.json_data import plain
from proofroll.report.changes import Against, EarlierReport, against, runs_of
from proofroll.report.figure import panels, svg_text
from proofroll.report.labels import SYMBOLS, engine_title
from proofroll.report.pages import element, environment, rendered
from proofroll.report.terminal.tables import change_lines
from proofroll.report.tradeoff.work_precision import SMALLEST
from proofroll.running.store import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from proofroll.report.long_table import TableLine

_COLOURS = ("#c9622f", "#3b6fb6", "#3f8f5b", "#8b5fa8", "#b08a1e", "#b8476b", "#2a8f9c", "#000000")


@dataclass(frozen=True)
class RunHistory:
    """One run over all reports: largest relative error and cost in each, or None; ``changed``: at any time."""

    run: str
    errors: list[float | None]
    costs: list[float | None]
    changed: bool


@dataclass(frozen=True)
class EngineHistory:
    """One engine over all reports: its version in each (empty: not run), counts of verdicts, and its runs."""

    engine: str
    versions: list[str]
    verdicts: list[dict[str, int]]
    runs: list[RunHistory]


@dataclass(frozen=True)
class History:
    """Reports of a folder, the oldest first; ``steps``: changes from each to the next."""

    files: list[str]
    dates: list[str]
    machines: list[str]
    engines: list[EngineHistory]
    steps: list[Against]

    def lines(self) -> Iterator[str]:
        """Lines for the terminal: changes from each report to the next."""
        for date, step in zip(self.dates[1:], self.steps, strict=True):
            head, *rest = change_lines(step)
            yield f"{date[:10]} {head[0].lower()}{head[1:]}"
            yield from rest


def read_history(folder: Path) -> History:
    """History of the reports in a folder (``*.json`` there, ``report.json`` in its folders), by date.

    Raises:
        InputError: there are fewer than two, or one is no report.
    """
    files = sorted([*folder.glob("*.json"), *folder.glob("*/report.json")])
    reports = sorted((EarlierReport.read(file, "--history") for file in files), key=lambda report: report.date)
    if len(reports) < 2:
        raise InputError("--history", folder, f"{len(reports)} reports there; keep a report.json of each night in it")
    steps = [against(old, new.lines, new.machine, new.versions) for old, new in pairwise(reports)]
    changed = {(item.study, item.run, item.place) for step in steps for item in step.changes if item.kind != "new"}
    tables = [runs_of(report.lines) for report in reports]
    names = dict.fromkeys(line.engine for report in reports for line in report.lines)
    engines = [_engine(name, tables, changed) for name in names]
    return History(
        files=[str(report.path) for report in reports],
        dates=[report.date for report in reports],
        machines=[report.machine for report in reports],
        engines=engines,
        steps=steps,
    )


def write_history(history: History, out: Path) -> None:
    """Writes ``history.html`` and ``history.json``.

    Raises:
        ProofrollError: the folder cannot be written, or matplotlib is not installed.
    """
    pictures = [
        element(svg_text({"font.size": 8}, lambda item=item: _drawn(item, history.dates)), f"h{number}-")  # type: ignore[misc]  # mypy infers no lambda with a default
        for number, item in enumerate(history.engines)
    ]
    order = [str(item) for item in Verdict]
    write_text(out / "history.json", json.dumps(plain(history), indent=1, allow_nan=False))
    names = {"titles": {item.engine: engine_title(item.engine) for item in history.engines}, "symbols": SYMBOLS}
    page = rendered(environment(), "history.html", history=history, pictures=pictures, order=order, **names)
    write_text(out / "history.html", page)


def _engine(
    name: str, tables: Sequence[dict[Any, dict[str, TableLine]]], changed: set[tuple[str, str, str]]
) -> EngineHistory:
    of_engine = [
        {key: run for key, run in table.items() if next(iter(run.values())).engine == name} for table in tables
    ]
    versions = [next((line.version for run in table.values() for line in run.values()), "") for table in of_engine]
    verdicts = [
        dict(Counter(line.verdict for run in table.values() for line in run.values() if line.verdict))
        for table in of_engine
    ]
    runs = []
    for key in dict.fromkeys(key for table in of_engine for key in table):
        study, place, run, _ = key
        both = [_numbers(table.get(key)) for table in of_engine]
        title = f"{study}: {run}{f' at {place}' if place else ''}"
        runs.append(RunHistory(title, [x[0] for x in both], [x[1] for x in both], (study, run, place) in changed))
    return EngineHistory(name, versions, verdicts, runs)


def _numbers(run: dict[str, TableLine] | None) -> tuple[float | None, float | None]:
    """Largest relative error of a run's quantities, and its cost if clean runs measured it."""
    lines = list(run.values()) if run else []
    errors = [line.relative for line in lines if line.error is not None and line.scale]
    cost = lines[0].cost if lines and lines[0].clean else None
    return max(errors, default=None), cost


def _drawn(engine: EngineHistory, dates: Sequence[str]) -> Figure:
    """Figure of errors and costs over the reports; runs that never changed are grey."""
    figure, drawn, _, _ = panels(2)
    figure.set_size_inches(10, 3.4)
    places = range(len(dates))
    marks = [f"{date[:10]}\n{version or '–'}" for date, version in zip(dates, engine.versions, strict=True)]
    colours = iter([*_COLOURS, *["#000000"] * len(engine.runs)])
    for run in sorted(engine.runs, key=lambda item: item.changed):
        look: dict[str, Any] = {"color": "#c3c9cf", "lw": 0.7}
        if run.changed:
            look = {"color": next(colours), "lw": 1.4, "marker": "o", "markersize": 3, "label": run.run}
        for panel, values in zip(drawn, (run.errors, run.costs), strict=True):
            panel.plot(places, [float("nan") if value is None else max(value, SMALLEST) for value in values], **look)
    if all(cost is None for run in engine.runs for cost in run.costs):
        drawn[1].text(0.5, 0.5, "no cost was measured by clean runs", ha="center", transform=drawn[1].transAxes)
    for panel, title in zip(drawn, ("largest error, in parts of its size", "cost [s/s]"), strict=True):
        panel.set(yscale="log", title=title, xticks=list(places), xlim=(-0.2, len(dates) - 0.8))
        panel.set_xticklabels(marks, rotation=0 if len(dates) < 7 else 60)
        panel.grid(which="major", color="0.92", lw=0.5)
    handles, labels = drawn[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles[:8], labels[:8], loc="outside lower left", frameon=False, fontsize=7, ncols=1)
    return figure
