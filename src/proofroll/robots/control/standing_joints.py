"""Joints of a record that something else than efforts moves or holds: their stops, and motors that hold them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import Diverged, Refused
from proofroll.core.number_format import error
from proofroll.robots.control.air_fit import states_of
from proofroll.robots.control.bookkeeping.air import AirRobot, HeldRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import ControlRecord, LayerCause
from proofroll.robots.model import Array

_NEAR = 1e-3  # part of a range, or 1 rad or m, at whose ends a stop may act
_STILL = 0.01  # part of the change of velocity in a step up to which a joint stands still
_ROWS = 5  # rows whose accelerations are computed


def rows_off_stops(record: ControlRecord, ranges: Mapping[str, tuple[float, float]]) -> tuple[NDArray[np.bool_], str]:
    """True at rows from which on no joint is at an end of its range, (times,), and a clause on the others, if any.

    ``ranges``: joint -> its limits [rad or m].
    """
    free, joints = np.ones(len(record.time), bool), []
    for joint, (lower, upper) in ranges.items():
        q = record.columns.get(f"q.{joint}")
        if q is None:
            continue
        near = _NEAR * min(upper - lower, 1.0)
        stopped = (q <= lower + near) | (q >= upper - near)
        if stopped.any():
            joints.append(f"q.{joint} from {record.time[int(np.argmax(stopped))]:.4g} s on")
            free &= ~stopped & ~np.append(stopped[1:], False)
    if not joints:
        return free, ""
    further = f" and {len(joints) - 1} more" if len(joints) > 1 else ""
    return free, f"rows at an end of the range of a joint are left out: {joints[0]}{further}"


def _acceleration(robot: AirRobot, state: tuple[Array, Array], efforts: Array) -> Array:
    return robot.equations.solve(*state, load=robot.load(efforts)).acceleration


def held_joints(record: ControlRecord, law: ControlLaw, held: HeldRobot, efforts: Array) -> LayerCause | None:
    """Joints that stand still under efforts that would move them, after the first row; None: there are none."""
    robot = AirRobot.bare(held.mechanism, law)
    motion = states_of(record, robot)
    if isinstance(motion, str):
        return None
    step = float(np.diff(record.time).mean())
    rows = np.unique(np.linspace(1, len(record.time) - 1, _ROWS).astype(int))
    try:
        accelerations = [_acceleration(robot, motion[row], efforts[row]) for row in rows.tolist()]
    except (Diverged, Refused):
        return None
    changes = step * np.abs(np.array(accelerations)[:, robot.driven[:, 1]]).max(axis=0)
    names = [f"v.{joint}" for joint in law.joints]
    sizes = np.array([np.abs(record.columns[name][2:]).max() for name in names])
    digits = np.array([record.rounding[name].max() for name in names])
    still = (sizes <= _STILL * changes) & (digits <= _STILL * changes)
    if not still.any():
        return None
    k = int(np.argmax(np.where(still, changes, 0)))
    which = "all joints" if still.all() else ", ".join(law.joints[k] for k in np.flatnonzero(still).tolist())
    words = (
        f"{which}: velocities stay zero whatever the effort, as under motors that hold them (PyBullet's do unless "
        f"setJointMotorControl2(..., VELOCITY_CONTROL, force=0) switches them off); {names[k]} would change by "
        f"{error(changes[k])} in a step and is at most {error(sizes[k])}"
    )
    return LayerCause("held_joints", words, None, float(sizes[k] / changes[k]))
