"""The question of an answer: scene, duration and samples, and its cases."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from proofroll.core.dataset import BETWEEN
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grids, time_grid, whole_intervals
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import is_scene, load_scene, read_scene_file
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.runner import Runner
from proofroll.studies.cases import case_of, require_length
from proofroll.studies.comparison.planning import with_edges
from proofroll.studies.judging.reference import Reference

# Length of the runs of a scene whose file has no duration [s].
USUAL = 2.0
# Fewest and most sampling intervals of a run: enough to see its largest error, few enough to end few steps.
_FEWEST, _MOST = 80, 400
# Sampling intervals of the second run of a scheme that adapts its steps.
_SPARSE = 2
# Limit of the truth's wall time [s].
_TRUTH_LIMIT = 600.0
# Times that a question is made shorter until it is well-posed.
_SHORTER = 3
# Halvings of the sampling interval at whose off-grid times the truth has samples, too.
_HALVINGS = 12


def duration_of(scene: str, usual: float = USUAL) -> float:
    """Length of the runs of a scene [s]: its file's duration, or the usual one."""
    return read_scene_file(scene).duration or usual


def sampling_of(scene: str, until: float) -> float:
    """Sampling interval of a run [s]: 1, 2 or 5 times a power of ten that divides it into 80 to 400 intervals.

    Where none does it is a hundredth; a file that gives an interval has a multiple of it.
    """
    if (base := read_scene_file(scene).every) is not None:
        return float(f"{base * max(1, round(until / 100 / base)):.12g}")
    power = math.floor(math.log10(until))
    choices = [digit * 10.0**exponent for exponent in range(power, power - 5, -1) for digit in (5, 2, 1)]
    for every in choices:
        count = until / every
        if _FEWEST * (1 - 1e-9) <= count <= _MOST and abs(count - round(count)) < 1e-9 * count:
            return float(f"{every:.12g}")
    return float(f"{until / 100:.12g}")


