"""Runs the ladder of models for one quantity, and every optional term switched on and off."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import observe
from proofroll.core.errors import InputError, Refused, require_known
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.core.observable import Role
from proofroll.core.plugins import engine_names
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grids, time_grid
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import describe_each, on_scene, resolve, resolve_with_truth
from proofroll.running.process import status_of
from proofroll.running.runner import Runner
from proofroll.running.timing import ROUNDS, Timing, time_in_rounds
from proofroll.studies.cases import case_of, length_of, require_length
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference
from proofroll.studies.ladder.models import LadderModel, Rung, Switch, rungs, switches

if TYPE_CHECKING:
    import xarray as xr

_EVERY = 0.02  # sampling interval [s], as in the comparison files


@dataclass(frozen=True)
class ModelAnswer:
    """Result of one model.

    Attributes:
        case: the requested run; None if its settings are invalid or its engine is missing.
        result: of the run.
        values: of the quantity, or None.
        run: its trajectory, if it reached the end.
        timing: wall time per simulated second, or None if it could not be timed.
    """

    case: Case | None
    result: Result
    values: FloatArray | None = None
    run: xr.Dataset | None = None
    timing: Timing | None = None


class Ladder:
    """Plans, runs and times the models; :func:`proofroll.report.ladder.ladder_content` reports the results.

    Attributes:
        ladder, switches: models to run and terms to switch.
        answers: :func:`key_of` a model -> its result.
        truths: text of the parameters that a switch changes -> the truth with them.
        engines: facts of every engine, or the error in asking it.

    Args:
        scene: name or path.
        parameters: of the scene, those that differ from the defaults.
        runner: runs the cases.
        quantity: observable; None: the one that decides the scene.
        until: last time [s]; None: the usual length.
        tolerance: of the quantity, in its unit; None: a term counts if it changes the quantity by more than the smaller
            of the errors with and without it.
        engines: names; all that are installed if empty.
        rounds: of the timing; None: the usual number.

    Raises:
        InputError: an argument names something unknown or makes no sense.
        Refused: the scene has no truth.
    """

    def __init__(
        self,
        scene: str,
        parameters: dict[str, Any],
        runner: Runner,
        *,
        quantity: str | None = None,
        until: float | None = None,
        tolerance: float | None = None,
        engines: Sequence[str] = (),
        rounds: int | None = None,
    ) -> None:
        until = length_of(scene, until)
        require_length(until)
        if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0):
            raise InputError("tolerance", tolerance, "give a positive number in the unit of the quantity")
        self._name, self._runner, self.until = scene, runner, until
        self.tolerance, self._rounds = tolerance, rounds or ROUNDS
        self.scene = load_scene(scene, **parameters)
        self._given = {name: self.scene.parameters[name] for name in parameters}
        curves = [name for name, item in self.scene.observables.items() if item.role != Role.EVENT]
        self.quantity = quantity or self.scene.deciding
        require_known("quantity", self.quantity, curves)
        self.unit = self.scene.observables[self.quantity].unit
        self.engines = describe_each(engines or engine_names(), runner.workers)
        for error in self.engines.values():
            if isinstance(error, InputError):
                raise error
        _, self._truth_facts = resolve_with_truth([], runner.workers)
        self.truths: dict[str, Reference] = {}
        self.answers: dict[str, ModelAnswer] = {}
        self.ladder: list[Rung] = rungs(self.engines, self.scene.requires)
        self.switches: list[Switch] = []

    def run(self, progress: Callable[[str], None] = lambda _: None) -> None:
        """Runs every model once, reusing stored results, then times all of them in rounds."""
        self._run_truths([{}], progress)
        self.switches = switches(self.ladder, self.engines, self.scene, self.truths[str({})].dataset)
        asked = [rung.model for rung in self.ladder] + [m for s in self.switches for m in (s.on, s.off)]
        models = {key_of(model): model for model in asked if model is not None}
        self._run_truths([dict(s.on.parameters) for s in self.switches if s.on is not None], progress)
        facts = resolve([(model.engine, model.options) for model in models.values()], self._runner.workers)
        cases: dict[str, Case] = {}
        for (key, model), engine_facts in zip(models.items(), facts, strict=True):
            if isinstance(engine_facts, EngineFacts):
                cases[key] = self._case(engine_facts, model)
            else:
                self.answers[key] = ModelAnswer(None, Result(status_of(engine_facts), str(engine_facts)))
        results = self._runner.run(cases.values(), lambda case, _: progress(case.engine.name))
        for key, case in cases.items():
            self.answers[key] = self._answer(models[key], case, results[case.key])
        self._time(progress)

    def _case(self, facts: EngineFacts, model: LadderModel) -> Case:
        parameters = self._given | dict(model.parameters)
        scene = load_scene(self._name, asks=model.asks, **parameters)
        return case_of(self._name, scene, parameters, facts, self.until, _EVERY, time_limit=STUDY_TIME_LIMIT)

    def _run_truths(self, points: Sequence[dict[str, float]], progress: Callable[[str], None]) -> None:
        points = [point for point in points if str(point) not in self.truths]
        # The steps of the models are not known yet: assume adaptive ones, and simple fractions of the interval.
        off_grid = off_grids(time_grid(self.until, _EVERY), [None, _EVERY / 2, _EVERY / 4, _EVERY / 5])
        cases = {
            str(point): dataclasses.replace(
                self._case(self._truth_of(point), LadderModel("truth", {}, point)), between=off_grid
            )
            for point in points
        }
        results = self._runner.run(cases.values(), lambda *_: progress("truth"))
        for point in points:
            case = cases[str(point)]
            result = results[case.key]
            if result.status != Status.DONE:
                raise Refused(f"there is no truth of this scene: {result.message}")
            reference = Reference.of(self._scene_at(point), self._runner.store.stored(case).dataset)
            if self.quantity not in reference.curves:
                raise Refused(f"the truth of this scene has no {self.quantity}")
            self.truths[str(point)] = reference

    def _truth_of(self, point: Mapping[str, float]) -> EngineFacts:
        return on_scene(self._truth_facts, self._scene_at(point), self._runner.workers)

    def _scene_at(self, point: Mapping[str, float]) -> Scene:
        return load_scene(self._name, **(self._given | dict(point)))

    def _answer(self, model: LadderModel, case: Case, result: Result) -> ModelAnswer:
        if result.status != Status.DONE:
            return ModelAnswer(case, result)
        run = self._runner.store.stored(case).dataset
        curves = observe(self._scene_at(model.parameters), run)
        return ModelAnswer(case, result, curves.get(self.quantity), run)

    def bar(self, point: dict[str, float]) -> float:
        """Error bar of the true quantity, with these parameters of the scene changed."""
        reference = self.truths[str(point)]
        return reference.true(self.quantity, reference.curves[self.quantity]).error_bar

    def error(self, model: LadderModel, point: dict[str, float]) -> float | None:
        """Largest distance of a model from the truth with these parameters changed; None: no answer."""
        answer = self.answers[key_of(model)]
        if answer.values is None or answer.run is None:
            return None
        return run_values.error(self.truths[str(point)], self.quantity, answer.values, answer.run)

    def _time(self, progress: Callable[[str], None]) -> None:
        timed = {key: answer.case for key, answer in self.answers.items() if answer.values is not None}
        speed = self._runner.workers.speed
        timings = time_in_rounds(
            {key: partial(speed, case) for key, case in timed.items() if case is not None},
            self._rounds,
            lambda _: progress("timing"),
        )
        for key, timing in timings.items():
            self.answers[key] = dataclasses.replace(self.answers[key], timing=timing)


def key_of(model: LadderModel) -> str:
    """Text that identifies a model."""
    return repr((model.engine, sorted(model.options.items()), sorted(model.parameters.items()), model.asks))
