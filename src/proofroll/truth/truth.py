"""Chooses the two routes and puts the error bar on the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.events import with_events
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.closed_form import closed_form
from proofroll.elements.ball_on_surface.dataset import variables
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import BallCapability, RollingBall
from proofroll.elements.ball_on_surface.motion import Motion
from proofroll.truth import rolling, unreduced_taylor
from proofroll.truth.error_bars import put_error_bars

if TYPE_CHECKING:
    import xarray as xr

# A route's own round-off: its values carry a relative error of some machine epsilons even where the routes agree.
_ROUND_OFF = 4 * np.finfo(float).eps


def truth(scene: Scene, times: FloatArray) -> xr.Dataset:
    """The true trajectory, each variable with the attribute ``error_bar`` in its own unit.

    The first route is the closed form where there is one, else the reduced equations; the second is the unreduced
    Newton-Euler system, derived and integrated independently (where heyoka is installed and nothing resists rolling, by
    Taylor series, which ten thousand oscillations take a second). The error bar of a variable is the largest difference
    between the routes plus round-off.

    With bounded friction the routes are those of :mod:`proofroll.truth.stick_slip`, and the dataset also holds
    ``sticking`` and the events (:func:`proofroll.core.events.events_of`).

    Raises:
        Diverged: the routes disagree about the order of events.
        Refused: the ball leaves the wall and lands on it again.
    """
    if BallCapability.BOUNDED_FRICTION in scene.requires:
        from proofroll.truth.stick_slip import stick_slip

        return with_events(*stick_slip(scene, times))
    body = rolling_ball(scene)
    times = np.asarray(times, dtype=np.float64)
    first = closed_form(body, times) or rolling.reduced(body, times)
    second = _unreduced(body, times)
    result, check = _dataset(scene, times, first), _dataset(scene, times, second)
    put_error_bars(result, check, _ROUND_OFF)
    result.attrs["route"] = first.route
    result.attrs["second_route"] = second.route
    return result


def _unreduced(body: RollingBall, times: FloatArray) -> Motion:
    if unreduced_taylor.available(body):
        return unreduced_taylor.unreduced(body, times)
    return rolling.unreduced(body, times)


def _dataset(scene: Scene, times: FloatArray, motion: Motion) -> xr.Dataset:
    return variables(rolling_ball(scene), times, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
