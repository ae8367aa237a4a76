"""Writes a program for every boundary of a map that shows the failure, if possible with the engine alone."""

import re
from dataclasses import replace
from pathlib import Path

from proofroll.core.element_abilities import WritesPrograms
from proofroll.core.program_text import FailedRun, imported_packages
from proofroll.running.case import Case
from proofroll.running.engine_questions import programs
from proofroll.running.idle_workers import Workers
from proofroll.running.store import write_text
from proofroll.studies.failure import ACCURATE, REFUSED, TOO_SLOW, WRONG, WRONG_MODEL
from proofroll.studies.stability.map import MapPoint, StabilityMap
from proofroll.studies.stability.records import BOUNDARIES, BoundaryPoint, StabilityStudy

# Failures that no program can show -> the reason.
_NOTHING_TO_SHOW = {
    REFUSED: "the run was refused before it began",
    WRONG_MODEL: "the engine built a different scene, so it was not run",
    TOO_SLOW: "the run was only too slow for the map",
}


def with_programs(
    stability_map: StabilityMap, study: StabilityStudy, folder: Path, workers: Workers | None = None
) -> StabilityStudy:
    """Writes a program into the folder for each point that has a failure to show.

    Returns:
        The study, whose points name their programs or say why they have none.
    """
    points = list(study.points)
    tasks: list[tuple[int, str, Case]] = []
    for index, (made, point) in enumerate(zip(stability_map.points, study.points, strict=True)):
        name = _shown(point)
        side = point.sides[name]
        if side.failure in _NOTHING_TO_SHOW:
            points[index] = replace(point, reproducer_note=_NOTHING_TO_SHOW[side.failure])
        elif side.failure is not None and side.beyond is not None:
            tasks.append((index, name, made.cases[made.ladder.index(side.beyond)]))
    for (index, name, case), (engine, reason) in zip(
        tasks, programs([item[-1] for item in tasks], workers), strict=True
    ):
        made, point = stability_map.points[index], study.points[index]
        element = made.at.scene.elements[0]
        if not isinstance(element, WritesPrograms):
            points[index] = replace(point, reproducer_note="elements of this kind offer no program")
            continue
        note = None if engine is not None else reason
        path = folder / f"{_file_name(point)}.py"
        text = element.failure_program(_failed(made, point, case, name, note), engine)
        write_text(path, text)
        needs = [package for package in imported_packages(text) if package != "sys"]
        points[index] = replace(point, reproducer=str(path), reproducer_needs=needs, reproducer_note=note)
    return replace(study, points=points)


def _failed(made: MapPoint, point: BoundaryPoint, case: Case, boundary: str, note: str | None) -> FailedRun:
    yardstick, facts, side = made.at.yardstick, case.engine, point.sides[boundary]
    assert side.failure is not None  # it is shown
    return FailedRun(
        scene=case.scene,
        parameters=point.parameters,
        engine=facts.name,
        version=facts.version,
        settings=facts.settings,
        resolution=str(facts.resolution),
        until=case.until,
        every=case.every,
        where=f"{point.axis} = {point.value:g}",
        boundary=boundary,
        failure=side.failure,
        silent=side.silent,
        truth=yardstick.truth,
        scale=yardstick.scale,
        allowed=WRONG if boundary == "stable" else ACCURATE,
        note=note or "",
    )


def _shown(point: BoundaryPoint) -> str:
    """Boundary whose failure a program can show: that of stability, or else that of accuracy."""
    for name in BOUNDARIES:
        failure = point.sides[name].failure
        if failure and failure not in _NOTHING_TO_SHOW:
            return name
    return point.boundary


def _file_name(point: BoundaryPoint) -> str:
    settings = point.settings
    words = (point.engine, settings.get("formulation"), settings.get("preset"), point.axis, f"{point.value:g}")
    return re.sub(r"[^\w.+-]+", "_", "-".join(str(word) for word in words if word))
