"""``proofroll export``: the model of a scene as a file that the engine's own tools read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
from robot_gallery import locate
from robot_templates import urdf

from proofroll import load_scene, simulate
from proofroll.files.scene_file import scene_text

Proofroll = Callable[..., tuple[int, str, str]]


@pytest.mark.drill
def test_a_mechanism_with_other_numbers(proofroll: Proofroll, tmp_path: Path) -> None:
    """The file has the parameters that were set, and the scene's start as its keyframe, from which MuJoCo goes on."""
    file = tmp_path / "long.xml"
    numbers = ("--set", "length=2", "--set", "mass=3", "--set", "angle=0.5", "--set", "speed=1.5")
    code, out, err = proofroll("export", "pendulum", str(file), "--engine", "mujoco[dt=0.004]", *numbers)
    assert (code, out, err) == (0, f"{file} is written\n", "")
    model = mujoco.MjModel.from_xml_path(str(file))
    assert model.opt.timestep == pytest.approx(0.004)
    assert model.body("rod").mass[0] == pytest.approx(3.0)
    assert model.body("rod").ipos == pytest.approx([0, -1.0, 0])
    assert (model.key("start").qpos[0], model.key("start").qvel[0]) == pytest.approx((0.5, 1.5))


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("pendulum", "{file}", "--engine", "projection"), 3, "projection: it writes no file"),
        (("pendulum", "{file}", "--engine", "mujoco[formulation=chart]"), 3, "needs revolute joints"),
        (("turntable", "{file}", "--engine", "mujoco[formulation=joints]"), 3, "needs contact between bodies"),
        (("pendulum", "{file}", "--engine", "mujoco", "--set", "lenght=1"), 2, "length"),
        (("no_such_scene", "{file}", "--engine", "mujoco"), 2, "no_such_scene"),
        (("pendulum", "{file}/in/a/file", "--engine", "mujoco"), 2, "long.xml"),
        (("pendulum", "{file}", "--as", "scene"), 2, "pendulum is no robot file; a scene"),
        (("pendulum", "{file}"), 2, "give an engine, whose model is written, or --as scene"),
    ],
)
def test_what_cannot_be_written(
    proofroll: Proofroll, tmp_path: Path, words: tuple[str, ...], code: int, said: str
) -> None:
    """An engine that writes none, a scene that it does not represent, a wrong name: one line, and no file."""
    file = tmp_path / "long.xml"
    if "in/a/file" in words[1]:
        file.write_text("")
    answer, out, err = proofroll("export", *(word.format(file=file) for word in words))
    assert (answer, out, err.count("\n")) == (code, "", 1)
    assert said in err
    assert not file.exists() or not file.read_text()


LAWS = """<mujoco model="arm"><worldbody><body name="a.b" pos="0.1 0 1" euler="10 20 30"><freejoint name="root"/>
<geom size="0.1" pos="0.2 0 0"/><body name="c" pos="0.3 0 0"><joint name="h" axis="0 1 0" damping="0.3" armature="0.1"/>
<joint name="k" axis="1 0 0" stiffness="2" springref="20"/><geom size="0.1" pos="0 0.2 0"/></body></body></worldbody>
<actuator><position name="m" joint="h" kp="20" kv="1"/></actuator></mujoco>"""


def test_a_urdf_as_a_scene(proofroll: Proofroll, tmp_path: Path) -> None:
    """The scene of a URDF has the bodies and joints of the file, with names that a scene may have."""
    file, folder = tmp_path / "arm.urdf", tmp_path / "arm"
    file.write_text(urdf().replace('"slide"', '"sl.ide"'))
    assert proofroll("export", str(file), str(folder / "scene.toml"), "--as", "scene", "--set", "seed=3")[0] == 0
    written, own = (load_scene(name).elements[0].mechanism for name in (str(folder), str(file)))
    assert [body.name for body in written.bodies] == ["shoulder", "sl_ide", "tip"]
    assert [body.mass for body in written.bodies] == [body.mass for body in own.bodies]
    assert [joint.parent for joint in written.joints] == ["world", "shoulder", "sl_ide"]
    assert written.start()[0].tolist() == load_scene(str(file), seed=3).elements[0].mechanism.start()[0].tolist()


