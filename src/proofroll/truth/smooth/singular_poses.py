"""Singular poses along a motion: the rows of loops lose rank, and the motion may branch, unseen by error control."""

from collections.abc import Iterable

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.analysis import RowSign, singular_values
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.witnesses.closed_forms import ClosedForm

BRANCHING = "the rows of the loops lose rank and the motion may branch: any change of the lengths may lead elsewhere"
_TURN = 0.02  # step between poses of a closed form, rad or natural lengths of the fastest coordinate
_FEW, _MOST = 50, 20_000  # limits of the number of poses


def singular_poses(mechanism: Mechanism, until: float, step: float) -> list[float]:
    """Times, s, at which the rows of the loops lose rank, accurate to a fraction of the step, s.

    The motion until ``until``, s, is integrated by Runge-Kutta 4 with a fixed rank, which passes singular poses.
    """
    equations = JointCoordinates(mechanism)
    if not (mechanism.loops and equations.rank):
        return []
    times = np.linspace(0.0, until, max(round(until / step), 5) + 1)
    return _passed(equations, times, (y[: mechanism.nq] for y in equations.rk4_states(times, float(times[1]))))


def singular_poses_of(form: ClosedForm, equations: JointCoordinates, until: float) -> list[float]:
    """Times, s, of singular poses along a motion in closed form until ``until``, s."""
    if not (equations.mechanism.loops and equations.rank) or form.motion is None or not until:
        return []
    fastest = float(np.abs(form.motion(np.linspace(0.0, until, _FEW))[1]).max())
    times = np.linspace(0.0, until, int(np.clip(until * fastest / _TURN, _FEW, _MOST)) + 1)
    return _passed(equations, times, form.motion(times)[0])


def branching(times: list[float]) -> str:
    """Clause about the times of singular poses, s; empty without any."""
    instants = ", ".join(f"{time:.4g}" for time in times[:3]) + (", …" if len(times) > 3 else "")
    return f"near t = {instants} s {BRANCHING}" if times else ""


def _passed(equations: JointCoordinates, times: Array, poses: Iterable[Array]) -> list[float]:
    sign, times_passed, last_value = RowSign(equations.rank), [], 0.0
    for k, q in enumerate(poses):
        C = equations.rows(q).C
        smallest = float(singular_values(C)[equations.rank - 1])
        if sign.changes(C):  # zero of the line through both values, with opposite signs
            times_passed.append(float(times[k - 1] + (times[k] - times[k - 1]) * last_value / (last_value + smallest)))
        last_value = smallest
    return times_passed
