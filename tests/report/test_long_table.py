"""The long table: all numbers of a report in one frame."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.verdict import Verdict
from proofroll.report.comparison.lines import _ended, lines_of
from proofroll.report.long_table import LongTable
from proofroll.report.page.growing import begun
from proofroll.report.page.records import ReportContent
from proofroll.running.case import Result, Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.outcome import Outcome

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_every_judgement_of_every_run_is_a_line(content: ReportContent) -> None:
    """The table has each error, bar, tolerance and verdict of the records, and a line for a run without any."""
    for comparison in content.comparisons:
        for run in comparison.runs:
            lines = [
                line
                for line in content.table.lines
                if (line.study, line.row, line.place) == (comparison.name, run.row, run.point)
            ]
            found = [(x.quantity, x.error, x.truth_error_bar, x.tolerance, x.verdict) for x in lines if x.quantity]
            said = [(x.observable, x.error, x.truth_error_bar, x.tolerance, x.verdict) for x in run.judgements]
            assert found == said
            assert lines, "a run that is missing has a line too"
            assert {line.cost for line in lines} == {run.seconds_per_second}
            assert {line.status for line in lines} == {run.status}


@pytest.mark.nightly
def test_a_rung_of_a_ladder_is_a_line_without_verdict(tmp_path: Path) -> None:
    """The runs with other steps are in the table with their own errors and the cost of their sampled run."""
    row = Row("projection[formulation=euler,preset=default]", "close", list(Verdict), because="a look")
    row = dataclasses.replace(row, ladder=[1.0, 0.5, 0.25])
    band = Band("a look", {"z": Tolerance(1e-3, False, "m")})
    asked = Comparison("ladder", "A ladder", "?", "sphere_in_cylinder", 0.2, 0.1, bands={"close": band}, rows=[row])
    outcome = compare(dataclasses.replace(asked, timed=False), Runner(Store(tmp_path), jobs=1))
    lines = [line for line in lines_of(outcome) if line.quantity == "z"]
    by_step = {line.step: line for line in lines}
    assert sorted(by_step) == [2.5e-4, 5e-4, 1e-3]
    main = max(by_step)
    assert by_step[main].verdict
    errors = [by_step[step].error for step in sorted(by_step)]
    assert errors == sorted(errors)
    assert errors[-1] > 2 * errors[0]
    for step, line in by_step.items():
        assert line.cost is not None
        assert not line.clean
        if step != main:
            assert line.verdict == ""


def test_a_rough_cost_is_without_time_of_other_processes() -> None:
    """Without clean runs the processor time counts; several threads, or a worker that does not tell, count by wall."""
    outcome: Any = SimpleNamespace(comparison=SimpleNamespace(until=0.5))
    for processor, cost in (({"advance": 0.25}, 0.5), ({"advance": 3.0}, 2.0), ({}, 2.0)):
        result = Result(Status.DONE, "", wall_seconds=1.0, processor=processor)
        assert _ended(outcome, result)["cost"] == cost


@pytest.mark.nightly
def test_the_documented_line_reads_the_table(
    made: tuple[Outcome, Store], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lines of docs/json.md give pandas the same frame from JSON and from CSV."""
    whole = begun([made[0]], "proofroll report")
    (tmp_path / "out").mkdir()
    whole.write(tmp_path / "out")
    text = (DOCS / "json.md").read_text(encoding="utf-8")
    program = re.search(r"```python\n(import json.*?)```", text, flags=re.DOTALL)
    assert program is not None
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(program[1], names)
    frame, same = names["frame"], names["same"]
    assert len(frame) == len(whole.content.table.lines)
    assert set(frame.study) == {"invented"}
    for name in frame:
        both = zip(frame[name].astype(object), same[name].astype(object), strict=True)
        assert all(one == other or ((one in ("", None) or pd.isna(one)) and pd.isna(other)) for one, other in both), (
            name
        )
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", _section(text), flags=re.MULTILINE)
    fields = {name for row in rows for name in re.findall(r"\w+", row)}
    assert fields == set(frame.columns)
    content = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert len(content["table"]["data"]) == len(frame)


def test_brackets_in_a_sentence_leave_the_json_readable(made: tuple[Outcome, Store], tmp_path: Path) -> None:
    """A matrix in a text, as in the source of a scene, is not taken for two lines of the table."""
    asked = "Is it [[1, n], [n, n^2]]?"
    comparison = dataclasses.replace(made[0].comparison, question=asked)
    begun([dataclasses.replace(made[0], comparison=comparison)], "proofroll report").write(tmp_path)
    content = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert content["comparisons"][0]["question"] == asked


def _section(text: str) -> str:
    found = re.search(r"^## The long table\n(.*?)(?=^## |\Z)", text, flags=re.DOTALL | re.MULTILINE)
    assert found is not None
    return found[1]


def test_infinite_numbers_are_empty(content: ReportContent) -> None:
    """A number that is not finite is none in JSON and an empty field in CSV."""
    line = dataclasses.replace(content.table.lines[0], error=math.inf)
    (values,) = csv.DictReader(LongTable([line]).csv.splitlines())
    assert values["error"] == ""
