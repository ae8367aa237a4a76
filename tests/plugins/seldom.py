"""Drills that run before a change lands only where it may move what they hold: one table for pytest and ``.ci/run``.

``python tests/plugins/seldom.py COMMIT`` prints what leaves out the others in an expression of marks; without a commit
nothing is known, and all run. ``make nightly`` runs all whatever changed.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[2]
# What may move every drill.
_EVERYWHERE = ("constraints.txt", "pyproject.toml", "tests/conftest.py", "tests/plugins", ":(glob)src/proofroll/*.py")


@dataclass(frozen=True)
class Room:
    """Drills in folders or files of tests, and the parts of the package and other folders that they import or run."""

    tests: tuple[str, ...]
    parts: tuple[str, ...]
    folders: tuple[str, ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Paths whose change may move these drills."""
        return (*_EVERYWHERE, *self.tests, *(f"src/proofroll/{part}" for part in self.parts), *self.folders)


_MECHANICS = ("core", "elements", "engines", "files", "papers", "running", "truth")
ROOMS = {
    "the_judge": Room(
        ("tests/conformance", "tests/meta"), (*_MECHANICS, "conformance", "studies"), ("docs/examples", "tests/drill")
    ),
    "robots": Room(("tests/robots",), (*_MECHANICS, "cli", "report", "robots", "studies"), ("fuzz",)),
    "pages": Room(("tests/report",), (*_MECHANICS, "cli", "report", "studies"), ("comparisons", "docs", "models")),
    "papers": Room(("tests/unit/papers",), (*_MECHANICS, "conformance", "report"), ("models", "tests/drill")),
    "packages": Room(
        ("tests/packaging", "tests/test_versions.py", "tests/unit/cluster"),
        (*_MECHANICS, "cli", "report", "studies"),
        (
            ".github",
            "benchmarks",
            "cluster",
            "comparisons",
            "docs",
            "examples",
            "fuzz",
            "models",
            "tests/drill",
            "throughput",
        ),
    ),
    "fuzz": Room(("tests/unit/fuzz",), (*_MECHANICS, "studies", "vocabulary"), ("fuzz",)),
    "balance": Room(("tests/unit/balance",), (*_MECHANICS, "cli", "studies"), ("balance",)),
    "throughput": Room(("tests/unit/throughput",), (*_MECHANICS, "studies"), ("throughput",)),
    "benchmarks": Room(
        ("tests/unit/benchmarks",), (*_MECHANICS, "cli", "report", "studies"), ("benchmarks", "tests/drill")
    ),
    "planted_faults": Room(
        ("tests/drill",),
        (*_MECHANICS, "cli", "conformance", "report", "robots", "studies"),
        ("comparisons", "fuzz", "models"),
    ),
}


def mark_of(test: str) -> str:
    """Mark of the drills among which a test, named by its path, belongs; empty if they run whatever changed."""
    path = Path(test.partition("::")[0])
    for name, room in ROOMS.items():
        if any(path.is_relative_to(place) for place in room.tests):
            return f"drill_of_{name}"
    return ""


def untouched(commit: str) -> Iterator[str]:
    """Names of rooms whose drills nothing may move that changed since a commit; none if the commit is empty."""
    for name, room in ROOMS.items() if commit else ():
        command = ["git", "diff", "--quiet", commit, "--", *room.places]
        if not subprocess.run(command, cwd=_ROOT, check=False).returncode:
            yield name


if __name__ == "__main__":
    print("".join(f" and not drill_of_{name}" for name in untouched(*sys.argv[1:])))
