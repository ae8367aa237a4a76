"""The vocabulary says what the readers of scenes and comparisons read, as a page and as a command."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from proofroll.core.errors import InputError
from proofroll.core.plugins import load_element_kinds
from proofroll.files.toml import read_toml
from proofroll.vocabulary import document as vocabulary
from proofroll.vocabulary.command import all_entries, entries_about, lines_of

ROOT = Path(__file__).resolve().parents[1]
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


def test_a_word_is_answered() -> None:
    """A key, a table or a word of a meaning is answered with type, default and unit; another word with near ones."""
    entries = [*all_entries()]
    (line, *_) = [line for line in lines_of(entries_about("damping", entries)) if line.startswith("    ")]
    assert line.startswith("    damping (float; 0.0): ")
    assert "N m s/rad" in line
    assert {entry.table for entry in entries_about("[[Geometries]]", entries)} >= {"[[geometries]]"}
    with pytest.raises(InputError, match=r"word = 'dampng': .* damping"):
        entries_about("dampng", entries)


def test_the_command_has_every_key_of_the_page(proofroll: Callable[..., tuple[int, str, str]]) -> None:
    """Without a word all keys are printed, and what is described in words."""
    code, out, _ = proofroll("check", "--keys", "--json")
    printed = json.loads(out)["keys"]
    lines = [line for line in TEXT.splitlines() if line.startswith("| `")]
    assert (code, len([entry for entry in printed if entry["key"]])) == (0, len(lines))
    assert "[[repeat]]" in {entry["table"] for entry in printed}
    assert "mu_static" in proofroll("check", "--keys")[1]
    assert proofroll("check", "--keys", "damping", "--engine", "mujoco")[0] == 2
    assert proofroll("check")[2].count("\n") == 1
