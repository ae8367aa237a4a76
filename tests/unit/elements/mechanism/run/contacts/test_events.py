"""Events of contacts, found between the samples of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from proofroll.core.events import Event
from proofroll.elements.mechanism.run.contacts.events import _CREEPS, ContactWatch
from proofroll.elements.mechanism.run.contacts.step_events import StepEvent
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.files.scene_file import load_scene

EVERY = 0.01
UP = np.array([0.0, 0.0, 1.0])


def ball(restitution: float = 0.0) -> MechanismElement:
    """A ball on a floor or over it."""
    return the_mechanism(load_scene("spinning_bounce", restitution=restitution))


def seen(
    heights: list[float],
    speeds: list[list[float]],
    N: list[float],
    element: MechanismElement,
    located: Sequence[Event] | None = None,
    share: float = 1.0,
) -> list[Event]:
    """Events of samples of a ball that does not turn; friction is at its bound, against the slip."""
    q, radius = np.array([1.0, 0, 0, 0]), 0.05
    friction = min(element.mechanism.contacts[0].friction, 1.0)
    samples = []
    for h, v, n in zip(heights, speeds, N, strict=True):
        slip = np.array([*v[:2], 0.0])
        force = n * (UP - share * friction * slip / (np.linalg.norm(slip) or 1.0))
        samples.append(
            MechanismSample(np.array([0, 0, radius + h]), np.array(v), np.zeros(3), q_WB=q, contact_force=force)
        )
    watch = ContactWatch(element)
    found = watch.conclude(EVERY * np.arange(len(samples)), samples, located)
    assert found.events is not None
    return list(found.events)


def told(events: list[Event]) -> list[tuple[str, int]]:
    """Kinds of events, and the sample before each."""
    return [(event.kind, round(event.time_low / EVERY)) for event in events]


def test_a_slip_that_ends_is_a_stick_and_at_rest_a_rest() -> None:
    """The time is where the slip comes to zero; what stands then rests."""
    events = seen([0] * 5, [[0.3, 0, 0], [0.2, 0, 0], [0.1, 0, 0], [0, 0, 0], [0, 0, 0]], [1.0] * 5, ball())
    assert [event.kind for event in events] == ["rest"]
    assert events[0].time == pytest.approx(0.03)
    assert events[0].name == "contact"


@pytest.mark.parametrize("bend", [0.0, 0.02])
def test_the_bracket_of_a_slips_end_is_what_the_change_of_its_fall_leaves_open(bend: float) -> None:
    """A slip that falls evenly ends within round-off; one whose fall changes, within what that moves its end."""
    slides = [[0.25 + bend, 0, 0], [0.15, 0, 0], [0.05, 0, 0], *[[0, 0, 0]] * 4]
    (event,) = seen([0] * 7, slides, [1.0] * 7, ball())
    assert event.time == pytest.approx(0.025)
    assert event.time_high - event.time == pytest.approx(bend * 0.01 * 0.75 / 2 / 0.1, abs=1e-10)


@pytest.mark.parametrize(
    ("kind", "time", "taken"), [("rest", 0.0301, True), ("slip", 0.0301, False), ("rest", 0.06, False)]
)
def test_an_engines_own_event_is_taken_unless_samples_contradict_it(kind: str, time: float, taken: bool) -> None:
    """An event that fits the samples keeps its own bracket; a wrong one is not believed."""
    own = Event(kind, time, time - 1e-4, time, "contact")
    slides = [[0.3, 0, 0], [0.2, 0, 0], [0.1, 0, 0], *[[0, 0, 0]] * 4]
    events = seen([0] * 7, slides, [1.0] * 7, ball(), [own])
    assert (events == [own]) == taken
    assert [event.kind for event in events] == ["rest"]


@pytest.mark.parametrize(("time", "taken"), [(0.0004, True), (0.0103, True), (0.0493, True), (0.0503, False)])
def test_a_slip_that_grazes_is_taken_where_it_begins(time: float, taken: bool) -> None:
    """Slip that rises for long before it counts may have begun at any of these samples, and not after it counts."""
    creeps = _CREEPS * ball().speed
    slides = [[k**2 * creeps / 12, 0, 0] for k in range(8)]  # counts at the fifth sample
    own = Event("slip", time, time, time, "contact")
    assert (seen([0] * 8, slides, [1.0] * 8, ball(), [own]) == [own]) == taken


def test_a_slip_before_another_rise_is_none_of_it() -> None:
    """Where creep has come to rest before it rises, the slip began with the last rise."""
    creeps = _CREEPS * ball().speed
    slides = [[part * creeps, 0, 0] for part in (0.1, 0.5, 0.0, 0.0, 0.0, 0.2, 0.6, 3.0, 5.0, 7.0)]
    early = Event("slip", 0.005, 0.005, 0.005, "contact")
    (found,) = seen([0] * 10, slides, [1.0] * 10, ball(), [early])
    assert (found.time_low, found.time_high) == pytest.approx((0.06, 0.07))


def test_what_slides_back_has_turned() -> None:
    """A slip that reverses between two samples is told as such."""
    events = seen([0] * 4, [[0.1, 0, 0], [0.05, 0, 0], [-0.05, 0, 0], [-0.1, 0, 0]], [1.0] * 4, ball())
    assert told(events) == [("turn", 1)]


def test_an_impact_is_found_with_and_without_a_rebound() -> None:
    """A ball that lands presses afterwards; one that rebounds between samples has the opposite speed."""
    landed = seen([0.015, 0.005, 0, 0], [[0, 0, -1.0], [0, 0, -1.0], [0, 0, 0], [0, 0, 0]], [0, 0, 1.0, 1.0], ball())
    assert told(landed) == [("impact", 1)]
    assert landed[0].time == pytest.approx(0.015)
    rebound = seen([0.015, 0.005, 0.004, 0.012], [[0, 0, -1.0]] * 2 + [[0, 0, 0.8]] * 2, [0] * 4, ball(0.8))
    assert told(rebound) == [("impact", 1)]
    during = seen([0.01, 0, 0.01, 0.02], [[0, 0, -1.0], [0, 0, 0.1], [0, 0, 0.8], [0, 0, 0.8]], [0, 9.0, 0, 0], ball())
    assert [kind for kind, _ in told(during)] == ["impact"]


@pytest.mark.parametrize("gap", [0.45, 0.02, 1e-3])
def test_what_swings_past_the_floor_does_not_strike_it(gap: float) -> None:
    """A normal speed that changes its sign without a touch is no impact, however near the floor is."""
    t, acceleration = EVERY * np.arange(-4.5, 5.0), 40.0
    heights, speeds = gap + acceleration * t**2 / 2, [[0.3, 0.0, u] for u in acceleration * t]
    assert seen(heights.tolist(), speeds, [0.0] * len(t), ball()) == []
    trembles = [[0.0, 0.0, sign * 1e-12] for sign in (-1.0, 1.0, -1.0, 1.0)]
    assert seen([gap] * 4, trembles, [0.0] * 4, ball()) == []


def test_what_leaves_at_the_start_has_not_struck() -> None:
    """A speed into the floor that is round-off at the start of a flight, as of a ball on a crest, is no impact."""
    t = EVERY * np.arange(4.0)
    speeds = [[0.3, 0.0, float(u)] for u in [-1e-17, *(0.4 * t[1:])]]
    assert seen((0.2 * t**2).tolist(), speeds, [0.0] * 4, ball()) == []


@pytest.mark.parametrize("phase", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("speed", [0.15, 1.0])
def test_what_rebounds_between_samples_has_struck(phase: float, speed: float) -> None:
    """A touch is found wherever it lies between its samples, and however slow it is against gravity."""
    t, g, e = EVERY * (np.arange(-2.0, 2.0) + phase), 9.81, 0.8
    heights = np.where(t < 0, -speed * t, e * speed * t) - g * t**2 / 2
    up = np.where(t < 0, -speed, e * speed) - g * t
    events = seen(heights.tolist(), [[0.0, 0.0, u] for u in up], [0.0] * 4, ball(e))
    assert [event.kind for event in events] == ["impact"]


@pytest.mark.parametrize("N", [[1.0, 1.0, 0, 0, 0, 1.0, 1.0], [0, 0, 0, 0, 1.0, 1.0, 1.0], [1.0] * 3 + [0] * 4])
def test_a_load_that_others_bear_is_no_lift_off(N: list[float]) -> None:
    """A contact that loses its force while its gap stays closed has neither left nor struck."""
    assert seen([0] * 7, [[0, 0, 0]] * 7, N, ball()) == []


def test_a_slip_in_the_plane_that_bends_has_not_turned() -> None:
    """Only a slip that goes back along its line turns; one whose direction changes sideways does not."""
    bent = [[0.1, 0.1, 0], [0.1, 0.05, 0], [-0.02, -0.08, 0], [-0.05, -0.1, 0]]
    sideways = [[0.1, 0.1, 0], [0.1, 0.02, 0], [-0.04, 0.12, 0], [-0.05, 0.2, 0]]
    assert [event.kind for event in seen([0] * 4, sideways, [1.0] * 4, ball())] == []
    assert told(seen([0] * 4, bent[:1] * 2 + [[-x for x in bent[0]]] * 2, [1.0] * 4, ball())) == [("turn", 1)]


def test_what_no_longer_presses_has_lifted_off() -> None:
    """A force that ends is a lift-off between the samples."""
    events = seen([0, 0, 0.01, 0.02], [[0, 0, 0], [0, 0, 0.5], [0, 0, 1.0], [0, 0, 1.0]], [1.0, 1.0, 0, 0], ball())
    assert told(events) == [("lift_off", 1)]


def test_an_engine_without_forces_of_contact_has_no_events() -> None:
    """Without forces nothing is told, rather than that nothing happened."""
    sample = MechanismSample(np.array([0, 0, 0.05]), np.zeros(3), np.zeros(3), q_WB=np.array([1.0, 0, 0, 0]))
    watch = ContactWatch(ball())
    assert watch.conclude(EVERY * np.arange(3), [sample] * 3, None).events is None
    silent = replace(sample, contact_force=np.full(3, np.nan))
    assert watch.conclude(EVERY * np.arange(3), [sample, silent, silent], None).events is None


def test_what_creeps_within_its_cone_does_not_slip() -> None:
    """Speed above the threshold with friction below its bound is no slip, and unbounded friction never slips."""
    creeps = [[0.0, 0, 0]] * 3 + [[0.3, 0, 0]] * 5
    assert told(seen([0] * 8, creeps, [1.0] * 8, ball())) == [("slip", 2)]
    assert seen([0] * 8, creeps, [1.0] * 8, ball(), share=0.5) == []
    assert seen([0] * 8, creeps, [1.0] * 8, ball(), [], share=0.9) == []  # told to stick, within the cone
    mechanism = ball().mechanism
    gripping = replace(mechanism, pairs=tuple(replace(pair, friction=np.inf) for pair in mechanism.pairs))
    assert seen([0] * 8, creeps, [1.0] * 8, MechanismElement(gripping), share=0.0) == []


def test_an_event_of_steps_is_what_samples_see_of_it() -> None:
    """A contact that holds in an engine's steps rests if samples show it; one that parts between samples hops."""
    slides = [[0.3, 0, 0], [0.2, 0, 0], [0.1, 0, 0], *[[0, 0, 0]] * 4]
    located = [StepEvent(kind, t, t - 1e-3, t, "contact") for kind, t in (("lift_off", 0.004), ("stick", 0.031))]
    assert seen([0] * 7, slides, [1.0] * 7, ball(), located) == [Event("rest", 0.031, 0.03, 0.031, "contact")]
