"""What several routes share: two motions joined in time, and one classic step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.motion import BallMotion


def joined(
    times: FloatArray,
    change: float,
    early: Callable[[FloatArray], BallMotion],
    late: Callable[[FloatArray], BallMotion],
) -> BallMotion:
    """Motion at rising times: by ``early`` before the time ``change`` [s] and by ``late`` from then on."""
    first = int(np.searchsorted(times, change))
    parts = early(times[:first]), late(times[first:])
    p, v, w, force = (
        np.concatenate([getattr(part, key) for part in parts]) for key in ("p_WB", "v_WB", "w_WB", "force")
    )
    return BallMotion(p, v, w, force, parts[1].route)


def classic_step(rates: Callable[[FloatArray], FloatArray], state: FloatArray, span: float) -> FloatArray:
    """The state after ``span`` [s] by one classic Runge-Kutta step; for looking a little ahead."""
    k1 = rates(state)
    k2 = rates(state + span / 2 * k1)
    k3 = rates(state + span / 2 * k2)
    k4 = rates(state + span * k3)
    return np.asarray(state + span / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
