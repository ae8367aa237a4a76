"""Lengths of vectors in curves, the same in all axes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import hermite, largest_difference, largest_distance, largest_magnitude, magnitudes

TURN = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
TWO = (0, 0, 0, 1, 1, 1)


def test_vectors_are_compared_by_their_lengths() -> None:
    """A difference of (1, 1, 1) counts as √3 in any axes; components on their own count by their size."""
    apart = np.zeros((4, 2, 3))
    apart[2, 1] = 1.0
    assert largest_difference(apart, 0 * apart, TWO) == pytest.approx(3**0.5)
    assert largest_difference(apart @ TURN.T, 0 * apart, TWO) == pytest.approx(3**0.5)
    assert largest_difference(apart, 0 * apart) == 1.0
    assert magnitudes(apart, TWO).shape == (4, 2)
    assert largest_magnitude(apart[:0], TWO) == 0.0


def test_components_that_are_not_determinate_leave_vectors_of_less() -> None:
    """Vectors may have one to three components."""
    assert magnitudes(np.array([[3.0, 4.0, -5.0]]), (0, 0, 2)).tolist() == [[5.0, 5.0]]


def test_a_way_is_the_same_in_all_axes() -> None:
    """The largest distance within a curve: that of a line exactly, also where it begins in its middle."""
    t = np.linspace(-1.0, 1.0, 21)
    line = np.roll(t[:, None] * [1.0, 2.0, 2.0], 10, axis=0)
    assert largest_distance(line, TWO[:3]) == pytest.approx(6.0)
    assert largest_distance(line @ TURN.T, TWO[:3]) == pytest.approx(6.0)
    assert largest_distance(line) == pytest.approx(4.0)
    assert largest_distance(line[:1], TWO[:3]) == 0.0


def test_a_cubic_is_interpolated_exactly() -> None:
    """Samples of a cubic with its rates give it back between them, of every component, at uneven times."""
    grid = np.array([0.0, 0.3, 0.4, 1.1, 2.0])
    powers = np.array([[1.0, -2.0], [0.5, 3.0], [-1.5, 0.0], [0.7, -0.4]])
    places = np.stack([grid**k for k in range(4)], axis=1) @ powers
    rates = np.stack([k * grid ** max(k - 1, 0) for k in range(4)], axis=1) @ powers
    times = np.linspace(0.0, 2.0, 17)
    expected = np.stack([times**k for k in range(4)], axis=1) @ powers
    assert hermite(grid, places, rates, times) == pytest.approx(expected, abs=1e-14)
    assert hermite(grid, places[:, 0], rates[:, 0], times) == pytest.approx(expected[:, 0], abs=1e-14)
