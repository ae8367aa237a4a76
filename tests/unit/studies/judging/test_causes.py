"""Typical mistakes in trajectories of users are named, and nothing else is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.parts import Point
from proofroll.files.scene_file import load_scene
from proofroll.studies.judging.causes import GivenVariable, begun_later, causes_of, mapping

TIMES = np.linspace(0.0, 2.0, 41)
ONE, TWO = np.sin(3 * TIMES) + 0.3, np.cos(2 * TIMES) - 0.1


def said(one: Any, two: Any, unit: str = "rad") -> list[str]:
    """Causes of two given variables whose true values are ONE and TWO."""
    given = {"q.a": GivenVariable(np.asarray(one), ONE, unit), "q.b": GivenVariable(np.asarray(two), TWO, unit)}
    return causes_of(given, TIMES, [])


@pytest.mark.parametrize(
    ("one", "two", "words"),
    [
        (ONE * 180 / np.pi, TWO, "q.a is 57.3 times the truth: degrees?"),
        (-ONE, TWO, "q.a is the opposite of the truth: its sign?"),
        (ONE, ONE + TWO, "q.b is its sum with q.a: an absolute angle"),
        (ONE - 2 * np.pi * (ONE > 0.8), TWO, "q.a is less by whole turns: wrapped to one turn?"),
        (TWO, ONE, "q.a and q.b are each the other: swapped columns?"),
        (ONE + 0.2 * np.exp(-TIMES), TWO, "the first row is not the scene's start: q.a 0.5 instead of 0.3 rad"),
    ],
    ids=["degrees", "sign", "absolute", "wrapped", "swapped", "start"],
)
def test_a_mistake_is_named_alone(one: Any, two: Any, words: str) -> None:
    """One clause, with the difference that it closes."""
    (only,) = said(one, two)
    assert only.startswith(words)


def test_a_motion_that_differs_otherwise_has_no_cause() -> None:
    """A wrong amplitude, a slow clock of one coordinate and the truth itself are no mistake of this kind."""
    for one in (1.1 * (ONE - 0.3) + 0.3, np.sin(3 * TIMES - 0.3 * TIMES) + 0.3, ONE):
        assert said(one, TWO) == []


@pytest.mark.parametrize("unit", ["rad", "m"])
def test_a_column_of_zeros_is_no_other_unit(unit: str) -> None:
    """A column of zeros lies near a small part of the truth, and is told neither as degrees nor as millimetres."""
    assert [cause for cause in said(0 * ONE, TWO, unit) if cause.startswith("q.a is")] == []


def test_round_off_has_no_cause() -> None:
    """Variables that are zero but for round-off are neither a thousandth of the truth nor another start."""
    noise = GivenVariable(1e-19 * np.ones(41), 1e-16 * np.ones(41), "m")
    assert causes_of({"tip.z": noise}, TIMES, []) == []


@pytest.mark.parametrize(
    ("one", "unit", "columns", "closes"),
    [
        (ONE * 180 / np.pi, "rad", {}, ["q.a=q.a[deg]"]),
        (ONE * 1e3, "m", {"x": "q.a"}, ["x=q.a[mm]"]),
        (-ONE, "m", {}, []),
    ],
)
def test_another_unit_has_a_mapping_that_closes_it(
    one: Any, unit: str, columns: dict[str, str], closes: list[str]
) -> None:
    """The names of columns to type; a sign has none."""
    (only,) = said(one, TWO, unit)
    assert mapping(only, {"q.a": unit}, columns) == closes


def test_swapped_columns_have_a_mapping() -> None:
    """Each gets the name of the other."""
    (only,) = said(TWO, ONE)
    assert mapping(only, {}, {"first": "q.a"}) == ["first=q.b", "q.b=q.a"]


def one_at(times: Any) -> Any:
    """ONE at other times, standing at its start before time 0."""
    return np.sin(3 * np.maximum(times, 0.0)) + 0.3


def two_at(times: Any) -> Any:
    """TWO at other times."""
    return np.cos(2 * np.maximum(times, 0.0)) - 0.1


@pytest.mark.parametrize("delay", [0.1, 0.123, 0.6, -0.1])
def test_a_record_at_other_times_is_named(delay: float) -> None:
    """One clause for all that moves, whether the delay is one of samples or not; of one late column its name."""
    word = f"{'late' if delay > 0 else 'early'} by {abs(delay):g} s (off by "
    (only,) = said(one_at(TIMES - delay), two_at(TIMES - delay))
    assert only.startswith(f"the record is {word}")
    (only,) = said(ONE, two_at(TIMES - delay))
    assert only.startswith(f"q.b is {word}")
    assert not [cause for cause in said(one_at(TIMES - delay), two_at(0.9 * TIMES - delay)) if "the record" in cause]


@pytest.mark.parametrize("rate", [0.5, 2.0, 4.0])
def test_a_clock_at_another_rate_is_named(rate: float) -> None:
    """Times that are doubled, halved or a quarter are told of the whole record, and of no single coordinate."""
    (only,) = said(one_at(rate * TIMES), two_at(rate * TIMES))
    assert only.startswith(f"the record runs {rate:g} times as fast as its times say (off by ")
    assert said(one_at(rate * TIMES), TWO) == []


@pytest.mark.nightly
def test_a_state_at_half_its_times_is_no_other_gravity() -> None:
    """A whole state whose times are halved has its clock as its cause, where the balance of momentum doubles, too."""
    scene = load_scene("pendulum")
    times = 0.02 * np.arange(51)
    true = truth(scene.fully_asked, times)
    run = {name: true[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB", "q_WB")}
    judged = proofroll.judge({"time": times / 2, **run}, scene)
    assert [cause.partition(" (")[0] for cause in judged.causes] == ["the record runs 2 times as fast as its times say"]
    assert "gravity" not in str(judged)


@pytest.mark.drill
def test_a_late_record_of_a_motion_that_jumps_is_named() -> None:
    """Its places tell the delay, and no start that was not taken is told beside it."""
    scene = load_scene("two_spheres")
    times = 0.02 * np.arange(26)
    true = truth(scene.fully_asked, times)
    late = np.maximum(np.arange(26) - 5, 0)
    run = {name: true[name].to_numpy()[late] for name in ("p_WB", "v_WB", "w_WB", "q_WB")}
    (only,) = proofroll.judge({"time": times, **run}, scene).causes
    assert only.startswith("the record is late by 0.1 s (")


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("clock", [True, False])
def test_a_late_record_is_named(*, whole: bool, clock: bool) -> None:
    """A clock that is late by 0.1 s, and a start that is; of coordinates alone, and of a whole state."""
    scene = load_scene("pendulum")
    times = 0.02 * np.arange(31)
    true = truth(scene.fully_asked, times)
    given = ("p_WB", "v_WB", "w_WB", "q_WB") if whole else ("q.pivot", "tip.x")
    columns = {name: true[name].to_numpy()[: -5 if clock else None] for name in given}
    if not clock:
        columns = {name: values[np.maximum(np.arange(31) - 5, 0)] for name, values in columns.items()}
    judged = proofroll.judge({"time": times[5:] if clock else times, **columns}, scene)
    assert not judged.agrees
    assert "cause: the record is late by 0.1 s (" in str(judged)


@pytest.mark.nightly
def test_a_clock_that_begins_later_is_no_delay_less_some_periods() -> None:
    """The first row of a swing that comes back is the scene's start, wherever its clock begins."""
    scene = load_scene("pendulum", angle=0.5)
    times = 0.02 * np.arange(61)
    true = truth(scene.fully_asked, times)
    judged = proofroll.judge({"time": 3.0 + times, "q.pivot": true["q.pivot"].to_numpy()}, scene)
    assert [cause.partition(" is off")[0] for cause in judged.causes] == [
        "the record is late by 3 s (its clock begins then, with the scene's start: q.pivot"
    ]
    later = truth(scene.fully_asked, np.concatenate([[0.0], 3.0 + times]))
    assert proofroll.judge({"time": 3.0 + times, "q.pivot": later["q.pivot"].to_numpy()[1:]}, scene).agrees


