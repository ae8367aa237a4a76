"""The report: one HTML file that needs nothing else, and the same content as JSON beside it."""

from __future__ import annotations

import functools
import json
import shlex
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from proofroll.plain import plain
from proofroll.report import heat_map, labels, onset_tables, study_tables, tables
from proofroll.report.content import environment, outcome_content
from proofroll.report.evidence import add_evidence
from proofroll.report.findings import findings
from proofroll.report.onsets import add_events, mark, truth_facts
from proofroll.report.packing import packed
from proofroll.report.parts import KEYS
from proofroll.report.regime_map import counts
from proofroll.report.styles import OUTLINES, styles
from proofroll.report.summary import three_sentences
from proofroll.report.tradeoff_tables import name_of
from proofroll.scene_file import load_scene
from proofroll.store import Store
from proofroll.studies.compare import Outcome
from proofroll.studies.numbers import SYMBOLS
from proofroll.trajectory import read

if TYPE_CHECKING:
    from collections.abc import Sequence

    import jinja2
    import xarray as xr

    Maps = Sequence[Sequence[xr.Dataset]]


def write_report(outcomes: list[Outcome], store: Store, out: Path, command: str, maps: Maps = ()) -> dict[str, Any]:
    """Writes ``report.html`` and ``report.json`` of comparisons alone.

    Args:
        outcomes: what was compared.
        store: where the trajectories are: a folder in that of the report.
        out: folder of the report.
        command: that makes the report again.
        maps: the regime maps of each comparison, empty where it has none.

    Returns:
        the content of both files as plain data, as :func:`report_content` has it.

    Raises:
        ProofrollError: the folder cannot be written.
    """
    from proofroll.report.whole import begun

    report = begun(outcomes, store, command, maps)
    report.write(out)
    return report.content


def report_content(outcomes: list[Outcome], store: Store, command: str, maps: Maps = ()) -> dict[str, Any]:
    """All that the report says, as plain data.

    ``findings`` on the whole, ``comparisons``, the entries of further studies under ``figures``, ``tradeoffs`` and
    ``stability``, ``date`` and ``environment``. Paths of files are relative to the folder of the report.
    """
    comparisons = []
    for index, outcome in enumerate(outcomes):
        content = outcome_content(outcome)
        for run in content["runs"]:
            run["trajectory"] = run["trajectory"] and f"{store.folder.name}/{run['trajectory']}"
        content["truths"] = _truths(outcome, store)
        content["findings"] = findings(content)
        content["regimes"] = counts(maps[index]) if index < len(maps) else []
        add_events(content, outcome.runs, store)
        add_evidence(content, outcome)
        comparisons.append(content)
    versions: dict[str, str] = {}
    for outcome in outcomes:
        for run in outcome.runs:
            versions |= run.result.versions
    content = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "comparisons": comparisons,
        **{key: [] for key in KEYS},
        "environment": environment(command, versions),
    }
    content["findings"] = {"sentences": three_sentences(content)}
    return dict(plain(content))


def page(
    content: dict[str, Any],
    curves: list[list[dict[str, Any]]],
    pictures: Mapping[str, str] = MappingProxyType({}),
    replay: dict[str, Any] | None = None,
) -> str:
    """The HTML page.

    Args:
        content: from :func:`report_content`.
        curves: from :func:`proofroll.report.plots.point_curves`, one list for each comparison.
        pictures: markup by name: ``map0`` are the regime maps of the first comparison, the others belong to
            further studies; what is not there is left out.
        replay: from :func:`proofroll.report.replay.replay_content`; None: the page has none.
    """
    drawn = {
        "rows": [_drawn_rows(comparison) for comparison in content["comparisons"]],
        "points": [mark(*pair) for pair in zip(content["comparisons"], curves, strict=True)],
    }
    text = (
        _templates()
        .get_template("page.html")
        .render(
            content=content,
            curves=curves,
            pictures=pictures,
            styles=[styles(comparison["rows"]) for comparison in content["comparisons"]],
            replay=replay or {"cases": []},
            data=packed(json.dumps(drawn, allow_nan=False, separators=(",", ":"))),
            plotly=_plotly(),
        )
    )
    return text.encode("utf-8", "replace").decode("utf-8")  # a lone surrogate from an engine's message


@functools.cache
def _plotly() -> str:
    """The program that draws, compressed."""
    import plotly.offline

    return packed(plotly.offline.get_plotlyjs())


def _drawn_rows(comparison: dict[str, Any]) -> list[dict[str, Any]]:
    rows = comparison["rows"]
    return [{"name": name, **style} for name, style in zip(labels.names(rows), styles(rows), strict=True)]


def _templates() -> jinja2.Environment:
    """The templates; everything that is put into them is escaped, save what they mark as ours."""
    import jinja2

    made = jinja2.Environment(
        loader=jinja2.PackageLoader("proofroll.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "number": labels.number,
        "error": labels.error,
        "symbol": labels.symbol,
        "unit": labels.unit,
        "values": labels.values,
        "settings": labels.settings_text,
        "clock": onset_tables.clock,
        "bracket": onset_tables.bracket,
        "between": onset_tables.between,
        "name_of": name_of,
        "dimensionless": lambda name: SYMBOLS.get(name, name),
    }
    made.globals |= {
        "tables": tables,
        "studies": study_tables,
        "heat_map": heat_map.table,
        "onsets": onset_tables,
        "names": labels.names,
        "symbols": labels.SYMBOLS,
        "meanings": labels.MEANINGS,
        "outlines": OUTLINES,
        "again": _again,
    }
    return made


def _again(comparison: dict[str, Any], run: dict[str, Any]) -> str:
    """The command that makes one run again."""
    words = ["proofroll", "run", comparison["scene"], "--engine", run["engine"]]
    for name, value in run["parameters"].items():
        words += ["--set", f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}"]
    return shlex.join([*words, "--until", f"{comparison['until']:g}", "--every", f"{comparison['every']:g}"])


def _truths(outcome: Outcome, store: Store) -> list[dict[str, Any]]:
    """For each point where the truth comes from and how well it is known."""
    found = []
    for name, case in outcome.truths.items():
        path = store.trajectory(case)
        entry: dict[str, Any] = {
            "point": name,
            "parameters": case.parameters,
            "trajectory": f"{store.folder.name}/{path.name}",
        }
        if path.is_file():
            dataset = read(path)
            entry |= {key: dataset.attrs.get(key, "") for key in ("route", "second_route")}
            entry["error_bars"] = {
                str(key): {"value": float(curve.attrs["error_bar"]), "unit": curve.attrs["units"]}
                for key, curve in dataset.data_vars.items()
                if curve.dims == ("time",) and "error_bar" in curve.attrs
            }
            entry |= truth_facts(dataset, load_scene(case.scene, **case.parameters))
        found.append(entry)
    return found
