"""Drills that run only where what they hold has changed: each room names all that its tests import."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
import seldom
from source_code import nodes

ROOT = Path(__file__).resolve().parents[2]
PLUGINS = ROOT / "tests" / "plugins"
# Packages beside this one, and the folders in which they lie.
_PACKAGES = {
    "proofroll_benchmarks": "benchmarks",
    "proofroll_drill": "tests/drill",
    "proofroll_fuzz": "fuzz",
    "proofroll_throughput": "throughput",
}


def imported(path: Path, seen: set[Path]) -> Iterator[str]:
    """Names of modules that a file imports, and those that the plug-ins among them import."""
    seen.add(path)
    for node in nodes(path):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        else:
            continue
        for name in names:
            yield name
            plug_in = PLUGINS / f"{name}.py"
            if plug_in.exists() and plug_in not in seen:
                yield from imported(plug_in, seen)


def files(room: seldom.Room) -> Iterator[Path]:
    """Files of the tests of a room."""
    for place in room.tests:
        path = ROOT / place
        yield from [path] if path.is_file() else path.rglob("*.py")


@pytest.mark.parametrize("name", seldom.ROOMS)
def test_a_room_names_all_that_its_tests_import(name: str) -> None:
    """A part of the package, or a package beside it, that the drills of a room import is among its places."""
    room, seen = seldom.ROOMS[name], set[Path]()
    lacking = set()
    for module in {module for file in files(room) for module in imported(file, seen)}:
        package, _, inside = module.partition(".")
        part = inside.partition(".")[0]
        if package == "proofroll" and (ROOT / "src" / "proofroll" / part).is_dir():
            lacking |= {part} - {*room.parts, ""}
        elif package in _PACKAGES:
            lacking |= {_PACKAGES[package]} - {*room.folders, *room.tests}
    assert lacking == set()


@pytest.mark.parametrize("name", seldom.ROOMS)
def test_the_places_of_a_room_are_there(name: str) -> None:
    """Each folder or file whose change a room watches exists."""
    assert [place for place in seldom.ROOMS[name].places if ":" not in place and not (ROOT / place).exists()] == []


def test_a_drill_has_the_mark_of_its_room() -> None:
    """A test belongs to a room by its path, a file as well as a folder."""
    assert seldom.mark_of("tests/robots/control/test_layers.py::test_sizes_are_fitted") == "drill_of_robots"
    assert seldom.mark_of("tests/test_versions.py::test_what_changed_is_shown") == "drill_of_packages"
    assert seldom.mark_of("tests/unit/running/test_runner.py::test_x") == ""


def test_without_a_commit_all_drills_run() -> None:
    """Where nothing is known of what changed no room is left out."""
    assert [*seldom.untouched("")] == []
    assert set(seldom.untouched("HEAD")) <= seldom.ROOMS.keys()
