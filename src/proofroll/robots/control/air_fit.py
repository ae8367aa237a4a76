"""Robot in the air whose accelerations are recorded: gravity, efforts, inertias and losses, by least squares.

M dv/dt + armature dv/dt + damping v + friction sign v + drag + payload = scale · effort + gravity - h, the drag of each
link being m v (1 + |v|) at its centre of mass, and I w (1 + |w|). What the right numbers
leave is held against the rounding of the record; a number that is not right counts if with it no more than rounding is
left.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from proofroll.core.diagnosis.fitting import least_squares_parameters
from proofroll.core.errors import Diverged, Refused
from proofroll.core.integrators import classical_step
from proofroll.core.number_format import error as short
from proofroll.core.number_format import with_bar
from proofroll.elements.mechanism.scene.rotations import skew
from proofroll.robots.control.bookkeeping.air import AirLink, AirRobot, HeldRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import BASE, ControlRecord, LayerCause
from proofroll.robots.model import Array

_MOST_ROWS = 40  # rows of a record whose accelerations are looked at
_FEWEST_ROWS = 4
FITTED = "payload"  # id of the cause that has a mass and an inertia of a body as fitted numbers
_SAFETY = 10.0  # on what rounding of the record leaves, whose size is estimated and whose errors are not independent
_EQUAL = 1e-3  # part of an interval by which intervals may differ
_ROUND_OFF = 1e-9  # part of the forces: round-off of a sum of some terms
_HELPS = 0.1  # part of a difference that a cause may leave
_SMALL = 1e-6  # smallest number that is told, in its unit
# Number -> what it is called, and its unit; gravity and efforts are in parts of the right ones.
_NUMBERS: Mapping[str, tuple[str, str]] = {
    "gravity": ("the gravity is", "of the right one"),
    "effort": ("the effort scale is", "of the right one"),
    "armature": ("the armature is", "of the right one"),
    "damping": ("joints have damping of", "N m s/rad or N s/m"),
    "friction": ("joints have dry friction of", "N m or N"),
    "drag": (
        "every link has drag m v (1 + |v|) and I w (1 + |w|), as linearDamping and angularDamping of PyBullet, of",
        "1/s",
    ),
}
_SIGNED = ("gravity", "effort")  # numbers that may have the other sign


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
    """

    off: float
    bar: float
    causes: tuple[LayerCause, ...] = ()
    damped: bool = False
    imitated: bool = False
    tried: int = 0
    between: bool = False


class _Scheme(NamedTuple):
    """State at which a step has its forces: that before it, unless told otherwise.

    Attributes:
        implicit: True if kd acts at the velocity after the step.
        damped: True if the damping of the joints themselves does, as in MuJoCo's Euler and implicitfast.
        whole: True if all forces of inertia do, linearised, as in MuJoCo's implicit.
        stages: True if the step is one of RK4.
        held: True if efforts are held over its stages; False: servos act in each.
    """

    implicit: bool = False
    damped: bool = False
    whole: bool = False
    stages: bool = False
    held: bool = False


@dataclass(frozen=True)
class _Rows:
    """Forces at rows of a record, whitened by the masses, one after the other.

    Attributes:
        left: remainder with the right numbers, (numbers,).
        columns: number -> what one more of it takes away, (numbers,).
        added: body -> the same of its mass, first moment [kg m] and inertia about its origin, (numbers, 10).
        rounding: root mean square of what rounding of the record makes of ``left``.
        late: part of ``left`` that half an interval between rows makes, where steps are not the rows, (numbers,).
        size: root mean square of the forces.
    """

    left: Array
    columns: Mapping[str, Array]
    added: Mapping[str, Array]
    rounding: float
    late: Array
    size: float

    @property
    def off(self) -> float:
        return _rms(self.left)

    @cached_property
    def unknown(self) -> float:
        return _rms(self.late)

    def explained(self, remainder: float) -> bool:
        """True if a cause that leaves ``remainder`` closes what the right numbers leave.

        It leaves a small part, and no more than rounding, unless even half an interval leaves less than there is.
        """
        return remainder <= _HELPS * self.off and (remainder <= _SAFETY * self.rounding or self.off > self.unknown)

    def rounded(self, remainder: Array) -> bool:
        """True if rounding explains a remainder, alone and along each number."""
        parts = [_along(column, remainder) for column in self.columns.values()]
        return max(parts) <= _SAFETY * self.rounding and _rms(remainder) <= _SAFETY * self.rounding

    @cached_property
    def exact(self) -> bool:
        """True if rounding explains what the right numbers leave."""
        return self.rounded(self.left)

    def shown(self, column: Array, remainder: Array) -> bool:
        """True if rounding explains what a number leaves, and neither it nor half an interval what it takes away."""
        taken = _SAFETY * self.rounding + _along(column, self.late)
        return self.rounded(remainder) and _along(column, self.left) > taken


