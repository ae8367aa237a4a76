"""Truths of bodies that touch which cost too much for every run of the tests, over held-out parameters."""

from __future__ import annotations

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.files.scene_file import read_scene_file
from proofroll.truth.switched_truth import truth_of

# m, s, N and the like: what two routes may leave of a scene; 1e-11 is seen.
KNOWN = 1e-9
# Scene and end [s], as far as a few seconds reach; and how often an event is seen until then, where the scene has any.
ENDS = {
    "two_spheres": (0.15, 1), "falling_rod": (0.27, 2), "rocking_block": (0.6, 4), "sled": (0.4, 3),
    "ladder": (1.06, 1), "eccentric_sphere": (0.08, 1), "free_turntable": (0.2, 0), "tilted_disc": (0.15, 0),
    "sled_on_slope": (0.12, 1), "rattleback": (0.1, 0), "flick": (0.4, 3),
}  # fmt: skip
# Starts and sizes in which the events come soon; so slow, most level sleds come to rest with all feet at once.
SOON = {
    "sled": {"speed": 0.6, "cross_speed": 0.12, "spin": 2.4},
    "falling_rod": {"half": 0.05, "foot": 0.002},
    "eccentric_sphere": {"speed": 0.15, "cross_speed": 0.04, "spin": 2.0},
    "sled_on_slope": {"speed": 0.05, "cross_speed": 0.1, "spin": 0.8},
}


def held_out(name: str, seed: int) -> dict[str, float]:
    """Parameters of a scene, each up to 15 % off its own value, or off that of an early event."""
    random = np.random.default_rng([seed, *name.encode()])
    own = {key: item.value for key, item in read_scene_file(name).parameters.items()} | SOON.get(name, {})
    return {key: value * random.uniform(0.85, 1.15) for key, value in own.items()}


@pytest.mark.drill
@pytest.mark.nightly
@pytest.mark.timeout(900)  # 30 s of processor time, on a machine that may have much else to do
def test_a_rattleback_reverses_its_spin() -> None:
    """Two routes of a stone that rolls agree until its spin has turned round, and it keeps its energy."""
    mechanism = mechanism_named("rattleback")
    found = truth_of(mechanism, np.array([0.0, 0.69, 0.71]))
    assert np.isinf(found.horizon)
    assert max(float(bar[-1]) for bar in found.bars.values()) < KNOWN
    assert found.events == ()
    start, before, after = found.record.w_WB[:, 0, 2]
    assert start < before < 0 < after  # it reverses at 0.70 s
    energy = found.record.placed(mechanism).energy()
    assert energy == pytest.approx(energy[0], abs=1e-10)


@pytest.mark.drill
@pytest.mark.parametrize(("name", "seed"), [(name, place % 3) for place, name in enumerate(ENDS)])
def test_two_routes_agree_over_held_out_parameters(name: str, seed: int) -> None:
    """Another mass, friction, speed and size each: both routes see the same events, and differ by round-off alone."""
    mechanism = mechanism_named(name, **held_out(name, seed))
    end, events = ENDS[name]
    found = truth_of(mechanism, np.array([0.0, end / 2, end]))
    assert np.isinf(found.horizon)
    assert max(float(bar[-1]) for bar in found.bars.values()) < KNOWN
    assert len(found.events) >= events
    assert all(event.time_high - event.time_low < KNOWN for event in found.events)


def bounced(height: float, radius: float, mu: float, e: float, g: float, until: float) -> list[np.ndarray]:
    """Place, velocity and spin of a thrown ball by formulas of its own: flights, and impacts that slide or stick."""
    p, v, w = np.array([0.0, 0.0, height]), np.array([1.0, 0.2, 0.0]), np.array([10.0, -60.0, 15.0])
    time, up = 0.0, np.array([0.0, 0.0, 1.0])
    while True:
        flight = (v[2] + np.sqrt(v[2] ** 2 + 2 * g * (p[2] - radius))) / g
        span = min(flight, until - time)
        p, v = p + span * v - g * span**2 / 2 * up, v - g * span * up
        time += span
        if span < flight:
            return [p, v, w]
        slip = (v - radius * np.cross(w, up)) * [1, 1, 0]
        pressed = -(1 + e) * v[2]
        rubbed = min(mu * pressed, 2 / 7 * float(np.linalg.norm(slip)))  # per mass; 2/7 is left of a slip that sticks
        push = -rubbed * slip / np.linalg.norm(slip) if rubbed else np.zeros(3)
        v, w = v + push + pressed * up, w + np.cross(-radius * up, push) / (0.4 * radius**2)


@pytest.mark.drill
@pytest.mark.parametrize("seed", [0, 3])  # one that bounces little, and one much
def test_a_thrown_ball_lies_where_formulas_say(seed: int) -> None:
    """Over held-out parameters a ball that bounces is, within its own bars, where flights and impacts put it."""
    numbers = held_out("spinning_bounce", seed) | {"restitution": 0.55 + 0.1 * seed}
    mechanism = mechanism_named("spinning_bounce", **numbers)
    found = truth_of(mechanism, np.array([0.0, 0.8]))
    keys = ("height", "radius", "friction", "restitution", "gravity")
    for field, exact in zip(("p_WB", "v_WB", "w_WB"), bounced(*(numbers[key] for key in keys), 0.8), strict=True):
        off = np.abs(getattr(found.record, field)[-1, 0] - exact).max()
        assert off <= found.bars[field][-1] < KNOWN, field
