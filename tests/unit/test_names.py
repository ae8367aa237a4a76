"""Names of locals and arguments are nouns: what can be counted of it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[2] / "src"
# Determiners and adverbs that hide what a name holds.
BARE = frozenset({
    "after", "along", "at", "before", "each", "first", "found", "given", "known", "one", "other", "own", "wanted",
    "where",
})  # fmt: skip
# Largest part of functions with such a name; lower it whenever the part falls.
MOST = 0.08


def _functions(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    """All functions but the methods of Python's data model, whose operands are called ``other`` by convention."""
    for node in ast.walk(tree):
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


@pytest.mark.drill
def test_few_functions_have_a_local_that_is_no_noun() -> None:
    """The part of functions with a local or argument that is a bare determiner or adverb stays below a bound."""
    functions = [item for path in SRC.rglob("*.py") for item in _functions(ast.parse(path.read_text(encoding="utf-8")))]
    part = sum(bool(bare_names(item)) for item in functions) / len(functions)
    assert part <= MOST


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
