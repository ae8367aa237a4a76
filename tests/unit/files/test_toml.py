"""TOML files: what is wrong with one is one line, and it costs no other."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest

from proofroll.core.errors import InputError
from proofroll.files import toml as toml_file
from proofroll.files.toml import read_toml, study_files, study_of, toml_text
from proofroll.studies.stability.claims import file_for


@pytest.mark.parametrize("content", [b"a = = 1", b"\xff\xfe"])
def test_a_broken_file(tmp_path: Path, content: bytes) -> None:
    """A file that is not TOML, or not text, is one line that names it."""
    path = tmp_path / "made.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"made\.toml.*the file is broken") as raised:
        read_toml(path)
    assert "\n" not in str(raised.value)
    assert study_of(path) is None


def test_a_file_that_begins_with_a_byte_order_mark(tmp_path: Path) -> None:
    """A file as Windows' editors write it, with a mark before its first letter, is read."""
    path = tmp_path / "made.toml"
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\n")
    assert read_toml(path) == {"a": 1}


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    """A file that cannot be read is one line that says why."""
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_toml(tmp_path / "made.toml")


def test_a_broken_neighbour_costs_nobody_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Looking for the file of a scene goes past a broken one, whichever study it is for."""
    (tmp_path / "a_broken.toml").write_text("a = = 1")
    (tmp_path / "b.toml").write_text('study = "made"\nscene = "cone"')
    monkeypatch.setattr(toml_file, "study_folders", lambda: (tmp_path,))
    assert [(path.name, content["scene"]) for path, content in study_files("made")] == [("b.toml", "cone")]
    without = file_for("pendulum")  # its own parameters are the axes
    assert (without.scene, without.claims) == ("pendulum", [])


def test_written_tables_are_read_as_they_were() -> None:
    """Numbers to the last digit, texts with quotes, bools, lists, tables, tables in rows and lists of tables."""
    content = {
        "title": 'a "quoted" \\ text\nof two lines, µ',
        "number": 0.1 + 0.2,
        "rate": 1e-300,
        "whole": 3,
        "true": True,
        "empty": [],
        "gravity": {"direction": [0.0, -1.0, 0.0]},
        "bodies": [{"name": "a", "inertia": [[1.0, 0.0], [0.0, 1.0]]}, {"name": "b"}],
        "pairs": [{"friction": {"static": 0.5, "kinetic": 0.3}}, {"friction": math.inf}],
    }
    assert tomllib.loads(toml_text(content)) == content
