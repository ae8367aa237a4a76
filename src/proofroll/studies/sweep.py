"""Every engine, formulation and preset over its usable range of steps or tolerances, on one scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import EngineSpec, engine_names, parse_engine
from proofroll.core.scene import Scene
from proofroll.files.netcdf import read
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.runner import Runner, describe, resolve
from proofroll.running.worker_pool import Workers
from proofroll.studies.reference import Reference

# Samples per run. An oscillation of the founding scene's z has a dozen of them.
SAMPLES = 40
# An adaptive step ends at each sample, so that with many of them no tolerance may be too loose. A run with so few is
# made besides, and the larger of both errors counts.
SPARSE = 2
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
_GAIN = 0.4
# Errors of runs that are the same but for round-off differ by less than this part.
_SAME = 1e-6


@dataclass(frozen=True)
class Question:
    """What is swept.

    Attributes:
        scene: name of the scene.
        parameters: its parameters that differ from the defaults.
        until: length of every run [s].
        quantity: the observable that decides how far the sweep goes.
    """

    scene: str
    parameters: dict[str, float]
    until: float
    quantity: str

    @property
    def every(self) -> float:
        """Sampling interval [s]."""
        return float(f"{self.until / SAMPLES:.12g}")

    @property
    def sparse(self) -> float:
        """Sampling interval of the second run of an adaptive step [s]."""
        return float(f"{self.until / SPARSE:.12g}")

    def step(self, factor: float) -> float:
        """So many sampling intervals [s], without the digits that multiplying leaves (0.005000000000000001)."""
        return float(f"{self.every * factor:.12g}")

    def loaded(self) -> Scene:
        """The scene with these parameters."""
        return load_scene(self.scene, **self.parameters)


@dataclass
class CurvePoint:
    """One engine with complete settings on the scene.

    Attributes:
        case, result: the run.
        curves: observables of its trajectory; empty if there is none.
        errors: largest distance of each from the truth; with an adaptive step also over few samples.
        bars: error bars of the truth, by observable.
        dense: ``errors`` over the many samples alone.
        sparse: the run over few samples, with its errors; None with a fixed step, which samples do not change.
    """

    case: Case
    result: Result
    curves: dict[str, FloatArray] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    bars: dict[str, float] = field(default_factory=dict)
    dense: dict[str, float] = field(default_factory=dict)
    sparse: CurvePoint | None = None

    @property
    def step(self) -> float | None:
        """Value of the setting that trades speed for accuracy; None if there is none."""
        facts = self.case.engine
        return None if facts.resolution is None else float(facts.settings[facts.resolution])


@dataclass
class Curve:
    """One engine, formulation and preset over its range.

    Attributes:
        engine: ``name[formulation=…,preset=…]``.
        facts: with the preset's own step or tolerance.
        level: its rung on the ladder of models, or None if the engine does not tell.
        points: coarse first.
        dropped: step -> why there is no run with it.
    """

    engine: str
    facts: EngineFacts
    level: str | None
    points: list[CurvePoint] = field(default_factory=list)
    dropped: dict[float, str] = field(default_factory=dict)

    @property
    def fixed_step(self) -> bool:
        """Whether it is swept over steps rather than over tolerances."""
        return self.facts.resolution == "dt"

    def saturated(self, quantity: str) -> bool:
        """Whether the two loosest tolerances give the same run: something else than they limits its steps.

        Where an array happens to lie in memory may change the round-off of a run, so equal is equal up to that.
        """
        if self.fixed_step or len(self.points) < 2:
            return False
        loosest, other = (point.errors.get(quantity, np.inf) for point in self.points[:2])
        bar = self.points[0].bars.get(quantity, 0.0)
        return bool(np.isfinite(loosest) and abs(loosest - other) <= max(bar, _SAME * loosest))


def curves_of(
    engines: Iterable[str], workers: Workers | None = None, requires: frozenset[str] = frozenset()
) -> tuple[list[Curve], dict[str, str]]:
    """A curve without points for every formulation and preset of the engines, and why some engine has none.

    Args:
        engines: names, or ``name[key=value,…]`` for one formulation or setting; all that are installed if empty.
        workers: processes in which they are asked.
        requires: by the scene; formulations that provide nothing of it are for other kinds of scenes, and left out.
    """
    wanted: list[tuple[str, str | None]] = []
    absent: dict[str, str] = {}
    for text in list(engines) or engine_names():
        spec = parse_engine(text)
        try:
            described = describe(spec.name, workers)
        except InputError:
            raise
        except ProofrollError as error:
            absent[spec.name] = str(error)
            continue
        chosen, foreign = _chosen(spec, described, requires)
        if foreign:
            absent.setdefault(spec.name, "none of its formulations is for scenes of this kind")
        wanted += chosen
        if any(parse_engine(name).name == spec.name for name, _ in wanted):
            absent.pop(spec.name, None)
        elif spec.name not in absent:
            raise InputError("engine", text, f"{spec.name} has {', '.join(described['presets'])}")
    specs = [parse_engine(name) for name, _ in wanted]
    curves = []
    resolved = resolve([(spec.name, spec.options) for spec in specs], workers)
    for (name, level), facts in zip(wanted, resolved, strict=True):
        if isinstance(facts, InputError):
            raise facts
        if isinstance(facts, EngineFacts):
            curves.append(Curve(name, facts, level))
        else:
            absent[name] = str(facts)
    return curves, absent


def _chosen(
    spec: EngineSpec, described: Mapping[str, Any], requires: frozenset[str]
) -> tuple[list[tuple[str, str | None]], bool]:
    """Formulations and presets that a specification means, each with its level; whether some are for other scenes."""
    levels: Mapping[str, str] = described.get("levels", {})
    chosen: list[tuple[str, str | None]] = []
    foreign = False
    for formulation, presets in described["presets"].items():
        if spec.options.get("formulation", formulation) != formulation:
            continue
        if requires and not requires & set(described["provides"][formulation]):
            foreign = True
            continue
        for preset in presets:
            if spec.options.get("preset", preset) == preset:
                options = {"formulation": formulation, "preset": preset, **spec.options}
                inner = ",".join(f"{key}={value}" for key, value in options.items())
                chosen.append((f"{spec.name}[{inner}]", levels.get(formulation)))
    return chosen, foreign


Progress = Callable[[Case, Result], None]


def sweep(
    question: Question,
    curves: list[Curve],
    runner: Runner,
    progress: Progress | None = None,
    finer: Sequence[float] = FINER,
) -> dict[float, Reference]:
    """Fills the curves with points, and returns the truth by sampling interval.

    Every curve begins with the same steps. It is then extended to coarser ones until it breaks, and to ``finer`` ones,
    in sampling intervals, while they pay.
    """
    references: dict[float, Reference] = {}
    asked: list[set[float]] = [set() for _ in curves]
    for first in (True, False, False, False):
        wanted = [
            (index, value)
            for index, curve in enumerate(curves)
            for value in (
                _first(question, curve) if first else _further(question, curve, references, asked[index], finer)
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
        if now < (1 - _GAIN) * before:
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
    resolved = resolve([*options, ("truth", {})], runner.workers)
    truth_facts = resolved.pop()
    if not isinstance(truth_facts, EngineFacts):
        raise truth_facts
    cases: list[tuple[int, tuple[Case, ...]]] = []
    for (index, value), found in zip(wanted, resolved, strict=True):
        if not isinstance(found, EngineFacts):
            curves[index].dropped[value] = str(found)
            continue
        facts = found
        every = max(question.every, value) if facts.resolution == "dt" else question.every
        try:
            if facts.resolution == "dt":
                whole_steps(0.0, question.until, value)
        except InputError as error:
            curves[index].dropped[value] = str(error)
            continue
        cases.append((index, cases_of(question, scene, facts, every)))
    intervals = {question.every, *(case.every for _, both in cases for case in both)} - references.keys()
    truths = {every: case_of(question, scene, truth_facts, every) for every in intervals}
    results = runner.run([*truths.values(), *(case for _, both in cases for case in both)], progress)
    for every, case in truths.items():
        if results[case.key].status != Status.DONE:
            raise ProofrollError(f"there is no truth here: {results[case.key].message}")
        references[every] = Reference.read(scene, runner.store.trajectory(case))
    for index, both in cases:
        curves[index].points.append(judged([CurvePoint(case, results[case.key]) for case in both], references, runner))
    for curve in curves:
        curve.points.sort(key=lambda point: -(point.step or 0.0))


def case_of(question: Question, scene: Scene, facts: EngineFacts, every: float) -> Case:
    """One run of the question."""
    return Case(
        scene=question.scene,
        parameters={name: scene.parameters[name] for name in question.parameters},
        scene_digest=scene.digest,
        engine=facts,
        until=question.until,
        every=every,
        time_limit=60.0,
    )


def cases_of(question: Question, scene: Scene, facts: EngineFacts, every: float) -> tuple[Case, ...]:
    """The run of the question, and with an adaptive step the one over few samples."""
    adaptive = facts.resolution not in {None, "dt"}
    return tuple(
        case_of(question, scene, facts, interval) for interval in ((every, question.sparse) if adaptive else (every,))
    )


def judged(points: Sequence[CurvePoint], references: Mapping[float, Reference], runner: Runner) -> CurvePoint:
    """The point with its observables and their errors, if it has a trajectory that reached the end.

    Args:
        points: the run, and the one over few samples if there is one.
        references: the truth by sampling interval.
        runner: where the trajectories are.
    """
    point, *others = (_measured(point, references[point.case.every], runner) for point in points)
    if not others:
        return point
    (sparse,) = others
    reference = references[sparse.case.every]
    # What is derived from neighbouring samples, as an audit, is not compared where there are few.
    errors = {
        name: max(error, sparse.errors.get(name, np.inf)) if name in reference.dataset else error
        for name, error in point.errors.items()
    }
    return replace(point, errors=errors, dense=point.errors, sparse=sparse)


def _measured(point: CurvePoint, reference: Reference, runner: Runner) -> CurvePoint:
    if point.result.status != Status.DONE:
        return point
    curves = reference.observed(read(runner.store.trajectory(point.case)))
    errors, bars = {}, {}
    for name, curve in curves.items():
        true, bar = reference.true(name, curve)
        same = curve.shape == true.shape
        error = float(np.max(np.abs(curve - true), initial=0.0)) if same else np.inf
        errors[name], bars[name] = error if np.isfinite(error) else np.inf, bar
    return replace(point, curves=curves, errors=errors, bars=bars)
