"""``proofroll watch``: a scene of one's own in motion whenever it is saved; runs that are kept, and shown together."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest

from proofroll.cli.watch import _written
from proofroll.core.errors import InputError, Refused
from proofroll.files.data_folders import data_folder
from proofroll.files.kept_runs import kept_lines, kept_path, run_file

Proofroll = Callable[..., tuple[int, str, str]]


@pytest.mark.nightly
def test_a_watched_scene_is_shown_beside_the_truth(proofroll: Proofroll, tmp_path: Path) -> None:
    """The page has the truth and all engines that run, and the script beside it sets the version that it has."""
    folder, page = tmp_path / "mine", tmp_path / "mine.html"
    shutil.copytree(data_folder("models") / "pendulum", folder)
    words = ["--engine", "mujoco", "--engine", "exudyn", "--until", "0.2", "--out", str(page), "--once"]
    code, _, err = proofroll("watch", str(folder), *words)
    assert code == 0, err
    html = page.read_text(encoding="utf-8")
    assert "The truth, solid, and mujoco" in html
    assert "Exudyn redundant" in html
    (version,) = re.findall(r"'(\d+)'", page.with_suffix(".js").read_text(encoding="utf-8"))
    assert f'shown = "{version}"' in html
    assert [line.rpartition(",")[0].partition(": ")[2] for line in err.splitlines()][-1].endswith(
        "mujoco, exudyn, truth"
    )


@pytest.mark.drill
def test_a_watched_scene_without_a_truth(proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All engines are shown, and the page says why there is no truth."""

    def refuse(*_: object) -> None:
        raise Refused("no two routes cover it")

    for keeping in ("report.run.replay", "studies.judging.judge"):  # the truth that they are imported with
        import_module(f"proofroll.{keeping}")
    monkeypatch.setattr("proofroll.core.truth.truth", refuse)
    page = tmp_path / "page.html"
    words = ["--engine", "projection", "--engine", "projection[rtol=1e-6]", "--until", "0.1", "--out", str(page)]
    words.append("--once")
    code, _, err = proofroll("watch", "pendulum", *words)
    assert code == 0, err
    assert err.splitlines()[-1].rpartition(",")[0].endswith("projection, projection")
    assert "translucent: no two routes cover it." in page.read_text(encoding="utf-8")


def test_a_saved_file_is_seen(tmp_path: Path) -> None:
    """What is looked at changes when a file beside the scene is saved, and only then."""
    (tmp_path / "scene.toml").write_text("title = 'a'\n", encoding="utf-8")
    seen = _written(str(tmp_path), None)
    assert _written(str(tmp_path), None) == seen
    (tmp_path / "scene.toml").write_text("title = 'another'\n", encoding="utf-8")
    assert _written(str(tmp_path), None) != seen


def test_a_page_beside_its_scene_is_no_change(tmp_path: Path) -> None:
    """A page that is written beside the scene, a file that is half written and a link to nothing run nothing again."""
    (tmp_path / "scene.toml").write_text("title = 'a'\n", encoding="utf-8")
    seen = _written(str(tmp_path), None)
    for name in ("watch.html", "watch.js", ".watch.html.0123456789ab"):
        (tmp_path / name).touch()
    (tmp_path / "gone").symlink_to(tmp_path / "nowhere")
    assert _written(str(tmp_path), None) == seen
    shutil.rmtree(tmp_path)
    assert _written(str(tmp_path), None) != seen


@pytest.mark.parametrize("until", ["nan", "-1"])
def test_a_time_that_is_none_is_refused(proofroll: Proofroll, tmp_path: Path, until: str) -> None:
    """A time that no run has is one line, before any engine starts."""
    code, _, err = proofroll("watch", "pendulum", "--out", str(tmp_path / "page.html"), "--until", until, "--once")
    assert (code, err.count("\n"), "until" in err) == (2, 1, True)


def test_a_page_of_another_kind_is_refused(proofroll: Proofroll, tmp_path: Path) -> None:
    """What is watched is a page."""
    code, _, err = proofroll("watch", "pendulum", "--out", str(tmp_path / "page.svg"))
    assert (code, "end the name of the file in .html" in err) == (2, True)


@pytest.mark.drill
def test_kept_runs_are_listed_and_shown_together(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run kept by a name is listed with what differs; two of one scene share a page, two of several do not."""
    monkeypatch.chdir(tmp_path)
    assert [*kept_lines()] == ["No run is kept in out/runs; proofroll run … --keep NAME keeps one."]
    run = ["run", "pendulum", "--until", "0.2"]
    assert proofroll(*run, "--engine", "mujoco", "--every", "0.02", "--keep", "a")[0] == 0
    assert proofroll(*run, "--engine", "exudyn", "--every", "0.04", "--keep", "b")[0] == 0
    assert proofroll(*run, "--engine", "exudyn", "--set", "length=2", "--keep", "c")[0] == 0
    code, out, _ = proofroll("replay")
    assert code == 0
    lines = {line.split()[0]: line for line in out.splitlines()}
    assert re.match(r"a +\d{4}-\d\d-\d\d \d\d:\d\d  pendulum in mujoco, length=1.0, ", lines["a"])
    assert lines["a"].endswith(": done")
    assert "formulation=joints" in lines["a"]
    assert "length=2.0" in lines["c"]
    assert "angle" not in out  # all have the same
    assert proofroll("replay", "a", "b")[0] == 0
    page = Path("out/runs/a-replay.html").read_text(encoding="utf-8")
    assert "MuJoCo joints" in page
    assert "Exudyn redundant" in page
    assert proofroll(*run, "--engine", "truth", "--every", "0.02", "--keep", "true")[0] == 0
    assert proofroll("replay", "true", "a")[0] == 0
    assert "The curves of mujoco that are" in Path("out/runs/true-replay.html").read_text(encoding="utf-8")
    code, _, err = proofroll("replay", "a", "c")
    assert (code, "several scenes or parameters" in err) == (2, True)


def test_a_path_wins_over_a_kept_name(proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file is read by its path; a name that is no path is that of a kept run, and has no folder in it."""
    monkeypatch.chdir(tmp_path)
    kept_path("a").parent.mkdir(parents=True)
    kept_path("a").touch()
    assert run_file("a") == kept_path("a")
    Path("a").touch()
    assert run_file("a") == Path("a")
    kept_path("gone").symlink_to("nowhere")
    assert [line.split()[-3:] for line in kept_lines()] == [["cannot", "be", "read"]]
    code, _, err = proofroll("run", "pendulum", "--engine", "mujoco", "--keep", "../a")
    assert (code, "letters, digits" in err) == (2, True)


@pytest.mark.parametrize("name", ["a b", "-a", ".a", ""])
def test_a_name_that_a_command_would_misread_is_refused(name: str) -> None:
    """A name is one word that is no option."""
    with pytest.raises(InputError, match="letters, digits"):
        kept_path(name)
