"""What becomes of the ball in the truth."""

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core import heyoka_library as library
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.truth.regimes import Regime, classify

pytestmark = pytest.mark.skipif(not library.available(), reason="a map takes minutes without heyoka")


def test_the_paper_falls_after_its_second_slip() -> None:
    """With resistance the paper's case slips twice and falls; shortly after it has stuck again it has recovered."""
    body = rolling_ball(load_scene("sphere_in_cylinder", rolling_resistance=5e-4, mu_static=0.35))
    regime, slips, first = classify(body, 4.0)
    assert (regime, slips) == (Regime.FALLS, 2)
    assert first == pytest.approx(1.720183172, abs=1e-7)
    assert classify(body, 2.1)[:2] == (Regime.RECOVERS, 1)


def test_variants_keep_rolling_and_ratio() -> None:
    """Another speed still rolls without slip, and another μs keeps the ratio μk/μs."""
    body = rolling_ball(load_scene("sphere_in_cylinder", mu_static=0.4, mu_kinetic=0.3, radial_spin=7.0))
    faster = body.at_speed(5.0)
    e1 = body.surface.normal(body.p0)
    np.testing.assert_allclose(faster.v0 + body.ball.radius * np.cross(faster.w0, e1), 0, atol=1e-14)
    assert np.linalg.norm(faster.v0) == pytest.approx(5.0)
    assert faster.w0 @ e1 == pytest.approx(7.0)
    assert body.with_contact(mu_static=0.2).contact.mu_kinetic == pytest.approx(0.15)
