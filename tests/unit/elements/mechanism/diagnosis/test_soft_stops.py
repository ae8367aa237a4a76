"""A stop that gives way is told as the cause where it throws its joint back, and of no run that has none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from proofroll.core.diagnosis import Cause, Evidence, diagnose, hypotheses_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

pytestmark = pytest.mark.drill  # the first of them compiles a truth
# A range in degrees, as of somebody who meant radians: the joint crosses it in a few steps.
ARM = """<mujoco><worldbody><body name="b"><inertial pos="0 0 -0.3" mass="1" diaginertia="0.01 0.01 0.01"/>
<joint name="j" axis="0 1 0" limited="true" range="-{range} {range}" damping="0.1"/></body></worldbody></mujoco>"""
TIMES = np.linspace(0.0, 1.0, 51)


def arm(folder: Path, half: float) -> Scene:
    """Arm between two stops, each so many degrees from the middle."""
    (folder / "arm.xml").write_text(ARM.replace("{range}", f"{half:g}"), encoding="utf-8")
    return load_scene(str(folder / "arm.xml"), limits=1)


def causes(scene: Scene, engine: str, step: float, **settings: str) -> list[Cause]:
    """Causes that are told of an engine's run."""
    run = simulate(scene, engine, until=1.0, every=0.02, dt=step, **settings)
    (element,) = scene.elements
    return diagnose(Evidence(element, [], run, truth(scene, TIMES), step), hypotheses_of(element))


@pytest.mark.nightly_of("0.001")
@pytest.mark.parametrize("step", [1e-3, 2.5e-4])
def test_a_soft_stop_is_named(tmp_path: Path, step: float) -> None:
    """Stops of 0.04 degrees on both sides catch the arm softly in MuJoCo, and that explains what comes after."""
    (cause,) = causes(arm(tmp_path, 0.04), "mujoco", step)
    assert cause.id == "soft stop of j"
    assert "its stops are 0.0014 rad apart" in cause.says
    assert cause.after < 1e-6 * cause.before
    assert "stiffer" in cause.remedy


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("projection-settings0-0.04", "exudyn-settings1-2.0")
@pytest.mark.parametrize("half", [0.04, 2.0])
@pytest.mark.parametrize(("engine", "settings"), [("projection", {"integrator": "rk4"}), ("exudyn", {})])
def test_an_engine_whose_stops_are_hard_is_not_accused(
    tmp_path: Path, engine: str, settings: dict[str, str], half: float
) -> None:
    """Where a joint rests on its stop, or leaves it as forces say, nothing is told of a soft stop, however coarse."""
    told = causes(arm(tmp_path, half), engine, 2e-3, **settings)
    assert not any(cause.id.startswith("soft stop") for cause in told)
