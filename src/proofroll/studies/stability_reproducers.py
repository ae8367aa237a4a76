"""Writes a self-contained program for every boundary of a map that shows the failure with the engine alone."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from proofroll.core.element_abilities import WritesPrograms
from proofroll.core.failed_run import FailedRun, imported
from proofroll.running.asking import programs
from proofroll.running.case import Case
from proofroll.running.store import write_text
from proofroll.running.worker_pool import Workers
from proofroll.studies.failure import ACCURATE, REFUSED, TOO_SLOW, WRONG
from proofroll.studies.stability import MapPoint, StabilityMap

# A run that did not begin, and one that nobody waited for, show nothing.
_NOTHING_TO_SHOW = {
    REFUSED: "the run was refused before it began",
    TOO_SLOW: "the run was only too slow for the map",
}


def write_reproducers(found: StabilityMap, study: dict[str, Any], folder: Path, workers: Workers | None = None) -> None:
    """Puts the path of each program into its point of the study, and why it needs proofroll, or why there is none.

    Args:
        found: the map.
        study: the same as :func:`proofroll.studies.stability_content.content` has it; its points are in its order.
        folder: where the programs go.
        workers: idle ones that may be asked.
    """
    wanted: list[tuple[MapPoint, dict[str, Any], dict[str, Any], Case, str]] = []
    for point, entry in zip(found.points, study["points"], strict=True):
        name, side = _shown(entry)
        if side is None or side["failure"] is None:
            continue
        if side["failure"] in _NOTHING_TO_SHOW:
            entry["reproducer_note"] = _NOTHING_TO_SHOW[side["failure"]]
            continue
        rung = point.ladder.index(side["beyond"])
        wanted.append((point, entry, side, point.cases[rung], name))
    for (point, entry, side, case, name), (engine, reason) in zip(
        wanted, programs([item[3] for item in wanted], workers), strict=True
    ):
        entry["reproducer_note"] = None if engine is not None else reason
        element = point.place.scene.elements[0] if point.place.scene is not None else None
        if not isinstance(element, WritesPrograms):
            entry["reproducer_note"] = "elements of this kind offer no program"
            continue
        path = folder / f"{_file_name(entry)}.py"
        text = element.failure_program(_failed(point, entry, side, case, name), engine)
        write_text(path, text)
        entry["reproducer"] = str(path)
        entry["reproducer_needs"] = [name for name in imported(text) if name != "sys"]


def _failed(point: MapPoint, entry: dict[str, Any], side: dict[str, Any], case: Case, boundary: str) -> FailedRun:
    yardstick, facts = point.place.yardstick, case.engine
    assert yardstick is not None  # a point has one
    return FailedRun(
        scene=case.scene,
        parameters=point.place.parameters,
        engine=facts.name,
        version=facts.version,
        settings=facts.settings,
        resolution=str(facts.resolution),
        until=case.until,
        every=case.every,
        where=f"{entry['axis']} = {entry['value']:g}",
        boundary=boundary,
        failure=side["failure"],
        silent=side["silent"],
        truth=yardstick.truth,
        scale=yardstick.scale,
        allowed=WRONG if boundary == "stable" else ACCURATE,
        note=entry["reproducer_note"] or "",
    )


def _shown(entry: dict[str, Any]) -> tuple[str, dict[str, Any] | None]:
    """The boundary that a program can show: that of stability, or else that of accuracy."""
    for name in ("stable", "accurate"):
        side = entry["sides"][name]
        if side["failure"] and side["failure"] not in _NOTHING_TO_SHOW:
            return name, side
    return entry["boundary"], entry["sides"][entry["boundary"]]


def _file_name(entry: dict[str, Any]) -> str:
    settings = entry["settings"]
    words = (entry["engine"], settings.get("formulation"), settings.get("preset"), entry["axis"], f"{entry['value']:g}")
    return re.sub(r"[^\w.+-]+", "_", "-".join(str(word) for word in words if word))
