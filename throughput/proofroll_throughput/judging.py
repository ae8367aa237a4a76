"""Errors of copies: each is held against the truth of its own value of the parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from proofroll import InputError, Refused
from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import columns_of, off_grid_apart
from proofroll.core.engine import Sample
from proofroll.core.scene import Scene
from proofroll.running.case import Case, EngineFacts
from proofroll.running.engine_questions import on_scene, resolve
from proofroll.running.runner import Runner
from proofroll.studies.answer.judged_run import errors_of
from proofroll.studies.judging.reference import Reference


@dataclass(frozen=True)
class JudgedCopies:
    """Copies of one scene with the same bits.

    Attributes:
        index: of the scene.
        copies: their numbers.
        states: arrays of their states, with the times as first axis.
        error: largest distance from the truth; None: a state is not finite.
        failure: sentence with which a run ended early; empty: none did.
    """

    index: int
    copies: list[int]
    states: Mapping[str, FloatArray]
    error: float | None
    failure: str = ""


def references_of(
    scenes: Sequence[Scene], values: Sequence[float], parameter: str, runner: Runner, case: Callable[..., Case]
) -> list[Reference]:
    """Truth of each scene.

    Args:
        scenes: with one value of the parameter each.
        values: of the parameter.
        parameter: its name.
        runner: of the truths, which reuses stored ones.
        case: makes a case of a scene, of facts of an engine and of further fields.

    Raises:
        Refused: a scene has no truth.
        InputError: a truth ends before the runs do.
    """
    (facts,) = resolve([("truth", {})], runner.workers)
    if not isinstance(facts, EngineFacts):
        raise facts
    cases = [case(scene, on_scene(facts, scene, runner.workers), turns=True) for scene in scenes]
    results = runner.run(cases)
    references = []
    for scene, value, asked in zip(scenes, values, cases, strict=True):
        result = results[asked.key]
        if result.trajectory is None:
            raise Refused(f"there is no truth for {parameter} = {value:g}: {result.message}")
        reference = Reference.of(scene, runner.store.stored(asked).dataset)
        if reference.ended:
            advice = f"with {parameter} = {value:g} {reference.ended}; end the runs sooner, or take a smaller range"
            raise InputError("--until", asked.until, advice)
        references.append(reference)
    return references


def judged_copies(
    groups: Sequence[Mapping[str, Any]],
    folder: Path,
    references: Sequence[Reference],
    times: tuple[FloatArray, FloatArray],
    quantity: str,
) -> list[JudgedCopies]:
    """Copies of a measurement with their errors.

    Args:
        groups: of :func:`proofroll_throughput.measurement.measured`.
        folder: of their files.
        references: truth of each scene.
        times: of all samples, and of those that are judged [s].
        quantity: judged observable.

    Raises:
        Refused: the engine does not give the observable.
    """
    judged = []
    for number, group in enumerate(groups):
        with np.load(folder / f"{number}.npz", allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        index = int(group["case"])
        states = {name: arrays[name] for name in Sample.widths if name in arrays}
        finite = all(np.all(np.isfinite(values)) for values in states.values())
        judged.append(
            JudgedCopies(
                index=index,
                copies=list(group["copies"]),
                states=states,
                error=_error(arrays, references[index], times, quantity) if finite else None,
                failure=str(group["failure"]),
            )
        )
    return judged


def _error(
    arrays: Mapping[str, FloatArray], reference: Reference, times: tuple[FloatArray, FloatArray], quantity: str
) -> float:
    """Error of one copy in the judged observable."""
    scene, (sampled, asked) = reference.scene, times
    kind = scene.elements[0].sample_type
    samples = [kind(**{name: values[index] for name, values in arrays.items()}) for index in range(len(sampled))]
    columns = off_grid_apart(scene, columns_of(scene, sampled, samples), asked, sampled[:0])
    errors = errors_of(columns.dataset(), reference, whole=True)[0]
    if quantity not in errors:
        raise Refused(f"it does not give {quantity}")
    return errors[quantity]


def twins_apart(judged: Sequence[JudgedCopies]) -> float | None:
    """Largest difference of finite copies of one scene, of the largest number in an array of their states.

    None: no scene has two such copies.
    """
    apart: float | None = None
    for index in {item.index for item in judged}:
        groups = [item for item in judged if item.index == index and item.error is not None]
        if sum(len(item.copies) for item in groups) < 2:
            continue
        base = groups[0].states
        differences = [
            float(np.max(np.abs(item.states[name] - values)) / (np.max(np.abs(values)) or 1.0))
            for item in groups[1:]
            for name, values in base.items()
        ]
        apart = max(apart or 0.0, *differences, 0.0)
    return apart
