import numpy as np
import pytest
from scipy.optimize import brentq

from proofroll.truth.mechanism.closed_forms import closed_form
from proofroll.truth.mechanism.two_routes import singular_poses


def test_four_bar_passes_when_its_links_are_in_line(scene):
    """Found where the closed form turns the rods by a quarter and three quarters."""
    mechanism = scene("four_bar", windows=1)
    turned = closed_form(mechanism).motion
    expected = [
        brentq(lambda t, a=angle: turned(np.array([t]))[0][0, 0] + a, 0.0, 1.5) for angle in (np.pi / 2, 3 * np.pi / 2)
    ]
    assert singular_poses(mechanism, 1.5) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("name", ["slider_crank", "bricard"])
def test_regular_motion_passes_none(scene, name):
    """Minima of the singular value away from zero are not taken for singular poses."""
    assert singular_poses(scene(name), 0.4) == []


def test_a_tree_has_none(scene):
    """Without loops there is nothing to lose rank."""
    assert singular_poses(scene("chain"), 1.0) == []
