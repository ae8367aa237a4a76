"""Truth with bounded friction, rolling resistance or lift-off: stick and slip by two independent routes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import ENDED, ENDS
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import Event, EventKind, with_events
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.mechanics import always_pressed, natural_speed
from proofroll.elements.ball_on_surface.model import BallCapability, RollingBall
from proofroll.truth import SAFETY
from proofroll.truth.ball_on_surface import taylor
from proofroll.truth.ball_on_surface.error_bars import dataset_of, put_error_bars
from proofroll.truth.ball_on_surface.implicit import Implicit
from proofroll.truth.ball_on_surface.orientation import MATRICES, QUATERNIONS, Quadrature
from proofroll.truth.ball_on_surface.polar import Polar
from proofroll.truth.ball_on_surface.route import Path, Route
from proofroll.truth.ball_on_surface.switching import follow
from proofroll.truth.numerics.conditioning import MOVE, Story, in_common, well_posed_events

if TYPE_CHECKING:
    import xarray as xr

# Relative error that the routes may share: both stop refining at 1e-13 per step.
_FLOOR = 1e-12


def first_route(body: RollingBall) -> Route:
    """Route whose values are the answer: Taylor series if heyoka and the surface allow it, else DOP853."""
    return taylor.SlidingTaylor(body) if taylor.supports(body) else Polar(body)


def stays_on(body: RollingBall, until: float) -> bool:
    """True if the ball is known to stay on the wall until ``until`` [s], by the first route."""
    path = follow(body, first_route(body), until)
    return not np.isfinite(path.end) and all(kind != EventKind.LIFT_OFF for kind, _ in path.events)


def stick_slip(scene: Scene, times: FloatArray) -> tuple[xr.Dataset, list[Event]]:
    """True trajectory of a ball on a surface at rising times [s], and its events, with error bars.

    Returns:
        Dataset of :func:`.error_bars.dataset_of`, each variable with the attribute ``error_bar`` in its own unit, and
        ``sticking`` (bool per sample; a sample at an event belongs to the later stretch), with its events if friction
        is bounded or there are some; events up to the last sample, each with a bracket that contains both routes. If
        relative changes of the parameters by :data:`proofroll.truth.numerics.conditioning.MOVE` (:func:`with_changes`)
        change the events, the attribute ``ill_posed`` says from which time on; only earlier events are returned, and
        error bars cover the difference of the routes. Where the motion is not known to the last time, the dataset has
        the samples before its end, and says when and why it ends (:data:`proofroll.core.dataset.ENDS`).

    Raises:
        Diverged, Refused: a route follows no motion from time 0 on.
    """
    body, bounded = rolling_ball(scene), BallCapability.BOUNDED_FRICTION in scene.requires
    times = np.asarray(times, dtype=np.float64)
    until = float(times[-1])
    routes: tuple[Route, Route] = (first_route(body), Implicit(body))
    paths = [follow(body, route, until) for route in routes]
    pace = body.ball.radius / natural_speed(body)
    shorter = min(paths, key=lambda path: path.end)
    if end := np.isfinite(shorter.end):
        until = shorter.end
        inside = times < until - MOVE * max(until, pace)
        inside[0] = True
        times = times[inside]
    events_1, events_2 = (path.events for path in paths)
    number, posed_throughout = in_common(events_1, events_2, pace, until)
    why = "the two routes to the truth disagree about it"
    posed, well = _unmoved(body, paths[1], pace, until)
    if not well:
        number, posed_throughout = min(number, posed), False
        why = f"a relative {MOVE:g} of friction, resistance or gravity changes it"
    events = []
    certain = until - MOVE * max(until, pace)  # the last digits would say whether an event at the end is in
    shared = [both for both in zip(events_1[:number], events_2, strict=False) if both[0][1] < certain]
    for (kind, time), (_, second_time) in shared:
        wide = SAFETY * (abs(time - second_time) + _FLOOR * time)
        events.append(Event(kind, time, max(time - wide, 0.0), time + wide))
    result, check = (
        _dataset(scene, times, path, route.name, quadrature)
        for path, route, quadrature in zip(paths, routes, (QUATERNIONS, MATRICES), strict=True)
    )
    put_error_bars(result, check, _FLOOR)
    result.attrs["second_route"] = routes[1].name
    if end:
        result.attrs |= {ENDS: shorter.end, ENDED: shorter.ended or _landing(shorter)}
    if not posed_throughout:
        last_event = events[-1].time if events else 0.0
        result.attrs["ill_posed"] = (
            f"ill-posed: what happens after {last_event:.9g} s depends on the last digits of the parameters: {why}"
        )
    if bounded or events:
        result = with_events(result, events)
    return result, events


def _landing(path: Path) -> str:
    """Reason why a path ends at a landing, as a clause."""
    return (
        f"the ball leaves the wall at t = {path.events[-1][1]:.9g} s and lands at t = {path.end:.9g} s; a restitution "
        "law would be needed (restitution of the contact), so end the run before it lands"
    )


def with_changes(body: RollingBall, part: float) -> RollingBall:
    """Ball with friction, rolling resistance and gravity changed by this relative amount or less.

    Zero stays zero. The amounts differ, so that two changes cannot cancel.
    """
    contact = body.contact
    contact = replace(
        contact,
        mu_static=contact.mu_static * (1 + part),
        mu_kinetic=contact.mu_kinetic * (1 + part),
        rolling_resistance=contact.rolling_resistance * (1 - part),
    )
    return replace(body, contact=contact, gravity=body.gravity * (1 - part / 2))


def _unmoved(body: RollingBall, path_now: Path, pace: float, until: float) -> tuple[int, bool]:
    """See :func:`~proofroll.truth.numerics.conditioning.well_posed_events`; few steps of route 2 near an edge."""
    contact = body.contact
    if always_pressed(body) and not (contact.rolling_resistance or np.isfinite(contact.mu_static)):
        return len(path_now.events), True  # nothing can switch

    def story(path: Path) -> Story:
        def states(times: FloatArray) -> FloatArray:
            motion = path.motion(times, "")
            speed = natural_speed(body)
            a = body.ball.radius
            return np.hstack([motion.p_WB / a, motion.v_WB / speed, motion.w_WB * a / speed])

        return Story(path.events, states)

    try:
        others = [follow(ball, Implicit(ball), until) for ball in (with_changes(body, -MOVE), with_changes(body, MOVE))]
    except (Diverged, Refused):
        return 0, False  # a changed ball has no known motion to the end
    until = min(until, *(path.end for path in others))
    return well_posed_events(story(path_now), [story(path) for path in others], pace, until)


def _dataset(scene: Scene, times: FloatArray, path: Path, route: str, quadrature: Quadrature) -> xr.Dataset:
    kinks = [stretch.end for stretch in path.stretches]
    motion = path.motion(times, route)
    result = dataset_of(scene, times, motion, lambda instants: path.motion(instants, route).w_WB, kinks, quadrature)
    attributes = {"units": "1", "long_name": "whether the ball sticks (rolls without slip)"}
    return result.assign(sticking=("time", path.sticking(times), attributes))
