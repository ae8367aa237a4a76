"""Both routes by implicit collocation, for dampers so stiff that stability limits explicit steps.

Stiffness is measured at the start, see :func:`stiff`. Route 1 has the equations in joint coordinates, route 2 those of
:mod:`.maximal_equations`, compiled if heyoka is installed. Their steps have different tolerances, so that their errors
differ too.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import Diverged, Missing
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.maximal_coordinates import BESIDE, MaximalCoordinates, NumericEquations
from proofroll.truth.bodies.maximal_taylor import compiled_rates
from proofroll.truth.compiled_tree import NaturalStep, kept_in_seconds
from proofroll.truth.natural_units import natural_units
from proofroll.truth.numerics.collocation import Step, System, by_states, next_length, nodes, take
from proofroll.truth.smooth_laws import KeptRoute

# Time constants of a damper per run above which it may be stiff. DOP853 is stable up to six of them per step, so it
# makes at least a hundred steps for stability alone, and more due to the noise of accelerations.
_CONSTANTS = 600
_FASTER = 30.0  # ratio to the fastest swing, which any method has to resolve
_NEAR = 1e-7  # step of finite differences for Jacobians: m, 1, and per s, in natural units
_FURTHER = 1.5  # how much longer a step may be for the last step's polynomial to be its first guess
_TOLERANCES = 1e-12, 1e-14  # of the two routes; Python computes the first, which is the dearer one


class StiffRuns(NamedTuple):
    """Motions at the same times: route 1, and route 2, whose steps are finer.

    Attributes:
        one, precise: records.
        growth: growth of the distance to a neighbouring motion at each time [1].
        kept: steps of both, route 1 first.
    """

    one: Record
    precise: Record
    growth: Array
    kept: tuple[KeptRoute, KeptRoute]


def stiff(equations: JointCoordinates, until: float) -> bool:
    """True if a damper's time constant is far below the run's length [s] and the fastest swing's period."""
    mechanism = equations.mechanism
    dampers = [item.damping for item in mechanism.springs] + [item.damping for item in mechanism.joints]
    dampers += [damping for bushing in mechanism.bushings for damping in bushing.damping]
    if not any(dampers + [item.kd for item in mechanism.actuators]):
        return False
    state = np.concatenate(mechanism.start())
    rates = lambda states: np.array([equations.rate(0.0, y) for y in states])  # noqa: E731
    modes = np.linalg.eigvals(_jacobian(rates, state[None])[0])
    fastest = max(float(-modes.real.min(initial=0.0)), 0.0)
    return fastest * until > _CONSTANTS and fastest > _FASTER * float(np.abs(modes.imag).max(initial=0.0))


def run_stiff(mechanism: Mechanism, rank: int, times: Array) -> StiffRuns:
    """Motions by both routes at rising times [s], computed in natural units.

    Raises:
        Diverged: no step is small enough, or one passes a singular pose.
    """
    units = natural_units(mechanism)
    scaled, moments = units.mechanism(mechanism), times / units.time
    tree, bodies = JointCoordinates(scaled, rank), MaximalCoordinates(scaled)
    lean, nq, start = bodies.lean, scaled.nq, np.concatenate(scaled.start())
    near = np.concatenate([tree.tree.moved(start[:nq], np.full(scaled.nv, BESIDE)), start[nq:] * (1 + BESIDE)])

    def joints(y: Array) -> Array:
        return np.array([tree.rate(state[-1], state[:-1]) for state in y])

    steps: tuple[list[Step], list[Step]] = [], []
    with units.errors_in_seconds():
        joined, beside = (
            _collocated(joints, state, moments, _TOLERANCES[0], tree.followed(), kept)
            for state, kept in ((start, steps[0]), (tree.eliminated(near), None))
        )
        lone = lean.equations.start()
        alone = _collocated(_rates(lean), lone, moments, _TOLERANCES[1], lean.eliminated, steps[1])
    by_tree = tree.recorded(moments, joined)
    growth = np.abs(beside - joined)[:, :nq].max(axis=1) / BESIDE
    by_tree, precise = (units.record(mechanism, state) for state in (by_tree, bodies.recorded(moments, alone)))
    kept = (
        kept_in_seconds(
            _natural(steps[0]), units, lambda t, y: units.record(mechanism, tree.recorded(t, y)), tree.spin
        ),
        kept_in_seconds(
            _natural(steps[1]), units, lambda t, y: units.record(mechanism, bodies.recorded(t, y)), bodies.spin
        )._replace(powers=lambda t, y: bodies.powers(t / units.time, y) * (units.force * units.length / units.time)),
    )
    return StiffRuns(by_tree, precise, growth, kept)


