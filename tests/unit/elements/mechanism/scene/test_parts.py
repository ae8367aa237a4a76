"""Bodies, loops and other parts of a mechanism, as a file gives them."""

from __future__ import annotations

import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Loop


def test_a_distance_of_rounding_errors_is_refused() -> None:
    """A rod whose points are one within rounding has no direction; its error names what takes its place."""
    ends = {"position_a": (0.3, -0.2, 0.1), "position_b": (0.5, 0.0, 0.0)}
    with pytest.raises(InputError, match=r"loops\.rod\.length = 5e-17: .*spherical loop"):
        Loop("rod", "distance", "a", "b", **ends, length=5e-17)  # type: ignore[arg-type]
    assert Loop("rod", "distance", "a", "b", **ends, length=1e-6).length == 1e-6  # type: ignore[arg-type]
