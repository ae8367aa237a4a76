"""Implicit collocation at Radau points: order 2s - 1, stiffly accurate, never evaluated at the start of a step.

Hence its use here: at the start of a slip the direction of slip is undefined, and no special start is needed. The error
of a step is estimated by the decay of the Legendre coefficients of the collocation polynomial, so the polynomial is as
accurate within a step as at its ends.

Source of the method: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import lu_factor, lu_solve

from proofroll.core.arrays import FloatArray

_STAGES = 13
_NEWTON = 9  # Newton iterations at most; a step that needs more is repeated with a shorter length
_GOOD = 1e-4  # first Newton correction, relative to the scale, up to which the Jacobians are kept
_NOISE = 3e-16  # last Legendre coefficients, relative to the scale, that are only round-off
_SEEN = 1e-13  # Legendre coefficients, relative to the scale, that exceed round-off
_ROUND_OFF = 1e-15  # Newton corrections, relative to the scale, that are only round-off


def _tableau(stages: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Radau nodes in (0, 1], integration matrix, and the matrix from values at the nodes to Legendre coefficients."""
    # Right Radau points: zeros of P_{s-1} - P_s on [-1, 1]; the last is 1.
    polynomial = np.zeros(stages + 1)
    polynomial[-2:] = 1.0, -1.0
    x = np.sort(np.real(legendre.legroots(polynomial)))
    x[-1] = 1.0
    to_coefficients = np.asarray(np.linalg.inv(legendre.legvander(x, stages - 1)), dtype=np.float64)
    integrals = np.stack([legendre.legval(x, legendre.legint(row, lbnd=-1)) for row in np.eye(stages)], axis=-1)
    return (x + 1) / 2, integrals @ to_coefficients / 2, to_coefficients


# Nodes; MATRIX @ values at the nodes: integrals from the start to each node of a unit step (last row: over all of it);
# Legendre coefficients.
_NODES, MATRIX, _TO_LEGENDRE = _tableau(_STAGES)


@dataclass(frozen=True)
class System:
    """An autonomous system ẏ = f(y) of n equations.

    Attributes:
        rates: f, shape (s, n) -> (s, n).
        jacobian: ∂f/∂y, shape (s, n) -> (s, n, n).
        scale: size of each variable, to which the tolerance is relative, shape (n,).
    """

    rates: Callable[[FloatArray], FloatArray]
    jacobian: Callable[[FloatArray], FloatArray]
    scale: FloatArray


@dataclass(frozen=True)
class Step:
    """One attempted step, accepted or not.

    Attributes:
        time, length: start and length [s].
        values: states at the start and at the nodes, shape (s + 1, n).
        error: estimate relative to the scale; inf where Newton's method failed.
    """

    time: float
    length: float
    values: FloatArray
    error: float

    @property
    def last(self) -> FloatArray:
        """State at the end of the step, shape (n,)."""
        return np.asarray(self.values[-1])

    def __call__(self, times: FloatArray) -> FloatArray:
        """States at times [s] within the step, shape (m, n)."""
        # Barycentric interpolation through the start and the nodes
        away = ((np.asarray(times) - self.time) / self.length)[:, None] - _WITH_START
        at_node = np.abs(away) < 1e-15
        weights = np.where(np.any(at_node, axis=-1, keepdims=True), at_node, _WEIGHTS / np.where(at_node, 1.0, away))
        return np.asarray(weights @ self.values / np.sum(weights, axis=-1, keepdims=True))


_WITH_START = np.concatenate([[0.0], _NODES])
_WEIGHTS = 1 / np.prod(_WITH_START[:, None] - _WITH_START + np.eye(_STAGES + 1), axis=-1)


def nodes(length: float) -> FloatArray:
    """Times of the nodes after the start of a step of this length [s], shape (s,)."""
    return length * _NODES


def take(system: System, time: float, state: FloatArray, length: float, guess: FloatArray) -> Step:
    """Attempts one step from a time [s]; ``guess``: states at the nodes to start Newton's method from, shape (s, n)."""
    s, n = guess.shape
    values = guess
    last_change, factors, grown = np.inf, None, 0
    for _ in range(_NEWTON):
        rates = system.rates(values)
        if factors is None:
            jacobians = system.jacobian(values)
            matrix = np.eye(s * n) - (length * np.einsum("ij,jkl->ikjl", MATRIX, jacobians)).reshape(s * n, s * n)
            if not np.all(np.isfinite(matrix)):
                break
            factors = lu_factor(matrix, check_finite=False)
        residual = values - state - length * MATRIX @ rates
        if not np.all(np.isfinite(residual)):
            break
        correction = lu_solve(factors, -residual.ravel(), check_finite=False).reshape(s, n)
        values = values + correction
        change = float(np.max(np.abs(correction) / system.scale))
        if change < _ROUND_OFF or (
            change < 1e-11 and change > 0.3 * last_change
        ):  # converged, or as far as round-off lets
            coefficients = length * _TO_LEGENDRE @ system.rates(values) / system.scale
            # Two coefficients, as one alone may vanish by symmetry
            return Step(time, length, np.vstack([state, values]), float(np.max(np.abs(coefficients[-2:]))))
        if change > 0.02 * last_change or (last_change == np.inf and change > _GOOD):
            factors = None
        grown = grown + 1 if change > last_change else 0
        if grown > 1:
            break
        last_change = change
    return Step(time, length, np.vstack([state, guess]), np.inf)


def by_states(step: Step, scale: FloatArray) -> tuple[float, float]:
    """Error of a step from its states instead of their rates, whose round-off stiff dampers magnify.

    Returns:
        Error estimate, and the same without round-off, extrapolated from the decay of coefficients above round-off;
        both relative to the scale.
    """
    if not np.isfinite(step.error):
        return np.inf, np.inf
    sizes = np.max(np.abs(_TO_LEGENDRE @ step.values[1:] / scale), axis=-1)
    resolved = 2 + int(np.flatnonzero(sizes[2:] > _SEEN)[-1]) if np.any(sizes[2:] > _SEEN) else 1
    decay = (sizes[resolved] / sizes[1]) ** (1 / (resolved - 1)) if resolved > 1 else 0.0
    return float(np.max(sizes[-2:])), float(sizes[1] * decay ** (_STAGES - 3))


def next_length(step: Step, tolerance: float) -> float:
    """Length of the next attempt [s]: the error falls with the power s - 1 of the length."""
    if not np.isfinite(step.error):
        return 0.4 * step.length
    error = step.error if step.error > _NOISE else 0.0  # round-off alone does not limit the next step
    growth = (tolerance / max(error, 1e-30)) ** (1 / (_STAGES - 1))
    return step.length * float(np.clip(0.8 * growth, 0.2, 3.0))
