"""Distributions of a load that contacts share."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import brentq, minimize

from proofroll.elements.mechanism.contact.distributions import ContactCones, Distribution, best_distribution, cones_of
from proofroll.elements.mechanism.scene.rotations import Array

FEET = np.array([[0.1, 0.0], [-0.05, 0.0866025403784], [-0.05, -0.0866025403784]])
FRICTION = np.array([0.3, 0.31, 0.3])
PRESSED = np.full(3, 10 / 3)


def cones(push: float) -> ContactCones:
    """Three feet on a floor that a push along x at their middle would move."""
    rows = np.zeros((3, 6))
    for k, (x, y) in enumerate(FEET):
        rows[:, 2 * k : 2 * k + 2] = [[1, 0], [0, 1], [-y, x]]
    held = np.linalg.lstsq(rows, [-push, 0, 0])[0]
    force = np.column_stack([held.reshape(3, 2), PRESSED])
    shifts = np.pad(null_space(rows).reshape(3, 2, -1), ((0, 0), (0, 1), (0, 0)))
    return cones_of(["stick"] * 3, np.tile([0, 0, 1.0], (3, 1)), FRICTION, np.zeros(3), [None] * 3, force, shifts)


def best(push: float) -> Distribution:
    """The distribution with the largest margin."""
    found = best_distribution(cones(push))
    assert found is not None
    return found


def slides(motion: Array) -> Array:
    """Speeds of the feet in a motion in the plane, (3, 2)."""
    return motion[:2] + motion[2] * np.column_stack([-FEET[:, 1], FEET[:, 0]])


def test_the_margin_ends_at_the_limit_load_of_rigid_motions() -> None:
    """Friction holds up to the least work of sliding per unit way of the push, whatever motion of the body it is."""

    def work(motion: Array) -> float:
        return float(FRICTION * PRESSED @ np.linalg.norm(slides(np.append(1.0, motion)), axis=1))

    limit = minimize(work, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14})
    found = brentq(lambda push: best(push).margin, 2.9, 3.1, xtol=1e-15)
    assert found == pytest.approx(limit.fun, abs=1e-9)
    speeds = np.linalg.norm(slides(np.append(1.0, limit.x)), axis=1)
    np.testing.assert_allclose(best(found).speeds, speeds / speeds.sum(), atol=1e-5)


@pytest.mark.arithmetic
def test_the_margin_is_known_to_round_off() -> None:
    """Its second differences over steps of 1e-9 are round-off (6e-16 seen), so that a limit is located as sharply."""
    margins = [best(3.033 + 1e-9 * k).margin for k in range(8)]
    assert float(np.abs(np.diff(margins, 2)).max()) < 6e-15


def test_a_distribution_holds_where_the_shortest_does_not() -> None:
    """Between the two limits friction holds all feet, with the weights that are found."""
    pushed = cones(3.02)
    assert not pushed.hold(np.zeros(3), 0.0)
    assert pushed.hold(best(3.02).weights, 0.0)


def test_contacts_that_press_each_other_without_bound_have_no_best_distribution() -> None:
    """Of a wedge between two walls nothing says how much it is jammed: no weight is chosen."""
    normals = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    force = np.array([[0.1, 0, 1.0], [-0.1, 0, 1.0]])
    jammed = cones_of(
        ["stick"] * 2, normals, np.full(2, 0.5), np.zeros(2), [None] * 2, force, normals[:, :, None] / 2**0.5
    )
    found = best_distribution(jammed)
    assert found is not None
    assert found.margin == pytest.approx(0.05 - 1.0)
    assert not found.weights.any()