def test_what_the_truth_does_not_determine_from_the_start_hinders_no_answer() -> None:
    """A variable without a true number at the times from the start leaves the clock undecided where it is wrong."""
    times = np.linspace(0.0, 1.0, 20)
    right, late = GivenVariable(times, times, "rad"), GivenVariable(times, times + 1.0, "rad")
    assert begun_later({"q.a": late, "force": right}, {"q.a": right}, 1.0).startswith("the record is late by 1 s")
    assert begun_later({"q.a": late, "force": late}, {"q.a": right}, 1.0) == ""


def test_millimetres_are_named() -> None:
    """A length in another unit."""
    assert said(1e3 * ONE, TWO, "m")[0].startswith("q.a is a thousand times the truth: millimetres?")


def falling() -> Scene:
    """A body that falls."""
    body, joint = Body("body", 1.0, inertia=(0.1, 0.1, 0.1)), Joint("float", "free", "world", "body")
    made = Mechanism((body,), (joint,), points=(Point("middle", "body"),), gravity=(0, 0, -10))
    return Scene("fall", "", (MechanismElement(made),))


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("kept", [0.96, 1.0])
def test_damping_of_a_free_body_is_named(kept: float) -> None:
    """Steps of 1/240 s that keep 96 % of the velocity in a second; without, their first-order error is no damping."""
    h, z, v, rows = 1 / 240, 0.0, 0.0, [0.0]
    for _ in range(240):
        v = (v - 10 * h) * kept**h
        z += v * h
        rows.append(z)
    judged = proofroll.judge({"time": np.arange(241) * h, "middle.z": rows}, falling(), {"middle.z": "1e-3 m"})
    assert not judged.agrees
    assert ["damping of 0.041 1/s" in cause for cause in judged.causes] == ([True] if kept < 1 else [])
    assert ("cause: middle.z is slowed down" in str(judged)) is (kept < 1)


def test_milliseconds_that_are_read_as_seconds_are_named() -> None:
    """Times a thousand times too long are found before a truth of that length is."""
    scene = load_scene("pendulum")
    (hinge,) = (joint.name for joint in scene.elements[0].mechanism.joints)  # type: ignore[attr-defined]  # of a mechanism
    times = np.linspace(0.0, 0.2, 6)
    run: dict[str, Callable[..., Any] | Any] = {"time": 1e3 * times, f"q.{hinge}": truth(scene, times)[f"q.{hinge}"]}
    with pytest.raises(InputError, match=r"with these times in milliseconds it follows the truth"):
        proofroll.judge({name: np.asarray(values) for name, values in run.items()}, scene)
