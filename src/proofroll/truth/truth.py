"""Chooses the two routes and puts the error bar on the truth."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.events import with_events
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.closed_form import closed_form
from proofroll.elements.ball_on_surface.dataset import columns
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
Spin = Callable[[RollingBall, FloatArray], FloatArray]

# A route's own round-off: its values carry a relative error of some machine epsilons even where the routes agree.
_ROUND_OFF = 4 * np.finfo(float).eps


def truth(scene: Scene, times: FloatArray) -> xr.Dataset:
    """The true trajectory, each variable with the attribute ``error_bar`` in its own unit.

    The first route is the closed form where there is one, else the reduced equations; the second is the unreduced
    Newton-Euler system, derived and integrated independently (where heyoka is installed by Taylor series, which ten
    thousand oscillations take a second). The error bar of a variable is the largest difference
    between the routes plus round-off, times a factor of safety. Where the scene asks for the orientation, each route
    gives it by a quadrature of its own.

    With bounded friction, where the ball leaves the wall, and where rolling is resisted, the routes are those of
    :mod:`truth.stick_slip`; with bounded friction the dataset also holds ``sticking`` and the events
    (:func:`events.events_of`), which it has of a ball that leaves the wall too.

    Raises:
        Diverged: a route could not be integrated, or a value is not finite.
        Refused: the ball leaves the wall and lands on it again.
    """
    body, bounded = rolling_ball(scene), BallCapability.BOUNDED_FRICTION in scene.requires
    times = np.asarray(times, dtype=np.float64)
    # Between its ends a step of DOP853 is less accurate than at them, and an orientation asks between samples; and it
    # takes some ten times as long.
    series = unreduced_taylor.available(body) and BallCapability.ORIENTATION not in scene.requires
    stepped = closed_form(body, times[:1]) is None and not series
    if bounded or stepped or body.gap0 or not (always_pressed(body) or stays_on(body, float(times[-1]))):
        result, events = stick_slip(scene, times)
        result = result if bounded else result.drop_vars("sticking")
        return with_events(result, events) if bounded or events else result
    result = _dataset(scene, times, _first, lambda ball, at: _first(ball, at).w_WB, QUATERNIONS)
    check = _dataset(scene, times, _unreduced, _unreduced_spin, MATRICES)
    put_error_bars(result, check, _ROUND_OFF)
    result.attrs["second_route"] = check.attrs["route"]
    return result


def _first(body: RollingBall, times: FloatArray) -> BallMotion:
    return closed_form(body, times) or rolling.reduced(body, times)


def _unreduced(body: RollingBall, times: FloatArray) -> BallMotion:
    if unreduced_taylor.available(body):
        return unreduced_taylor.unreduced(body, times)
    return rolling.unreduced(body, times)


def _unreduced_spin(body: RollingBall, times: FloatArray) -> FloatArray:
    if unreduced_taylor.available(body):
        return unreduced_taylor.states(body, times)[:, 6:]
    return rolling.unreduced(body, times).w_WB


def _dataset(scene: Scene, times: FloatArray, route: Route, spin: Spin, quadrature: Quadrature) -> xr.Dataset:
    body = rolling_ball(scene)
    found = route(body, times)
    q_WB = None
    if BallCapability.ORIENTATION in scene.requires:

        def from_start(at: FloatArray) -> FloatArray:
            return spin(body, at) if at[0] == 0 else spin(body, np.append(0.0, at))[1:]

        q_WB = orientation(from_start, times, (), quadrature)
    result = columns(body, times, found.p_WB, found.v_WB, found.w_WB, force=found.force, q_WB=q_WB).dataset()
    return result.assign_attrs(route=found.route)
