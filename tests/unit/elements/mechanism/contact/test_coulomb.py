"""Coulomb's law at several contacts, held against the law itself: no solver is trusted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proofroll.core.errors import NotUnique, Refused
from proofroll.elements.mechanism.contact.coulomb import contact_forces, robust_forces

SMALL = 1e-9  # of the loads: where the sweeps end


def obeys(G: np.ndarray, c: np.ndarray, f: np.ndarray, friction: np.ndarray) -> None:
    """Checks nonpenetration, the cone, and that friction is against what slides, for each contact."""
    w = (c + G @ f.ravel()).reshape(-1, 3)
    least_f, least_w = SMALL * np.abs(f).max(initial=1.0), SMALL * np.abs(c).max()
    for force, slide, mu in zip(f, w, friction, strict=True):
        assert force[0] >= 0
        assert slide[0] >= -least_w
        assert min(force[0] / max(np.abs(f).max(), 1.0), slide[0] / np.abs(c).max()) <= SMALL
        held, speed = float(np.linalg.norm(force[1:])), float(np.linalg.norm(slide[1:]))
        assert held <= mu * force[0] + least_f
        if force[0] > least_f and speed > 1e-6 * np.abs(c).max():
            assert force[1:] == pytest.approx(-mu * force[0] * slide[1:] / speed, abs=1e-6 * np.abs(f).max())


@pytest.mark.drill
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), mu=st.floats(0.01, 0.6), count=st.integers(1, 3))
def test_the_forces_obey_coulomb(seed: int, mu: float, count: int) -> None:
    """Whatever is loaded and however the contacts feel each other, no contact breaks its law."""
    rng = np.random.default_rng(seed)
    size = 3 * count
    mixed = rng.normal(size=(size, size))
    G = np.eye(size) + 0.15 * mixed @ mixed.T / size  # couplings for which any friction up to 0.6 is well-posed
    c = rng.normal(size=size)
    friction = np.full(count, mu)
    f, done = contact_forces(G, c, friction, [None] * count, ["c"] * count)
    obeys(G, c, f, friction)
    assert [kind == "open" for kind in done] == [force[0] == 0 for force in f]


def test_what_slides_keeps_its_direction() -> None:
    """A contact that slides is pressed by what its load needs, friction against its slip, whatever the loads along."""
    G, t = np.diag([2.0, 1.0, 1.0]), np.array([0.6, 0.8])
    f, done = contact_forces(G, np.array([-4.0, 50.0, 0.0]), np.array([0.3]), [t], ["c"])
    assert done == ["slip"]
    assert f[0] == pytest.approx([2.0, -0.36, -0.48])


def test_a_contact_that_a_hinge_turns_rebounds_by_newtons_law() -> None:
    """Where one velocity moves a contact along its normal and along its surface, none of them sticks in a rebound."""
    way, law = np.array([1.0, 0.05, 0.0]), 0.7
    c = -way - np.array([law, 0.0, 0.0])
    f, done = contact_forces(np.outer(way, way), c, np.array([0.3]), [None], ["tip"])
    assert done == ["slip"]
    assert way @ f[0] == pytest.approx(1 + law, abs=1e-12)
    obeys(np.outer(way, way), c, f, np.array([0.3]))


def test_friction_that_tears_is_told() -> None:
    """Where friction lifts more than the normal force presses, there is no unique answer."""
    G = np.array([[1.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    told = r"^foot would not press but tear from t = 0\.5 s on: with its friction .*\(Painlevé\)$"
    with pytest.raises(NotUnique, match=told):
        contact_forces(G, np.array([-1.0, 0.0, 0.0]), np.array([1.5]), [np.array([1.0, 0.0])], ["foot"], time=0.5)


def test_a_tie_is_no_answer() -> None:
    """A load exactly on the bound of friction may stick or slip; a thousandth beside it, the answer is sure."""
    G, mu = np.eye(3), np.array([0.3])
    assert not robust_forces(G, np.array([-1.0, 0.3, 0.0]), mu, [None], ["c"])[2]
    assert robust_forces(G, np.array([-1.0, 0.2997, 0.0]), mu, [None], ["c"])[1:] == (["stick"], True)
    assert robust_forces(G, np.array([-1.0, 0.3003, 0.0]), mu, [None], ["c"])[1:] == (["slip"], True)


def test_what_two_walls_may_jam_is_no_answer() -> None:
    """A ball between two walls that press it equally, or not at all, may fall or hold: nothing says which."""
    J = np.concatenate([np.eye(3), np.diag([-1.0, 1.0, 1.0])])  # normals against each other
    loads = J @ np.array([0.0, 0.0, -9.81])
    assert not robust_forces(J @ J.T, loads, np.full(2, 0.5), [None] * 2, ["left", "right"])[2]


def test_a_contact_and_joints_that_rub_hold_together_in_any_distribution() -> None:
    """Two coordinates held by a tip and two joints with dry friction rest, though the smallest forces slip."""
    tip = [[-1.05, -0.69], [0.68, 0.49], [0.79, -2.48]]
    J = np.array([*tip, [0.0, 0.0], [1.84, 0.0], [0.0, 0.0], [0.0, 0.0], [-3.13, 3.85], [0.0, 0.0]])
    c, bounds, mu = J @ np.array([0.96, 0.19]), np.array([0.0, 0.05, 0.06]), 0.1
    f, done = contact_forces(J @ J.T, c, np.array([mu, 0.0, 0.0]), [None] * 3, ["tip", "one", "two"], bounds)
    assert done == ["stick"] * 3
    assert np.abs(c + J @ J.T @ f.ravel()).max() < 1e-12
    assert np.linalg.norm(f[0, 1:]) <= mu * f[0, 0]
    assert (np.linalg.norm(f[1:], axis=1) <= bounds[1:]).all()


def test_a_contact_without_a_direction_is_refused() -> None:
    """Where centres of two spheres coincide no direction of their force is defined, which is said in one line."""
    with pytest.raises(Refused, match="contacts a, b at t = 0 s: one of them has no direction"):
        contact_forces(np.full((6, 6), np.nan), np.zeros(6), np.ones(2), [None, None], ["a", "b"])
