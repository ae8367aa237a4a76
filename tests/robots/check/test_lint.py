"""What is noticed in a file before any engine sees it."""

from __future__ import annotations

from pathlib import Path

import pytest
from robot_templates import inertial, mjcf, spherical, urdf

from proofroll.robots.check.lint import lint
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.robot_file import LintRemark
from proofroll.robots.files.urdf import read_urdf
from proofroll.robots.model import Robot

MESH = '<collision><geometry><mesh filename="package://x/y.stl"/></geometry></collision>'
BOX = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
NOT_POSITIVE = inertial(ixx="-0.01")
FLAT = inertial(ixx="0.01", iyy="0.01", izz="0.9")
MASSLESS = inertial(mass="0")
ROD = inertial(ixx="0", iyy="0.01", izz="0.01", ixy="0").replace("0.002", "0").replace("-0.001", "0")
EMPTY = inertial(mass="0", ixx="0", iyy="0", izz="0", ixy="0").replace("0.002", "0").replace("-0.001", "0")
POINT = inertial(ixx="0", iyy="0", izz="0", ixy="0").replace("0.002", "0").replace("-0.001", "0")
LACKING = inertial().replace('ixz="0.002" iyz="-0.001"', "")
PLANTED = {
    "without inertial": (urdf(), "warning", "links", "1 without <inertial>: tool"),
    "shape without inertial": (urdf(tool=BOX), "warning", "link tool", "1000 kg/m³"),
    "mesh without inertial": (urdf(tool=MESH), "warning", "link tool", "collision mesh was left out"),
    "not positive": (urdf(tip=NOT_POSITIVE), "error", "link tip", "not positive definite"),
    "triangle": (urdf(tip=FLAT), "error", "link tip", "breaks the triangle inequality (0.9 > 0.00699"),
    "flat to nothing": (urdf(tip=ROD), "warning", "link tip", "a principal moment of zero"),
    "inertia of four numbers": (urdf(tip=LACKING), "warning", "link tip", "its <inertia> lacks ixz, iyz, here 0"),
    "inertia without mass": (urdf(tip=MASSLESS), "error", "link tip", "it has inertia but no mass"),
    "nothing to move": (urdf(tip=EMPTY), "error", "joint j3", "it moves no mass"),
    "spherical": (urdf(kinds=("spherical", "fixed", "fixed")), "warning", "joint j1", "no spherical joints"),
    "turned inertial": (urdf(tip=inertial(rpy="0.1 0 0")), "note", "link tip", "rpy together with products"),
    "axis": (urdf().replace("0 0.6 0.8", "0 0.6 0.9"), "warning", "joint j1", "its axis has length 1.08"),
    "damping": (urdf(first='<dynamics damping="1"/>'), "warning", "joints", "damping on 1 of 3"),
    "friction": (urdf(first='<dynamics friction="1"/>'), "warning", "joints", "friction on 1 of 3"),
    "negative damping": (urdf(first='<dynamics damping="-1"/>'), "error", "joint j1", "negative damping -1"),
    "mimic": (urdf(third='<mimic joint="j1"/>'), "warning", "joints", "1 follow another (mimic): j3"),
    "limits": (urdf().replace('lower="-1.5"', 'lower="1.5"'), "error", "joint j1", "above the upper one"),
    "no limits": (urdf(kinds=("revolute", "prismatic", "revolute")), "warning", "joint j3", "needs <limit>"),
    "author's options": (urdf(extra="<gazebo/>"), "note", "gazebo", "left out for every engine"),
    "unknown element": (urdf(extra="<wheel/>"), "warning", "wheel", "the specification has no such element"),
    "mass without inertia": (urdf(tip=POINT), "warning", "link tip", "mass of 1.3 kg but no inertia"),
    "g mm²": (urdf(tip=spherical("0.3", "4e5")), "warning", "link tip", "radius of gyration is 1155 m"),
    "denser than osmium": (urdf(tip=spherical("1.3", "4e-9")), "warning", "link tip", "denser than osmium"),
    "mm": (urdf().replace("0.3 0.1 0", "300 100 0"), "warning", "joint j3", "316.2 m from its parent's origin"),
    "far centre": (urdf(tip=inertial(com="0 0 14")), "warning", "link tip", "centre of mass lies 14 m"),
    "limits in degrees": (urdf().replace('upper="1.2"', 'upper="90"'), "warning", "joint j1", "14.3 turns"),
    "rpy in degrees": (urdf().replace("0.2 0.7 -0.3", "0 90 0"), "warning", "joint j3", "rpy 0 90 0: angles are rad"),
    "unknown inside": (urdf(first="<spring/>"), "warning", "joint j1", "no <spring> here"),
}


