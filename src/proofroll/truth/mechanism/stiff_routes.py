"""Both routes by implicit collocation, where dampers settle so fast that explicit steps only keep them stable.

Stiffness is measured at the start, see :func:`stiff`. Route 1 has the equations in joint coordinates, route 2 those of
:mod:`.maximal_equations`, compiled where heyoka is. Their steps have different tolerances, so that errors differ too.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import Diverged, Missing
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.record import Record, gathered
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth.collocation import Step, System, by_states, next_length, nodes, take
from proofroll.truth.mechanism.maximal_coordinates import BESIDE, MaximalCoordinates, NumericEquations
from proofroll.truth.mechanism.maximal_taylor import compiled_rates
from proofroll.truth.mechanism.natural_units import natural_units

# Time constants of a damper in a run: DOP853, stable to six of them in a step, makes a hundred steps and more for
# stability alone, and the noise of accelerations makes them shorter still.
_CONSTANTS = 600
_FASTER = 30.0  # than the fastest swing, which any method has to follow
_NEAR = 1e-7  # m, 1, and per s, in natural units: what columns of Jacobians are differences of
_FURTHER = 1.5  # the last step's polynomial guesses a step at most this much longer
_TOLERANCES = 1e-14, 1e-11, 3e-14  # of two runs of route 1, and of route 2


class StiffRuns(NamedTuple):
    """Motions at the same times: of route 2, and of route 1 with two tolerances, the better one last.

    Attributes:
        other, coarse, precise: records.
        growth: of the distance from a motion that starts beside this one, at each time.
    """

    other: Record
    coarse: Record
    precise: Record
    growth: Array


def stiff(equations: JointCoordinates, until: float) -> bool:
    """True if a damper's time constant is far below the run's length [s] and the fastest swing's period."""
    mechanism = equations.mechanism
    dampers = [item.damping for item in mechanism.springs] + [item.damping for item in mechanism.joints]
    if not any(dampers + [item.kd for item in mechanism.actuators]):
        return False
    state = np.concatenate(mechanism.start())
    rates = lambda states: np.array([equations.rate(0.0, y) for y in states])  # noqa: E731
    modes = np.linalg.eigvals(_jacobian(rates, state[None])[0])
    fastest = max(float(-modes.real.min(initial=0.0)), 0.0)
    return fastest * until > _CONSTANTS and fastest > _FASTER * float(np.abs(modes.imag).max(initial=0.0))


def run_stiff(mechanism: Mechanism, rank: int, times: Array) -> StiffRuns:
    """Both routes at growing times [s], in natural units on the way.

    Raises:
        Diverged: no step is small enough, or one passes a singular pose.
    """
    units = natural_units(mechanism)
    own, moments = units.mechanism(mechanism), times / units.time
    tree, bodies = JointCoordinates(own, rank), MaximalCoordinates(own)
    lean, nq, start = bodies.lean, own.nq, np.concatenate(own.start())
    near = np.concatenate([tree.tree.moved(start[:nq], np.full(own.nv, BESIDE)), start[nq:] * (1 + BESIDE)])

    def joints(y: Array) -> Array:
        return np.array([tree.rate(each[-1], each[:-1]) for each in y])

    with units.said_in_seconds():
        best, rough = (_collocated(joints, start, moments, each, tree.followed()) for each in _TOLERANCES[:2])
        beside = _collocated(joints, tree.eliminated(near), moments, _TOLERANCES[1], tree.followed())
        alone = _collocated(_rates(lean), lean.equations.start(), moments, _TOLERANCES[2], lean.eliminated)
    records = [
        gathered(moments, [tree.sample(y[:nq], y[nq:], None, t) for t, y in zip(moments, states, strict=True)])
        for states in (rough, best)
    ]
    growth = np.abs(beside - rough)[:, :nq].max(axis=1) / BESIDE
    other, coarse, precise = (units.record(mechanism, each) for each in (bodies.recorded(moments, alone), *records))
    return StiffRuns(other, coarse, precise, growth)


def _rates(lean: NumericEquations) -> Callable[[Array], Array]:
    """Rates of route 2 for states with their time behind them, compiled where that can be."""
    try:
        return compiled_rates(lean.equations, lean.independent_rows())
    except Missing:
        return lambda states: np.array([lean.rate(each[-1], each[:-1]) for each in states])


def _jacobian(rates: Callable[[Array], Array], states: Array) -> Array:
    """Derivatives of rates of states, (stages, n) -> (stages, n, n); seven digits are many for Newton's method."""
    stages, n = states.shape
    near = (states[:, None] + _NEAR * np.concatenate([np.zeros((1, n)), np.eye(n)])).reshape(-1, n)
    found = rates(near).reshape(stages, n + 1, -1)
    return np.asarray((found[:, 1:] - found[:, :1]).transpose(0, 2, 1) / _NEAR)


def _collocated(
    rates: Callable[[Array], Array],
    start: Array,
    times: Array,
    tolerance: float,
    corrected: Callable[[Array], Array],
) -> Array:
    """States at growing times from a state at time 0; ``rates`` are those of states with the time behind them."""

    def with_time(y: Array) -> Array:
        return np.column_stack([rates(y), np.ones(len(y))])

    system = System(with_time, lambda y: _jacobian(with_time, y), np.ones(len(start) + 1))
    state, now, end = np.append(start, 0.0), 0.0, float(times[-1])
    speed = float(np.abs(with_time(state[None])).max())
    length, last = 1e-3 / max(1.0, speed), None
    found = [np.repeat(start[None], np.count_nonzero(times <= 0.0), axis=0)]
    while now < end:
        length = min(length, end - now)
        if now + length == now:
            raise Diverged(f"implicit collocation stopped at t = {now:.6g} s")
        scaled = replace(system, scale=np.maximum(1.0, np.abs(state)))
        step = take(scaled, now, state, length, _guess(system, last, now, state, length))
        error, alone = by_states(step, scaled.scale)
        wanted = next_length(replace(step, error=max(alone, error if error > tolerance else 0.0)), tolerance)
        if error > tolerance:
            length, last = min(wanted, 0.8 * length), last if np.isfinite(error) else None
            continue
        reached = end if length == end - now else now + length
        found.append(step(times[(times > now) & (times <= reached)])[:, :-1])
        now, last, length = reached, step, wanted
        state = np.append(corrected(step.last[:-1]), now)
    return np.concatenate(found)


def _guess(system: System, last: Step | None, now: float, state: Array, length: float) -> Array:
    """States at the nodes of a step: the last step's polynomial, or a tangent."""
    if last is None or length > _FURTHER * last.length:
        return np.asarray(state + nodes(length)[:, None] * system.rates(state[None]))
    return last(now + nodes(length))
