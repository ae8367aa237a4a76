"""Findings about engines: files that are sound, programs whose exit codes are read rightly."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from proofroll.cli import app
from proofroll.core.errors import InputError, Missing
from proofroll.studies.findings import EngineFinding, FindingState, load_findings, read_finding, run_findings


def made(program: str, package: str = "numpy") -> EngineFinding:
    """A finding with this program."""
    return EngineFinding("made", "it does", "numpy", package, "1", "", "", "text", program)


def test_every_file_is_sound() -> None:
    """Each file names engine, versions and remedy, its issue is an address, and its program can say both."""
    found = load_findings()
    assert len(found) >= 15
    for item in found:
        assert item.title
        assert item.seen
        assert item.issue == "" or item.issue.startswith("https://github.com/")
        assert "## What happens" in item.text
        assert "## What to do" in item.text
        compile(item.program, item.name, "exec")
        assert "SystemExit(10 if" in item.program


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("program", "state"),
    [
        ("print('here')\nraise SystemExit(10)", FindingState.SHOWS),
        ("print('here')", FindingState.GONE),
        ("raise ValueError('here')", FindingState.BROKEN),
        ("print('here'); import os; os.abort()", FindingState.BROKEN),
    ],
)
def test_exit_codes_are_read(program: str, state: FindingState) -> None:
    """Exit code 10 shows, 0 is gone, and a program that fails could not tell; the last line is what it says."""
    (row,) = run_findings([made(program)])
    assert row.state == state
    assert state == FindingState.BROKEN or row.said == "here"
    assert row.version


@pytest.mark.drill
def test_what_cannot_be_run_is_said() -> None:
    """An engine that is not installed is no verdict; an interpreter that does not exist is named; a hang is ended."""
    (row,) = run_findings([made("", "no-such-engine")])
    assert row.state == FindingState.NOT_INSTALLED
    with pytest.raises(Missing, match="/no/such/python is no Python interpreter"):
        list(run_findings([made("")], "/no/such/python"))


_STARTS_A_HELPER = """
import subprocess, sys, time
output = {{}} if {seconds} else {{"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}}
helper = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(300)"], **output)
open({note!r}, "w").write(str(helper.pid))
time.sleep({seconds})
"""


@pytest.mark.drill
@pytest.mark.parametrize("seconds", [0, 300])
def test_a_program_ends_with_what_it_started(tmp_path: Path, seconds: int) -> None:
    """A helper that holds the output of a program is not waited for, and ends with it, also at the limit of time."""
    program = _STARTS_A_HELPER.format(note=str(tmp_path / "helper"), seconds=seconds)
    (row,) = run_findings([made(program)], time_limit=300.0 if not seconds else 2.0)
    assert row.state == (FindingState.BROKEN if seconds else FindingState.GONE)
    status = Path(f"/proc/{(tmp_path / 'helper').read_text()}/stat")
    deadline = time.monotonic() + 30
    while (alive := status.exists() and status.read_text().split()[2] not in "ZX") and time.monotonic() < deadline:
        time.sleep(0.05)  # the system takes a moment to end it
    assert not alive


@pytest.mark.drill
def test_modules_of_the_working_folder_are_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files named as modules of Python that lie where the command is called are not run."""
    for name in ("json", "random"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit(10)")
    monkeypatch.chdir(tmp_path)
    (row,) = run_findings([made("import json, random")])
    assert row.state == FindingState.GONE


@pytest.mark.parametrize(
    ("text", "problem"),
    [("no front", "begin with TOML"), ("+++\ntitle = \n+++\n", "cannot be read"), ("+++\n+++\n", "begin with TOML")],
)
def test_broken_files_give_one_line(tmp_path: Path, text: str, problem: str) -> None:
    """A file that is no finding is named with what is wrong."""
    file = tmp_path / "broken.md"
    file.write_text(text)
    with pytest.raises(InputError, match=problem):
        read_finding(file)


@pytest.mark.nightly
def test_the_command_tells_states_and_versions() -> None:
    """The command runs the findings of one engine in an interpreter and tells each with its state and version."""
    options = ["findings", "--engine", "pinocchio", "--python", sys.executable, "--json"]
    done = CliRunner().invoke(app, options)
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout)
    states = {row["name"]: row["state"] for row in content["findings"]}
    assert states["pinocchio_crba_order"] in {"still shows", "gone"}
    assert sum(content["counts"].values()) == len(states) >= 4
