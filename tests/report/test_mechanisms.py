"""A comparison of a mechanism in the report."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from proofroll.files.comparison_file import load_comparison
from proofroll.report.growing_report import write_report
from proofroll.report.plots import point_curves
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.compare import Outcome, compare


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Outcome, Store, Path]:
    """A short slider-crank in one engine, its store, and a folder for its report."""
    whole = load_comparison("slider_crank")
    rows = [row for row in whole.rows if row.engine == "mujoco[formulation=joints,preset=tuned]"]
    folder = tmp_path_factory.mktemp("mechanism")
    store = Store(folder / "cases")
    outcome = compare(dataclasses.replace(whole, rows=rows, until=0.04), Runner(store, jobs=1))
    return outcome, store, folder


@pytest.mark.slow
def test_only_single_curves_are_drawn(compared: tuple[Outcome, Store, Path]) -> None:
    """Coordinates of points and joints have curves and differences; an array over many components has none."""
    outcome, store, _ = compared
    (entry,) = point_curves(outcome, store)
    drawn = {item["name"]: item for item in entry["observables"]}
    assert {"slider.x", "q.shaft"} <= set(drawn)
    assert not {"positions", "attitudes", "forces", "torques"} & set(drawn)
    (curve,) = drawn["slider.x"]["engines"]
    assert len(curve["difference"]) == len(entry["time"])
    assert 0 < max(map(abs, curve["difference"])) < 1e-6


@pytest.mark.slow
def test_the_page_shows_the_mechanism(compared: tuple[Outcome, Store, Path]) -> None:
    """The scene's drawing is on the page with its own caption, and nothing speaks of balls or of a replay."""
    outcome, store, folder = compared
    content = write_report([outcome], store, folder, "proofroll report slider_crank")
    page = (folder / "report.html").read_text()
    (sheet,) = (item["sheet"] for item in content["comparisons"])
    assert json.loads((folder / "report.json").read_text())["comparisons"][0]["sheet"] == sheet
    assert sheet["undrawn"] == ""
    assert f'aria-label="{sheet["title"]}, at the start"' in page
    assert sheet["caption"] in page
    assert "where the ball touches" not in page
    assert content["replay"] == []
    assert all(verdict["verdict"] == "agrees" for verdict in content["comparisons"][0]["rows"])
