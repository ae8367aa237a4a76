"""A run held against the truth: its errors, the time until which they are small, and its cost."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray, largest_difference, magnitudes
from proofroll.core.observable import Role
from proofroll.running.case import Case, Result, Status
from proofroll.running.store import Store
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference

REFUSALS = frozenset({Status.REFUSED, Status.WRONG_MODEL})


@dataclass(frozen=True)
class JudgedRun:
    """One run of a setting as a search sees it.

    Attributes:
        step: its step [s] or tolerance; 0 if it has neither.
        status: of the run.
        message: sentence about its end.
        cost: processor time inside ``advance`` per simulated second; infinite if nothing was advanced.
        spent: processor time of the run in all, its build included [s].
        reached: time of its last sample [s].
        errors: observable -> largest distance from the truth; infinite unless the run reached the end.
        growth: observable -> largest distance up to each of the ``times``.
        times: of the samples [s].
        curves: observable -> values of the run.
        true: observable -> true values.
    """

    step: float
    status: Status
    message: str = ""
    cost: float = math.inf
    spent: float = 0.0
    reached: float = 0.0
    errors: Mapping[str, float] = field(default_factory=dict)
    growth: Mapping[str, FloatArray] = field(default_factory=dict)
    times: FloatArray = field(default_factory=lambda: np.zeros(0))
    curves: Mapping[str, FloatArray] = field(default_factory=dict)
    true: Mapping[str, FloatArray] = field(default_factory=dict)

    def of_allowed(self, allowed: Mapping[str, float]) -> float | None:
        """Largest error over what is allowed; infinite without a result; None: a quantity is not reported."""
        if self.status is not Status.DONE:
            return math.inf
        if not allowed.keys() <= self.errors.keys():
            return None
        return max((self.errors[name] / bound for name, bound in allowed.items()), default=0.0)

    def worst(self, allowed: Mapping[str, float]) -> str:
        """Quantity whose error is the largest part of what is allowed; empty without one."""
        return max(
            (name for name in allowed if name in self.errors), key=lambda name: self.errors[name] / allowed[name],
            default="",
        )  # fmt: skip

    def held_until(self, allowed: Mapping[str, float]) -> float:
        """Time of the last sample up to which every error is within what is allowed [s]."""
        ends = []
        for name in allowed.keys() & self.growth.keys():
            growth, bound = self.growth[name], allowed[name]
            times = self.times[len(self.times) - len(growth) :]
            count = int(np.searchsorted(growth, bound, side="right"))
            ends.append(float(times[count - 1]) if count else 0.0)
        return min(ends, default=0.0)

    def with_sparse(self, sparse: JudgedRun) -> JudgedRun:
        """The run with the larger error of it and of the same setting over few samples, at which no step has to end.

        If that one failed, so has this.
        """
        spent = self.spent + sparse.spent
        if sparse.status is not Status.DONE:
            message = f"sampled seldom: {sparse.message}"
            return replace(self, status=sparse.status, message=message, spent=spent)
        errors = {name: max(error, sparse.errors.get(name, 0.0)) for name, error in self.errors.items()}
        return replace(self, errors=errors, spent=spent)


def judged_run(case: Case, result: Result, reference: Reference, store: Store) -> JudgedRun:
    """A finished case held against the truth; ``reference``: of the case's samples."""
    step = float(case.engine.settings[case.engine.resolution]) if case.engine.resolution else 0.0
    spent = case.time_limit if result.status is Status.TIMEOUT else sum(result.processor.values())
    run = JudgedRun(step, result.status, result.message, spent=spent)
    if result.trajectory is None:
        return run
    if another := reference.another_scene(result.certificate):
        return replace(run, status=Status.ANOTHER_SCENE, message=another)
    dataset = store.stored(case).dataset
    reached = float(dataset.variables["time"].values[-1])
    cost = result.processor.get("advance", 0.0) / reached if reached > 0 else math.inf
    whole = result.status is Status.DONE
    errors, growth, curves, true_values = errors_of(dataset, reference, whole=whole)
    times = dataset.variables["time"].values
    longest = max(map(len, growth.values()), default=0)
    return replace(
        run,
        cost=cost,
        reached=reached,
        errors=errors,
        growth=growth,
        times=times[:longest] if longest and len(times) > longest + 1 else times,
        curves=curves,
        true=true_values,
    )


def errors_of(
    dataset: Any, reference: Reference, *, whole: bool
) -> tuple[dict[str, float], dict[str, FloatArray], dict[str, FloatArray], dict[str, FloatArray]]:
    """Errors, their growth, values and true values of a run by observable; ``whole``: the run reached its end."""
    if whole:
        reference, runs = reference.common_span({0: dataset})
        dataset = runs[0]
    errors: dict[str, float] = {}
    growth: dict[str, FloatArray] = {}
    curves: dict[str, FloatArray] = {}
    true_values: dict[str, FloatArray] = {}
    for name, values in run_values.observables_of(reference, dataset).items():
        true = reference.true(name, values)
        if not math.isfinite(true.error_bar):
            continue
        count = min(len(values), len(true.values))
        alike = values.shape[1:] == true.values.shape[1:]
        if count and alike and reference.scene.observables[name].role is not Role.EVENT:
            apart = magnitudes(values[:count] - true.values[:count], reference.vectors(name)).max(axis=1, initial=0.0)
            growth[name] = np.maximum.accumulate(np.where(np.isfinite(apart), apart, np.inf))
        if whole:
            bar = reference.own_bar(name, dataset)
            errors[name] = max(run_values.error(reference, name, values, dataset), bar)
            curves[name], true_values[name] = values, true.values
        else:
            errors[name] = math.inf
    return errors, growth, curves, true_values


def least_of_limit(runs: tuple[JudgedRun, JudgedRun, JudgedRun], allowed: Mapping[str, float]) -> float:
    """Least error over what is allowed that the limit of small steps can have, from runs each with half the step.

    Changes that fall by a factor go on falling by at least that factor, or by 2 if it is smaller; twice their sum is
    taken off the distance of the finest run from the truth. 0 if the changes do not fall.
    """
    least = 0.0
    for name, bound in allowed.items():
        if any(name not in run.curves for run in runs):
            return 0.0
        coarse, middle, fine = (run.curves[name] for run in runs)
        change, next_change = largest_difference(coarse, middle), largest_difference(middle, fine)
        off = largest_difference(fine, runs[-1].true[name])
        if not all(map(math.isfinite, (change, next_change, off))):
            return 0.0
        fall = next_change / change if change else 0.0
        if fall >= _FALLS:
            continue
        factor = max(fall, 0.5)
        least = max(least, (off - 2 * next_change * factor / (1 - factor)) / bound)
    return least


# Largest ratio of two changes, one after the other, that counts as falling.
_FALLS = 0.75
