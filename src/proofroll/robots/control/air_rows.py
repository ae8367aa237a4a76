"""Forces at rows of a record of a robot in the air, whitened, and what more of each number would take away.

M dv/dt + armature dv/dt + damping v + friction sign v + drag + payload = scale · effort + gravity - h, the drag of each
link being m v (1 + |v|) at its centre of mass, and I w (1 + |w|).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from proofroll.core.integrators import classical_step
from proofroll.core.number_format import error
from proofroll.elements.mechanism.scene.rotations import skew
from proofroll.robots.control.bookkeeping.air import AirLink, AirRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import BASE, ControlRecord
from proofroll.robots.model import Array

# Number of a joint -> what it is called, and its unit.
BY_JOINT: Mapping[str, tuple[str, str]] = {
    "torque": ("a constant torque of", "N m or N"),
    "friction": ("dry friction of", "N m or N"),
    "damping": ("damping of", "N m s/rad or N s/m"),
    "stiffness": ("a spring of", "N m/rad or N/m"),
    "armature": ("an armature of more by", "kg m² or kg"),
}
_SLOW = 0.02  # part of its largest rate below which a joint is about to turn back
FEWEST_ROWS = 4
SAFETY = 10.0  # on what rounding of the record leaves, whose size is estimated and whose errors are not independent
ROUND_OFF = 1e-9  # part of the forces: round-off of a sum of some terms
_EQUAL = 1e-3  # part of an interval by which intervals may differ
_HELPS = 0.1  # part of a difference that a cause may leave
# Number -> what it is called, and its unit; gravity and efforts are in parts of the right ones.
NUMBERS: Mapping[str, tuple[str, str]] = {
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


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def along(column: Array, values: Array) -> float:
    """Size of the part of values along a column."""
    return abs(float(column @ values)) / float(np.linalg.norm(column) or 1.0)


class StepScheme(NamedTuple):
    """State at which a step has its forces: that before it, but for these.

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
class AirRows:
    """Forces at rows of a record, whitened by the masses, one after the other.

    Attributes:
        left: remainder with the right numbers, (numbers,).
        columns: number -> what one more of it takes away, (numbers,).
        by_joint: number -> the same of it at each driven joint, (numbers, joints).
        added: body -> the same of its mass, first moment [kg m] and inertia about its origin, (numbers, 10).
        rounding: root mean square of what rounding of the record makes of ``left``.
        late: part of ``left`` that half an interval between rows makes, where steps are not the rows, (numbers,).
        size: root mean square of the forces.
        slow: True at rows at which a driven joint is about to turn back, (numbers,).
    """

    left: Array
    columns: Mapping[str, Array]
    by_joint: Mapping[str, Array]
    added: Mapping[str, Array]
    rounding: float
    late: Array
    size: float
    slow: NDArray[np.bool_]

    def proof(self, after: float, closing: str = "with that") -> str:
        """Clause on the forces that are off, and those that a cause leaves; ``after``: their root mean square."""
        return f"forces off by {error(self.off / self.size)} of their size, by {error(after / self.size, 1)} {closing}"

    def without(self, left_out: NDArray[np.bool_]) -> AirRows:
        """The same at fewer rows."""
        kept = ~left_out
        columns, by_joint, added = (
            {name: item[kept] for name, item in table.items()} for table in (self.columns, self.by_joint, self.added)
        )
        return replace(
            self,
            left=self.left[kept],
            columns=columns,
            by_joint=by_joint,
            added=added,
            late=self.late[kept],
            slow=self.slow[kept],
        )

    @property
    def off(self) -> float:
        """Root mean square of what the right numbers leave."""
        return rms(self.left)

    @cached_property
    def unknown(self) -> float:
        """Root mean square of what half an interval makes."""
        return rms(self.late)

    def explained(self, remainder: float) -> bool:
        """True if a cause that leaves ``remainder`` closes what the right numbers leave.

        It leaves a small part, and no more than rounding, unless even half an interval leaves less than there is.
        """
        return remainder <= _HELPS * self.off and (remainder <= SAFETY * self.rounding or self.off > self.unknown)

    def rounded(self, remainder: Array) -> bool:
        """True if rounding explains a remainder, alone and along each number."""
        parts = [along(column, remainder) for column in self.columns.values()]
        return max(parts) <= SAFETY * self.rounding and rms(remainder) <= SAFETY * self.rounding

    @cached_property
    def exact(self) -> bool:
        """True if rounding explains what the right numbers leave."""
        return self.rounded(self.left)

    def shown(self, column: Array, remainder: Array) -> bool:
        """True if rounding explains what a number leaves, and neither it nor half an interval what it takes away."""
        taken = SAFETY * self.rounding + along(column, self.late)
        return self.rounded(remainder) and along(column, self.left) > taken


