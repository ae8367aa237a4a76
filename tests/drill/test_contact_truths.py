"""Truths of bodies that touch which cost too much for every run of the tests, over held-out parameters."""

from __future__ import annotations

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.files.scene_file import read_scene_file
from proofroll.truth.truth_of_mechanism import truth_of

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


@pytest.mark.nightly
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