def acceleration_fit(
    record: ControlRecord,
    law: ControlLaw,
    held: HeldRobot,
    efforts: Array,
    steady: Array,
    usable: NDArray[np.bool_] | None = None,
) -> AirFit | str:
    """Fit of a record with a row for each step or a few steps, or the reason why there is none.

    Args:
        record: with the state.
        law: the law as it should be.
        held: the robot.
        efforts: of the joints from each row on, (times, n).
        steady: True at rows at which no target changes, (times,).
        usable: True at rows at which nothing else acts, (times,); None: all are.
    """
    robot = AirRobot.bare(held.mechanism, law)
    motion = _motion(record, robot)
    if isinstance(motion, str):
        return motion
    states, moving = motion
    table = _Table(record, law, robot, states, efforts, held.links)
    trials: list[tuple[_Scheme, _Rows]] = []
    schemes = [_Scheme(*item) for item in itertools.product((False, True), (False, True))]
    schemes = [item for item in schemes if robot.damping.any() or not item.damped]
    rarer = [_Scheme(whole=True), _Scheme(stages=True), _Scheme(stages=True, held=True)]
    try:
        for central, rated in itertools.product((False, True), moving):
            rows = np.flatnonzero(steady[1:-1]) + 1 if central else np.arange(len(record.time) - 1)
            if usable is not None:
                rows = rows[usable[rows] & usable[rows - central]]
            if len(rows) < _FEWEST_ROWS:
                continue
            rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(_MOST_ROWS, len(rows))).astype(int))]
            for scheme in (*schemes, *([] if central else rarer)):
                if scheme in rarer and any(item.exact for _, item in trials):
                    break
                trials.append((scheme, table.rows(rows, rated, scheme, central=central)))
                if trials[-1][1].exact and not any(scheme):
                    return AirFit(
                        trials[-1][1].off / trials[-1][1].size, _SAFETY * trials[-1][1].rounding / trials[-1][1].size
                    )
    except (Diverged, Refused) as error:
        return str(error)
    if not trials:
        return "too few rows are left"
    return _judged(trials, law, robot)


def _judged(trials: Sequence[tuple[_Scheme, _Rows]], law: ControlLaw, robot: AirRobot) -> AirFit:
    """Fit with the scheme that leaves least, and causes where that is more than rounding."""
    scheme, best = min(trials, key=lambda trial: trial[1].off / trial[1].size)
    scale = 1 / best.size
    if best.exact:
        armed = [rows for item, rows in trials if not item.implicit and _fits(rows, "implicit")]
        imitated = scheme.implicit and bool(armed)
        return AirFit(best.off * scale, _SAFETY * best.rounding * scale, damped=scheme.damped, imitated=imitated)
    right = LayerCause("", "", None, best.off * scale)  # what no cause may leave, whatever the scheme
    causes: dict[str, LayerCause] = {}
    for _, rows in trials:
        for cause in _causes(rows, law, robot):
            if cause.after < causes.get(cause.id, right).after:
                causes[cause.id] = cause
    bar = _SAFETY * best.rounding
    closed = any(cause.after <= bar * scale for cause in causes.values())  # by one of them to rounding
    several = [cause for cause in causes.values() if cause.after <= bar * scale or not closed]
    named = sorted(several, key=lambda cause: cause.after)
    # The steps of the program may be no rows.
    between = not named and bar < best.off <= min(rows.unknown for _, rows in trials)
    tried = len(_NUMBERS) + len(best.added)
    return AirFit(best.off * scale, bar * scale, tuple(named), tried=tried, between=between)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _along(column: Array, values: Array) -> float:
    """Size of the part of values along a column."""
    return abs(float(column @ values)) / float(np.linalg.norm(column) or 1.0)


