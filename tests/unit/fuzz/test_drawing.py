"""Families of random scenes, as packages announce them."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.core import entry_points
from proofroll_fuzz.drawing import all_families, drawn_scene
from proofroll_fuzz.mechanisms.families import FAMILIES

_MODULE = """
from proofroll_fuzz.drawing import SceneFamily

FAMILIES = {"stones": SceneFamily(features={"wet": 1.0}, draw=lambda choices, features: {"title": features[0]})}
NUMBER = 3
"""


@pytest.fixture
def announced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package that announces one family, and a number in place of another."""
    info = tmp_path / "stones-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: stones\nVersion: 1.0\n")
    lines = ["[proofroll.scene_families]", "stones = stony_scenes:FAMILIES", "wrong = stony_scenes:NUMBER"]
    (info / "entry_points.txt").write_text("\n".join(lines))
    (tmp_path / "stony_scenes.py").write_text(_MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(entry_points, "broken", {})


def test_the_families_of_mechanisms_are_announced() -> None:
    """Nobody else here announces families, so that a seed makes the scene that it makes of these."""
    assert all_families() == FAMILIES


@pytest.mark.usefixtures("announced")
def test_families_of_another_package_are_drawn() -> None:
    """They stand beside those of mechanisms, and an announcement of something else is left out with a warning."""
    with pytest.warns(RuntimeWarning, match=r"stones announces stony_scenes:NUMBER as wrong .* is no Mapping"):
        families = all_families()
    assert families.keys() - FAMILIES.keys() == {"stones"}
    assert drawn_scene({"stones": families["stones"]}, 5).tables == {"title": "wet"}
