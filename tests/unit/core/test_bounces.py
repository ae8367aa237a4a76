"""Energy and height of bounces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from proofroll.core.arrays import FloatArray
from proofroll.core.bounces import Bounce, Course, bounces_along, bounces_of, exact_bounces
from proofroll.core.columns import Columns
from proofroll.core.events import Event
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.contacts.events import ContactWatch
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

_G, _DROP, _E = 9.81, 1.0, 0.8


def _ball(times: FloatArray) -> Course:
    """A point of 1 kg that falls 1 m and bounces with e = 0.8 three times; its samples may lie at any time."""
    falls = float(np.sqrt(2 * _DROP / _G))
    hits = falls + np.cumsum([0.0, *(2 * falls * _E**k for k in (1, 2))])
    height, climb = np.zeros(len(times)), np.zeros(len(times))
    for k, t in enumerate(times):
        n = int(np.sum(hits <= t))
        start, speed, high = (0.0, 0.0, _DROP) if n == 0 else (hits[n - 1], _G * falls * _E**n, 0.0)
        height[k] = high + speed * (t - start) - _G * (t - start) ** 2 / 2
        climb[k] = speed - _G * (t - start)
    return Course(times, _G * height + climb**2 / 2, height[:, None], climb[:, None])


_FALL = float(np.sqrt(2 * _DROP / _G))
_HITS = (_FALL, _FALL * (1 + 2 * _E), _FALL * (1 + 2 * _E + 2 * _E**2))


def test_heights_between_samples_are_those_of_parabolas() -> None:
    """Of a ball that falls freely any samples give the height of each bounce, and energies beside it."""
    times = np.linspace(0.0, 2.2, 45)
    brackets = [(times[times < hit][-1], times[times > hit][0]) for hit in _HITS]
    events = [Event("impact", hit, low, high, "c") for hit, (low, high) in zip(_HITS, brackets, strict=True)]
    found = bounces_along(_ball(times), events, {"c": 0})
    np.testing.assert_allclose([item.height for item in found[:2]], [_E**2, _E**4], rtol=1e-12)
    np.testing.assert_allclose([item.energy_before / _G for item in found], [1, _E**2, _E**4], rtol=1e-12)
    np.testing.assert_allclose([item.energy_after / _G for item in found], [_E**2, _E**4, _E**6], rtol=1e-12)
    assert found[2].height == pytest.approx(_E**6, rel=1e-12)
    early = bounces_along(_ball(times[times < 1.3]), events[:2], {"c": 0})
    assert np.isnan(early[1].height)  # its apex lies behind the end


def test_the_height_of_what_is_pulled_unevenly_is_exact() -> None:
    """The first apex of a centre of mass that swings while it rises, by the closed form: the pull changes beside it."""

    def swinging(times: FloatArray) -> Course:
        height = 0.3 * times - 2 * times**2 + 2e-3 * (np.cos(40 * times) - 1)
        climb = 0.3 - 4 * times - 0.08 * np.sin(40 * times)
        return Course(times, np.zeros(len(times)), height[:, None], climb[:, None])

    hit, crest = 1e-3, brentq(lambda t: 0.3 - 4 * t - 0.08 * np.sin(40 * t), 1e-3, 0.1, xtol=1e-16)
    (found,) = exact_bounces(swinging, [Event("impact", hit, hit, hit, "c")], {"c": 0}, 0.12)
    beside = swinging(np.array([hit, crest])).height[:, 0]
    assert found.height == pytest.approx(beside[1] - beside[0], abs=1e-15)  # some hundred times the round-off of 7 mm


def test_a_motion_that_can_be_sampled_anywhere_gives_exact_bounces() -> None:
    """Bounces of a motion at any times are those of the closed form, without samples of its own."""
    events = [Event("impact", hit, hit - 1e-9, hit + 1e-9, "c") for hit in _HITS]
    found = exact_bounces(_ball, events, {"c": 0}, 2.2)
    np.testing.assert_allclose([item.height for item in found], [_E**2, _E**4, _E**6], rtol=1e-13)
    np.testing.assert_allclose([item.energy_before / _G for item in found], [1, _E**2, _E**4], rtol=1e-13)
    assert all(np.isnan(item.height) for item in exact_bounces(_ball, events, {}, 2.2))


def _within_bars(found: list[Bounce] | None, heights: list[float], energies: list[float]) -> None:
    assert found is not None
    for item, height, energy in zip(found, heights, energies, strict=False):
        assert item.height_bar is not None
        assert item.energy_bar is not None
        assert item.height_bar < 1e-11
        assert abs(item.height - height) <= item.height_bar
        assert abs(item.energy_before - item.energy_after - energy) <= 2 * item.energy_bar


@pytest.mark.drill
def test_the_truth_of_a_ball_tells_its_bounces() -> None:
    """A ball dropped from 1 m with e = 0.8 rises to 0.64 and 0.4096 m, and loses 1 - e² of its energy each time."""
    found = bounces_of(truth(load_scene("bouncing_ball"), np.linspace(0.0, 1.7, 18)))
    lost = 0.36 * 0.517 * _G * 1.0
    _within_bars(found, [0.64, 0.4096], [lost, 0.64 * lost])


@pytest.mark.nightly
def test_the_last_rebound_before_a_rest_has_its_height() -> None:
    """Each height is e² of the one before, up to the last impact, whose next rebounds are summed."""
    bounces = bounces_of(truth(load_scene("bouncing_ball"), np.linspace(0.0, 4.1, 3)))
    assert bounces is not None
    heights = np.array([item.height for item in bounces])
    assert len(heights) > 50
    bar = bounces[0].height_bar
    assert bar is not None
    assert np.abs(heights - 0.64 ** np.arange(1, len(heights) + 1)).max() < bar < 1e-13


def _box() -> Scene:
    """A box of 2 kg whose bottom is 0.5 m above a floor."""
    free = Joint("free", "free", "world", "box", q0=(0, 0, 0.55, 1, 0, 0, 0))
    shapes = (Geometry("floor", "world", "plane"), Geometry("shape", "box", "box", size=(0.4, 0.2, 0.1)))
    pairs = (Pair("touch", ("shape", "floor"), friction=0.3, restitution=0.5),)
    bodies = (Body("box", 2.0, inertia=((0.01, 0, 0), (0, 0.02, 0), (0, 0, 0.03))),)
    return Scene("box", "", (MechanismElement(Mechanism(bodies, (free,), geometries=shapes, pairs=pairs)),))


@pytest.mark.drill
def test_a_box_that_lands_flat_bounces_as_one() -> None:
    """The corners of a box that lands flat share the time, energies and height of its bounce: e² of its fall."""
    found = bounces_of(truth(_box(), np.linspace(0.0, 0.6, 7)))
    assert found is not None
    assert len(found) == 4
    _within_bars(found, [0.125] * 4, [0.75 * 2 * _G * 0.5] * 4)
    assert len({replace(item, name="") for item in found}) == 1


@pytest.mark.drill
def test_an_engine_has_bounces_by_its_samples() -> None:
    """Energies and heights of an engine's run follow from its samples, near those of the truth."""
    scene = load_scene("spinning_bounce")
    run, true = (simulate(scene, engine, until=1.0) for engine in ("pinocchio", "truth"))
    element = scene.elements[0]
    assert isinstance(element, MechanismElement)
    found, known = ContactWatch(element).bounces(Columns.of(run)), bounces_of(true)
    assert known is not None
    assert len(found) == len(known) == 2
    np.testing.assert_allclose([item.height for item in found[:1]], [item.height for item in known[:1]], rtol=0.03)
    np.testing.assert_allclose([b.energy_after for b in found], [b.energy_after for b in known], rtol=0.03)