@pytest.mark.drill
def test_a_robot_as_a_scene_moves_as_its_file(proofroll: Proofroll, tmp_path: Path) -> None:
    """The scene of a robot file runs as the file with the same numbers, to the last digit, and says what it lacks."""
    file, folder = tmp_path / "arm.xml", tmp_path / "arm"
    file.write_text(LAWS)
    numbers = ("--set", "actuators=1", "--set", "speed=0.7")
    assert proofroll("export", str(file), str(folder), "--as", "scene", *numbers)[0] == 0
    text = (folder / "scene.toml").read_text()
    assert text.startswith("# Not in this scene: contacts\n")
    scenes = load_scene(str(folder)), load_scene(str(file), actuators=1, speed=0.7)
    written, own = (simulate(scene, "mujoco", until=0.02, every=0.01) for scene in scenes)
    assert set(written.body.to_numpy()) == {"a_b", "c_0", "c"}
    for quantity in ("p_WB", "q_WB", "v_WB", "q.h", "effort.m"):
        assert np.array_equal(written[quantity], own[quantity]), quantity


@pytest.mark.nightly_of("panda", "half_cheetah", "ant", "hopper")
@pytest.mark.drill
@pytest.mark.parametrize("name", ["ur5", "panda", "hopper", "half_cheetah", "ant"])
def test_robots_of_packages_as_scenes(tmp_path: Path, name: str) -> None:
    """Robots of packages, written as scenes, move as their files."""
    file, folder = str(locate(name)), tmp_path / name
    folder.mkdir()
    (folder / "scene.toml").write_text(scene_text(file, {}))
    written, own = (simulate(load_scene(scene), "mujoco", until=0.1, every=0.1) for scene in (str(folder), file))
    assert np.array_equal(written.p_WB, own.p_WB)


STOOL = """<mujoco model="stool"><worldbody><geom name="floor" type="plane" size="0 0 1"/>
<body name="seat" pos="0 0 0.09"><freejoint name="root"/><geom name="ball" size="0.1" mass="1" friction="0.4"
priority="1"/><body name="arm"><joint name="h" axis="0 1 0"/><inertial mass="0.1" pos="0 0 0.1"
diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody>
<actuator><position joint="h" kp="2" kv="0.1"/></actuator></mujoco>"""


@pytest.mark.nightly
def test_a_robot_on_its_floor(proofroll: Proofroll, tmp_path: Path) -> None:
    """Check and export take a controller and a ground as run does; what cannot be written has one true reason."""
    robot, stand, held, model = (tmp_path / name for name in ("stool.xml", "stand.toml", "held.toml", "long.xml"))
    robot.write_text(STOOL)
    stand.write_text("[ground]\n")
    held.write_text("rate = 50\n[ground]\n")
    code, out, _ = proofroll("check", str(robot), "--control", str(held), "--plot", str(tmp_path / "p.html"))
    assert code == 0
    assert "1 shape on a floor, friction 0.4" in " ".join(out.split())
    assert "contact between bodies" in " ".join(out.split())
    assert (tmp_path / "p.html").is_file()
    code, out, _ = proofroll("check", str(robot), "--control", str(held), "--ground", "none")
    assert code == 0
    assert "contact" not in out
    assert proofroll("export", str(robot), str(model), "--engine", "mujoco", "--control", str(stand))[0] == 0
    assert mujoco.MjModel.from_xml_path(str(model)).npair == 1
    air = ("--control", str(stand), "--ground", "none")
    assert proofroll("export", str(robot), str(model), "--engine", "mujoco", *air)[0] == 0
    assert mujoco.MjModel.from_xml_path(str(model)).npair == 0
    folder = tmp_path / "scene"
    assert proofroll("export", str(robot), str(folder), "--as", "scene", "--control", str(stand))[0] == 0
    (pair,) = load_scene(str(folder)).elements[0].mechanism.pairs
    assert pair.friction == pytest.approx(0.4)
    code, _, err = proofroll("export", str(robot), str(folder), "--as", "scene", "--control", str(held))
    assert (code, err.count("\n")) == (2, 1)
    assert "no targets between instants; leave rate out" in err
    code, _, err = proofroll("export", str(robot), str(model), "--engine", "mujoco", "--ground", "file")
    assert code == 2
    assert "a robot stands under a controller" in err
