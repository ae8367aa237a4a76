"""Gravity, scale of efforts and armature of a record in the air, by least squares of its accelerations."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.bookkeeping.air import AirRobot
from proofroll.elements.mechanism.bookkeeping.law import ControlLaw
from proofroll.robots.control_record import BASE, ControlRecord
from proofroll.robots.model import Array

_MOST_ROWS = 40  # rows of a record whose accelerations are looked at
_FEWEST_ROWS = 4
_SAFETY = 10.0  # on the standard error: what is left over is an error of the scheme, and no noise
_ALIKE = 10.0  # sums of squares that are left and tell nothing apart differ by no more
_EQUAL = 1e-3  # part of an interval by which intervals may differ


@dataclass(frozen=True)
class AirFit:
    """Parameters of a robot in the air.

    Attributes:
        names: of the parameters: gravity and the scale of efforts, in parts of the right ones; armature in parts of the
            law's, or in kg m² where the law has none.
        values, right, errors: fitted, by the law, and error bars; shape (3,).
        imitated: True if the record fits kd at the velocity after a step h, and explicit kd with an armature of h kd
            more as well.
    """

    names: tuple[str, ...]
    values: Array
    right: Array
    errors: Array
    imitated: bool


def acceleration_fit(record: ControlRecord, law: ControlLaw, mechanism: Mechanism) -> AirFit | str:
    """Fit of a record with a row for each step or a few steps, or the reason why there is none.

    M dv/dt + armature dv/dt = scale · effort + gravity - h; with implicit kd there is also h kd dv/dt on the left.
    """
    efforts, targets = record.stacked("effort", law.joints), record.stacked("target", law.joints)
    if efforts is None:
        return "the record has no columns effort.JOINT"
    robot = AirRobot(mechanism, law.change(armature=np.zeros(len(law.joints)), gravity=1.0))
    motion = _motion(record, robot)
    if isinstance(motion, str):
        return motion
    at, velocities, base_axes = motion
    step = float(np.diff(record.time).mean())
    held = np.ones(len(record.time), bool)
    if targets is not None:
        held[1:] = np.all(targets[1:] == targets[:-1], axis=1)
    fits = []
    # A method adds steps to the velocity of a floating base along the world's axes, or along the base's.
    moving = [(velocities, base_axes)] + ([] if robot.base is None else [(np.array([v for _, v in at]), None)])
    for central, (rated, axes) in itertools.product((False, True), moving):
        rows = np.flatnonzero(held[1:-1]) + 1 if central else np.arange(len(record.time) - 1)
        if len(rows) < _FEWEST_ROWS:
            continue
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(_MOST_ROWS, len(rows))).astype(int))]
        before, width = (rows - 1, 2 * step) if central else (rows, step)
        rates = (rated[rows + 1] - rated[before]) / width
        try:
            table = _table(robot, mechanism, law, [at[row] for row in rows], rates, efforts[rows], axes, rows)
        except (Diverged, Refused) as error:
            return str(error)
        for implicit in (False, True):
            fits.append((*_solved(table, step if implicit else 0.0), implicit))
    if not fits:
        return "too few rows lie between instants"
    right = np.array([law.gravity, 1.0, 1.0 if law.armature.any() else 0.0])
    least = min(square for _, _, square, _ in fits)
    alike = [fit for fit in fits if fit[2] <= _ALIKE * least]
    values, errors, _, implicit = min(alike, key=lambda fit: float((np.abs(fit[0] - right) / fit[1]).max()))
    imitated = implicit and not all(fit[3] for fit in alike)
    return AirFit(
        names=("gravity", "effort scale", "armature"), values=values, right=right, errors=errors, imitated=imitated
    )


def states_of(record: ControlRecord, robot: AirRobot) -> list[tuple[Array, Array]] | str:
    """Coordinates and velocities of the mechanism at all rows, or the reason why there are none at equal intervals."""
    q, v = record.stacked("q", robot.joints), record.stacked("v", robot.joints)
    if q is None or v is None:
        return "the record has no columns q.JOINT and v.JOINT of all joints"
    steps = np.diff(record.time)
    if len(steps) < _FEWEST_ROWS or float(np.ptp(steps)) > _EQUAL * float(steps.mean()):
        return "accelerations need rows at equal, short intervals"
    if robot.base is None:
        return [robot.coordinates(*row, None) for row in zip(q, v, strict=True)]
    parts = [record.stacked(name, tuple(axes)) for name, axes in BASE.items()]
    base = [item for item in parts if item is not None]
    if len(base) < len(parts):
        return "the record has no place, quaternion and velocities of the base"
    return [robot.coordinates(*row) for row in zip(q, v, np.concatenate(base, axis=1), strict=True)]


def _motion(record: ControlRecord, robot: AirRobot) -> tuple[list[tuple[Array, Array]], Array, Array] | str:
    """States at all rows; velocities whose differences are accelerations; rotation of the base at all rows.

    The velocity of the base is along the world's axes, and its angular velocity along its own.
    """
    at = states_of(record, robot)
    if isinstance(at, str):
        return at
    velocities, rotations = np.array([v for _, v in at]), np.tile(np.eye(3), (len(at), 1, 1))
    if robot.base is not None:
        attitude = np.array([q[robot.base[0]][3:] for q, _ in at])
        rotations = Rotation.from_quat(attitude, scalar_first=True).as_matrix()
        linear = velocities[:, robot.base[1]][:, :3]
        velocities[:, robot.base[1].start : robot.base[1].start + 3] = np.einsum("tij,tj->ti", rotations, linear)
    return at, velocities, rotations


def _table(
    robot: AirRobot,
    mechanism: Mechanism,
    law: ControlLaw,
    at: list[tuple[Array, Array]],
    rates: Array,
    efforts: Array,
    rotations: Array | None,
    rows: Array,
) -> tuple[Array, Array, Array]:
    """Forces that the rates need, what each parameter adds to them, and kd dv/dt; whitened by the mass matrix.

    ``rotations``: of the base, whose rates are then along the world's axes; None: along its own.
    """
    weightless = AirRobot(replace(mechanism, gravity=(0.0, 0.0, 0.0)), law.change(armature=0.0 * law.armature))
    added = law.armature if law.armature.any() else np.ones(len(law.joints))
    needed, columns, damped = [], [], []
    for (q, v), rate, effort, row in zip(at, rates.copy(), efforts, rows, strict=True):
        if robot.base is not None and rotations is not None:
            base = rate[robot.base[1]]
            moving, spin = v[robot.base[1]][:3], v[robot.base[1]][3:]
            base[:3] = rotations[row].T @ base[:3] - np.cross(spin, moving)
        M = robot.equations.inertial(robot.equations.tree.at(q, v))[1]
        inner = M @ weightless.equations.solve(q, v).acceleration
        weight = M @ robot.equations.solve(q, v).acceleration - inner
        into = np.linalg.inv(np.linalg.cholesky(M + np.diag(robot.load(law.armature))))
        needed.append(into @ (M @ rate - inner))
        columns.append(into @ np.stack([weight, robot.load(effort), -robot.load(added) * rate], axis=1))
        held = np.where(np.abs(effort) < law.limit * (1 - 1e-6), law.kd, 0.0)
        damped.append(into @ (robot.load(held) * rate))
    return np.concatenate(needed), np.concatenate(columns), np.concatenate(damped)


def _solved(table: tuple[Array, Array, Array], step: float) -> tuple[Array, Array, float]:
    """Parameters, their error bars, and the sum of squares that is left; ``step``: of implicit kd, else 0."""
    needed, columns, damped = table
    wanted = needed + step * damped
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    values, *_ = np.linalg.lstsq(columns / size, wanted, rcond=None)
    left = wanted - columns @ (values / size)
    square = float(left @ left)
    inverse = np.linalg.pinv((columns / size).T @ (columns / size))
    errors = _SAFETY * np.sqrt(np.diag(inverse) * square / max(1, len(wanted) - len(size)))
    return values / size, errors / size + 1e-9, square
