"""Robot in the air whose accelerations are recorded: gravity, efforts, inertias and losses, by least squares.

What the right numbers leave is held against the rounding of the record; a number that is not right counts if with it no
more than rounding is left. Rows at which a stop, dry friction or a motor holds a joint are left out, or named.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import Diverged, Refused
from proofroll.core.number_format import error, with_bar
from proofroll.robots.control.air_rows import (
    FEWEST_ROWS,
    NUMBERS,
    ROUND_OFF,
    SAFETY,
    AirRows,
    AirTable,
    StepScheme,
    motion_of,
    right_numbers,
    rms,
    states_of,
)
from proofroll.robots.control.air_several import may_be_explained, several_causes
from proofroll.robots.control.bookkeeping.air import AirRobot, HeldRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import FITTED, ControlRecord, LayerCause
from proofroll.robots.model import Array

_NEAR = 1e-3  # part of a range at whose ends a stop may act
_STILL = 0.01  # part of the change of velocity in a step up to which a joint stands still
_ROWS = 5  # rows whose accelerations are computed
_MOST_ROWS = 40  # rows of a record whose accelerations are looked at
_FEW = 150  # equations by which a scheme that is rare is looked at first
_UNKNOWN = 3.0  # times what half an interval makes that steps between rows may make: efforts jump at instants
_FEW_BARS = 3.0  # bars of rounding up to which what is left accuses nothing but a number beyond several of its own
_OWN_BARS = 2.0  # bars of such a number: a bar is ten roundings, for their errors are not independent
_STAGED = 0.05  # part of what the right numbers leave that friction may leave over the stages of a step
_BOUND = 0.05  # part of the rows at which friction is at its bound, at least
_SIGNED = ("gravity", "effort")  # numbers that may have the other sign
_DIGITS = f"that is no more than {_FEW_BARS:.0f} times what the record's digits make"
_SOFT = "dry friction within its bounds explains it, as that of MuJoCo, which is soft: no other cause is decided"


class _Trial(NamedTuple):
    """Forces at the rows of a record by the steps of a scheme; ``hopeful``: False if no numbers explain a few rows."""

    scheme: StepScheme
    rows: AirRows
    hopeful: bool


@dataclass(frozen=True)
class AirFit:
    """Accelerations of a robot in the air against the right ones, in parts of the largest forces.

    Attributes:
        off: root mean square of what the right numbers leave.
        bar: part of it that the rounding of the record explains.
        causes: numbers with which no more than rounding is left; empty where the right ones leave no more.
        damped: True if the record fits damping of joints at the velocity after a step, and an armature of h times it
            more as well.
        imitated: True if the record fits kd at the velocity after a step h, and explicit kd with an armature of h kd
            more as well.
        tried: number of numbers and bodies that were tried.
        between: True if more than rounding is left, which no cause explains and steps between the rows may.
        hidden: clause on what hides every cause, soft friction or the digits of the record; empty: nothing does.
    """

    off: float
    bar: float
    causes: tuple[LayerCause, ...] = ()
    damped: bool = False
    imitated: bool = False
    tried: int = 0
    between: bool = False
    hidden: str = ""

    @property
    def left(self) -> float:
        """Part of the forces that the best cause leaves, or the right numbers where there is none."""
        return min((cause.after for cause in self.causes), default=self.off)


def acceleration_fit(
    record: ControlRecord,
    law: ControlLaw,
    held: HeldRobot,
    efforts: Array,
    steady: Array,
    usable: NDArray[np.bool_] | None = None,
    *,
    together: bool = True,
) -> AirFit | str:
    """Fit of a record with a row for each step or a few steps, or the reason why there is none.

    Args:
        record: with the state.
        law: the law as it should be.
        held: the robot.
        efforts: of the joints from each row on, (times, n).
        steady: True at rows at which no target changes, (times,).
        usable: True at rows at which nothing else acts, (times,); None: all are.
        together: True if several numbers are tried together where no single one explains what is left; False: a record
            that no single one explains has no fit.
    """
    robot = AirRobot.bare(held.mechanism, law)
    motion = motion_of(record, robot)
    if isinstance(motion, str):
        return motion
    states, moving = motion
    few = max(FEWEST_ROWS, -(-_FEW // robot.mechanism.nv))
    table = AirTable(record, law, robot, states, efforts, held.links)
    trials: list[_Trial] = []
    every = [StepScheme(*item) for item in itertools.product((False, True), (False, True))]
    schemes = [item for item in every if robot.damping.any() or not item.damped]
    rarer = [*(item for item in every if item not in schemes), StepScheme(whole=True)]
    rarer += [StepScheme(stages=True), StepScheme(stages=True, held=True)]
    try:
        for central, rated in itertools.product((False, True), moving):
            rows = np.flatnonzero(steady[1:-1]) + 1 if central else np.arange(len(record.time) - 1)
            if usable is not None:
                rows = rows[usable[rows] & usable[rows - central]]
            if len(rows) < FEWEST_ROWS:
                continue
            moved = rows[~table.slow[rows]]  # near rest dry friction is none that a sign tells
            first, rows = _spread(moved if len(moved) >= few else rows, few), _spread(rows, _MOST_ROWS)
            for scheme in (*schemes, *([] if central else rarer)):
                if scheme in rarer and any(item.rows.exact for item in trials):
                    break
                begun = table.rows(first, rated, scheme, central=central) if trials or not together else None
                hopeful = begun is None or _promising(_Trial(scheme, begun, True), law, robot, together=together)
                if not hopeful and (scheme in rarer or not together):
                    continue
                trials.append(_Trial(scheme, table.rows(rows, rated, scheme, central=central), hopeful))
                if trials[-1].rows.exact and not any(scheme):
                    return _judged(trials[-1:], law, robot, together=False)
    except (Diverged, Refused) as error:
        return str(error)
    if not trials:
        return "too few rows are left" if together else "no single number explains a few rows"
    return _judged(trials, law, robot, together=together)


def _spread(rows: Any, most: int) -> Any:
    """Some of the rows at equal intervals."""
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(int))]


def _promising(trial: _Trial, law: ControlLaw, robot: AirRobot, *, together: bool) -> bool:
    """True if a scheme may explain a record by what it leaves at a few rows, with or without a cause."""
    rows, softened = trial.rows, trial.scheme.stages and _softened(trial, law, robot)
    return rows.exact or softened or bool(_causes(rows, law)) or (together and may_be_explained(rows, law.joints))


def _judged(trials: Sequence[_Trial], law: ControlLaw, robot: AirRobot, *, together: bool) -> AirFit:
    """Fit with the scheme that leaves least, and causes where that is more than rounding."""
    scheme, best, _ = min(trials, key=lambda trial: trial.rows.off / trial.rows.size)
    scale = 1 / best.size
    if best.exact:
        explicit = [item.rows for item in trials if not item.scheme.implicit]
        armed = [item for item in explicit if rms(item.left - item.columns["implicit"]) <= SAFETY * item.rounding]
        imitated = scheme.implicit and bool(armed)
        damped = scheme.damped and bool(robot.damping.any())
        return AirFit(best.off * scale, SAFETY * best.rounding * scale, damped=damped, imitated=imitated)
    bar = SAFETY * best.rounding
    few, soft = best.off <= _FEW_BARS * bar, any(_softened(item, law, robot) for item in trials)
    right = LayerCause("", "", None, best.off * scale)  # what no cause may leave, whatever the scheme
    causes: dict[str, LayerCause] = {}
    for trial in trials if not soft else ():
        for cause in _causes(trial.rows, law, _OWN_BARS if few else 1.0):
            if cause.after < causes.get(cause.id, right).after:
                causes[cause.id] = cause
    if soft or (few and not causes):
        digits = f"{_DIGITS}, {error(bar * scale)}: log more digits to decide"
        return AirFit(best.off * scale, bar * scale, hidden=_SOFT if soft else digits)
    closed = any(cause.after <= bar * scale for cause in causes.values())  # by one of them to rounding
    several = [cause for cause in causes.values() if cause.after <= bar * scale or not closed]
    named = sorted(several, key=lambda cause: cause.after)
    if together and not closed:
        likely = [rows for item, rows, hopeful in trials if hopeful and not item.stages]
        sets = [several_causes(rows, law.joints, right_numbers(law)) for rows in likely]
        named = min(filter(None, sets), key=len, default=named)
    # The steps of the program may be no rows.
    between = not named and bar < best.off <= _UNKNOWN * min(item.rows.unknown for item in trials)
    tried = len(NUMBERS) + len(best.added)
    return AirFit(best.off * scale, bar * scale, tuple(named), tried=tried, between=between)


def _softened(trial: _Trial, law: ControlLaw, robot: AirRobot) -> bool:
    """True if dry friction within its bounds, and at them at some rows, leaves no more than rounding.

    MuJoCo's friction is a soft row: below its bound it is a force by the velocity and the acceleration of its joint.
    Over the stages of RK4 it changes, so that its mean goes beyond by a part of what half an interval makes.
    """
    rows, staged = trial.rows, trial.scheme.stages
    bounds = {joint.name: joint.friction for joint in robot.mechanism.joints}
    friction = np.array([bounds[name] for name in law.joints])
    rubbing = friction > 0
    if not rubbing.any():
        return False
    rows = rows.without(rows.slow) if rows.slow.any() and not rows.slow.all() else rows
    columns = rows.by_joint["friction"][:, rubbing].reshape(-1, rows.freedoms, np.count_nonzero(rubbing))
    inverse = np.linalg.pinv(columns)
    more, late = (np.einsum("rij,rj->ri", inverse, item.reshape(-1, rows.freedoms)) for item in (rows.left, rows.late))
    sizes = np.linalg.norm(columns, axis=1)
    near = SAFETY * rows.rounding / sizes[sizes > 0].min(initial=np.inf) + ROUND_OFF
    beyond = near + staged * np.abs(late)
    within = np.all((more <= beyond) & (more >= -2 * friction[rubbing] - beyond))
    left = rows.left - np.einsum("rij,rj->ri", columns, more).ravel()
    explained = rows.rounded(left) or (staged and rms(left) <= _STAGED * rows.off)
    return bool(within and explained and np.mean(np.abs(more) <= near) >= _BOUND)


def _causes(rows: AirRows, law: ControlLaw, bars: float = 1.0) -> list[LayerCause]:
    """Numbers beyond so many bars that close what the right ones leave, but those that leave more than the best's."""
    causes = [*_numbers(rows, law, bars)]
    least = max(min((cause.after for cause in causes), default=0.0), ROUND_OFF)
    return [cause for cause in causes if cause.after <= least * np.sqrt(1 + SAFETY**2 / len(rows.left))]