def _findings(text: str, folder: Path) -> list[LintRemark]:
    path = folder / "robot.urdf"
    path.write_text(text)
    file = open_robot(path)
    return [*file.remarks, *lint(file, read_urdf(file))]


@pytest.mark.parametrize("name", PLANTED)
def test_planted(name: str, tmp_path: Path) -> None:
    """What is planted is found at its place, in words."""
    text, level, where, what = PLANTED[name]
    found = _findings(text, tmp_path)
    assert any(item.level == level and item.where == where and what in item.what for item in found), found


def test_nothing_planted(tmp_path: Path) -> None:
    """A clean file has no findings."""
    assert _findings(urdf(tool=inertial()), tmp_path) == []


LIFTED = '<body name="b"><joint name="f" type="free" {}/><geom size="0.1"/></body>'
SPRUNG = '<default><joint damping="2"/><default class="k"><joint armature="0.01"/></default></default>'
IN_MJCF = {
    "inherited by a free joint": (
        LIFTED.format('class="k"'),
        SPRUNG,
        "damping 2 and armature 0.01 from a default class",
    ),
    "inherited through childclass": (
        LIFTED.format("").replace("<body", '<body childclass="k"'),
        SPRUNG,
        "armature 0.01",
    ),
    "radians": ('<body><joint name="f" range="-3.14 3.14"/><geom size="0.1"/></body>', "", "is in degrees"),
}
FREE = (LIFTED.format('class="k" damping="0" armature="0"'), LIFTED.format('damping="1"'), "<body><freejoint/></body>")


def _mjcf_findings(extra: str, default: str, folder: Path) -> list[LintRemark]:
    path = folder / "robot.xml"
    path.write_text(mjcf(extra=extra).replace("<worldbody>", default + "<worldbody>"))
    return [item for item in lint(open_robot(path), Robot("r", {}, ())) if item.where == "joint f"]


@pytest.mark.parametrize("name", IN_MJCF)
def test_planted_in_mjcf(name: str, tmp_path: Path) -> None:
    """What a default class gives a free joint, and radians that are read as degrees, are told."""
    extra, default, what = IN_MJCF[name]
    (found,) = _mjcf_findings(extra, default, tmp_path)
    assert found.level == "warning"
    assert what in found.what


@pytest.mark.parametrize("extra", FREE)
def test_free_joints_that_say_it_themselves(extra: str, tmp_path: Path) -> None:
    """A free joint whose own attributes say what acts on it, or that inherits nothing, is left alone."""
    assert not [item for item in _mjcf_findings(extra, SPRUNG, tmp_path) if "default class" in item.what]


def test_loops_of_an_mjcf_are_told(tmp_path: Path) -> None:
    """Constraints that close loops or hold bodies are a warning that counts them; coupled joints are none of these."""
    path = tmp_path / "robot.xml"
    held = '<connect body1="upper" body2="lower" anchor="0 0 1"/><weld body1="upper"/><joint joint1="k1"/>'
    path.write_text(mjcf().replace("</mujoco>", f"<equality>{held}</equality></mujoco>"))
    found = [item for item in lint(open_robot(path), Robot("", {}, ())) if item.where == "equality"]
    assert [(item.level, item.what.partition(":")[0]) for item in found] == [("warning", "1 <connect>, 1 <weld>")]
    idle = '<connect body1="upper" body2="lower" anchor="0 0 1" active="false"/>'
    path.write_text(mjcf().replace("</mujoco>", f"<equality>{idle}</equality></mujoco>"))
    assert not [item for item in lint(open_robot(path), Robot("", {}, ())) if item.where == "equality"]


def test_trees_in_frames(tmp_path: Path) -> None:
    """Trees that hang in frames of the world, one in another, are counted."""
    path = tmp_path / "robot.xml"
    inner = '<frame><frame><body name="c"><joint/><geom size="0.1"/></body></frame></frame>'
    path.write_text(mjcf(extra=inner))
    found = lint(open_robot(path), Robot("r", {}, ()))
    assert [item.what for item in found if item.where == "worldbody"] == ["2 trees: some engines keep only the first"]
