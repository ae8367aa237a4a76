"""First slips in bulk: one compiled integrator whose vector lanes each roll a ball of their own.

A lane whose ball has slipped, or whose time is over, takes the next ball at once, inside the integrator's own loop.
The equations are those of the element's compiled rolling without the arc length and height, on which nothing depends
where gravity is uniform along the surface; the event is that of :mod:`proofroll_benchmarks.first_slip`.
"""

from __future__ import annotations

import copy
import threading
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, InputError
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.compiled import rolling
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll_benchmarks.first_slip import (
    UNREACHABLE,
    margins,
    require_supported,
    slips_at_once,
)

# What may differ from ball to ball: parameters of the equations, and the start.
_PARAMETERS = (*rolling.PARAMETERS, "mu")
_VARIED = ("v2", "v3", "w1", "f", "mu", "radius", "kappa", "c")
# Error of a step relative to the state. Next to a crest the time of slip costs half the digits: with this it keeps ten.
_TOLERANCE = 1e-15
# Longer than any ball rolls [s]: a lane that has no ball left waits for the others.
_NEVER = 1e9
# Later than all balls together [s]: the callbacks end the run.
_FAR = 1e15
# Friction that a waiting lane never reaches.
_HOLDING = 1e10


def first_slips(
    scene: Scene,
    until: float,
    *,
    v2: npt.ArrayLike | None = None,
    v3: npt.ArrayLike | None = None,
    w1: npt.ArrayLike | None = None,
    f: npt.ArrayLike | None = None,
    mu: npt.ArrayLike | None = None,
    radius: npt.ArrayLike | None = None,
    kappa: npt.ArrayLike | None = None,
    c: npt.ArrayLike | None = None,
) -> FloatArray:
    """When balls that differ from the scene's first slip [s]; NaN: not until ``until`` [s].

    All arrays are broadcast against each other, and so is the result; None is the scene's own value. The start is
    rolling without slip at the scene's point of the surface. A single time is as accurate as that of
    :func:`proofroll_benchmarks.first_slip.first_slip`.

    Args:
        scene: a ball on a cylinder or plane.
        until: how long to look [s].
        v2: initial speed of the centre along e2, on the cylinder V0 [m/s].
        v3: initial speed of the centre along e3 [m/s].
        w1: initial spin about the normal [rad/s].
        f: rolling resistance [m].
        mu: static friction [-]; inf never slips.
        radius: of the ball, a [m].
        kappa: J/(m a²) [-].
        c: radius of the centre's path on a cylinder [m]; None: of the wall less that of the ball.

    Raises:
        InputError: a value that makes no sense, or shapes that do not go together.
        Refused: heyoka is missing, or the scene is not one of the compiled equations.
    """
    given = dict(zip(_VARIED, (v2, v3, w1, f, mu, radius, kappa, c), strict=True))
    values, shape = _broadcast(scene, until, given)
    require_supported(rolling_ball(scene), resistance=bool(np.any(values["f"] > 0)))
    found = np.full(values["mu"].shape, np.nan)
    for resistance in (False, True):
        members = np.flatnonzero((values["f"] > 0) == resistance)
        if len(members):
            chosen = {name: value[members] for name, value in values.items()}
            found[members] = _Lanes(scene, chosen, resistance).run(until)
    return found.reshape(shape)


def _broadcast(scene: Scene, until: float, given: dict[str, Any]) -> tuple[dict[str, FloatArray], tuple[int, ...]]:
    """Every varied quantity as an array of one dimension, and the shape of the result."""
    body = rolling_ball(scene)
    if not np.isfinite(until) or until < 0:
        raise InputError("until", until, "give a finite time in s that is not negative")
    if given["c"] is not None and not isinstance(body.surface, Cylinder):
        raise InputError("c", "…", "only a cylinder has it; leave it out")
    own = dict(zip(("v2", "v3", "w1"), rolling.start(body)[2:].tolist(), strict=True))
    own |= {"f": body.contact.rolling_resistance, "mu": body.contact.mu_static}
    own |= {"radius": body.ball.radius, "kappa": body.ball.inertia_ratio}
    arrays = {}
    for name, value in given.items():
        if name == "c":
            continue
        try:
            arrays[name] = np.asarray(own[name] if value is None else value, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(name, value, "give a number or an array of numbers") from None
    if given["c"] is not None:
        arrays["c"] = np.asarray(given["c"], dtype=np.float64)
    elif isinstance(body.surface, Cylinder):  # the wall stays where it is
        arrays["c"] = body.surface.radius + body.ball.radius - arrays["radius"]
    for name, array in arrays.items():
        _require_sense(name, array)
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.ndim)
        raise InputError("shapes", shapes, "give arrays that can be broadcast against each other") from None
    return {name: np.broadcast_to(array, shape).ravel() for name, array in arrays.items()}, shape


def _require_sense(name: str, array: FloatArray) -> None:
    lowest, strict = {"f": (0.0, False), "mu": (0.0, False)}.get(name, (0.0, True))
    signed = name in {"v2", "v3", "w1"}
    bad = ~np.isfinite(array) & ~((name == "mu") & (array == np.inf))
    if not signed:
        bad |= (array <= lowest) if strict else (array < lowest)
    if np.any(bad):
        rule = "finite numbers" if signed else "positive numbers" if strict else "numbers that are not negative"
        raise InputError(name, float(array[bad][0]), f"give {rule}")


