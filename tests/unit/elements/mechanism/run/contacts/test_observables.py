"""Coulomb's law held against the forces that a run reports."""

from __future__ import annotations

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.arrays import FloatArray
from proofroll.core.truth import truth
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts import observables
from proofroll.elements.mechanism.run.contacts.observables import RESIDUALS, Followed, follow_contacts, residuals
from proofroll.files.scene_file import load_scene

MU = 0.5
UP = np.array([0.0, 0.0, 1.0])


def left(force: list[float], slide: list[float], gap: float = 0.0, static: float = MU) -> dict[str, float]:
    """Residuals of a contact on a floor at two equal samples, with a weight of 10 N and a speed of 1 m/s."""
    normal, moving = np.broadcast_to(UP, (2, 1, 3)), np.broadcast_to(slide, (2, 1, 3))
    slip = np.linalg.norm(moving[..., :2], axis=-1)
    found = Followed(np.full((2, 1), gap), slip, normal, moving, np.zeros_like(normal))
    values = residuals(found, np.broadcast_to(force, (2, 1, 3)), np.array([MU]), 10.0, 1.0, np.array([static]))
    return {name: float(value[1, 0]) for name, value in values.items()}


@pytest.mark.parametrize(
    ("force", "slide"),
    [
        ([-3.0, -4.0, 10.0], [0.3, 0.4, 0.0]),
        ([1.0, 2.0, 10.0], [0.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.0], [1.0, 0.0, 2.0]),
        ([-2.5e-6, 0.0, 5e-6], [0.1, 0.0, 0.0]),  # shortly before it opens
    ],
)
def test_what_slides_sticks_or_is_open_leaves_nothing(force: list[float], slide: list[float]) -> None:
    """Friction against a slip at its bound, less of it without a slip, and no force at all keep Coulomb's law."""
    found = left(force, slide)
    assert found.pop("unpressed") == float(force[2] < 1e-5)
    assert found == pytest.approx(dict.fromkeys(found, 0.0), abs=1e-12)


@pytest.mark.parametrize("slip", [0.0, 1e-4, 1e-3, 0.1])
def test_a_slip_that_begins_has_kinetic_friction(slip: float) -> None:
    """However slow a slip is, friction at its kinetic bound leaves nothing; friction between the two bounds does."""
    found = left([-5.0, 0.0, 10.0], [slip, 0.0, 0.0], static=1.2 * MU)
    assert found == pytest.approx(dict.fromkeys(found, 0.0), abs=1e-12)
    assert (left([-5.5, 0.0, 10.0], [slip, 0.0, 0.0], static=1.2 * MU)["natural_map"] > 1e-12) == (slip > 0)


def test_each_fault_shows_in_its_residual() -> None:
    """A force that pulls, friction beyond its bound, aside or too small, overlap, and a hop: each has its own size."""
    assert left([0, 0, -2.0], [0, 0, 0])["contact_pull"] == pytest.approx(2.0)
    assert left([-6.0, 0, 10.0], [1.0, 0, 0])["cone_excess"] == pytest.approx(1.0)
    assert left([0, 5.0, 10.0], [1.0, 0, 0])["friction_direction"] == pytest.approx(1.0)
    assert left([-4.0, 0, 10.0], [1.0, 0, 0])["friction_direction"] == pytest.approx(0.2)
    assert left([0, 0, 1.0], [0, 0, 0], gap=-1e-3)["penetration"] == pytest.approx(1e-3)


def test_a_hop_shows_where_cone_and_direction_are_kept() -> None:
    """A convex cone lets what slides rise at μ|u|: only the speed along the normal and the natural map tell."""
    hop = left([-5.0, 0, 10.0], [1.0, 0, MU])
    assert hop["cone_excess"] == pytest.approx(0.0)
    assert hop["friction_direction"] == pytest.approx(0.0)
    assert hop["hop_speed"] == pytest.approx(MU)
    assert hop["natural_map"] > 1.0


@pytest.mark.drill
def test_the_truth_leaves_nothing_and_says_normal_forces_at_rest() -> None:
    """A sled that slides and one that stands keep the law; where the split of friction is not known, N is."""
    moving = load_scene("sled")
    still = load_scene("sled", speed=0.0, cross_speed=0.0, spin=0.0)
    for scene in (moving, still):
        found = truth(scene, np.array([0.0, 1e-3, 2e-3]))
        for name, _, _ in RESIDUALS:
            assert np.abs(found[name].to_numpy()).max() < 1e-9, name
        normal: FloatArray = found["normal_forces"].to_numpy()
        assert normal.sum(axis=1) == pytest.approx(2 * 9.81, abs=0.2)
        assert np.all(found["unpressed"].to_numpy() == 0)


@pytest.mark.parametrize(
    ("scene", "passive", "closed"), [("cradle", True, True), ("sled", True, False), ("pendulum", False, False)]
)
def test_laws_that_no_impact_breaks_are_judged_where_they_hold(scene: str, passive: bool, closed: bool) -> None:
    """Energy does not grow where nothing drives, and momentum stays where bodies touch each other alone."""
    names = {item.name for item in load_scene(scene).elements[0].observables}
    assert ("energy_gain" in names) == passive
    assert ({"momentum_error", "angular_momentum_error"} <= names) == closed


def test_events_and_columns_of_a_run_see_each_contact_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """States that were followed before are not followed again, among others and with the other sign of quaternions."""
    mechanism, rng, seen = mechanism_named("sled"), np.random.default_rng(0), 0
    touch = observables.touch

    def counted(*arguments: object) -> object:
        nonlocal seen
        seen += 1
        return touch(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(observables, "touch", counted)
    q = rng.normal(size=(6, 1, 4))
    motion = [*rng.normal(size=(3, 6, 1, 3)), q / np.linalg.norm(q, axis=-1, keepdims=True)]
    times = np.arange(6.0)
    first = follow_contacts(Placed(mechanism, times[:4], *(values[:4] for values in motion)))
    assert seen == 4 * 3
    again = follow_contacts(Placed(mechanism, times, *motion[:3], -motion[3]))
    assert seen == 6 * 3
    assert all(np.array_equal(values[:4], before) for values, before in zip(again, first, strict=True))
    other = mechanism_named("sled", friction=0.2)
    follow_contacts(Placed(other, times, *motion))
    assert seen == 12 * 3