def states_of(record: ControlRecord, robot: AirRobot) -> list[tuple[Array, Array]] | str:
    """Coordinates and velocities of the mechanism at all rows, or the reason why there are none at equal intervals."""
    q, v = record.stacked("q", robot.joints), record.stacked("v", robot.joints)
    if q is None or v is None:
        return "the record has no columns q.JOINT and v.JOINT of all joints"
    steps = np.diff(record.time)
    if len(steps) < FEWEST_ROWS or float(np.ptp(steps)) > _EQUAL * float(steps.mean()):
        return "accelerations need rows at equal, short intervals"
    if robot.base is None:
        return [robot.coordinates(*row, None) for row in zip(q, v, strict=True)]
    parts = [record.stacked(name, tuple(axes)) for name, axes in BASE.items()]
    base = [item for item in parts if item is not None]
    if len(base) < len(parts):
        return "the record has no place, quaternion and velocities of the base"
    return [robot.coordinates(*row) for row in zip(q, v, np.concatenate(base, axis=1), strict=True)]


class MovingRates(NamedTuple):
    """Velocities whose differences are accelerations, (times, nv), and the rotation of the base at all rows.

    Its linear velocity is then along the world's axes; without rotations it is along its own.
    """

    rates: Array
    axes: Array | None = None


def motion_of(record: ControlRecord, robot: AirRobot) -> tuple[list[tuple[Array, Array]], list[MovingRates]] | str:
    """States at all rows, and their velocities along the axes in which a method may add steps to them."""
    states = states_of(record, robot)
    if isinstance(states, str):
        return states
    of_body = np.array([v for _, v in states])
    if robot.base is None:
        return states, [MovingRates(of_body)]
    attitude = np.array([q[robot.base[0]][3:] for q, _ in states])
    R = Rotation.from_quat(attitude, scalar_first=True).as_matrix()
    of_world, start = of_body.copy(), robot.base[1].start
    of_world[:, start : start + 3] = np.einsum("tij,tj->ti", R, of_body[:, start : start + 3])
    return states, [MovingRates(of_world, R), MovingRates(of_body)]


