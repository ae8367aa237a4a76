"""The scenes of the page about composed joints: they load, and move by their closed forms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

PAGE = Path(__file__).resolve().parents[1] / "docs" / "compose_joints.md"
SCENES = re.findall(r"^```toml\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def run(text: str, folder: Path) -> xr.Dataset:
    """Dataset of a scene of the page, 0.5 s of it."""
    folder.joinpath("scene.toml").write_text(text, encoding="utf-8")
    return simulate(load_scene(str(folder)), "projection", until=0.5, every=0.1)


@pytest.mark.drill
def test_a_sleeve_without_mass_swings_and_turns(tmp_path: Path) -> None:
    """The rotor swings along the axis as on the spring alone, about the place where it holds the weight."""
    found = run(SCENES[0], tmp_path)
    middle = -0.02 - 2 * 9.81 / 800
    place = middle - middle * np.cos(np.sqrt(800 / 2) * found["time"].to_numpy())
    assert np.abs(found["q.slide"].to_numpy() - place).max() < 1e-10
    moment = -0.02 * 0.2 * 30**2 * np.sin(30 * found["time"].to_numpy())
    assert np.abs(found["drive.turn"].to_numpy() - moment).max() < 1e-10


def test_an_arm_without_mass_carries_its_force_alone(tmp_path: Path) -> None:
    """What the ball does to the arm is what the hinge does to it, and has no moment about the hinge."""
    found = run(SCENES[1], tmp_path)
    force = {name: np.stack([found[f"force.{name}.{c}"] for c in "xyz"], axis=-1) for name in ("hinge", "ball")}
    assert np.abs(force["hinge"] - force["ball"]).max() < 1e-10
    moment = np.cross(found["p_WB"].to_numpy()[:, 1] - found["p_WB"].to_numpy()[:, 0], force["ball"])
    assert np.abs(moment @ [0, 1, 1]).max() < 1e-10
    assert np.abs(force["ball"]).max() > 1.0


def test_the_page_has_these_scenes() -> None:
    """Every scene of the page is tested."""
    assert len(SCENES) == 2
