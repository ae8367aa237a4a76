"""``run --plot`` and ``proofroll replay``: a person's own run as a picture, and in motion."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr
from mixed_scene import BALL_AND_PENDULUM

from proofroll.files.trajectory_file import read, write
from proofroll.report.run.curves import names_of_curves

Proofroll = Callable[..., tuple[int, str, str]]
RUN = ["--until", "0.1", "--every", "0.05"]


@pytest.mark.nightly_of("pendulum-truth-names1-.png-\\x89PNG")
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("scene", "engine", "names", "ending", "begins"),
    [
        ("sphere_in_cylinder", "oracle", {"gamma", "z", "N"}, ".svg", b"<?xml"),
        ("pendulum", "truth", {"q.pivot", "force.pivot.x"}, ".png", b"\x89PNG"),
    ],
)
def test_every_curve_with_its_unit(
    proofroll: Proofroll, tmp_path: Path, scene: str, engine: str, names: set[str], ending: str, begins: bytes
) -> None:
    """The picture has a panel for each variable over time, of whatever kind of element; run says what it wrote."""
    run, picture = tmp_path / "run.nc", tmp_path / f"run{ending}"
    code, out, err = proofroll("run", scene, "--engine", engine, *RUN, "--out", str(run), "--plot", str(picture))
    assert (code, err) == (0, "")
    assert "The trajectory is in" in out
    assert "The plot is in" in out
    assert names <= set(names_of_curves(read(run)))

    assert picture.read_bytes().startswith(begins)
    assert ending == ".png" or b"<svg" in picture.read_bytes()


def curves_of(page: Path) -> list[str]:
    """Titles of the panels of a page."""
    html = page.read_text(encoding="utf-8").partition('id="curves"')[2]
    return [re.sub("<[^>]*>", "", title) for title in re.findall("<figcaption>(.*?)</figcaption>", html)]


@pytest.mark.drill
def test_a_page_has_the_curves_that_are_furthest_off(proofroll: Proofroll, tmp_path: Path) -> None:
    """A page has the motion and four curves beside the truth's, one of each unit first, in less than 1.5 MB."""
    run, page = tmp_path / "run.nc", tmp_path / "run.html"
    words = ["pendulum", "--engine", "mujoco[dt=2e-2]", "--until", "1", "--every", "0.1"]
    assert proofroll("run", *words, "--out", str(run), "--plot", str(page))[0] == 0
    titles = curves_of(page)
    assert len(titles) == 4
    assert len({re.findall(r"\[(.*?)\]", title)[0] for title in titles}) == 4
    assert all(re.search(r": at most [\d.e-]+ .* off, at [\d.]+ s$", title) for title in titles)
    html = page.read_text(encoding="utf-8")
    assert html.count('class="true"') == 4
    assert 'data-part="cases"' in html
    assert "<script src=" not in html  # nothing is loaded
    assert '<meta http-equiv="Content-Security-Policy" content="default-src \'none\';' in html
    assert page.stat().st_size < 1.5e6


@pytest.mark.nightly
def test_json_says_what_was_written(proofroll: Proofroll, tmp_path: Path) -> None:
    """With --json the paths of the files stand in the document."""
    run, picture = tmp_path / "run.nc", tmp_path / "run.html"
    files = ["--out", str(run), "--plot", str(picture), "--json"]
    code, out, _ = proofroll("run", "sphere_in_cylinder", "--engine", "oracle", *RUN, *files)
    content = json.loads(out)
    assert (code, content["trajectory"], content["plot"]) == (0, str(run), str(picture))
    assert picture.is_file()


@pytest.mark.nightly
def test_bad_files(proofroll: Proofroll, tmp_path: Path) -> None:
    """No file, no run in it, or an ending that no picture has: one line, exit code 2, and nothing is written."""
    for name in ("text.nc", "text.npz"):
        (tmp_path / name).write_text("no run")
    whole = tmp_path / "whole.nc"
    assert proofroll("run", "pendulum", "--engine", "truth", *RUN, "--out", str(whole))[0] == 0
    (tmp_path / "cut.nc").write_bytes(whole.read_bytes()[:100])
    for arguments, word in (
        ([str(tmp_path / "cut.nc")], "no run in netCDF"),
        (["."], "no run in netCDF"),
        ([str(tmp_path / "none.nc")], "no such file"),
        ([str(tmp_path / "text.nc")], "no run in netCDF"),
        ([str(tmp_path / "text.npz")], "no run in netCDF"),
        ([str(tmp_path / "text.nc"), "--out", str(tmp_path / "run.gif")], ".html"),
    ):
        code, out, err = proofroll("replay", *arguments)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert word in err
    assert [path.name for path in tmp_path.iterdir() if path.suffix in {".html", ".gif"}] == []


