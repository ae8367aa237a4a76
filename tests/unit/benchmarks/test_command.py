"""``python -m proofroll_benchmarks`` as a user meets it. No exit code hangs on speed."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from proofroll import cli
from proofroll.report.terminal.screen import console
from proofroll_benchmarks.command import bench
from proofroll_benchmarks.tables import study_lines, study_tables

Proofroll = Callable[..., tuple[int, str, str]]
QUICK = ("--rounds", "2", "--seconds", "0.005")
INTERVAL = {"value", "low", "high", "confidence"}


@pytest.fixture
def proofroll(
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    install_engines: Callable[[Mapping[str, str]], None],
) -> Proofroll:
    """Runs the command line in this process; exit code, standard output, standard error."""
    install_engines({"tiny": "tiny:Tiny"})
    monkeypatch.setenv("COLUMNS", "100")

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["proofroll_benchmarks", *arguments])
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main(bench)
        captured = capfd.readouterr()
        assert isinstance(ended.value.code, int)
        return ended.value.code, captured.out, captured.err

    return run


@pytest.mark.nightly
def test_adapters_json(proofroll: Proofroll, tmp_path: Path) -> None:
    """``--json`` has a ratio with its interval for the engine that was asked for, and says of each row what it is."""
    kept = tmp_path / "bench.json"
    code, out, err = proofroll("adapters", "--engine", "projection", *QUICK, "--json", "--out", str(kept))
    assert code == 0, err
    assert kept.read_text(encoding="utf-8") == out
    found = json.loads(out)
    assert set(found) == {"goal", "scene", "mechanisms", "every", "machine", "engines"}
    assert set(found["engines"]) == {"projection"}
    engine = found["engines"]["projection"]
    assert set(engine["ratio"]) == INTERVAL
    assert engine["ratio"]["value"] > 0
    assert {row["formulation"] for row in engine["rows"]} == {"euler", "rotating_frame", "dependent"}
    for row in engine["rows"]:
        assert not row["failed"]
        assert set(row["ratio"]) == INTERVAL
        assert row["distance"] <= row["tolerance"]
        assert row["adapter"] > 0
        assert row["because"]


@pytest.mark.drill
def test_an_engine_without_a_bare_loop(proofroll: Proofroll) -> None:
    """Alone, such an engine has a table that says so, within 100 columns, and the exit code of an engine missing."""
    code, out, _ = proofroll("adapters", "--engine", "tiny", *QUICK)
    assert code == 3
    assert "no bare loop is announced for tiny" in " ".join(out.split())
    assert max(map(len, out.splitlines())) <= 100


@pytest.mark.parametrize("command", ["adapters", "study"])
def test_an_engine_that_does_not_exist(proofroll: Proofroll, command: str) -> None:
    """It is wrong usage: one line, and nothing on standard output."""
    code, out, err = proofroll(command, "--engine", "nothing", "--json")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1


@pytest.mark.nightly
@pytest.mark.own_workers  # what a first answer costs is measured
def test_study(proofroll: Proofroll, capfd: pytest.CaptureFixture[str]) -> None:
    """``--json`` has the part outside the engines, shares that add up, all cases, and what a first answer costs.

    For a person the same is tables within 100 columns.
    """
    code, out, err = proofroll("study", "--engine", "tiny", "--seconds", "0.05", "--json")
    assert code == 0, err
    found = json.loads(out)
    assert set(found) == {
        "goal", "jobs", "load_before", "wall_seconds", "outside", "within_goal", "shares", "processor", "cases",
        "first_answer",
    }  # fmt: skip
    assert 0 < found["outside"] < 1
    assert sum(found["shares"].values()) == pytest.approx(1)
    assert len(found["cases"]) == 2
    assert all(case["status"] == "done" and case["spent"]["advance"] > 0 for case in found["cases"])
    assert found["first_answer"]["tiny"] > 0
    for part in (*study_tables(found), *study_lines(found)):
        console().print(part)
    table = capfd.readouterr().out
    assert "outside the engines" in " ".join(table.split())
    assert max(map(len, table.splitlines())) <= 100


@pytest.mark.parametrize("met", [True, False])
def test_a_goal_that_is_not_met_fails_nothing(proofroll: Proofroll, monkeypatch: pytest.MonkeyPatch, met: bool) -> None:
    """Whether a benchmark met its goal stands in the document; the exit code does not hang on the machine."""
    ratio = {"value": 2.0, "low": 1.0, "high": 3.0, "goal": 2.0, "slow": "a", "fast": "b", "met": True}
    content = {"ratios": {"one": ratio, "other": {**ratio, "met": met}}, "onsets_per_second": ratio}
    monkeypatch.setattr("proofroll_benchmarks.reference.reference", lambda *_: content)
    code, out, _ = proofroll("reference", "--json")
    assert code == 0
    assert json.loads(out) == content


def test_bench_alone(proofroll: Proofroll) -> None:
    """Without a command it is wrong usage, said in one line, and not the help squeezed into one."""
    code, out, err = proofroll()
    assert (code, out) == (2, "")
    assert err == "proofroll: Missing command.\n"
