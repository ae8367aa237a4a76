"""Differences of one case between two versions of an engine: verdicts, observed orders and numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Self

import numpy as np

from proofroll.core.dataset import observe
from proofroll.core.observable import Role
from proofroll.core.plugins import parse_engine
from proofroll.core.scene import Scene
from proofroll.core.verdict import Verdict
from proofroll.core.whole_turns import on_turns_of
from proofroll.running.case import Status
from proofroll.studies.comparison.outcome import Outcome, Run
from proofroll.studies.comparison.planning import point_name

if TYPE_CHECKING:
    import xarray as xr

# Largest difference, relative to the size of the quantity, that counts as round-off. Another compiler or order of sums
# changes numbers by some 1e-13, solvers of constraints by their tolerances, other physics or methods by far more.
ROUND_OFF = 1e-9
# Observed orders that differ by more belong to different methods; a ladder shows an order to a tenth or two.
_ANOTHER_ORDER = 0.5


def setting_of(run: Run) -> str:
    """Settings of a row as the file writes them, without the engine."""
    return ", ".join(f"{key}={value}" for key, value in parse_engine(run.row.engine).options.items()) or "as it is"


class NumberKind(StrEnum):
    """Kind of difference between the numbers of two versions."""

    SAME_BITS = "same bits"
    ROUND_OFF = "round-off"
    CHANGED = "changed"


@dataclass(frozen=True)
class NumbersApart:
    """Difference of two trajectories, for the observable with the largest relative difference.

    Attributes:
        quantity, unit: of that observable; empty if nothing differs.
        difference: the largest, in its unit.
        relative: difference divided by the observable's size [1].
        kind: of difference.
    """

    quantity: str = ""
    unit: str = ""
    difference: float = 0.0
    relative: float = 0.0
    kind: NumberKind = NumberKind.SAME_BITS


@dataclass(frozen=True)
class RunInVersion:
    """A case in one of the versions.

    Attributes:
        status, message: end of the run.
        verdict: of its worst observable.
        declared_order: of the engine with these settings, or None.
        errors: judged observable -> largest error.
        versions: of the engine and of the software that it ran on.
    """

    status: Status
    message: str
    verdict: Verdict
    declared_order: int | None
    errors: dict[str, float]
    versions: dict[str, str]

    @classmethod
    def of(cls, run: Run) -> Self:
        """Record of a judged run."""
        order = run.facts.order if run.facts else None
        errors = {judgement.observable: judgement.error for judgement in run.judgements}
        return cls(run.result.status, run.result.message, run.verdict, order, errors, run.result.versions)


@dataclass(frozen=True)
class OrderChange:
    """Change of a quantity's observed order of convergence that is large enough for a different method."""

    quantity: str
    old: float
    new: float


@dataclass(frozen=True)
class CaseDifference:
    """One case in both versions.

    Attributes:
        comparison, scene, setting, point: identity of the case.
        old, new: its runs.
        numbers: difference of the trajectories; None if one has none.
        orders: observed orders that changed.
        changed: verdicts that changed, ``refused (why) → agrees``, and observables that one of them alone gives.
    """

    comparison: str
    scene: str
    setting: str
    point: str
    old: RunInVersion
    new: RunInVersion
    numbers: NumbersApart | None
    orders: list[OrderChange]
    changed: list[str]


def case_difference(outcome: Outcome, old_run: Run, new_run: Run) -> CaseDifference:
    """Differences of one case between two versions."""
    verdicts = [
        (judged.observable, judged.verdict, judged_new.verdict)
        for judged in old_run.judgements
        for judged_new in new_run.judgements
        if judged.observable == judged_new.observable and judged.verdict != judged_new.verdict
    ]
    changes = []
    if old_run.result.status != new_run.result.status:
        changes.append(f"{_ending(old_run)} → {_ending(new_run)}")
    elif old_run.verdict != new_run.verdict or verdicts:
        which = ", ".join(f"{name} {judged} → {judged_new}" for name, judged, judged_new in verdicts)
        changes.append(which or f"{old_run.verdict} → {new_run.verdict}")
    changes += _given_by_one(outcome, old_run, new_run)
    orders = [
        OrderChange(judged.observable, judged.order, judged_new.order)
        for judged in old_run.judgements
        for judged_new in new_run.judgements
        if judged.observable == judged_new.observable and judged.order and judged_new.order
        if abs(judged.order - judged_new.order) > _ANOTHER_ORDER
    ]
    return CaseDifference(
        comparison=outcome.comparison.name,
        scene=outcome.comparison.scene,
        setting=setting_of(old_run),
        point=point_name(old_run.parameters),
        old=RunInVersion.of(old_run),
        new=RunInVersion.of(new_run),
        numbers=_numbers(outcome, old_run, new_run),
        orders=orders,
        changed=changes,
    )


def _ending(run: Run) -> str:
    return str(run.verdict) if run.result.status == Status.DONE else f"{run.result.status} ({run.result.message})"


def _given_by_one(outcome: Outcome, old_run: Run, new_run: Run) -> list[str]:
    """A sentence for each observable that one run gives and the other one does not."""
    if old_run.trajectory is None or new_run.trajectory is None:
        return []
    scene = outcome.points[point_name(old_run.parameters)].scene
    old, new = (observe(scene, run.trajectory.dataset).keys() for run in (old_run, new_run) if run.trajectory)
    lost, gained = sorted(old - new), sorted(new - old)
    return [f"{name} is given no more" for name in lost] + [f"{name} is given now" for name in gained]


def _numbers(outcome: Outcome, old: Run, new: Run) -> NumbersApart | None:
    """Largest difference of the trajectories; None if one is missing."""
    if old.trajectory is None or new.trajectory is None:
        return None
    point = outcome.points[point_name(old.parameters)]
    sizes = point.reference.sizes if point.reference else {}
    differences = numbers_apart(point.scene, old.trajectory.dataset, new.trajectory.dataset, sizes)
    return differences[0] if differences else NumbersApart()


def numbers_apart(
    scene: Scene, data: xr.Dataset, new_data: xr.Dataset, sizes: Mapping[str, float]
) -> list[NumbersApart]:
    """Differences of two runs with samples at the same times, for each observable that differs, the largest first.

    Args:
        scene: of both runs.
        data: earlier run.
        new_data: later run.
        sizes: observable -> its size, to which its difference is relative; by default its largest value.
    """
    differences = []
    values, rivals = observe(scene, data), observe(scene, new_data)
    for name, mine in values.items():
        item, theirs = scene.observables[name], rivals.get(name)
        if theirs is None or item.role not in {Role.MOTION, Role.REACTION} or mine.ndim != theirs.ndim:
            continue
        theirs = on_turns_of(mine, theirs, name, (data, new_data))
        if theirs is None:
            continue
        count = min(len(mine), len(theirs))
        if mine[:count].shape != theirs[:count].shape or np.array_equal(mine[:count], theirs[:count], equal_nan=True):
            continue
        difference = float(np.nanmax(np.abs(mine[:count] - theirs[:count]), initial=0.0))
        relative = difference / (sizes.get(name) or float(np.nanmax(np.abs(mine), initial=0.0)) or 1.0)
        kind = NumberKind.ROUND_OFF if relative <= ROUND_OFF else NumberKind.CHANGED  # NaN counts as a difference
        differences.append(
            NumbersApart(quantity=name, unit=item.unit, difference=difference, relative=relative, kind=kind)
        )
    return sorted(differences, key=lambda apart: -apart.relative if apart.relative >= 0 else -math.inf)
