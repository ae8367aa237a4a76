"""Truth of a ball on a surface: choice of its two routes, and its error bars."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import ENDS
from proofroll.core.element import Element
from proofroll.core.errors import Diverged, InputError
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import BallOnSurface, rolling_ball
from proofroll.elements.ball_on_surface.mechanics import always_pressed
from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.rolling_equations import closed_form
from proofroll.truth.ball_on_surface import rolling, unreduced_taylor
from proofroll.truth.ball_on_surface.error_bars import ROUND_OFF, dataset_of, put_error_bars
from proofroll.truth.ball_on_surface.onset import edge_between, onset
from proofroll.truth.ball_on_surface.orientation import MATRICES, QUATERNIONS
from proofroll.truth.ball_on_surface.stick_slip import stays_on, stick_slip

if TYPE_CHECKING:
    import xarray as xr

_ILL_POSED = "a change of the parameters within their accuracy changes the time of the first slip"


class BallOnSurfaceTruth:
    """See :class:`proofroll.core.truth.ElementTruth`, :class:`proofroll.core.truth.FindsEdges`."""

    @staticmethod
    def covers(element: Element) -> bool:
        """True for every ball on a surface."""
        return isinstance(element, BallOnSurface)

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """Dataset of :func:`truth`; with bounded friction also the conditioning of the first slip."""
        scene = Scene(element.name, "", (element,), asks=tuple(asks))
        try:
            # Non-finite values are refused by name below; a warning would add nothing.
            with np.errstate(invalid="ignore", divide="ignore"):
                result = truth(scene, times)
        except ZeroDivisionError:
            message = "the ball comes to a point where its wall has no curvature, as at the apex of a cone"
            raise Diverged(f"{message}; start further off") from None
        if "sticking" in result:
            first = onset(scene, min(float(times[-1]), float(result.attrs.get(ENDS, np.inf))))
            result.attrs["onset"] = json.dumps(dataclasses.asdict(first))
            if first.verdict == "ill-posed":
                # A disagreement of the routes is recorded there already, with its time.
                result.attrs.setdefault("ill_posed", _ILL_POSED)
        return result

    @staticmethod
    def edge_between(element: Element, parameter: str, low: float, high: float, until: float) -> float | None:
        """Value of static friction at which the time of the first slip jumps, see :func:`.onset`; None: there is none.

        Raises:
            InputError: ``parameter`` is not ``mu_static``.
        """
        if parameter != "mu_static":
            raise InputError(parameter, "edge_between", "an edge can be found only for mu_static")
        return edge_between(Scene(element.name, "", (element,)), low, high, until)


def truth(scene: Scene, times: FloatArray) -> xr.Dataset:
    """True trajectory at rising times [s]; each variable has the attribute ``error_bar`` in its own unit.

    The first route is the closed form if one is known, else the reduced equations. The second is the unreduced
    Newton-Euler system, derived and integrated independently (by Taylor series if heyoka is installed: ten thousand
    oscillations in a second). The error bar of a variable is the largest difference between the routes plus round-off,
    times a factor of safety. If the scene asks for the orientation, each route gives it by a quadrature of its own.

    With bounded friction or rolling resistance, or if the ball leaves the wall, the routes are those of
    :mod:`truth.stick_slip`. The dataset then has the events (:func:`events.events_of`), and with bounded friction
    ``sticking``.

    Raises:
        Diverged: a route could not be integrated, or a value is not finite.
        Refused: no motion is known from time 0 on.
    """
    body, bounded = rolling_ball(scene), BallCapability.BOUNDED_FRICTION in scene.requires
    times = np.asarray(times, dtype=np.float64)
    by_series = unreduced_taylor.available(body)
    # Within a step DOP853 is less accurate than at its ends, and an orientation needs the spin within steps. It also
    # takes some ten times as long as the series.
    stepped = not by_series or BallCapability.ORIENTATION in scene.requires
    stepped = stepped and closed_form(body, times[:1]) is None
    if bounded or stepped or not (always_pressed(body) or stays_on(body, float(times[-1]))):
        result, _ = stick_slip(scene, times)
        return result if bounded else result.drop_vars("sticking")

    def first(instants: FloatArray) -> BallMotion:
        return closed_form(body, instants) or rolling.reduced(body, instants)

    def second(instants: FloatArray) -> BallMotion:
        return unreduced_taylor.unreduced(body, instants) if by_series else rolling.unreduced(body, instants)

    def second_spin(instants: FloatArray) -> FloatArray:  # computing forces would take longer than the whole series
        return unreduced_taylor.states(body, instants)[:, 6:] if by_series else second(instants).w_WB

    def from_start(spin: Callable[[FloatArray], FloatArray]) -> Callable[[FloatArray], FloatArray]:
        return lambda instants: spin(instants) if instants[0] == 0 else spin(np.append(0.0, instants))[1:]

    result = dataset_of(scene, times, first(times), from_start(lambda instants: first(instants).w_WB), (), QUATERNIONS)
    check = dataset_of(scene, times, second(times), from_start(second_spin), (), MATRICES)
    put_error_bars(result, check, ROUND_OFF)
    result.attrs["second_route"] = check.attrs["route"]
    return result
