"""The table of a robot on its floor, made with the commands of the page on robots."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from proofroll import load_scene, simulate
from proofroll.files.scene_sources import with_control

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")
pytestmark = pytest.mark.drill

PAGE = Path(__file__).resolve().parents[3] / "docs" / "control_a_robot.md"
MATCHED = "mujoco[formulation=geoms,preset=matched,dt=1e-3]"
UNTIL = 0.12  # s
INERTIA = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'


def _link(name: str, mass: float, shapes: str = "") -> str:
    inertial = f'<inertial><origin xyz="0 0 0.05"/><mass value="{mass}"/>{INERTIA}</inertial>'
    return f'<link name="{name}">{inertial}{shapes}</link>'


def _joint(name: str, parent: str, child: str, z: float) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 {z}"/><axis xyz="0 1 0"/>'
    return f'<joint name="{name}" type="revolute">{ends}<limit lower="-2" upper="2" effort="50" velocity="50"/></joint>'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with the file of a stool on three feet with an arm of two joints, and the controller of the page."""
    feet = "".join(
        f'<collision><origin xyz="{x} {y} 0"/><geometry><sphere radius="0.02"/></geometry></collision>'
        for x, y in ((0.2, 0.0), (-0.1, 0.17), (-0.1, -0.17))
    )
    links = _link("seat", 2.0, feet) + _link("upper_arm", 0.3) + _link("lower_arm", 0.2)
    joints = _joint("hip", "seat", "upper_arm", 0.1) + _joint("knee", "upper_arm", "lower_arm", 0.15)
    (tmp_path / "my_robot.urdf").write_text(f'<robot name="stool">{links}{joints}</robot>')
    toml, _ = _blocks()
    (tmp_path / "hold.toml").write_text(toml)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _blocks() -> tuple[str, list[list[str]]]:
    """Controller and commands of the page's section."""
    text = PAGE.read_text(encoding="utf-8").partition("## The table of your own robot")[2].partition("\n## ")[0]
    (toml,), (sh,) = (re.findall(rf"^```{kind}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE) for kind in ("toml", "sh"))
    return toml, [shlex.split(line) for line in sh.splitlines()]


@pytest.mark.drill
def test_the_commands_of_the_page_make_the_table(folder: Path, proofroll: Callable[..., tuple[int, str, str]]) -> None:
    """Each command works on a robot that the page does not know, and the table's numbers are those of plain runs."""
    check, compare = (words[1:] for words in _blocks()[1])
    code, out, _ = proofroll(*check)
    assert (code, "3 shapes on a floor, friction 0.8" in " ".join(out.split())) == (0, True), out
    assert compare[-2:] == ["--until", "1"]
    words = [*compare[:-1], str(UNTIL), "--engine", MATCHED, "--out", str(folder / "out")]
    _, out, err = proofroll(*words)
    table = out.partition("Largest distance from the reference")[2].splitlines()
    assert all(len(line) <= 80 for line in out.splitlines()), err
    assert table[1].split() == ["up", "to", "0.1", "s", "0.12", "s", "s/s"]
    assert table[2].startswith("known to ")
    assert table[3].startswith("MuJoCo geoms, matched, dt 1e-3 s ")
    told = json.loads(proofroll(*words, "--json")[1])["distances"][0]
    bars, line = told["lines"]
    scene = load_scene(with_control("my_robot.urdf", folder / "hold.toml"))
    true, run = (simulate(scene, engine, until=UNTIL, every=4e-3) for engine in ("truth", MATCHED))
    apart = np.linalg.norm(run["p_WB"].values - true["p_WB"].values, axis=-1).max(axis=1)
    for time, place in zip(told["times"], line["places"], strict=True):
        assert place == pytest.approx(apart[true["time"].values <= time + 1e-9].max(), rel=0.05)
    assert bars["places"][0] <= bars["places"][1] == pytest.approx(true["p_WB"].attrs["error_bar"], rel=0.05)
    assert max(line["places"][1], bars["places"][1]) < 1e-3
