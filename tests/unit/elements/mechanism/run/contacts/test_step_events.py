"""Events of contacts by their states in an engine's steps."""

from __future__ import annotations

import math

import pytest

from proofroll.core.events import Event
from proofroll.elements.mechanism.run.contacts.step_events import OPEN, SLIP, STICK, StepEvents, state_of
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, SphereShape

STEP = 1e-3


def watched(states: str, friction: float = 0.3) -> list[Event]:
    """Events of one contact by its states in steps, a letter each: (o)pen, stic(k), (s)lip."""
    sphere, floor = SphereShape((0.0, 0.0, 0.0), 0.1), HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    events = StepEvents([BodyContact("foot", "b", "world", sphere, floor, friction, 0.0, "foot")], STEP)
    for number, letter in enumerate(states, 1):
        events.observe(number * STEP, ({"o": OPEN, "k": STICK, "s": SLIP}[letter],))
    return list(events.events() or ())


@pytest.mark.parametrize(
    ("states", "told"),
    [
        ("kkkkssss", [("slip", 5)]),
        ("sssskkkk", [("stick", 5)]),
        ("kkkkooookkkk", [("lift_off", 5), ("impact", 9)]),
        ("kkkksskkkk", []),  # friction at its bound for two steps
        ("kkkkoskkssss", [("slip", 5)]),  # hops where it begins to slip
        ("ooooskooooo", [("impact", 5)]),  # rebounds
        ("skkkkkk", []),  # builds its load up
        ("kkkks", [("slip", 5)]),  # now
    ],
)
def test_what_lasts_is_an_event_of_the_step_where_it_begins(states: str, told: list[tuple[str, int]]) -> None:
    """Each event has the bracket of one step; flickers, hops and first loads are none."""
    events = watched(states)
    assert [(event.kind, round(event.time_high / STEP)) for event in events] == told
    assert all(event.time_high - event.time_low == pytest.approx(STEP) for event in events)
    assert all(event.name == "foot" for event in events)


@pytest.mark.parametrize("friction", [0.0, math.inf])
def test_contacts_that_never_change_are_not_watched(friction: float) -> None:
    """Without bounded friction nothing is located, which is not the same as no event."""
    sphere, floor = SphereShape((0.0, 0.0, 0.0), 0.1), HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    watch = StepEvents([BodyContact("foot", "b", "world", sphere, floor, friction, 0.0, "foot")], STEP)
    assert not watch
    assert watch.events() is None


def test_a_state_follows_from_the_force() -> None:
    """Friction at its bound slips, below it sticks; without a normal force the contact is open."""
    assert state_of(0.0, 0.0, 0.0) == OPEN
    assert (state_of(1.0, 0.2, 0.3), state_of(1.0, 0.3, 0.3), state_of(1.0, 5.0, math.inf)) == (STICK, SLIP, STICK)
