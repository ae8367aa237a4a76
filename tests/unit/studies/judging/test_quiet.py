"""Motions in which nothing happens are said to be such."""

from __future__ import annotations

import numpy as np
import pytest

import proofroll
from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.studies.judging.reference import quiet


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("name", "parameters", "until", "words"),
    [
        ("pendulum", {"angle": 0.0}, 0.1, "Nothing moves up to 0.1 s: every body stays where it starts."),
        ("pendulum", {}, 0.1, ""),
        ("bouncing_ball", {}, 0.1, "Nothing touches up to 0.1 s: no contact and no impact is part of the answer."),
        pytest.param("bouncing_ball", {}, 0.6, "", marks=pytest.mark.drill),
    ],
)
def test_a_motion_in_which_nothing_happens_is_told(
    name: str, parameters: dict[str, float], until: float, words: str
) -> None:
    """Bodies at rest, and bodies that do not touch before the end, have a sentence; others have none."""
    scene = load_scene(name, **parameters)
    data = truth(scene.fully_asked, np.linspace(0.0, until, 6))
    assert quiet(scene, data.variables, events_of(data)) == words


def test_what_touches_without_a_force_is_not_told_to_be_apart() -> None:
    """A body along a floor that bears nothing touches it: the gap is closed."""
    scene = load_scene("bouncing_ball")
    data = truth(scene.fully_asked, np.linspace(0.0, 0.1, 6))
    gap = next(name for name in ("gap", "gaps") if name in data)
    assert quiet(scene, data.assign({gap: 0 * data[gap]}).variables, ()) == ""


def test_a_judgement_of_a_body_at_rest_says_so() -> None:
    """A trajectory that agrees with a truth in which nothing moves has the sentence in its text and its content."""
    times = np.linspace(0.0, 0.1, 6)
    judged = proofroll.judge({"time": times, "q.pivot": 0 * times}, load_scene("pendulum", angle=0.0))
    assert judged.agrees
    assert "Nothing moves up to 0.1 s" in str(judged)
    assert judged.content()["quiet"].startswith("Nothing moves")


@pytest.mark.parametrize("begin", [0.0, 2.0])
def test_a_motion_that_is_over_before_the_first_sample_is_not_told_to_rest(begin: float) -> None:
    """A body that may have moved before the first sample, or moves between samples, is not told to rest."""
    scene = load_scene("pendulum", angle=0.0)
    data = truth(scene.fully_asked, np.linspace(0.0, 0.1, 6)).assign_coords(time=begin + np.linspace(0.0, 0.1, 6))
    if begin:
        assert quiet(scene, data.variables, ()) == ""
    data["v_WB"] = data["v_WB"] + 1.0
    assert quiet(scene, data.variables, ()) == ""


def test_rows_without_a_number_are_counted() -> None:
    """Of several rows that are not finite, the answer has the number and the first."""
    times = np.linspace(0.0, 0.1, 6)
    angle = np.where(times > 0.05, np.nan, 0.0)
    judged = proofroll.judge({"time": times, "q.pivot": angle}, load_scene("pendulum", angle=0.0))
    assert "q.pivot is not finite in 3 of 6 rows, first at 0.06 s" in str(judged)
