"""Error bars: how wide, and of what there is none."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.core.errors import Diverged
from proofroll.truth import SAFETY
from proofroll.truth.ball_on_surface.error_bars import put_error_bars


def dataset(**values: list[float]) -> xr.Dataset:
    """Curves over time."""
    return xr.Dataset({name: ("time", np.array(curve)) for name, curve in values.items()})


def test_a_factor_of_safety() -> None:
    """The bar is three times the difference of the routes: it was exceeded by up to 2.25 times without."""
    result = dataset(z=[1.0, 2.0])
    put_error_bars(result, dataset(z=[1.0, 2.1]), 0.0)
    assert SAFETY == 3
    assert result.z.attrs["error_bar"] == pytest.approx(0.3)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
@pytest.mark.parametrize("second", [False, True])
def test_nothing_that_is_not_finite_has_a_bar(wrong: float, second: bool) -> None:
    """A truth that is not finite, in either route or in both, is an error and not a result."""
    good, bad = dataset(z=[1.0, 2.0]), dataset(z=[1.0, wrong])
    with pytest.raises(Diverged, match=r"not finite .* in z"):
        put_error_bars(*((good, bad) if second else (bad, good)), 0.0)
    with pytest.raises(Diverged):
        put_error_bars(bad, bad.copy(), 0.0)


def test_friction_needed_without_a_normal_force() -> None:
    """Where nothing presses |F|/N is 0/0, in one route or in both, and does not count."""
    result = dataset(N=[1.0, 0.0], needed_friction=[0.2, np.nan])
    put_error_bars(result, dataset(N=[1.0, 0.0], needed_friction=[0.2, np.nan]), 1e-12)
    assert result.needed_friction.attrs["error_bar"] < 1e-11
    pressed = dataset(N=[1.0, 1.0], needed_friction=[0.2, np.nan])
    with pytest.raises(Diverged, match="needed_friction"):
        put_error_bars(pressed, pressed.copy(), 1e-12)
