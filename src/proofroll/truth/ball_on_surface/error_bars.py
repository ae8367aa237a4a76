"""Dataset of one route's motion, and error bars from the difference of two routes."""

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

# Relative round-off of a route: values may be wrong by a few machine epsilons even where the routes agree.
ROUND_OFF = 4 * np.finfo(float).eps
# Variables that are small differences of large variables, with the large one.
_DIFFERENCE_OF = {"gap": "p_WB", "slip": "v_WB", "slip2": "v_WB", "slip3": "v_WB"}
# Below this many of its own error bars the normal force is zero, and the needed friction 0/0.
_NOTHING = 10.0


def dataset_of(
    scene: Scene,
    times: FloatArray,
    solved: BallMotion,
    spin: Callable[[FloatArray], FloatArray],
    kinks: Iterable[float],
    quadrature: Quadrature,
) -> xr.Dataset:
    """Dataset of all variables of a route's motion.

    ``spin``, ``kinks`` and ``quadrature`` serve for the orientation, if the scene requires it; see
    :func:`.orientation.orientation`. Variables: :func:`proofroll.elements.ball_on_surface.dataset.columns`.
    """
    q_WB = orientation(spin, times, kinks, quadrature) if BallCapability.ORIENTATION in scene.requires else None
    motion = (solved.p_WB, solved.v_WB, solved.w_WB)
    result = columns(rolling_ball(scene), times, *motion, force=solved.force, q_WB=q_WB).dataset()
    return result.assign_attrs(route=solved.route)


def put_error_bars(result: xr.Dataset, check: xr.Dataset, floor: float) -> None:
    """Gives each variable of ``result`` the attribute ``error_bar`` in its own unit.

    It is ``SAFETY`` times the sum of the largest difference to ``check``, the second route, and ``floor`` times the
    size of the variable: the relative error that both routes may share [1].

    Raises:
        Diverged: a value is not finite, except needed friction at zero normal force.
    """
    for name, values in result.data_vars.items():
        mine, second = (np.asarray(x.to_numpy(), dtype=np.float64) for x in (values, check[name]))
        if name == "needed_friction":  # N is earlier in data_vars, so it has its error bar
            pressed = np.minimum(*(np.abs(x["N"].to_numpy()) for x in (result, check)))
            on_wall = pressed > _NOTHING * result["N"].attrs["error_bar"]
            mine, second = mine[on_wall], second[on_wall]
        if not (np.all(np.isfinite(mine)) and np.all(np.isfinite(second))):
            raise Diverged(f"the truth is not finite (NaN or overflow) in {name}; take less extreme parameters")
        size = 0.0 if values.dtype == bool else np.max(np.abs(mine), initial=0.0)
        difference = np.max(np.abs(mine - second), initial=0.0)
        if name in _DIFFERENCE_OF:  # plus the round-off of the large variable
            difference += ROUND_OFF * np.max(np.abs(result[_DIFFERENCE_OF[name]].to_numpy()), initial=0.0)
        values.attrs["error_bar"] = float(SAFETY * (difference + floor * size))
