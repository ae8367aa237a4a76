"""Runs every mutant as a comparison would, and asks the diagnosis what is wrong with it."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.certificate import Line, first_difference
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.errors import Diverged
from proofroll.core.first_steps import certificate as certificate_of
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.core.truth import truth
from proofroll.core.verdict import Allowance, Judgement, RunCurve, Verdict, judge_curve
from proofroll.files.scene_file import load_scene
from proofroll.running.recording import record
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference
from proofroll_drill.mutants import (
    ball_samples,
    balls,
    contact_models,
    controllers,
    joint_laws,
    loads,
    mechanism_models,
    mechanism_samples,
)
from proofroll_drill.mutants.base import Mutant

if TYPE_CHECKING:
    from proofroll.running.cluster import Cluster

MODULES = (ball_samples, balls, contact_models, controllers, joint_laws, loads, mechanism_models, mechanism_samples)
# Least tolerance of every observable: relative to its size, and in errors of the engine without the fault.
_TOLERANCE, _OF_METHOD = 1e-6, 10.0
_plain: dict[Any, Sequence[Judgement]] = {}  # by bases of an engine and what it is asked
# Part of the mutants whose fault has to be named.
ENOUGH = 0.9


@dataclass(frozen=True)
class Mutated:
    """Result of one mutant.

    Attributes:
        fault: planted fault.
        mutant: its class.
        scene: on which it ran.
        detected: True if certificate or verdicts show that something is wrong.
        by: part of the judge that showed it.
        named: True if the diagnosis names the cause.
        said: text of the diagnosis; may be empty.
        ran_on: name of the machine of a cluster on which it ran; empty: here.
    """

    fault: str
    mutant: str
    scene: str
    detected: bool
    by: str
    named: bool
    said: str
    ran_on: str = ""


def mutants() -> list[type[Mutant]]:
    """All, in the order of their modules."""
    return [kind for module in MODULES for kind in module.FAULTS]


def mutant(name: str) -> type[Mutant]:
    """The one of a name."""
    (kind,) = (kind for kind in mutants() if kind.__name__ == name)
    return kind


def mutant_drill(progress: Callable[[str], None] = lambda _: None, cluster: Cluster | None = None) -> Iterator[Mutated]:
    """Tries every mutant, here or on a cluster."""
    kinds = mutants()
    for host, found in cluster.map(tried, kinds) if cluster else (("", tried(kind)) for kind in kinds):
        yield dataclasses.replace(found, ran_on=host)
        progress(found.fault)


def tried(kind: type[Mutant]) -> Mutated:
    """One mutant: certificate, run, verdicts, diagnosis."""
    scene, reference = _truth(*_asked(kind))
    engine, certificate = _built(kind, scene)
    lines = [line.as_dict() for line in certificate]
    by, ended = first_difference(certificate) or "", ""
    if by:
        causes = diagnose_scene(scene, lines, step=kind.step)
    else:
        try:
            recording = record(engine, scene, reference.dataset["time"].to_numpy())
        except Diverged as error:
            return Mutated(kind.fault, kind.__name__, scene.name, True, str(error), False, "")
        judgements = _judged(reference, recording.dataset, judged_without_fault(kind))
        wrong = [item for item in judgements if item.verdict == Verdict.DIFFERS]
        ended = recording.failure or ""  # which says why
        by = ended or "; ".join(f"{item.observable} {item.reason.partition(';')[0]}" for item in wrong[:2])
        causes = diagnose_scene(scene, lines, recording.dataset, reference.dataset, kind.step, judgements) if by else []
    said = "; ".join(item.sentence for item in causes) or ended
    # The first cause, and what looks the same from outside, are the answer; what is said after it does not count.
    answer = " ".join(item.sentence for item in causes[:1] + [item for item in causes[1:] if item.cause.alternative])
    named = any(word in (answer or ended) for word in kind.named)
    return Mutated(kind.fault, kind.__name__, scene.name, bool(by), by, named, said)


def without_fault(kind: type[Mutant]) -> type[Mutant]:
    """The engine of a mutant without its fault, on its scene: of all its bases those without a fault."""
    bases = tuple(each for each in kind.__mro__ if getattr(each, "fault", None) == "")
    same = {name: getattr(kind, name) for name in ("scene", "until", "every", "step", "asks")}
    return type(f"{bases[0].__name__}Of_{Path(kind.scene[0]).name}", bases, same)


def judged_without_fault(kind: type[Mutant]) -> Sequence[Judgement]:
    """All observables of the mutant's engine without its fault on its scene, whose errors are no sign of the fault.

    Raises:
        ValueError: the engine does not build the scene, or fails in it.
    """
    plain = without_fault(kind)
    key = (plain.__bases__, plain.step, _asked(plain))
    if key not in _plain:
        scene, reference = _truth(*_asked(plain))
        engine, certificate = _built(plain, scene)
        recording = record(engine, scene, reference.dataset["time"].to_numpy())
        if wrong := first_difference(certificate) or recording.failure:
            raise ValueError(f"{plain.__name__} without a fault: {wrong}")
        _plain[key] = _judged(reference, recording.dataset, ())
    return _plain[key]


def _built(kind: type[Mutant], scene: Scene) -> tuple[Any, list[Line]]:
    settings = dataclasses.replace(kind.presets[kind.formulation]["default"], dt=kind.step)
    engine = kind.build(scene, settings)
    return engine, certificate_of(kind, engine, scene, settings)


def _judged(reference: Reference, dataset: Any, plain: Sequence[Judgement]) -> list[Judgement]:
    """Verdicts of what a run has, but of sums over its samples; ``plain``: of the engine without the fault."""
    found, of_method = [], {item.observable: item.error for item in plain}
    for name, values in run_values.observables_of(reference, dataset).items():
        if reference.scene.observables[name].sums_samples:
            continue
        true, size = reference.true(name, values), reference.sizes.get(name, 1.0)
        least = max(_TOLERANCE * size, _OF_METHOD * of_method.get(name, 0.0), 4 * true.error_bar)
        allowance = Allowance(name, reference.scene.observables[name].unit, least, size)
        found.append(judge_curve(allowance, RunCurve(values), true))
    return found


def _asked(kind: type[Mutant]) -> tuple[Any, ...]:
    """Scene, its parameters, what is asked of it, end and interval of the run of a mutant."""
    name, parameters = kind.scene
    return name, tuple(sorted(parameters.items())), kind.asks, kind.until, kind.every


@functools.cache
def _truth(
    name: str, parameters: tuple[tuple[str, float], ...], asks: tuple[str, ...], until: float, every: float
) -> tuple[Scene, Reference]:
    """Shared by all mutants of a scene."""
    scene = load_scene(name, asks=asks, **dict(parameters))
    return scene, Reference.of(scene, truth(scene, np.asarray(time_grid(until, every))))
