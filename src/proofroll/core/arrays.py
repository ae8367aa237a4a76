"""Types of arrays, and how far two are apart."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def largest_difference(one: FloatArray, other: FloatArray) -> float:
    """Largest difference of two curves; inf where one has what the other has not, or something is not finite."""
    if one.shape != other.shape:
        return float("inf")
    found = float(np.max(np.abs(one - other), initial=0.0))
    return found if np.isfinite(found) else float("inf")
