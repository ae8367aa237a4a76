"""Two routes to one answer: their difference is the answer's error bar."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def put_error_bars(result: xr.Dataset, check: xr.Dataset, floor: float) -> None:
    """Gives each variable of ``result`` the attribute ``error_bar`` in its own unit.

    It is the largest difference between the routes plus what both may have in common.

    Args:
        result: of the first route; changed in place.
        check: of the second route.
        floor: error common to both routes, relative to the variable's largest size [-].
    """
    for name, values in result.data_vars.items():
        mine, other = (np.asarray(x.to_numpy(), dtype=np.float64) for x in (values, check[name]))
        # Without contact |F|/N is 0/0 in both routes: nothing to compare there.
        known = np.isfinite(mine) | np.isfinite(other)
        difference = np.max(np.abs(mine - other)[known], initial=0.0)
        size = 0.0 if values.dtype == bool else np.max(np.abs(mine[known]), initial=0.0)
        values.attrs["error_bar"] = float(difference + floor * size)
