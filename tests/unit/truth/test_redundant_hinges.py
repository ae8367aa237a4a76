"""Truths and engines where a loop is redundant as a whole: a door on two hinges of one axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

DOOR = """title = "A door on two hinges"
source = "made up"
[gravity]
magnitude = 9.81
[[bodies]]
name = "door"
mass = 10
com = [0.4, 0, 1]
inertia = [0.9, 1.4, 0.6]
[[joints]]
name = "low"
kind = "revolute"
parent = "world"
child = "door"
axis = [0, 0, 1]
v0 = 1.0
[[loops]]
name = "high"
kind = "revolute"
body_a = "world"
position_a = [0, 0, 2]
body_b = "door"
position_b = [0, 0, 2]
axis_a = [0, 0, 1]
axis_b = [0, 0, 1]
"""


@pytest.fixture
def door(tmp_path: Path) -> str:
    """Folder of the scene."""
    (tmp_path / "scene.toml").write_text(DOOR, encoding="utf-8")
    return str(tmp_path)


def test_a_door_on_two_hinges_turns(door: str) -> None:
    """The second hinge takes no freedom: the door turns evenly, and no reaction of a single hinge is determinate."""
    motion = truth(load_scene(door), np.linspace(0.0, 0.2, 5))
    assert motion["q.low"].to_numpy() == pytest.approx(np.linspace(0.0, 0.2, 5), abs=1e-14)


@pytest.mark.parametrize("engine", ["mujoco", "exudyn", "pinocchio", "projection"])
def test_engines_turn_it(door: str, engine: str) -> None:
    """Each engine turns the door as the truth does."""
    run = simulate(load_scene(door), engine, until=0.1, every=0.05)
    assert run["q.low"].to_numpy() == pytest.approx([0.0, 0.05, 0.1], abs=1e-5)
