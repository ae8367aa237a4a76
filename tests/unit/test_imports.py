"""Data flows one way: the imports of every module lead only where its folder may lead."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

import proofroll
from proofroll.elements.ball_on_surface.surfaces import surface_kinds
from proofroll.files.scene_file import scene_names

ROOT = Path(proofroll.__file__).parent
# What may import what. The harness knows neither a kind of element nor an engine nor a truth; these are plug-ins.
HARNESS = {"core", "files", "running", "studies", "report", "cli", "conformance"}
MAY: dict[str, set[str]] = {
    "core": {"core"},
    "files": {"core", "files"},
    "running": {"core", "files", "running"},
    "studies": {"core", "files", "running", "studies"},
    "conformance": {"core", "files", "conformance"},
    "report": {"core", "files", "running", "studies", "report"},
    "cli": {"core", "files", "running", "studies", "report", "cli"},
    "elements": {"core", "files", "elements"},
    "truth": {"core", "elements", "truth"},
    "engines": {"core", "elements", "engines", "robots"},  # the protocol of robot readers
    "robots": {"core", "files", "running", "studies", "report", "cli", "robots", "elements"},  # a mechanism to be run
}
# A kind's own studies, commands and parts of the report stand on the harness, as a plug-in of somebody else would.
PLUGIN_PARTS = {"report", "onset_study", "regimes_study", "commands"}


@cache
def _nodes(file: Path) -> list[ast.AST]:
    return list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))


def _imported(file: Path) -> list[tuple[int, str]]:
    found = []
    for node in _nodes(file):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("proofroll."):
            found.append((node.lineno, node.module))
        elif isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names if alias.name.startswith("proofroll.")]
    return found


# Packages that stand on this one: it imports none of them.
OUTSIDE = {"blajer_2006", "proofroll_benchmarks", "proofroll_drill"}


def test_nothing_here_imports_what_stands_on_it() -> None:
    """No module imports an article, a benchmark or the drill; these announce themselves."""
    wrong = []
    for file in ROOT.rglob("*.py"):
        for node in _nodes(file):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            wrong += [f"{file.relative_to(ROOT)} imports {name}" for name in names if name.split(".")[0] in OUTSIDE]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("folder", sorted(MAY))
def test_imports_lead_one_way(folder: str) -> None:
    """No module imports from a folder that its own may not know."""
    wrong = []
    for file in (ROOT / folder).rglob("*.py"):
        parts = set(file.relative_to(ROOT).with_suffix("").parts)
        for line, module in _imported(file):
            target = module.split(".")[1]
            allowed = MAY[folder] | (HARNESS | {"truth"} if folder == "elements" and parts & PLUGIN_PARTS else set())
            if target not in allowed:
                wrong.append(f"{file.relative_to(ROOT)}:{line} imports {module}")
    assert not wrong, "\n".join(wrong)


def test_engines_know_no_scene_and_no_surface_by_name() -> None:
    """An adapter that did would be fair on that one alone: it asks what any surface can say."""
    surfaces = {kind.__name__ for kind in surface_kinds()}
    scenes = {name for name in scene_names() if "_" in name}  # of one word are also words of mechanics: a friction cone
    wrong = []
    for file in (ROOT / "engines").rglob("*.py"):
        where = file.relative_to(ROOT)
        for node in _nodes(file):
            if isinstance(node, ast.ImportFrom):
                wrong += [f"{where} imports {alias.name}" for alias in node.names if alias.name in surfaces]
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                wrong += [f"{where}:{node.lineno} names {name}" for name in scenes if name in node.value]
            if isinstance(node, ast.Compare) and ast.unparse(node.left).endswith("surface.kind"):
                wrong.append(f"{where}:{node.lineno} asks for a kind of surface")
    assert not wrong, "\n".join(wrong)


def test_each_class_has_a_name_of_its_own() -> None:
    """No two public classes are called the same: a name says what it is wherever one reads it."""
    homes: dict[str, list[str]] = {}
    for file in ROOT.rglob("*.py"):
        for node in _nodes(file):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(f"{file.relative_to(ROOT)}:{node.lineno}")
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_one_place_makes_cases() -> None:
    """What decides the result of a case is put together in one place, whichever study asks."""
    makers = {
        str(file.relative_to(ROOT))
        for file in ROOT.rglob("*.py")
        for node in _nodes(file)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Case"
    }
    assert makers == {"studies/cases.py"}


def test_modules_are_short_enough_to_be_read_at_once() -> None:
    """No module has more than 300 lines."""
    long = [str(file.relative_to(ROOT)) for file in ROOT.rglob("*.py") if len(file.read_text().splitlines()) > 300]
    assert long == []
