"""Truth of a ball that rolls in an upright cylinder, by two routes of its own or as the body that stands for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element import Element
from proofroll.core.errors import Diverged
from proofroll.elements.ball_on_surface.dataset import columns
from proofroll.elements.ball_on_surface.element import BallOnSurface
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.rolling_equations import closed_form
from proofroll.elements.mechanism.run.balls import PlacedBall, ball_as_body
from proofroll.truth import SAFETY
from proofroll.truth.ball_on_surface.rolling import reduced, unreduced

if TYPE_CHECKING:
    import xarray as xr

_AS_BODY: tuple[str, ...] = (
    "p_WB",
    "v_WB",
    "w_WB",
    "q_WB",
    "attitude",
    "omega1",
    "omega2",
    "omega3",
    "slip2",
    "slip3",
    "slip",
    "gap",
)
_AS_BODY += ("energy", "N", "F2", "F3", "needed_friction")
# Relative round-off of a route: values may be wrong by a few machine epsilons even where the routes agree; and the
# error that two integrations may share, which stop refining at 1e-13 a step.
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
        """Motion of the ball and force of the wall on it, with error bars; as a body if the orientation is asked for.

        Without the orientation the motion does not turn with the ball, however small and fast that is. The first
        route is the closed form, or with rolling resistance the reduced equations; the second is Newton-Euler in the
        world, derived and integrated independently.

        Raises:
            Diverged: a route could not be integrated, or a value is not finite.
        """
        assert isinstance(element, BallOnSurface)  # by ``covers``
        if "orientation" in asks:
            return _as_body(element, times, asks)
        body, instants = element.rolling, np.asarray(times, dtype=np.float64)
        with np.errstate(invalid="ignore", divide="ignore"):  # values that are not finite are refused by name below
            exact = closed_form(body, instants)
            first, second = exact or reduced(body, instants), unreduced(body, instants)
            result, check = (_dataset(body, instants, route) for route in (first, second))
        _put_error_bars(result, check, _ROUND_OFF if exact else _SHARED)
        return result.assign_attrs(route=first.route, second_route=second.route)


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


def _as_body(element: BallOnSurface, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
    """Motion of the body that stands for the ball, under the ball's names."""
    from proofroll.truth.plug_in import MechanismTruth

    placed = PlacedBall(
        ball=element.ball, surface=element.surface, contact=element.contact, start=element.start, number=0
    )
    motion = MechanismTruth.truth(ball_as_body(placed, element.gravity, "scene"), times, asks)
    coordinates = element.surface.coordinates
    names = [*coordinates, *(f"{name}_rate" for name in coordinates), *_AS_BODY]
    return motion[[name for name in names if name in motion]].isel(body=0, drop=True)
