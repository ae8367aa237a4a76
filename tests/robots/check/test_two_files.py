"""``proofroll check --against``: two files of one robot."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from robot_templates import urdf

from proofroll.robots.check.two_files import against

Proofroll = Callable[..., tuple[int, str, str]]

pytestmark = pytest.mark.drill  # each imports an engine, or the first of them does
URDF = """<robot name="arm"><link name="base"/><link name="upper"><inertial><origin xyz="0.1 0 0"/><mass value="1.5"/>
<inertia ixx="0.01" iyy="0.02" izz="0.021" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="h" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 1" rpy="0 0 0.3"/>
<axis xyz="0 1 0"/>{}</joint></robot>"""
MJCF = """<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0 0 1" euler="0 0 0.3">
<joint name="h" axis="0 1 0" {}/><inertial pos="0.1 0 0" mass="1.5" diaginertia="0.01 0.02 0.021"/></body>
</worldbody></mujoco>"""
DAMPING = '<dynamics damping="0.7"/>'
Pair = Callable[[str, str], tuple[Path, Path]]


@pytest.fixture
def pair(tmp_path: Path) -> Pair:
    """Two files beside each other."""

    def written(one: str, two: str) -> tuple[Path, Path]:
        found = tmp_path / "one.urdf", tmp_path / "two.xml"
        for path, text in zip(found, (one, two), strict=True):
            path.write_text(text)
        return found

    return written


def test_one_robot_in_two_formats(proofroll: Proofroll, pair: Pair) -> None:
    """A URDF and an MJCF of one robot agree at every layer, and the command exits 0."""
    pytest.importorskip("mujoco")
    one, two = pair(URDF.format(DAMPING), MJCF.format('damping="0.7"'))
    code, out, _ = proofroll("check", str(one), "--against", str(two), "--json")
    content = json.loads(out)
    assert code == 0
    (row,) = content["engines"]
    assert row["status"] == "holds"
    assert len(row["layers"]) == len(content["layers"])
    assert content["values"] == []
    assert content["matched"] == {"h": "h"}


@pytest.mark.parametrize("turned", [False, True])
def test_which_file_has_what(turned: bool, proofroll: Proofroll, pair: Pair, tmp_path: Path) -> None:
    """A law that one file lacks is a cause whichever file comes first, and said with both values."""
    pytest.importorskip("mujoco")
    files = pair(URDF.format(DAMPING), MJCF.format(""))
    one, two = reversed(files) if turned else files
    code, out, _ = proofroll("check", str(one), "--against", str(two), "--out", str(tmp_path / "out"))
    said = " ".join(out.split())
    assert code == 1
    assert "two.xml differs in forward dynamics" in said
    assert "explained by: damping is not used" in said
    assert "Do:" not in said
    values = "damping 0 in two.xml, 0.7 in one.urdf" if turned else "damping 0.7 in one.urdf, 0 in two.xml"
    assert f"joint h: {values}" in said
    kept = json.loads((tmp_path / "out" / "check.json").read_text())
    value = {"joint": "h", "quantity": "damping", "here": 0.0 if turned else 0.7, "there": 0.7 if turned else 0.0}
    assert kept["values"] == [value]
    assert "What each file has" in (tmp_path / "out" / "check.html").read_text()


def test_other_names(proofroll: Proofroll, pair: Pair, tmp_path: Path) -> None:
    """Joints without a partner are listed; partners are given on the command line or in a file."""
    pytest.importorskip("mujoco")
    one, two = pair(URDF.format(""), MJCF.format("").replace('"h"', '"hinge"'))
    code, out, _ = proofroll("check", str(one), "--against", str(two))
    assert code == 1
    assert "only in one.urdf: h\nonly in two.xml: hinge\n" in out
    partners = tmp_path / "names.toml"
    partners.write_text('h = "hinge"\n')
    for given in ("h=hinge", str(partners)):
        code, out, _ = proofroll("check", str(one), "--against", str(two), "--map", given)
        assert code == 0
        assert "joints with another name there: h is hinge" in out


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--map", "x=h"], "no joint of the first file moves under this name; those are h"),
        (["--map", "h=x"], "no joint of the second file moves under this name; those are h"),
        (["--map", "h=h", "--map", "h=h"], "h is given twice"),
        (["--engine", "mujoco"], "--against compares two files and asks no engine"),
    ],
)
def test_wrong_names(asked: list[str], said: str, proofroll: Proofroll, pair: Pair) -> None:
    """A name that no joint has, or an engine, is one clear line."""
    one, _ = pair(URDF.format(""), "")
    code, _, err = proofroll("check", str(one), "--against", str(one), *asked)
    assert code == 2
    assert said in err


def test_map_of_one_file(proofroll: Proofroll, arm: Path) -> None:
    """Partners without a second file are refused."""
    code, _, err = proofroll("check", str(arm), "--map", "a=b")
    assert code == 2
    assert "name the other by --against FILE" in err


def test_a_joint_more(tmp_path: Path) -> None:
    """A joint that only one file moves is named, and all others are held against each other."""
    one, two = tmp_path / "one.urdf", tmp_path / "two.urdf"
    one.write_text(urdf())
    two.write_text(urdf(kinds=("revolute", "prismatic", "fixed")))
    found = against(one, two)
    assert found.absent == ["j3"]
    assert found.added == []
    assert found.engines[0].layers["joints"].difference == 1
    assert set(found.engines[0].layers) > {"mass", "mass matrix"}


def _renamed(text: str, form: str) -> str:
    for number in (1, 2, 3):
        text = text.replace(f'joint name="j{number}"', f'joint name="{form.format(number)}"')
    return text


@pytest.mark.one_in(3)
@pytest.mark.parametrize(("form", "argument"), [("arm_j{}", "*=arm_*"), ("k{}", "j*=k*"), ("j{}_r", "*=*_r")])
def test_proposed_map(form: str, argument: str, proofroll: Proofroll, tmp_path: Path) -> None:
    """A map is proposed, and taken, where names differ by a prefix or suffix and kinds and tree fit."""
    one, two = tmp_path / "one.urdf", tmp_path / "two.urdf"
    one.write_text(urdf())
    two.write_text(_renamed(urdf(), form))
    code, out, _ = proofroll("check", str(one), "--against", str(two))
    assert code == 1
    assert f"try --map '{argument}'" in " ".join(out.split())
    code, out, _ = proofroll("check", str(one), "--against", str(two), "--map", argument)
    assert code == 0
    assert "--map" not in out


def test_no_map_is_proposed(tmp_path: Path) -> None:
    """Joints of other kinds are no partners, whatever their names, nor are names without a common part."""
    one, two = tmp_path / "one.urdf", tmp_path / "two.urdf"
    one.write_text(urdf())
    two.write_text(_renamed(urdf(kinds=("prismatic", "revolute", "prismatic")), "arm_j{}"))
    assert against(one, two).proposed == ""
    two.write_text(_renamed(urdf(), "x{}x"))
    assert against(one, two).proposed == ""


@pytest.mark.parametrize(
    ("names", "said"),
    [("j**=k*", "write one * on each side"), ("j*=k", "write one * on each side"), ("x*=y*", "it fits no joint")],
)
def test_wrong_patterns(names: str, said: str, proofroll: Proofroll, pair: Pair) -> None:
    """A pattern of ``--map`` with no or two ``*`` on a side, or that fits nothing, is one clear line."""
    one, _ = pair(URDF.format(""), "")
    code, _, err = proofroll("check", str(one), "--against", str(one), "--map", names)
    assert code == 2
    assert said in err


def test_last_written_digit(proofroll: Proofroll, pair: Pair, tmp_path: Path) -> None:
    """Values that differ by the last digit of one file are one line; a value that differs by more is named."""
    limits = '<limit lower="{}" upper="{}" effort="1" velocity="1"/>'
    one, _ = pair(URDF.format(limits.format(-6.28319, 1.5708)).replace("continuous", "revolute"), "")
    two = tmp_path / "two.urdf"
    two.write_text(one.read_text().replace("-6.28319", "-6.283185307").replace("1.5708", "1.570796"))
    code, out, _ = proofroll("check", str(one), "--against", str(two))
    assert code == 0
    assert "2 values differ by the last written digit alone: h lower -6.28319" in out
    assert "joint h" not in out
    two.write_text(one.read_text().replace("-6.28319", "-6.283185307").replace("1.5708", "1.5710"))
    found = against(one, two)
    assert [value.quantity for value in found.values] == ["upper"]
    assert [value.quantity for value in found.rounded] == ["lower"]