def _fits(rows: _Rows, name: str) -> bool:
    """True if a number of 1 leaves no more than rounding."""
    return _rms(rows.left - rows.columns[name]) <= _SAFETY * rows.rounding


def _causes(rows: _Rows, law: ControlLaw, robot: AirRobot) -> list[LayerCause]:
    """Numbers and bodies that close what the right ones leave, but those that leave more than the best's errors."""
    causes = [*_numbers(rows, law), *_heavier(rows, robot)]
    least = max(min((cause.after for cause in causes), default=0.0), _ROUND_OFF)
    return [cause for cause in causes if cause.after <= least * np.sqrt(1 + _SAFETY**2 / len(rows.left))]


def _numbers(rows: _Rows, law: ControlLaw) -> Iterator[LayerCause]:
    """Numbers of the robot that close what the right ones leave."""
    right = {"gravity": law.gravity, "effort": 1.0, "armature": float(law.armature.any())}
    for name, (words, unit) in _NUMBERS.items():
        column = rows.columns[name]
        square = float(column @ column)
        if not square:
            continue
        change = float(column @ rows.left) / square
        remainder, value = rows.left - change * column, right.get(name, 0.0) + change
        distance, matched = _rms(remainder), rows.shown(column, remainder)
        bar = _SAFETY * (rows.rounding if matched else max(rows.rounding, distance)) / np.sqrt(square) + _ROUND_OFF
        if not (matched or rows.explained(distance)) or abs(change) <= bar or (name not in _SIGNED and value < -bar):
            continue
        if name in _SIGNED and abs(value + 1) <= bar:
            yield _cause(name, f"{words.removesuffix(' is')} has the other sign", -1.0, rows, distance)
            continue
        text, interval = with_bar(value, bar, 1)
        in_unit = "kg m² or kg" if name == "armature" and not law.armature.any() else unit
        yield _cause(name, f"{words} {text} ± {interval} {in_unit}", value, rows, distance)


def _cause(name: str, sentence: str, value: float | None, rows: _Rows, distance: float) -> LayerCause:
    proof = f"forces off by {short(rows.off / rows.size)} of their size, by {short(distance / rows.size, 1)} with that"
    return LayerCause(name, f"{sentence} ({proof})", value, distance / rows.size)


def _heavier(rows: _Rows, robot: AirRobot) -> Iterator[LayerCause]:
    """A body that weighs more: a mass at a point of it, else any inertia."""
    heavier_bodies: list[tuple[float, str, float | None, str]] = []
    for body, columns in rows.added.items():
        sizes = np.linalg.norm(columns, axis=0)
        seen = sizes > _ROUND_OFF * sizes.max()
        values = np.zeros(10)
        values[seen] = np.linalg.lstsq(columns[:, seen] / sizes[seen], rows.left, rcond=_SMALL)[0] / sizes[seen]
        if not rows.explained(_rms(rows.left - columns @ values)):
            continue
        mass = robot.mechanism.bodies[robot.mechanism.body_index[body]].mass
        start = np.array([values[0] if values[0] > 0 else 0.05 * mass, *values[1:4]])

        def left(numbers: Array, columns: Array = columns) -> Array:
            return rows.left - columns @ _point(numbers)

        numbers = least_squares_parameters(left, start, float(np.abs(start).max()) or 1.0)
        distance = _rms(left(numbers))
        if rows.explained(distance) and numbers[0] > 0:
            place = ", ".join(f"{x:.3g}" for x in (numbers[1:] / numbers[0]).round(4).tolist())
            words = f"{body} carries {numbers[0]:.4g} kg more, at ({place}) m"
            heavier_bodies.append((distance, body, float(numbers[0]), words))
        elif mass + values[0] > 0:
            moments = columns[:, 4:] @ np.linalg.lstsq(columns[:, 4:], rows.left, rcond=_SMALL)[0]
            if rows.explained(_rms(rows.left - moments)):
                words = f"the inertia of {body} is another"
                heavier_bodies.append((_SAFETY * _rms(rows.left - moments), body, None, words))
                continue
            words = f"mass, centre and inertia of {body} are others, {values[0]:+.3g} kg"
            words = words if seen[0] else f"centre and inertia of {body} are others"
            heavier_bodies.append((_SAFETY * _rms(rows.left - columns @ values), body, float(values[0]), words))
    for distance, _, size, words in sorted(heavier_bodies)[:1]:
        yield _cause(FITTED, words, size, rows, distance)


