"""Scenes with numbers that other programs or closed forms published: the truth meets them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.elements.mechanism.scene.rotations import from_quaternion
from proofroll.files.scene_file import load_scene
from proofroll_drill.published import of_motion, of_scene, run_of, tables, true_motions

QUICK = {"falling_screw"}
# Those whose truths take longest.
NIGHTLY = {"spatial_slider_crank", "car_axis", "link_bench"}
MARKS = {True: pytest.mark.nightly, False: pytest.mark.drill}
BARS = 1e-10  # s, and units of values: 1e-12 is seen
# Meijaard, Papadopoulos, Ruina, Schwab 2007: the roots at 5 m/s.
ROOTS = np.array([-14.0783896927982, -0.3228664296, -0.7753418818 - 4.4648677130j, -0.7753418818 + 4.4648677130j])


@pytest.mark.one_in(3)
@pytest.mark.nightly_of("bricard", "babyboot", "pushed_box", "andrews_squeezer", "bicycle", "driven_four_bar")
@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=MARKS[name in NIGHTLY]) for name in tables()]
)
def test_a_truth_meets_what_peers_published(name: str) -> None:
    """Each published number of the scene, of an instant or a series, is the true one to its digits."""
    rows = [row for entry in tables()[name] for row in of_scene(name, entry)]
    assert [row.text for row in rows if row.misses] == []


# The last entry of each scene, or of each of its parameters.
MOTIONS = {entry["scene"] + str(entry.get("parameters", "")): entry for entry in true_motions()}
LONG = {"sled", "sled_on_slope", "eccentric_sphere", "tilted_disc", "rattleback"}


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.nightly_of("rattleback")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.drill) if name in LONG else name for name in MOTIONS]
)
def test_a_truth_meets_what_a_laboratory_found(name: str) -> None:
    """Values and events of other equations are the true ones to ten digits, within narrow brackets and bars."""
    entry = MOTIONS[name]
    found = run_of(entry)
    events = events_of(found)
    assert [row.text for row in of_motion(entry) if row.misses] == []
    assert [f"{event.kind} {event.name}" for event in events] == entry.get("happens", [])
    assert all(event.time_low <= event.time <= event.time_high <= event.time_low + BARS for event in events)
    assert max((found[value].attrs["error_bar"] for value in entry.get("values", {})), default=0.0) < BARS


@pytest.mark.drill
def test_a_bicycle_leans_as_published() -> None:
    """The roll is the angle of the frame's lateral axis from the level: three published instants, to 1e-12 rad."""
    found = truth(load_scene("bicycle"), np.array([0.0, 0.5, 1.0, 2.0]))
    rolls = [np.arcsin(from_quaternion(q)[2, 1]) for q in found["q_WB"].to_numpy()[1:, 0]]
    assert rolls == pytest.approx([0.1056094344262, -0.0412938697178, 0.0561808086960], abs=1e-12)


@pytest.mark.nightly
def test_small_motions_of_a_bicycle_have_the_published_roots() -> None:
    """At 5 m/s a lean of 1e-4 rad/s is a sum of the four published exponentials."""
    times = np.linspace(0.0, 1.0, 41)
    found = truth(load_scene("bicycle", speed=5.0, rate=1e-4), times)
    motion = np.column_stack([np.exp(root * times) for root in ROOTS])
    steer = found["q.steer"].to_numpy()
    left = steer - motion @ np.linalg.lstsq(motion, steer.astype(complex), rcond=None)[0]
    assert np.abs(left).max() < 1e-8 * np.abs(steer).max()


# Of Bricard's ring as IFToMM's problem A04 has it: axes of its hinges and its rods, of 1 m and 1 kg, at the start.
HINGES = np.array([[0, -1, 0], [0, 0, -1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]])
RODS = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1], [-1, 0, 0], [0, 1, 0]])
THICK, SLENDER, G = 1 / 600, 1 / 12 + 1 / 1200, 9.81


def ring(even: Any, odd: Any) -> tuple[tuple[Any, Any], Any, Any, Any]:
    """Rates of hinges at unit speed, twice its kinetic energy, potential energy, and the end of the third rod.

    Hinges turn by two angles in turn, with sin a + sin b = sin a sin b; angles may be complex.
    """
    rates = ((np.sin(even) - 1) * np.cos(odd), (1 - np.sin(odd)) * np.cos(even))
    R, origin, velocity, spin = np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3)
    twice, potential, ends = 0.0, 0.0, []
    for number, (axis, rod) in enumerate(zip(HINGES, RODS, strict=True)):
        angle = (even, odd)[number % 2]
        spin = spin + R @ axis * rates[number % 2]
        K = -np.cross(np.eye(3), axis)
        R = R @ (np.eye(3) + np.sin(angle) * K.T + (1 - np.cos(angle)) * K @ K)
        way, local = R @ rod, R.T @ spin
        centre = velocity + np.cross(spin, way / 2)
        twice = twice + centre @ centre + local @ (np.where(rod != 0, THICK, SLENDER) * local)
        potential = potential + G * (origin + way / 2)[1]
        origin, velocity = origin + way, velocity + np.cross(spin, way)
        ends.append(origin)
    return rates, twice, potential, ends[2]


def ring_rates(_: float, state: Any) -> list[float]:
    """Rates of both angles and of the speed along their curve, by Lagrange's equation with complex steps."""
    even, odd, speed = state
    (p, q), inertia, *_ = ring(even, odd)
    _, inertias, potentials, _ = ring(even + 1e-30j * p, odd + 1e-30j * q)
    slopes = np.imag([inertias, potentials]) / 1e-30
    return [p * speed, q * speed, -(slopes[1] + slopes[0] * speed**2 / 2) / inertia]


@pytest.mark.nightly
def test_a_ring_of_six_rods_follows_one_coordinate() -> None:
    """Problem A04 to 10 s: published places of the ring are those of its closed form in one coordinate."""
    (entry,) = tables()["bricard"]
    found = solve_ivp(ring_rates, (0, entry.times[-1]), [0, 0, 0], method="DOP853", rtol=1e-12, atol=1e-12,
                      t_eval=entry.times)  # fmt: skip
    places = np.array([ring(even, odd)[3] for even, odd, _ in found.y.T])
    published = np.stack([entry.values[f"P3.{axis}"] for axis in "xyz"], axis=1)
    assert np.abs(places - published).max() < 1e-10
