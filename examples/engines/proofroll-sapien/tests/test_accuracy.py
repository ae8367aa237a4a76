"""Accuracy as README.md states it, against the truths of the scenes in figures that two routes agree on."""

import numpy as np
import pytest
from proofroll_sapien import Sapien, SapienSettings
from sapien import physx

import proofroll


def at_end(scene, formulation, t, dt=1e-3):
    engine = Sapien.build(proofroll.load_scene(scene), SapienSettings(formulation, dt=dt))
    engine.advance(t)
    return engine.sample()


def rest(formulation, dt):
    """Distance of the place where a sled on three feet rests from its true place of rest [m]."""
    return float(np.linalg.norm(at_end("sled", formulation, 0.7, dt).p_WB[0, :2] - [0.458107051786, 0.048503949880]))


@pytest.mark.parametrize(("formulation", "least", "most"), [("tgs", 4e-3, 8e-3), ("pgs", 0.07, 0.09)])
def test_a_sled_on_three_feet_has_another_limit(formulation, least, most):
    """A tenth of the step leaves the sled as far aside: friction, not the step, leads it there."""
    coarse, fine = rest(formulation, 1e-3), rest(formulation, 1e-4)
    assert least < coarse < most
    assert least < fine < most  # a law of first order would leave a tenth


@pytest.mark.parametrize(("formulation", "least", "most"), [("tgs", 3e-3, 2e-2), ("pgs", 0.2, 0.35)])
def test_an_eccentric_sphere_is_led_aside(formulation, least, most):
    """A sphere with unlike moments slides a centimetre aside with a cone, a quarter of a metre with a pyramid."""
    found = at_end("eccentric_sphere", formulation, 2.0).p_WB[0]
    assert least < np.linalg.norm(found - [0.612566071, -0.883584839, 0.1]) < most


def test_a_rod_slips_in_its_plane_as_coulomb_says():
    """Along a line its friction is Coulomb's: the rod's mass is a millimetre off its true place before it lies flat."""
    found = at_end("falling_rod", "tgs", 0.93).p_WB[0]
    assert np.linalg.norm(found - [0.553902610, 0.0, 0.032956240]) < 3e-3


@pytest.mark.parametrize(("formulation", "bound"), [("tgs", 1e-2), ("pgs", 3e-2)])
def test_a_ball_with_spin_bounces(formulation, bound):
    """Rebounds with friction come near the closed form: two impacts that slide, and one that sticks."""
    found = at_end("spinning_bounce", formulation, 1.5)
    assert np.linalg.norm(found.p_WB[0] - [0.509272146943, 0.126622625715, 0.134211784211]) < bound


def test_contact_forces_have_their_normal_part_alone():
    """Normal forces of three feet carry the sled; friction is unknown, and not zero."""
    force = at_end("sled", "tgs", 0.1).contact_force
    assert force[:, 2].sum() == pytest.approx(2 * 9.81, rel=1e-3)
    assert np.isnan(force[:, :2]).all()


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        ("rattleback", "contact of ellipsoids"),
        ("free_turntable", "not joined"),
        ("double_pendulum", "not joined"),
    ],
)
def test_what_it_has_not_is_refused_with_the_reason(scene, reason):
    """Other shapes, planes that move and joints are refused before anything moves."""
    with pytest.raises(proofroll.Refused, match=reason):
        proofroll.simulate(proofroll.load_scene(scene), Sapien, until=0.1, every=0.1)


def test_options_of_scenes_are_put_back():
    """Options of scenes, which are global in SAPIEN, are the same before and after a build that has its own."""
    before = physx.get_scene_config()
    at_end("sled", "pgs", 1e-3)
    after = physx.get_scene_config()
    assert (after.bounce_threshold, after.enable_tgs) == (before.bounce_threshold, before.enable_tgs) == (2.0, True)
    assert list(after.gravity) == list(before.gravity)
