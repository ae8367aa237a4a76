"""Measurement of one row in a worker's process: the copies move, their states are written, their cost is counted."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from proofroll.core import multi_element
from proofroll.core.element_abilities import HoldsTargets
from proofroll.core.engine import Sample, fixed_step
from proofroll.core.engine_abilities import RunsBatches, require_provided
from proofroll.core.errors import Diverged, Refused, lack_behind
from proofroll.core.formulations import added_by
from proofroll.core.scene import Scene
from proofroll.running.case import Case
from proofroll.running.loading import engine_and_settings, scene_of

CPU = "cpu"
# Processor time of the clean runs of a row [s], and the most of them; the least counts: others empty the caches.
_ENOUGH, _MOST_RUNS = 0.3, 5

Arrays = dict[str, npt.NDArray[np.float64]]


class _Copies(Protocol):
    """Copies of scenes in an engine.

    Attributes:
        device: see :class:`proofroll.core.engine_abilities.Batch`.
        failures: number of a copy -> sentence with which its engine gave up.
    """

    device: str
    failures: dict[int, str]

    def advance(self, t: float) -> None:
        """Moves all copies that have not failed to time ``t`` [s]."""

    def arrays(self) -> Arrays:
        """Arrays of a sample with the copies as first axis; NaN for copies that have failed."""


class _Together:
    """Copies that move together, see :class:`_Copies`."""

    def __init__(self, kind: Any, scenes: Sequence[Scene], pattern: Sequence[int], settings: Any) -> None:
        for scene in scenes:
            require_provided(kind, settings.formulation, scene)
        self._batch = kind.build_batch([scene.for_an_engine for scene in scenes], pattern, settings)
        self.device = self._batch.device
        self.failures: dict[int, str] = {}

    def advance(self, t: float) -> None:
        """Moves all copies to time ``t`` [s]."""
        self._batch.advance(t)

    def arrays(self) -> Arrays:
        """Arrays of the batch's sample."""
        return _arrays(self._batch.sample())


class _InTurn:
    """Copies that move one after the other, each a run of its own, see :class:`_Copies`."""

    device = CPU

    def __init__(self, kind: Any, scenes: Sequence[Scene], pattern: Sequence[int], settings: Any) -> None:
        self._runs = [multi_element.build(kind, scenes[index], settings) for index in pattern]
        self.failures: dict[int, str] = {}
        self._last: dict[int, Arrays] = {}

    def advance(self, t: float) -> None:
        """Moves the runs that have not failed to time ``t`` [s]."""
        for number, run in enumerate(self._runs):
            if number in self.failures:
                continue
            try:
                run.advance(t)
            except Diverged as error:
                if lack_behind(error):
                    raise
                self.failures[number] = str(error)

    def arrays(self) -> Arrays:
        """Arrays of the samples of all runs; NaN for runs that have failed."""
        for number, run in enumerate(self._runs):
            arrays = self._last.get(number) if number in self.failures else _arrays(run.sample())
            if number in self.failures and arrays is not None:
                arrays = {name: np.full_like(values, np.nan) for name, values in arrays.items()}
            self._last[number] = arrays or {}
        return {name: np.stack([arrays[name] for arrays in self._last.values()]) for name in self._last[0]}


def measured(cases: list[dict[str, Any]], pattern: list[int], times: list[float], folder: str) -> dict[str, Any]:
    """Moves copies of scenes in an engine, and writes their states.

    Args:
        cases: one for each distinct scene, of one engine and its settings.
        pattern: index of the case of each copy.
        times: of the samples [s], from 0 on.
        folder: place of the files ``N.npz``, one for each group of copies with the same bits: arrays of a sample with
            the times as first axis, NaN from the time on at which a run has failed.

    Returns:
        ``device``; ``why``: reason for which each case has one copy and these move one after the other, or empty;
        ``groups``: for each file the index of its case, its copies, and the sentence of a failure or an empty one;
        ``seconds_before``: processor time of building and of the first step; ``seconds``: least processor time of the
        copies to the last time, with one sample at its end; ``steps`` of a copy, or None.

    Raises:
        Refused: the engine represents no such scene.
    """
    asked = [Case.from_dict(case) for case in cases]
    kind, settings = engine_and_settings(asked[0])
    scenes, step, clock = [scene_of(case) for case in asked], fixed_step(settings), time.process_time
    copies, why = pattern, _why_in_turn(kind, scenes[0], settings)
    make: Callable[[], _Copies] = partial(_Together, kind, scenes, pattern, settings)
    begin = clock()
    if not why:
        try:
            moving = make()
        except Refused as refusal:
            why = str(refusal)
    if why:
        copies = list(range(len(scenes)))
        make = partial(_InTurn, kind, scenes, copies, settings)
        begin = clock()
        moving = make()
    built = clock()
    samples = [moving.arrays()]
    begin_of_step = clock()
    moving.advance(times[1] if step is None else step)
    before = built - begin + clock() - begin_of_step
    for t in times[1:]:
        moving.advance(t)
        samples.append(moving.arrays())
    spent: list[float] = []
    while sum(spent) < _ENOUGH and len(spent) < _MOST_RUNS:
        clean = make()
        begin = clock()
        clean.advance(times[-1])
        clean.arrays()
        spent.append(clock() - begin)
    return {
        "device": moving.device,
        "why": why,
        "groups": _written(samples, copies, moving.failures, Path(folder)),
        "seconds_before": before,
        "seconds": min(spent),
        "steps": None if step is None else round(times[-1] / step),
    }


def _why_in_turn(kind: Any, scene: Scene, settings: Any) -> str:
    """Reason for which an engine moves copies of a scene one after the other; empty: it may move them together."""
    if not isinstance(kind, RunsBatches) or added_by(kind, settings.formulation):
        return "its adapter moves no copies together"
    if any(isinstance(element, HoldsTargets) and element.commands() for element in scene.elements):
        return "a controller sets the targets of each run"
    return ""


def _arrays(sample: Sample) -> Arrays:
    """Arrays of a sample that the engine gives."""
    values = {item.name: getattr(sample, item.name) for item in fields(sample)}
    return {name: np.asarray(array, np.float64) for name, array in values.items() if array is not None}


def _written(
    samples: Sequence[Arrays], pattern: Sequence[int], failures: dict[int, str], folder: Path
) -> list[dict[str, Any]]:
    """Writes the states of all copies, those with the same bits once; returns the groups."""
    names = [name for name in samples[-1] if name in samples[0]]  # reactions may begin after the start
    whole = {name: np.stack([arrays[name] for arrays in samples], axis=1) for name in names}
    groups: dict[tuple[int, bytes], list[int]] = {}
    for number, index in enumerate(pattern):
        bits = b"".join(np.ascontiguousarray(values[number]).tobytes() for values in whole.values())
        groups.setdefault((index, bits), []).append(number)
    answers: list[dict[str, Any]] = []
    for (index, _), numbers in groups.items():
        chosen: dict[str, Any] = {name: values[numbers[0]] for name, values in whole.items()}
        np.savez(folder / f"{len(answers)}.npz", **chosen)
        answers.append({"case": index, "copies": numbers, "failure": failures.get(numbers[0], "")})
    return answers
