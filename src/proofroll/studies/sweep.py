"""Every engine, formulation and preset over its usable range of steps or tolerances, on one scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.engine import whole_steps
from proofroll.core.errors import InputError, ProofrollError
from proofroll.running.asking import resolve_with_truth
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.runner import Runner
from proofroll.studies.curve import Curve, CurvePoint, Question, judged
from proofroll.studies.reference import Reference

# Steps in sampling intervals: those that every curve starts with, and those by which it may be extended.
_STEPS = (1.0, 1 / 2, 1 / 5, 1 / 10, 1 / 25, 1 / 50, 1 / 100, 1 / 250)
_COARSER = (2.0, 4.0, 8.0)
FINER = (1 / 500, 1 / 1000, 1 / 2500)
_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_LOOSER = (1.0, 10.0, 100.0)
# A run is broken where its error is this part of the quantity's scale; a curve starts in the broken range.
BROKEN = 0.1
# A curve is refined while that still takes off this part of the error; the finest step is short enough to end that,
# and how fast the machine is must not.
GAIN = 0.4


Progress = Callable[[Case, Result], None]


def sweep(
    question: Question,
    curves: list[Curve],
    runner: Runner,
    progress: Progress | None = None,
    finer: Sequence[float] = FINER,
    gain: float = GAIN,
) -> dict[float, Reference]:
    """Fills the curves with points, and returns the truth by sampling interval.

    Every curve begins with the same steps. It is then extended to coarser ones until it breaks, and to ``finer`` ones,
    in sampling intervals, while each takes off this part of the error, ``gain``.
    """
    references: dict[float, Reference] = {}
    asked: list[set[float]] = [set() for _ in curves]
    for first in (True, False, False, False):
        wanted = [
            (index, value)
            for index, curve in enumerate(curves)
            for value in (
                _first(question, curve) if first else _further(question, curve, references, asked[index], finer, gain)
            )
            if value not in asked[index]
        ]
        if not wanted:
            break
        for index, value in wanted:
            asked[index].add(value)
        _run(question, curves, wanted, runner, references, progress)
    return references


def _first(question: Question, curve: Curve) -> list[float]:
    if curve.facts.resolution is None:
        return [0.0]  # a closed form has nothing to refine: one point
    own = float(curve.facts.settings[curve.facts.resolution])
    if curve.fixed_step:
        return [question.step(factor) for factor in _STEPS]
    return [*_TOLERANCES, own]


def _further(
    question: Question,
    curve: Curve,
    references: Mapping[float, Reference],
    asked: set[float],
    finer_steps: Sequence[float] = FINER,
    gain: float = GAIN,
) -> list[float]:
    """One coarser step or looser tolerance if the coarsest is not broken yet, one of ``finer_steps`` if that pays."""
    if curve.facts.resolution is None or not curve.points:
        return []
    found = []
    scale = references[question.every].scale(question.quantity) or 1.0
    coarsest, finest = curve.points[0], curve.points[-1]
    ladder = [question.step(factor) for factor in _COARSER] if curve.fixed_step else _LOOSER
    coarser = next((value for value in ladder if value not in asked), None)
    whole = coarsest.errors.get(question.quantity, np.inf) < BROKEN * scale
    if coarser is not None and whole and not curve.saturated(question.quantity):
        found.append(coarser)
    if not curve.fixed_step:
        return found
    finer = next((step for step in map(question.step, finer_steps) if step not in asked), None)
    if finer is not None and len(curve.points) > 1:
        now, before = (point.errors.get(question.quantity, np.inf) for point in (finest, curve.points[-2]))
        if now < (1 - gain) * before:
            found.append(finer)
    return found


def _run(
    question: Question,
    curves: list[Curve],
    wanted: list[tuple[int, float]],
    runner: Runner,
    references: dict[float, Reference],
    progress: Progress | None,
) -> None:
    scene = question.loaded()
    options: list[tuple[str, dict[str, Any]]] = []
    for index, value in wanted:
        facts = curves[index].facts
        options.append((facts.name, facts.settings | ({facts.resolution: value} if facts.resolution else {})))
    resolved, truth_facts = resolve_with_truth(options, runner.workers)
    cases: list[tuple[int, tuple[Case, ...]]] = []
    for (index, value), found in zip(wanted, resolved, strict=True):
        if not isinstance(found, EngineFacts):
            curves[index].dropped[value] = str(found)
            continue
        try:
            if found.step is not None:
                whole_steps(0.0, question.until, found.step)
        except InputError as error:
            curves[index].dropped[value] = str(error)
            continue
        cases.append((index, question.cases(scene, found, max(question.every, found.step or 0.0))))
    intervals = {question.every, *(case.every for _, both in cases for case in both)} - references.keys()
    truths = {every: question.case(scene, truth_facts, every) for every in intervals}
    results = runner.run([*truths.values(), *(case for _, both in cases for case in both)], progress)
    for every, case in truths.items():
        if results[case.key].status != Status.DONE:
            raise ProofrollError(f"there is no truth here: {results[case.key].message}")
        references[every] = Reference.read(scene, runner.store.trajectory(case))
    for index, both in cases:
        curves[index].points.append(judged([CurvePoint(case, results[case.key]) for case in both], references, runner))
    for curve in curves:
        curve.points.sort(key=lambda point: -(point.step or 0.0))
