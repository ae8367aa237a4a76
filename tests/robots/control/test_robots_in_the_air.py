"""Robots from packages under a policy in the air: engines agree, and the truth is exact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from robot_gallery import locate

from proofroll import load_scene, simulate
from proofroll.core.scene import Scene
from proofroll.files.scene_sources import with_control

FREE = """
[start]
base = [0, 0, 0.5, 0.9689124217106447, 0.24740395925452294, 0, 0]
base_velocity = [0.1, 0, 0.2, 0.3, -0.4, 0.9]
"""
POLICY = '[policy]\ncall = "proofroll.robots.probe:make"\nscale = 0.25\n'
# Robot -> gains that hold it at 1 ms, and a pose off zero.
ROBOTS = {
    "solo12": ("kp = 5\nkd = 0.2", "pose = {FL_HFE = 0.7, FL_KFE = -1.4, HR_KFE = 1.4}", FREE),
    "go1": ("kp = 40\nkd = 1", "pose = {FL_thigh_joint = 0.8, FL_calf_joint = -1.6}", FREE),
    "anymal_b": ("kp = 80\nkd = 2", "pose = {LF_HFE = 0.4, LF_KFE = -0.8}", FREE),
    "g1": ("kp = 60\nkd = 2\narmature = 0.01", "pose = {left_knee_joint = 0.3}", FREE),
    "panda": ("kp = 200\nkd = 15\narmature = 0.1", "pose = {panda_joint2 = -0.6, panda_joint4 = -2.1}", ""),
}


# Links of these files have impossible inertias, which only count together with the links that they are fixed to; dry
# friction of joints is a law that Pinocchio's equations do not have.
SET = {"anymal_b": {"possible": 0}, "go1": {"possible": 0, "friction": 0}}


def _scene(name: str, folder: Path) -> Scene:
    path = locate(name)
    gains, pose, start = ROBOTS[name]
    control = folder / "control.toml"
    control.write_text(f'rate = 50\n{pose}\n[[gains]]\njoints = "*"\n{gains}\n{POLICY}{start}', encoding="utf-8")
    return load_scene(with_control(str(path), control), **SET.get(name, {}))


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize("name", list(ROBOTS))
def test_engines_agree_on_a_robot_under_a_policy(name: str, tmp_path: Path) -> None:
    """MuJoCo and Pinocchio, read from one robot file and driven by one policy, move alike."""
    scene = _scene(name, tmp_path)
    one, other = (simulate(scene, engine, until=0.1, dt=1e-3) for engine in ("mujoco", "pinocchio"))
    apart = float(np.abs(one["p_WB"].values - other["p_WB"].values).max())
    moved = float(np.ptp(one["p_WB"].values, axis=0).max())
    assert moved > 5e-3
    assert apart < 1e-6


@pytest.mark.nightly
@pytest.mark.parametrize("name", [pytest.param("solo12", marks=pytest.mark.nightly), "panda"])
def test_the_truth_of_a_robot_is_exact(name: str, tmp_path: Path) -> None:
    """The truth of a robot under a policy has an error bar below 1e-10 m, and holds both engines to 1e-6 m."""
    scene = _scene(name, tmp_path)
    truth = simulate(scene, until=0.04)
    assert truth["p_WB"].attrs["error_bar"] < 1e-10
    for engine in ("mujoco", "pinocchio"):
        run = simulate(scene, engine, until=0.04, dt=1e-3)
        assert float(np.abs(run["p_WB"].values - truth["p_WB"].values).max()) < 1e-6


@pytest.mark.drill
def test_targets_at_50_hz_cost_no_order(tmp_path: Path) -> None:
    """A quadruped whose targets jump 50 times a second: RK4 engines keep order 3.5 towards the other's limit."""
    path = locate("solo12")
    legs = [f"{end}{side}" for end in "FH" for side in "LR"]
    signs = {leg: 1 if leg.startswith("F") else -1 for leg in legs}
    pose = ", ".join(f"{leg}_HFE = {0.7 * sign}, {leg}_KFE = {-1.4 * sign}" for leg, sign in signs.items())
    targets = "\n".join(f'{leg}_HFE = "= {0.7 * sign} + 0.3*sin(12*t)"' for leg, sign in signs.items())
    control = tmp_path / "control.toml"
    gains = '[[gains]]\njoints = "*"\nkp = 5\nkd = 0.2\nlimit = 0.8\n'
    base = "[start]\nbase = [0, 0, 0.3235, 0.9995750535388216, 0.024994583760400414, 0.014994750426233747, "
    start = f"{base}-0.0003749468778436687]\n"
    control.write_text(f"rate = 50\npose = {{{pose}}}\n{gains}[targets]\n{targets}\n{start}", encoding="utf-8")
    scene = load_scene(with_control(str(path), control))
    for engine, other in (("mujoco", "pinocchio"), ("pinocchio", "mujoco")):
        limit = simulate(scene, other, until=0.06, dt=2.5e-4)["p_WB"].values
        runs = (simulate(scene, engine, until=0.06, dt=dt) for dt in (2e-3, 1e-3))
        coarse, fine = (float(np.abs(run["p_WB"].values - limit).max()) for run in runs)
        assert fine < 1e-8
        assert np.log2(coarse / fine) > 3.5
