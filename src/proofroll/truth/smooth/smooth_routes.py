"""Routes of a motion without switches, each in one stretch, by the steps that suit its rates.

Dampers make implicit steps worth it: explicit ones resolve the fastest time constant to the end, though what it belongs
to has decayed soon after the start, see :func:`stiff`. Steps of both routes have different tolerances, so that their
errors differ too.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from proofroll.core.errors import Diverged, Missing
from proofroll.core.pace import OutOfTime
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.bodies.maximal_taylor import MaximalTaylor, Visited, compiled_rates
from proofroll.truth.followed_paths import TOLERANCES
from proofroll.truth.numerics.collocation import Step, System, by_states, next_length, nodes, take
from proofroll.truth.numerics.hybrid import DenseStep, StoppedWithin, Stretch, StretchLaw, Transition
from proofroll.truth.numerics.scalars import Scalar
from proofroll.truth.tree.contact_tree import ContactTree

# Time constants of a damper per run above which it may be stiff. DOP853 is stable up to six of them per step, so it
# makes at least a hundred steps for stability alone, and more due to the noise of accelerations.
_CONSTANTS = 600
_FASTER = 30.0  # ratio to the fastest swing, which any method has to resolve
_NEAR = 1e-7  # step of finite differences for Jacobians: m, 1, and per s, in natural units
_FURTHER = 1.5  # how much longer a step may be for the last step's polynomial to be its first guess
_EXPLICIT = 1e-15  # tolerance of the first route by DOP853
_IMPLICIT = 1e-12, 1e-14  # tolerances of implicit steps; Python computes those of the first route, the dearer one

_Rates = Callable[[Array], Array]  # of states with the time as last column


class SmoothTree(ContactTree):
    """Joint coordinates: compiled collocation, DOP853 with projection, or implicit collocation.

    ``implicit``: take implicit steps.
    """

    def __init__(self, dynamics: ContactDynamics, implicit: bool) -> None:
        super().__init__(dynamics, _EXPLICIT, 1.0)
        self._implicit = implicit
        self._tolerance = np.append(dynamics.equations.least(_EXPLICIT), _EXPLICIT)

    def begin(self) -> Transition[ContactMode]:
        """See the protocol; the start is as given, without the round-off of a projection."""
        return Transition(self.start, (), ())

    def _law(self, state: Array, mode: ContactMode, signs: tuple[int, ...] | None = None) -> StretchLaw:  # noqa: ARG002 -- nothing switches
        equations, none = self.dynamics.equations, np.zeros(0)
        followed = equations.followed()

        def corrected(y: Array) -> Array:
            alone = y[:-1]
            moved = followed(alone)
            return y if moved is alone else np.append(moved, y[-1])

        return StretchLaw(
            rates=lambda y: np.append(equations.rate(float(y[-1]), y[:-1]), 1.0),
            guards=lambda _: none,
            corrected=corrected,
            noise=none,
            near=none,
        )

    def _law_inside(self, state: Array, mode: ContactMode) -> StretchLaw:
        eliminated = self.dynamics.equations.eliminated
        return self._law(state, mode)._replace(corrected=lambda y: np.append(eliminated(y[:-1]), y[-1]))

    def _walked(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        if not self._implicit:
            return super()._walked(time, state, mode, until)
        self._used.setdefault("implicit collocation")
        law = self._law(state, mode)
        rates = lambda states: np.array([law.rates(y) for y in states])  # noqa: E731
        return _implicit_stretch(rates, state, until, _IMPLICIT[0], law.corrected)


class SmoothBodies(ContactBodies):
    """Separate bodies: Taylor series in long doubles, implicit collocation, or DOP853 with projection.

    ``implicit``: take implicit steps.
    """

    def __init__(self, equations: ContactEquations, second: MaximalCoordinates, implicit: bool) -> None:
        super().__init__(equations, TOLERANCES[1], 1.0)
        self._second, self._implicit = second, implicit

    def begin(self) -> Transition[ContactMode]:
        """See the protocol; the start is as given, without the round-off of a projection."""
        return Transition(self.start, (), ())

    def _symbols(self) -> None:
        return None  # series in long doubles have their own

    def _walked(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        if self._implicit:
            self._used.setdefault("implicit collocation")
            return _implicit_stretch(self._rates(), state, until, _IMPLICIT[1], self._law(state, mode).corrected)
        series: Visited = []
        try:
            (last,) = self._second.taylor_states(np.array([until]), state[:-1], series)
        except Missing:
            return super()._walked(time, state, mode, until)
        except OutOfTime as stopped:
            if not series or stopped.time is None:
                raise
            taylor, start, y = series[-1]
            (last,) = taylor.inside(start, y, stopped.time, np.array([stopped.time]))
            path = self._of_series(series, time, state, mode, stopped.time, last)
            raise StoppedWithin(str(stopped), stopped.time, path) from None
        return self._of_series(series, time, state, mode, until, last)

    def _of_series(
        self, series: Visited, time: float, state: Array, mode: ContactMode, until: float, last: Array
    ) -> Stretch[ContactMode]:
        """Stretch from a time and state to ``until`` and the ``last`` state, by the series of its steps."""
        self._used.setdefault("Taylor series in long doubles")
        ends = [*(float(start) for _, start, _ in series[1:]), until]
        dense: list[DenseStep] = [
            (float(start), end, partial(_inside, taylor, start, y, end))
            for (taylor, start, y), end in zip(series, ends, strict=True)
            if end > start
        ]
        return Stretch(
            start=time,
            end=until,
            mode=mode,
            first=state,
            last=np.append(np.asarray(last, dtype=float), until),
            guard=None,
            dense=dense,
            exact=bool(dense),
        )

    def _rates(self) -> _Rates:
        """Rates of many states, compiled if heyoka is installed."""
        lean = self._second.lean
        try:
            compiled = compiled_rates(lean.equations, lean.independent_rows())
        except Missing:
            return lambda states: np.array([[*lean.rate(y[-1], y[:-1]), 1.0] for y in states])
        return lambda states: np.column_stack([compiled(states), np.ones(len(states))])


def _inside(taylor: MaximalTaylor, start: Scalar, state: Array, end: float, times: Array) -> Array:
    """States with the time, (state, times), within a step of Taylor series, which is taken again."""
    return np.column_stack([taylor.inside(start, state, end, times), times]).T


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


def _jacobian(rates: _Rates, states: Array) -> Array:
    """Jacobians of the rates, (stages, n) -> (stages, n, n): seven digits suffice for Newton's method."""
    stages, n = states.shape
    near = (states[:, None] + _NEAR * np.concatenate([np.zeros((1, n)), np.eye(n)])).reshape(-1, n)
    stacked = rates(near).reshape(stages, n + 1, -1)
    return np.asarray((stacked[:, 1:] - stacked[:, :1]).transpose(0, 2, 1) / _NEAR)