def _point(numbers: Array) -> Array:
    """Mass, first moment and inertia (xx, yy, zz, xy, xz, yz) of a point of a mass with a first moment."""
    m, (x, y, z) = numbers[0], numbers[1:]
    xx, yy, zz, xy, xz, yz = np.array([x * x, y * y, z * z, x * y, x * z, y * z]) / (m or np.inf)
    return np.array([m, x, y, z, yy + zz, xx + zz, xx + yy, -xy, -xz, -yz])


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


class _Moving(NamedTuple):
    """Velocities whose differences are accelerations, (times, nv), and the rotation of the base at all rows.

    Its linear velocity is then along the world's axes; without rotations it is along its own.
    """

    rates: Array
    axes: Array | None = None


def _motion(record: ControlRecord, robot: AirRobot) -> tuple[list[tuple[Array, Array]], list[_Moving]] | str:
    """States at all rows, and their velocities along the axes in which a method may add steps to them."""
    states = states_of(record, robot)
    if isinstance(states, str):
        return states
    of_body = np.array([v for _, v in states])
    if robot.base is None:
        return states, [_Moving(of_body)]
    attitude = np.array([q[robot.base[0]][3:] for q, _ in states])
    R = Rotation.from_quat(attitude, scalar_first=True).as_matrix()
    of_world, start = of_body.copy(), robot.base[1].start
    of_world[:, start : start + 3] = np.einsum("tij,tj->ti", R, of_body[:, start : start + 3])
    return states, [_Moving(of_world, R), _Moving(of_body)]


