"""The map of regimes against the boundaries that the closed form gives."""

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.truth import taylor
from proofroll.truth.regimes import Regime, classify, regime_map
from proofroll.truth.variants import at_speed, with_contact

pytestmark = pytest.mark.skipif(not taylor.available(), reason="a map takes minutes without heyoka")


def test_map_follows_the_analytic_boundaries() -> None:
    """Without resistance every point of the map lies where g c/V0² and (12/7) g c/V0² say, and progress adds up."""
    done: list[int] = []
    speeds, mus = np.linspace(1.5, 6, 12), np.linspace(0.02, 0.9, 15)
    result = regime_map(load_scene("sphere_in_cylinder"), speeds, mus, progress=done.append)
    boundary = 9.81 * 0.2 / speeds[:, None] ** 2
    expected = np.where(mus < boundary, Regime.FALLS, np.where(mus < 12 / 7 * boundary, Regime.RECOVERS, 0))
    np.testing.assert_array_equal(result.regime, expected)
    np.testing.assert_allclose(result.mu_slips, 12 / 7 * result.mu_falls)
    assert sum(done) == 12 * 15
    assert np.array_equal(np.isnan(result.first_slip), result.regime == Regime.NEVER_SLIPS)


def test_the_paper_falls_after_its_second_slip() -> None:
    """With resistance the paper's case slips twice and falls; shortly after it has stuck again it has recovered."""
    body = rolling_ball(load_scene("sphere_in_cylinder", rolling_resistance=5e-4, mu_static=0.35))
    regime, slips, first = classify(body, 4.0)
    assert (regime, slips) == (Regime.FALLS, 2)
    assert first == pytest.approx(1.720183172, abs=1e-7)
    assert classify(body, 2.1)[:2] == (Regime.RECOVERS, 1)


def test_processes_change_nothing() -> None:
    """Two processes give the map that one gives."""
    scene = load_scene("sphere_in_cylinder", rolling_resistance=5e-4)
    one, two = (regime_map(scene, [2.0, 4.0], [0.1, 0.35], workers=workers) for workers in (1, 2))
    assert one.identical(two)


def test_variants_keep_rolling_and_ratio() -> None:
    """Another speed still rolls without slip, and another μs keeps the ratio μk/μs."""
    body = rolling_ball(load_scene("sphere_in_cylinder", mu_static=0.4, mu_kinetic=0.3, radial_spin=7.0))
    faster = at_speed(body, 5.0)
    e1 = body.surface.normal(body.p0)
    np.testing.assert_allclose(faster.v0 + body.ball.radius * np.cross(faster.w0, e1), 0, atol=1e-14)
    assert np.linalg.norm(faster.v0) == pytest.approx(5.0)
    assert faster.w0 @ e1 == pytest.approx(7.0)
    assert with_contact(body, mu_static=0.2).contact.mu_kinetic == pytest.approx(0.15)
