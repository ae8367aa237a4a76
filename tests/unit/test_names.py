"""Names of locals and arguments are nouns: what can be counted of it."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from source_code import PACKAGES, nodes

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = (ROOT / "src" / "proofroll", *(ROOT / name / f"proofroll_{name}" for name in PACKAGES))
# Determiners, adverbs and participles that hide what a name holds.
BARE = frozenset({
    "after", "along", "at", "before", "changed", "closed", "each", "first", "found", "given", "held", "here", "known",
    "never", "now", "one", "other", "own", "said", "still", "struck", "then", "there", "two", "wanted", "was", "where",
})  # fmt: skip
pytestmark = pytest.mark.usefixtures("parsed_sources")
WORST = 0.1  # largest part of a folder's functions with such a name


def _functions(module: Iterable[ast.AST]) -> Iterator[ast.FunctionDef]:
    """All functions but the methods of Python's data model, whose operands are called ``other`` by convention."""
    for node in module:
        if isinstance(node, ast.FunctionDef) and not (node.name.startswith("__") and node.name != "__init__"):
            yield node


def bare_names(function: ast.FunctionDef) -> set[str]:
    """Determiners and adverbs among the arguments and locals of a function, those of functions inside left out."""
    names = {item.arg for item in ast.walk(function.args) if isinstance(item, ast.arg)}
    waiting: list[ast.AST] = list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        waiting += ast.iter_child_nodes(node)
    return names & BARE


def _lines(module: Iterable[ast.AST]) -> set[int]:
    """Lines of a module with such an argument or local, of whatever function: all others need no closer look."""
    names = (node for node in module if isinstance(node, ast.Name | ast.arg))
    return {node.lineno for node in names if (node.id if isinstance(node, ast.Name) else node.arg) in BARE}


def parts() -> dict[str, float]:
    """Folder of a package -> part of its functions with a local or argument that is a bare determiner or adverb."""
    functions: dict[str, list[bool]] = {}
    for path in (path for folder in FOLDERS for path in folder.rglob("*.py")):
        lines = _lines(nodes(path))
        bare = [
            not lines.isdisjoint(range(item.lineno, (item.end_lineno or item.lineno) + 1)) and bool(bare_names(item))
            for item in _functions(nodes(path))
        ]
        functions.setdefault(path.parent.relative_to(ROOT).as_posix(), []).extend(bare)
    return {folder: sum(bare) / len(bare) for folder, bare in functions.items() if bare}


def test_few_functions_of_a_folder_have_a_local_that_is_no_noun() -> None:
    """In no folder of a package do more than a tenth of the functions have such a name."""
    assert {folder: part for folder, part in parts().items() if part > WORST} == {}


@pytest.mark.parametrize(
    ("source", "bare"),
    [
        ("def f(own): pass", {"own"}),
        ("def f(contact):\n    at = contact", {"at"}),
        ("def f(rows):\n    return [one for one in rows]", {"one"}),
        ("def f(rows):\n    return sorted(rows, key=lambda each: each.size)", {"each"}),
        ("def f(rows):\n    def g(first):\n        return first\n    return g", set()),
        ("def f(rows):\n    return rows.first", set()),
    ],
)
def test_a_bare_name_is_seen(source: str, bare: set[str]) -> None:
    """Arguments, locals and names of comprehensions are counted; attributes and inner functions are not."""
    (function,) = (item for item in ast.parse(source).body if isinstance(item, ast.FunctionDef))
    assert bare_names(function) == bare
