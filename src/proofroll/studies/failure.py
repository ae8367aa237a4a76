"""Failures of runs, found in trajectories, and whether the engine reported them.

Signs of failure of one kind of element (a ball that left its wall) come from the elements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import BETWEEN, part
from proofroll.core.element_abilities import ExplainsErrors
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.running.case import Result, Status
from proofroll.running.recording import is_nonfinite_message
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference

if TYPE_CHECKING:
    import xarray as xr

# A run is accurate if the deciding observable is wrong by at most this part of its range.
ACCURATE = 0.01
# A run is stable if it is wrong by at most this part: beyond it a constant curve would be better.
WRONG = 1.0

DIVERGED, GAVE_UP, CRASHED = "diverged", "solver gave up", "crashed"
LOST_PHASE, TOO_SLOW, REFUSED, WRONG_MODEL = "lost phase", "too slow", "refused", "wrong model"
MEANINGS = {
    DIVERGED: "the state became NaN or overflowed",
    LOST_PHASE: "bounded, with no other sign of failure, but wrong",
    GAVE_UP: "the engine stopped and said why",
    CRASHED: "the engine's process ended",
    TOO_SLOW: "no result within the time that the map allows",
    REFUSED: "the engine said before the run that it cannot represent the scene",
    WRONG_MODEL: "the engine built a different scene",
}
# Failures of runs that were not made, or of another scene: they tell nothing about the boundaries.
NOT_RUN = frozenset({REFUSED, WRONG_MODEL})


def meanings(scene: Scene) -> Mapping[str, str]:
    """Every kind of failure that a run of the scene may show -> its meaning."""
    kinds = dict(MEANINGS)
    for element in scene.elements:
        kinds |= element.failures
    return kinds


@dataclass(frozen=True)
class RunOutcome:
    """Outcome of a run.

    Attributes:
        stable: True if the run reached the end without a sign of failure and its error stayed below the quantity's
            range.
        accurate: True if it is stable and the deciding observable was wrong by at most 1 % of its range; without a
            truth the same as stable.
        failure: first sign of failure, if it was not accurate.
        silent: True if it failed and the engine did not report it.
        error: largest error of the deciding observable, as a part of its range; None if unknown.
        time: of the failure [s].
        message: of the run.
    """

    stable: bool
    accurate: bool
    failure: str | None
    silent: bool
    error: float | None
    time: float | None
    message: str


@dataclass(frozen=True)
class Yardstick:
    """Sizes and limits by which a run counts as failed.

    Attributes:
        scene: the scene that was run.
        truth: the true run; None: there is none.
        name: of the deciding observable.
        true: its true values; None without a truth.
        scale: its range; with several components the widest.
    """

    scene: Scene
    truth: xr.Dataset | None
    name: str
    true: FloatArray | None
    scale: float

    @classmethod
    def of(cls, scene: Scene, truth: xr.Dataset | None) -> Yardstick:
        """Yardstick made from the truth; if there is none, from the scene alone."""
        name = scene.deciding
        if truth is None:
            return cls(scene, None, name, None, 1.0)
        true = truth[name].to_numpy()
        return cls(scene, truth, name, true, float(np.max(np.ptp(true, axis=0))) or 1.0)

    @cached_property
    def _reference(self) -> Reference:
        assert self.truth is not None  # else nothing asks
        return Reference.of(self.scene, self.truth)

    def another_scene(self, result: Result) -> str | None:
        """Reason why a run's model is another scene than was asked for; None without one, or without a truth."""
        return None if self.truth is None else self._reference.another_scene(result.certificate)

    def off_grid(self, dataset: xr.Dataset) -> FloatArray:
        """Largest error off the grid in the interval before each sample, as a part of the range; else 0."""
        errors = np.zeros(dataset.sizes["time"])
        comparable = self.truth is not None and BETWEEN in dataset and BETWEEN in self.truth
        pairs = run_values.off_grid(self._reference, self.name, dataset) if comparable else None
        if pairs is not None and len(pairs[0]):
            times, values, true = pairs
            wrong = np.abs(np.where(np.isfinite(true), values - true, 0.0)) / self.scale
            ends = np.minimum(np.searchsorted(dataset["time"].to_numpy(), times), len(errors) - 1)
            np.maximum.at(errors, ends, _worst(wrong))
        return errors


