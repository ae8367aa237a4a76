"""The matrix: comparisons and tests under each kind of arithmetic, and what differs from the machine as it is."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from proofroll.files.data_folders import data_folder
from proofroll.running.case import Status
from proofroll_drill.arithmetic.differences import Difference, differences, late
from proofroll_drill.arithmetic.kinds import REPOSITORY, Arithmetic, make_ready, took_effect

_RECORD = "from proofroll_drill.arithmetic.record import main; import sys; main(*sys.argv[1:])"
# The tests that a change of the last digits may reach, by a mark (pyproject.toml): without drills, without the longest
# or with them; or all tests.
TESTS = {
    "quick": "arithmetic and not drill",
    "sensitive": "arithmetic and not nightly",
    "nightly": "arithmetic",
    "all": "",
}


@dataclass(frozen=True)
class Tried:
    """Result of one kind of arithmetic.

    Attributes:
        kind: its name.
        says: difference in words.
        untried: why it was not tried; empty: it was.
        runs: number of runs compared with the reference.
        differences: deviations from the reference.
        failed: tests that failed, by name; or how the runs, or pytest without a test, ended.
        passed: the last line of pytest; empty: no tests were asked for.
        late: runs that ran out of time, here or in the reference: they are compared with nothing.
    """

    kind: str
    says: str
    untried: str = ""
    runs: int = 0
    differences: list[Difference] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    passed: str = ""
    late: list[str] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """True if nothing depends on this kind of arithmetic, as far as it was tried: all runs late are no try."""
        return not self.differences and not self.failed and (bool(self.runs) or not self.late)


def comparison_files() -> list[str]:
    """All comparisons of this repository, its own, those of the folders below and of articles; and its studies."""
    from proofroll.files.comparison_file import comparison_names
    from proofroll_drill.arithmetic.studies import study_names

    return [*comparison_names(), *map(str, sorted(data_folder("comparisons").glob("*/*.toml"))), *study_names()]


def matrix(
    kinds: Sequence[Arithmetic],
    comparisons: Sequence[str],
    tests: str = "",
    out: Path | None = None,
    jobs: int = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> list[Tried]:
    """Runs ``comparisons`` and ``tests`` (a key of :data:`TESTS`) under each kind; the first is the reference.

    Each kind has a folder of its own under ``out``, with a fresh store: no result of one arithmetic reaches another.
    """
    with tempfile.TemporaryDirectory() as temporary:
        place = out or Path(temporary)
        return _matrix(kinds, comparisons, tests, place, jobs, progress)


def _matrix(
    kinds: Sequence[Arithmetic],
    comparisons: Sequence[str],
    tests: str,
    place: Path,
    jobs: int,
    progress: Callable[[str], None],
) -> list[Tried]:
    found: list[Tried] = []
    reference: Any = None
    for kind in kinds:
        progress(kind.name)
        folder = place / kind.name
        why = kind.untried or _made_ready(kind) or took_effect(kind, folder / "site")
        if why:
            found.append(Tried(kind.name, kind.says, why))
            continue
        try:
            record = _recorded(kind, comparisons, folder, jobs)
        except subprocess.CalledProcessError as error:
            if reference is None:
                raise
            ended = f"its comparisons ended with exit code {error.returncode}"
            found.append(Tried(kind.name, kind.says, failed=[ended]))
            continue
        if reference is None:
            reference = place / kind.name, record
        records = reference[1], record
        parted = list(differences(kind.name, reference[0], folder, records))
        failed, passed = _tested(kind, tests, folder, jobs) if tests else ([], "")
        slow = late(records)
        runs = sum(
            said["status"] != Status.MISSING and f"{comparison}: {run}" not in slow
            for comparison, item in record.items()
            for run, said in item["decisions"].items()
        )
        found.append(Tried(kind.name, kind.says, "", runs, parted, failed, passed, slow))
    return found


def _made_ready(kind: Arithmetic) -> str:
    try:
        make_ready(kind)
    except subprocess.CalledProcessError as error:
        return f"proofroll cannot be installed for {kind.says}: exit code {error.returncode}"
    return ""


def _recorded(kind: Arithmetic, comparisons: Sequence[str], folder: Path, jobs: int) -> dict[str, Any]:
    if not comparisons:
        return {}
    command = [kind.python, "-c", _RECORD, str(folder), str(kind.threads), str(jobs), *comparisons]
    subprocess.run(command, env=kind.variables(folder / "site"), check=True, stdout=sys.stderr)
    recorded: dict[str, Any] = json.loads((folder / "record.json").read_text(encoding="utf-8"))
    return recorded


def _with(mark: str) -> list[str]:
    """Files of tests with a mark: to collect all others would take a fifth of the time of these."""
    files = sorted((REPOSITORY / "tests").rglob("test_*.py"))
    return [str(file) for file in files if f"pytest.mark.{mark}" in file.read_text(encoding="utf-8")]


def _tested(kind: Arithmetic, tests: str, folder: Path, jobs: int) -> tuple[list[str], str]:
    """Tests that failed, and the last line of pytest."""
    command = [
        kind.python,
        "-m",
        "pytest",
        "-q",
        "-n",
        str(jobs if jobs > 1 else 0),
        "-p",
        "no:cacheprovider",
        "-rfE",
        "-m",
        TESTS[tests],
        *(_with("arithmetic") if TESTS[tests] else []),
    ]
    environment = kind.variables(folder / "site")
    done = subprocess.run(
        command,
        cwd=REPOSITORY,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    lines = done.stdout.strip().splitlines()
    failed = [line for line in lines if line.startswith(("FAILED ", "ERROR "))]
    if done.returncode and not failed:
        failed = lines[-5:]
    return failed, lines[-1] if lines else ""
