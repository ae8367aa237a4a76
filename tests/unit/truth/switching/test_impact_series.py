"""Impacts that alternate and accumulate: rocking blocks, corners of a box, and the sum of their series."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanism_scenes import mechanism_named
from scipy.integrate import quad

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.sequences import Outcomes, refuse_spread
from proofroll.elements.mechanism.dynamics import switches
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.check.laws import impacts
from proofroll.truth.switching.contact_stretches import GeometricSeries, Impact, ImpactSeries
from proofroll.truth.truth_of_mechanism import truth_of

GRAVITY = 9.81


def housner(half_width: float, half_height: float, tilt: float) -> tuple[list[float], float]:
    """Times of impacts of a homogeneous block let go at a tilt, and of its rest, by quadrature [s]."""
    slope = float(np.arctan2(half_width, half_height))
    square = 0.75 * GRAVITY / float(np.hypot(half_width, half_height))  # m g R over the moment about a corner

    def swing(top: float) -> float:
        """Duration of the fall from rest at an angle to the face."""

        def slowness(s: float) -> float:
            angle = top * (1 - s * s)
            return float(
                2 * top * s / np.sqrt(4 * square * np.sin(slope - (top + angle) / 2) * np.sin((top - angle) / 2))
            )

        return float(quad(slowness, 0, 1)[0])

    ratio, top, times = 1 - 1.5 * np.sin(slope) ** 2, tilt, [swing(tilt)]
    while top > 1e-12:
        high = ratio**2 * 2 * np.sin(slope - top / 2) * np.sin(top / 2)  # cos(slope - angle) - cos(slope)
        top = slope - float(np.arccos(np.cos(slope) + high)) if high > 1e-3 else _angle(high, slope)
        times.append(times[-1] + 2 * swing(top))
    return times, times[-1] + (times[-1] - times[-2]) * ratio / (1 - ratio)


def _angle(high: float, slope: float) -> float:
    angle = high / np.sin(slope)
    for _ in range(9):
        angle -= (2 * np.sin(slope - angle / 2) * np.sin(angle / 2) - high) / np.sin(slope - angle)
    return float(angle)


@pytest.mark.nightly
def test_a_block_rocks_to_its_rest() -> None:
    """Infinitely many impacts of both corners in turn end when their geometric series says."""
    block = mechanism_named("rocking_block")
    times, rests = housner(0.1, 0.25, 0.15)
    found = truth_of(block, np.array([0.0, 1.0, 1.6]))
    assert (found.ended, found.horizon) == ("", np.inf)
    impacts = [event.time for event in found.events if event.kind == "impact"]
    assert impacts[:20] == pytest.approx(times[:20], abs=1e-10)  # 1e-12 is seen
    ends = [event for event in found.events if event.kind == "settle"]
    assert {event.name for event in ends} == {"left", "right"}
    assert all(event.time_low < rests < event.time_high < event.time_low + 1e-8 for event in ends)
    assert np.abs(found.record.v_WB[2]).max() < 1e-12
    assert found.record.p_WB[2, 0, 2] == pytest.approx(0.25, abs=1e-12)


def dropped(kind: str, start: tuple[float, ...], friction: float) -> Mechanism:
    """A cube of 0.4 m and 10 kg that moves in a joint above a floor."""
    free = Joint("j", kind, "world", "box", q0=start, **({"axis": (0, 1, 0)} if kind == "planar" else {}))
    shapes = (Geometry("floor", "world", "plane"), Geometry("shape", "box", "box", size=(0.4, 0.4, 0.4)))
    return Mechanism(
        (Body("box", 10.0, inertia=(4 / 15,) * 3),),
        (free,),
        gravity=(0.0, 0.0, -GRAVITY),
        geometries=shapes,
        pairs=(Pair("touch", ("shape", "floor"), friction=friction),),
    )


@pytest.mark.nightly
def test_a_cube_that_falls_on_an_edge_rocks_to_its_rest() -> None:
    """Each impact leaves a quarter of the speed: sums of intervals by the energy of the cube."""
    cube = dropped("free", (0, 0, 0.4, float(np.cos(0.15)), 0, float(np.sin(0.15)), 0), 1.0)
    found = truth_of(cube, np.array([0.0, 0.3, 1.0]))
    assert (found.ended, found.horizon) == ("", np.inf)
    impacts = sorted({round(event.time, 9) for event in found.events if event.kind == "impact"})
    assert impacts[1:5] == pytest.approx([0.2797, 0.3821, 0.4073, 0.4136], abs=5e-5)
    assert found.record.p_WB[2, 0] == pytest.approx([-0.0680367435, 0, 0.2], abs=1e-10)
    assert found.events[-1].kind == "settle"
    assert found.events[-1].time == pytest.approx(0.41567584, abs=1e-8)


CORNER = (0.9838313410528056, 0.0987123949919223, 0.14869156426260063, -0.014918919342160731)


@pytest.mark.nightly
def test_two_smooth_corners_that_hit_in_turn_close_and_the_box_goes_on_an_edge() -> None:
    """Their impacts accumulate before the other edge lands: then the box lies flat, and slides without slowing."""
    found = truth_of(dropped("free", (0, 0, 0.4, *CORNER), 0.0), np.array([0.0, 0.2, 0.5]))
    assert (found.ended, found.horizon) == ("", np.inf)
    assert {event.name for event in found.events if event.kind == "settle"} == {"touch.5", "touch.7"}
    assert found.record.p_WB[2, 0] == pytest.approx([0, 0, 0.2], abs=1e-12)


@pytest.mark.nightly
def test_one_order_is_told_from_the_impact_at_once() -> None:
    """A cube that lands on its second edge while the first one slides has one order: it is no question of orders."""
    turn = (0.984807753012208, 0.0, -0.17364817766693033, 0.0)
    cube = dropped("free", (0, 0, 0.4, *turn), 0.5)
    sloped = replace(cube, gravity=(0.3420201433256687 * GRAVITY, 0.0, -0.9396926207859084 * GRAVITY))
    found = truth_of(sloped, np.array([0.0, 0.3, 0.4]))
    assert "impacts in turn and at once differ by 0.052 of the jump" in found.ended
    assert found.record.time.tolist() == [0.0, 0.3]


def test_impacts_in_turn_and_at_once_are_compared() -> None:
    """One outcome of all orders, 2 % from the impact at once, or of other modes, is no question of orders."""
    outcomes, jumps = Outcomes(np.zeros((2, 3)), complete=True), np.array([[1.0, 1.0], [0.0, 0.0]])
    refuse_spread(jumps, outcomes, ["a", "b"], 0.5, np.array([1.0, 0.009]))
    with pytest.raises(NotUnique, match=r"a and b at once: impacts in turn and at once differ by 0\.02 of the jump"):
        refuse_spread(jumps, outcomes, ["a", "b"], 0.5, np.array([1.0, 0.02]))
    with pytest.raises(NotUnique, match=r"differ by 0 of the jump of the velocities, and in which contacts stick"):
        refuse_spread(jumps, outcomes, ["a", "b"], 0.5, np.array([1.0, 0.0]), alike=False)
    with pytest.raises(NotUnique, match=r"its outcome depends on their order, by 0\.02"):
        refuse_spread(jumps + np.diag([0.02, 0.0]), outcomes, ["a", "b"], 0.5)


def series_of(ratio: float, growth: float) -> tuple[GeometricSeries | None, float]:
    """Series after eight impacts of two sets of contacts in turn, and the time of the last."""
    impacts, time, found = ImpactSeries(), 0.0, None
    for k in range(8):
        time += growth**k
        found = impacts.after("pair", Impact(time, frozenset({2} if k % 2 else {0, 1}), ratio**k))
    return found, time


def test_a_series_of_impacts_is_summed_when_speeds_and_intervals_shrink_alike() -> None:
    """Two sets of contacts that are hit in turn are one cycle; intervals that grow make none."""
    found, time = series_of(0.5, 0.5)
    assert found is not None
    assert found.contacts == {0, 1, 2}
    assert found.ratio == pytest.approx(0.25)
    assert time + found.remaining == pytest.approx(2.0)
    assert series_of(0.5, 2.0)[0] is None


@pytest.mark.nightly
def test_the_error_of_impacts_cut_short_is_within_the_bars(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the sum of a series begins changes the motion of a rocking block within its bars."""
    block = mechanism_named("rocking_block")
    monkeypatch.setattr(switches, "SETTLED", 1e-3)
    monkeypatch.setattr(impacts, "_SETTLED", 1e-3)  # the law check knows the cut by its own number
    rough = truth_of(block, np.array([0.0, 1.6]))
    monkeypatch.setattr(switches, "SETTLED", 1e-6)
    monkeypatch.setattr(impacts, "_SETTLED", 1e-6)
    fine = truth_of(block, np.array([0.0, 1.6]))
    off = float(np.abs(rough.record.p_WB[-1] - fine.record.p_WB[-1]).max())
    assert off < float(rough.bars["p_WB"][-1])
    rests = [next(event for event in each.events if event.kind == "settle") for each in (rough, fine)]
    assert rests[0].time_low < rests[1].time < rests[0].time_high


def test_contacts_that_meet_without_speed_form_no_series() -> None:
    """Impacts of speed zero, as of bodies that start inside each other, have no ratio of speeds."""
    impacts = ImpactSeries()
    assert [impacts.after("", Impact(time, frozenset({0}), 0.0)) for time in (0.0, 0.1, 0.15, 0.175)] == [None] * 4


@pytest.mark.parametrize("times", [(1.0, 1.0, 1.0), (1.0, 1.0, 1.0 - 1e-16), (1.0, 1.0, 1.0 + 1e-15)])
def test_impacts_at_one_time_form_no_series(times: tuple[float, ...]) -> None:
    """Impacts of one pair at the same time to the last bit have no periods whose ratio says anything."""
    impacts = ImpactSeries()
    speeds = (1.0, 0.5, 0.25)
    found = [impacts.after("", Impact(time, frozenset({0}), speed)) for time, speed in zip(times, speeds, strict=True)]
    assert found == [None] * 3