def run_outcome(result: Result, dataset: xr.Dataset | None, yardstick: Yardstick) -> RunOutcome:
    """Outcome of a run from its result and its trajectory, measured by the yardstick."""
    early = {
        Status.CRASHED: CRASHED,
        Status.TIMEOUT: TOO_SLOW,
        Status.REFUSED: REFUSED,
        Status.WRONG_MODEL: WRONG_MODEL,
    }
    another = yardstick.another_scene(result)
    if result.status in early or dataset is None or another:
        sign_before = early.get(result.status, WRONG_MODEL if another else GAVE_UP)
        return _failed(sign_before, replace(result, message=another or result.message), None, None)
    errors = _errors(dataset, yardstick)
    error = None if errors is None else float(np.max(errors, initial=0.0))
    sign = _first(dataset, yardstick, errors)
    if result.status == Status.DIVERGED:
        failure, time = sign or (None, None)
        if is_nonfinite_message(result.message) or (failure is None and "finite" in result.message):
            failure, time = DIVERGED, float(dataset["time"][-1])
        elif failure is None:
            failure, time = _by_event(dataset, yardstick.scene) or GAVE_UP, float(dataset["time"][-1])
        return _failed(failure, result, error, time, silent=is_nonfinite_message(result.message))
    if sign is not None:
        return _failed(sign[0], result, error, sign[1], silent=True)
    if errors is not None and yardstick.true is not None and len(errors) < len(yardstick.true):
        # The run ended early without an error, where its model left the scene.
        return _failed(_by_event(dataset, yardstick.scene) or GAVE_UP, result, error, float(dataset["time"][-1]))
    if errors is None or error is None or error <= ACCURATE:
        return RunOutcome(
            stable=True, accurate=True, failure=None, silent=False, error=error, time=None, message=result.message
        )
    index = int(np.argmax(errors > ACCURATE))
    return RunOutcome(
        stable=True,
        accurate=False,
        failure=_wrong(dataset, yardstick, errors, index),
        silent=True,
        error=error,
        time=None,
        message=result.message,
    )


def _by_event(dataset: xr.Dataset, scene: Scene) -> str | None:
    """Failure that an event of the run stands for, or None."""
    for element in scene.elements:
        for event in events_of(part(scene, element, dataset)):
            if event.kind in element.failing_events:
                return element.failing_events[event.kind]
    return None


def _failed(
    failure: str | None, result: Result, error: float | None, time: float | None, *, silent: bool = False
) -> RunOutcome:
    return RunOutcome(
        stable=False, accurate=False, failure=failure, silent=silent, error=error, time=time, message=result.message
    )


def _errors(dataset: xr.Dataset, yardstick: Yardstick) -> FloatArray | None:
    """Largest error of a component of the deciding observable at each sample, as a part of the range; shape (time,).

    A larger error off the grid, in the interval before the sample, takes its place.
    """
    if yardstick.true is None:
        return None
    values = dataset[yardstick.name].to_numpy()
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.abs(values - yardstick.true[: len(values)]) / yardstick.scale
        return np.maximum(_worst(errors), yardstick.off_grid(dataset))


def _worst(errors: FloatArray) -> FloatArray:
    """Largest component of each error, infinite where one is not finite; shape (time,)."""
    finite = np.where(np.isfinite(errors), errors, np.inf)
    return np.asarray(finite.reshape(len(errors), -1).max(axis=1, initial=0.0))


def _first(dataset: xr.Dataset, yardstick: Yardstick, errors: FloatArray | None) -> tuple[str, float] | None:
    """First sign of instability and its time [s]; None: the run is stable as far as it went."""
    times = dataset["time"].to_numpy()
    shown: dict[str, int] = {}
    scene, truth = yardstick.scene, yardstick.truth
    for element in scene.elements:
        true_part = None if truth is None else part(scene, element, truth)
        for sign in element.signs(part(scene, element, dataset), true_part):
            if np.any(sign.shown):
                index = int(np.argmax(sign.shown))
                shown[sign.name] = min(index, shown.get(sign.name, index))
    if errors is not None and np.any(errors > WRONG):
        index = int(np.argmax(errors > WRONG))
        if not shown or index < min(shown.values()):
            return _wrong(dataset, yardstick, errors, index), float(times[index])
    if not shown:
        return None
    failure = min(shown, key=lambda item: shown[item])
    return failure, float(times[shown[failure]])


def _wrong(dataset: xr.Dataset, yardstick: Yardstick, errors: FloatArray, index: int) -> str:
    """Cause of a bounded but wrong path at a sample, from the element of the deciding observable; else lost phase."""
    scene = yardstick.scene
    reached = dataset.isel(time=slice(0, index + 1))
    for element in scene.elements:
        decides = any(
            item.decides and scene.label(element, item.name) == yardstick.name for item in element.observables
        )
        if decides and isinstance(element, ExplainsErrors):
            cause = element.cause(part(scene, element, reached), float(errors[index]) * yardstick.scale)
            return cause or LOST_PHASE
    return LOST_PHASE
