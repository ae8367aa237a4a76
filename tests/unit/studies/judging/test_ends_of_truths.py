"""Truths that end early: what lies before the end is judged, what lies behind has no value and no bar."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import proofroll

FALLS = float(np.sqrt(2 * 0.05 / 9.81))
DISC = """
title = "A disc that is dropped flat"
source = "this project"
duration = 0.3
[gravity]
magnitude = 9.81
[[bodies]]
name = "disc"
mass = 1.0
inertia = [0.01, 0.01, 0.02]
[[joints]]
name = "free"
kind = "free"
parent = "world"
child = "disc"
q0 = [0, 0, 0.05, 1, 0, 0, 0]
[[geometries]]
name = "edge"
body = "disc"
kind = "circle"
radius = 0.2
normal = [0, 0, 1]
[[geometries]]
name = "floor"
body = "world"
kind = "plane"
[[pairs]]
name = "contact"
geometries = ["edge", "floor"]
friction = 0.5
"""


@pytest.fixture
def disc(tmp_path: Path) -> str:
    """Folder of a scene whose truth ends where the disc lies flat."""
    (tmp_path / "disc").mkdir()
    (tmp_path / "disc" / "scene.toml").write_text(DISC)
    return str(tmp_path / "disc")


def falling() -> dict[str, np.ndarray]:
    """Arrays of a disc that falls for ever."""
    time = np.linspace(0.0, 0.3, 31)
    p_WB = np.zeros((31, 1, 3))
    p_WB[:, 0, 2] = 0.05 - 9.81 * time**2 / 2
    return {"time": time, "p_WB": p_WB}


@pytest.mark.drill
def test_a_truth_has_no_sample_behind_its_end(disc: str) -> None:
    """All samples before the end have their values, none lies behind it, and the message says when and why."""
    found = proofroll.simulate(disc, until=0.3, every=0.01)
    assert found.attrs["ends"] == pytest.approx(FALLS, abs=1e-12)
    assert found["time"].to_numpy() == pytest.approx(np.arange(11) * 0.01)
    assert found["p_WB"].to_numpy()[-1, 0, 2] == pytest.approx(0.05 - 9.81 * 0.1**2 / 2, abs=1e-14)
    assert "lies flat" in found.attrs["message"]


def test_a_run_is_judged_up_to_the_end_of_the_truth(disc: str) -> None:
    """A run that is right before the end agrees whatever it does behind, and one that is wrong before it differs."""
    run = falling()
    found = proofroll.judge(run, disc, {"p_WB": "1e-9 m"})
    assert found.agrees
    assert "the truth ends at t = 0.100964 s" in found.ended
    assert "not judged: what lies behind" in str(found)
    run["p_WB"][5, 0, 2] += 1e-3
    assert not proofroll.judge(run, disc, {"p_WB": "1e-9 m"}).agrees


@pytest.mark.nightly
def test_a_run_of_the_truth_that_lacks_samples_says_so(
    command_line: Callable[..., tuple[int, str, str]], disc: str
) -> None:
    """The exit code is 3, the values are those of the last sample before the end, and no bar is beside nothing."""
    code, out, _ = command_line("run", disc, "--engine", "truth", "--every", "0.01", "--json")
    content = json.loads(out)
    assert code == 3
    assert content["ends"] == pytest.approx(FALLS, abs=1e-12)
    assert content["final"]["time"] == pytest.approx(0.1)
    assert all(np.isfinite(content["final"][name]) for name in content["error_bars"] if name not in content["absent"])