def _numbers(rows: AirRows, law: ControlLaw, bars: float) -> Iterator[LayerCause]:
    """Numbers of the robot beyond so many of their bars that close what the right ones leave."""
    right = right_numbers(law)
    for name, (words, unit) in NUMBERS.items():
        column = rows.columns[name]
        square = float(column @ column)
        if not square:
            continue
        change = float(column @ rows.left) / square
        remainder, value = rows.left - change * column, right.get(name, 0.0) + change
        distance, matched = rms(remainder), rows.shown(column, remainder)
        bar = SAFETY * (rows.rounding if matched else max(rows.rounding, distance)) / np.sqrt(square) + ROUND_OFF
        told = (matched or rows.explained(distance)) and abs(change) > bars * bar
        if not told or (name not in _SIGNED and value < -bar):
            continue
        if name in _SIGNED and abs(value + 1) <= bar:
            yield _cause(name, f"{words.removesuffix(' is')} has the other sign", -1.0, rows, distance)
            continue
        text, interval = with_bar(value, bar, 1)
        in_unit = "kg m² or kg" if name == "armature" and not law.armature.any() else unit
        yield _cause(name, f"{words} {text} ± {interval} {in_unit}", value, rows, distance)


def _cause(name: str, sentence: str, value: float | None, rows: AirRows, distance: float) -> LayerCause:
    return LayerCause(name, f"{sentence} ({rows.proof(distance)})", value, distance / rows.size)


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
    at_ends = {}
    for joint, (lower, upper) in ranges.items():
        near = _NEAR * (upper - lower)
        if (q := record.columns.get(f"q.{joint}")) is not None:
            at_ends[f"q.{joint}"] = (q <= lower + near) | (q >= upper - near)
    off_stops, at_stops = _rows_without(at_ends, record.time)
    rubbing = [f"v.{joint.name}" for joint in held.mechanism.joints if joint.friction]
    standing = {
        name: np.abs(record.columns[name]) <= record.rounding[name] for name in rubbing if name in record.columns
    }
    off_friction, at_rest = _rows_without(standing, record.time)
    remarks = [f"rows at an end of the range of a joint are left out: {at_stops}"] if at_stops else []
    remarks += [f"rows at which dry friction may hold a joint are left out: {at_rest}"] if at_rest else []
    usable = off_stops & off_friction
    if remarks:
        fit = acceleration_fit(record, law, held, efforts, steady, usable)
    if isinstance(fit, str) or (
        _differs(fit) and not fit.hidden and (len(fit.causes) != 1 or fit.causes[0].id == FITTED)
    ):
        motors = _held_joints(record, law, held, efforts, off_stops)
        if motors is not None:
            return StandingFit(replace(whole, causes=(motors,), between=False), every, "")
    return StandingFit(fit, usable, "; ".join(remarks))


def _differs(fit: AirFit) -> bool:
    """True if accelerations are not the right ones, or rounding hides whether they are."""
    return fit.off > fit.bar or fit.bar >= 1


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
    friction, rates = np.zeros(mechanism.nv), list[Array]()
    for joint, at_v in zip(mechanism.joints, mechanism.v_slices, strict=True):
        friction[at_v] = joint.friction
    try:
        for row in rows.tolist():
            q, v = motion[row]
            rate = np.abs(robot.equations.solve(q, v, load=robot.load(efforts[row])).acceleration)
            if friction.any():
                M = robot.equations.inertial(robot.equations.tree.at(q, v))[1]
                rate = rate - np.abs(np.linalg.inv(M)) @ friction
            rates.append(rate[robot.driven[:, 1]])  # what dry friction leaves at least
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
