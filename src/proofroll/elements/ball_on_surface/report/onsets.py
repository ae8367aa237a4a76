"""Bounded friction in the report: what happened when, in the truth and in every run, and how well that is posed."""

from __future__ import annotations

import dataclasses
import json
from typing import TYPE_CHECKING, Any

from proofroll.core.events import Event, events_of
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.onset_study import onset_verdict as judged_onset
from proofroll.files.json_data import plain
from proofroll.files.netcdf import read_some
from proofroll.studies.planning import point_name
from proofroll.truth.onset import Onset

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    import xarray as xr

    from proofroll.core.scene import Scene
    from proofroll.running.store import Store
    from proofroll.studies.outcome import Run

# The curve on which onsets are marked.
CURVE = "needed_friction"


def truth_facts(dataset: xr.Dataset, scene: Scene) -> dict[str, Any]:
    """What the report says of the truth's slips; nothing where friction has no bound."""
    if "onset" not in dataset.attrs:
        return {}
    contact = rolling_ball(scene).contact
    return {
        "mu_static": contact.mu_static,
        "mu_kinetic": contact.mu_kinetic,
        "onset": json.loads(dataset.attrs["onset"]),
        "events": [dataclasses.asdict(event) for event in events_of(dataset)],
    }


def run_facts(truths: Sequence[Mapping[str, Any]], runs: Sequence[Run], store: Store) -> list[dict[str, Any]]:
    """The ``events`` of each run, and where friction is bounded the ``onset_verdict``.

    Args:
        truths: of a comparison, with their :func:`truth_facts`.
        runs: of the comparison.
        store: where the trajectories are.
    """
    known = {truth["point"]: Onset(**truth["onset"]) for truth in truths if "onset" in truth}
    return [_run_facts(known.get(point_name(run.parameters)), run, store) for run in runs]


def _run_facts(truth: Onset | None, run: Run, store: Store) -> dict[str, Any]:
    if truth is None:
        return {"events": []}
    events = []
    if run.case is not None and run.result.trajectory is not None and store.trajectory(run.case).is_file():
        events = _events(store.trajectory(run.case))
    first = next((event for event in events if event.kind == "slip"), None)
    told = [plain(dataclasses.asdict(event)) for event in events]
    return {"events": told, "onset_verdict": judged_onset(truth, run.result, first)}


def mark(content: dict[str, Any], curves: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The curves of a comparison with the bounds of friction and every first slip on that of needed friction."""
    marked = []
    for entry in curves:
        truth = next((t for t in content["truths"] if t["point"] == entry["point"] and "onset" in t), None)
        observables = entry["observables"]
        if truth is not None:
            runs = [(-1, truth)] + [(run["row"], run) for run in content["runs"] if run["point"] == entry["point"]]
            firsts = [(row, first_slip(item["events"])) for row, item in runs]
            bounds = {"static": truth["mu_static"], "kinetic": truth["mu_kinetic"]}
            added = {
                "marks": [{"row": row, "time": first["time"]} for row, first in firsts if first is not None],
                "bounds": [
                    {"name": f"μ {name}", "value": value}
                    for name, value in bounds.items()
                    if value is not None and (name == "static" or value != bounds["static"])
                ],
            }
            observables = [{**item, **added} if item["name"] == CURVE else item for item in observables]
        marked.append({**entry, "observables": observables})
    return marked


def first_slip(events: list[dict[str, Any]]) -> dict[str, Any] | None:
    """The first slip that has a time."""
    return next((event for event in events if event["kind"] == "slip" and event["time"] is not None), None)


def _events(path: Path) -> list[Event]:
    """The events of a stored trajectory, without the rest of it."""
    columns = read_some(path, [f"event_{name}" for name in ("kind", "time", "low", "high")])
    if not columns:
        return []
    kinds, *times = (values.tolist() for values in columns.values())
    return [Event(*row) for row in zip(kinds, *times, strict=True)]
