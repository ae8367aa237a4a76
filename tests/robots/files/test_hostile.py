"""Files that mean harm cost one line, and nothing is read that they should not reach."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from robot_templates import inertial, mjcf, urdf

from proofroll.core.errors import InputError
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.urdf import read_urdf

BOMB = """<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><robot name="&c;"/>"""
OUTSIDE = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]><robot name="&x;"><link name="a"/></robot>'
LINKS = "".join(f'<link name="l{n}"/>' for n in range(100_000))
LOOP = """<robot name="r"><link name="a"/><link name="b"/><joint name="i" type="fixed"><parent link="a"/>
<child link="b"/></joint><joint name="j" type="fixed"><parent link="b"/><child link="a"/></joint></robot>"""
ISLAND = LOOP.replace("</robot>", '<link name="c"/></robot>')

HOSTILE = {
    "no file": (None, "no such file"),
    "empty": ("", "no XML"),
    "no XML": ("\x00\x01", "no XML"),
    "other XML": ("<html/>", "neither a URDF"),
    "entity bomb": (BOMB, "document type"),
    "external entity": (OUTSIDE, "document type"),
    "deep": ("<robot>" + "<link>" * 5000 + "</link>" * 5000 + "</robot>", "nested deeper"),
    "many links": (f'<robot name="r">{LINKS}</robot>', "100000 links"),
    "many elements": ('<robot name="r">' + "<a/>" * 250_000 + "</robot>", "more than"),
    "no links": ('<robot name="r"/>', "no links"),
    "link without name": ('<robot name="r"><link/></robot>', "needs a name"),
    "same name": ('<robot name="r"><link name="a"/><link name="a"/></robot>', "2 links have this name"),
    "loop": (LOOP, "form a loop"),
    "loop beside": (ISLAND, "form a loop"),
    "negative mass": (urdf(tip=inertial(mass="-1")), "<link tip>: mass = -1.0: no body has a negative mass"),
    "negative mass of what stands still": (urdf().replace('value="4"', 'value="-4"'), "<link base>: mass = -4.0"),
    "NaN mass": (urdf(tip=inertial(mass="nan")), "finite"),
    "infinite inertia": (urdf(tip=inertial(ixx="1e999")), "finite"),
    "words for numbers": (urdf(tip=inertial(com="a b c")), "write numbers"),
    "commas": (urdf().replace("0.3 0.1 0", "0.3, 0.1, 0"), "<joint j3>: <origin xyz> = '0.3, .*with spaces between"),
    "two numbers": (urdf(tip=inertial(com="1 2")), "<link tip>: <origin xyz> = '1 2': write 3 numbers, not 2"),
    "no axis": (urdf().replace('xyz="1 0 0"', 'xyz="0 0 0"'), "an axis needs a direction"),
    "no parent": (urdf().replace('parent link="slide"', 'parent link="nothing"'), "there is no such link"),
    "two parents": (urdf().replace('child link="tool"', 'child link="slide"'), "a tree"),
    "planar": (urdf(kinds=("planar", "fixed", "fixed")), "the check covers"),
    "follows none": (urdf(third='<mimic joint="1"/>'), "no joint of this name; name the one that is meant, j1"),
    "follows itself": (urdf(first='<mimic joint="j1"/>'), "name another joint"),
    "follows in a ring": (
        urdf(first='<mimic joint="j2"/>', second='<mimic joint="j1"/>'),
        "name another joint",
    ),
    "includes": (mjcf(extra='<include file="/etc/hostname"/>'), "outside its folder"),
    "includes above": (mjcf(extra='<include file="../secret.xml"/>'), "outside its folder"),
    "includes a link": (mjcf(extra='<include file="linked.xml"/>'), "outside its folder"),
    "includes itself": (mjcf(extra='<include file="robot.xml"/>'), "include each other"),
    "includes nothing": (mjcf(extra='<include file="absent.xml"/>'), "no such file"),
    "a pipe for a shape": (
        mjcf(extra='<asset><mesh name="m" file="pipe.stl"/></asset>'),
        "<mesh file> = 'pipe.stl': .* a pipe",
    ),
    "a pipe of a URDF": (
        urdf(tool='<visual><geometry><mesh filename="pipe.stl"/></geometry></visual>'),
        "name an ordinary",
    ),
    "plug-in": (mjcf(extra='<plugin plugin="x"/>'), "does not cover"),
    "xacro": (
        urdf(extra='<xacro:macro xmlns:xacro="http://www.ros.org/wiki/xacro" name="m"/>'),
        "<xacro:macro>: run xacro",
    ),
    "xacro without its name": (urdf(extra="<xacro:m/>"), "run xacro first"),
    "a value for xacro": (urdf(tip=inertial(mass="${2 * m}")), r"<mass value> is '\$\{2 \* m\}': run xacro first"),
    "comment without end": ("<!-- -- <robot/>", "no XML"),
    "infinite repetition": (mjcf(extra='<replicate count="1000000"><geom size="1"/></replicate>'), "does not cover"),
}


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("many links", "many elements")
@pytest.mark.parametrize("name", HOSTILE)
def test_one_line(name: str, tmp_path: Path) -> None:
    """A file that is broken, endless or reaches outside is refused in one line that says what is wrong."""
    text, said = HOSTILE[name]
    (tmp_path / "secret.xml").write_text("<mujoco><worldbody><body name='secret'/></worldbody></mujoco>")
    folder = tmp_path / "folder"
    folder.mkdir()
    os.symlink(tmp_path / "secret.xml", folder / "linked.xml")
    os.mkfifo(folder / "pipe.stl")
    path = folder / "robot.xml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        read_urdf(open_robot(path))
    assert "\n" not in str(caught.value)
    assert "folder" in str(caught.value)  # of the file


def test_unreadable(tmp_path: Path) -> None:
    """A folder or a file of a strange encoding is refused in one line."""
    with pytest.raises(InputError, match="no such file"):
        open_robot(tmp_path)
    path = tmp_path / "robot.urdf"
    path.write_bytes(b'<?xml version="1.0" encoding="klingon"?><robot/>')
    with pytest.raises(InputError, match="no XML"):
        open_robot(path)
    (loop := tmp_path / "loop.urdf").symlink_to("loop.urdf")
    with pytest.raises(InputError, match=r"loop\.urdf"):
        open_robot(loop)
    (tmp_path / "loop.stl").symlink_to("loop.stl")
    mesh = '<asset><mesh name="m" file="loop.stl"/></asset>'
    (file := tmp_path / "robot.xml").write_text(
        mjcf(base='<geom type="mesh" mesh="m"/>').replace("<worldbody>", f"{mesh}<worldbody>", 1)
    )
    with pytest.raises(InputError, match=r"loop\.stl"):
        open_robot(file)


def test_meshes_are_not_opened(tmp_path: Path) -> None:
    """What engines are given names no mesh of a URDF, and no mesh of an MJCF outside its folder."""
    mesh = '<collision><geometry><mesh filename="/etc/hostname"/></geometry></collision>'
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(tool=mesh))
    file = open_robot(path)
    assert not [*file.root.iter("mesh")]
    assert any("collision mesh was left out" in finding.what for finding in file.remarks)
    path = tmp_path / "robot.xml"
    path.write_text(
        mjcf(base='<geom type="mesh" mesh="m"/>').replace(
            "<worldbody>", '<asset><mesh name="m" file="/etc/hostname"/></asset><worldbody>', 1
        )
    )
    with pytest.raises(InputError, match=r"/etc/hostname.*outside its folder.*--root"):
        open_robot(path)
    weighed = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="mesh"'
    path.write_text(path.read_text().replace('<geom type="mesh"', weighed, 1))
    file = open_robot(path)
    assert not [*file.root.iter("mesh")]
    assert all(geom.get("mesh") is None for geom in file.root.iter("geom"))


def test_names_are_data(tmp_path: Path) -> None:
    """Names with markup, quotes and line breaks are kept as they are."""
    path = tmp_path / "robot.urdf"
    name = "<b>&\"'../../x\u202e[red]"
    escaped = "&lt;b&gt;&amp;&quot;'../../x\u202e[red]"
    path.write_text(urdf().replace('"j1"', f'"{escaped}"'))
    robot = read_urdf(open_robot(path))
    assert name in {joint.name for joint in robot.joints}
