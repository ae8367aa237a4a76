"""Diagnosis of a run that does not agree: causes that the hypotheses of its elements prove."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.dataset import common_span, impact_samples, part
from proofroll.core.diagnosis import CLOSES, Cause, Evidence, diagnose, hypotheses_of
from proofroll.core.element_abilities import HoldsTargets
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.verdict import Judgement, Verdict

if TYPE_CHECKING:
    import xarray as xr

# Most causes that are reported for an element; the best come first.
_MOST = 3
_WRONG = frozenset({Verdict.DIFFERS, Verdict.CONVERGES})
_RIGHT = frozenset({Verdict.AGREES, Verdict.UNCONFIRMED})


@dataclass(frozen=True)
class Diagnosis:
    """A cause of one element.

    Attributes:
        element: name of the element.
        cause: with its proof.
        seen: right and wrong parts of the run, as the beginning of the sentence; may be empty.
    """

    element: str
    cause: Cause
    seen: str = ""

    @property
    def sentence(self) -> str:
        """Sentence for a person."""
        if self.cause.alternative:
            return f"or, which has the same effect: {self.cause.sentence}"
        return f"{self.seen}: {self.cause.sentence}" if self.seen else self.cause.sentence

    def as_dict(self) -> dict[str, Any]:
        """The cause with its numbers and the sentence, for JSON."""
        return {"element": self.element, "sentence": self.sentence, **dataclasses.asdict(self.cause)}


def diagnose_scene(
    scene: Scene,
    lines: Sequence[Mapping[str, Any]],
    run: xr.Dataset | None = None,
    truth: xr.Dataset | None = None,
    step: float | None = None,
    judgements: Iterable[Judgement] = (),
) -> list[Diagnosis]:
    """The proven causes of all elements of a scene.

    Samples on an impact are left out: which side of it a run reports there is no fault. With judgements, an element
    whose observables are all right is left out: its remaining differences are round-off and truncation, which any
    fault may seem to explain.

    Args:
        scene: of the run.
        lines: of the stored certificate.
        run: trajectory of the engine; None: it was not run.
        truth: the truth at the same times.
        step: of the engine [s], or None.
        judgements: of observables.
    """
    if run is None and all(line["holds"] for line in lines):
        return []
    if run is not None and truth is not None:
        truth, shorter = common_span(scene, truth, {0: run})
        run = shorter[0]
        on = impact_samples(scene, truth)
        if on.any() and np.mean(on) < 0.5 and run.sizes["time"] == len(on):
            truth, run = (dataset.isel(time=~on) for dataset in (truth, run))
    judged = list(judgements)
    wrong = {item.observable for item in judged if item.verdict in _WRONG}
    right = {item.observable for item in judged if item.verdict in _RIGHT}
    diagnoses, seen = [], agreement_sentence(scene, judged)
    for element in scene.elements:
        ending = f".{element.name}" if len(scene.elements) > 1 else ""
        own_lines = [
            {**line, "quantity": line["quantity"].removesuffix(ending)}
            for line in lines
            if str(line["quantity"]).endswith(ending)
        ]
        if judged and all(line["holds"] for line in own_lines) and not any(name.endswith(ending) for name in wrong):
            continue
        ran = None if run is None else part(scene, element, run)
        true = None if truth is None else part(scene, element, truth)
        settled = frozenset(name.removesuffix(ending) for name in right if name.endswith(ending))
        off = [item for item in judged if item.verdict in _WRONG and item.observable.endswith(ending)]
        by_step = bool(off) and all(_closed_by_step(item) for item in off)
        commanded = element.along(ran) if isinstance(element, HoldsTargets) else element
        if commanded is None:  # without its targets every cause would be a guess
            continue
        evidence = Evidence(
            element=commanded,
            lines=own_lines,
            run=ran,
            truth=true,
            step=step,
            settled=settled,
            by_step=by_step,
            asked=element,
        )
        diagnoses += [
            Diagnosis(element.name, cause, seen) for cause in diagnose(evidence, hypotheses_of(element))[:_MOST]
        ]
    return diagnoses


def _closed_by_step(item: Judgement) -> bool:
    """True if the limit of small steps leaves no more of the error than a proven cause may."""
    return item.limit_error is not None and item.limit_error <= CLOSES * item.error


def agreement_sentence(scene: Scene, judgements: Iterable[Judgement]) -> str:
    """Headline observables that agree and those that do not: ``the path is right and N is not``.

    Empty unless some are right and some are not.
    """
    right, wrong = [], []  # residuals (balances, audits) are left out: they follow from the other observables

    for item in judgements:
        item_observable = scene.observables.get(item.observable)
        if item_observable is None or (item_observable.role == Role.RESIDUAL and not item_observable.hangs_on_events):
            continue
        if item.verdict in _RIGHT:
            right.append(item_observable)
        elif item.verdict in _WRONG:
            wrong.append(item_observable)
    decided = [item for item in right if item.decides]
    if not decided or not wrong:
        return ""
    shown = [item.shown for item in wrong[:3]]
    return f"the path is right and {' and '.join(shown)} {'is' if len(shown) == 1 else 'are'} not"