@dataclass(frozen=True)
class AnswerQuestion:
    """Scene, duration and samples of an answer.

    Attributes:
        scene: name of the scene.
        parameters: its parameters that differ from the defaults.
        until: length of every run [s].
        every: sampling interval [s].
        whole: step whose multiples the samples are [s]; None: any steps are run.
        beyond: clause on why no longer run can be judged; empty: as long was asked for.
    """

    scene: str
    parameters: dict[str, float]
    until: float
    every: float
    whole: float | None = None
    beyond: str = ""

    @classmethod
    def of(cls, scene: str, parameters: dict[str, float], until: float | None = None) -> AnswerQuestion:
        """Question about a scene, whose runs end with a whole interval between samples, so that any part divides it.

        Args:
            scene: name of the scene.
            parameters: values that differ from the defaults.
            until: length of the runs [s]; None: the scene's own duration.

        Raises:
            InputError: a time makes no sense.
        """
        until = duration_of(scene) if until is None else until
        time_grid(until, until or 1.0)
        require_length(until)
        every = sampling_of(scene, until)
        end = float(f"{every * whole_intervals(until, every):.12g}")
        until = end if 0 < end < until - 1e-6 * every else until
        return cls(scene, parameters, until, every)

    def sampled_for(self, step: float | None) -> AnswerQuestion:
        """The same with samples at whole steps of a given one, of its double and of four times it.

        The runs end with such a step.

        Args:
            step: step [s]; None: it adapts, and the samples stay.

        Raises:
            InputError: the step is longer than a quarter of the runs.
        """
        if step is None:
            return self
        longest = 4 * step
        if not 0 < longest <= self.until:
            raise InputError("dt", step, f"give a positive step of at most a quarter of the {self.until:g} s")
        every = float(f"{longest * max(1, round(self.until / 100 / longest)):.12g}")
        return replace(
            self, until=float(f"{longest * whole_intervals(self.until, longest):.12g}"), every=every, whole=step
        )

    @cached_property
    def loaded(self) -> Scene:
        """The scene with these parameters, read at the first access."""
        return load_scene(self.scene, **self.parameters)

    @property
    def sparse(self) -> float:
        """Sampling interval of the second run of a scheme that adapts its steps [s]."""
        return float(f"{self.until / _SPARSE:.12g}")

    def case(self, facts: EngineFacts, every: float, limit: float, judged: Collection[str]) -> Case:
        """Case of one run; ``limit``: of its wall time [s]; ``judged``: observables."""
        events = {name for name, item in self.loaded.observables.items() if item.role is Role.EVENT}
        named = self.scene, self.loaded, self.parameters
        return case_of(*named, facts, self.until, every, time_limit=limit, without_events=events.isdisjoint(judged))

    def truth(self, facts: EngineFacts) -> Case:
        """Case of the truth, with samples off the grid where runs have theirs."""
        scene, between = self.loaded.fully_asked, off_grids(time_grid(self.until, self.every), _steps(self.every))
        return case_of(
            self.scene, scene, self.parameters, facts, self.until, self.every, time_limit=_TRUTH_LIMIT, between=between
        )

    def well_posed(self, facts: EngineFacts, runner: Runner) -> tuple[AnswerQuestion, dict[float, Reference]]:
        """The question over the time in which it is well-posed, and its truths by sampling interval [s].

        Args:
            facts: of the truth.
            runner: runs it.

        Raises:
            ProofrollError: there is no truth.
        """
        question, references = self, self.references(facts, runner)
        for _ in range(_SHORTER):
            reference = references[question.every]
            horizon = float(reference.dataset.attrs.get("horizon", math.inf))
            if not 0 < horizon <= question.until:
                break
            # a horizon may be found at a sample only, one interval late
            sure = max(horizon - question.every, horizon / 2)
            shorter = AnswerQuestion.of(self.scene, self.parameters, _rounded_down(sure)).sampled_for(self.whole)
            question = replace(shorter, beyond=question.beyond or reference.ill_posed)
            references = question.references(facts, runner)
        return question, references

    def references(self, facts: EngineFacts, runner: Runner) -> dict[float, Reference]:
        """Sampling interval [s] -> truth.

        Raises:
            ProofrollError: there is no truth.
        """
        case = self.truth(facts)
        result = runner.run([case])[case.key]
        if result.status is not Status.DONE:
            raise ProofrollError(f"there is no truth here: {result.message}")
        dataset = runner.store.stored(case).dataset
        times, sparse = dataset["time"].to_numpy(), time_grid(self.until, self.sparse)
        sparse = sparse[sparse <= times[-1] * (1 + 1e-9)]
        indices = np.unique(np.abs(times[:, None] - sparse).argmin(axis=0))
        few = dataset.drop_dims(BETWEEN, errors="ignore").isel(time=indices)
        pairs = (self.every, dataset), (self.sparse, few)
        return {every: Reference.of(self.loaded, data, self.every) for every, data in pairs}


def question_named(name: str, parameters: Mapping[str, object], until: float | None = None) -> AnswerQuestion:
    """Question about a scene, or about the first brief point of a comparison; what is given counts more.

    Args:
        name: of a scene, of a comparison, or the path of either or of a robot file.
        parameters: values of parameters, as text or numbers.
        until: length of the runs [s]; None: the duration of the scene's file, or else that of the comparison, or 2 s.

    Raises:
        InputError: there is neither, or a value makes no sense.
    """
    scene, point = name, dict(parameters)
    if not is_scene(name):
        comparison = with_edges(load_comparison(name).briefly())
        scene = comparison.scene
        point = {**next(iter(comparison.combinations())), **point}
        until = until or duration_of(scene, comparison.until)
    loaded = load_scene(scene, **point)  # type: ignore[arg-type]  # text is checked and converted there
    return AnswerQuestion.of(scene, {key: loaded.parameters[key] for key in point}, until)


def _rounded_down(seconds: float) -> float:
    """A time with two digits, not above the given one [s]."""
    unit = 10.0 ** (math.floor(math.log10(seconds)) - 1)
    return float(f"{math.floor(seconds / unit) * unit:.12g}")


def _steps(every: float) -> Iterator[float | None]:
    """Steps that a search may run, as far as they have times of their own off the grid, and None: an adapted step."""
    yield None
    for halving in range(_HALVINGS):
        yield from (float(f"{every / (factor * 2**halving):.12g}") for factor in (1, 3, 5))
