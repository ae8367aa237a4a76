"""Numbers that were found elsewhere beside ours."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.published import read_published
from proofroll_drill import published

NUMBERS = """
[[truths]]
scene = "servo"
at = 0.5
values = { "q.slide" = 1.0055444518, "v.slide" = -3.6894821932 }
events = [0.1]

[[errors]]
scene = "servo"
until = 0.1
engines = { "projection[formulation=dependent,preset=default]" = [1e-30], "mujoco[formulation=chart]" = [1.0] }
"""


@pytest.mark.drill
def test_a_number_that_is_off_misses(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A tenth digit that differs, an event or a run that there is not, and a larger error miss; the rest holds."""
    (tmp_path / "numbers.toml").write_text(NUMBERS, encoding="utf-8")
    monkeypatch.setattr(published, "FILE", tmp_path / "numbers.toml")
    monkeypatch.setattr(published, "tables", dict)
    rows = list(published.held([]))
    assert [row.misses for row in rows] == [False, False, True, True, True]
    assert "chart" in rows[-1].what
    assert rows[0].text == "✓ servo: q.slide at 0.5 s: 1.0055444518 published, 1.005544451824 ours"
    assert rows[-1].why
    with pytest.raises(InputError, match="no number of it was published; choose from"):
        list(published.held(["sled"]))
    (tmp_path / "numbers.toml").write_text(NUMBERS.replace("4518,", "4528,").replace("1e-30", "1"), encoding="utf-8")
    assert [row.misses for row in published.held([])] == [True, False, True, False, True]


@pytest.mark.drill
def test_a_series_misses_by_its_worst_instant() -> None:
    """A table of a scene is held at all its times; its row names the value that is a last digit too far off."""
    table = {"source": "closed form", "times": [0.5, 1.0], "q.thread.slide": [-0.24525, -0.9822]}
    (entry,) = read_published([table])
    (row,) = published.of_scene("falling_screw", entry)
    assert row.misses
    assert row.text == "✗ falling_screw: q.thread.slide at 1 s, of 2: -0.9822 published, -0.981 ours"
    (entry,) = read_published([{**table, "within": 2e-3}])
    assert not next(iter(published.of_scene("falling_screw", entry))).misses
