"""Replay pages of runs whose truth ends early."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from proofroll.files.scene_file import load_scene
from proofroll.report.run.replay import replay_page
from proofroll.running.simulation import simulate


@pytest.mark.drill
def test_nothing_is_drawn_behind_the_end_of_a_truth() -> None:
    """The page of a run whose truth ends early draws both up to there, and says when and why."""
    bouncing = {"restitution": 0.5, "tangential_restitution": 1.0, "mu_static": math.inf, "mu_kinetic": math.inf}
    scene = load_scene("bouncing_ball", back_spin=60.0, height=0.1, **bouncing)
    early = simulate(scene, "truth", until=0.6, every=0.05)
    longer = simulate(load_scene("bouncing_ball"), "truth", until=0.6, every=0.05)
    longer.attrs |= early.attrs | {"engine": "mine", "settings": "{}", "status": "done"}
    del longer.attrs["ends"], longer.attrs["ended"]  # of a truth, not of a run
    page = replay_page(Path("run.nc"), longer)
    assert re.search(r"What lies behind 0\.42\d+ s is not drawn, for the truth ends there: ball_on_wall closes", page)
    assert len(early.time) < len(longer.time)
