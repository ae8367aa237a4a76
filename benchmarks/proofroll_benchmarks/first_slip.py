"""First time at which rolling without slip needs more friction than there is, by Taylor series with an event.

The event is a root of the needed friction's own Taylor polynomial in a step. All its roots in the step are isolated
(by Descartes' rule of signs on ever smaller parts), also the pair under a crest that rises past μ and falls again
within the step, so only a crest within round-off of μ can be missed: there the question itself has no answer.
"""

from __future__ import annotations

import copy
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.heyoka_library import TIGHTEST, require_heyoka
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.compiled import projection, rolling
from proofroll.papers.blajer_2006.ball.model import RollingBall

Model = Literal["reduced", "rotating_frame", "euler"]

# A friction that is never reached, and can still be squared.
UNREACHABLE = 1e100
# Needed friction that differs by less from the available one, relatively, has reached it.
REACHED = 8 * TIGHTEST
# Longest step [s]: only a motion that is a polynomial of time has no other bound.
_LONGEST = 1e3
_TIME_LIMIT = -(2**32) - 3  # heyoka's taylor_outcome.time_limit


def first_slip(scene: Scene, until: float, model: Model = "reduced") -> float | None:
    """Time of the ball's first slip [s]; None: not until ``until`` [s].

    Args:
        scene: a ball in a cylinder along whose axis gravity points.
        until: end of the search [s].
        model: the reduced equations, or the projection method with quasi-velocities or with Euler angles.

    Raises:
        Refused: heyoka is missing, or the scene is another.
    """
    return FirstSlip(rolling_ball(scene), model).run(until)


class FirstSlip:
    """A ball that rolls until it first slips; built once, run as often as wanted.

    Attributes:
        x: state where it stopped: (q, h, v2, v3, ω1) or the projection method's (q, s).
    """

    def __init__(self, body: RollingBall, model: Model = "reduced", tolerance: float = TIGHTEST) -> None:
        """Builds the model; ``tolerance`` is that of each step, relative to the state [-].

        Raises:
            Refused: heyoka is missing, or the scene is another.
        """
        mu = min(body.contact.mu_static, UNREACHABLE)
        require_supported()
        self._scales = np.array(body.surface.length_scales)
        if model == "reduced":
            compiled, margin = _reduced(tolerance)
            self._start = rolling.start(body)
            pars = [*rolling.parameters(body), mu]
        else:
            compiled, margin = _projected(projection.structure(body, model), tolerance)
            self._start = _projected_start(body, model)
            pars = [*projection.parameters(body), mu]
            self._scales = np.ones(2)
        self._integrator = copy.copy(compiled)
        self._integrator.pars[:] = pars
        self._surface = body.surface
        self._at_once = bool(slips_at_once(margin(self._start, pars)))
        self.x = self._start

    def run(self, until: float) -> float | None:
        """Time of the ball's first slip [s]; None: not until ``until`` [s].

        Raises:
            Diverged: the state is not finite.
        """
        self.x = self._start
        if self._at_once:
            return 0.0
        if until <= 0:
            return None
        series = self._integrator
        series.time = 0.0
        series.state[:] = self._start
        series.reset_cooldowns()
        outcome = int(series.propagate_until(until, max_delta_t=_LONGEST)[0])
        self.x = series.state.copy()
        if outcome == _TIME_LIMIT:
            return None
        if outcome != -1:  # the first and only event
            raise Diverged(f"the state is not finite (NaN or overflow) at t = {series.time:.6g} s")
        return float(series.time)

    @property
    def p_WB(self) -> FloatArray:
        """Centre where the ball stopped [m], shape (3,)."""
        return self._surface.position(self.x[:2] / self._scales)


def require_supported() -> None:
    """Refuses what the compiled equations cannot follow to the first slip.

    Raises:
        Missing: heyoka is not installed.
    """
    require_heyoka("a compiled first slip")


def _projected_start(body: RollingBall, formulation: projection.Formulation) -> FloatArray:
    """State [q, s] at time 0; the angles start at θ = π/2, as far from the singularity as can be (Blajer 2006)."""
    if formulation == "rotating_frame":
        return np.concatenate([body.u0, body.udot0, body.surface.frame(body.u0).T @ body.w0])
    w_x, w_y, w_z = body.w0  # there φ turns about -y, θ about x and ψ about z
    return np.concatenate([body.u0, [0.0, np.pi / 2, 0.0], body.udot0, [-w_y, w_x, w_z]])


def slips_at_once(margin: FloatArray) -> Any:
    """True if the ball slips at time 0, from the margins of :func:`margins`, shape (3,) or (3, n)."""
    excess, rate, available = margin
    reached = np.abs(excess) <= REACHED * available
    return np.where(reached, rate > 0, excess > 0)


def margins(excess: Any, available: Any, system: list[tuple[Any, Any]]) -> rolling.Function:
    """State -> excess of needed over available friction (squares), its rate, and the square of what is available."""
    rate = rolling.Expressions.along(excess, system)
    return rolling.Function([excess, rate, available], [variable for variable, _ in system])


@lru_cache(maxsize=16)
def _reduced(tolerance: float) -> tuple[Any, rolling.Function]:
    import heyoka as hy

    symbols = rolling.expressions(resistance=True)
    mu = hy.par[len(rolling.PARAMETERS)]
    available = (symbols.A * mu * symbols.N) ** 2
    return _stopping(symbols.rolling(), symbols.excess(mu), available, tolerance)


@lru_cache(maxsize=16)
def _projected(form: projection.Structure, tolerance: float) -> tuple[Any, rolling.Function]:
    import heyoka as hy

    symbols = projection.equations(form)
    first, second = symbols.multipliers
    available = (hy.par[len(projection.PARAMETERS)] * symbols.N) ** 2
    return _stopping(symbols.system, first**2 + second**2 - available, available, tolerance)


def _stopping(
    system: list[tuple[Any, Any]], excess: Any, available: Any, tolerance: float
) -> tuple[Any, rolling.Function]:
    import heyoka as hy

    event = hy.t_event(excess, direction=hy.event_direction.positive)
    integrator = hy.taylor_adaptive(system, [1.0] * len(system), tol=tolerance, t_events=[event])
    return integrator, margins(excess, available, system)
