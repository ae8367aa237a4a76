"""Files that ask for regime maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from proofroll.core import heyoka_library
from proofroll.core.errors import InputError
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.slip import regimes as regimes_study
from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_map, regime_maps
from proofroll.papers.blajer_2006.truth.regimes import Regime

slow = pytest.mark.skipif(not heyoka_library.available(), reason="a map takes minutes without heyoka")

TEXT = """
study = "regimes"
title = "A map"
question = "What becomes of the ball?"
scene = "sphere_in_cylinder"
until = 0.2
rolling_resistance = [0.0, 5e-4]
speed = { low = 2, high = 4, count = 3 }
mu_static = { low = 0.1, high = 0.1, count = 1 }
"""


def written(folder: Path, text: str = TEXT) -> str:
    """The path of a file with this text."""
    (folder / "map.toml").write_text(text, encoding="utf-8")
    return str(folder / "map.toml")


def test_a_file(tmp_path: Path) -> None:
    """The axes are read with their values, and the number of runs follows from them."""
    found = load_regimes(written(tmp_path))
    assert (found.name, found.until, found.runs) == ("map", 0.2, 6)
    assert found.speed.values.tolist() == [2, 3, 4]
    assert found.mu_static.values.tolist() == [0.1]


@pytest.mark.parametrize("name", ["regimes", "sphere_in_cylinder"])
def test_ours_is_found_by_its_name_and_by_its_scene(name: str) -> None:
    """The founding scene has a map without and one with rolling resistance."""
    found = load_regimes(name)
    assert (found.name, found.rolling_resistance) == ("regimes", (0.0, 5e-4))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"regimes"', '"stability"', 'only a file with study = "regimes"'),
        ("until = 0.2", "until = -4", "until = -4.*above 0"),
        ("until = 0.2", "until = nan", "until = nan.*finite"),
        ("[0.0, 5e-4]", "[]", "rolling_resistance.*at least one"),
        ("[0.0, 5e-4]", "[-1]", "rolling_resistance = -1"),
        ("low = 2", "low = 0", "speed.*0 < low <= high"),
        ("low = 2", "low = 5", "speed.*0 < low <= high"),
        ("count = 1", "count = 0", "mu_static.*count of 1 to 1000"),
        ("count = 1", "count = 1.5", "mu_static.count"),
        ("count = 1", "counts = 1", "mu_static.count"),
        ('"sphere_in_cylinder"', '"sphere_in_nowhere"', "sphere_in_nowhere"),
    ],
)
def test_what_makes_no_sense(tmp_path: Path, old: str, new: str, words: str) -> None:
    """A broken file is one line that names the field."""
    assert old in TEXT
    with pytest.raises(InputError, match=words):
        load_regimes(written(tmp_path, TEXT.replace(old, new, 1)))


def test_maps_are_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who asks again in one process, the figures of an article say, gets the same maps without a run."""
    monkeypatch.setattr(regimes_study, "_MADE", {})
    study, runs = load_regimes(written(tmp_path)), []
    first = regime_maps(study, 1, runs.append)
    assert [item.attrs["rolling_resistance"] for item in first] == list(study.rolling_resistance)
    assert sum(runs) == study.runs
    assert regime_maps(load_regimes(written(tmp_path)), 1, runs.append) is first
    assert sum(runs) == study.runs


@pytest.mark.drill
@slow
def test_map_follows_the_analytic_boundaries() -> None:
    """Without resistance every point of the map lies where g c/V0² and (12/7) g c/V0² say, and progress adds up."""
    done: list[int] = []
    speeds, mus = np.linspace(1.5, 6, 12), np.linspace(0.02, 0.9, 15)
    result = regime_map(load_scene("sphere_in_cylinder"), speeds, mus, progress=done.append)
    boundary = 9.81 * 0.2 / speeds[:, None] ** 2
    expected = np.where(mus < boundary, Regime.FALLS, np.where(mus < 12 / 7 * boundary, Regime.RECOVERS, 0))
    np.testing.assert_array_equal(result.regime, expected)
    np.testing.assert_allclose(result.mu_slips, 12 / 7 * result.mu_falls)
    assert sum(done) == 12 * 15
    assert np.array_equal(np.isnan(result.first_slip), result.regime == Regime.NEVER_SLIPS)


@pytest.mark.nightly
@slow
def test_processes_change_nothing() -> None:
    """Two processes give the map that one gives."""
    scene = load_scene("sphere_in_cylinder", rolling_resistance=5e-4)
    one, two = (regime_map(scene, [2.0, 4.0], [0.1, 0.35], workers=workers) for workers in (1, 2))
    assert one.identical(two)
