"""Two reports held against each other: what changed, and nothing else."""

from __future__ import annotations

import json
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import table_lines

from proofroll.core.errors import InputError
from proofroll.files.json_data import plain
from proofroll.report.changes import Against, EarlierReport, against
from proofroll.report.long_table import LongTable, TableLine

LINE = table_lines.line(limit="", cost_low=9e-3, cost_high=0.011)
COST = {"cost": 0.01, "cost_low": 9.8e-3, "cost_high": 0.0102}
SLOW = {"cost": 0.02, "cost_low": 0.019, "cost_high": 0.021}
LINES = [LINE, replace(LINE, quantity="z", error=1e-13), replace(LINE, row=1, engine="beta", error=2e-9)]


def held(new: list[TableLine], machine: str = "here", old: list[TableLine] = LINES) -> Against:
    """The lines against earlier ones."""
    return against(
        EarlierReport(Path("old.json"), "2026-01-01", "here", {"alpha": "1"}, old), new, machine, {"alpha": "2"}
    )


def changed(number: int, **values: Any) -> list[TableLine]:
    """The lines with one of them changed."""
    return [replace(line, **values) if at == number else line for at, line in enumerate(LINES)]


def test_the_same_numbers_have_not_changed() -> None:
    """Nothing is said, and versions are told; round-off and errors within both bars are no change."""
    found = held(LINES)
    assert (found.changes, found.changed, found.compared) == ([], False, 2)
    assert found.sentence == "Of 2 runs in both reports, changed: nothing."
    assert found.versions == {"alpha": ("1", "2")}
    assert held(changed(1, error=3e-13)).changes == []
    assert held(changed(2, error=2.5e-9)).changes == [], "round-off of another processor"
    assert held(changed(0, truth_error_bar=1e-3, error=6e-4)).changes == [], "within the truth's bar"
    earlier = [replace(LINE, setting="default")]
    assert held([replace(LINE, setting="as installed")], old=earlier).compared == 1, "earlier reports have its own name"
    endless = [replace(LINE, error=math.inf)]
    assert held(endless, old=[replace(LINE, error=None)]).changes == [], "a file has none for what is not finite"


@pytest.mark.parametrize(
    ("values", "kind", "says"),
    [
        ({"error": 5.05e-4}, "value", "error of x 5e-4 → 5.1e-4 m"),
        ({"error": 5.01e-4}, "value", "error of x 5e-4 → 5.01e-4 m"),
        ({"error": 5.01e-4, "unit": "1"}, "value", "error of x 5e-4 → 5.01e-4"),
        ({"verdict": "differs", "error": 5e-2}, "verdict", "x agrees → differs"),
        ({"status": "crashed", "message": "it ended"}, "verdict", "done → crashed: it ended"),
        ({"error": None}, "value", "error of x 5e-4 → ∞ m"),
        (SLOW, "cost", "cost 0.01 (9e-3 to 0.011) → 0.02 (0.019 to 0.021) s/s"),
    ],
)  # fmt: skip
def test_one_change_is_found_and_nothing_else(values: dict[str, Any], kind: str, says: str) -> None:
    """One per cent of an error, a verdict, the end of a run, a cost beyond its interval: the run is named."""
    found = held(changed(0, **values))
    assert [(item.run, item.kind) for item in found.changes] == [("alpha joints as installed dt 1e-3 s", kind)]
    assert found.changes[0].says[0] == says
    assert found.changed


def test_costs_of_other_machines_are_not_compared() -> None:
    """They say nothing of the engine, and the report says that; intervals that meet are no change either."""
    assert held(changed(0, **SLOW), machine="there").changes == []
    assert "another machine" in held(LINES, machine="there").sentence
    assert held(changed(0, cost=0.012, cost_low=0.0105, cost_high=0.013)).changes == []


def test_a_machine_that_is_slower_throughout_accuses_no_engine() -> None:
    """Where most costs grew alike, that is told once; the run that grew by more is named."""
    old = [replace(LINE, row=number, engine=f"e{number}") for number in range(8)]
    slow = [replace(line, **SLOW) for line in old]
    found = held(slow, old=old)
    assert found.changes == []
    assert "costs are 2 of the old ones throughout" in found.sentence
    slow[3] = replace(slow[3], cost=0.05, cost_low=0.048, cost_high=0.052)
    assert [(item.run.split()[0], item.kind) for item in held(slow, old=old).changes] == [("e3", "cost")]


def test_costs_of_a_busy_machine_accuse_no_engine() -> None:
    """Where costs scatter by factors the report says so, and names only what is far beyond that."""
    old = [replace(LINE, row=number, engine=f"e{number}") for number in range(9)]
    ratios = (1.0, 1.2, 1.7, 0.8, 1.0, 0.7, 1.3, 2.2, 1.1)
    new = [
        replace(line, **{name: value * ratio for name, value in COST.items()})
        for line, ratio in zip(old, ratios, strict=True)
    ]
    found = held(new, old=old)
    assert found.changes == []
    assert "costs scatter, so that only those count that differ by a factor of" in found.sentence
    new[4] = replace(new[4], cost=0.2, cost_low=0.19, cost_high=0.21)
    assert [(item.run.split()[0], item.kind) for item in held(new, old=old).changes] == [("e4", "cost")]


