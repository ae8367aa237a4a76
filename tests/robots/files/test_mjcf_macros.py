"""What an MJCF abbreviates (repetitions, attached models, composites) is written out before engines are compared."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from robot_templates import mjcf, urdf

from proofroll.core.errors import InputError
from proofroll.core.limits import TIME_LIMIT
from proofroll.robots.files.meaning import meaning, opened
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.reading import write
from proofroll.robots.files.urdf import read_urdf
from proofroll.robots.model import Robot

Proofroll = Callable[..., tuple[int, str, str]]
BALL = '<geom size="0.1"/>'
REPEATED = f"""<mujoco><worldbody><body name="a"><joint name="j"/>{BALL}<replicate count="3" offset="0.3 0 0">
<body name="b" pos="0.1 0 0"><joint name="k" axis="0 1 0"/>{BALL}<body><joint/>{BALL}</body></body></replicate>
<replicate count="2" offset="0 0 1">{BALL}</replicate></body></worldbody></mujoco>"""
PART = f"""<mujoco><worldbody><body name="hand" euler="0 30 0"><joint name="finger" range="-30 40"/>{BALL}
<body name="tip"><attach model="x" body="nail" prefix="n-"/></body></body></worldbody>
<asset><model name="x" file="nail.xml"/></asset></mujoco>"""
NAIL = f'<mujoco><worldbody><body name="nail"><joint name="last"/>{BALL}</body></worldbody></mujoco>'
WHOLE = f"""<mujoco><asset><model name="part" file="part.xml"/></asset><worldbody><body name="arm"><joint name="elbow"/>
{BALL}<attach model="part" body="hand" prefix="left-"/></body></worldbody></mujoco>"""


def _meant(path: Path, text: str) -> Robot:
    pytest.importorskip("mujoco")
    path.write_text(text)
    file = opened(path, "fixed")
    place = path.parent / "written"
    place.mkdir()
    return meaning(file, write(file, place), TIME_LIMIT)[0]


def test_repetition(tmp_path: Path) -> None:
    """A repetition gives bodies, joints and mass as often as it says, each with a name of its own."""
    robot = _meant(tmp_path / "robot.xml", REPEATED)
    assert {joint.name for joint in robot.moving} > {"j", "k0", "k1", "k2"}
    assert len(robot.moving) == 7
    assert robot.bodies["a"].mass == pytest.approx(3 * robot.bodies["b0"].mass)


def test_repetition_keeps_every_digit(tmp_path: Path) -> None:
    """Numbers of what is repeated are those of the file, not six digits of them."""
    ball = '<geom size="0.1" mass="0.123456789012345"/>'
    text = (
        f'<mujoco><worldbody><replicate count="2"><body name="b"><joint/>{ball}</body></replicate></worldbody></mujoco>'
    )
    robot = _meant(tmp_path / "robot.xml", text)
    assert [body.mass for name, body in robot.bodies.items() if name.startswith("b")] == [0.123456789012345] * 2


def test_attachment(tmp_path: Path) -> None:
    """A model that another file holds is attached, and what that attaches too."""
    (tmp_path / "part.xml").write_text(PART)
    (tmp_path / "nail.xml").write_text(NAIL)
    robot = _meant(tmp_path / "robot.xml", WHOLE)
    assert [joint.name for joint in robot.moving] == ["elbow", "left-finger", "left-n-last"]


def test_attachment_outside(tmp_path: Path) -> None:
    """An attached model outside the folder is refused, and models that attach each other end."""
    path = tmp_path / "robot.xml"
    path.write_text(WHOLE.replace("part.xml", "../part.xml"))
    with pytest.raises(InputError, match="outside its folder"):
        open_robot(path)
    path.write_text(WHOLE.replace("part.xml", "robot.xml"))
    with pytest.raises(InputError, match="models are attached"):
        open_robot(path)


def test_too_much(tmp_path: Path) -> None:
    """Repetitions within repetitions are counted before an engine writes them out."""
    path = tmp_path / "robot.xml"
    inner = f'<replicate count="1000">{BALL}</replicate>'
    path.write_text(f'<mujoco><worldbody><replicate count="1000">{inner}</replicate></worldbody></mujoco>')
    with pytest.raises(InputError, match="written out these are more than"):
        opened(path, "fixed")


def test_plugin_of_an_actuator(tmp_path: Path) -> None:
    """An extension that only drives is left out as actuators are; one that shapes a body is refused."""
    driven = mjcf(actuator='<motor joint="k1"/><plugin joint="k1" plugin="mujoco.pid"/>')
    extension = '<extension><plugin plugin="mujoco.pid"/></extension><worldbody>'
    robot = _meant(tmp_path / "robot.xml", driven.replace("<worldbody>", extension))
    assert [joint.actuated for joint in robot.moving] == [True, False]
    (tmp_path / "bent.xml").write_text(mjcf(base='<plugin plugin="mujoco.elasticity.cable"/>'))
    with pytest.raises(InputError, match="does not cover <plugin>"):
        open_robot(tmp_path / "bent.xml")


@pytest.mark.parametrize(
    ("head", "tail"),
    [
        ("\n<?xml version='1.0'?>\n", ""),
        ("<!-- a -- b --->", ""),
        ("  \n<!-- <link/> -->\n<?xml version='1.0'?>", ""),
        ("", "\r\n\0"),
        ("", "\0\n\0\0 "),
    ],
)
def test_loose_xml(head: str, tail: str, tmp_path: Path) -> None:
    """XML that engines read, although not well-formed, is read: blanks before its head, null characters at the end."""
    path = tmp_path / "robot.urdf"
    path.write_text(head + urdf() + tail)
    assert len(read_urdf(open_robot(path)).moving) == 3


@pytest.mark.parametrize("tail", ["\0<robot/>", "\0 no more"])
def test_nothing_is_dropped_without_a_word(tail: str, tmp_path: Path) -> None:
    """A file that goes on after a null character is no XML."""
    path = tmp_path / "robot.urdf"
    path.write_text(urdf() + tail)
    with pytest.raises(InputError, match="this is no XML"):
        open_robot(path)


@pytest.mark.drill
def test_no_log_is_left(proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an engine writes to a log while it reads does not come to lie in the user's folder."""
    pytest.importorskip("mujoco")
    path = tmp_path / "robot.xml"
    path.write_text(mjcf(compiler='settotalmass="7"'))
    monkeypatch.chdir(tmp_path)
    _, out, _ = proofroll("check", str(path), "--engine", "mujoco", "--json")
    assert json.loads(out)["engines"][0]["status"] == "holds"
    assert [item.name for item in tmp_path.iterdir()] == ["robot.xml"]
