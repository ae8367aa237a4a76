"""Replay pages of runs whose truth ends early, or that say of no scene."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from proofroll.files.scene_file import load_scene
from proofroll.report.run.curves import names_of_curves
from proofroll.report.run.replay import replay_page, run_page
from proofroll.running.simulation import simulate


@pytest.mark.nightly
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


def test_a_run_of_no_scene_is_shown_alone() -> None:
    """Where nothing tells which scene it is, the page says so and has all curves of the run."""
    run = simulate(load_scene("pendulum"), "mujoco", until=0.1, every=0.05)
    del run.attrs["scene"]
    page = run_page(Path("run.nc"), run)
    assert "The run alone: it does not say which scene it is of" in page
    captions = re.findall("<figcaption>(.*?)</figcaption>", page.partition('id="curves"')[2])
    assert {re.sub("<[^>]*>", "", text).partition(" [")[0] for text in captions} == set(names_of_curves(run))
