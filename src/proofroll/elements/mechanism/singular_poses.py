"""Singular poses that a motion passes: where the loops' rows lose rank and the mechanism could change its branch."""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.model import Mechanism

# Of the smallest singular value just before and after: where it goes to zero like |t|, the lines through its values
# on both sides meet at zero but for their curvature; at a mere minimum they meet near the minimum.
_AT_ZERO = 0.2


def singular_poses(mechanism: Mechanism, until: float, step: float = 5e-3) -> list[float]:
    """Times, s, good to a fraction of the step, at which the motion passes a singular pose.

    Args:
        mechanism: any without dry friction.
        until: end of the motion, s.
        step: of Runge-Kutta 4 with a fixed rank, which passes such poses, s.
    """
    if not mechanism.loops:
        return []
    equations, nq = JointCoordinates(mechanism), mechanism.nq
    times = np.linspace(0.0, until, max(round(until / step), 5) + 1)
    states = equations.rk4_states(times, float(times[1]))
    sizes = np.array([equations.solve(y[:nq], y[nq:]).smallest for y in states])
    found = []
    for i in range(2, len(times) - 2):
        before, after = sizes[i - 2 : i], sizes[i + 1 : i + 3]
        if sizes[i] > before[1] or sizes[i] >= after[0]:
            continue
        down, up = before[1] - before[0], after[1] - after[0]
        # both lines against steps from i: before[1] + down·(x + 1) and after[0] + up·(x - 1)
        x = (before[1] + down - after[0] + up) / (up - down)
        if abs(before[1] + down * (x + 1)) < _AT_ZERO * min(before[1], after[0]):
            found.append(float(times[i] + x * times[1]))
    return found
