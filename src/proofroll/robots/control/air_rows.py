"""Forces at rows of a record of a robot in the air, whitened, and what more of each number would take away.

M dv/dt + armature dv/dt + damping v + friction sign v + drag + payload = scale · effort + gravity - h, the drag of each
link being m v (1 + |v|) at its centre of mass, and I w (1 + |w|).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from proofroll.core.integrators import classical_step
from proofroll.core.number_format import error
from proofroll.elements.mechanism.dynamics import linear_balance
from proofroll.elements.mechanism.scene.rotations import skews
from proofroll.robots.control.bookkeeping.air import AirForces, AirLink, AirRobot
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
    "quadratic": ("drag v |v| of", "N m s²/rad² or N s²/m²"),
    "efforts": ("efforts of", "of the right ones"),
}
# Vector along the world's axes -> what it is called, and its unit.
VECTORS: Mapping[str, tuple[str, str]] = {
    "pull": ("gravity is more by {}", "m/s²"),
    "push": ("a constant force of {} acts on {body}", "N"),
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


def right_numbers(law: ControlLaw) -> dict[str, float]:
    """Right values of the numbers that are parts of the right ones, or are not zero, by their names."""
    return {"gravity": law.gravity, "effort": 1.0, "armature": float(law.armature.any())}


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
        pushed: body -> the same of a force at its centre along the world's axes [N], or nothing -> of gravity [m/s²],
            (numbers, 3).
        rounding: root mean square of what rounding of the record makes of ``left``.
        late: part of ``left`` that half an interval between rows makes, where steps are not the rows, (numbers,).
        size: root mean square of the forces.
        slow: True at rows at which a driven joint is about to turn back, (numbers,).
        freedoms: numbers of each row.
        blur: part of the columns that is noise.
    """

    left: Array
    columns: Mapping[str, Array]
    by_joint: Mapping[str, Array]
    added: Mapping[str, Array]
    rounding: float
    late: Array
    size: float
    slow: NDArray[np.bool_]
    freedoms: int = 1
    blur: float = 0.0
    pushed: Mapping[str, Array] = field(default_factory=dict)

    def proof(self, after: float, closing: str = "with that") -> str:
        """Clause on the forces that are off, and those that a cause leaves; ``after``: their root mean square."""
        return f"forces off by {error(self.off / self.size)} of their size, by {error(after / self.size, 1)} {closing}"

    def without(self, left_out: NDArray[np.bool_]) -> AirRows:
        """The same at fewer rows."""
        return replace(self.changed(lambda values: values[~left_out]), slow=self.slow[~left_out])

    def changed(self, change: Callable[[Array], Array]) -> AirRows:
        """The same with a change of the remainder, and of all that more of numbers takes away."""
        columns, by_joint, added, pushed = (
            {name: change(item) for name, item in table.items()}
            for table in (self.columns, self.by_joint, self.added, self.pushed)
        )
        left, late = change(self.left), change(self.late)
        return replace(self, left=left, late=late, columns=columns, by_joint=by_joint, added=added, pushed=pushed)

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
        rates = np.array([v[robot.driven[:, 1]] for _, v in states])
        speeds, self.signs = np.abs(rates), np.sign(rates)  # of the driven joints, (times, joints)
        self.slow = np.any(speeds < _SLOW * speeds.max(axis=0), axis=1)  # rows at which a joint is about to turn back
        self._forces: dict[int, AirForces] = {}
        self._stepped: dict[tuple[int, bool], Array] = {}

    def _at(self, row: int) -> AirForces:
        """Forces at a row."""
        if row not in self._forces:
            self._forces[row] = _armed(self.robot, self.law, self.at[row])
        return self._forces[row]

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
            first = np.array_equal(y, start)
            M, inner, weight, free = (self._at(row) if first else _armed(robot, law, (place, velocity)))[:4]
            acting = free.T @ (inner + law.gravity * weight + robot.load(effort_at(place[at_q], velocity[at_v])))
            rate = free @ np.linalg.solve(free.T @ M @ free, acting)
            return np.concatenate([robot.equations.tree.rate(place, velocity), rate])

        start = np.concatenate([q, v])
        new_v = classical_step(rates, start, self.step)[len(q) :]
        self._stepped[row, held] = np.asarray((self.at[row + 1][1] - new_v) / self.step)
        return self._stepped[row, held]

    def _slope(self, row: int, rate: Array, *, of_world: bool) -> Array:
        """Change of the forces of inertia at a row with velocities that change by ``rate``; they are quadratic.

        ``of_world``: True if the velocity of a base that floats has its steps along the world's axes.
        """
        q, v = self.at[row]
        M, place = self._at(row).mass, self.robot.base[1] if of_world and self.robot.base else slice(0, 0)

        def turning(velocity: Array) -> Array:
            """Part of the base's acceleration that the turning of its axes makes."""
            return np.cross(velocity[place][3:], velocity[place][:3]) if place.stop else np.zeros(0)

        change = rate.copy()
        change[place][:3] += turning(v)
        size = (np.abs(v).max() or 1.0) / (np.abs(change).max() or 1.0)
        ends = (v + size * change, v - size * change)
        forces_after, forces_before = (
            self.robot.forces(q, end).inertial + M[:, place][:, :3] @ turning(end) for end in ends
        )
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
        width = 2 * h if central else h
        late = np.minimum(rows + 1, len(rated) - 2)
        q, v = (np.array(part) for part in zip(*(self.at[row] for row in rows.tolist()), strict=True))
        rate, following = (rated[rows + 1] - rated[rows - central]) / width, (rated[late + 1] - rated[late]) / h
        if robot.base is not None and moving.axes is not None:
            place = slice(robot.base[1].start, robot.base[1].start + 3)
            spin = v[:, robot.base[1]][:, 3:]
            for item in (rate, following):
                along_base = np.einsum("tji,tj->ti", moving.axes[rows], item[:, place])
                item[:, place] = along_base - np.cross(spin, v[:, place])
        forces = [self._at(row) for row in rows.tolist()]
        M, inner, weight, free = (np.array(part) for part in list(zip(*forces, strict=True))[:4])
        turned = np.swapaxes(free, 1, 2)
        into = np.linalg.inv(np.linalg.cholesky(turned @ M @ free)) @ turned

        def whitened(values: Array) -> Array:
            """Forces along the velocities, (rows, nv, ...), one after the other, (numbers, ...)."""
            columns = into @ values.reshape(*values.shape[:2], -1)
            return np.asarray(columns.reshape(-1, *values.shape[2:]))

        driven, effort, at_v = robot.driven[:, 1], self.efforts[rows], v[:, robot.driven[:, 1]]
        masses = np.einsum("tij,tj->ti", M, rate)
        acting = masses - inner - law.gravity * weight - robot.load(effort)
        if scheme.stages:
            stepped = np.array([self._by_stages(row, held=scheme.held) for row in rows.tolist()])
            acting = np.einsum("tij,tj->ti", M, stepped)
        if scheme.whole:
            of_world = moving.axes is not None
            slopes = [self._slope(row, item, of_world=of_world) for row, item in zip(rows.tolist(), rate, strict=True)]
            acting = acting - h * np.array(slopes)
        if scheme.damped:
            acting = acting + h * robot.damping * rate
        if scheme.implicit:
            acting = acting + h * robot.load(np.where(np.abs(effort) < law.limit * (1 - 1e-6), law.kd, 0.0)) * rate
        # Rounding errors spread evenly up to the largest, whose variance is a third of its square.
        squares = ((into @ M) ** 2).sum(axis=2) * 2 * (self.rated / width) ** 2 / 3
        squares = squares + into**2 @ robot.load(np.full(effort.shape[1], self.forced)) ** 2 / 3
        sizes = (np.linalg.norm(whitened(part).reshape(len(rows), -1), axis=1) for part in (masses, weight))
        parts = 2 * self.placed + 2 * self.rated / (1e-300 + np.abs(v).max(axis=1)) + ROUND_OFF
        noise = np.sqrt(squares + (parts * sum(sizes))[:, None] ** 2)
        damped_v = at_v + (h * rate[:, driven] if scheme.damped or scheme.whole else 0.0)
        of_joints = {"torque": np.ones(at_v.shape), "friction": -self.signs[rows], "damping": -damped_v}
        of_joints |= {"quadratic": -at_v * np.abs(at_v), "efforts": effort}
        of_joints |= {"stiffness": -q[:, robot.driven[:, 0]], "armature": -rate[:, driven]}
        by_joint = {
            name: whitened(robot.load(values[:, None] * np.eye(len(driven))).swapaxes(1, 2))
            for name, values in of_joints.items()
        }
        of_all = {"gravity": weight, "effort": robot.load(effort), "drag": -self._drag(forces, v)}
        columns = {name: whitened(values) for name, values in of_all.items()}
        columns |= {name: by_joint[name].sum(axis=1) for name in ("damping", "friction")}
        columns["armature"] = by_joint["armature"] @ (law.armature if law.armature.any() else np.ones(len(driven)))
        columns["implicit"] = by_joint["armature"] @ (h * law.kd)
        named = [body.name for body in robot.mechanism.bodies]
        bodies = -np.moveaxis(self._of_bodies(forces, rate), 1, 0)
        pushes = np.array([item.pushes for item in forces]).transpose(1, 0, 3, 2)
        return AirRows(
            left=whitened(acting),
            columns=columns,
            by_joint=by_joint,
            added={name: whitened(values) for name, values in zip(named, bodies, strict=True)},
            pushed={name: whitened(values) for name, values in zip(["", *named], pushes, strict=True)},
            rounding=rms(noise),
            late=whitened(np.einsum("tij,tj->ti", M, following - rate) / 2),
            size=size if (size := rms(whitened(masses - inner))) > ROUND_OFF * rms(whitened(weight)) else 1.0,
            slow=np.repeat(self.slow[rows], into.shape[1]),
            freedoms=into.shape[1],
        )

    def _drag(self, forces: Sequence[AirForces], v: Array) -> Array:
        """Forces along the velocities (rows, nv) that drag of 1 1/s on each link needs, (rows, nv)."""
        R, w, J = (item[:, [link.body for link in self.links]] for item in _bodies(forces, "R_WB", "w_WB", "J"))
        mass, com, inertia = (np.array([getattr(link, name) for link in self.links]) for name in AirLink._fields[1:])
        J[:, :, :3] -= skews((R @ com[:, :, None])[..., 0]) @ J[:, :, 3:]
        speeds = np.einsum("tbij,tj->tbi", J[:, :, :3], v), w
        fluid = (item * (1 + np.linalg.norm(item, axis=-1, keepdims=True)) for item in speeds)
        return linear_balance.forces(linear_balance.moved(R, J, *fluid), mass, 0 * com, inertia)

    def _of_bodies(self, forces: Sequence[AirForces], rate: Array) -> Array:
        """Forces that a mass, a first moment and an inertia of each body need, (rows, bodies, nv, 10)."""
        R, w, J, bias = _bodies(forces, "R_WB", "w_WB", "J", "bias")
        acceleration = np.einsum("tbij,tj->tbi", J, rate) + bias
        pull = acceleration[..., :3] - np.array(self.robot.mechanism.gravity)
        return linear_balance.moved(R, J, pull, acceleration[..., 3:]) + linear_balance.spun(R, J, w)


def _armed(robot: AirRobot, law: ControlLaw, state: tuple[Array, Array]) -> AirForces:
    """Forces in a state, with the armatures of a law."""
    forces = robot.forces(*state)
    return forces._replace(mass=forces.mass + np.diag(robot.load(law.armature)))


def _bodies(forces: Sequence[AirForces], *names: str) -> list[Array]:
    """Arrays of the motion of all bodies, each (rows, bodies, ...)."""
    return [np.array([getattr(item.motion, name)[:-1] for item in forces]) for name in names]


def _largest(record: ControlRecord, kinds: tuple[str, ...]) -> float:
    """Largest rounding of columns whose names begin so; 0 without one."""
    return max((float(item.max()) for name, item in record.rounding.items() if name.startswith(kinds)), default=0.0)
