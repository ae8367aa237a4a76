"""``proofroll check`` of scenes and studies: what they hold, how scenes start, and nothing is run."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from proofroll.elements.mechanism.report.drawing import mechanism_drawing
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene, scene_names
from proofroll.report.pen import Polyline
from proofroll.running import runner
from proofroll.running.runner import Runner

Proofroll = Callable[..., tuple[int, str, str]]
COMPARISONS = data_folder("comparisons")


@pytest.fixture(autouse=True)
def nothing_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A check that runs a case fails."""

    def run(*_: object) -> None:
        raise AssertionError("a case was run")

    monkeypatch.setattr(Runner, "run", run)
    monkeypatch.setattr(runner, "run_one", run)


@pytest.mark.one_in(4)
@pytest.mark.parametrize("name", scene_names())
def test_every_scene_is_sound(proofroll: Proofroll, name: str) -> None:
    """Each scene of the package passes with a line that counts its parameters, and a few that say how it starts."""
    code, out, err = proofroll("check", name)
    assert (code, err) == (0, "")
    assert out.startswith(f"{name} is sound: scene, ")
    assert re.search(r" parameters?, ", out.splitlines()[0])
    assert 1 < out.count("\n") <= 18
    assert "warning" not in out


def test_what_is_sound_fits_the_terminal(proofroll: Proofroll, monkeypatch: pytest.MonkeyPatch) -> None:
    """A line of a scene that requires much is broken where the terminal ends."""
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = proofroll("check", "gyroscope_cart")
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("bouncing_ball", ("", ""), ["speed 0 m/s", "gaps of pairs: ball_on_wall 1 m"]),
        ("sphere_in_cylinder", ("", ""), ["gamma = 0 rad", "the wall's force on it is 41.39 N"]),
        ("slide_to_roll", ("", ""), ["v0 is velocity (2, 0, 0) m/s", "gaps of pairs: ball_on_wall 0 m"]),
        ("torus_rim", ("", ""), ["ball: centre of mass at (0.1612, 0, 0.1065) m, speed 0.8 m/s"]),
        (
            "four_bar",
            ("", ""),
            ["freedom: 1; 10 constraints of loops and couplings", "rod0: centre of mass at (0, 0.5, 0) m"],
        ),
        ("gear_pair", ("", ""), ["freedom: 1; 1 constraint of loops and couplings\n"]),
        ("bricard", ("", ""), ["degrees of freedom: 1", "of which 1 follow from the others"]),
        ("double_pendulum", ("", ""), ["degrees of freedom: 2\n"]),
        ("cradle", ("", ""), ["gaps of pairs: hit 0.1 m, "]),
    ],
)
def test_how_a_scene_starts(
    proofroll: Proofroll, tmp_path: Path, name: str, change: tuple[str, str], words: list[str]
) -> None:
    """Places, what presses a ball, and degrees of freedom are told."""
    shutil.copytree(data_folder("models") / name, tmp_path, dirs_exist_ok=True)
    text = (tmp_path / "scene.toml").read_text(encoding="utf-8")
    assert change[0] in text
    (tmp_path / "scene.toml").write_text(text.replace(*change, 1) if change[0] else text, encoding="utf-8")
    _, out, _ = proofroll("check", str(tmp_path))
    for word in words:
        assert word in out


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("pendulum", ("value = 2.8", "value = 45"), "joint pivot: an angle of 45 rad is 7.2 turns; angles are radians"),
        ("double_pendulum", ("[[points]]", "[[points]]"), ""),
        ("free_body", ('name = "body"', 'name = "body"\ncom = [351, 0, 0]'), "lies 351 m from its origin; lengths are"),
        ("free_body", ('kind = "free"', 'kind = "free"\norientation = [0, 0, 90]'), "an angle of 90 rad is 14.3 turns"),
        ("slide_to_roll", ("", ""), ""),
        (
            "sphere_in_cylinder",
            ('value = 0.025\nunit = "m"', 'value = 0.0025\nunit = "m"'),
            "denser than osmium; lengths",
        ),
    ],
)
def test_numbers_in_another_unit(
    proofroll: Proofroll, tmp_path: Path, name: str, change: tuple[str, str], words: str
) -> None:
    """Degrees, millimetres and impossible densities of a scene are told as warnings; sound numbers are not."""
    shutil.copytree(data_folder("models") / name, tmp_path, dirs_exist_ok=True)
    text = (tmp_path / "scene.toml").read_text(encoding="utf-8")
    assert change[0] in text
    (tmp_path / "scene.toml").write_text(text.replace(*change, 1), encoding="utf-8")
    code, out, _ = proofroll("check", str(tmp_path))
    said = " ".join(out.split())
    assert code == 0
    assert ("warning: " in said) == bool(words)
    assert words in said


