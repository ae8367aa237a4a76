"""One engine in two versions: the same cases in both, and what changed."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.comparison import Comparison
from proofroll.core.dataset import observe, scales
from proofroll.core.observable import Role
from proofroll.core.plugins import parse_engine
from proofroll.core.scene import Scene
from proofroll.files.netcdf import read
from proofroll.files.scene_file import load_scene
from proofroll.running.asking import describe
from proofroll.running.case import Result, Status
from proofroll.running.runner import Runner
from proofroll.running.stopwatch import Stopwatch
from proofroll.running.timing import interleaved, ratio
from proofroll.studies.compare import evaluate
from proofroll.studies.hosts import hosts
from proofroll.studies.outcome import Run
from proofroll.studies.planning import Plan, plan, point_name

if TYPE_CHECKING:
    import xarray as xr

# Of two runs relative to the size of the quantity: another compiler or another order of sums moves numbers by some
# 1e-13, and the solvers of constraints stop at tolerances of theirs; what physics or a method changes is far above.
ROUND_OFF = 1e-9
# Two observed orders that are further apart are different methods: a ladder shows a whole order to a tenth or two.
_ANOTHER_ORDER = 0.5
# Rounds of timing: with twelve one estimate moved by 5 % between series, with twenty the interval is some 4 % wide.
ROUNDS = 20

Progress = Callable[[str], None]


def compared(
    sides: tuple[str, str],
    comparisons: Sequence[Comparison],
    runner: Runner,
    rounds: int = ROUNDS,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The same cases in two versions of an engine, and what changed, as plain data.

    Args:
        sides: the engine twice, ``NAME`` or ``NAME@PLACE``: the old version and the new one.
        comparisons: from :func:`comparisons_about`.
        runner: where the cases are run.
        rounds: of timing; 0 times nothing.
        progress: called with what has just been done.

    Raises:
        InputError, Missing, WorkerDied: one of them cannot be asked at all.
    """
    progress = progress or (lambda _: None)
    told = [describe(side, runner.workers) for side in sides]
    plans = [plan(dataclasses.replace(item, timed=False), sides, runner.workers) for item in comparisons]
    cases = {case.key: case for item in plans for case in item.cases}
    results = runner.run(cases.values(), lambda case, _: progress(case.engine.name))
    found: list[tuple[Plan, Run, Run]] = []
    for item in plans:
        runs = evaluate(item, results, runner).runs
        one, other = ([run for run in runs if parse_engine(run.row.engine).name == side] for side in sides)
        found += [(item, before, after) for before, after in zip(one, other, strict=True)]
    told_cases = [_case(item, before, after, results, runner) for item, before, after in found]
    speeds = _speeds(found, runner, rounds, progress) if rounds else {}
    return {
        "engine": parse_engine(sides[0]).name.partition("@")[0],
        "old": _side(sides[0], told[0]),
        "new": _side(sides[1], told[1]),
        "comparisons": [item.name for item in comparisons],
        "rows": _rows(told_cases, speeds),
        "cases": told_cases,
        "defaults": _defaults(*told),
        "hosts": hosts(run.result for _, *pair in found for run in pair),
        "robot": None,
        "changed": [sentence for case in told_cases for sentence in case["changed"]],
        "lost": [
            f"{side} {case['setting']} at {case['point'] or 'its only point'}: {case[side]['message']}"
            for case in told_cases
            for side in ("old", "new")
            if case[side]["status"] == Status.MISSING
        ],
    }


def _side(name: str, told: Mapping[str, Any]) -> dict[str, Any]:
    return {"name": name, "version": told["version"], "interpreter": told["interpreter"]}


def _setting(run: Run) -> str:
    """Settings as the file writes them, without the engine."""
    return ", ".join(f"{key}={value}" for key, value in parse_engine(run.row.engine).options.items()) or "as it is"


def _case(item: Plan, before: Run, after: Run, results: Mapping[str, Result], runner: Runner) -> dict[str, Any]:
    """One case in both versions."""
    setting, point = _setting(before), point_name(before.parameters)
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


def _rows(cases: Sequence[dict[str, Any]], speeds: Mapping[tuple[str, str], dict[str, Any]]) -> list[dict[str, Any]]:
    """Summaries of all points of a setting."""
    grouped: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for case in cases:
        grouped.setdefault((case["comparison"], case["setting"]), []).append(case)
    rows = []
    for key, group in grouped.items():
        numbers = [case["numbers"] for case in group if case["numbers"]]
        rows.append(
            {
                "comparison": key[0],
                "setting": key[1],
                "cases": len(group),
                "verdicts": {
                    side: dict(Counter(str(case[side]["verdict"]) for case in group)) for side in ("old", "new")
                },
                "numbers": max(numbers, key=lambda item: (item["relative"], item["kind"] != "same bits"), default=None),
                "declared_order": {side: group[0][side]["declared_order"] for side in ("old", "new")},
                "orders": [order for case in group for order in case["orders"]],
                "changed": sum(bool(case["changed"]) for case in group),
                "speed": speeds.get(key),
            }
        )
    return rows


def _speeds(
    found: Sequence[tuple[Plan, Run, Run]], runner: Runner, rounds: int, progress: Progress
) -> dict[tuple[str, str], dict[str, Any]]:
    """Time of the new version over that of the old one, for the first point of each setting that both run."""
    chosen: dict[tuple[str, str], tuple[Run, Run]] = {}
    for item, before, after in found:
        if before.result.status == after.result.status == Status.DONE:
            chosen.setdefault((item.comparison.name, _setting(before)), (before, after))
    speeds = {}
    with Stopwatch(runner.workers) as watch:
        for key, (before, after) in chosen.items():
            assert before.case is not None  # both ran
            assert after.case is not None
            old, new = before.case, after.case
            timings = interleaved({"old": lambda c=old: watch(c), "new": lambda c=new: watch(c)}, rounds)  # type: ignore[misc]  # bound now
            progress(f"timing {key[1]}")
            if timings.keys() == {"old", "new"} and len(timings["old"].values) == len(timings["new"].values):
                speeds[key] = dataclasses.asdict(ratio(timings["new"], timings["old"]))
    return speeds


def _defaults(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What the engine itself takes where nobody chooses, and what formulations can represent, if that changed."""
    found = []
    for kind in ("defaults", "provides"):
        one, other = old.get(kind) or {}, new.get(kind) or {}
        for name in sorted(one.keys() | other.keys()):
            if one.get(name) != other.get(name):
                found.append({"name": name, "old": one.get(name), "new": other.get(name)})
    return found
