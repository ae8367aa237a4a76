"""Truth of a ball that rolls in an upright cylinder, by two routes of its own or as the body that stands for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import ENDED, ENDS, LAWS
from proofroll.core.element import Element
from proofroll.core.errors import Diverged
from proofroll.core.heyoka_library import available
from proofroll.elements.ball_on_surface.dataset import columns
from proofroll.elements.ball_on_surface.element import BallOnSurface
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.rolling_equations import closed_form
from proofroll.elements.mechanism.run.balls import PlacedBall, ball_as_body
from proofroll.truth import SAFETY
from proofroll.truth.ball_on_surface import series
from proofroll.truth.ball_on_surface.rolling import reduced, unreduced

if TYPE_CHECKING:
    import xarray as xr

# Relative round-off of a route: values may be wrong by a few machine epsilons even where the routes agree; and the
# error that two integrations by DOP853 may share, which stop refining at 1e-13 a step.
_ROUND_OFF, _SHARED = 4 * float(np.finfo(float).eps), 1e-12
# Variables that are small differences of large variables, with the large one.
_DIFFERENCE_OF = {"gap": "p_WB", "slip": "v_WB", "slip2": "v_WB", "slip3": "v_WB"}
# Below this many of its own error bars the normal force is zero, and the needed friction 0/0.
_NOTHING = 10.0


class BallOnSurfaceTruth:
    """See :class:`proofroll.core.truth.ElementTruth`."""

    @staticmethod
    def covers(element: Element) -> bool:
        """True for every ball in an upright cylinder."""
        return isinstance(element, BallOnSurface)

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """Motion of the ball and force of the wall on it, with error bars.

        The first route is the closed form, or with rolling resistance the reduced equations; the second is Newton-Euler
        in the world, derived and integrated independently. They do not turn with the ball, however small and fast that
        is: its orientation, if asked for, is that of the body that stands for it.

        Raises:
            Diverged: a route could not be integrated, or a value is not finite.
        """
        assert isinstance(element, BallOnSurface)  # by ``covers``
        body, instants = element.rolling, np.asarray(times, dtype=np.float64)
        by_series = available() and (not body.contact.rolling_resistance or bool(body.udot0[0]))
        first_route, second_route = (series.reduced, series.unreduced) if by_series else (reduced, unreduced)
        with np.errstate(invalid="ignore", divide="ignore"):  # values that are not finite are refused by name below
            exact = closed_form(body, instants)
            first, second = exact or first_route(body, instants), second_route(body, instants)
            result, check = (_dataset(body, instants, route) for route in (first, second))
        _put_error_bars(result, check, _ROUND_OFF if exact or by_series else _SHARED)
        result.attrs |= {"route": first.route, "second_route": second.route}
        return _with_orientation(result, element, times, asks) if "orientation" in asks else result


def _dataset(body: RollingBall, times: FloatArray, solved: BallMotion) -> xr.Dataset:
    return columns(body, times, solved.p_WB, solved.v_WB, solved.w_WB, force=solved.force).dataset()


def _put_error_bars(result: xr.Dataset, check: xr.Dataset, floor: float) -> None:
    """Gives each variable of ``result`` the attribute ``error_bar`` in its own unit.

    It is ``SAFETY`` times the sum of the largest difference to ``check``, the second route, and ``floor`` times the
    size of the variable: the relative error that both routes may share [1].

    Raises:
        Diverged: a value is not finite, except needed friction at zero normal force.
    """
    for name, values in result.data_vars.items():
        mine, second = values.to_numpy(), check[name].to_numpy()
        if name == "needed_friction":  # N is earlier in data_vars, so it has its error bar
            pressed = np.minimum(*(np.abs(x["N"].to_numpy()) for x in (result, check)))
            on_wall = pressed > _NOTHING * result["N"].attrs["error_bar"]
            mine, second = mine[on_wall], second[on_wall]
        if not (np.all(np.isfinite(mine)) and np.all(np.isfinite(second))):
            raise Diverged(f"the truth is not finite (NaN or overflow) in {name}; take less extreme parameters")
        difference = np.max(np.abs(mine - second), initial=0.0)
        if name in _DIFFERENCE_OF:  # plus the round-off of the large variable
            difference += _ROUND_OFF * np.max(np.abs(result[_DIFFERENCE_OF[name]].to_numpy()), initial=0.0)
        values.attrs["error_bar"] = float(SAFETY * (difference + floor * np.max(np.abs(mine), initial=0.0)))


def _with_orientation(result: xr.Dataset, element: BallOnSurface, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
    """The truth with the orientation of the body that stands for the ball, up to the end of that body's truth.

    Raises:
        Diverged: the body moves in another way.
    """
    from proofroll.truth.plug_in import MechanismTruth

    placed = PlacedBall(
        ball=element.ball, surface=element.surface, contact=element.contact, start=element.start, number=0
    )
    turning = MechanismTruth.truth(ball_as_body(placed, element.gravity, "scene"), times, asks).isel(body=0, drop=True)
    result = result.isel(time=slice(len(turning["time"])))
    for name in ("p_WB", "w_WB"):
        apart = float(np.abs(result[name] - turning[name]).max())
        if not apart <= result[name].attrs["error_bar"] + turning[name].attrs["error_bar"]:
            raise Diverged(f"{name} of the ball and of its body are {apart:.3g} apart, more than their error bars")
    ends = {name: turning.attrs[name] for name in (LAWS, ENDS, ENDED, "ill_posed") if name in turning.attrs}
    routes = {name: f"{result.attrs[name]}; orientation by {turning.attrs[name]}" for name in ("route", "second_route")}
    return result.assign(turning[["q_WB", "attitude"]].data_vars).assign_attrs(routes | ends)
