"""Lemke's method: z ≥ 0 with w = M z + q ≥ 0 and z·w = 0.

Source: R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, 1992, section 4.4.
"""

import numpy as np

from proofroll.core.arrays import uneven
from proofroll.elements.mechanism.scene.rotations import Array

_PIVOTS = 50  # at most, for each unknown
_ZERO = 1e-12  # entries of the tableau, relative to the largest of their column, that count as zero


def lemke(M: Array, q: Array) -> Array | None:
    """Solution z, shape (n,), of a linear complementarity problem; None: the method ends on a ray."""
    n = len(q)
    scale = float(np.abs(q).max(initial=0.0))
    if q.min(initial=0.0) >= 0:
        return np.zeros(n)
    # w − M z − d z0 = q; the entries of d differ, so that no two rows leave at once where contacts are alike
    d = uneven(n)
    tableau = np.column_stack([np.eye(n), -M, -d, q / scale])
    basis = list(range(n))  # w is 0 … n − 1, z is n … 2n − 1, z0 is 2n
    row, entering = int(np.argmin(tableau[:, -1] / d)), 2 * n
    for _ in range(_PIVOTS * n):
        leaving = basis[row]
        tableau[row] /= tableau[row, entering]
        others = np.arange(n) != row
        tableau[others] -= np.outer(tableau[others, entering], tableau[row])
        basis[row] = entering
        if leaving == 2 * n:
            break
        entering = leaving + n if leaving < n else leaving - n
        column = tableau[:, entering]
        able = np.flatnonzero(column > _ZERO * np.abs(column).max())
        if not len(able):
            return None
        ratios = np.maximum(tableau[able, -1], 0.0) / column[able]
        ties = able[ratios <= ratios.min() + _ZERO]
        row = next((int(k) for k in ties if basis[k] == 2 * n), int(ties[0]))
    else:
        return None
    z = np.zeros(2 * n + 1)
    z[basis] = tableau[:, -1]
    return scale * np.maximum(z[n : 2 * n], 0.0)