def test_axes_of_the_start_are_told(proofroll: Proofroll) -> None:
    """The velocity of a free joint stands along the child's axes and the world's, with the axes of all vectors."""
    _, out, _ = proofroll("check", "heavy_top")
    said = " ".join(out.split())
    assert "tip: v0 is angular velocity (0, 1, 60) rad/s along the axes of top; along the world's: (0, -27.89" in said
    assert "velocities and forces of a run along the world's" in said


@pytest.mark.nightly
def test_a_scene_is_drawn(proofroll: Proofroll, tmp_path: Path) -> None:
    """With --plot the scene at its start, its parameters and how it starts are a page; a study or robot has none."""
    page = tmp_path / "scene.html"
    code, out, _ = proofroll("check", "four_bar", "--plot", str(page))
    assert (code, "".join(out.split()).endswith(f"Theplotisin{page}.")) == (0, True)
    text = page.read_text(encoding="utf-8")
    assert '<svg class="drawing"' in text
    assert "degrees of freedom: 1" in text
    assert "acceleration of gravity" in text
    for name, words in (("paper", "is no scene"), ("pendulum.png", "end the name of the file in .html")):
        plot = str(tmp_path / "none.html") if name == "paper" else str(tmp_path / name)
        code, _, err = proofroll("check", name.partition(".")[0], "--plot", plot)
        assert (code, err.count("\n")) == (2, 1)
        assert words in err


def test_a_box_is_drawn_with_its_edges(tmp_path: Path) -> None:
    """The twelve edges of a box that may touch are lines of the drawing."""
    text = (data_folder("models") / "free_body" / "scene.toml").read_text(encoding="utf-8")
    more = """
[[geometries]]
name = "case"
body = "body"
kind = "box"
size = [0.4, 0.3, 0.2]

[[geometries]]
name = "floor"
body = "world"
kind = "plane"
position = [0, 0, -2]

[[pairs]]
name = "touch"
geometries = ["case", "floor"]
friction = 0.3
"""
    (tmp_path / "scene.toml").write_text(text + more, encoding="utf-8")
    lines = [
        sum(isinstance(mark, Polyline) for mark in mechanism_drawing(the_mechanism(load_scene(scene))).marks)
        for scene in (str(tmp_path), "free_body")
    ]
    assert lines[0] - lines[1] >= 12


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.drill_of("accuracy")
@pytest.mark.parametrize("path", sorted(COMPARISONS.glob("*.toml")), ids=lambda path: path.stem)
def test_every_study_is_sound(proofroll: Proofroll, path: Path) -> None:
    """Each file of a study of the package passes with one sentence, whatever it is for."""
    code, out, err = proofroll("check", str(path))
    assert (code, err) == (0, "")
    assert len(out.splitlines()) <= 2
    assert out.startswith(f"{path.stem} is sound: ")


def test_json(proofroll: Proofroll) -> None:
    """With --json it says what the thing is, where it lies, its parts, and what engines must provide."""
    code, out, _ = proofroll("check", "sphere_in_cylinder", "--json")
    found = json.loads(out)
    assert (code, found["kind"], found["name"]) == (0, "scene", "sphere_in_cylinder")
    assert Path(found["path"]).is_file()
    assert found["counts"]["[[balls]]"] == 1
    of_contact = ["contact between bodies", "contact of spheres", "contact with bores"]
    assert found["requires"] == [*of_contact, "contacts that never slip (friction = inf)"]


