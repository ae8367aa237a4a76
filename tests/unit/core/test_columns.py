"""The variables of a run as plain arrays."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.columns import Columns, Variable

TIME = Variable(("time",), np.linspace(0.0, 1.0, 5), {"units": "s"})


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        (Variable(("time",), np.array([7.0])), "odd has 1 values along time, and others have 5"),
        (Variable(("time",), np.zeros(3)), "odd has 3 values along time, and others have 5"),
        (Variable(("time",), np.zeros((5, 3))), r"odd has the shape \(5, 3\), and the dimensions time"),
        (Variable((), np.zeros(5)), r"odd has the shape \(5,\), and no dimension"),
    ],
)
def test_lengths_along_one_dimension_are_one(odd: Variable, words: str) -> None:
    """A single value beside five would be written to a file as five equal ones."""
    with pytest.raises(ValueError, match=words):
        Columns({"time": TIME, "odd": odd})
