"""Chooses the two routes and puts the error bar on the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.errors import Refused
from proofroll.scene import Capability, Scene
from proofroll.surfaces import FloatArray
from proofroll.trajectory import trajectory
from proofroll.truth.closed_form import closed_form
from proofroll.truth.motion import Motion
from proofroll.truth.rolling import reduced, unreduced

if TYPE_CHECKING:
    import xarray as xr

# A route's own round-off: its values carry a relative error of some machine epsilons even where the routes agree.
_ROUND_OFF = 4 * np.finfo(float).eps


def truth(scene: Scene, times: FloatArray) -> xr.Dataset:
    """The true trajectory, each variable with the attribute ``error_bar`` in its own unit.

    The first route is the closed form where there is one, else the reduced equations; the second is the unreduced
    Newton-Euler system, derived and integrated independently. The error bar of a variable is the largest difference
    between the routes plus round-off.

    Raises:
        Refused: bounded friction, for which there is no truth yet.
    """
    if Capability.BOUNDED_FRICTION in scene.requires:
        raise Refused("the truth does not model bounded friction (slip) yet; leave mu_static unbounded")
    body = scene.rolling
    times = np.asarray(times, dtype=np.float64)
    first = closed_form(body, times) or reduced(body, times)
    second = unreduced(body, times)
    result, check = _dataset(scene, times, first), _dataset(scene, times, second)
    for name, values in result.data_vars.items():
        difference = float(np.max(np.abs(values.to_numpy() - check[name].to_numpy())))
        values.attrs["error_bar"] = difference + _ROUND_OFF * float(np.max(np.abs(values.to_numpy())))
    result.attrs["route"] = first.route
    result.attrs["second_route"] = second.route
    return result


def _dataset(scene: Scene, times: FloatArray, motion: Motion) -> xr.Dataset:
    return trajectory(scene, times, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
