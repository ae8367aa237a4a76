"""How well a sequence of events is posed, from what a move of the parameters does to it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from proofroll.core.arrays import FloatArray
from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.truth.numerics.conditioning import Events, Story, in_common, well_posed_events

PACE, UNTIL = 1.0, 10.0
OWN: Events = [("slip", 2.0), ("stick", 4.0), ("slip", 6.0)]


def story(events: Events, jump: float = 0.0, at: float = math.inf) -> Story:
    """A motion that grows with time, and from a time on by a jump more."""

    def states(times: FloatArray) -> FloatArray:
        return (times + jump * (times > at))[:, None]

    return Story(events, states)


def test_what_moves_evenly_is_well_posed() -> None:
    """Events that a move of the parameters shifts as much one way as another move the other way are all known."""
    less, more = ([(kind, time + shift * time) for kind, time in OWN] for shift in (-0.05, 0.05))
    assert well_posed_events(story(OWN), [story(less), story(more)], PACE, UNTIL) == (3, True)


@pytest.mark.parametrize(
    ("other", "known"),
    [
        ([("slip", 2.0), ("stick", 4.0)], 2),  # one does not come
        ([*OWN, ("stick", 7.0)], 3),  # one more comes
        ([("slip", 2.0), ("lift_off", 4.0), ("slip", 6.0)], 1),  # another one comes
        ([("slip", 2.0), ("stick", 4.0), ("slip", 7.0)], 2),  # on another rise
    ],
)
def test_other_events_are_ill_posed(other: Events, known: int) -> None:
    """What is known ends before the first event that one of the moves changes, whichever of them does."""
    for pair in ([other, OWN], [OWN, other]):
        assert well_posed_events(story(OWN), [story(events) for events in pair], PACE, UNTIL) == (known, False)
    assert in_common(OWN, other, PACE, UNTIL) == (known, False)


def test_another_motion_between_the_same_events_is_ill_posed() -> None:
    """A motion that jumps after an event, on one side alone, makes all that comes after it unknown."""
    jumped = story(OWN, 1e-2, at=4.5)
    assert well_posed_events(story(OWN), [story(OWN), jumped], PACE, UNTIL) == (2, False)


def test_an_event_at_the_very_end_may_lie_beyond_it() -> None:
    """An event that a move shifts over the end of the run changes nothing that the run says."""
    late: Events = [*OWN, ("stick", UNTIL - 1e-6)]
    assert well_posed_events(story(OWN), [story(late), story(OWN)], PACE, UNTIL) == (3, True)
    assert in_common(OWN, late, PACE, UNTIL) == in_common(late, OWN, PACE, UNTIL) == (3, True)


def test_friction_that_an_impact_just_uses_up_is_ill_posed() -> None:
    """Where slipping rubs less, a blow that just sticks hangs on the last digits, though the bounce itself is known."""
    mu, spin = 0.3, 40.0
    # Stuck: (2/7) m u of friction are needed; there are μs (1 + e) m v.
    fall = math.sqrt(2 * 9.81)
    speed = mu * (1 + 0.5) * fall * 3.5 - spin * 0.025
    for part, ill in ((0.0, True), (1e-2, False), (-1e-2, False)):
        scene = load_scene(
            "bouncing_ball",
            restitution=0.5,
            speed=speed,
            back_spin=spin,
            mu_static=mu * (1 + part),
            mu_kinetic=0.2,
        )
        found = truth(scene, np.linspace(0.0, 0.8, 9))
        assert ("ill_posed" in found.attrs) == ill
        assert [event.kind for event in events_of(found)] == ["impact"] * (not ill)
