"""``proofroll compare`` of a scene about which no file says anything."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.mark.own_workers
def test_each_engine_is_started_once(
    tmp_path: Path,
    command_line: Callable[..., tuple[int, str, str]],
    monkeypatch: pytest.MonkeyPatch,
    started_workers: list[str],
) -> None:
    """An engine that was asked whether it can represent the scene runs it in the same process."""
    monkeypatch.setattr("proofroll.studies.first_look.engine_names", lambda: ["reduced"])
    monkeypatch.setattr("proofroll.studies.first_look._UNTIL", 0.1)
    assert command_line("compare", "sphere_in_cylinder", "--out", str(tmp_path))[0] == 0
    assert sorted(started_workers) == ["reduced", "truth"]