def _implicit_stretch(
    rates: _Rates, start: Array, until: float, tolerance: float, corrected: Callable[[Array], Array]
) -> Stretch[ContactMode]:
    """Stretch from a state at time 0, which ends with the time, by implicit collocation.

    Raises:
        Diverged: no step is small enough, or one passes a singular pose.
    """
    system = System(rates, lambda y: _jacobian(rates, y), np.ones(len(start)))
    state, time, steps = start, 0.0, list[DenseStep]()
    speed = float(np.abs(rates(state[None])).max())
    length, last = 1e-3 / max(1.0, speed), None
    while time < until:
        length = min(length, until - time)
        if time + length == time:
            raise Diverged(f"implicit collocation stopped at t = {time:.6g} s", time)
        scaled = replace(system, scale=np.maximum(1.0, np.abs(state)))
        step = take(scaled, time, state, length, _guess(system, last, time, state, length))
        error, alone = by_states(step, scaled.scale)
        next_step = next_length(replace(step, error=max(alone, error if error > tolerance else 0.0)), tolerance)
        if error > tolerance:
            length, last = min(next_step, 0.8 * length), last if np.isfinite(error) else None
            continue
        reached = until if length == until - time else time + length
        steps.append((time, reached, partial(_transposed, step)))
        time, last, length = reached, step, next_step
        state = corrected(np.append(step.last[:-1], time))
    return Stretch(start=0.0, end=until, mode=(), first=start, last=state, guard=None, dense=steps, exact=bool(steps))


def _transposed(step: Step, times: Array) -> Array:
    return step(times).T


def _guess(system: System, last: Step | None, now: float, state: Array, length: float) -> Array:
    """Guess of the states at the nodes of a step: the last step's polynomial, or a tangent."""
    if last is None or length > _FURTHER * last.length:
        return np.asarray(state + nodes(length)[:, None] * system.rates(state[None]))
    return last(now + nodes(length))
