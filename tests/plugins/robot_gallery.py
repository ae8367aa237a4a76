"""Robots of installed packages, with the expected outcome of every engine's importer, from ``gallery.toml``."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import pytest

from proofroll.robots.check.records import ImporterRow

FILE = Path(__file__).resolve().parents[1] / "robots" / "gallery.toml"


@dataclass(frozen=True)
class Entry:
    """A robot: distribution, end of its file's path there, engine -> expected :func:`outcome`, base."""

    name: str
    package: str
    file: str
    engines: dict[str, list[str]]
    base: str = "fixed"


def read_gallery() -> dict[str, Entry]:
    """Entries by name."""
    entries = [Entry(**entry) for entry in tomllib.loads(FILE.read_text(encoding="utf-8"))["robots"]]
    return {entry.name: entry for entry in entries}


def locate(name: str) -> Path:
    """Path of a robot's file; the test is skipped where its package is not installed."""
    entry = read_gallery()[name]
    try:
        inside = files(entry.package) or []
    except PackageNotFoundError:
        pytest.skip(f"{entry.package} is not installed: pip install 'proofroll[robots]'")
    found = next((item for item in inside if f"/{item}".endswith(f"/{entry.file}")), None)
    assert found is not None, f"{entry.package} has no {entry.file}"
    return Path(str(found.locate()))


def outcome(row: ImporterRow) -> list[str]:
    """Outcome of an engine: causes of its differences, ``open`` beside them or alone, ``refuses``, or a status."""
    if not row.layers:
        return ["refuses"] if row.status == "refused" else [row.status]
    return [*dict.fromkeys(cause.id for cause in row.causes), *(["open"] if row.unexplained else [])]
