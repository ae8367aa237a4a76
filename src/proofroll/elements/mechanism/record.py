"""Record of a mechanism's motion, the same for both routes of the truth, and the integration that makes it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from proofroll.core.dop853 import controlled_step, corrected_by, solver_from
from proofroll.core.stalling import StepCount, StepWatch
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.placed import Placed
from proofroll.elements.mechanism.rotations import Array


@dataclass(frozen=True)
class Record:
    """A motion at sampled times, SI units, world axes; bodies, joints and loops in the order of the mechanism.

    Attributes:
        time: s, (times).
        p_WB, v_WB: origin of each body's frame and its velocity, (times, bodies, 3).
        q_WB: unit quaternion wxyz of each body, (times, bodies, 4).
        w_WB: angular velocity, rad/s, (times, bodies, 3).
        q, v: coordinates (times, nq) and velocities (times, nv) of the tree.
        wrench: force and moment on the child (joints) or on body_b (loops), at the joint, of all that the joint
            transmits: constraint, spring, damper and drive; N, N m, (times, joints + loops, 6).
        named: see :func:`~proofroll.elements.mechanism.named_forces.named_forces`, (times, forces).
        residual: largest violation of a constraint, m or 1, and of its rate, (times, 2).
    """

    time: Array
    p_WB: Array
    v_WB: Array
    q_WB: Array
    w_WB: Array
    q: Array
    v: Array
    wrench: Array
    named: Array
    residual: Array

    def placed(self, mechanism: Mechanism) -> Placed:
        """The recorded motion of the mechanism."""
        known_q = self.q if self.q.shape[1] else None  # a route that integrates poses has no coordinates at first
        return Placed(mechanism, self.time, self.p_WB, self.v_WB, self.w_WB, self.q_WB, known_q)


def record_of(time: Array, samples: list[dict[str, Any]]) -> Record:
    """Record of samples; each is a dictionary of the record's other fields at one time."""
    names = [item.name for item in fields(Record) if item.name != "time"]
    return Record(time=time, **{name: np.array([sample[name] for sample in samples]) for name in names})


def integrate(
    rate: Callable[[float, Array], Array],
    start: Array,
    times: Array,
    tolerance: float,
    corrected: Callable[[Array], Array],
    least: Array | None = None,
) -> Iterator[Array]:
    """States at the times by DOP853; the solver steps exactly onto each time, for its interpolation is of lower order.

    The round-off of a step is added to the next step (W. Kahan, Comm. ACM 8, 1965, 40): otherwise a body that turns
    about its intermediate axis would lose ten times the digits.

    Args:
        rate: right-hand side.
        start: state at time 0.
        times: growing, s; the first may be 0.
        tolerance: absolute and relative, of each step.
        corrected: puts a state back on its constraints; applied after every step.
        least: absolute tolerance of each component; None: ``tolerance``.

    Raises:
        Diverged: the steps become too small or too many.
    """
    solver = solver_from(rate, 0.0, start, tolerance, tolerance if least is None else least)
    watch, count = StepWatch(), StepCount(0.0, float(times[-1]))
    lost, back = np.zeros_like(start), corrected_by(corrected)

    def accept(t: float, _: Array) -> Array:
        nonlocal lost
        moved = (t - solver.t_old) * (solver.K[:-1].T @ solver.B) + lost
        y = solver.y_old + moved
        lost = moved - (y - solver.y_old)
        return back(t, y)

    for time in times.tolist():
        while solver.t < time:
            controlled_step(solver, accept, time)
            watch.took(solver.t, solver.step_size, solver.t == time)
            count.took(solver.t)
        yield solver.y.copy()
