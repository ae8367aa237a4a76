"""Rolling of a ball inside an upright cylinder in five states, as symbolic expressions and compiled series.

The surface bends along the arc length q only, with the curvature k = 1/c, and gravity is along e3. State: arc length q
and height h [m], velocities v2, v3 of the centre [m/s], ω1 [rad/s]; all forces are divided by the mass. With κ =
J/(m a²), A = (1 + κ)/κ and the drive

    b = g + a ω1 e1 × ė1 + (f N / (κ a)) v/|v|

the slip velocity u obeys u̇ = A F + b, whether the ball slips (F = -μk N u/|u|) or sticks (F = -b/A).

The truth's Taylor route and the engine ``reduced`` both use these expressions: only other routes can check them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.model import RollingBall

# Order of the run-time parameters that every expression shares. A product of parameters is a parameter itself, for a
# series would compute it anew in every step.
PARAMETERS = ("k", "g", "k/a", "k a", "A", "1/A", "f/(kappa a)")
STATES = ("q", "h", "v2", "v3", "w1")


@dataclass(frozen=True)
class Expressions:
    """The equations in symbols.

    Attributes:
        state: q, h, v2, v3, ω1.
        swing: k/a [1/m²].
        A, per_A: (1 + κ)/κ [1] and its inverse.
        g: gravity along the axis [m/s²].
        b2, b3: drive [m/s²].
        N: normal force over mass [m/s²].
    """

    state: tuple[Any, ...]
    swing: Any
    A: Any
    per_A: Any
    g: Any
    b2: Any
    b3: Any
    N: Any

    def rates(self, F2: Any, F3: Any, u3: Any = 0.0) -> list[tuple[Any, Any]]:
        """(variable, rate) pairs under the friction F [m/s²], with the slip ``u3`` of the contact along e3 [m/s]."""
        q, h, v2, v3, w1 = self.state
        turning = self.swing * (v3 - u3) * v2
        return [(q, v2), (h, v3), (v2, F2), (v3, self.g + F3), (w1, turning)]

    def rolling(self) -> list[tuple[Any, Any]]:
        """(variable, rate) pairs of rolling without slip."""
        return self.rates(-self.per_A * self.b2, -self.per_A * self.b3)

    def excess(self, mu: Any) -> Any:
        """Guard of slip: zero if rolling needs ``mu`` times the normal force as friction, positive if more."""
        return self.b2**2 + self.b3**2 - (self.A * mu * self.N) ** 2

    @staticmethod
    def along(expression: Any, flow: Sequence[tuple[Any, Any]]) -> Any:
        """Rate of an expression along a flow of (variable, rate) pairs."""
        import heyoka as hy

        return hy.sum([hy.diff(expression, x) * rate for x, rate in flow])


def expressions(resistance: bool) -> Expressions:
    """The equations in symbols; without rolling ``resistance`` the speed may pass through zero."""
    import heyoka as hy

    q, h, v2, v3, w1 = hy.make_vars(*STATES)
    k, g, swing, back, A, per_A, lever = (hy.par[i] for i in range(len(PARAMETERS)))
    N = k * v2**2
    per_speed = lever * N / hy.sqrt(v2**2 + v3**2) if resistance else hy.expression(0.0)
    return Expressions(
        state=(q, h, v2, v3, w1),
        swing=swing,
        A=A,
        per_A=per_A,
        g=g,
        b2=per_speed * v2,
        b3=g + back * w1 * v2 + per_speed * v3,
        N=N,
    )


class Function:
    """A compiled function of states, shape (k,) or (k, n), and of the parameters that it uses."""

    def __init__(self, outputs: Sequence[Any], variables: Sequence[Any]) -> None:
        import heyoka as hy

        self._call = hy.cfunc(list(outputs), list(variables))
        names = [str(par) for output in outputs for par in hy.get_params(output)]
        self._count = 1 + max((int(name.strip("par[]")) for name in names), default=-1)

    def __call__(self, states: FloatArray, pars: Sequence[float] | FloatArray) -> FloatArray:
        """Values, shape (outputs,) or (outputs, n); ``pars`` may also differ from state to state, shape (p, n)."""
        used = np.asarray(pars[: self._count], dtype=np.float64)
        if states.ndim == 2 and used.ndim == 1:
            used = np.repeat(used[:, None], states.shape[1], axis=1)
        return np.asarray(self._call(np.ascontiguousarray(states), pars=np.ascontiguousarray(used)), dtype=np.float64)


@dataclass(frozen=True)
class CompiledEquations:
    """Compiled equations of motion.

    Attributes:
        integrator: heyoka's integrator; copy it before use, for it holds a state.
        evaluate: state -> its rates, and the forces over mass [m/s²].
    """

    integrator: Any
    evaluate: Function


@lru_cache(maxsize=16)
def reduced(resistance: bool, tolerance: float) -> CompiledEquations:
    """Equations compiled for a relative tolerance of each step [1], which also decides the order of the series.

    Its forces over mass are b2/A, b3/A (the friction needed) and N.
    """
    import heyoka as hy

    symbols = expressions(resistance)
    system = symbols.rolling()
    outputs = [*(rate for _, rate in system), symbols.per_A * symbols.b2, symbols.per_A * symbols.b3, symbols.N]
    return CompiledEquations(
        integrator=hy.taylor_adaptive(system, [1.0] * len(system), tol=tolerance),
        evaluate=Function(outputs, symbols.state),
    )


def parameters(body: RollingBall) -> list[float]:
    """Values of :data:`PARAMETERS`."""
    a, kappa, f = body.ball.radius, body.ball.inertia_ratio, body.contact.rolling_resistance
    k, A, g = 1 / body.surface.radius, (1 + kappa) / kappa, float(np.asarray(body.surface.axis) @ body.gravity)
    return [float(value) for value in (k, g, k / a, k * a, A, 1 / A, f / (kappa * a))]


def start(body: RollingBall) -> FloatArray:
    """(q, h, v2, v3, ω1) at time 0."""
    frame = body.surface.frame(body.u0)
    scales = np.array(body.surface.length_scales)
    return np.concatenate([body.u0 * scales, frame[:, 1:].T @ body.v0, [body.w0 @ frame[:, 0]]])
