"""What the options of a robot's own file do to its motion on a floor, switched one after the other."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from proofroll.files.scene_sources import with_control
from proofroll.studies.comparison.default_comparison import default_comparison

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")
pytestmark = pytest.mark.drill

Proofroll = Callable[..., tuple[int, str, str]]
OPTION = '<option timestep="0.004" iterations="7"><flag eulerdamp="disable"/></option>'
STOOL = """<mujoco model="stool"><worldbody><geom name="floor" type="plane" size="0 0 1"/>
<body name="seat" pos="0 0 0.09"><freejoint name="root"/><geom name="ball" size="0.1" mass="1" friction="0.4"
priority="1"/><body name="arm"><joint name="h" axis="0 1 0"/><inertial mass="0.1" pos="0 0 0.1"
diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody>
<actuator><position joint="h" kp="2" kv="0.1"/></actuator></mujoco>"""


@pytest.fixture
def robot(tmp_path: Path) -> tuple[Path, Path]:
    """A ball with an arm over a floor, whose file has options of its own, and its controller."""
    path, control = tmp_path / "stool.xml", tmp_path / "stand.toml"
    path.write_text(STOOL.replace("<worldbody>", f"{OPTION}<worldbody>").replace("0.09", "0.101"))
    control.write_text("rate = 50\n[ground]\n")
    return path, control


def test_the_first_row_is_the_file(robot: tuple[Path, Path]) -> None:
    """Under a controller, too, the options of the file are the first row: step, solver and explicit damping."""
    row = default_comparison(with_control(str(robot[0]), robot[1]), {}).rows[0]
    assert row.engine == "mujoco[formulation=geoms,preset=default,dt=0.004,eulerdamp=False,iterations=7]"
    assert row.short == "the file's own options"


@pytest.mark.nightly
def test_softness_is_what_is_off(
    proofroll: Proofroll, robot: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ball that only falls on the floor is off by its soft contact, which the first line takes away.

    Without time for it nothing is tried: no run is counted, and what was not tried is named.
    """
    words = ("--control", str(robot[1]), "--until", "0.16", "--out", str(tmp_path / "out"))
    with monkeypatch.context() as patch:
        patch.setattr("proofroll.studies.comparison.own_path._SECONDS", 0.0)
        out = " ".join(proofroll("compare", str(robot[0]), *words)[1].split())
    assert "(0 runs): rest: " in out
    assert "; not tried: hard constraints in place of soft ones; " in out
    code, out, _ = proofroll("compare", str(robot[0]), *words)
    assert code == 0
    text = " ".join(out.split())
    assert "its steps are the reference, which is no judge of itself" in text
    lines = text.partition("Options of the file, switched one after the other; worst error of ")[2]
    assert "hard constraints in place of soft ones: " in lines.partition("rest: ")[0]
    assert "implicit" not in lines, "the file has none"


@pytest.mark.nightly
def test_soft_friction_is_what_is_off(proofroll: Proofroll, tmp_path: Path) -> None:
    """The friction of a joint that the file's softness makes wrong is right with hard constraints; a line says so."""
    path = tmp_path / "wheel.xml"
    joint = '<joint name="axle" axis="0 0 1" damping="0.05" frictionloss="0.1"/>'
    key = '<keyframe><key name="spin" qvel="10"/></keyframe>'
    wheel = f'<body name="wheel">{joint}<geom type="cylinder" size="0.1 0.05" mass="1"/></body>'
    path.write_text(f"<mujoco><option noslip_iterations='10'/><worldbody>{wheel}</worldbody>{key}</mujoco>")
    code, out, _ = proofroll("compare", str(path), "--set", "keyframe=1", "--out", str(tmp_path / "out"))
    assert code == 0
    text = " ".join(out.split())
    lines = text.partition("Options of the file, switched one after the other; worst error of friction.axle ")[2]
    assert re.search(r"hard constraints in place of soft ones: [\d.e-]+ → [\d.]+e-1\d N m", lines)


@pytest.mark.nightly
def test_euler_with_explicit_damping_is_what_is_off(proofroll: Proofroll, tmp_path: Path) -> None:
    """Steps that are coarse for a joint's damping are told as Euler's, not as damping that the engine adds.

    Switches that take nothing away stand beside the rest; no other scheme is said to be the engine's own.
    """
    path = tmp_path / "reacher.xml"
    option = "<option timestep='0.005' iterations='3'><flag eulerdamp='disable'/></option>"
    links = [
        f"<body pos='{at} 0 0'><joint axis='0 0 1' damping='0.01'/>"
        f"<geom type='capsule' fromto='0 0 0 {end} 0 0' size='0.01'/>"
        for at, end in ((0.0, 0.12), (0.12, 0.1))
    ]
    path.write_text(f"<mujoco>{option}<worldbody>{''.join(links)}</body></body></worldbody></mujoco>")
    words = ("--until", "1", "--out", str(tmp_path / "out"))
    text = " ".join(proofroll("compare", str(path), *words)[1].split())
    assert "is wrong at this step: " in text
    assert "damped at a rate" not in text
    lines, _, rest = text.partition("switched one after the other; ")[2].partition("rest: ")
    assert "RK4 in place of Euler: " in lines
    assert "hard constraints" not in lines
    assert "as armature" not in rest
    assert "no less by: MuJoCo's default solver in place of 3 iterations; hard constraints in place of" in rest