def test_no_other_file_is_written_over(proofroll: Proofroll, tmp_path: Path) -> None:
    """A run goes into no file whose ending is another's, as a scene's."""
    (scene := tmp_path / "scene.toml").write_text("mine")
    code, out, err = proofroll("run", "pendulum", "--engine", "truth", *RUN, "--out", str(scene))
    assert (code, out, scene.read_text()) == (2, "", "mine")
    assert "end the name of the file in .nc, .csv or .npz" in err


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("words", "shown"),
    [(["sphere_in_cylinder", "--set", "speed=3", "--engine", "oracle"], ["truth", "oracle"]),
     (["pendulum", "--engine", "truth"], ["truth"]),
     (["painleve_rod", "--engine", "mujoco"], ["mujoco"])],
)  # fmt: skip
def test_a_run_in_motion(proofroll: Proofroll, tmp_path: Path, words: list[str], shown: list[str]) -> None:
    """The page holds the truth and beside it the run, of whatever kind, named by what is not default; or it alone."""
    run = tmp_path / "run.nc"
    assert proofroll("run", *words, *RUN, "--out", str(run))[0] == 0
    code, out, err = proofroll("replay", str(run))
    assert (code, err) == (0, "")
    assert "run-replay.html" in out
    page = (tmp_path / "run-replay.html").read_text(encoding="utf-8")
    (found,) = re.findall(r'data-part="cases">(.*?)</script>', page, flags=re.DOTALL)
    (case,) = json.loads(found)
    assert [item["name"] for item in case["runs"]] == shown
    assert case["label"] == ("speed=3" if "--set" in words else case["scene"])


@pytest.mark.nightly
def test_elements_in_motion(proofroll: Proofroll, tmp_path: Path) -> None:
    """Of a scene of several elements each is a case of its own, with its truth and its part of the run."""
    (tmp_path / "mixed").mkdir()
    (tmp_path / "mixed" / "scene.toml").write_text(BALL_AND_PENDULUM, encoding="utf-8")
    run = tmp_path / "run.nc"
    said = proofroll("run", str(tmp_path / "mixed"), "--engine", "projection", *RUN, "--out", str(run))
    assert said[0] == 0, said
    assert proofroll("replay", str(run))[0] == 0
    page = (tmp_path / "run-replay.html").read_text(encoding="utf-8")
    (found,) = re.findall(r'data-part="cases">(.*?)</script>', page, flags=re.DOTALL)
    cases = json.loads(found)
    assert [(case["kind"], case["label"]) for case in cases] == [("ball", "ball"), ("mechanism", "mechanism")]
    assert [[item["name"] for item in case["runs"]] for case in cases] == [["truth", "projection"]] * 2
    assert len(re.findall(r"<script[^>]*data-numbers=", page)) == 2
    write(read(run).drop_vars("p_WB.mechanism"), tmp_path / "still.nc")
    code, _, err = proofroll("replay", str(tmp_path / "still.nc"))
    assert (code, err.count("\n")) == (2, 1)
    assert "no poses of bodies (p_WB) of mechanism" in err


@pytest.mark.drill
def test_what_cannot_be_replayed(proofroll: Proofroll, tmp_path: Path) -> None:
    """A file that is no page, a run of no scene, and a scene that has changed since: one line, exit code 2."""
    run = tmp_path / "run.nc"
    assert proofroll("run", "pendulum", "--engine", "truth", *RUN, "--out", str(run))[0] == 0
    dataset = read(run)
    write(dataset.assign_attrs(scene_digest="another"), tmp_path / "old.nc")
    write(dataset.drop_vars("p_WB"), tmp_path / "still.nc")
    write(dataset.assign_coords(time=dataset["time"][::-1]), tmp_path / "back.nc")
    write(dataset.assign_attrs(settings="{"), tmp_path / "unset.nc")
    write(dataset.assign(p_WB=dataset["p_WB"] * float("nan")), tmp_path / "nan.nc")
    del dataset.attrs["scene"]
    write(dataset, tmp_path / "none.nc")
    for arguments, word in (
        ([str(run), "--out", str(tmp_path / "run.svg")], ".html"),
        ([str(tmp_path / "old.nc")], "has changed since this run"),
        ([str(run), "--scene", "inclined_plane"], "the run is one of pendulum, and this scene has no angle, length"),
        ([str(tmp_path / "none.nc")], "does not say which scene"),
        ([str(tmp_path / "still.nc")], "no poses of bodies"),
        ([str(tmp_path / "back.nc")], "its times have to rise"),
        ([str(tmp_path / "nan.nc")], "its poses to be numbers"),
        ([str(tmp_path / "unset.nc")], "does not say which scene"),
        (["."], "no run in netCDF"),
    ):
        code, out, err = proofroll("replay", *arguments)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert word in err


def test_what_has_no_value_is_not_drawn() -> None:
    """A variable without any value, of text or without a unit has no panel."""
    times = [0.0, 1.0]
    made = xr.Dataset(
        {
            "z": ("time", [1.0, float("nan")], {"units": "m"}),
            "force": ("time", [float("nan")] * 2, {"units": "N"}),
            "sticks": ("time", ["yes", "no"], {"units": "1"}),
            "count": ("time", [1, 2]),
            "p": (("time", "xyz"), [[0.0] * 3] * 2, {"units": "m"}),
        },
        {"time": times},
    )
    assert names_of_curves(made) == ["z"]