def broken(tmp_path: Path, name: str, old: str, new: str) -> str:
    """A copy of a study of the package with a slip of the pen."""
    text = (COMPARISONS / name).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new, 1), encoding="utf-8")
    return str(tmp_path / name)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("inclined_plane.toml", "formulation=dependent", "formulation=dependant", ["rows.0.engine", "dependant"]),
        ("inclined_plane.toml", 'gap = "1e-5 m"', 'gap = "1e-5 s"', ["gap", "its unit is m"]),
        (
            "inclined_plane.toml",
            "tilt = [0.35]",
            "tlt = [0.35]",
            ["inclined_plane.toml: tlt = 0.35", "choose from"],
        ),
        ("inclined_plane.toml", "tilt = [0.35]", "tilt = [9.0]", ["inclined_plane.toml: tilt = 9", "must be below"]),
        (
            "inclined_plane.toml",
            "=dependent]",
            "=euler]",
            ["rows.0.engine", "at tilt=0.35"],
        ),
        ("inclined_plane.toml", "=geoms]", "=geoms,dt=0.003]", ["rows.5.engine", "no whole number of steps"]),
        (
            "inclined_plane.toml",
            "ladder = [4, 2, 1]",
            "ladder = [9, 3, 1]",
            ["rows.2.ladder", "does not divide the interval", "[4.0, 2.0, 1.0] does"],
        ),
        ("regimes.toml", "count = ", "count = 100000", ["speed = 'from 1 to 7", "count of 1 to 1000"]),
        ("stick_slip.toml", "[0.39, 0.40]", "[0.40, 0.39]", ["points.", "lower value first"]),
        ("stability_plane.toml", "values = [0.05,", "value = [0.05,", ["axes.0"]),
        ("regimes.toml", "low = 1.0", "low = 9.0", ["speed", "low <= high"]),
        ("regimes.toml", 'study = "regimes"', 'study = "regime"', ["study = 'regime'", "regimes"]),
    ],
)
def test_a_slip_of_the_pen(
    proofroll: Proofroll, tmp_path: Path, name: str, old: str, new: str, words: list[str]
) -> None:
    """What is wrong is said in one line, with its place, and the exit code is 2."""
    code, out, err = proofroll("check", broken(tmp_path, name, old, new))
    assert (code, out, err.count("\n")) == (2, "", 1)
    for word in words:
        assert word in err


def test_a_folder_without_a_scene(proofroll: Proofroll, tmp_path: Path) -> None:
    """Every command says of a folder what it lacks."""
    for command in (["check"], ["compare"], ["run", "--engine", "truth"]):
        code, out, err = proofroll(*command, str(tmp_path))
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "this folder has no scene.toml" in err


def test_the_path_of_a_scene_file(proofroll: Proofroll) -> None:
    """The path of a scene.toml means its scene, for every command."""
    path = str(data_folder("models") / "pendulum" / "scene.toml")
    for command in (["check"], ["cite"]):
        code, out, err = proofroll(*command, path)
        assert (code, err) == (0, "")
        assert "pendulum" in out


def test_neither_scene_nor_file(proofroll: Proofroll) -> None:
    """A name of nothing is told what resembles it."""
    code, out, err = proofroll("check", "sphere_in_cone")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "sphere_in_cylinder" in err


@pytest.mark.parametrize("what", ["inclined_plane", str(COMPARISONS / "paper.toml")])
@pytest.mark.parametrize(
    "given",
    [("--engine", "mujoco"), ("--base", "free"), ("--states", "20"), ("--out", "checked"), ("--time-limit", "9")],
)
def test_what_is_for_robots_is_not_overlooked(proofroll: Proofroll, what: str, given: tuple[str, str]) -> None:
    """An option that would do nothing is refused in one line, also with the value that it has anyway."""
    code, out, err = proofroll("check", what, *given)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert given[0] in err
    assert "this is for robot files" in err
    assert ("compare SCENE --engine" in err) == (given[0] == "--engine")