def test_costs_without_intervals_show_how_the_machine_scatters() -> None:
    """Where few costs have intervals, the others tell how much slower the machine was, and how they scatter."""
    old = [replace(LINE, row=at, engine=f"e{at}", cost_low=None, cost_high=None) for at in range(11)]
    old[5] = replace(old[5], cost=0.11, cost_low=0.091, cost_high=0.13)
    ratios = (1.31, 1.27, 1.02, 0.62, 0.56, 0.53, 0.73, 0.44, 1.11, 0.72, 0.74)
    new = [replace(line, cost=ratio * float(line.cost or 0)) for line, ratio in zip(old, ratios, strict=True)]
    new[5] = replace(new[5], cost_low=0.054, cost_high=0.063)
    assert held(new, old=old).changes == []
    rough = [replace(line, clean=at == 5) for at, line in enumerate(old)]
    assert held([replace(line, clean=at == 5) for at, line in enumerate(new)], old=rough).changes == []
    new[5] = replace(new[5], cost=1.1, cost_low=1.0, cost_high=1.2)
    assert [(item.run.split()[0], item.kind) for item in held(new, old=old).changes] == [("e5", "cost")]


def test_runs_that_are_gone_count_and_new_ones_do_not() -> None:
    """A run that is not made any more is a change; one that is new is told; other studies are left alone."""
    assert [(item.kind, item.run) for item in held(LINES[:2]).changes] == [
        ("gone", "beta joints as installed dt 1e-3 s")
    ]
    assert held(LINES[:2]).changed
    more = held([*LINES, replace(LINE, row=2, engine="gamma")])
    assert [item.kind for item in more.changes] == ["new"]
    assert not more.changed
    assert held([*LINES, replace(LINE, study="chain")]).changes == []


def test_a_report_is_read_from_its_file(tmp_path: Path) -> None:
    """What a report wrote is what is read; columns of a later version are left out; other files are one line."""
    file = tmp_path / "report.json"
    said = {"date": "2026-01-01", "environment": {"machine": "here", "versions": {}}, "table": plain(LongTable(LINES))}
    said["table"]["columns"] = [*said["table"]["columns"], "later"]
    said["table"]["data"] = [[*row, 1] for row in said["table"]["data"]]
    file.write_text(json.dumps(said), encoding="utf-8")
    assert EarlierReport.read(file).lines == LINES
    file.write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="with a long table"):
        EarlierReport.read(file)
    with pytest.raises(InputError, match="cannot be read"):
        EarlierReport.read(tmp_path / "absent.json")
    os.mkfifo(pipe := tmp_path / "pipe.json")
    with pytest.raises(InputError, match="no ordinary file"):
        EarlierReport.read(pipe)
    file.write_text("[" * 100_000)
    with pytest.raises(InputError, match="with a long table"):
        EarlierReport.read(file)


def test_runs_that_changed_alike_share_a_line() -> None:
    """A terminal tells a change once, with all runs that have it, and another change beside it."""
    new = [replace(line, verdict="another-scene") for line in LINES[:2]] + changed(2, error=2e-3)[2:]
    old = [*LINES, *(replace(line, study="chain") for line in LINES[:2])]
    found = held([*new, *(replace(line, study="chain") for line in new[:2])], old=old)
    head, versions, both, other = found.lines
    assert head.startswith("Against old.json of 2026-01-01. Of 3 runs in both reports, changed: 2 verdicts, 1 errors")
    assert versions == "Other versions: alpha 1 → 2."
    runs = "arm: alpha joints as installed dt 1e-3 s; chain: alpha joints as installed dt 1e-3 s"
    assert both == f"!! {runs}: x agrees → another-scene; z agrees → another-scene (2 runs)"
    assert other == "!! arm: beta joints as installed dt 1e-3 s: error of x 2e-9 → 2e-3 m"


def test_a_comment_has_each_change_once() -> None:
    """Markdown of the changes has the sentence, versions and a row for each change; a bar in a message ends no cell."""
    crashed = held(changed(2, status="crashed", message="a|b"))
    head, versions, table = crashed.markdown.strip().split("\n\n")
    assert head == f"**proofroll**, against the report of 2026-01-01: {crashed.sentence}"
    assert versions == "Other versions: alpha 1 → 2."
    assert table.splitlines()[2:] == ["| done → crashed: a\\|b | arm: beta joints as installed dt 1e-3 s |"]
    same = held(LINES).markdown
    assert "|" not in same


def test_costs_of_another_machine_are_told_in_one_ratio() -> None:
    """Costs of two machines are not compared one by one, and their common ratio is told."""
    lines = [replace(line, row=row, quantity="x") for row, line in enumerate([LINE] * 6)]
    slower = [replace(line, cost=3 * (line.cost or 0.0)) for line in lines]
    far = held(slower, "there", old=lines)
    assert (far.costs, far.machines, far.changes) == (False, ("here", "there"), [])
    assert "costs are of another machine, 3 of the old ones in the middle" in far.sentence
