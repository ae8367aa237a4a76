"""Records are built by keyword: a swapped pair of numbers would be a result nobody sees."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[2] / "src"
MOST = 4  # positional arguments of a record


def records_of(trees: list[ast.Module]) -> set[str]:
    """Names of the dataclasses and named tuples of modules."""
    return {
        node.name
        for tree in trees
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        and (
            any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list)
            or any("NamedTuple" in ast.unparse(base) for base in node.bases)
        )
    }


def long_calls(tree: ast.Module, records: set[str]) -> Iterator[ast.Call]:
    """Calls that build one of the records with more than four positional arguments."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and len(node.args) > MOST:
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in records:
                yield node


@pytest.mark.drill
def test_records_are_built_by_keyword() -> None:
    """No call in src builds a record with more than four positional arguments."""
    trees = {path.relative_to(SRC): ast.parse(path.read_text(encoding="utf-8")) for path in SRC.rglob("*.py")}
    records = records_of(list(trees.values()))
    calls = [f"{path}:{call.lineno}" for path, tree in trees.items() for call in long_calls(tree, records)]
    assert len(records) > 400
    assert calls == []


@pytest.mark.parametrize(
    ("call", "long"), [("R(1, 2, 3, 4, 5)", True), ("R(1, 2, 3, 4, e=5)", False), ("f(1, 2, 3, 4, 5)", False)]
)
def test_a_long_call_is_seen(call: str, long: bool) -> None:
    """Positional arguments of records are counted; those of functions are not."""
    tree = ast.parse(f"@dataclass\nclass R:\n    a: int\n\n{call}")
    assert bool(list(long_calls(tree, records_of([tree])))) is long