def _natural(steps: Sequence[Step]) -> list[NaturalStep]:
    """Steps by their start, end and states without the time."""

    def states(step: Step, times: Array) -> Array:
        return step(times)[:, :-1]

    return [(step.time, step.time + step.length, partial(states, step)) for step in steps]


def _rates(lean: NumericEquations) -> Callable[[Array], Array]:
    """Rates of route 2 for states with the time as last column, compiled if heyoka is installed."""
    try:
        return compiled_rates(lean.equations, lean.independent_rows())
    except Missing:
        return lambda states: np.array([lean.rate(state[-1], state[:-1]) for state in states])


def _jacobian(rates: Callable[[Array], Array], states: Array) -> Array:
    """Jacobians of the rates, (stages, n) -> (stages, n, n): seven digits suffice for Newton's method."""
    stages, n = states.shape
    near = (states[:, None] + _NEAR * np.concatenate([np.zeros((1, n)), np.eye(n)])).reshape(-1, n)
    stacked = rates(near).reshape(stages, n + 1, -1)
    return np.asarray((stacked[:, 1:] - stacked[:, :1]).transpose(0, 2, 1) / _NEAR)


def _collocated(
    rates: Callable[[Array], Array],
    start: Array,
    times: Array,
    tolerance: float,
    corrected: Callable[[Array], Array],
    kept: list[Step] | None = None,
) -> Array:
    """States at rising times from a state at time 0; ``rates`` takes states with the time as last column."""

    def with_time(y: Array) -> Array:
        return np.column_stack([rates(y), np.ones(len(y))])

    system = System(with_time, lambda y: _jacobian(with_time, y), np.ones(len(start) + 1))
    state, now, end = np.append(start, 0.0), 0.0, float(times[-1])
    speed = float(np.abs(with_time(state[None])).max())
    length, last = 1e-3 / max(1.0, speed), None
    parts = [np.repeat(start[None], np.count_nonzero(times <= 0.0), axis=0)]
    while now < end:
        length = min(length, end - now)
        if now + length == now:
            raise Diverged(f"implicit collocation stopped at t = {now:.6g} s", now)
        scaled = replace(system, scale=np.maximum(1.0, np.abs(state)))
        step = take(scaled, now, state, length, _guess(system, last, now, state, length))
        error, alone = by_states(step, scaled.scale)
        next_step = next_length(replace(step, error=max(alone, error if error > tolerance else 0.0)), tolerance)
        if error > tolerance:
            length, last = min(next_step, 0.8 * length), last if np.isfinite(error) else None
            continue
        reached = end if length == end - now else now + length
        parts.append(step(times[(times > now) & (times <= reached)])[:, :-1])
        if kept is not None:
            kept.append(step)
        now, last, length = reached, step, next_step
        state = np.append(corrected(step.last[:-1]), now)
    return np.concatenate(parts)


def _guess(system: System, last: Step | None, now: float, state: Array, length: float) -> Array:
    """Guess of the states at the nodes of a step: the last step's polynomial, or a tangent."""
    if last is None or length > _FURTHER * last.length:
        return np.asarray(state + nodes(length)[:, None] * system.rates(state[None]))
    return last(now + nodes(length))
