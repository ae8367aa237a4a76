"""Answer of a route about a ball, and the error bar of two routes: the difference of their answers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.dataset import columns
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth import SAFETY
from proofroll.truth.ball_on_surface.orientation import Quadrature, orientation

if TYPE_CHECKING:
    import xarray as xr

# A route's own round-off: values carry a relative error of some machine epsilons even where the routes agree.
ROUND_OFF = 4 * np.finfo(float).eps
# What is a small difference of large numbers, and of which.
_DIFFERENCE_OF = {"gap": "p_WB", "slip": "v_WB", "slip2": "v_WB", "slip3": "v_WB"}
# Where the normal force is this many of its own error bars or less, the friction needed is 0/0.
_NOTHING = 10.0


def dataset_of(
    scene: Scene,
    times: FloatArray,
    found: BallMotion,
    spin: Callable[[FloatArray], FloatArray],
    kinks: Iterable[float],
    quadrature: Quadrature,
) -> xr.Dataset:
    """All variables of a route's motion; spin, its kinks and a quadrature are for the orientation, if it is asked for.

    See :func:`proofroll.elements.ball_on_surface.dataset.columns` and :func:`.orientation.orientation`.
    """
    q_WB = orientation(spin, times, kinks, quadrature) if BallCapability.ORIENTATION in scene.requires else None
    motion = (found.p_WB, found.v_WB, found.w_WB)
    result = columns(rolling_ball(scene), times, *motion, force=found.force, q_WB=q_WB).dataset()
    return result.assign_attrs(route=found.route)


def put_error_bars(result: xr.Dataset, check: xr.Dataset, floor: float) -> None:
    """Gives each variable of ``result`` the attribute ``error_bar`` in its own unit.

    It is ``SAFETY`` times the largest difference to ``check``, of the second route, plus ``floor``: what both may
    have in common, relative to the size of the variable [1].

    Raises:
        Diverged: a value is not finite, other than the friction needed where nothing presses.
    """
    for name, values in result.data_vars.items():
        mine, other = (np.asarray(x.to_numpy(), dtype=np.float64) for x in (values, check[name]))
        if name == "needed_friction":  # comes after N
            pressed = np.minimum(*(np.abs(x["N"].to_numpy()) for x in (result, check)))
            known = pressed > _NOTHING * result["N"].attrs["error_bar"]
            mine, other = mine[known], other[known]
        if not (np.all(np.isfinite(mine)) and np.all(np.isfinite(other))):
            raise Diverged(f"the truth is not finite (NaN or overflow) in {name}; take less extreme parameters")
        size = 0.0 if values.dtype == bool else np.max(np.abs(mine), initial=0.0)
        difference = np.max(np.abs(mine - other), initial=0.0)
        if name in _DIFFERENCE_OF:  # it has the round-off of what it is a difference of
            difference += ROUND_OFF * np.max(np.abs(result[_DIFFERENCE_OF[name]].to_numpy()), initial=0.0)
        values.attrs["error_bar"] = float(SAFETY * (difference + floor * size))
