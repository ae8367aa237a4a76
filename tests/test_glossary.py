"""The glossary has every formulation and every word of a verdict, and the page of surfaces every surface."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.plugins import engine_names
from proofroll.core.verdict import Verdict
from proofroll.elements.balls.surfaces import surface_kinds
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.walls.charts import wall_coordinates
from proofroll.files.scene_file import load_scene
from proofroll.running.case import EngineDescription
from proofroll.running.engine_questions import describe_each

DOCS = Path(__file__).resolve().parents[1] / "docs"
GLOSSARY = (DOCS / "glossary.md").read_text(encoding="utf-8")
SCENES = {
    "cylinder": "sphere_in_cylinder", "plane": "inclined_plane", "bowl": "bowl", "cone": "cone", "torus": "torus_rim",
}  # fmt: skip


def words(text: str) -> list[str]:
    """The words in code that some lines explain."""
    return re.findall(r"^`([\w-]+)`\n: ", text, flags=re.MULTILINE)


@pytest.mark.drill
def test_every_formulation_is_explained() -> None:
    """Each engine of this project has a section, and in it each of its formulations once, and no other."""
    sections = dict(re.findall(r"^### `(\w+)`\n(.*?)(?=^##)", GLOSSARY, flags=re.DOTALL | re.MULTILINE))
    told = describe_each(engine_names(), None)
    for engine, text in sections.items():
        facts = told[engine]
        if isinstance(facts, EngineDescription):
            assert sorted(words(text)) == sorted(facts.provides)
    assert {"projection", "reduced", "mujoco", "exudyn", "pinocchio"} == set(sections)


def test_every_word_of_a_verdict_is_explained() -> None:
    """All verdicts, once each."""
    section = GLOSSARY.partition("## Words of verdicts")[2]
    assert sorted(words(section)) == sorted(verdict.value for verdict in Verdict)


@pytest.mark.parametrize("kind", sorted(SCENES))
def test_coordinates_of_a_surface_are_explained(kind: str) -> None:
    """The row of a surface has its coordinates with their units and a place that is true, and a picture shows it."""
    page = (DOCS / "surfaces.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| `{kind}` \|.*$", page, flags=re.MULTILINE)
    element: Any = load_scene(SCENES[kind]).elements[0]
    if isinstance(element, MechanismElement):
        wall = element.mechanism.geometries[1]
        coordinates: Any = wall_coordinates(wall.solid, 0.0)  # type: ignore[arg-type]  # a wall
    else:
        wall = coordinates = element.rolling.wall
    for name, unit in zip(coordinates.coordinates, coordinates.units, strict=True):
        assert f"`{name}` [{unit}]" in row
    assert f"gallery/{SCENES[kind]}.svg" in page
    u, v = 0.1, 0.2
    cos, sin = np.cos, np.sin
    places = {
        "cylinder": lambda: (wall.radius * cos(u), wall.radius * sin(u), v),
        "plane": lambda: (u * wall.normal[2], -v, -u * wall.normal[0]),
        "cone": lambda: (v * cos(wall.slope) * cos(u), v * cos(wall.slope) * sin(u), v * sin(wall.slope)),
        "torus": lambda: (
            (wall.ring_radius + wall.radius * sin(v)) * cos(u),
            (wall.ring_radius + wall.radius * sin(v)) * sin(u),
            wall.radius * cos(v),
        ),
        "bowl": lambda: np.array([u, -v, -wall.radius * (1 - q)]) / (1 + q),
    }
    q = (u * u + v * v) / (4 * wall.radius**2) if kind == "bowl" else 0.0
    assert np.allclose(coordinates.position((u, v)), places[kind](), atol=1e-12)


def test_every_surface_has_a_row() -> None:
    """No kind of surface of this project is left out."""
    assert SCENES.keys() == {kind.kind for kind in surface_kinds()}


def test_the_picture_of_the_tutorial_is_that_of_its_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """The page shows the scene that it has, as it is drawn now."""
    monkeypatch.setattr(sys, "path", [str(DOCS), *sys.path])
    drawn = runpy.run_path(str(DOCS / "first_mechanism.py"))["picture"]()
    assert (DOCS / "first_mechanism.svg").read_text(encoding="utf-8") == drawn
