"""Reports over time: read from a folder, held one against the next, and drawn."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

import pytest
from browsing import Visit
from table_lines import ARM

from proofroll.core.errors import InputError
from proofroll.files.json_data import plain
from proofroll.report.history import read_history, write_history
from proofroll.report.long_table import LongTable, TableLine


def keep(folder: Path, date: str, version: str, lines: list[TableLine]) -> None:
    """Writes a report of a night."""
    folder.mkdir(parents=True)
    made = {"environment": {"machine": "m", "versions": {"alpha": version}}, "date": date}
    table = plain(LongTable([replace(line, version=version) for line in lines]))
    (folder / "report.json").write_text(json.dumps(made | {"table": table}))


@pytest.fixture
def nights(tmp_path: Path) -> Path:
    """Three nights: at the second nothing changes, at the third the new version's force is one per cent off."""
    worse = [replace(line, error=1.01 * (line.error or 0.0)) if line.quantity == "F" else line for line in ARM]
    keep(tmp_path / "nights" / "c", "2026-11-03T01:00:00", "1.1", worse)
    keep(tmp_path / "nights" / "a", "2026-11-01T01:00:00", "1.0", ARM)
    keep(tmp_path / "nights" / "b", "2026-11-02T01:00:00", "1.0", ARM)
    return tmp_path / "nights"


def test_reports_are_ordered_and_held_one_against_the_next(nights: Path) -> None:
    """By date, whatever their names; what changed is told at the night when it did, and with which version."""
    found = read_history(nights)
    assert [date[8:10] for date in found.dates] == ["01", "02", "03"]
    assert [len(step.changes) for step in found.steps] == [0, 3]
    assert found.steps[1].versions == {"alpha": ("1.0", "1.1")}
    (alpha,) = found.engines
    assert alpha.versions == ["1.0", "1.0", "1.1"]
    assert all(run.changed for run in alpha.runs)
    assert alpha.runs[0].errors == pytest.approx([3e-2, 3e-2, 3.03e-2])
    lines = list(found.lines())
    assert lines[0].startswith("2026-11-02 against")
    assert "changed: nothing" in lines[0]
    assert "alpha 1.0 → 1.1" in lines[2]


def test_the_page_stands_alone(
    nights: Path, tmp_path: Path, visit: Callable[..., AbstractContextManager[Visit]]
) -> None:
    """One file with a picture and a table for each engine; versions are on the axis, and nothing is loaded."""
    write_history(read_history(nights), tmp_path / "out")
    page = (tmp_path / "out" / "history.html").read_text(encoding="utf-8")
    assert "http:" not in page
    with visit(tmp_path / "out" / "history.html") as opened:
        assert opened.messages == []
        assert opened.page.locator("figure svg").count() == 1
        row = opened.page.locator("[aria-label='Verdicts of alpha'] tbody tr").last.inner_text()
        assert "1.1" in row
    assert json.loads((tmp_path / "out" / "history.json").read_text())["engines"][0]["versions"] == [
        "1.0",
        "1.0",
        "1.1",
    ]


def test_a_panel_without_costs_says_why(nights: Path, tmp_path: Path) -> None:
    """Where no clean run measured a cost, the panel of costs is not empty but says so; elsewhere it does not."""
    written = tmp_path / "out" / "history.html"
    write_history(read_history(nights), written.parent)
    timed = written.read_text(encoding="utf-8")
    for name, date in (("x", "2026-11-01"), ("y", "2026-11-02")):
        keep(tmp_path / "untimed" / name, f"{date}T01:00:00", "1.0", [replace(line, clean=False) for line in ARM])
    write_history(read_history(tmp_path / "untimed"), written.parent)
    assert "no cost was measured" not in timed
    assert "no cost was measured" in written.read_text(encoding="utf-8")


def test_too_few_reports_are_told(nights: Path) -> None:
    """One report has no history; a file that is no report is named."""
    with pytest.raises(InputError, match="1 reports there"):
        read_history(nights / "a")
    (nights / "notes.json").write_text("{}")
    with pytest.raises(InputError, match=r"notes\.json"):
        read_history(nights)


def test_the_command_runs_nothing(proofroll: Callable[..., tuple[int, str, str]], nights: Path, tmp_path: Path) -> None:
    """It reads the folder, writes its two files, and says what changed when."""
    code, out, err = proofroll("report", "--history", str(nights), "--out", str(tmp_path / "out"))
    assert (code, err) == (0, "")
    assert "The history is in" in out
    assert "error of F" in " ".join(out.split())
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["history.html", "history.json"]