class AirTable:
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
        self._stepped: dict[tuple[int, bool], Array] = {}
        self._added: dict[tuple[int, tuple[bool, bool]], list[Array]] = {}

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
        if (row, held) in self._stepped:
            return self._stepped[row, held]
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

        new_v = classical_step(rates, np.concatenate([q, v]), self.step)[len(q) :]
        self._stepped[row, held] = np.asarray((self.at[row + 1][1] - new_v) / self.step)
        return self._stepped[row, held]

    def _slope(self, row: int, rate: Array, *, of_world: bool) -> Array:
        """Change of the forces of inertia at a row with velocities that change by ``rate``; they are quadratic.

        ``of_world``: True if the velocity of a base that floats has its steps along the world's axes.
        """
        q, v = self.at[row]
        M, place = self._forces(row)[0], self.robot.base[1] if of_world and self.robot.base else slice(0, 0)

        def turning(velocity: Array) -> Array:
            """Part of the base's acceleration that the turning of its axes makes."""
            return np.cross(velocity[place][3:], velocity[place][:3]) if place.stop else np.zeros(0)

        change = rate.copy()
        change[place][:3] += turning(v)
        size = (np.abs(v).max() or 1.0) / (np.abs(change).max() or 1.0)
        ends = (v + size * change, v - size * change)
        forces_after, forces_before = (self.robot.forces(q, end)[1] + M[:, place][:, :3] @ turning(end) for end in ends)
        return np.asarray((forces_after - forces_before) / (2 * size))

    def rows(self, rows: Array, moving: MovingRates, scheme: StepScheme, *, central: bool) -> AirRows:
        """Forces at some rows.

        Args:
            rows: their indices.
            moving: velocities whose differences are accelerations.
            scheme: state at which forces act.
            central: True if accelerations are differences over two intervals.
        """
        law, robot, h, rated = self.law, self.robot, self.step, moving.rates
        previous, width = (rows - 1, 2 * h) if central else (rows, h)
        rates = (rated[rows + 1] - rated[previous]) / width
        late = np.minimum(rows + 1, len(rated) - 2)
        ahead = (rated[late + 1] - rated[late]) / h
        added = law.armature if law.armature.any() else np.ones(len(law.joints))
        driven = robot.driven[:, 1]
        left, noise, lates, sizes, slow = [], [], [], [], []
        least = _SLOW * np.abs(rated[:, driven]).max(axis=0)
        columns: dict[str, list[Array]] = {name: [] for name in (*NUMBERS, "implicit")}
        singles: dict[str, list[Array]] = {name: [] for name in BY_JOINT}
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
                acting -= h * self._slope(row, rate, of_world=moving.axes is not None)
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
            parts = 2 * self.placed + 2 * self.rated / (1e-300 + np.abs(v).max()) + ROUND_OFF
            noise.append(np.sqrt(squares + (parts * forces) ** 2))
            slow.append(np.full(len(into), bool(np.any(np.abs(v[driven]) < least))))
            lates.append(into @ (M @ (following - rate)) / 2)
            columns["gravity"].append(into @ weight)
            columns["effort"].append(into @ robot.load(effort))
            columns["armature"].append(-into @ (robot.load(added) * rate))
            damped_v = v[driven] + (h * rate[driven] if scheme.damped or scheme.whole else 0.0)
            columns["damping"].append(-into @ robot.load(damped_v))
            columns["friction"].append(-into @ robot.load(np.sign(v[driven])))
            columns["drag"].append(-into @ drag)
            columns["implicit"].append(-into @ (robot.load(h * law.kd) * rate))
            of_joints = {"damping": -damped_v, "friction": -np.sign(v[driven]), "torque": np.ones(len(driven))}
            of_joints |= {"stiffness": -q[robot.driven[:, 0]], "armature": -rate[driven]}
            for name, values in of_joints.items():
                singles[name].append(into[:, driven] * values)
            for body, forces_of in zip(bodies, self._of_bodies(row, rate, (central, moving.axes is None)), strict=True):
                bodies[body].append(-into @ forces_of)
        return AirRows(
            left=np.concatenate(left),
            columns={name: np.concatenate(parts) for name, parts in columns.items()},
            by_joint={name: np.concatenate(parts) for name, parts in singles.items()},
            added={name: np.concatenate(parts) for name, parts in bodies.items()},
            rounding=rms(np.concatenate(noise)),
            late=np.concatenate(lates),
            size=rms(np.concatenate(sizes)) or 1.0,
            slow=np.concatenate(slow),
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

    def _of_bodies(self, row: int, rate: Array, kind: tuple[bool, bool]) -> list[Array]:
        """Forces along the velocities that a mass, a first moment and an inertia of each body need, (nv, 10).

        ``kind``: of the rates; a row has one rate of each.
        """
        if (row, kind) in self._added:
            return self._added[row, kind]
        tree, gravity, added = self.robot.equations.tree, np.array(self.robot.mechanism.gravity), []
        motion = tree.at(*self.at[row])
        for k in range(len(self.robot.mechanism.bodies)):
            R, J = motion.R_WB[k], motion.J[k]
            acceleration = J @ rate + motion.bias[k]
            pull, turning, spin = R.T @ (acceleration[:3] - gravity), R.T @ acceleration[3:], R.T @ motion.w_WB[k]
            moved = skew(turning) + skew(spin) @ skew(spin)
            wrench = np.zeros((6, 10))
            wrench[:3, 0], wrench[:3, 1:4] = pull, moved
            wrench[3:, 1:4] = -skew(pull)
            wrench[3:, 4:] = _inertial(turning) + skew(spin) @ _inertial(spin)
            added.append(J[:3].T @ R @ wrench[:3] + J[3:].T @ R @ wrench[3:])
        self._added[row, kind] = added
        return added


def _largest(record: ControlRecord, kinds: tuple[str, ...]) -> float:
    """Largest rounding of columns whose names begin so; 0 without one."""
    return max((float(item.max()) for name, item in record.rounding.items() if name.startswith(kinds)), default=0.0)


def _inertial(a: Array) -> Array:
    """Matrix that turns an inertia (xx, yy, zz, xy, xz, yz) into its product with a vector, (3, 6)."""
    x, y, z = a
    return np.array([[x, 0, 0, y, z, 0], [0, y, 0, x, 0, z], [0, 0, z, 0, x, y]])
