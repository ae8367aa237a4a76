"""``proofroll.compare``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import proofroll


@pytest.mark.nightly
def test_a_notebook_shows_a_comparison(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene is compared at given parameters, and its outcome is a table with a row for each run."""
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison.engine_names", lambda: ["projection"])
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison._FIRST", 0.1)
    found = proofroll.compare("pendulum", out=tmp_path, jobs=1, length=2.0)
    assert [run.parameters for run in found.runs] == [{"length": 2.0}] * len(found.runs)
    assert found.comparison.title.endswith(" (the first 0.1 s of 10)")
    lines = repr(found).splitlines()
    assert (lines[0], len(lines)) == (found.comparison.title, 2 + len(found.runs) + len(found.contradictions))
    assert max(map(len, lines[1:])) < 300
    assert all(run.row.engine[:30] in line for run, line in zip(found.runs, lines[2:], strict=False))
    shown = found._repr_html_()
    assert shown.count("<tr>") == 1 + len(found.runs)
    assert shown.count("</svg>") == len(found.runs)
    assert "<th>projection[formulation=dependent] length=2</th><td>agrees</td>" in shown


def test_what_is_for_a_scene_is_not_for_a_file() -> None:
    """A comparison file has its own points and no budget: either is refused by its name."""
    for given, advice in (({"speed": 2.0}, "speed = 2.0"), ({"budget": 9.0}, "budget = 9.0")):
        with pytest.raises(proofroll.InputError, match=f"{advice}: a comparison file"):
            proofroll.compare("paper", **given)


@pytest.mark.parametrize("given", [{"jobs": 0}, {"jobs": -1}, {"jobs": 1.5}, {"budget": -5.0}, {"budget": math.nan}])
def test_numbers_that_make_no_sense_are_refused(given: dict[str, Any], tmp_path: Path) -> None:
    """Workers and processor time below 1, or no number, give one line with their name before anything runs."""
    ((name, value),) = given.items()
    with pytest.raises(proofroll.InputError, match=rf"^{name} = {value}: .*, at least 1$"):
        proofroll.compare("pendulum", out=tmp_path, **given)
