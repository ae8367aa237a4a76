"""All that the report says, as plain data."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from proofroll.files.json_data import plain
from proofroll.files.netcdf import read
from proofroll.files.scene_file import load_scene
from proofroll.report.comparison_content import by_row, environment, outcome_content
from proofroll.report.evidence import claims, cost
from proofroll.report.findings import findings
from proofroll.report.growth import growth
from proofroll.report.kinds import kind_of
from proofroll.report.scene_sheet import scene_sheet
from proofroll.report.study_parts import part_kinds
from proofroll.report.summary import three_sentences
from proofroll.studies.findings import load_findings

if TYPE_CHECKING:
    from proofroll.running.store import Store
    from proofroll.studies.outcome import Outcome


def report_content(outcomes: list[Outcome], store: Store, command: str) -> dict[str, Any]:
    """All that the report says, as plain data.

    ``findings`` on the whole, ``engine_findings`` (what is known of engines), ``comparisons``, ``awaited`` (titles of
    comparisons that are still being run), the entries of further studies under the key of their kind, ``date`` and
    ``environment``. Paths of files are relative to the folder of the report.
    """
    comparisons = [_comparison(outcome, store) for outcome in outcomes]
    versions: dict[str, str] = {}
    for outcome in outcomes:
        for run in outcome.runs:
            versions |= run.result.versions
    content = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "comparisons": comparisons,
        "awaited": [],
        "engine_findings": [
            {key: getattr(item, key) for key in ("name", "engine", "title", "seen", "gone")} for item in load_findings()
        ],
        **{kind.key: [] for kind in part_kinds()},
        "environment": environment(command, versions),
    }
    content["findings"] = {"sentences": three_sentences(content)}
    return dict(plain(content))


def _comparison(outcome: Outcome, store: Store) -> dict[str, Any]:
    """A comparison's content with its truths, what its kind of scene tells of each run, claims, costs and findings."""
    content, truths = outcome_content(outcome), _truths(outcome, store)
    kind = kind_of(load_scene(outcome.comparison.scene))
    facts = kind.run_facts(truths, outcome.runs, store) if kind is not None else [{} for _ in outcome.runs]
    runs = [
        {
            **entry,
            "trajectory": entry["trajectory"] and f"{store.folder.name}/{entry['trajectory']}",
            **of_kind,
            "cost": cost(run.result.timings),
        }
        for entry, run, of_kind in zip(content["runs"], outcome.runs, facts, strict=True)
    ]
    rows = [
        {**entry, "claims": claims(of_row[0].row)}
        for entry, of_row in zip(content["rows"], by_row(outcome).values(), strict=True)
    ]
    sheet = scene_sheet(outcome.comparison.scene, [case.parameters for case in outcome.truths.values()])
    told: dict[str, Any] = plain({**content, "rows": rows, "runs": runs, "truths": truths, "sheet": sheet})
    return {**told, "findings": findings(told), "growth": growth(told)}


def _truths(outcome: Outcome, store: Store) -> list[dict[str, Any]]:
    """For each point where the truth comes from and how well it is known."""
    found = []
    for name, case in outcome.truths.items():
        path = store.trajectory(case)
        entry: dict[str, Any] = {
            "point": name,
            "parameters": case.parameters,
            "trajectory": f"{store.folder.name}/{path.name}",
            "wall_seconds": result.wall_seconds if (result := store.get(case)) is not None else None,
        }
        if path.is_file():
            dataset = read(path)
            entry |= {key: dataset.attrs.get(key, "") for key in ("route", "second_route")}
            scene = load_scene(case.scene, **case.parameters)
            observables = scene.observables
            entry["error_bars"] = {
                str(key): {"value": float(curve.attrs["error_bar"]), "unit": curve.attrs["units"]}
                for key, curve in dataset.data_vars.items()
                if (curve.dims == ("time",) or key in observables) and "error_bar" in curve.attrs
            }
            kind = kind_of(scene)
            entry |= kind.truth_facts(scene, dataset) if kind is not None else {}
        found.append(entry)
    return found
