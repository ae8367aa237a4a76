"""First slips in bulk: one compiled integrator whose vector lanes each roll a ball of their own.

A lane whose ball has slipped, or whose time is over, takes the next ball at once, inside the integrator's own loop.
The equations are those of the element's compiled rolling without the arc length and height, on which nothing depends
where gravity points along the cylinder's axis; the event is that of :mod:`proofroll_benchmarks.first_slip`.
"""

from __future__ import annotations

import copy
import threading
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.compiled import rolling
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll_benchmarks.first_slip import UNREACHABLE, margins, require_supported, slips_at_once

# Parameters of the equations, and the friction.
_PARAMETERS = (*rolling.PARAMETERS, "mu")
# Error of a step relative to the state. Next to a crest the time of slip costs half the digits: with this it keeps ten.
_TOLERANCE = 1e-15
# Longer than any ball rolls [s]: a lane that has no ball left waits for the others.
_NEVER = 1e9
# Later than all balls together [s]: the callbacks end the run.
_FAR = 1e15
# Friction that a waiting lane never reaches.
_HOLDING = 1e10


def first_slips(scene: Scene, until: float, v2: npt.ArrayLike, mu: npt.ArrayLike, f: npt.ArrayLike) -> FloatArray:
    """First slips of balls that differ from the scene's [s], shape (n,); NaN: not until ``until`` [s].

    The start is rolling without slip at the scene's point of the cylinder. A single time is as accurate as that of
    :func:`proofroll_benchmarks.first_slip.first_slip`.

    Args:
        scene: a ball in a cylinder along whose axis gravity points.
        until: end of the search [s].
        v2: initial speed of the centre along e2, V0 [m/s], shape (n,), or one for all.
        mu: static friction [-], likewise; inf never slips.
        f: rolling resistance [m], likewise.

    Raises:
        Refused: heyoka is missing, or the scene is another.
    """
    body = rolling_ball(scene)
    require_supported()
    varied = np.broadcast_arrays(*(np.asarray(values, dtype=np.float64) for values in (v2, mu, f)))
    return _Lanes(body, *varied).run(until)


class _Lanes:
    """Balls that wait for the lanes of one integrator."""

    def __init__(self, body: RollingBall, v2: FloatArray, mu: FloatArray, f: FloatArray) -> None:
        lever = f / (body.ball.inertia_ratio * body.ball.radius)
        own = np.repeat(np.array([rolling.parameters(body)[:-1]]).T, mu.size, axis=1)
        self._pars = np.vstack([own, lever, np.minimum(mu, UNREACHABLE)])
        _, v3, w1 = rolling.start(body)[2:].tolist()
        self._starts = np.array([v2, np.full(mu.size, v3), np.full(mu.size, w1), np.zeros(mu.size)])
        # The same once more as one row per ball, to be taken by a lane at once.
        self._start_of = self._starts.T.copy()
        template, self._margins = _compiled()
        # heyoka's copy shares the compiled code; the callbacks find their lanes by thread.
        self._integrator = copy.copy(template)
        self._found = np.full(mu.size, np.nan)

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


@cache
def _compiled() -> tuple[Any, rolling.Function]:
    """The integrator of (v2, v3, ω1, t), and the margins at such states.

    Its parameters are those of the equations, μ, and the time at which a ball is given up.
    """
    import heyoka as hy

    symbols = rolling.expressions(resistance=True)
    anywhere = {symbols.state[0]: hy.expression(0.0)}  # gravity along the axis is the same at every q
    clock, mu, limit = hy.make_vars("clock"), hy.par[len(_PARAMETERS) - 1], hy.par[len(_PARAMETERS)]
    rates = [(variable, hy.subs(rate, anywhere)) for variable, rate in symbols.rolling()[2:]]
    system = [*rates, (clock, hy.expression(1.0))]
    excess = hy.subs(symbols.excess(mu), anywhere)
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
    return integrator, margins(excess, hy.subs((symbols.A * mu * symbols.N) ** 2, anywhere), system)
