"""Sparse elimination, in numbers."""

import numpy as np
import pytest

from proofroll.truth.numerics.elimination import Row, eliminated


@pytest.mark.parametrize("symmetric", [True, False])
def test_constraints_wait_for_what_they_hold(symmetric: bool) -> None:
    """A chain of masses whose constraints come first, with zeros on the diagonal, is solved as by a dense method."""
    rng, n, m = np.random.default_rng(5), 6, 3
    C = np.zeros((m, n))
    for k in range(m):
        C[k, k : k + 3] = rng.uniform(0.5, 2.0, 3)
    P = C if symmetric else C * rng.uniform(0.9, 1.1, C.shape)
    A = np.block([[np.zeros((m, m)), C], [P.T, np.diag(rng.uniform(1.0, 2.0, n))]])
    rows: list[Row] = [{j: float(value) for j, value in enumerate(row) if value} for row in A]
    after = [set(np.flatnonzero(row).tolist()) if k < m else set() for k, row in enumerate(A)]
    b = rng.uniform(-1.0, 1.0, (2, n + m))
    answers, pivots = eliminated(rows, b.tolist(), after, symmetric=symmetric)
    assert np.array(answers) == pytest.approx(np.linalg.solve(A, b.T).T, rel=1e-12)
    assert np.prod(pivots) == pytest.approx(np.linalg.det(A), rel=1e-12)
