"""Points and curves of a sweep with their errors, and the question that they answer."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray, largest_difference
from proofroll.core.convergence import is_floor
from proofroll.core.dataset import BETWEEN
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grids, time_grid
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.runner import Runner
from proofroll.running.timing import Timing
from proofroll.studies.cases import case_of
from proofroll.studies.judging import held_against
from proofroll.studies.judging.reference import Reference
from proofroll.studies.tradeoff.pareto import envelope
from proofroll.studies.tradeoff.records import Corner

if TYPE_CHECKING:
    import xarray as xr

# Samples per run. An oscillation of the founding scene's z has a dozen of them.
SAMPLES = 40
# An adaptive step ends at each sample, so that with many of them no tolerance may be too loose. A run with so few is
# made besides, and the larger of both errors counts.
SPARSE = 2
# Errors of runs that are the same but for round-off differ by less than this part.
_SAME = 1e-6


@dataclass(frozen=True)
class Question:
    """Subject of a sweep.

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
        """Step of several sampling intervals [s], without digits that multiplying leaves (0.005000000000000001)."""
        return float(f"{self.every * factor:.12g}")

    @cached_property
    def loaded(self) -> Scene:
        """The scene with these parameters, read when it is first asked for."""
        return load_scene(self.scene, **self.parameters)

    def case(self, scene: Scene, facts: EngineFacts, every: float, time_limit: float = STUDY_TIME_LIMIT) -> Case:
        """One run, on the loaded scene."""
        return case_of(self.scene, scene, self.parameters, facts, self.until, every, time_limit=time_limit)

    def cases(self, scene: Scene, facts: EngineFacts, every: float) -> tuple[Case, ...]:
        """Cases of a point: its run; of an adaptive step also one with sparse samples."""
        adaptive = facts.resolution not in {None, "dt"}
        return tuple(self.case(scene, facts, each) for each in ((every, self.sparse) if adaptive else (every,)))

    def truth(self, scene: Scene, facts: EngineFacts, runs: Collection[Case]) -> Case:
        """Case of the truth, known wherever the runs are sampled."""
        steps = [run.engine.step for run in runs if run.every == self.every]
        return replace(self.case(scene, facts, self.every), between=off_grids(time_grid(self.until, self.every), steps))

    def reference(self, scene: Scene, truth: xr.Dataset, every: float) -> Reference:
        """The truth at a sampling interval [s], from that at the shortest one, which has all its times."""
        if every != self.every:
            known, times = truth["time"].to_numpy(), time_grid(self.until, every)
            places = np.abs(known[:, None] - times).argmin(axis=0)
            truth = truth.drop_dims(BETWEEN, errors="ignore").isel(time=places)
        return Reference.of(scene, truth)


@dataclass
class CurvePoint:
    """One engine with complete settings on the scene.

    Attributes:
        case, result: the run.
        curves: observables of its trajectory; empty if there is none.
        errors: largest distance of each from the truth; with an adaptive step also over few samples.
        bars: error bars of the truth, by observable.
        scales: see :meth:`proofroll.studies.judging.reference.Reference.scale`, by observable.
        dense: ``errors`` over the many samples alone.
        sparse: the run over few samples, with its errors; None with a fixed step, which samples do not change.
        timing: of the run, wall seconds per simulated second; None where it is not measured.
        corners: the runs at the corners of a range of the scene's parameters; None where it was not checked there.
    """

    case: Case
    result: Result
    curves: dict[str, FloatArray] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    bars: dict[str, float] = field(default_factory=dict)
    scales: dict[str, float | None] = field(default_factory=dict)
    dense: dict[str, float] = field(default_factory=dict)
    sparse: CurvePoint | None = None
    timing: Timing | None = None
    corners: list[Corner] | None = None

    @property
    def step(self) -> float | None:
        """Value of the setting that trades speed for accuracy; None if there is none."""
        facts = self.case.engine
        return None if facts.resolution is None else float(facts.settings[facts.resolution])


class Floor(NamedTuple):
    """Floor of a curve, below which its runs come no closer because each step rounds the state.

    Attributes:
        best: the most accurate run; those with smaller steps are worse.
        error: of that run.
        scatter: change by the next smaller step.
    """

    best: CurvePoint
    error: float
    scatter: float


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
        """True if it is swept over steps rather than over tolerances."""
        return self.facts.resolution == "dt"

    @property
    def tried(self) -> set[float | None]:
        """Steps or tolerances with which there is a run, or why there is none."""
        return {point.step for point in self.points} | self.dropped.keys()

    def envelope(self, quantity: str) -> list[float]:
        """Envelope of the points' errors, see :func:`proofroll.studies.tradeoff.pareto.envelope`.

        Below the best step the round-off of single precision grows; that counts against no larger step.
        """
        errors, floor = [point.errors.get(quantity, np.inf) for point in self.points], self.floor(quantity)
        last = self.points.index(floor.best) + 1 if floor else len(errors)
        return envelope(errors[:last]) + errors[last:]

    def floor(self, quantity: str) -> Floor | None:
        """Floor at which smaller steps become worse in single precision; None: double, or none is clearly worse."""
        if self.facts.precision == "double" or not self.fixed_step:
            return None
        done = [point for point in self.points if np.isfinite(point.errors.get(quantity, np.inf))]
        used = [point for point in done if point.curves[quantity].shape == done[-1].curves[quantity].shape]
        changes = [largest_difference(a.curves[quantity], b.curves[quantity]) for a, b in itertools.pairwise(used)]
        if not changes or changes[-1] == min(changes):
            return None
        least = int(np.argmin(changes))
        errors = [point.errors[quantity] for point in done]
        best = done.index(used[least + 1])
        while best and errors[best - 1] <= errors[best]:  # an error that cancels at one step alone is not reached
            best -= 1
        if not is_floor(errors[best:], done[best].scales.get(quantity)):
            return None
        return Floor(done[best], errors[best], changes[least + 1])

    def saturated(self, quantity: str) -> bool:
        """True if the two loosest tolerances give the same run, so that something else limits its steps.

        Where an array happens to lie in memory may change the round-off of a run, so equal is equal up to that.
        """
        if self.fixed_step or len(self.points) < 2:
            return False
        loosest, other = (point.errors.get(quantity, np.inf) for point in self.points[:2])
        bar = self.points[0].bars.get(quantity, 0.0)
        return bool(np.isfinite(loosest) and abs(loosest - other) <= max(bar, _SAME * loosest))


def judged(points: Sequence[CurvePoint], references: Mapping[float, Reference], runner: Runner) -> CurvePoint:
    """The point with its observables and their errors, if it has a trajectory that reached the end.

    ``points`` are the run, and the one over few samples if there is one; the truth is known by sampling interval.
    """
    done = (
        measured(point, references[point.case.every], read(runner.store.trajectory(point.case)))
        if point.result.status == Status.DONE
        else point
        for point in points
    )
    point, *others = done
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


def measured(point: CurvePoint, reference: Reference, run: xr.Dataset) -> CurvePoint:
    """The point with its observables and their errors; an event in a wide bracket is as wrong as that is half wide."""
    given = held_against.observed(reference, run)
    curves = {name: values for name, values in given.items() if np.isfinite(reference.true(name, values)[1])}
    return replace(
        point,
        curves=curves,
        errors={
            name: max(held_against.error(reference, name, curve, run), reference.own_bar(name, run))
            for name, curve in curves.items()
        },
        bars={name: reference.true(name, curve)[1] for name, curve in curves.items()},
        scales={name: reference.scale(name) for name in curves},
    )
