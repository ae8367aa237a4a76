"""One case in two versions of an engine: verdicts, observed orders and numbers that changed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.dataset import observe, scales
from proofroll.core.observable import Role
from proofroll.core.plugins import parse_engine
from proofroll.core.scene import Scene
from proofroll.files.netcdf import read
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Result, Status
from proofroll.running.runner import Runner
from proofroll.studies.outcome import Run
from proofroll.studies.planning import Plan, point_name

if TYPE_CHECKING:
    import xarray as xr

# Of two runs relative to the size of the quantity: another compiler or another order of sums moves numbers by some
# 1e-13, and the solvers of constraints stop at tolerances of theirs; what physics or a method changes is far above.
ROUND_OFF = 1e-9
# Two observed orders that are further apart are different methods: a ladder shows a whole order to a tenth or two.
_ANOTHER_ORDER = 0.5


def setting_of(run: Run) -> str:
    """Settings as the file writes them, without the engine."""
    return ", ".join(f"{key}={value}" for key, value in parse_engine(run.row.engine).options.items()) or "as it is"


def case_difference(
    item: Plan, before: Run, after: Run, results: Mapping[str, Result], runner: Runner
) -> dict[str, Any]:
    """One case in both versions."""
    setting, point = setting_of(before), point_name(before.parameters)
    where = f"{item.comparison.name}: {setting}" + (f" at {point}" if point else "")
    sides = {name: _told(run) for name, run in (("old", before), ("new", after))}
    verdicts = [
        (one.observable, one.verdict, other.verdict)
        for one in before.judgements
        for other in after.judgements
        if one.observable == other.observable and one.verdict != other.verdict
    ]
    changed = []
    if before.result.status != after.result.status:
        changed.append(f"{where}: {_ending(before)} → {_ending(after)}")
    elif before.verdict != after.verdict or verdicts:
        which = ", ".join(f"{name} {one} → {other}" for name, one, other in verdicts)
        changed.append(f"{where}: {which or f'{before.verdict} → {after.verdict}'}")
    orders = [
        {"quantity": one.observable, "old": one.order, "new": other.order}
        for one in before.judgements
        for other in after.judgements
        if one.observable == other.observable and one.order and other.order
        if abs(one.order - other.order) > _ANOTHER_ORDER
    ]
    return {
        "comparison": item.comparison.name,
        "scene": item.comparison.scene,
        "setting": setting,
        "point": point,
        **sides,
        "numbers": _numbers(item, before, after, results, runner),
        "orders": orders,
        "changed": changed,
    }


def _told(run: Run) -> dict[str, Any]:
    return {
        "status": run.result.status,
        "message": run.result.message,
        "verdict": run.verdict,
        "declared_order": run.facts.order if run.facts else None,
        "errors": {judgement.observable: judgement.error for judgement in run.judgements},
        "versions": run.result.versions,
    }


def _ending(run: Run) -> str:
    return str(run.verdict) if run.result.status == Status.DONE else f"{run.result.status} ({run.result.message})"


def _numbers(
    item: Plan, before: Run, after: Run, results: Mapping[str, Result], runner: Runner
) -> dict[str, Any] | None:
    """How far the trajectories are apart, by the observable that differs most for its size; None: there are none."""
    if before.case is None or after.case is None or not before.result.trajectory or not after.result.trajectory:
        return None
    one, other = (read(runner.store.trajectory(run.case)) for run in (before, after) if run.case is not None)
    scene = load_scene(item.comparison.scene, **before.parameters)
    truth = item.truths[point_name(before.parameters)]
    sizes = scales(scene, read(runner.store.trajectory(truth))) if results[truth.key].trajectory else {}
    return _apart(scene, one, other, sizes)


def _apart(scene: Scene, one: xr.Dataset, other: xr.Dataset, sizes: Mapping[str, float]) -> dict[str, Any]:
    found = {"quantity": "", "unit": "", "difference": 0.0, "relative": 0.0, "kind": "same bits"}
    values, others = observe(scene, one), observe(scene, other)
    for name, mine in values.items():
        item, theirs = scene.observables[name], others.get(name)
        if theirs is None or item.role not in {Role.MOTION, Role.REACTION} or mine.ndim != theirs.ndim:
            continue
        count = min(len(mine), len(theirs))
        if mine[:count].shape != theirs[:count].shape or np.array_equal(mine[:count], theirs[:count], equal_nan=True):
            continue
        apart = np.abs(mine[:count] - theirs[:count])
        difference = float(np.nanmax(apart, initial=0.0))
        size = sizes.get(name) or float(np.nanmax(np.abs(mine), initial=0.0)) or 1.0
        if found["kind"] == "same bits":
            found["kind"] = "round-off"
        if difference / size >= float(str(found["relative"])):
            found |= {"quantity": name, "unit": item.unit, "difference": difference, "relative": difference / size}
    if float(str(found["relative"])) > ROUND_OFF:
        found["kind"] = "changed"
    return found
