"""Points of a comparison that are given by what happens there."""

from __future__ import annotations

import dataclasses

import pytest

from proofroll.core.comparison import Comparison, Edge
from proofroll.core.errors import InputError
from proofroll.files.comparison_file import load_comparison
from proofroll.studies.comparison.planning import with_edges

SPEED_AND_RESISTANCE = {"speed": 4.0, "rolling_resistance": 5e-4}


def at(point: dict[str, float | Edge]) -> Comparison:
    """Our comparison of stick and slip at one point."""
    return dataclasses.replace(load_comparison("stick_slip"), vary={}, points=[point])


def test_the_stair_edge_of_our_comparison() -> None:
    """The edge between 0.39 and 0.40 is found to six digits, and nothing else of the comparison changes."""
    comparison = load_comparison("stick_slip")
    found = with_edges(comparison)
    assert found.points[:-1] == comparison.points[:-1]
    assert found.points[-1] == SPEED_AND_RESISTANCE | {"mu_static": 0.391459}
    assert isinstance(comparison.points[-1]["mu_static"], Edge)
    assert dataclasses.replace(found, points=comparison.points) == comparison


def test_an_edge_that_is_not_there() -> None:
    """Between two values without a jump no edge is invented."""
    with pytest.raises(InputError, match="nothing jumps between these values of mu_static"):
        with_edges(at({**SPEED_AND_RESISTANCE, "mu_static": Edge((0.35, 0.36))}))


def test_an_edge_of_another_parameter() -> None:
    """An edge of anything but static friction is refused by its name."""
    with pytest.raises(InputError, match=r"stick_slip: points: speed.*only for mu_static"):
        with_edges(at({"speed": Edge((3.0, 4.0)), "rolling_resistance": 5e-4, "mu_static": 0.35}))
