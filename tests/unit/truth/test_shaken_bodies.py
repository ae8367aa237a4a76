"""Cylinders and boxes whose corners all begin to slip, turn and stick at once, in worlds with any axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from turned_scenes import turned_mechanism

from proofroll.elements.mechanism import Body, Force, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.truth_of_mechanism import truth_of

_G = 9.81
_SEEDS = [pytest.param(0, marks=pytest.mark.drill), *(pytest.param(k, marks=pytest.mark.nightly) for k in range(1, 6))]


def _turned(mechanism: Mechanism, seed: int) -> tuple[Mechanism, np.ndarray]:
    """The mechanism in a random world, and the direction of its x there."""
    random = np.random.default_rng([20261129, seed])
    rpy = tuple(random.uniform(-3.0, 3.0, 3).tolist())
    turned = turned_mechanism(mechanism, rpy, tuple(random.uniform(-2.0, 2.0, 3).tolist()))
    level = turned_mechanism(replace(mechanism, gravity=(1.0, 0.0, 0.0)), rpy, (0.0, 0.0, 0.0))
    return turned, np.array(level.gravity)


@pytest.mark.nightly_of("0")
@pytest.mark.parametrize("seed", _SEEDS)
def test_a_can_on_a_shaken_plate_slips_and_sticks(seed: int) -> None:
    """It slips where the plate brakes harder than friction can, and sticks where the plate has its speed again."""
    random = np.random.default_rng([1, seed])
    way, rate, mu = random.uniform(0.05, 0.053), random.uniform(9.9, 10.2), random.uniform(0.46, 0.5)
    shake = Joint("shake", "prismatic", "world", "plate", axis=(1, 0, 0), motion=Formula(f"{way!r}*sin({rate!r}*t)"))
    free = Joint("float", "free", "world", "can", q0=(0, 0, 0.05, 1, 0, 0, 0), v0=(way * rate, 0, 0, 0, 0, 0))
    plate, can = Body("plate", 50.0, inertia=(10, 10, 20)), Body("can", 2.0, inertia=(0.01, 0.01, 0.01))
    shapes = (
        Geometry("ground", "plate", "plane"),
        Geometry("shape", "can", "cylinder", radius=0.1, length=0.1),
    )
    pairs = (Pair("touch", ("shape", "ground"), friction=mu),)
    mechanism = Mechanism((plate, can), (shake, free), gravity=(0, 0, -_G), geometries=shapes, pairs=pairs)
    slip = np.arcsin(mu * _G / (way * rate**2)) / rate

    def ahead(time: float) -> float:
        return way * rate * (np.cos(rate * slip) - np.cos(rate * time)) - mu * _G * (time - slip)

    stick = brentq(ahead, slip + 0.01, 0.3, xtol=1e-15)
    slid = way * rate * np.cos(rate * slip) * (stick - slip) - mu * _G * (stick - slip) ** 2 / 2
    apart = way * np.sin(rate * slip) + slid - way * np.sin(rate * stick)
    turned, x = _turned(mechanism, seed)
    found = truth_of(turned, np.array([0.0, 0.4]))
    assert found.ended == ""
    assert [event.kind for event in found.events] == ["slip", "stick"]
    assert [event.time for event in found.events] == pytest.approx([slip, stick], abs=1e-11)
    moved = (found.record.p_WB[1, 1] - found.record.p_WB[0, 1]) @ x
    assert moved == pytest.approx(way * np.sin(rate * 0.4) + apart, abs=1e-11)


@pytest.mark.nightly_of("0")
@pytest.mark.parametrize("seed", _SEEDS)
def test_a_box_that_is_pushed_to_and_fro_on_a_slope_turns(seed: int) -> None:
    """All four corners slip, turn where the box stops under a push beyond friction, stick, and slip again.

    Times and places are those of a block on a slope (by hand).
    """
    slope = np.deg2rad(10.0)
    block = Body("block", 5.0, inertia=(0.1, 0.1, 0.1))
    free = Joint("float", "free", "world", "block", q0=(0, 0, 0.1, 1, 0, 0, 0))
    push = Force("push", "block", "force", (Formula("40*sin(12*t)"), 0.0, 0.0), position=(0, 0, -0.1))
    shapes = (Geometry("ground", "world", "plane"), Geometry("shape", "block", "box", size=(0.6, 0.6, 0.2)))
    pairs = (Pair("touch", ("shape", "ground"), friction=0.4),)
    gravity = (_G * np.sin(slope), 0.0, -_G * np.cos(slope))
    mechanism = Mechanism((block,), (free,), gravity=gravity, geometries=shapes, pairs=pairs, forces=(push,))
    turned, x = _turned(mechanism, seed)
    times = np.array([0.0, 0.377132825134, 0.518914166645, 0.6])
    found = truth_of(turned, times)
    assert found.ended == ""
    known = {"slip": 0.0227924569391, "turn": 0.377132825134, "stick": 0.518914166645, "slip again": 0.546391232537}
    assert [event.kind for event in found.events] == [kind.split()[0] for kind in known for _ in range(4)]
    assert [event.time for event in found.events] == pytest.approx(
        [t for t in known.values() for _ in range(4)], abs=1e-11
    )
    places = (found.record.p_WB[:, 0] - found.record.p_WB[0, 0]) @ x
    assert places == pytest.approx([0.0, 0.161383481437, 0.148324793832, 0.150543975802], abs=1e-11)