class _Table:
    """Forces at rows of a record; what no scheme changes is computed once for each row."""

    def __init__(
        self,
        record: ControlRecord,
        law: ControlLaw,
        robot: AirRobot,
        states: list[tuple[Array, Array]],
        efforts: Array,
        links: Sequence[AirLink],
    ) -> None:
        self.links = links
        self.law, self.robot, self.at, self.efforts = law, robot, states, efforts
        self.step = float(np.diff(record.time).mean())
        self.targets = record.stacked("target", law.joints)
        self.rated = _largest(record, ("v.", "v_WB.", "w_WB."))
        self.placed, self.forced = _largest(record, ("q.", "q_WB.")), _largest(record, ("effort.",))
        self._known: dict[int, tuple[Array, ...]] = {}

    def _forces(self, row: int) -> tuple[Array, ...]:
        """Mass matrix with armatures, inertial forces, weight, whitening of free directions, and drag, at a row."""
        if row not in self._known:
            M, inner, weight, free = self.robot.forces(*self.at[row])
            armed = M + np.diag(self.robot.load(self.law.armature))
            into = np.linalg.inv(np.linalg.cholesky(free.T @ armed @ free)) @ free.T
            self._known[row] = armed, inner, weight, into, self._drag(*self.at[row])
        return self._known[row]

    def _by_stages(self, row: int, *, held: bool) -> Array:
        """Change of the velocities by a step of RK4 from a row less the recorded one, in parts of the step."""
        law, robot, (q, v), effort = self.law, self.robot, self.at[row], self.efforts[row]
        at_q, at_v = robot.driven.T
        servos = np.abs(effort) < law.limit * (1 - 1e-6)
        target = None if self.targets is None else self.targets[row]

        def effort_at(place: Array, velocity: Array) -> Array:
            if held:
                return np.asarray(effort)
            if target is not None:
                return np.asarray(effort + law.effort(target, place, velocity) - law.effort(target, q[at_q], v[at_v]))
            change = law.kp * (place - q[at_q]) + law.kd * (velocity - v[at_v])
            return np.asarray(np.clip(effort - np.where(servos, change, 0.0), -law.limit, law.limit))

        def rates(y: Array) -> Array:
            place, velocity = y[: len(q)], y[len(q) :]
            M, inner, weight, free = robot.forces(place, velocity)
            armed = M + np.diag(robot.load(law.armature))
            load = robot.load(effort_at(place[at_q], velocity[at_v]))
            acting = free.T @ (inner + law.gravity * weight + load)
            rate = free @ np.linalg.solve(free.T @ armed @ free, acting)
            return np.concatenate([robot.equations.tree.rate(place, velocity), rate])

        after = classical_step(rates, np.concatenate([q, v]), self.step)[len(q) :]
        return np.asarray((self.at[row + 1][1] - after) / self.step)

    def _slope(self, row: int, rate: Array) -> Array:
        """Change of the forces of inertia at a row with velocities that change by ``rate``; they are quadratic."""
        q, v = self.at[row]
        size = (np.abs(v).max() or 1.0) / (np.abs(rate).max() or 1.0)
        after, before = (self.robot.forces(q, v + change * rate)[1] for change in (size, -size))
        return np.asarray((after - before) / (2 * size))

    def rows(self, rows: Array, moving: _Moving, scheme: _Scheme, *, central: bool) -> _Rows:
        """Forces at some rows.

        Args:
            rows: their indices.
            moving: velocities whose differences are accelerations.
            scheme: what acts at the velocity after a step.
            central: True if accelerations are differences over two intervals.
        """
        law, robot, h, rated = self.law, self.robot, self.step, moving.rates
        previous, width = (rows - 1, 2 * h) if central else (rows, h)
        rates = (rated[rows + 1] - rated[previous]) / width
        late = np.minimum(rows + 1, len(rated) - 2)
        ahead = (rated[late + 1] - rated[late]) / h
        added = law.armature if law.armature.any() else np.ones(len(law.joints))
        driven = robot.driven[:, 1]
        left, noise, lates, sizes = [], [], [], []
        columns: dict[str, list[Array]] = {name: [] for name in (*_NUMBERS, "implicit")}
        bodies: dict[str, list[Array]] = {body.name: [] for body in robot.mechanism.bodies}
        for row, rate, following in zip(rows.tolist(), rates.copy(), ahead.copy(), strict=True):
            q, v = self.at[row]
            M, inner, weight, into, drag = self._forces(row)
            for item in (rate, following):
                if robot.base is not None and moving.axes is not None:
                    base, velocity, spin = item[robot.base[1]], v[robot.base[1]][:3], v[robot.base[1]][3:]
                    base[:3] = moving.axes[row].T @ base[:3] - np.cross(spin, velocity)
            effort = self.efforts[row]
            acting = M @ rate - inner - law.gravity * weight - robot.load(effort)
            if scheme.stages:
                acting = M @ self._by_stages(row, held=scheme.held)
            if scheme.whole:
                acting -= h * self._slope(row, rate)
            if scheme.damped:
                acting += h * robot.damping * rate
            if scheme.implicit:
                acting += h * robot.load(np.where(np.abs(effort) < law.limit * (1 - 1e-6), law.kd, 0.0)) * rate
            left.append(into @ acting)
            forces = np.linalg.norm(into @ (M @ rate)) + np.linalg.norm(into @ weight)
            sizes.append(into @ (M @ rate - inner))
            # Rounding errors spread evenly up to the largest, whose variance is a third of its square.
            squares = ((into @ M) ** 2).sum(axis=1) * 2 * (self.rated / width) ** 2 / 3
            squares = squares + into**2 @ robot.load(np.full(len(effort), self.forced)) ** 2 / 3
            parts = 2 * self.placed + 2 * self.rated / (1e-300 + np.abs(v).max()) + _ROUND_OFF
            noise.append(np.sqrt(squares + (parts * forces) ** 2))
            lates.append(into @ (M @ (following - rate)) / 2)
            columns["gravity"].append(into @ weight)
            columns["effort"].append(into @ robot.load(effort))
            columns["armature"].append(-into @ (robot.load(added) * rate))
            columns["damping"].append(-into @ robot.load(v[driven]))
            columns["friction"].append(-into @ robot.load(np.sign(v[driven])))
            columns["drag"].append(-into @ drag)
            columns["implicit"].append(-into @ (robot.load(h * law.kd) * rate))
            for body, forces_of in zip(bodies, self._of_bodies(q, v, rate), strict=True):
                bodies[body].append(-into @ forces_of)
        return _Rows(
            left=np.concatenate(left),
            columns={name: np.concatenate(parts) for name, parts in columns.items()},
            added={name: np.concatenate(parts) for name, parts in bodies.items()},
            rounding=_rms(np.concatenate(noise)),
            late=np.concatenate(lates),
            size=_rms(np.concatenate(sizes)) or 1.0,
        )

    def _drag(self, q: Array, v: Array) -> Array:
        """Forces along the velocities that drag of 1 1/s on each link needs, (nv,)."""
        motion, total = self.robot.equations.tree.at(q, v), np.zeros(len(v))
        for link in self.links:
            R, w, J = motion.R_WB[link.body], motion.w_WB[link.body], motion.J[link.body]
            arm = R @ link.com
            velocity = J[:3] @ v + np.cross(w, arm)
            force = link.mass * velocity * (1 + np.linalg.norm(velocity))
            torque = R @ link.inertia @ R.T @ w * (1 + np.linalg.norm(w))
            total += J[:3].T @ force + J[3:].T @ (torque + np.cross(arm, force))
        return total

    def _of_bodies(self, q: Array, v: Array, rate: Array) -> Iterator[Array]:
        """Forces along the velocities that a mass, a first moment and an inertia of each body need, (nv, 10)."""
        tree, gravity = self.robot.equations.tree, np.array(self.robot.mechanism.gravity)
        motion = tree.at(q, v)
        for k in range(len(self.robot.mechanism.bodies)):
            R, J = motion.R_WB[k], motion.J[k]
            acceleration = J @ rate + motion.bias[k]
            pull, turning, spin = R.T @ (acceleration[:3] - gravity), R.T @ acceleration[3:], R.T @ motion.w_WB[k]
            moved = skew(turning) + skew(spin) @ skew(spin)
            wrench = np.zeros((6, 10))
            wrench[:3, 0], wrench[:3, 1:4] = pull, moved
            wrench[3:, 1:4] = -skew(pull)
            wrench[3:, 4:] = _inertial(turning) + skew(spin) @ _inertial(spin)
            yield J[:3].T @ R @ wrench[:3] + J[3:].T @ R @ wrench[3:]


def _largest(record: ControlRecord, kinds: tuple[str, ...]) -> float:
    """Largest rounding of columns whose names begin so; 0 without one."""
    return max((float(item.max()) for name, item in record.rounding.items() if name.startswith(kinds)), default=0.0)


def _inertial(a: Array) -> Array:
    """Matrix that turns an inertia (xx, yy, zz, xy, xz, yz) into its product with a vector, (3, 6)."""
    x, y, z = a
    return np.array([[x, 0, 0, y, z, 0], [0, y, 0, x, 0, z], [0, 0, z, 0, x, y]])
