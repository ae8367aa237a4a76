"""Both routes of a ball that rolls in an upright cylinder as compiled Taylor series (heyoka), for long motions."""

import copy
from functools import lru_cache
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.papers.blajer_2006.ball.compiled.rolling import parameters, start
from proofroll.papers.blajer_2006.ball.compiled.rolling import reduced as compiled_reduced
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion, newton_euler, world_motion
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.truth.numerics.scalars import cross, dot, minus, plus, scaled

# Tolerance of a step: less than round-off.
_TIGHTEST = 1e-18
# Level of the compiler's optimisation: runs are no slower than with more, since sampling takes most of their time.
_LEVEL = 0


def reduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion at rising times [s] by the reduced equations of :mod:`~proofroll.papers.blajer_2006.ball.compiled`.

    Raises:
        Diverged: the series could not be continued.
    """
    model = compiled_reduced(body.contact.rolling_resistance > 0, _TIGHTEST)
    pars = np.array(parameters(body))
    states = _sampled(model.integrator, pars[: len(model.integrator.pars)], start(body), times)
    held2, held3, N = model.evaluate(states.T, pars)[5:]
    return world_motion(
        body,
        states[:, :2] / np.array(body.surface.length_scales),
        velocity=states[:, 2:4],
        spin=states[:, 4],
        friction=-body.ball.mass * np.stack([held2, held3], axis=-1),
        press=body.ball.mass * N,
        route="reduced equations, Taylor series",
    )


def unreduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion at rising times [s] by Newton-Euler in the world, see :func:`_compiled`.

    Raises:
        Diverged: the series could not be continued.
    """
    ball, axis = body.ball, np.asarray(body.surface.axis)
    resists = body.contact.rolling_resistance > 0
    pars = [ball.radius, ball.inertia_ratio, *body.gravity, *axis]
    pars += [body.contact.rolling_resistance] if resists else []
    states = _sampled(_compiled(resists), np.array(pars), np.concatenate([body.p0, body.w0]), times)
    p, w = states[:, :3], states[:, 3:]
    v = ball.radius * np.cross(body.surface.normal(p), w)
    force = np.array([newton_euler(body, *x)[2] for x in zip(p, v, w, strict=True)])
    return BallMotion(p_WB=p, v_WB=v, w_WB=w, force=force, route="unreduced Newton-Euler, Taylor series")


def _sampled(integrator: Any, pars: FloatArray, x: FloatArray, times: FloatArray) -> FloatArray:
    """States at rising times [s] from the state ``x`` at the first one on, shape (n, k)."""
    series = copy.copy(integrator)  # the original is shared
    series.time, series.pars[:], series.state[:] = 0.0, pars, x
    spans = np.asarray(times - times[0], dtype=np.float64)
    states = series.propagate_grid(spans)[-1] if len(spans) > 1 else series.state[None, :]
    if len(states) < len(times) or not np.all(np.isfinite(states)):
        raise Diverged(f"the truth (Taylor series) could not be integrated past {series.time:g} s")
    return np.array(states)


@lru_cache(maxsize=2)
def _compiled(resists: bool) -> Any:
    """Compiled integrator of p and ω, which give v = a e1 × ω.

    Of the wall only the direction of its normal e1 and its rate are used. With F the force of the wall and M = f N
    (v/V) × (-e1) the moment of rolling resistance, differentiating e1·v = 0 and v + a ω × e1 = 0 gives, with Newton's
    m (v̇ - g) = F and Euler's κ m a² ω̇ = a e1 × F + M,

        e1·v̇ = -ė1·v,      (1 + κ) v̇ = g - κ a ω × ė1 - M × e1 / (m a) along the wall.

    No projection keeps the states on the wall, so errors remain visible.
    """
    import heyoka as hy

    p, w = (hy.make_vars(*(f"{name}{axis}" for axis in "xyz")) for name in "pw")
    a, kappa, g, axis = hy.par[0], hy.par[1], [hy.par[i] for i in (2, 3, 4)], [hy.par[i] for i in (5, 6, 7)]

    def across(x: Any, direction: Any) -> list[Any]:
        return minus(x, scaled(dot(x, direction), direction))

    radial = across(p, axis)
    distance = hy.sqrt(dot(radial, radial))
    e1 = [x / distance for x in radial]
    v = scaled(a, cross(e1, w))
    e1_rate = [x / distance for x in across(across(v, axis), e1)]
    bent = dot(e1_rate, v)
    pressed = bent + dot(g, e1)  # normal force over mass
    driven = minus(g, scaled(kappa * a, cross(w, e1_rate)))
    moment = [hy.expression(0.0)] * 3  # over mass
    if resists:
        moment = scaled(-hy.par[8] * pressed / hy.sqrt(dot(v, v)), cross(v, e1))
        driven = minus(driven, [x / a for x in cross(moment, e1)])
    v_rate = plus([x / (1 + kappa) for x in across(driven, e1)], scaled(-bent, e1))
    turned = plus(scaled(a, cross(e1, minus(v_rate, g))), moment)
    w_rate = [x / (kappa * a**2) for x in turned]
    rates = zip([*p, *w], [*v, *w_rate], strict=True)
    return hy.taylor_adaptive(list(rates), [1.0] * 6, tol=_TIGHTEST, opt_level=_LEVEL)
