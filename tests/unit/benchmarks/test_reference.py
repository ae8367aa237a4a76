"""The reference bench: what it picks, what it leaves out, and what it prints. Never how fast anything is."""

from __future__ import annotations

import io
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ball_scenes import rolled
from rich.console import Console

from proofroll.core import heyoka_library as library
from proofroll.core.engine_abilities import Term
from proofroll.core.errors import Missing
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.running.runner import Runner
from proofroll.running.simulation import simulate
from proofroll.running.store import Store
from proofroll.running.timing import Timing
from proofroll_benchmarks import reference as bench
from proofroll_benchmarks import search as searching
from proofroll_benchmarks.compiled import Onsets, compiled, numeric
from proofroll_benchmarks.tables import reference_tables

needs_heyoka = pytest.mark.skipif(not library.available(), reason="heyoka is not installed")

SLIPPING = load_scene("sphere_in_cylinder", rolling_resistance=5e-4, mu_static=0.35)
FREE = load_scene("sphere_in_cylinder", rolling_resistance=5e-4)
TIMES = np.array([0.2, 0.4])


@cache
def true_places() -> np.ndarray:
    """Places of the ball that never slips, at these times [m]."""
    return rolled(rolling_ball(FREE), np.append(0.0, TIMES)).p_WB[1:]


@pytest.mark.nightly
@needs_heyoka
def test_the_loosest_tolerance_that_holds() -> None:
    """A tighter bound takes a tighter tolerance, each bound is held, and one below round-off by none."""
    loose, tight = (compiled(SLIPPING, "reduced", TIMES, true_places(), bound) for bound in (1e-9, 1e-13))
    assert loose is not None
    assert tight is not None
    assert tight.tolerance < loose.tolerance
    assert (loose.error <= 1e-9, tight.error <= 1e-13) == (True, True)
    assert loose.measure() > 0
    assert compiled(SLIPPING, "reduced", TIMES, true_places(), 1e-20) is None


def test_the_numeric_model_holds_its_bound() -> None:
    """The numeric projection method is taken at a tolerance that holds the bound, and none where none does."""
    found = numeric(FREE, "rotating_frame", TIMES, true_places(), 1e-9)
    assert found is not None
    assert found.error <= 1e-9  # near it by construction: the loosest tolerance that holds it is taken
    assert numeric(FREE, "rotating_frame", TIMES, true_places(), 1e-20) is None


@pytest.mark.nightly
def test_search_takes_what_holds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Every configuration found holds the bound on z and none is compiled; a bound that nothing holds finds nothing."""
    monkeypatch.setattr(searching, "engine_names", lambda: ["projection"])
    monkeypatch.setattr(searching, "_STEPS", ((2, 8),))
    monkeypatch.setattr(searching, "_TOLERANCES", ((1e-3, 1e-6),))
    true_z = simulate(FREE, "truth", until=0.5, every=0.05)["z"].to_numpy()

    found = searching.search(FREE, 0.5, true_z, 1e-4, Runner(Store(tmp_path)), 2, lambda _: None)

    assert len(found) == 2
    assert all(item.error <= 1e-4 for item in found)
    assert not any(item.contact or item.case.engine.settings["integrator"] == "taylor" for item in found)
    assert searching.search(FREE, 0.5, true_z + 1.0, 1e-4, Runner(Store(tmp_path)), 2, lambda _: None) == []


def test_search_leaves_out_what_an_engine_can_do_without() -> None:
    """Each term of the formulation that the preset has gives a variant without it; others give none."""
    terms = [
        Term("exactness", ("a", "b"), {}, {"exact": False}, ""),
        Term("damping", ("b",), {}, {"drift": None, "damping": 0.0}, ""),
    ]
    settings = {"exact": True, "drift": None, "damping": 0.5}
    assert list(searching._without(terms, "a", settings)) == [{"exact": False}]
    assert list(searching._without(terms, "b", settings)) == [{"exact": False}, {"drift": None, "damping": 0.0}]
    assert list(searching._without(terms, "b", settings | {"exact": False, "damping": 0.0})) == []


@pytest.mark.nightly
@needs_heyoka
def test_bulk_is_checked_against_one_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error of the first slips in bulk is round-off, and a single wrong one shows."""
    monkeypatch.setattr("proofroll_benchmarks.compiled._CHECKED", 20)
    onsets = Onsets(SLIPPING, 4.0)
    assert onsets.error() < 1e-10
    index = int(np.flatnonzero(~np.isnan(onsets.found[:20]))[0])
    onsets.found[index] += 1e-3
    assert onsets.error() == pytest.approx(1e-3, rel=1e-6)
    onsets.found[index] = np.nan
    assert onsets.error() == np.inf


def test_a_ratio_needs_both() -> None:
    """A goal is met if the slow one takes as many times longer; without one of the two there is no number."""
    timings = {"reduced": Timing((1.0, 1.0)), "near": Timing((39.0, 39.0)), "far": Timing((41.0, 41.0))}
    assert bench._ratio("reduced_over_engine", "far", "reduced", timings)["met"]
    assert not bench._ratio("reduced_over_engine", "near", "reduced", timings)["met"]
    nothing = bench._ratio("reduced_over_engine", None, "reduced", timings)
    assert (nothing["value"], nothing["met"]) == (None, False)


@pytest.mark.nightly
@needs_heyoka
def test_the_whole_without_engines(monkeypatch: pytest.MonkeyPatch) -> None:
    """The content is one JSON document with every ratio, and its tables fit the terminal."""
    monkeypatch.setattr(bench, "search", lambda *_: [])
    monkeypatch.setattr(bench, "numeric", lambda *_: None)
    monkeypatch.setattr("proofroll_benchmarks.compiled._CHECKED", 5)
    content: dict[str, Any] = bench.reference(2, lambda _: None)
    assert json.loads(json.dumps(content)) == content
    assert content["ratios"].keys() == bench.GOALS.keys()
    assert content["first_slip"]["error"] < 1e-12
    rows = {row["name"]: row for row in content["models"]}
    # near their bounds by construction: the loosest tolerance that holds one is taken
    assert rows["reduced, compiled"]["error"] <= 1e-12
    assert max(rows[f"{name}, compiled"]["error"] for name in ("euler", "rotating_frame")) <= 1e-9
    assert content["onsets_per_second"]["low"] <= content["onsets_per_second"]["value"]
    text = io.StringIO()
    for table in reference_tables(content):
        Console(file=text, width=100).print(table)
    assert max(map(len, text.getvalue().splitlines())) <= 100
    assert "✗" in text.getvalue()
    assert "error [m]" in text.getvalue()


def test_without_heyoka(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without heyoka there is nothing to measure, in one line."""
    monkeypatch.setattr(library, "available", lambda: False)
    with pytest.raises(Missing, match="bench reference needs heyoka"):
        bench.reference(2, lambda _: None)
