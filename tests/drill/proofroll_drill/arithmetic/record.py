"""Record of all decisions of comparisons and studies, with the truths' numbers, of one arithmetic, in a fresh store.

``python -m proofroll_drill.arithmetic.record FOLDER THREADS JOBS COMPARISON …`` writes ``FOLDER/record.json``.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

from proofroll.core.comparison import Comparison
from proofroll.core.dataset import part
from proofroll.core.errors import ProofrollError
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.core.verdict import Judgement, round_off_of
from proofroll.files.comparison_file import load_comparison
from proofroll.files.trajectory_file import read
from proofroll.running import forked
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.outcome import Outcome, Run
from proofroll.studies.comparison.planning import point_name
from proofroll_drill.arithmetic.studies import decided_by, is_study

TRUTH = "truth at"
# Truths of closed chains take five times as long without heyoka, and more with plain instructions.
_PATIENCE = 10.0
WRONG = "one that the truth does not have"


def main(folder: str, threads: str, jobs: str, *comparisons: str) -> None:
    """Runs the comparisons and studies and writes what they decide."""
    forked.THREADS.update(dict.fromkeys(forked.THREADS, threads))
    place = Path(folder)
    if any(place.glob("store/*")):
        raise SystemExit(f"{place} holds results of another arithmetic; name an empty folder")
    runner = Runner(Store(place / "store"), jobs=int(jobs))
    found: dict[str, Any] = {}
    for path in comparisons:
        if is_study(path):
            found[Path(path).stem] = decided_by(path, runner)
        else:
            comparison = unhurried(load_comparison(path))
            found[comparison.name] = decided(compare(comparison, runner), runner.store)
        # Written after each, so that what was found is there if a later one is ended.
        (place / "record.json").write_text(json.dumps(found, indent=1), encoding="utf-8")


def unhurried(comparison: Comparison) -> Comparison:
    """The brief comparison without speeds, on which no verdict hangs, and with time for arithmetic that is slow."""
    return dataclasses.replace(comparison.briefly(), timed=False, time_limit=_PATIENCE * comparison.time_limit)


def decided(outcome: Outcome, store: Store) -> dict[str, Any]:
    """``decisions`` and ``limits`` of each run; ``truths``: what they decide, and in which files their numbers lie.

    ``late``: truths that ran out of time, and runs, themselves, in a rung of their ladder or in their truth.
    """
    late = []
    points = {name: f"point {number}" for number, name in enumerate(outcome.points)}  # an edge is a found number
    decisions: dict[str, Any] = {}
    limits: dict[str, Any] = {}
    for run in outcome.runs:
        # A row need not be unique: the same engine may stand twice, for other points.
        number = sum(key.startswith(f"{run.row.engine} ") for key in decisions)
        key = f"{run.row.engine} {points[point_name(run.parameters)]} #{number}"
        decisions[key] = _decisions(run, outcome, store)
        point = outcome.points.get(point_name(run.parameters))
        ended = [run.result, *(rung.result for rung in run.rungs), *([point.result] if point else [])]
        if any(result.status == Status.TIMEOUT for result in ended):
            late.append(key)
        limits[key] = {
            item.observable: [item.limit_error, _bar(item)] for item in run.judgements if item.limit_error is not None
        }
    truths = {}
    for name, point in outcome.points.items():
        if point.result.status == Status.TIMEOUT:
            late.append(f"{TRUTH} {points[name]}")
        if point.reference is not None:
            said = {"ill_posed": point.reference.ill_posed, "events": _events(point.scene, point.reference.dataset)}
            truths[points[name]] = {"decisions": said, "file": point.trajectory.file.name}
    return {"decisions": decisions, "limits": limits, "truths": truths, "late": late}


def _decisions(run: Run, outcome: Outcome, store: Store) -> dict[str, Any]:
    events: Any = None
    if run.case is not None and run.result.status == Status.DONE and run.result.trajectory is not None:
        point = outcome.points[point_name(run.parameters)]
        true = _events(point.scene, point.reference.dataset) if point.reference else {}
        found = _events(point.scene, read(store.trajectory(run.case)))
        events = {name: until_wrong(kinds, true.get(name, kinds)) for name, kinds in found.items()}
    return {
        "status": run.result.status,
        "verdict": run.verdict,
        "judgements": {item.observable: [item.verdict, item.limit, len(item.remarks)] for item in run.judgements},
        "causes": [[one.element, one.cause.id] for one in run.diagnosis],
        "certificate": [[line["quantity"], line["holds"]] for line in run.result.certificate],
        "missing": run.missing,
        "contradictions": len(run.contradictions),
        "events": events,
    }


def _bar(item: Judgement) -> float:
    """Error bar of a limit, with the round-off that no verdict depends on."""
    return (item.limit_error_bar or 0.0) + item.truth_error_bar + round_off_of("double", item.scale)


def _events(scene: Scene, dataset: Any) -> dict[str, list[str]]:
    found = {}
    for element in scene.elements:
        found[element.name] = [event.kind for event in events_of(part(scene, element, dataset))]
    return found


def until_wrong(found: list[str], true: list[str]) -> list[str]:
    """Events of an engine up to the first that the truth does not have, which stands as :data:`WRONG`.

    After a wrong event a run is another motion, whose chatter may hang on round-off; no decision does.
    """
    same = next((k for k, pair in enumerate(zip(found, true, strict=False)) if len(set(pair)) > 1), len(true))
    return found[:same] + [WRONG] * (len(found) > same)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except ProofrollError as error:
        raise SystemExit(str(error)) from None
