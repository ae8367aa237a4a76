"""docs/vocabulary.md says what the readers of scenes and comparisons read."""

from __future__ import annotations

import importlib.util
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from proofroll.core.plugins import load_element_kinds
from proofroll.files.toml import read_toml

ROOT = Path(__file__).resolve().parents[1]
_SPEC = importlib.util.spec_from_file_location("vocabulary", ROOT / "docs" / "vocabulary.py")
assert _SPEC is not None
assert _SPEC.loader is not None
vocabulary = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(vocabulary)
TEXT = vocabulary.document()
# Below these a key is the user's own: the name of a parameter, of an observable, of a tolerance.
OWN = {"vary", "brief", "points", "over", "parameters", "tolerances", "limit", "bound", "order", "only", "where",
       "expect_for", "published", "repeat"}  # fmt: skip


def keys(content: Any) -> Iterator[str]:
    """Every key of a file that the vocabulary must have."""
    for table in content if isinstance(content, list) else [content]:
        if isinstance(table, dict):
            for key, value in table.items():
                yield key
                if key not in OWN:
                    yield from keys(value)


@pytest.mark.parametrize("table", [table for tables in vocabulary.CHAPTERS.values() for table in tables])
def test_every_key_has_a_meaning(table: Any) -> None:
    """No key is without a meaning, a type and a default."""
    for line in vocabulary.keys(table):
        assert all(cell.strip() for cell in line), line


def test_every_key_of_our_files_is_in_it() -> None:
    """What the scenes and comparisons of the package write stands in the vocabulary."""
    files = [*ROOT.glob("models/*/scene.toml"), *ROOT.glob("comparisons/*.toml")]
    files.remove(ROOT / "comparisons" / "robots.toml")
    used = {key: path for path in files for key in keys(read_toml(path))}
    assert {
        key: path.name
        for key, path in used.items()
        if not any(form in TEXT for form in (f"`{key}`", f"[{key}", f".{key}]"))
    } == {}


def test_every_table_is_in_it() -> None:
    """Each table that a kind of element reads has a section."""
    for kind in load_element_kinds():
        for name in kind.tables:
            assert f"### `[[{name}]]`" in TEXT or f"### `{name}`" in TEXT


def test_examples_are_valid() -> None:
    """Each example is TOML."""
    blocks = TEXT.split("```toml\n")[1:]
    assert len(blocks) > 15
    for block in blocks:
        tomllib.loads(block.partition("```")[0])
