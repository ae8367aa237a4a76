"""Rotation vectors, quaternions and matrices, against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism.scene.rotations import (
    from_rotation_vector,
    quaternion_of_vector,
    quaternion_product,
    to_quaternion,
    vector_of_quaternion,
)

TURNS = Rotation.random(20, rng=np.random.default_rng(3))


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-5, 0.1, 1.0, np.pi, 2 * np.pi, 7.0])
def test_rotation_vectors_of_any_length(size: float) -> None:
    """Matrices and quaternions of rotation vectors are scipy's to rounding, of none and of whole turns, too."""
    vectors = size * TURNS.apply([1.0, 0.0, 0.0])
    expected = Rotation.from_rotvec(vectors)
    assert from_rotation_vector(vectors) == pytest.approx(expected.as_matrix(), abs=1e-14)
    assert quaternion_of_vector(vectors) == pytest.approx(expected.as_quat(scalar_first=True), abs=1e-14)
    assert from_rotation_vector(vectors[0]) == pytest.approx(expected[0].as_matrix(), abs=1e-14)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-5, 0.1, 1.0, 3.0, np.pi - 1e-9])
def test_a_quaternion_gives_its_vector_back(size: float) -> None:
    """The rotation vector of a quaternion and of its negative is the shortest one."""
    vectors = size * TURNS.apply([1.0, 0.0, 0.0])
    q = quaternion_of_vector(vectors)
    for signed in (q, -q):
        assert vector_of_quaternion(signed) == pytest.approx(vectors, rel=1e-12, abs=1e-15)


def test_products_turn_one_after_the_other() -> None:
    """A product of quaternions is that of scipy's rotations, up to its sign."""
    p, q = to_quaternion(TURNS.as_matrix()), to_quaternion(TURNS.inv().as_matrix()[::-1])
    expected = (TURNS * TURNS.inv()[::-1]).as_matrix()
    turned = Rotation.from_quat(quaternion_product(p, q), scalar_first=True)
    assert turned.as_matrix() == pytest.approx(expected, abs=1e-14)
