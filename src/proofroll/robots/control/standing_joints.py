"""Joints of a record that something else than efforts moves or holds: stops, dry friction, and motors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import Diverged, Refused
from proofroll.core.number_format import error
from proofroll.robots.control.air_fit import AirFit, acceleration_fit
from proofroll.robots.control.air_rows import states_of
from proofroll.robots.control.bookkeeping.air import AirRobot, HeldRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import FITTED, ControlRecord, LayerCause
from proofroll.robots.model import Array

_NEAR = 1e-3  # part of a range at whose ends a stop may act
_STILL = 0.01  # part of the change of velocity in a step up to which a joint stands still
_ROWS = 5  # rows whose accelerations are computed


class StandingFit(NamedTuple):
    """Fit of accelerations, the rows that it has, True where nothing holds a joint, and a clause on those left out."""

    fit: AirFit | str
    usable: NDArray[np.bool_]
    remark: str


def standing_fit(
    record: ControlRecord,
    law: ControlLaw,
    held: HeldRobot,
    efforts: Array,
    steady: Array,
    ranges: Mapping[str, tuple[float, float]],
) -> StandingFit:
    """Fit with all rows; where it differs, without those at which stops or dry friction may hold a joint.

    What neither explains may be motors that hold joints.

    Args:
        record: with the state.
        law: the law as it should be.
        held: the robot.
        efforts: of the joints from each row on, (times, n).
        steady: True at rows at which no target changes, (times,).
        ranges: joint -> its limits [rad or m].
    """
    whole, every = acceleration_fit(record, law, held, efforts, steady), np.ones(len(record.time), bool)
    if isinstance(whole, str) or not _differs(whole):
        return StandingFit(whole, every, "")
    fit: AirFit | str = whole
    off_stops, at_stops = _rows_without(_at_ends(record, ranges), record.time)
    off_friction, at_rest = _rows_without(_at_rest(record, held), record.time)
    remarks = [f"rows at an end of the range of a joint are left out: {at_stops}"] if at_stops else []
    remarks += [f"rows at which dry friction may hold a joint are left out: {at_rest}"] if at_rest else []
    usable = off_stops & off_friction
    if remarks:
        fit = acceleration_fit(record, law, held, efforts, steady, usable)
    if isinstance(fit, str) or (_differs(fit) and (len(fit.causes) != 1 or fit.causes[0].id == FITTED)):
        motors = _held_joints(record, law, held, efforts, off_stops)
        if motors is not None:
            return StandingFit(replace(whole, causes=(motors,), between=False), every, "")
    return StandingFit(fit, usable, "; ".join(remarks))


def _differs(fit: AirFit) -> bool:
    """True if accelerations are not the right ones, or rounding hides whether they are."""
    return fit.off > fit.bar or fit.bar >= 1


def _at_ends(record: ControlRecord, ranges: Mapping[str, tuple[float, float]]) -> dict[str, NDArray[np.bool_]]:
    """Column of each joint -> True at rows at which it is at an end of its range, or beyond it."""
    ends = {}
    for joint, (lower, upper) in ranges.items():
        near = _NEAR * (upper - lower)
        if (q := record.columns.get(f"q.{joint}")) is not None:
            ends[f"q.{joint}"] = (q <= lower + near) | (q >= upper - near)
    return ends


def _at_rest(record: ControlRecord, held: HeldRobot) -> dict[str, NDArray[np.bool_]]:
    """Column of each joint with dry friction -> True at rows at which it does not move."""
    names = [f"v.{joint.name}" for joint in held.mechanism.joints if joint.friction]
    return {name: np.abs(record.columns[name]) <= record.rounding[name] for name in names if name in record.columns}


def _rows_without(held: Mapping[str, NDArray[np.bool_]], time: Array) -> tuple[NDArray[np.bool_], str]:
    """True at rows from which on no joint is held, (times,), and the first column that is, with its time, if any."""
    free = np.ones(len(time), bool)
    names = [name for name, rows in held.items() if rows.any()]
    for name in names:
        free &= ~held[name] & ~np.append(held[name][1:], False)
    if not names:
        return free, ""
    further = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return free, f"{names[0]}, first at {time[int(np.argmax(held[names[0]]))]:.4g} s{further}"


def _least_rates(robot: AirRobot, state: tuple[Array, Array], efforts: Array, friction: Array) -> Array:
    """Sizes of the accelerations of driven joints that dry friction, (nv,), leaves at least."""
    rates = np.abs(robot.equations.solve(*state, load=robot.load(efforts)).acceleration)
    if friction.any():
        M = robot.equations.inertial(robot.equations.tree.at(*state))[1]
        rates = rates - np.abs(np.linalg.inv(M)) @ friction
    return np.asarray(rates[robot.driven[:, 1]])


def _held_joints(
    record: ControlRecord, law: ControlLaw, held: HeldRobot, efforts: Array, usable: NDArray[np.bool_]
) -> LayerCause | None:
    """Joints that stand still under changing efforts that would move them, after the first row; None: there are none.

    ``usable``: True at rows at which no joint is at a stop, (times,).
    """
    mechanism = held.mechanism
    smooth = replace(mechanism, joints=tuple(replace(joint, friction=0.0) for joint in mechanism.joints))
    robot = AirRobot(smooth, law)
    motion, rows = states_of(record, robot), np.flatnonzero(usable[1:]) + 1
    if isinstance(motion, str) or not len(rows):
        return None
    step = float(np.diff(record.time).mean())
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, _ROWS).astype(int))]
    friction = np.zeros(mechanism.nv)
    for joint, at_v in zip(mechanism.joints, mechanism.v_slices, strict=True):
        friction[at_v] = joint.friction
    try:
        rates = [_least_rates(robot, motion[row], efforts[row], friction) for row in rows.tolist()]
    except (Diverged, Refused, np.linalg.LinAlgError):
        return None
    changes = step * np.array(rates).max(axis=0)
    names = [f"v.{joint}" for joint in law.joints]
    sizes = np.array([np.abs(record.columns[name][2:]).max() for name in names])
    digits = np.array([record.rounding[name].max() for name in names])
    varied = np.ptp(efforts, axis=0) > 2 * record.rounding_of("effort", law.joints).max(axis=0)
    standing = varied & (changes > 0) & (sizes <= _STILL * changes) & (digits <= _STILL * changes)
    if not standing.any():
        return None
    k = int(np.argmax(np.where(standing, changes, 0)))
    which = "all joints" if standing.all() else ", ".join(law.joints[k] for k in np.flatnonzero(standing).tolist())
    words = (
        f"{which}: velocities stay zero whatever the effort, as under motors that hold them (PyBullet's do unless "
        f"setJointMotorControl2(..., VELOCITY_CONTROL, force=0) switches them off); {names[k]} would change by "
        f"{error(changes[k])} in a step and is at most {error(sizes[k])}"
    )
    return LayerCause("held_joints", words, None, float(sizes[k] / changes[k]))
