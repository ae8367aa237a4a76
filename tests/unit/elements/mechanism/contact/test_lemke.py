"""Linear complementarity problems with known answers, and random ones whose conditions are checked."""

import numpy as np
import pytest

from proofroll.elements.mechanism.contact.coulomb import lemke


@pytest.mark.parametrize("seed", range(20))
def test_a_random_problem_is_solved(seed: int) -> None:
    """Positive semidefinite problems with a part that is not symmetric, also singular ones as of shared loads."""
    random = np.random.default_rng(seed)
    n, rank = int(random.integers(1, 33)), int(random.integers(1, 7))
    columns, turn = random.normal(size=(n, rank)), random.normal(size=(n, n))
    M = columns @ columns.T + 0.01 * (turn - turn.T) * (seed % 2)
    q = -M @ np.abs(random.normal(size=n)) + np.abs(random.normal(size=n)) * (random.random(n) < 0.3)
    z = lemke(M, q)
    assert z is not None
    w = M @ z + q
    size = float(np.abs(q).max())
    assert z.min() >= 0
    assert w.min() >= -1e-9 * size
    assert np.abs(z * w).max() <= 1e-8 * size * max(1.0, float(z.max()))


def test_a_problem_without_an_answer_has_none() -> None:
    """Where nothing presses back there is no force, and where nothing is pulled together none is needed."""
    assert lemke(np.array([[-1.0]]), np.array([-1.0])) is None
    assert lemke(np.eye(2), np.array([1.0, 0.0])) == pytest.approx([0.0, 0.0])
