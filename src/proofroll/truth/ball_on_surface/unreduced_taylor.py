"""Newton-Euler equations in the world as compiled Taylor series (heyoka): the second route of long motions.

The nine states (p, v, ω), their equations and their constraints are those of :func:`.rolling.unreduced`. Of the wall
only the direction of its normal and the rate of that direction are used. Differentiating e1·v = 0 and v + a ω × e1 = 0
gives, with Newton's m (v̇ - g) = F and Euler's κ m a² ω̇ = a e1 × F,

    e1·v̇ = -ė1·v,      (1 + κ) v̇ = g - κ a ω × ė1 along the wall,      κ a ω̇ = e1 × (v̇ - g).

No projection keeps the states on the constraints, so errors remain visible.
"""

import copy
import threading
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from proofroll.core import heyoka_library as library
from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.elements.ball_on_surface.mechanics import newton_euler
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll.truth.numerics.scalars import cross, dot, minus, plus, scaled

_local = threading.local()
# Optimisation level of the compiler: with 0 the series compile in a tenth of the time that the default, 3, takes. Runs
# are no slower, since sampling takes most of their time.
_LEVEL = 0


def available(body: RollingBall) -> bool:
    """True if heyoka is installed and has the equations: those without rolling resistance."""
    return not body.contact.rolling_resistance and library.available()


def unreduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion by the unreduced equations at rising times [s], from their compiled series.

    Raises:
        Diverged: the series could not be continued.
    """
    p, v, w = (np.array(part) for part in np.split(states(body, times), 3, axis=1))
    force = np.array([newton_euler(body, *x)[2] for x in zip(p, v, w, strict=True)])
    return BallMotion(p_WB=p, v_WB=v, w_WB=w, force=force, route="unreduced Newton-Euler, Taylor series")


def states(body: RollingBall, times: FloatArray) -> FloatArray:
    """States p, v and ω at rising times [s], shape (n, 9); computing forces would take longer than the series.

    Raises:
        Diverged: the series could not be continued.
    """
    series = _integrator(body, bounded=False)
    series.time, series.state[:] = float(times[0]), np.concatenate([body.p0, body.v0, body.w0])
    samples = (
        series.propagate_grid(np.asarray(times, dtype=np.float64))[-1] if len(times) > 1 else series.state[None, :]
    )
    if len(samples) < len(times) or not np.all(np.isfinite(samples)):
        raise _stopped(series)
    return np.array(samples)


def until_slip(
    body: RollingBall, time: float, state: FloatArray, until: float
) -> tuple[float, bool, Callable[[FloatArray], FloatArray]]:
    """Rolling under bounded friction, until the needed friction exceeds the available friction.

    Args:
        body: the ball, always pressed against its wall, which is at rest.
        time: start [s].
        state: p and ω at the start, shape (6,).
        until: time limit [s].

    Returns:
        Time of the end [s]; True if the friction was used up there; and a function: times in between [s] to p and ω,
        shape (n, 6).

    Raises:
        Diverged: the series could not be continued.
    """
    series = _integrator(body, bounded=True)
    series.time, series.state[:] = time, state
    series.reset_cooldowns()
    code, *_, dense, _ = series.propagate_until(until, c_output=True)
    slips = int(code) == -1  # terminal events are numbered -1, -2, …
    if not (slips or series.time == until) or not np.all(np.isfinite(series.state)):
        raise _stopped(series)
    return float(series.time), slips, lambda times: np.array(dense(times))


def _stopped(series: Any) -> Diverged:
    return Diverged(f"the truth (Taylor series in the world) could not be integrated past {series.time:g} s")


def _integrator(body: RollingBall, bounded: bool) -> Any:
    """Integrator with the parameters of ``body``; with bounded friction it stops where that is used up."""
    surface = body.surface
    if not hasattr(_local, "integrators"):
        _local.integrators = cache(_compiled)  # an integrator holds a state and must not be shared between threads
    # All cylinders share one integrator, and all planes.
    round_axis = isinstance(surface, Cylinder)
    series = copy.copy(_local.integrators(round_axis, bounded))
    e1 = surface.normal(body.p0)
    values = [body.ball.radius, body.ball.inertia_ratio, *body.gravity]
    if isinstance(surface, Cylinder):
        axis = np.asarray(surface.generators[1].axis)
        values += [*axis, np.sign(e1 @ (body.p0 - (body.p0 @ axis) * axis))]
    else:
        values += e1.tolist()
    series.pars[:] = [*values, *([body.contact.mu_static] if bounded else [])]
    return series


def _compiled(round_axis: bool, bounded: bool) -> Any:
    """Compiled integrator for all cylinders or all planes.

    Args:
        round_axis: True for cylinders.
        bounded: True: the integrator stops where friction is used up, and has only the states p and ω: rolling on a
            wall gives v = a e1 × ω, which then cannot drift.
    """
    import heyoka as hy

    p, free, w = (hy.make_vars(*(f"{name}{axis}" for axis in "xyz")) for name in "pvw")
    a, kappa = hy.par[0], hy.par[1]
    g, k, outward = [hy.par[i] for i in (2, 3, 4)], [hy.par[i] for i in (5, 6, 7)], hy.par[8]

    def across(x: Any, axis: Any) -> list[Any]:
        return minus(x, scaled(dot(x, axis), axis))

    if round_axis:
        radial = across(p, k)
        distance = hy.sqrt(dot(radial, radial))
        e1 = [outward * x / distance for x in radial]
    else:
        e1 = k
    v = scaled(a, cross(e1, w)) if bounded else free
    e1_rate = [outward * x / distance for x in across(across(v, k), e1)] if round_axis else [0.0, 0.0, 0.0]
    driven = scaled(-a, cross(w, e1_rate))
    along_wall = across([x / (1 + kappa) for x in plus(g, scaled(kappa, driven))], e1)
    v_rate = plus(along_wall, scaled(-dot(e1_rate, v), e1))
    force = minus(v_rate, g)  # force of the wall per unit mass
    w_rate = [x / (kappa * a) for x in cross(e1, force)]
    if not bounded:
        return hy.taylor_adaptive(
            list(zip([*p, *v, *w], [*v, *v_rate, *w_rate], strict=True)), [1.0] * 9, opt_level=_LEVEL
        )
    mu = hy.par[9 if round_axis else 8]  # the first free parameter
    pressed = -dot(force, e1)
    friction = plus(force, scaled(pressed, e1))
    used_up = hy.t_event(dot(friction, friction) - (mu * pressed) ** 2, direction=hy.event_direction.positive)
    return hy.taylor_adaptive(
        list(zip([*p, *w], [*v, *w_rate], strict=True)), [1.0] * 6, t_events=[used_up], opt_level=_LEVEL
    )
