"""``proofroll new``: what it writes works at once."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from proofroll.files.comparison_file import load_comparison

Proofroll = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, in which the commands are given."""
    place = tmp_path / "mine"
    place.mkdir()
    monkeypatch.chdir(place)
    return place


@pytest.mark.drill
def test_a_scene(proofroll: Proofroll) -> None:
    """A new scene is sound, and the truth covers it."""
    assert proofroll("new", "scene", "rod")[0] == 0
    assert proofroll("check", "rod")[0] == 0
    code, out, err = proofroll("run", "rod", "--engine", "truth", "--until", "0.1", "--every", "0.05", "--json")
    assert (code, err) == (0, "")
    assert '"status": "done"' in out


@pytest.mark.nightly_of("./rod")
@pytest.mark.nightly
@pytest.mark.parametrize("scene", ["sphere_in_cylinder", "./rod"])
def test_a_comparison(
    command_line: Proofroll, install_engines: Callable[[Mapping[str, str]], None], scene: str
) -> None:
    """A new comparison is sound, of balls and of mechanisms, and has a row for each engine that can."""
    install_engines(
        {"oracle": "hostile:Oracle", "absent": "no_such_module_anywhere:Engine"}
    )  # as tests/test_json.py: workers are shared
    assert command_line("new", "scene", "rod")[0] == 0
    text = Path("rod/scene.toml").read_text(encoding="utf-8")
    Path("rod/scene.toml").write_text(f"duration = 0.8\n{text}", encoding="utf-8")
    assert command_line("new", "comparison", "claim", "--scene", scene)[0] == 0
    code, out, err = command_line("check", "claim.toml")
    assert (code, err) == (0, "")
    assert out.startswith("claim is sound: comparison, ")
    comparison = load_comparison("claim.toml")
    assert comparison.until == (0.8 if scene == "./rod" else 1.0)  # as long as the scene says
    names = {row.engine.partition("[")[0] for row in comparison.rows}
    assert {"projection", "mujoco", "exudyn", "pinocchio"} <= names
    assert "absent" not in names
    assert ("reduced" in names) == (scene == "sphere_in_cylinder")  # it has no equations of a rod


@pytest.mark.drill
@pytest.mark.parametrize(("scene", "asked"), [("pushed_box", False), ("sled", True)])
def test_a_comparison_asks_for_what_is_determined(command_line: Proofroll, scene: str, asked: bool) -> None:
    """Of a box, whose corners share their forces in no known way, it asks for the sum of each pair alone."""
    assert command_line("new", "comparison", "claim", "--scene", scene)[0] == 0
    bounds = load_comparison("claim.toml").bands["close"].bounds
    assert ("contact_forces" in bounds, "pair_forces" in bounds) == (asked, not asked)


@pytest.mark.drill
def test_an_engine(proofroll: Proofroll, folder: Path) -> None:
    """A new engine announces its class from a package that hides no other, and passes its own conformance test."""
    assert proofroll("new", "engine", "my_engine")[0] == 0
    package = folder / "proofroll_my_engine"
    project = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"]["proofroll.engines"] == {"my_engine": "proofroll_my_engine:MyEngine"}
    assert [path.name for path in (package / "src").iterdir()] == ["proofroll_my_engine"]
    install = [
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--target",
        "site",
        f"./{package.name}",
    ]
    subprocess.run([sys.executable, "-m", *install], cwd=folder, capture_output=True, timeout=600, check=True)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"],
        cwd=package,
        env=os.environ | {"PYTHONPATH": str(folder / "site")},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("what", "name"),
    [("scene", "pendulum"), ("engine", "mujoco"), ("engine", "truth"), ("scene", "class"),
     ("comparison", "paper"), ("comparison", "regimes")],
)  # fmt: skip
def test_a_name_that_stands_for_something_else(proofroll: Proofroll, what: str, name: str) -> None:
    """A scene is not called as one of the package, which commands would take, nor an engine as what is installed."""
    more = {"comparison": ["--scene", "pendulum"]}.get(what, [])
    code, out, err = proofroll("new", what, name, *more)
    assert (code, out, list(Path().iterdir())) == (2, "", [])
    assert f"name = '{name}': " in err
    assert err.endswith("choose another name\n")


def test_an_engine_may_be_called_as_its_library(proofroll: Proofroll, folder: Path) -> None:
    """An engine has the name of its library, from a package that has another."""
    assert proofroll("new", "engine", "numpy")[0] == 0
    assert (folder / "proofroll_numpy" / "src" / "proofroll_numpy" / "__init__.py").exists()


@pytest.mark.parametrize("what", [["scene"], ["engine"], ["comparison", "--scene", "pendulum"]])
def test_nothing_is_overwritten(proofroll: Proofroll, folder: Path, what: list[str]) -> None:
    """What is there already stays, and so does a place that a name would lead out of the folder."""
    file = folder / {"comparison": "mine.toml", "engine": "proofroll_mine", "scene": "mine"}[what[0]]
    file.write_text("dear to me")
    for name in ("mine", "../mine", "Mine", "class"):
        code, out, err = proofroll("new", what[0], name, *what[1:])
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "name = " in err
    assert file.read_text() == "dear to me"
    assert [path.name for path in folder.iterdir()] == [file.name]
