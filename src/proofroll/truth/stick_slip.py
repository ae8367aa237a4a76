"""The truth with bounded friction: stick, slip, stick again, by two independent routes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.events import Event
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.events import EventKind
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.truth import taylor
from proofroll.truth.error_bars import SAFETY, dataset_of, put_error_bars
from proofroll.truth.implicit import Implicit
from proofroll.truth.orientation import MATRICES, QUATERNIONS, Quadrature
from proofroll.truth.polar import Polar
from proofroll.truth.route import Path, Route
from proofroll.truth.switching import follow

if TYPE_CHECKING:
    import xarray as xr

# What the routes may have in common, relative to a value's size: both stop refining at 1e-13 per step.
_FLOOR = 1e-12


def first_route(body: RollingBall) -> Route:
    """The route that is taken as the answer: Taylor series where heyoka and the surface allow them, else DOP853."""
    return taylor.SlidingTaylor(body) if taylor.supports(body) else Polar(body)


def stays_on(body: RollingBall, until: float) -> bool:
    """Whether the ball is on the wall until ``until`` [s], as the first route tells it."""
    return all(kind != "lift_off" for kind, _ in follow(body, first_route(body), until).events)


def stick_slip(scene: Scene, times: FloatArray) -> tuple[xr.Dataset, list[Event]]:
    """The true trajectory of one ball on one surface at rising times [s], and the events, with error bars.

    Returns:
        Dataset as of :func:`proofroll.truth.error_bars.dataset_of`, each variable with the attribute ``error_bar`` in
        its own unit, and ``sticking`` (bool per sample; a sample at an event belongs to what follows); and the events
        up to the last sample, each with a bracket that holds both routes. Where the routes disagree about what
        happens, which they do where it hangs on the last digits of the parameters, the attribute ``ill_posed`` says
        from when on; the events are those before, and the error bars as large as the difference.

    Raises:
        Diverged: a route could not be integrated.
        Refused: the ball leaves the wall and lands on it again.
    """
    body = rolling_ball(scene)
    times = np.asarray(times, dtype=np.float64)
    until = float(times[-1])
    routes: tuple[Route, Route] = (first_route(body), Implicit(body))
    paths = [follow(body, route, until) for route in routes]
    if paths[0].lands is not None:
        raise Refused(
            f"the ball leaves the wall at t = {paths[0].events[-1][1]:.9g} s and lands at t = {paths[0].lands:.9g} s; "
            "a restitution law would be needed (restitution of the contact), so end the run before it lands"
        )
    events, common = _events(paths, until)
    result, check = (
        _dataset(scene, times, path, route.name, quadrature)
        for path, route, quadrature in zip(paths, routes, (QUATERNIONS, MATRICES), strict=True)
    )
    put_error_bars(result, check, _FLOOR)
    result.attrs["second_route"] = routes[1].name
    if not common:
        after = events[-1].time if events else 0.0
        result.attrs["ill_posed"] = (
            f"ill-posed: what happens after {after:.9g} s hangs on the last digits of the parameters, "
            "and the two routes to the truth disagree about it"
        )
    return result, events


def _events(paths: list[Path], until: float) -> tuple[list[Event], bool]:
    """The events up to the first about which the routes disagree, and whether there is no such."""
    first, second = (path.events for path in paths)
    # An event at the very end may be in one route and just beyond the end in the other: then it is not an event yet.
    first, second = _without_last(first, second, until), _without_last(second, first, until)
    result = []
    for (kind, time), (other_kind, other) in zip(first, second, strict=False):
        if kind != other_kind:
            break
        wide = SAFETY * (abs(time - other) + _FLOOR * time)
        result.append(Event(kind, time, max(time - wide, 0.0), time + wide))
    return result, len(result) == len(first) == len(second)


def _without_last(
    events: list[tuple[EventKind, float]], others: list[tuple[EventKind, float]], until: float
) -> list[tuple[EventKind, float]]:
    at_end = len(events) == len(others) + 1 and until - events[-1][1] < 1e-9 * until
    return events[:-1] if at_end else events


def _dataset(scene: Scene, times: FloatArray, path: Path, route: str, quadrature: Quadrature) -> xr.Dataset:
    kinks = [leg.end for leg in path.legs]
    motion = path.motion(times, route)
    result = dataset_of(scene, times, motion, lambda at: path.motion(at, route).w_WB, kinks, quadrature)
    attributes = {"units": "1", "long_name": "whether the ball sticks (rolls without slip)"}
    return result.assign(sticking=("time", path.sticking(times), attributes))
