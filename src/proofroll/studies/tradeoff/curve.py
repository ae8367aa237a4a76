"""Points and curves of a sweep with their errors, and the question of the sweep."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray, Vectors, largest_difference
from proofroll.core.convergence import envelope, is_floor
from proofroll.core.dataset import BETWEEN, off_impacts
from proofroll.core.engine import whole_steps
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.core.plugins import parse_engine
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grids, time_grid
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.runner import Runner
from proofroll.running.timing import Timing
from proofroll.studies.cases import case_of
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference
from proofroll.studies.tradeoff.records import Corner

if TYPE_CHECKING:
    import xarray as xr

# Sampling intervals per run; a dozen per oscillation of z in the first scene, stick_slip.
SAMPLES = 40
# Sampling intervals of a second run with an adaptive step, whose larger error counts. Steps end at each sample, so that
# with many samples even a loose tolerance gives short steps.
SPARSE = 2
# Relative difference of errors below which two runs differ by round-off only.
_SAME = 1e-6


@dataclass(frozen=True)
class Question:
    """Subject of a sweep.

    Attributes:
        scene: name of the scene.
        parameters: its parameters that differ from the defaults.
        until: length of every run [s].
        quantity: observable that decides how far the sweep goes.
        samples: sampling intervals per run, an even number.
    """

    scene: str
    parameters: dict[str, float]
    until: float
    quantity: str
    samples: int = SAMPLES

    @property
    def every(self) -> float:
        """Sampling interval [s]."""
        return float(f"{self.until / self.samples:.12g}")

    @property
    def sparse(self) -> float:
        """Sampling interval of the second run of an adaptive step [s]."""
        return float(f"{self.until / SPARSE:.12g}")

    def step(self, factor: float) -> float:
        """Step of ``factor`` sampling intervals [s], rounded to 12 digits (0.005 instead of 0.005000000000000001)."""
        return float(f"{self.every * factor:.12g}")

    def sampled_for(self, curves: Iterable[Curve]) -> Question:
        """The same, with an interval of whole steps of each curve that has one step, or a part of such a step.

        Raises:
            InputError: the step of a curve does not divide the length of the runs.
        """
        steps = [curve.facts.step for curve in curves if curve.fixed and curve.facts.step is not None]
        counts = [whole_steps(0.0, self.until, step) for step in steps]
        common = math.gcd(*counts)
        divisors = (number for number in range(self.samples, 2 * self.samples, 2) if common % number == 0)
        together = math.lcm(2, *counts)
        return replace(self, samples=next(divisors, together * math.ceil(self.samples / together)))

    @cached_property
    def loaded(self) -> Scene:
        """The scene with these parameters, read at the first access."""
        return load_scene(self.scene, **self.parameters)

    def case(self, facts: EngineFacts, every: float) -> Case:
        """Case of one run."""
        limit = STUDY_TIME_LIMIT
        return case_of(self.scene, self.loaded, self.parameters, facts, self.until, every, time_limit=limit)

    def cases(self, facts: EngineFacts, every: float) -> tuple[Case, ...]:
        """Cases of a point: its run and, with an adaptive step, a second run with few samples."""
        adaptive = facts.resolution not in {None, "dt"}
        return tuple(self.case(facts, interval) for interval in ((every, self.sparse) if adaptive else (every,)))

    def truth(self, facts: EngineFacts, runs: Collection[Case]) -> Case:
        """Case of the truth, with samples off the grid wherever the runs have them."""
        steps = [run.engine.step for run in runs if run.every == self.every]
        return replace(self.case(facts, self.every), between=off_grids(time_grid(self.until, self.every), steps))

    def reference(self, truth: xr.Dataset, every: float) -> Reference:
        """Reference with this sampling interval [s], taken from the samples of the truth with the shortest one."""
        if every != self.every:
            true_times, times = truth["time"].to_numpy(), time_grid(self.until, every)
            indices = np.abs(true_times[:, None] - times).argmin(axis=0)
            truth = truth.drop_dims(BETWEEN, errors="ignore").isel(time=indices)
        return Reference.of(self.loaded, truth)


@dataclass
class CurvePoint:
    """One engine with complete settings on the scene.

    Attributes:
        case, result: the run.
        curves: observable -> values of its trajectory; empty if there is none.
        errors: observable -> largest distance from the truth, that of ``sparse`` included.
        bars: observable -> error bar of the truth.
        scales: observable -> :meth:`proofroll.studies.judging.reference.Reference.scale`.
        vectors: observable -> :meth:`proofroll.studies.judging.reference.Reference.vectors`.
        dense: ``errors`` without those of ``sparse``.
        sparse: the run over few samples, with its errors; None with a fixed step, which samples do not change.
        timing: wall time per simulated second; None if it was not measured.
        corners: runs at the corners of a range of the scene's parameters; None if it was not checked there.
    """

    case: Case
    result: Result
    curves: dict[str, FloatArray] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    bars: dict[str, float] = field(default_factory=dict)
    scales: dict[str, float | None] = field(default_factory=dict)
    vectors: dict[str, Vectors] = field(default_factory=dict)
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
    """Error floor of a curve: with smaller steps the error grows, because each step rounds the state.

    Attributes:
        best: the most accurate run.
        error: of that run.
        scatter: change by the next smaller step.
    """

    best: CurvePoint
    error: float
    scatter: float


@dataclass
class Curve:
    """One engine, formulation and preset over its range of steps or tolerances.

    Attributes:
        engine: ``name[formulation=…,preset=…]``.
        facts: with the preset's own step or tolerance.
        points: coarse first.
        dropped: step -> why there is no run with it.
    """

    engine: str
    facts: EngineFacts
    points: list[CurvePoint] = field(default_factory=list)
    dropped: dict[float, str] = field(default_factory=dict)

    @property
    def fixed_step(self) -> bool:
        """True if the curve is swept over steps; False: over tolerances."""
        return self.facts.resolution == "dt"

    @property
    def fixed(self) -> bool:
        """True if the curve is one point: nothing can be refined, or the user gave the step or the tolerance."""
        resolution = self.facts.resolution
        return resolution is None or resolution in parse_engine(self.engine).options

    def setting(self, facts: EngineFacts) -> dict[str, Any]:
        """Values of the fields of :class:`SweptSetting` with the facts of one of its runs."""
        facts_shown = {
            name: getattr(facts, name) for name in ("settings", "resolution", "caveat", "family", "precision")
        }
        return {"engine": facts.name, "curve": self.engine, "level": facts.level or None} | facts_shown

    @property
    def tried(self) -> set[float | None]:
        """Steps or tolerances that were run or dropped."""
        return {point.step for point in self.points} | self.dropped.keys()

    def envelope(self, quantity: str) -> list[float]:
        """Envelope of the points' errors, see :func:`proofroll.core.convergence.envelope`.

        Errors at steps below the best one, which grow by round-off in single precision, do not count against larger
        steps.
        """
        errors, floor = [point.errors.get(quantity, np.inf) for point in self.points], self.floor(quantity)
        return envelope(errors, self.points.index(floor.best) if floor else None)

    def floor(self, quantity: str) -> Floor | None:
        """Error floor of single precision; None in double precision, or if no smaller step is clearly worse."""
        if self.facts.precision == "double" or not self.fixed_step:
            return None
        done = [point for point in self.points if np.isfinite(point.errors.get(quantity, np.inf))]
        used = [point for point in done if point.curves[quantity].shape == done[-1].curves[quantity].shape]
        changes = [
            largest_difference(a.curves[quantity], b.curves[quantity], a.vectors.get(quantity))
            for a, b in itertools.pairwise(used)
        ]
        if not changes or changes[-1] == min(changes):
            return None
        least = int(np.argmin(changes))
        errors = [point.errors[quantity] for point in done]
        best = done.index(used[least + 1])
        while best and errors[best - 1] <= errors[best]:  # take the coarsest step with as small an error
            best -= 1
        if not is_floor(errors[best:], done[best].scales.get(quantity)):
            return None
        return Floor(done[best], errors[best], changes[least + 1])

    def saturated(self, quantity: str) -> bool:
        """True if the two loosest tolerances give the same run, so that something else limits its steps.

        Runs count as the same up to round-off, which may depend on the place of arrays in memory.
        """
        if self.fixed_step or len(self.points) < 2:
            return False
        loosest, tighter = (point.errors.get(quantity, np.inf) for point in self.points[:2])
        bar = self.points[0].bars.get(quantity, 0.0)
        return bool(np.isfinite(loosest) and abs(loosest - tighter) <= max(bar, _SAME * loosest))


def judge_point(points: Sequence[CurvePoint], references: Mapping[float, Reference], runner: Runner) -> CurvePoint:
    """Point with its observables and their errors, if its run reached the end.

    Args:
        points: the run, and with an adaptive step the one over few samples.
        references: sampling interval [s] -> truth.
        runner: whose store has the trajectories.
    """
    done = (
        with_errors(point, references[point.case.every], runner.store.stored(point.case).dataset)
        if point.result.status == Status.DONE
        else point
        for point in points
    )
    point, *others = done
    if not others:
        return point
    (sparse,) = others
    reference = references[sparse.case.every]
    # Observables derived from neighbouring samples (audits) are not compared where samples are few.
    errors = {
        name: max(error, sparse.errors.get(name, np.inf)) if name in reference.dataset else error
        for name, error in point.errors.items()
    }
    return replace(point, errors=errors, dense=point.errors, sparse=sparse)


def with_errors(point: CurvePoint, reference: Reference, run: xr.Dataset) -> CurvePoint:
    """Point with its observables and their errors; the error of an event is at least half the width of its bracket."""
    run = off_impacts(reference.scene, reference.dataset, {0: run})[0]
    observed = run_values.observables_of(reference, run)
    curves = {name: values for name, values in observed.items() if np.isfinite(reference.true(name, values).error_bar)}
    return replace(
        point,
        curves=curves,
        errors={
            name: max(run_values.error(reference, name, curve, run), reference.own_bar(name, run))
            for name, curve in curves.items()
        },
        bars={name: reference.true(name, curve).error_bar for name, curve in curves.items()},
        scales={name: reference.scale(name) for name in curves},
        vectors={name: reference.vectors(name) for name in curves},
    )
