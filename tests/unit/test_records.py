"""Records are built by keyword: a swapped pair of numbers would be a result nobody sees."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from source_code import PACKAGES, nodes

ROOT = Path(__file__).resolve().parents[2]
FILES = [file for folder in ("src", *PACKAGES) for file in (ROOT / folder).rglob("*.py")]
MOST = 4  # positional arguments of a record


def records_of(modules: Iterable[list[ast.AST]]) -> set[str]:
    """Names of the dataclasses and named tuples of modules, each a list of its nodes."""
    return {
        node.name
        for module in modules
        for node in module
        if isinstance(node, ast.ClassDef)
        and (
            any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list)
            or any("NamedTuple" in ast.unparse(base) for base in node.bases)
        )
    }


def long_calls(module: list[ast.AST], records: set[str]) -> Iterator[ast.Call]:
    """Calls that build one of the records with more than four positional arguments."""
    for node in module:
        if isinstance(node, ast.Call) and len(node.args) > MOST:
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in records:
                yield node


def test_records_are_built_by_keyword() -> None:
    """No call in src and in the packages with commands builds a record with more than four positional arguments."""
    modules = {path.relative_to(ROOT): nodes(path) for path in FILES}
    records = records_of(modules.values())
    calls = [f"{path}:{call.lineno}" for path, module in modules.items() for call in long_calls(module, records)]
    assert len(records) > 400
    assert calls == []


@pytest.mark.parametrize(
    ("call", "long"), [("R(1, 2, 3, 4, 5)", True), ("R(1, 2, 3, 4, e=5)", False), ("f(1, 2, 3, 4, 5)", False)]
)
def test_a_long_call_is_seen(call: str, long: bool) -> None:
    """Positional arguments of records are counted; those of functions are not."""
    module = list(ast.walk(ast.parse(f"@dataclass\nclass R:\n    a: int\n\n{call}")))
    assert bool(list(long_calls(module, records_of([module])))) is long