class _Lanes:
    """Balls of one kind, waiting for the lanes of one integrator."""

    def __init__(self, scene: Scene, values: dict[str, FloatArray], resistance: bool) -> None:
        body, count = rolling_ball(scene), len(values["mu"])
        uniform = rolling.is_uniform(body)
        curvature = 1 / values["c"] if "c" in values else 0.0
        gravity = rolling.local_gravity(body).tolist()
        pars = rolling.parameters_of(curvature, gravity, values["radius"], values["kappa"], values["f"])
        pars.append(np.minimum(values["mu"], UNREACHABLE))
        self._pars = np.array([np.broadcast_to(value, count) for value in pars])
        start = [values["v2"], values["v3"], values["w1"], np.zeros(count)]
        if not uniform:
            start.append(body.u0[0] * values["c"])
        self._starts = np.array(start)
        # The same once more as one row per ball, to be taken by a lane at once.
        self._start_of = self._starts.T.copy()
        template, self._margins = _compiled(resistance, uniform)
        # heyoka's copy shares the compiled code; the callbacks find their lanes by thread.
        self._integrator = copy.copy(template)
        self._found = np.full(count, np.nan)

    def run(self, until: float) -> FloatArray:
        """Times of first slip [s], shape (n,)."""
        at_once = slips_at_once(self._margins(self._starts, self._pars))
        self._found[at_once] = 0.0
        waiting = np.flatnonzero(~at_once & (self._pars[-1] < UNREACHABLE))
        if not len(waiting) or until <= 0:
            return self._found
        series = self._integrator
        limits = np.full((1, self._pars.shape[1]), until)
        self._pars_of = np.vstack([self._pars, limits]).T.copy()
        self._clocks, self._lanes = series.state[3], list(zip(series.state.T, series.pars.T, strict=True))
        self._next: Iterator[int] = iter(waiting.tolist())
        self._ball = [-1] * series.batch_size
        self._busy: int = min(len(waiting), series.batch_size)
        for lane in range(series.batch_size):
            if not self._take(lane):
                self._park(lane, int(waiting[0]))
        series.set_time(0.0)
        series.reset_cooldowns()
        _running.lanes = self
        try:
            # No step is longer than what is looked at: only a motion that is a polynomial of time would take one.
            series.propagate_until(_FAR, max_delta_t=[until] * series.batch_size)
        finally:
            del _running.lanes
        if self._busy:
            raise Diverged("a state is not finite (NaN or overflow)")
        return self._found

    def ended(self, lane: int, slipped: bool) -> bool:
        """A lane's ball slipped or its time is over; gives the lane the next. Returns whether to go on."""
        ball = self._ball[lane]
        if ball < 0:  # it waits
            return True
        if slipped:
            self._found[ball] = self._clocks[lane]
        if not self._take(lane):
            self._busy -= 1
            self._park(lane, ball)
        return self._busy > 0

    def _take(self, lane: int) -> bool:
        ball = next(self._next, -1)
        self._ball[lane] = ball
        if ball < 0:
            return False
        state, pars = self._lanes[lane]
        state[:], pars[:] = self._start_of[ball], self._pars_of[ball]
        return True

    def _park(self, lane: int, ball: int) -> None:
        """The lane rolls some ball again, with friction that holds for ever."""
        state, pars = self._lanes[lane]
        state[:], pars[:] = self._start_of[ball], self._pars_of[ball]
        pars[-2:] = _HOLDING, _NEVER


_running = threading.local()


def _slipped(_series: Any, _direction: int, lane: int) -> bool:
    lanes: _Lanes = _running.lanes
    return lanes.ended(lane, slipped=True)


def _timed_out(_series: Any, _direction: int, lane: int) -> bool:
    lanes: _Lanes = _running.lanes
    return lanes.ended(lane, slipped=False)


@lru_cache(maxsize=8)
def _compiled(resistance: bool, uniform: bool) -> tuple[Any, rolling.Function]:
    """The integrator of (v2, v3, ω1, t) and, where gravity is not uniform, q; and the margins at such states.

    Its parameters are those of the equations, μ, and the time at which a ball is given up.
    """
    import heyoka as hy

    found = rolling.expressions(resistance, uniform)
    clock, mu, limit = hy.make_vars("clock"), hy.par[len(_PARAMETERS) - 1], hy.par[len(_PARAMETERS)]
    arc, _, *needed = found.rolling()
    system = [*needed, (clock, hy.expression(1.0)), *([] if uniform else [arc])]
    excess = found.excess(mu)
    lanes = hy.recommended_simd_size()
    up = hy.event_direction.positive
    # A lane's next ball has nothing to do with the last one, so no event needs to be kept from coming twice.
    events = [
        hy.t_event_batch(excess, direction=up, cooldown=0.0, callback=_slipped),
        hy.t_event_batch(clock - limit, direction=up, cooldown=0.0, callback=_timed_out),
    ]
    integrator = hy.taylor_adaptive_batch(
        system,
        np.ones((len(system), lanes)),
        pars=np.ones((len(_PARAMETERS) + 1, lanes)),
        tol=_TOLERANCE,
        t_events=events,
    )
    return integrator, margins(excess, (found.A * mu * found.N) ** 2, system)
