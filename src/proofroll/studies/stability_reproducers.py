"""Writes a self-contained program for every boundary of a map that shows the failure with the engine alone."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Reproducer:
    """A program of one point.

    Attributes:
        reproducer: its path; None: there is none.
        reproducer_needs: packages that it imports.
        reproducer_note: why it needs proofroll, or why there is none.
    """

    reproducer: str | None = None
    reproducer_needs: Sequence[str] = ()
    reproducer_note: str | None = None


def write_reproducers(
    found: StabilityMap, entries: Sequence[Mapping[str, Any]], folder: Path, workers: Workers | None = None
) -> list[Reproducer]:
    """Writes a program for each point that shows a failure; one answer for each point.

    Args:
        found: the map.
        entries: its points as :func:`proofroll.studies.stability_content.stability_document` has them.
        folder: where the programs go.
        workers: idle ones that may be asked.
    """
    written = [Reproducer() for _ in entries]
    wanted: list[tuple[int, str, Case]] = []
    for index, (point, entry) in enumerate(zip(found.points, entries, strict=True)):
        name = _shown(entry)
        side = entry["sides"][name]
        if side["failure"] in _NOTHING_TO_SHOW:
            written[index] = Reproducer(reproducer_note=_NOTHING_TO_SHOW[side["failure"]])
        elif side["failure"] is not None:
            wanted.append((index, name, point.cases[point.ladder.index(side["beyond"])]))
    for (index, name, case), (engine, reason) in zip(
        wanted, programs([item[-1] for item in wanted], workers), strict=True
    ):
        point, entry = found.points[index], entries[index]
        element = point.place.scene.elements[0] if point.place.scene is not None else None
        if not isinstance(element, WritesPrograms):
            written[index] = Reproducer(reproducer_note="elements of this kind offer no program")
            continue
        note = None if engine is not None else reason
        path = folder / f"{_file_name(entry)}.py"
        text = element.failure_program(_failed(point, entry, case, name, note), engine)
        write_text(path, text)
        written[index] = Reproducer(str(path), [package for package in imported(text) if package != "sys"], note)
    return written


def _failed(point: MapPoint, entry: Mapping[str, Any], case: Case, boundary: str, note: str | None) -> FailedRun:
    yardstick, facts, side = point.place.yardstick, case.engine, entry["sides"][boundary]
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
        note=note or "",
    )


def _shown(entry: Mapping[str, Any]) -> str:
    """The boundary that a program can show: that of stability, or else that of accuracy."""
    for name in ("stable", "accurate"):
        failure = entry["sides"][name]["failure"]
        if failure and failure not in _NOTHING_TO_SHOW:
            return name
    return str(entry["boundary"])


def _file_name(entry: Mapping[str, Any]) -> str:
    settings = entry["settings"]
    words = (entry["engine"], settings.get("formulation"), settings.get("preset"), entry["axis"], f"{entry['value']:g}")
    return re.sub(r"[^\w.+-]+", "_", "-".join(str(word) for word in words if word))
