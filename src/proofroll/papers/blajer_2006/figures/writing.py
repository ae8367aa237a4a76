"""Files of a study of figures, and lines on the verdicts of its statements."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.files.atomic import replacing
from proofroll.files.json_data import plain
from proofroll.papers.blajer_2006.figures import style
from proofroll.papers.blajer_2006.figures.drawing import picture
from proofroll.papers.blajer_2006.figures.judging import judgements
from proofroll.papers.blajer_2006.figures.statement_tables import count
from proofroll.papers.blajer_2006.figures.study import FigureRuns, study_content
from proofroll.papers.blajer_2006.report.regime_map import counts
from proofroll.papers.blajer_2006.report.regime_map import picture as map_picture
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
