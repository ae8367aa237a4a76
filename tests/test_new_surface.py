"""Surfaces of another package, said by a point or a profile curve, go through run, compare, drawing and replay."""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from proofroll.core import plugins
from proofroll.elements.balls import reader
from proofroll.elements.balls.surfaces import surface_kinds
from proofroll.elements.mechanism.report.drawing import mechanism_drawing
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball import kind

PLUGINS = Path(__file__).parent / "plugins"
Proofroll = Callable[..., tuple[int, str, str]]
SCENE = """
title = "A ball in a trough"
source = "invented"

[parameters.radius]
value = 0.3
unit = "m"
meaning = "inner radius of the trough"
source = "invented"

[gravity]
magnitude = 9.81
direction = [0, 0, -1]

[[balls]]
name = "ball"
radius = 0.02
mass = 0.1

[[surfaces]]
kind = "trough"
name = "wall"
radius = "$radius"

[[contacts]]
body = "ball"
surface = "wall"

[[initial]]
body = "ball"
coordinates = [0.4, 0.0]
velocity = [0.1, 0.3]
spin = 5.0
"""
DISH = (
    SCENE.replace('kind = "trough"', 'kind = "dish"')
    .replace('radius = "$radius"', 'focus = "$radius"')
    .replace("[0.4, 0.0]", "[0.0, 0.2]")
)
COMPARISON = """
title = "A trough"
question = "Does anybody's surface go through?"
scene = {scene!r}
until = 0.1
every = 0.02

[tolerances.fine]
because = "half a swing of 0.1 m by schemes of second order"
angle = "1e-3 rad"
way = "1e-3 m"
gap = "1e-4 m"

[[rows]]
engine = "projection[formulation=dependent]"
tolerance = "fine"

[[rows]]
engine = "mujoco[formulation=geoms,preset=tuned]"
tolerance = "fine"
ladder = [2, 1, 0.5]
"""


def _look_again() -> None:
    """What is installed is looked up once in a process."""
    surface_kinds.cache_clear()
    importlib.reload(reader)
    importlib.reload(kind)
    plugins.load_element_kinds.cache_clear()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the surfaces are announced as an installed package would."""
    site = tmp_path_factory.mktemp("site")
    info = site / "troughs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: troughs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[proofroll.surfaces]\ntrough = trough:Trough\ndish = dish:Dish\n")
    return site


@pytest.fixture
def trough(
    proofroll: Proofroll,  # noqa: ARG001 -- it announces its engines first
    site: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[Path]:
    """The folder of a scene with a trough."""
    places = [str(site), str(PLUGINS), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(places))
    monkeypatch.syspath_prepend(str(site))
    _look_again()
    folder = tmp_path / "rolling"
    folder.mkdir()
    (folder / "scene.toml").write_text(SCENE)
    yield folder
    monkeypatch.undo()
    _look_again()


@pytest.mark.nightly_of("dish")
@pytest.mark.drill
@pytest.mark.parametrize("kind", ["trough", "dish"])
def test_compare(proofroll: Proofroll, trough: Path, kind: str) -> None:
    """The truth has its error bar by two routes, and engines that know any surface agree with it."""
    file, comparison = trough.parent / "trough.toml", COMPARISON.format(scene=str(trough))
    if kind == "dish":
        (trough / "scene.toml").write_text(DISH)
        comparison = comparison.replace("angle =", "gamma =").replace("way =", "s =")
    file.write_text(comparison)
    code, out, err = proofroll("compare", str(file), "--json", "--out", str(trough.parent / "out"))
    assert code == 0, err + out
    document = json.loads(out)
    content = document.get("comparisons", [document])[0]
    assert {run["status"] for run in content["runs"]} == {"done"}


@pytest.mark.usefixtures("proofroll")
def test_it_is_drawn(trough: Path) -> None:
    """The ball has the coordinates of the package's surface, which is drawn as a net of their lines."""
    (element,) = load_scene(str(trough)).elements
    assert isinstance(element, MechanismElement)
    assert element.on_wall is not None
    assert element.on_wall.surface.coordinates == ("angle", "way")
    picture = plain(mechanism_drawing(element).picture(""))
    lines = [mark for mark in picture["marks"] if mark.get("look") in {"hidden", "line"}]
    assert len(lines) >= 26, {str(mark)[:200] for mark in picture["marks"]}  # 13 along each, cut where they turn away
    texts = {"".join(part["text"] for part in mark.get("parts", ())) for mark in picture["marks"]}
    assert {"angle", "way"} <= texts, texts


def test_a_distance_that_is_none_is_refused(
    proofroll: Proofroll, trough: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A declaration that contradicts itself gets one line that says how, before anything runs."""
    from trough import Trough

    monkeypatch.setattr(Trough, "distance", lambda self, x, y, z: self.radius**2 - y * y - z * z)  # noqa: ARG005
    (trough / "scene.toml").write_text(SCENE.replace("0.3", "0.31"))  # of formulas once made nothing changes
    code, _, err = proofroll("check", str(trough))
    assert code == 2
    assert "wall: distance" in err
    assert "one metre per metre" in err
