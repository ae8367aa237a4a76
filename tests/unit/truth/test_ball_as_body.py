"""Every ball scene read as a body with a sphere that touches a wall, held against frozen values and closed forms.

The values of ``ball_as_body.toml`` were found by two routes for balls alone, Taylor series in polar coordinates of the
slip and implicit collocation in the world, with their error bars.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from closed_balls import FORMS

from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene

FIELDS = ("p_WB", "v_WB", "w_WB")
ROUND_OFF = 1e-12  # s: least distance of the brackets of two events that counts
NARROW = 1e-10  # largest bar of the general truth over the largest value, or 1 in SI units; ten times what is seen
FROZEN: list[dict[str, Any]] = tomllib.loads(Path(__file__).with_name("ball_as_body.toml").read_text())["cases"]


def named(case: dict[str, Any]) -> str:
    """Scene and parameters that differ from the usual ones."""
    return f"{case['scene']} {' '.join(case['parameters'])}".strip()


# Every second case is for the night.
CASES = [
    pytest.param(
        case,
        marks=pytest.mark.nightly if place % 2 else pytest.mark.drill if case.get("slow") else (),
        id=named(case),
    )
    for place, case in enumerate(FROZEN)
]
CLOSED = [case for case in FROZEN if case["scene"] in FORMS and FORMS[case["scene"]][1](case["parameters"])]


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.drill_of("sphere_in_cylinder rolling_resistance")
@pytest.mark.parametrize("case", CASES)
def test_a_ball_read_as_a_body_moves_as_its_frozen_values_say(case: dict[str, Any]) -> None:
    """Position, velocity, spin and events agree within the sum of both error bars, and no bar is wide."""
    found = truth(load_scene(case["scene"], **case["parameters"]), np.array([0.0, *case["times"]]))
    for field in FIELDS:
        values, bar = found[field].sel(body="ball").to_numpy()[1:], float(found[field].attrs["error_bar"])
        apart, frozen = np.abs(values - np.array(case[field])).max(), case["bars"][field]
        assert np.isfinite(values).all(), field
        assert apart <= frozen + bar, field
        assert bar <= NARROW * max(1.0, float(np.abs(values).max())), field
    told = [event for event in events_of(found) if event.time > 0]
    assert [event.kind for event in told] == [kind for kind, *_ in case["events"]]
    for event, (_, _, low, high) in zip(told, case["events"], strict=True):
        assert max(event.time_low - high, low - event.time_high) <= ROUND_OFF


@pytest.mark.parametrize("case", CLOSED, ids=named)
def test_frozen_values_are_those_of_closed_forms(case: dict[str, Any]) -> None:
    """What a textbook says of a plane or an upright cylinder lies within the bars of the frozen values."""
    closed = FORMS[case["scene"]][0](case["parameters"], np.array(case["times"]))
    for field, values in zip(FIELDS, closed[:3], strict=True):
        assert np.abs(values - np.array(case[field])).max() <= case["bars"][field], field
    known = [event for event in case["events"] if event[0] in {"impact", "stick"}]
    assert [kind for kind, _ in closed.events] == [kind for kind, *_ in known]
    for (_, time), (_, _, low, high) in zip(closed.events, known, strict=True):
        assert low - ROUND_OFF <= time <= high + ROUND_OFF
