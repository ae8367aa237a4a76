from __future__ import annotations

import re

import pytest

from proofroll.core.engine import whole_steps
from proofroll.core.errors import InputError


@pytest.mark.parametrize(
    ("start", "end", "dt", "steps"),
    [(0, 1, 0.1, 10), (0.3, 0.30, 0.1, 0), (1.99, 2.0, 1e-4, 100), (0, 2, 2 / 3, 3), (0, 1000, 1e-4, 10_000_000)],
)
def test_whole_steps(start: float, end: float, dt: float, steps: int) -> None:
    """The number of steps is right although neither the times nor the step are binary fractions."""
    assert whole_steps(start, end, dt) == steps


@pytest.mark.parametrize(("end", "dt"), [(0.01, 3e-3), (0.01, 0.02), (1.0, 0.3)])
def test_a_step_that_does_not_divide_the_interval(end: float, dt: float) -> None:
    """A step that no whole number of times fits is the user's to change, and the line says to what."""
    with pytest.raises(InputError, match="choose a step that divides") as caught:
        whole_steps(0.0, end, dt)
    assert (caught.value.field, caught.value.value) == ("dt", dt)


def test_the_grid_that_a_step_does_not_fit_is_that_of_the_samples() -> None:
    """The line says whose grid it is, and names an interval and a step that fit each other."""
    with pytest.raises(InputError) as caught:
        whole_steps(0.01, 0.02, 1 / 240)
    said = str(caught.value)
    assert "sampled at 0.01 s and 0.02 s" in said
    every, step = (float(found) for found in re.search(r"every (\S+) s .*, as (\S+) s", said).groups())
    assert every == pytest.approx(2 / 240, rel=1e-5)
    assert whole_steps(0.01, 0.02, 0.01 / round(0.01 / step)) == 3
