"""Summary of a stability map for storage: counts, boundaries, explanations, and violations of scale invariance."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, replace
from operator import attrgetter
from pathlib import Path

from proofroll.core.element_abilities import WritesPrograms
from proofroll.core.program_text import FailedRun, imported_packages
from proofroll.running.case import Case, hosts
from proofroll.running.engine_questions import programs
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import write_text
from proofroll.studies.failure import ACCURATE, NOT_RUN, REFUSED, TOO_SLOW, WRONG, WRONG_MODEL, meanings
from proofroll.studies.stability.axes import Axis, Effort
from proofroll.studies.stability.claims import StabilityFile
from proofroll.studies.stability.map import MapPoint, Progress, StabilityMap, failure_beyond, stability, stability_path
from proofroll.studies.stability.records import (
    BOUNDARIES,
    Boundary,
    BoundaryPoint,
    ExplainedBoundary,
    JudgedFile,
    StabilityStudy,
    dependence,
)
from proofroll.studies.stability.step_numbers import explanation, step_numbers, values
from proofroll.studies.study_store import conditions_now, keep_study

# Failures that no program can show -> the reason.
_NOTHING_TO_SHOW = {
    REFUSED: "the run was refused before it began",
    WRONG_MODEL: "the engine built a different scene",
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


def make_stability(
    asked: StabilityFile,
    axes: Sequence[Axis],
    runner: Runner,
    folder: Path,
    *,
    engines: Sequence[str] = (),
    effort: Effort,
    progress: Progress | None = None,
) -> tuple[StabilityStudy, Path]:
    """Maps the boundaries of a scene (:func:`stability`), and stores the map with a program for each boundary.

    Returns:
        The study with judged claims, and its file.

    Raises:
        InputError: an unknown scene, parameter or engine.
        ProofrollError: the folder cannot be written.
    """
    stability_map = stability(asked.scene, axes, runner, engines=engines, effort=effort, progress=progress)
    path = stability_path(folder, asked.scene, axes, engines, effort)
    study = with_programs(stability_map, stability_study(stability_map), path.with_suffix(""), runner.workers)
    study = replace(study, claims=JudgedFile(asked.name, asked.contradictions(study)))
    keep_study(study, path)
    return study, path


def stability_study(stability_map: StabilityMap) -> StabilityStudy:
    """Record of a stability map with its counts and conclusions."""
    points, scene = [_point(point) for point in stability_map.points], stability_map.default
    failing = [point for point in points if point.failure and point.failure not in NOT_RUN]
    return StabilityStudy(
        scene=stability_map.scene,
        axes=stability_map.axes,
        periods=stability_map.effort.periods,
        accurate=ACCURATE,
        runs=stability_map.runs,
        boundaries=len(failing),
        silent=sum(point.silent for point in failing),
        refused=sum(point.failure == REFUSED for point in points),
        wrong_model=sum(point.failure == WRONG_MODEL for point in points),
        failures=dict(Counter(point.failure for point in failing if point.failure)),
        never_accurate=sum(point.largest_accurate is None and not point.problem for point in points),
        meanings=dict(meanings(scene)),
        step_symbols={item.name: item.symbol for item in step_numbers(scene)},
        points=points,
        explanations=_explanations(points),
        findings=_scale_conclusions(stability_map, points),
        places=stability_map.values,
        absent=stability_map.absent,
        hosts=hosts(result for point in stability_map.points for result in point.results.values()),
        effort=stability_map.effort,
        measured=conditions_now(),
    )


def _point(point: MapPoint) -> BoundaryPoint:
    axis_value, facts = point.at, point.curve.facts
    settings = {key: value for key, value in facts.settings.items() if key != facts.resolution}
    sides = {name: _side(point, name) for name in BOUNDARIES}
    if axis_value.yardstick.true is None:
        sides["accurate"] = replace(sides["accurate"], largest=None, numbers={})  # unknown without a truth
    # Without a boundary of stability that of accuracy is shown.
    boundary = "stable" if sides["stable"].failure else "accurate"
    boundary_found = sides[boundary]
    errors = [item.error for item in point.found.seen.values() if item.stable and item.error is not None]
    return BoundaryPoint(
        **point.curve.setting(replace(facts, settings=settings)),
        axis=axis_value.axis,
        value=axis_value.value,
        parameters=axis_value.parameters,
        until=axis_value.until,
        period=axis_value.scene.natural_time,
        largest_stable=sides["stable"].largest,
        largest_accurate=sides["accurate"].largest,
        boundary=boundary,
        failure=boundary_found.failure,
        silent=boundary_found.silent,
        message=boundary_found.message,
        sides=sides,
        least_error=min(errors, default=None),
        finest=point.ladder[max(point.found.seen)] if point.found.seen else None,
        too_slow=point.ladder[point.found.limit] if point.found.limit < len(point.ladder) else None,
        timed_out=point.timeouts > 0,
        runs=len(point.results),
        problem=axis_value.problem,
    )


def _side(point: MapPoint, name: str) -> Boundary:
    """One boundary of a point: the largest step or tolerance that holds, and the failure beyond it."""
    holding, failing = point.found.boundary(attrgetter(name))
    beyond = failure_beyond(point, failing)
    scene, yardstick = point.at.scene, point.at.yardstick
    largest = None if holding is None else point.ladder[holding]
    return Boundary(
        largest=largest,
        reached=beyond is not None and holding is not None,
        numbers=values(scene, largest, yardstick.truth) if point.curve.fixed_step and largest is not None else {},
        beyond=None if failing is None else point.ladder[failing],
        failure=None if beyond is None else beyond.failure,
        silent=beyond is not None and beyond.silent,
        error=None if beyond is None else beyond.error,
        time=None if beyond is None else beyond.time,
        message=None if beyond is None else beyond.message,
    )


def _explanations(points: Sequence[BoundaryPoint]) -> list[ExplainedBoundary]:
    """Dimensionless number that varies least, for every curve, axis and boundary."""
    explained = []
    for curve in dict.fromkeys(point.curve for point in points):
        for axis in dict.fromkeys(point.axis for point in points):
            for name in BOUNDARIES:
                sides = [point.sides[name] for point in points if point.curve == curve and point.axis == axis]
                best = explanation([side.numbers for side in sides if side.reached and side.numbers])
                if best is not None:
                    explained.append(ExplainedBoundary(**asdict(best), curve=curve, axis=axis, boundary=name))
    return explained


def _scale_conclusions(stability_map: StabilityMap, points: Sequence[BoundaryPoint]) -> list[str]:
    """Sentences on boundaries that change along an axis though the dimensionless problem does not."""
    sentences = []
    for axis in (axis for axis in stability_map.axes if axis.scale_free):
        for curve in dict.fromkeys(point.curve for point in points):
            on_axis = [point for point in points if point.curve == curve and point.axis == axis.name]
            for name in BOUNDARIES:
                change = dependence([p for p in on_axis if not (p.problem and name == "accurate")], name)
                if change:
                    sentences.append(f"{curve} depends on {axis.name}, which should not matter: {name} up to {change}")
    return sentences
