"""Chooses the two routes and puts the error bar on the truth."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.events import with_events
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.closed_form import closed_form
from proofroll.elements.ball_on_surface.dataset import variables
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.mechanics import always_pressed
from proofroll.elements.ball_on_surface.model import BallCapability, RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth import rolling, unreduced_taylor
from proofroll.truth.error_bars import put_error_bars
from proofroll.truth.orientation import MATRICES, QUATERNIONS, Quadrature, orientation
from proofroll.truth.stick_slip import stays_on, stick_slip

if TYPE_CHECKING:
    import xarray as xr

Route = Callable[[RollingBall, FloatArray], BallMotion]

# A route's own round-off: its values carry a relative error of some machine epsilons even where the routes agree.
_ROUND_OFF = 4 * np.finfo(float).eps


def truth(scene: Scene, times: FloatArray) -> xr.Dataset:
    """The true trajectory, each variable with the attribute ``error_bar`` in its own unit.

    The first route is the closed form where there is one, else the reduced equations; the second is the unreduced
    Newton-Euler system, derived and integrated independently (where heyoka is installed and nothing resists rolling, by
    Taylor series, which ten thousand oscillations take a second). The error bar of a variable is the largest difference
    between the routes plus round-off, times a factor of safety. Where the scene asks for the orientation, each route
    gives it by a quadrature of its own.

    With bounded friction, or where the ball leaves the wall, the routes are those of
    :mod:`truth.stick_slip`, and the dataset also holds the events (:func:`events.events_of`), with
    bounded friction ``sticking`` too.

    Raises:
        Diverged: a route could not be integrated, or a value is not finite.
        Refused: the ball leaves the wall and lands on it again.
    """
    body, bounded = rolling_ball(scene), BallCapability.BOUNDED_FRICTION in scene.requires
    times = np.asarray(times, dtype=np.float64)
    # Between its ends a step of DOP853 is less accurate than at them, and an orientation asks between samples.
    turns = BallCapability.ORIENTATION in scene.requires and closed_form(body, times[:1]) is None
    if bounded or turns or body.gap0 or not (always_pressed(body) or stays_on(body, float(times[-1]))):
        result, events = stick_slip(scene, times)
        return with_events(result if bounded else result.drop_vars("sticking"), events)
    result = _dataset(scene, times, _first, QUATERNIONS)
    check = _dataset(scene, times, _unreduced, MATRICES)
    put_error_bars(result, check, _ROUND_OFF)
    result.attrs["second_route"] = check.attrs["route"]
    return result


def _first(body: RollingBall, times: FloatArray) -> BallMotion:
    return closed_form(body, times) or rolling.reduced(body, times)


def _unreduced(body: RollingBall, times: FloatArray) -> BallMotion:
    if unreduced_taylor.available(body):
        return unreduced_taylor.unreduced(body, times)
    return rolling.unreduced(body, times)


def _dataset(scene: Scene, times: FloatArray, route: Route, quadrature: Quadrature) -> xr.Dataset:
    body = rolling_ball(scene)
    found = route(body, times)
    q_WB = None
    if BallCapability.ORIENTATION in scene.requires:

        def from_start(at: FloatArray) -> BallMotion:
            return route(body, at) if at[0] == 0 else route(body, np.append(0.0, at)).at(slice(1, None))

        q_WB = orientation(from_start, times, (), quadrature)
    result = variables(body, times, found.p_WB, found.v_WB, found.w_WB, force=found.force, q_WB=q_WB)
    return result.assign_attrs(route=found.route)
