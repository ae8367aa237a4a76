"""``proofroll new probe``: a script records the robot in the user's simulator, and ``judge`` decides on its arrays."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import fake_isaaclab
import numpy as np
import outside_records
import pytest
import robot_templates

Proofroll = Callable[..., tuple[int, str, str]]
_RUFF = Path(sys.executable).with_name("ruff")
ARM = robot_templates.urdf(first='<dynamics damping="0.3"/>')
MJCF = """<mujoco><option integrator="RK4"/><worldbody><body name="ball"><freejoint/>
<inertial pos="0.01 0 0" mass="2" diaginertia="0.02 0.03 0.04"/>
<body name="leg" pos="0.1 0 0"><joint name="hip" axis="0 1 0" range="-40 40" ref="10"/>
<geom size="0.05" fromto="0 0 0 0 0 -0.3" type="capsule" mass="0.5"/></body></body></worldbody>
<actuator><position joint="hip" kp="5"/></actuator></mujoco>"""
ROBOTS = {"arm.urdf": ARM, "legs.urdf": outside_records.urdf(), "leg.xml": MJCF}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with robot files, in which the commands are given."""
    monkeypatch.chdir(tmp_path)
    for name, text in ROBOTS.items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.fixture
def record(proofroll: Proofroll, monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Arguments of ``judge`` for the record of a probe of a robot, moved as another text of its file says."""

    def made(name: str, program: str, base: str = "fixed", moved: str = "") -> list[str]:
        code, out, err = proofroll("new", "probe", name, "--for", program, "--base", base)
        assert (code, err) == (0, "")
        script = Path(out.split()[0])
        right = Path(name).read_text()
        Path(name).write_text(moved or right)
        if program == "mujoco":
            subprocess.run([sys.executable, str(script)], check=True, timeout=100)
        else:
            with monkeypatch.context() as patch:
                for key, module in fake_isaaclab.modules().items():
                    patch.setitem(sys.modules, key, module)
                runpy.run_path(str(script))
        Path(name).write_text(right)
        return out.splitlines()[-1].split()[1:]

    return made


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("program", "name", "base"),
    [
        pytest.param("mujoco", "arm.urdf", "fixed", marks=pytest.mark.nightly),
        ("isaaclab", "legs.urdf", "free"),
        pytest.param("mujoco", "legs.urdf", "free", marks=pytest.mark.nightly),
        pytest.param("isaaclab", "arm.urdf", "fixed", marks=pytest.mark.nightly),
        pytest.param("isaaclab", "arm.urdf", "free", marks=pytest.mark.nightly),
    ],
)
def test_a_probe_decides(
    program: str, name: str, base: str, proofroll: Proofroll, record: Callable[..., list[str]]
) -> None:
    """A right robot holds; one with a link that is heavier by 1 % does not, and that link is named."""
    judge = record(name, program, base)
    code, out, err = proofroll(*judge)
    assert code == 0, out + err
    assert f"{base} base): every layer that was looked at holds" in " ".join(out.split())
    for path in Path().glob("probe_*.py"):
        path.unlink()
    text = ROBOTS[name]
    mass = re.findall(r'mass value="([0-9.]+)"', text)[-1]
    before, after = text.rsplit(f'"{mass}"', 1)
    wrong = f'{before}"{1.01 * float(mass)}"{after}'
    code, out, err = proofroll(*record(name, program, base, wrong))
    assert code == 1, out + err
    link = {"arm.urdf": "tip", "legs.urdf": "FR_KFE_link"}[name]
    assert re.search(rf"{link}\S* carries \S+ kg more|inertia of {link}\S* are others", " ".join(out.split())), out


@pytest.mark.parametrize("program", ["mujoco", "isaaclab"])
@pytest.mark.parametrize("base", ["fixed", "free"])
def test_a_probe_is_clean_code(program: str, base: str, proofroll: Proofroll, folder: Path) -> None:
    """What ``new`` writes passes ruff with its own rules, and has no condition that is a constant."""
    _, out, _ = proofroll("new", "probe", "arm.urdf", "--for", program, "--base", base)
    script = folder / out.split()[0]
    checked = subprocess.run([_RUFF, "check", "--isolated", str(script)], check=False, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout
    assert not re.search(r"if (True|False)", script.read_text())


def test_a_probe_that_is_there_says_what_to_do(proofroll: Proofroll) -> None:
    """No option names the script: a second one says what to move, not that another name be chosen."""
    asked = ("new", "probe", "arm.urdf", "--for", "mujoco")
    proofroll(*asked)
    code, _, err = proofroll(*asked)
    assert (code, err.count("\n")) == (2, 1)
    assert "'probe_arm_mujoco.py': this file is there already; remove or move it, or run the command in" in err


@pytest.mark.nightly
def test_a_controller_and_a_ref_do_not_meet(proofroll: Proofroll, record: Callable[..., list[str]]) -> None:
    """Arrays count from `ref` and a controller from the file's pose: both together are refused in one line."""
    Path("stand.toml").write_text('rate = 50\n[[gains]]\njoints = "*"\nkp = 5\n')
    code, _, err = proofroll(*record("leg.xml", "mujoco"), "--control", "stand.toml")
    assert (code, err.count("\n")) == (2, 1)
    assert "hip has ref = 0.17453 in the robot's file: qpos counts from there" in err


@pytest.mark.drill
def test_a_probe_of_an_mjcf(proofroll: Proofroll, record: Callable[..., list[str]]) -> None:
    """An MJCF moves by known efforts alone: its servo and its integrator count for nothing, and its stops are far."""
    code, out, err = proofroll(*record("leg.xml", "mujoco"))
    assert code == 0, out + err
    hip = np.load("probe_leg_mujoco.npz")["qpos"][:, 7]
    assert np.abs(hip).max() < np.radians(40)


@pytest.mark.nightly
@pytest.mark.parametrize("masses", [(2.1, 2.121), pytest.param((2.1, 2.079), marks=pytest.mark.nightly)])
def test_a_link_on_a_fixed_axis(
    masses: tuple[float, float], proofroll: Proofroll, record: Callable[..., list[str]]
) -> None:
    """A heavier and a lighter link that turn about a fixed axis are named, though no mass shows there."""
    right, wrong = masses
    code, out, _ = proofroll(*record("arm.urdf", "mujoco", "fixed", ARM.replace(f'"{right}"', f'"{wrong}"')))
    assert code == 1
    assert "centre and inertia of shoulder are others" in " ".join(out.split())


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["leg.xml", "--for", "isaaclab"], "Isaac Lab reads a URDF; give the robot's, or --for mujoco"),
        (["arm.urdf", "--for", "drake"], "there is no probe for it; choose from mujoco, isaaclab"),
        (["arm.urdf", "--for", "mujoco", "--base", "loose"], "choose one of fixed, free"),
        (["none.urdf", "--for", "mujoco"], "give the path of a robot file, .urdf or .xml"),
        (["mimic.urdf", "--for", "mujoco"], "a tree of revolute and prismatic joints, and this robot has j2"),
    ],
)
def test_what_cannot_be_probed(asked: list[str], said: str, proofroll: Proofroll, folder: Path) -> None:
    """What no script can be written for is one line, and no file is written."""
    (folder / "mimic.urdf").write_text(robot_templates.urdf(second='<mimic joint="j1" multiplier="2"/>'))
    code, out, err = proofroll("new", "probe", *asked)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert said in err
    assert not list(folder.glob("probe_*"))
