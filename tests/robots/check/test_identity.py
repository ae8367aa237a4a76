"""Readers of robot files and stored results."""

from __future__ import annotations

from pathlib import Path

from proofroll.running.identity import digest


def test_reader_outdates_no_result(tmp_path: Path) -> None:
    """A reader of robot files in an adapter's folder outdates no stored result of it; the adapter does."""
    (tmp_path / "adapter.py").write_text("x = 1\n")
    before = digest([tmp_path])
    (tmp_path / "robot_reader.py").write_text("y = 1\n")
    assert digest([tmp_path]) == before
    (tmp_path / "adapter.py").write_text("x = 2\n")
    assert digest([tmp_path]) != before
