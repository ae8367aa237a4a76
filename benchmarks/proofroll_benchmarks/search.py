"""The fastest configuration of every engine that holds a bound on z: coarse steps first, finer where they fail."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine_abilities import Level, Term
from proofroll.core.errors import ProofrollError
from proofroll.core.plugins import engine_names
from proofroll.core.scene import Scene
from proofroll.files.trajectory_file import read
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import describe, resolve
from proofroll.running.runner import Runner
from proofroll.studies.cases import case_of

# Samples per run: enough that the largest error of an oscillation of about 0.6 s is seen. Every run stops at them, the
# timed ones too; that costs a fixed step nothing, and an adaptive one of high order at most a factor of about two.
SAMPLES = 10
# Steps between two samples, in rounds: the next is run only for what did not hold the bound in those before.
_STEPS = ((8, 16, 32, 64, 128), (256, 512), (1024, 2048))
_TOLERANCES = ((1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6), (1e-7, 1e-8))
# Between two of those, for what is fast: parts of the number of steps.
_PARTS = (0.55, 0.62, 0.7, 0.8, 0.9)
# Wall seconds of one run, simulating 1.72 s: what takes longer is some thousandfold of the fastest.
_LIMIT = 5.0


@dataclasses.dataclass(frozen=True)
class Configuration:
    """A configuration that holds the bound.

    Attributes:
        case: engine, settings and samples.
        error: largest error of z at the samples [m].
        seconds: of the run that gave the error, for a first ranking [s].
        contact: True if the ball is held by the engine's contact model.
    """

    case: Case
    error: float
    seconds: float
    contact: bool

    @property
    def name(self) -> str:
        """Engine and what was chosen, for a person."""
        facts = self.case.engine
        formulation, preset = facts.settings["formulation"], facts.settings["preset"]
        return f"{facts.name} {formulation} {preset} {facts.resolution}={_resolution(facts):.4g}"


def search(
    scene: Scene,
    until: float,
    true_z: FloatArray,
    bound: float,
    runner: Runner,
    finalists: int,
    progress: Callable[[str], None],
) -> list[Configuration]:
    """The fastest configurations of all installed engines that hold the bound, and the fastest contact models.

    Compiled models are left out: they are what the engines are compared with.

    Args:
        scene: with unbounded friction.
        until: last time [s].
        true_z: z at the samples [m], shape (SAMPLES + 1,).
        bound: on the error of z [m].
        runner: runs the cases.
        finalists: number of either.
        progress: called with a sentence about what is done next.
    """
    progress("asking the engines")
    kinds = list(_kinds())
    best: dict[int, Configuration] = {}

    def attempt(wanted: list[tuple[int, float]], what: str) -> None:
        cases = [(index, _case(scene, _with(kinds[index][0], value), until)) for index, value in wanted]
        progress(f"running {len(cases)} configurations: {what}")
        results = runner.run([case for _, case in cases])
        for index, case in cases:
            found = _judged(case, results[case.key], true_z, kinds[index][1], runner)
            if found and found.error <= bound and (index not in best or _coarser(found, best[index])):
                best[index] = found

    for rung in range(len(_STEPS)):
        missing = [index for index in range(len(kinds)) if index not in best]
        wanted = [(index, value) for index in missing for value in _values(kinds[index][0], until / SAMPLES, rung)]
        if wanted:
            attempt(wanted, f"steps, round {rung + 1}")
    ranked = sorted(best, key=lambda index: best[index].seconds)
    chosen = {*ranked[:finalists], *[index for index in ranked if best[index].contact][:finalists]}
    attempt([(index, value) for index in chosen for value in _between(best[index], until / SAMPLES)], "steps between")
    return sorted((best[index] for index in chosen), key=lambda found: found.seconds)


def _coarser(one: Configuration, other: Configuration) -> bool:
    """True if the first of two that hold the bound does less work; the wall seconds of a run are too noisy."""
    return _resolution(one.case.engine) > _resolution(other.case.engine)


def _resolution(facts: EngineFacts) -> float:
    return float(facts.settings[str(facts.resolution)])


def _between(found: Configuration, every: float) -> list[float]:
    """Coarser resolutions than the one that holds the bound, finer than the next that did not."""
    facts = found.case.engine
    if facts.resolution == "rtol":
        return [_resolution(facts) * factor for factor in (2.0, 4.0, 7.0)]
    steps = round(every / _resolution(facts))
    return [every / max(1, round(part * steps)) for part in _PARTS]


def _kinds() -> Iterator[tuple[EngineFacts, bool]]:
    """Every preset and variant of every engine, and whether it is a contact model."""
    wanted: list[tuple[str, dict[str, Any]]] = []
    contacts: list[bool] = []
    for name in engine_names():
        try:
            described = describe(name)
        except ProofrollError:
            continue
        levels = described.levels
        for formulation, presets in described.presets.items():
            level = levels.get(formulation)
            contact = level == Level.CONTACT
            for preset, settings in presets.items():
                if settings.get("integrator") == "taylor":
                    continue
                base = {"formulation": formulation, "preset": preset}
                for variant in ({}, *_without(described.terms, formulation, settings)):
                    wanted.append((name, base | dict(variant)))
                    contacts.append(contact)
    for facts, contact in zip(resolve(wanted), contacts, strict=True):
        if isinstance(facts, EngineFacts) and facts.resolution is not None:
            yield facts, contact


def _without(terms: Sequence[Term], formulation: str, settings: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Settings that leave out each of the engine's own terms that the settings may have."""
    for term in terms:
        if formulation in term.formulations and any(settings[key] != value for key, value in term.off.items()):
            yield term.off


def _values(facts: EngineFacts, every: float, rung: int) -> list[float]:
    if facts.resolution == "dt":
        return [every / steps for steps in _STEPS[rung]]
    return list(_TOLERANCES[rung]) if rung < len(_TOLERANCES) else []


def _with(facts: EngineFacts, value: float) -> EngineFacts:
    return dataclasses.replace(facts, settings={**facts.settings, str(facts.resolution): value})


def _case(scene: Scene, facts: EngineFacts, until: float) -> Case:
    return case_of(scene.name, scene, scene.parameters, facts, until, until / SAMPLES, time_limit=_LIMIT)


def _judged(case: Case, result: Result, true_z: FloatArray, contact: bool, runner: Runner) -> Configuration | None:
    if result.status is not Status.DONE:
        return None
    z = read(runner.store.trajectory(case))["z"].to_numpy()
    return Configuration(case, float(np.max(np.abs(z - true_z))), result.wall_seconds, contact)
