"""What an engine says of sticking, held against the events that it located."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.events import Event
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.events import Watch, contradicted
from proofroll.elements.ball_on_surface.sampling import BallSample
from proofroll.files.scene_file import load_scene

TIMES = [0.0, 0.1, 0.2, 0.3, 0.4]
SLIP, STICK = Event("slip", 0.15, 0.14, 0.16), Event("stick", 0.3, 0.29, 0.31)


@pytest.mark.parametrize(
    ("sticking", "events", "lies"),
    [
        ([True, True, False, False, True], [SLIP, STICK], False),
        ([True, True, False, True, True], [SLIP, STICK], False),
        ([True, True, True, True, True], [SLIP, STICK], True),
        ([True, True, True, True, True], [STICK], True),
        ([False, False, False, True, True], [STICK], False),
        ([False, False, True, True, True], [], True),
        ([True, True, False, False, False], [SLIP, Event("lift_off", 0.25, 0.25, 0.25)], False),
        ([True, True, False, True, False], [SLIP, Event("lift_off", 0.25, 0.25, 0.25)], False),
    ],
)
def test_flags_are_held_against_events(sticking: list[bool], events: list[Event], lies: bool) -> None:
    """Samples say what the events between them say, but in a bracket and in flight, where they may say anything."""
    assert contradicted(TIMES, sticking, events) is lies


def test_events_that_the_samples_deny_are_not_believed() -> None:
    """An engine that locates the end of a slip and says all along that it sticks has no events."""
    body = rolling_ball(load_scene("inclined_plane", tilt=0.8, mu_static=0.1))
    sample = BallSample(body.p0, body.v0, body.w0, force=np.array([0, 0, 5.0]), sticking=True)
    seen = Watch(body).conclude(np.array(TIMES), [sample] * 5, [STICK])
    assert seen.events == []
