"""The truth's orientation, by two quadratures, against rotations that are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll import load_scene, simulate
from proofroll.core.arrays import FloatArray
from proofroll.core.truth import truth
from proofroll.truth.ball_on_surface.orientation import MATRICES, QUATERNIONS, orientation

ASKED = {"asks": ("orientation",)}


def precessing(times: FloatArray) -> FloatArray:
    """Spin of 160 rad/s about an axis that itself turns by 20 rad/s about z, leaning by 0.7 rad."""
    angle = 20 * times
    across, up = np.sin(0.7), np.full_like(times, np.cos(0.7))
    return np.asarray(160 * np.stack([across * np.cos(angle), across * np.sin(angle), up], -1))


@pytest.mark.parametrize("quadrature", [QUATERNIONS, MATRICES])
def test_precession(quadrature: Any) -> None:
    """Seen from the turning axis the spin stands still: the rotation is a product of two, to 1e-11 after 50 turns."""
    times = np.linspace(0, 2, 21)
    found = orientation(precessing, times, (), quadrature)
    still = 160 * np.array([np.sin(0.7), 0, np.cos(0.7)]) - [0, 0, 20]
    expected = Rotation.from_rotvec(times[:, None] * [0, 0, 20]) * Rotation.from_rotvec(times[:, None] * still)
    turned = Rotation.from_quat(np.roll(found, -1, axis=1)) * expected.inv()
    assert np.max(turned.magnitude()) < 1e-11


@pytest.mark.parametrize(
    "parameters",
    [
        pytest.param({}, marks=pytest.mark.drill),
        {"mu_static": 0.15},
        pytest.param({"rolling_resistance": 5e-4, "mu_static": 0.35}, marks=pytest.mark.drill),
        {"rolling_resistance": 5e-4},
    ],
)
def test_both_routes_give_it(parameters: dict[str, float]) -> None:
    """Whoever asks the truth for the orientation gets unit quaternions from the identity on, with an error bar."""
    scene = load_scene("sphere_in_cylinder", **ASKED, **parameters)
    found = simulate(scene, "truth", until=0.5, every=0.05)
    assert found.q_WB[0].to_numpy().tolist() == [1, 0, 0, 0]
    np.testing.assert_allclose(np.linalg.norm(found.q_WB, axis=1), 1, atol=1e-13)
    assert found.q_WB.attrs["error_bar"] < 1e-10
    engine = simulate(scene, "projection", until=0.5, every=0.05)
    apart = np.minimum(*(np.linalg.norm(found.q_WB + sign * engine.q_WB.to_numpy(), axis=1) for sign in (1, -1)))
    assert np.max(apart) < 1e-6


def test_an_error_of_one_quadrature_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error bar holds what one quadrature does wrong."""
    scene = load_scene("sphere_in_cylinder", **ASKED)
    coarse: Any = (np.array([0.5]), lambda h, spin: QUATERNIONS[1](h, np.repeat(spin, 8, axis=1)))
    monkeypatch.setattr("proofroll.truth.ball_on_surface.plug_in.QUATERNIONS", coarse)
    assert truth(scene, np.linspace(0, 1, 11)).q_WB.attrs["error_bar"] > 1e-4


def test_what_nobody_asks_for_is_not_there() -> None:
    """Without asking the truth has no orientation, and asking changes nothing else."""
    times = np.linspace(0, 1, 11)
    plain, asked = (truth(load_scene("sphere_in_cylinder", **more), times) for more in ({}, ASKED))
    assert "q_WB" not in plain
    np.testing.assert_array_equal(plain.p_WB, asked.p_WB)


def test_kinks_are_not_stepped_over() -> None:
    """A spin that slows and stops is integrated to its stop and from there."""

    def stopping(times: FloatArray) -> FloatArray:
        return np.asarray(np.maximum(60 * (0.3 - times), 0.0)[:, None] * [0, 0, 1.0])

    for quadrature in (QUATERNIONS, MATRICES):
        q = orientation(stopping, np.array([0.0, 1.0]), [0.3], quadrature)
        assert q[-1] == pytest.approx([math.cos(1.35), 0, 0, math.sin(1.35)], abs=1e-12)
