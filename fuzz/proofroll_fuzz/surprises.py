"""Surprises of an engine or the truth in a scene: undeclared behaviour, from the outcome of a comparison."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proofroll import ProofrollError
from proofroll.core.arrays import FloatArray, magnitudes
from proofroll.core.observable import Observable, Role
from proofroll.core.verdict import Judgement, LimitResult, Verdict
from proofroll.running.case import Result, Status
from proofroll.studies.comparison.outcome import ComparedPoint, Outcome, Run
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference

TRUTH = "truth"
HANGS, REFUSES = "hangs", "refuses"
RELATION = "relation "  # beginning of the surprise of a truth that breaks a relation
_PARTED = 0.1  # part of the largest difference from which on a run has parted from the truth
_LARGE = 0.03  # part of its scale by which an observable without a shown limit may be off
_EVENTFUL = 100.0  # by which the limit of small steps of a run with events may be farther off
_FALLEN = 0.8  # largest ratio of the errors at the shortest and the longest step that counts as falling
_OF_MOTION = frozenset({"m", "rad", "m/s", "rad/s", "1"})  # units of quantities of motion
OURS = "proofroll"  # in place of a formulation where the comparison itself fails
_EVENTS, _OF_EVENTS = "events", 1.0  # quantity, and size where their number is not the true one [decades]
_SETTLING = 5.0  # steps behind an event in which a run may still follow it, seen at one stop of a joint
_SAME = 0.01  # relative difference of errors that are alike at all steps
_FEW = 2  # samples that count as the start of a run
# Status of a run -> kind of surprise and its size [decades]: the worst first in a table of kinds.
_OF_STATUS = {
    Status.CRASHED: ("crashes", 9.0),
    Status.TIMEOUT: (HANGS, 8.0),
    Status.WRONG_MODEL: ("wrong model", 5.0),
    Status.DIVERGED: ("stops", 5.0),
    Status.ANOTHER_SCENE: ("another scene", 1.0),
    Status.REFUSED: (REFUSES, 0.0),
}
_NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class SurpriseKind:
    """Kind of a surprise; two with the same kind probably have the same cause.

    Attributes:
        formulation: engine and formulation, ``mujoco joints``; or ``truth``.
        surprise: its sign, in a few words.
        quantity: ``motion``, ``events``, or first word of another observable; or beginning of the message.
        phase: of the run when it shows: ``start``, the last event before, or ``underway``; empty: before the run.
    """

    formulation: str
    surprise: str
    quantity: str = ""
    phase: str = ""

    @property
    def relation(self) -> str:
        """Name of the relation that the truth breaks; empty: the surprise is another one."""
        return self.surprise.removeprefix(RELATION) if self.surprise.startswith(RELATION) else ""

    def __str__(self) -> str:
        """Text for a table, and key of what is known from earlier hunts."""
        return "; ".join(filter(None, (self.formulation, self.surprise, self.quantity, self.phase)))


@dataclass(frozen=True)
class Surprise:
    """A surprise in one scene.

    Attributes:
        kind: of it.
        size: decades by which an error exceeds what is allowed; fixed for others, see the table of kinds.
        message: one sentence with its numbers.
    """

    kind: SurpriseKind
    size: float
    message: str


def surprises(outcome: Outcome) -> list[Surprise]:
    """All surprises of a comparison of one scene, the largest first."""
    (point,) = outcome.points.values()
    shown = [*_of_truth(point)]
    if point.result.status is Status.DONE and point.reference is not None:
        for run in outcome.runs:
            shown += _of_run(run, point.reference)
    return sorted(shown, key=lambda item: -item.size)


def _of_truth(point: ComparedPoint) -> Iterator[Surprise]:
    """Surprises of the truth: it has none, ends early, or calls the question ill-posed."""
    result = point.result
    if result.status is not Status.DONE:
        yield _failed(TRUTH, result)
    elif point.reference is not None:
        for surprise, text in (("ends", point.reference.ended), ("ill-posed", point.reference.ill_posed)):
            if text:
                yield Surprise(SurpriseKind(TRUTH, surprise, _words(text)), 0.0, text)


def _of_run(run: Run, reference: Reference) -> Iterator[Surprise]:
    """Largest surprise of a run; no surprise where it does what its formulation declares."""
    formulation = formulation_of(run)
    if run.result.status is not Status.DONE:
        if run.result.status in _OF_STATUS:
            yield _failed(formulation, run.result)
        return
    for rung in run.rungs:
        if rung.result.status in {Status.CRASHED, Status.TIMEOUT}:
            yield _failed(formulation, rung.result)
            return
    if reference.ill_posed:
        return
    judged = [item for item in run.judgements if item.verdict not in {Verdict.NOT_JUDGED, Verdict.ILL_POSED}]
    wrong = [item for item in judged if _is_wrong(item, bool(reference.events), _errors(run, item))]
    wrong = [item for item in wrong if not _late_alone(run, item, reference)]
    if wrong:
        worst = max(wrong, key=lambda item: (item.limit is LimitResult.ANOTHER, _size(item, events=False)))
        quantity = _quantity(reference.scene.observables[worst.observable], worst.observable)
        kind = SurpriseKind(formulation, "wrong limit", quantity, _phase(run, worst.observable, reference))
        causes = "".join(f"; {cause.sentence}" for cause in run.diagnosis)
        yield Surprise(kind, _size(worst, quantity == _EVENTS), f"{worst.observable}: {worst.reason}{causes}")


def _quantity(observable: Observable, label: str) -> str:
    """Word for a quantity: ``events``, ``motion``, or the first word of another one."""
    if observable.role is Role.EVENT:
        return _EVENTS
    return "motion" if observable.unit in _OF_MOTION else label.partition(".")[0]


def _errors(run: Run, judgement: Judgement) -> list[float]:
    """Errors of an observable, from the shortest step, or tightest tolerance, to the other end."""
    assert run.facts is not None  # it has run
    if run.facts.resolution is None:
        return [judgement.error]
    errors = {rung.value: rung.errors.get(judgement.observable, math.inf) for rung in run.rungs}
    errors[float(run.facts.settings[run.facts.resolution])] = judgement.error
    return [errors[step] for step in sorted(errors)]


def _is_wrong(judgement: Judgement, eventful: bool, errors: list[float]) -> bool:
    """True if small steps lead to another motion than the true one, or nowhere.

    An event that falls between two steps leaves errors whose order three steps do not show, so that more is allowed;
    but not where all three have the same error.
    """
    steady = len(errors) > 1 and math.isfinite(max(errors)) and max(errors) - min(errors) <= _SAME * max(errors)
    if judgement.limit is LimitResult.ANOTHER and judgement.limit_error is not None:
        allowed = judgement.tolerance * (_EVENTFUL if eventful and not steady else 1.0)
        return not judgement.limit_error - (judgement.limit_doubt or 0.0) <= allowed
    if judgement.limit is not LimitResult.NOT_SHOWN:
        return False
    large = not judgement.error <= max(_LARGE * judgement.scale, judgement.tolerance)
    return (large and not _fall(errors)) or (steady and judgement.error > judgement.tolerance)


def _fall(errors: list[float]) -> bool:
    """True if the error at the shortest step is clearly smaller than at the longest."""
    return len(errors) > 1 and errors[0] < _FALLEN * errors[-1]


def _size(judgement: Judgement, events: bool) -> float:
    """Decades by which an error exceeds its tolerance; the error of the limit of small steps, if there is one."""
    error = judgement.limit_error if judgement.limit is LimitResult.ANOTHER else judgement.error
    if error is None or not math.isfinite(error):
        return _OF_EVENTS if events else max(size for _, size in _OF_STATUS.values())
    return math.log10(max(error / judgement.tolerance, 1e-9))


def _failed(formulation: str, result: Result) -> Surprise:
    """Surprise of a run without a result."""
    surprise, size = _OF_STATUS.get(result.status, (result.status.value, 1.0))
    return Surprise(SurpriseKind(formulation, surprise, _words(result.message)), size, result.message)


def failure_of_ours(message: str) -> Surprise:
    """Surprise of a comparison that ends with an error on a scene that the reader takes."""
    return Surprise(SurpriseKind(OURS, "fails", _words(message)), _OF_STATUS[Status.CRASHED][1], message)


def _words(message: str) -> str:
    """Beginning of a message without numbers and names of parts, so that it is alike in scenes alike."""
    words = _NUMBER.sub("#", re.sub(r"\b[a-z]{2,3}\d+(\.\d+)?\b", "…", message))
    words = re.sub(r"#(, #)+", "#", words).replace("angular acceleration", "acceleration")  # of which is furthest off
    return " ".join(words.split()[:12])


def formulation_of(run: Run) -> str:
    """Engine and formulation of a run, for a table."""
    engine = run.row.engine.partition("[")[0]
    return engine if run.facts is None else f"{engine} {run.facts.settings.get('formulation', '')}".strip()


def _late_alone(run: Run, judgement: Judgement, reference: Reference) -> bool:
    """True if a run is off at samples right behind events alone, which its steps do not resolve.

    Where errors do not fall, even the shortest step must have had no time to follow the event.
    """
    if run.facts is None or run.facts.step is None or not (apart := _apart(run, judgement.observable, reference)):
        return False
    steps = [run.facts.step, *(rung.value for rung in run.rungs)]
    step = (max if _fall(_errors(run, judgement)) else min)(steps)
    happened = np.array([event.time for event in reference.events])
    behind = apart.times[:, None] - happened
    settled = ~((behind > -step) & (behind <= _SETTLING * step)).any(axis=1)
    if not happened.size or not (settled & (apart.times > happened.max())).any():
        return False
    return bool(apart.sizes[settled].max() <= _EVENTFUL * judgement.tolerance)


def _phase(run: Run, observable: str, reference: Reference) -> str:
    """Phase in which a run parts from the truth: the start, behind a kind of event, or underway."""
    apart = _apart(run, observable, reference)
    if apart is None:
        return ""
    index = int(np.argmax(apart.sizes > _PARTED * apart.sizes.max()))
    events = [event for event in reference.events if event.time <= apart.times[index]]
    if events:
        return f"after {events[-1].kind.replace('_', '-')}"
    return "start" if index < _FEW else "underway"


class _Apart(NamedTuple):
    """Differences of a run from the truth, the largest of all vectors at each sample, and their times [s]."""

    times: FloatArray
    sizes: FloatArray


def _apart(run: Run, observable: str, reference: Reference) -> _Apart | None:
    """Differences of an observable from the truth; None where it is no function of the sample times."""
    if run.trajectory is None:
        return None
    try:
        reference, cut = reference.common_span({0: run.trajectory.dataset})
        values = run_values.observables_of(reference, cut[0])[observable]
        true = reference.true(observable, values).values
    except (KeyError, ProofrollError):
        return None
    times = reference.dataset["time"].to_numpy()
    if values.shape != true.shape or not 0 < len(values) <= len(times):
        return None
    apart = np.nan_to_num(values - true, nan=np.inf)
    sizes = magnitudes(apart, reference.vectors(observable)).max(axis=1, initial=0.0)
    return _Apart(times[len(times) - len(values) :], sizes)
