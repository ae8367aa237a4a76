"""Accuracy as README.md states it."""

import numpy as np
import pytest

import proofroll


def error(scene, engine, name, until, **settings):
    loaded = proofroll.load_scene(scene)
    true, found = (
        proofroll.simulate(loaded, text, until=until, every=until / 10, **more)[name].to_numpy()
        for text, more in (("truth", {}), (engine, settings))
    )
    return float(np.max(np.abs(found - true)[1:]))


def test_terms_are_exact():
    """A ball on Drake's mass matrix, bias and Jacobian rolls as it should to round-off."""
    assert error("sphere_in_cylinder", "drake[formulation=terms]", "z", 0.2) < 1e-13


@pytest.mark.parametrize(("scene", "until"), [("gyroscope_cart", 0.2), ("heavy_top", 0.2), ("free_body", 0.5)])
def test_continuous_plants_follow_the_truth_with_their_reactions(scene, until):
    """Universal, ball and free joints, springs and reactions are the truth's to the tolerance of integration."""
    assert error(scene, "drake[formulation=continuous]", "positions", until) < 1e-7
    assert error(scene, "drake[formulation=continuous]", "forces", until) < 1e-5


@pytest.mark.parametrize(("scene", "until"), [("slider_crank", 0.2), ("bricard", 0.2)])
def test_loops_of_discrete_plants_are_of_first_order(scene, until):
    """A tenth of the step leaves a tenth of the error, in a plane and in space."""
    coarse, fine = (
        error(scene, "drake[formulation=discrete]", "positions", until, dt=dt) for dt in (until / 100, until / 1000)
    )
    assert coarse / fine == pytest.approx(10, rel=0.15)


def rest(contact, dt):
    """Distance of the place where a sled on three feet ends from its true place of rest [m]."""
    found = proofroll.simulate(
        proofroll.load_scene("sled"), "drake[formulation=contact]", until=0.7, every=0.35, dt=dt, contact=contact
    )
    return float(np.linalg.norm(found["p_WB"].to_numpy()[-1, 0, :2] - [0.458107051786, 0.048503949880]))


@pytest.mark.parametrize("contact", ["tamsi", "lagged"])
def test_a_sled_rests_where_coulomb_says(contact):
    """TAMSI and the lagged solver come to the true place of rest in proportion to the step."""
    coarse, fine = rest(contact, 1e-3), rest(contact, 1e-4)
    assert coarse < 9e-4
    assert coarse / fine == pytest.approx(10, rel=0.1)


def test_a_convex_cone_has_another_limit():
    """SAP, whose cone is convex, leaves the sled a centimetre off."""
    assert 5e-3 < rest("sap", 1e-3) < 2e-2


def test_rebounds_and_corners_are_refused():
    """Points of contact only dissipate, need a radius, and have one law for all pairs."""
    refused = (("spinning_bounce", "only dissipate"), ("rocking_block", "radius"), ("ladder", "laws of their own"))
    for scene, reason in refused:
        with pytest.raises(proofroll.Refused, match=reason):
            proofroll.simulate(proofroll.load_scene(scene), "drake[formulation=contact]", until=0.1, every=0.1)


def test_a_continuous_plant_has_no_loops():
    """Loops, which Drake has for discrete plants alone, are refused, with the way out."""
    with pytest.raises(proofroll.Refused, match="take formulation=discrete"):
        proofroll.simulate(proofroll.load_scene("bricard"), "drake[formulation=continuous]", until=0.1, every=0.1)
