"""Regime maps in the report: one element of the page, its counts in the data, and nothing that leaks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.report.regime_map import boundaries, counts, draw, inline
from proofroll.papers.blajer_2006.report.regimes_part import RegimesPart
from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_map
from proofroll.report.page.growing import begun
from proofroll.report.terminal.tables import part_lines
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import Outcome


@pytest.fixture(scope="module")
def maps() -> list[xr.Dataset]:
    """Two small maps."""
    scenes = [load_scene("sphere_in_cylinder", rolling_resistance=f) for f in (0.0, 5e-4)]
    return [regime_map(scene, [3.0, 4.0], [0.1, 0.35, 0.7], until=1.0) for scene in scenes]


def test_counts_and_formulas_go_into_the_data(maps: list[xr.Dataset]) -> None:
    """How many runs became what; the boundaries with the factor of this ball."""
    found = counts(maps)
    assert [sum(item["counts"].values()) for item in found] == [6, 6]
    assert found[0]["axes"]["speed"] == {"low": 3.0, "high": 4.0, "count": 2}
    assert found[0]["boundaries"]["mu_slips"] == "μ = (12/7) g c / V0²"
    assert "regime" not in found[0], "the map itself stays out of the report's data"
    plane = maps[0].drop_vars(["mu_falls", "mu_slips"])
    assert boundaries(plane) == {}
    assert counts([plane])[0]["outside_boundaries"] is None


@pytest.mark.drill
def test_picture_is_an_element_that_keeps_to_itself(maps: list[xr.Dataset]) -> None:
    """Own ids, no style for the page, no address; the legend explains the lines."""
    text = inline(maps, "here-")
    assert text.startswith("<svg")
    assert text.rstrip().endswith("</svg>")
    assert "<style" not in text
    assert "http" not in text
    assert text.count('id="here-') == text.count(' id="')
    assert "url(#here-" in text
    assert "μ = g c / V0²: below it falls (f = 0)" in text
    assert "μ = (12/7) g c / V0²: above it never slips (f = 0)" in text


@pytest.mark.drill
def test_file_is_a_picture_of_its_own(maps: list[xr.Dataset], tmp_path: Path) -> None:
    """The file opens without the page, also without boundaries."""
    draw([item.drop_vars(["mu_falls", "mu_slips"]) for item in maps[:1]], tmp_path / "map.svg")
    text = (tmp_path / "map.svg").read_text(encoding="utf-8")
    assert text.startswith("<?xml")
    assert "V0²" not in text


@pytest.mark.nightly
def test_report_shows_the_maps(made: tuple[Outcome, Store], maps: Any, tmp_path: Path, parse: Any) -> None:
    """Twice on the page of further studies, no id is used twice."""
    whole = begun([made[0]], "proofroll report")
    asked = load_regimes("regimes")
    parts = [RegimesPart(replace(asked, name=name), maps=maps) for name in ("regimes", "more")]
    whole.expect(parts, tmp_path)
    for part in parts:
        whole.make(part, lambda: None)
    whole.write(tmp_path)
    assert [len(item.study["maps"]) for item in whole.content.entries["regimes"]] == [2, 2]
    assert part_lines(whole.content)[0] == f"regimes: {RegimesPart.line(whole.content.entries['regimes'][0])}."
    html = (tmp_path / "studies.html").read_text(encoding="utf-8")
    elements = parse(html)
    ids = [attributes["id"] for _, attributes in elements.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    pictures = [attributes for tag, attributes in elements.tags if tag == "svg" and "class" not in attributes]
    of_the_frame = {"0 0 24 24", "0 0 640 330", "0 0 1000 100"}
    pictures = [item for item in pictures if item.get("viewbox") not in of_the_frame]
    assert sum("viewbox" in attributes for attributes in pictures) == 2
    assert "http:" not in html
    assert "slips and recovers" in elements.text
