"""The truth with bounded friction: stick, slip, stick again, by two independent routes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.events import Event, EventKind
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.dataset import variables
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.truth import taylor
from proofroll.truth.error_bars import put_error_bars
from proofroll.truth.implicit import Implicit
from proofroll.truth.polar import Polar
from proofroll.truth.switching import Path, Route, follow

if TYPE_CHECKING:
    import xarray as xr

# What the routes may have in common, relative to a value's size: both stop refining at 1e-13 per step.
_FLOOR = 1e-12


def first_route(body: RollingBall) -> Route[FloatArray]:
    """The route that is taken as the answer: Taylor series where heyoka and the surface allow them, else DOP853."""
    return taylor.Taylor(body) if taylor.available() and taylor.supports(body) else Polar(body)


def stick_slip(scene: Scene, times: FloatArray) -> tuple[xr.Dataset, list[Event]]:
    """The true trajectory and the events, with error bars.

    Args:
        scene: one ball on one surface; starts rolling without slip at time 0.
        times: of the samples [s], rising, shape (time,).

    Returns:
        Dataset as of :func:`trajectory.trajectory`, each variable with the attribute ``error_bar`` in its
        own unit, and ``sticking`` (bool per sample; a sample at an event belongs to what follows); and the events up
        to the last sample, each with a bracket that holds both routes.

    Raises:
        Diverged: the routes disagree about the order of events, which happens where it hangs on the last digits.
        Refused: the ball leaves the wall and lands on it again.
    """
    body = rolling_ball(scene)
    times = np.asarray(times, dtype=np.float64)
    until = float(times[-1])
    routes: tuple[Route[FloatArray], Route[FloatArray]] = (first_route(body), Implicit(body))
    paths = [follow(body, route, until) for route in routes]
    events = _events(paths, until)
    result, check = (_dataset(scene, times, path, route.name) for path, route in zip(paths, routes, strict=True))
    put_error_bars(result, check, _FLOOR)
    result.attrs["route"], result.attrs["second_route"] = routes[0].name, routes[1].name
    return result, events


def _events(paths: list[Path[FloatArray]], until: float) -> list[Event]:
    first, second = (path.events for path in paths)
    # An event at the very end may be in one route and just beyond the end in the other: then it is not an event yet.
    first, second = _without_last(first, second, until), _without_last(second, first, until)
    kinds: list[list[EventKind]] = [[kind for kind, _ in events] for events in (first, second)]
    if kinds[0] != kinds[1]:
        common = next((i for i, (a, b) in enumerate(zip(*kinds, strict=False)) if a != b), min(map(len, kinds)))
        after = first[common - 1][1] if common else 0.0
        raise Diverged(
            f"the two routes to the truth disagree about what happens after {after:.9g} s; "
            "there it hangs on the last digits of the parameters, so change one of them a little"
        )
    result = []
    for (kind, time), (_, other) in zip(first, second, strict=True):
        floor = _FLOOR * time
        result.append(Event(kind, time, max(min(time, other) - floor, 0.0), max(time, other) + floor))
    return result


def _without_last(
    events: list[tuple[EventKind, float]], others: list[tuple[EventKind, float]], until: float
) -> list[tuple[EventKind, float]]:
    at_end = len(events) == len(others) + 1 and until - events[-1][1] < 1e-9 * until
    return events[:-1] if at_end else events


def _dataset(scene: Scene, times: FloatArray, path: Path[FloatArray], route: str) -> xr.Dataset:
    motion, sticking = path.motion(times, route)
    result = variables(rolling_ball(scene), times, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
    attributes = {"units": "1", "long_name": "whether the ball sticks (rolls without slip)"}
    return result.assign(sticking=("time", sticking, attributes))
