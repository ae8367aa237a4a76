"""A gripper of a robot file closes on a box, lifts it and lets it go, as a reference and other engines say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from xarray import Dataset

from proofroll import compare, load_scene, simulate
from proofroll.core.verdict import Verdict
from proofroll.files.scene_sources import with_control

pytest.importorskip("mujoco")

_TIP = '<geom name="{name}{side}" type="sphere" size=".008" pos="0 {y} 0" mass=".025" friction="{friction}"/>'
_FINGER = (
    '<body name="{name}" pos="{x} 0 -.1"><joint name="{name}" type="slide" axis="{axis} 0 0" damping="2"/>{tips}</body>'
)
# Fingers close on the box, the palm lifts it, and they open.
_CONTROL = """
rate = 50
[targets]
left = "= min(0.03, 0.2*t) - 0.02*min(1, 10*max(0, t - 0.9))"
right = "= min(0.03, 0.2*t) - 0.02*min(1, 10*max(0, t - 0.9))"
lift = "= 0.1*max(0, min(1, (t - 0.3)/0.4))"
[ground]
"""
_OPEN = "rate = 50\n[ground]\n"


def _gripper(friction: float) -> str:
    """MJCF of a palm that slides up and down, with two fingers of two round tips each, over a box on a table."""
    fingers = ""
    for name, sign in (("left", -1), ("right", 1)):
        tips = "".join(_TIP.format(name=name, side=side, y=side * 0.008, friction=friction) for side in (-1, 1))
        fingers += _FINGER.format(name=name, x=sign * 0.05, axis=-sign, tips=tips)
    servos = "".join(
        f'<position name="{joint}" joint="{joint}" kp="{kp}" kv="{kv}"/>'
        for joint, kp, kv in (("lift", 800, 40), ("left", 200, 10), ("right", 200, 10))
    )
    return (
        '<mujoco model="gripper"><worldbody><geom name="table" type="plane" size="0 0 1" friction=".5"/>'
        '<body name="palm" pos="0 0 .12"><joint name="lift" type="slide" axis="0 0 1" damping="5"/>'
        f'<inertial pos="0 0 0" mass=".5" diaginertia="1e-3 1e-3 1e-3"/>{fingers}</body>'
        '<body name="box" pos="0 0 .02"><freejoint/>'
        f'<geom name="box" type="box" size=".02 .02 .02" mass=".1" friction="{friction}"/></body></worldbody>'
        f"<actuator>{servos}</actuator></mujoco>"
    )


@pytest.fixture
def gripper(tmp_path: Path) -> tuple[Path, Path]:
    """Files of the gripper and of what it is told."""
    robot, control = tmp_path / "gripper.xml", tmp_path / "lift.toml"
    robot.write_text(_gripper(0.8), encoding="utf-8")
    control.write_text(_CONTROL, encoding="utf-8")
    return robot, control


def _height(run: Dataset) -> np.ndarray:
    """Height of the box at each sample [m]."""
    return np.asarray(run["p_WB"].sel(body="box")[:, 2])


@pytest.mark.drill
def test_fingers_touch_what_they_are_told_to_close_on(gripper: tuple[Path, Path]) -> None:
    """Who touches whom is looked for under the controller's targets: open fingers come near nothing but the table."""
    robot, control = gripper
    pairs = {pair.name for pair in load_scene(with_control(str(robot), control)).elements[0].mechanism.pairs}
    assert {"left1 on box", "right-1 on box", "box on table"} <= pairs
    control.write_text(_OPEN, encoding="utf-8")
    pairs = {pair.name for pair in load_scene(with_control(str(robot), control)).elements[0].mechanism.pairs}
    assert not any(name.endswith("on box") for name in pairs)


@pytest.mark.drill
@pytest.mark.parametrize(("friction", "highest"), [(0.8, 0.12), (0.02, 0.02)])
def test_a_box_is_lifted_and_dropped_or_slips(gripper: tuple[Path, Path], friction: float, highest: float) -> None:
    """A box that the tips hold goes up with the palm and falls once they open; one that they do not hold stays."""
    robot, control = gripper
    robot.write_text(_gripper(friction), encoding="utf-8")
    engine = "mujoco[formulation=geoms,dt=1e-3]"
    height = _height(simulate(str(robot), engine, control=control, until=1.2, every=0.05))
    assert height.max() == pytest.approx(highest, abs=2e-3)
    assert height[-1] == pytest.approx(0.02, abs=1e-3)


@pytest.mark.nightly
def test_engines_lift_as_the_reference_does(gripper: tuple[Path, Path], tmp_path: Path) -> None:
    """MuJoCo with hard contacts lifts the box as the reference by steps does, and the file as it is lets it creep."""
    pytest.importorskip("pinocchio")
    robot, control = gripper
    scene = with_control(str(robot), control)
    outcome = compare(scene, until=0.8, budget=300, out=tmp_path)
    runs = {run.row.engine: run for run in outcome.runs}
    default, hard = runs["mujoco[formulation=geoms,preset=default]"], runs["mujoco[formulation=geoms,dt=0.0005]"]
    assert default.verdict is Verdict.DIFFERS
    assert hard.verdict is Verdict.AGREES
    ways = [next(item.error for item in run.judgements if item.observable == "p_WB") for run in (default, hard)]
    assert ways[0] > 1e-3 > 10 * ways[1]
