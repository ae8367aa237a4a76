"""Scenes of the page on how to build: their motions are closed forms."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

PAGE = Path(__file__).resolve().parents[1] / "docs" / "how_to_build.md"
SCENES = dict(
    re.findall(r"^```toml\n# (\w+)/scene\.toml\n(.*?)^```$", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)
)
_G, _K = 9.81, (2 * math.pi / 0.01) ** 2


def _differential() -> tuple[float, float]:
    """Accelerations of both wheels [rad/s²], from their balance with the carrier between them."""
    # 2 a = l + r;  6 = 0.02 a + 2 M;  0.1 l = M;  0.3 r = M
    moment = 6 / (2 + 0.02 * (1 / 0.1 + 1 / 0.3) / 2)
    return moment / 0.1, moment / 0.3


def run(text: str, folder: Path) -> xr.Dataset:
    """Dataset of a scene of the page, 0.5 s of it."""
    folder.joinpath("scene.toml").write_text(text, encoding="utf-8")
    return simulate(load_scene(str(folder)), "projection", until=0.5, every=0.1)


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("name", "accelerations"),
    [
        ("belt", {"motor": 100.0, "shaft": 50.0}),
        ("tackle", {"x1": -0.2 * _G}),
        ("screw", {"slide": -_G * 0.5 / (0.5 + 1e-4 * _K)}),
        ("differential", dict(zip(("left_shaft", "right_shaft"), _differential(), strict=True))),
    ],
)
def test_a_scene_of_the_page_has_its_closed_form(name: str, accelerations: dict[str, float], tmp_path: Path) -> None:
    """From rest each coordinate is half its constant acceleration times the time squared, to the error bar."""
    (tmp_path / "scene.toml").write_text(SCENES[name], encoding="utf-8")
    dataset = truth(load_scene(str(tmp_path)), np.array([0.0, 0.2]))
    for joint, acceleration in accelerations.items():
        coordinate = dataset[f"q.{joint}"]
        assert float(coordinate[-1]) == pytest.approx(0.02 * acceleration, rel=1e-11)
        assert float(coordinate.attrs["error_bar"]) < 1e-10


@pytest.mark.drill
def test_the_force_of_a_coupling_is_that_on_one_joint(tmp_path: Path) -> None:
    """It acts on joint_b of a ratio and on the first of several joints, as the page about torques says."""
    forces = {"belt": ("coupling.belt", 0.08 * 50), "tackle": ("coupling.rope", 4 * 0.8 * _G)}
    for name, (variable, force) in forces.items():
        (tmp_path / "scene.toml").write_text(SCENES[name], encoding="utf-8")
        values = truth(load_scene(str(tmp_path)), np.array([0.0, 0.2]))[variable]
        assert float(values[-1]) == pytest.approx(force, rel=1e-11)


@pytest.mark.nightly
def test_a_parcel_slides_on_a_conveyor(tmp_path: Path) -> None:
    """The conveyor's parcel starts with the acceleration mu g."""
    (tmp_path / "scene.toml").write_text(SCENES["conveyor"], encoding="utf-8")
    dataset = truth(load_scene(str(tmp_path)), np.array([0.0, 0.05]))
    assert float(dataset["middle.x"][-1]) == pytest.approx(0.3 * _G * 0.05**2 / 2, rel=1e-9)


@pytest.mark.nightly
def test_a_sleeve_without_mass_swings_and_turns(tmp_path: Path) -> None:
    """The rotor swings along the axis as on the spring alone, about the place where it holds the weight."""
    found = run(SCENES["sleeve"], tmp_path)
    middle = -0.02 - 2 * 9.81 / 800
    place = middle - middle * np.cos(np.sqrt(800 / 2) * found["time"].to_numpy())
    assert np.abs(found["q.slide"].to_numpy() - place).max() < 1e-10
    moment = -0.02 * 0.2 * 30**2 * np.sin(30 * found["time"].to_numpy())
    assert np.abs(found["drive.turn"].to_numpy() - moment).max() < 1e-10


@pytest.mark.nightly
def test_an_arm_without_mass_carries_its_force_alone(tmp_path: Path) -> None:
    """What the ball does to the arm is what the hinge does to it, and has no moment about the hinge."""
    found = run(SCENES["held_by_an_arm"], tmp_path)
    force = {name: np.stack([found[f"force.{name}.{c}"] for c in "xyz"], axis=-1) for name in ("hinge", "ball")}
    assert np.abs(force["hinge"] - force["ball"]).max() < 1e-10
    moment = np.cross(found["p_WB"].to_numpy()[:, 1] - found["p_WB"].to_numpy()[:, 0], force["ball"])
    assert np.abs(moment @ [0, 1, 1]).max() < 1e-10
    assert np.abs(force["ball"]).max() > 1.0


def test_the_page_has_these_scenes() -> None:
    """Every scene of the page is tested."""
    assert set(SCENES) == {"belt", "tackle", "screw", "differential", "conveyor", "sleeve", "held_by_an_arm"}
