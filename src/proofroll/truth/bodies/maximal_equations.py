"""Equations of route 2: loads and constraint rows of separate bodies.

They are written once in plain additions and multiplications, for numbers, long doubles and symbols.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from proofroll.core.arrays import slices
from proofroll.elements.mechanism import WORLD, Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Coupling
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.kinks import KINKED
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import SMOOTH, value_at
from proofroll.truth.bodies.constraint_rows import NONE, Connection, ConstraintRow, ConstraintRows, columns, speed_at
from proofroll.truth.bodies.maximal_bodies import GROUND, BodyInScalars, made_bodies, placed_bodies
from proofroll.truth.numerics.scalars import (
    Scalar,
    add,
    clean,
    cross,
    dot,
    is_zero,
    minus,
    mul,
    plus,
    product,
    scaled,
    sub,
    turned,
)
from proofroll.truth.switching.bushing_scalars import bushing_load

# Kinds whose coordinates are angles that may exceed a turn; the first route has a list of its own.
_COUNTED = frozenset({JointKind.REVOLUTE, JointKind.UNIVERSAL})


def _of_each(name: str) -> Callable[[Any], Any]:
    """Function of a number, or of each in an array, with the same digits."""
    function = getattr(math, name)
    return lambda x: np.array([*map(function, x.tolist())]) if isinstance(x, np.ndarray) else function(x)


FUNCTIONS: Mapping[str, Callable[..., Any]] = {**{name: _of_each(name) for name in SMOOTH}, **KINKED}


class Drive(NamedTuple):
    """Armature of a joint with the rate Σ coefficient·u of the row: λ = −inertia·(Σ coefficient·u̇ + bias)."""

    row: ConstraintRow
    inertia: float


class Switched(NamedTuple):
    """Present state of switched joints and efforts.

    Attributes:
        held: indices of the joints whose coordinates do not move.
        stopped: the joints of ``held`` that a stop holds.
        push: index of a joint -> additional force along its coordinate, N or N m.
        clamped: index of an actuator at its limit -> its effort, N or N m.
    """

    held: tuple[int, ...] = ()
    stopped: tuple[int, ...] = ()
    push: Mapping[int, Scalar] = {}
    clamped: Mapping[int, Scalar] = {}


@dataclass(frozen=True)
class ConstrainedEquations:
    """Equations M u̇ = force + Cᵀλ, C u̇ + bias = 0 at one state, with the rates of all coordinates.

    Attributes:
        rows: C, with residuals and biases.
        force: loads along u, with gyroscopic forces.
        rate: rates of the coordinates.
        angle_rate: rates of the angles that are integrated to count turns.
        views: poses and velocities of the bodies, the ground last.
        laws: force and moment of each joint's spring, damper, drive and actuators on its child, at the joint, world
            axes.
        efforts: of each actuator, N or N m.
        drives: armature of joints.
        holders: the rows of bodies without inertia, as drives: as all rows are satisfied, they change only M, and make
            it invertible.
        coupled, moved: slices of the rows of couplings, and of prescribed motions.
    """

    rows: list[ConstraintRow]
    force: list[Scalar]
    rate: list[Scalar]
    angle_rate: list[Scalar]
    views: list[BodyInScalars]
    laws: list[tuple[list[Scalar], list[Scalar]]]
    efforts: list[Scalar]
    drives: list[Drive]
    holders: list[Drive]
    coupled: slice
    moved: slice

    def opening(self, rates: Array) -> Array:
        """Rates at which the rows are violated, from those of their coordinates; motions hold the acceleration only."""
        violated = rates.copy()
        violated[self.moved] = 0.0
        return violated


class MaximalEquations:
    """Equations of a mechanism as separate bodies, connections and springs.

    Args:
        mechanism: any mechanism.
        allow_planar: give the bodies of a planar mechanism three coordinates; its rows are those within the plane.
    """

    def __init__(self, mechanism: Mechanism, allow_planar: bool) -> None:
        self.mechanism, self.bodies = mechanism, made_bodies(mechanism, allow_planar)
        self.x_slices = slices(body.nx for body in self.bodies)
        self.u_slices = slices(body.nu for body in self.bodies)
        self.nx, self.nu = self.x_slices[-1].stop, self.u_slices[-1].stop
        self.mass_matrix = block_diag(*(body.mass_matrix for body in self.bodies))
        self._light = {number for number, body in enumerate(self.bodies) if not body.heavy}
        self.light = [k for number in sorted(self._light) for k in range(self.nu)[self.u_slices[number]]]
        heavy = [body for number, body in enumerate(mechanism.bodies) if number not in self._light]
        # mass and inertia of the holders, kg and kg m²: any values will do; typical ones lose the fewest digits
        self.usual = (
            float(np.median([body.mass for body in heavy] or [1.0])),
            float(np.median([np.trace(body.inertia) / 3 for body in heavy] or [1.0])),
        )
        index = mechanism.body_index
        self._com = {WORLD: np.zeros(3)} | {body.name: np.array(body.com) for body in mechanism.bodies}
        self.connections = [
            self.connection(c.kind, c.a, c.b, c.position_a, c.position_b, c.frame_a, c.frame_b, c.length)
            for c in mechanism.connections
        ]
        ends = [
            (index[s.body_a], self._place(s.body_a, s.position_a), index[s.body_b], self._place(s.body_b, s.position_b))
            for s in mechanism.links
        ]
        self._ends, self._bushed = ends[: len(mechanism.springs)], ends[len(mechanism.springs) :]
        self._forced = [(index[f.body], self._place(f.body, f.position), index[f.reaction]) for f in mechanism.forces]
        self._driving: dict[int, list[int]] = {}
        for number, actuator in enumerate(mechanism.actuators):
            self._driving.setdefault(mechanism.joint_index[actuator.joint], []).append(number)
        driven_joints = {mechanism.joint_index[actuator.joint] for actuator in mechanism.actuators if actuator.kp}
        # a spring on an angle counts whole turns, which an attitude does not
        self.angles = [
            (k, n)
            for k, joint in enumerate(mechanism.joints)
            if (joint.stiffness or joint.limits or k in driven_joints) and joint.kind in _COUNTED
            for n in range(joint.nq)
        ]

    def start(self) -> Array:
        """Coordinates, velocities and integrated angles at the start, one after the other."""
        return self._start.copy()

    @cached_property
    def _start(self) -> Array:
        placed = placed_bodies(self.mechanism)
        starts = [
            body.start(placed[data.name], np.array(data.com))
            for body, data in zip(self.bodies, self.mechanism.bodies, strict=True)
        ]
        angles = [self.mechanism.joints[k].q0[n] for k, n in self.angles]
        return np.array([s for x, _ in starts for s in x] + [s for _, u in starts for s in u] + angles)

    def at(
        self,
        state: Sequence[Scalar],
        functions: Mapping[str, Any] = FUNCTIONS,
        switched: Switched | None = None,
        time: Scalar = 0.0,
    ) -> ConstrainedEquations:
        """Equations for a state laid out as by :meth:`start`, in any scalars; quaternions must have unit length.

        Rows of couplings come after those of connections, then those of motions; of held ``switched`` joints last.
        """
        switched = switched or Switched()
        x, u, angles = state[: self.nx], state[self.nx : self.nx + self.nu], state[self.nx + self.nu :]
        views = self.views(state, functions)
        force: list[Scalar] = []
        rate: list[Scalar] = []
        for body, at_x, at_u, view in zip(self.bodies, self.x_slices, self.u_slices, views, strict=False):
            weight = [float(body.mass * g) for g in self.mechanism.gravity]
            force += plus(body.gyroscopic(u[at_u]), body.projected(view, weight, NONE))
            rate += body.rate(x[at_x], u[at_u])
        made = self._rows(views)
        rows = self.lasting_rows(views, functions, time)
        moved_rows = slice(len(rows) - len(self.mechanism.prescribed), len(rows))
        coupled = slice(moved_rows.start - len(self.mechanism.couplings), moved_rows.start)
        laws, angle_rate = [], []
        efforts: list[Scalar] = [0.0] * len(self.mechanism.actuators)

        def effort(number: int, q: Scalar, speed: Scalar) -> Scalar:
            """Force of drive and actuators along a joint's coordinate, without its spring and damper."""
            for k in self._driving.get(number, ()):
                actuator = self.mechanism.actuators[k]
                clamped = switched.clamped.get(k)
                efforts[k] = actuator.wanted(time, q, speed, functions) if clamped is None else clamped
            drive = value_at(self.mechanism.joints[number].torque, time, functions)
            own_parts = [efforts[k] for k in self._driving.get(number, ())]
            return add(drive, switched.push.get(number, 0.0), *own_parts)

        for number, connection in enumerate(self.connections):
            if number < len(self.mechanism.joints):
                own_parts = [angle for angle, (k, _) in zip(angles, self.angles, strict=True) if k == number]
                acts = bool(number in self._driving or number in switched.push)
                law, rates = self._law(number, connection, views, own_parts, force, effort, acts)
                laws.append(law)
                angle_rate += rates
        self._add_point_loads(force, views, functions, time)
        rows += [made.of_rate(number, self.mechanism.joints[number].kind) for number in switched.held]
        drives = [
            Drive(made.of_rate(number, joint.kind), float(joint.armature))
            for number, joint in enumerate(self.mechanism.joints)
            if joint.armature
        ]
        holders = [
            Drive(row, self.usual[0 if any(not is_zero(part) for part in row.force) else 1])
            for row in rows
            if self._light & {self.connections[row.connection].a, self.connections[row.connection].b}
        ]
        return ConstrainedEquations(
            rows=rows,
            force=force,
            rate=rate,
            angle_rate=angle_rate,
            views=views,
            laws=laws,
            efforts=efforts,
            drives=drives,
            holders=holders,
            coupled=coupled,
            moved=moved_rows,
        )

    def projected(self, views: Sequence[BodyInScalars], applied: Sequence[Sequence[Scalar]]) -> list[Scalar]:
        """Generalised forces along u of forces and moments about the centres of mass, world axes, of each body."""
        bodies = zip(self.bodies, views, applied, strict=False)
        return [entry for body, view, wrench in bodies for entry in body.projected(view, wrench[:3], wrench[3:])]

    def rate_rows(
        self, state: Sequence[Scalar], joints: Sequence[int], functions: Mapping[str, Any] = FUNCTIONS
    ) -> list[ConstraintRow]:
        """Rates of revolute and prismatic joints as rows; the residual of a prismatic one is the coordinate."""
        made = self._rows(self.views(state, functions))
        return [made.of_rate(number, self.mechanism.joints[number].kind) for number in joints]

    def _rows(self, views: Sequence[BodyInScalars]) -> ConstraintRows:
        return ConstraintRows(self.bodies, self.u_slices, self.connections, views)

    def lasting_rows(
        self, views: Sequence[BodyInScalars], functions: Mapping[str, Any] = FUNCTIONS, time: Scalar = 0.0
    ) -> list[ConstraintRow]:
        """Rows of connections, then of couplings, then of motions at a time [s], without those of held joints."""
        made = self._rows(views)
        rows = [row for number in range(len(self.connections)) for row in made.of(number)]
        rows += [self._coupled(made, coupling) for coupling in self.mechanism.couplings]
        return rows + [self._prescribed(made, joint, time, functions) for joint, _, _ in self.mechanism.prescribed]

    def _coupled(self, made: ConstraintRows, coupling: Coupling) -> ConstraintRow:
        """Row of a coupling between rates; the start satisfies it between coordinates, so the motion does, too."""
        numbers = [self.mechanism.joint_index[name] for name, _ in coupling.terms]
        row, *others = (made.of_rate(number, self.mechanism.joints[number].kind) for number in numbers)
        for term, (_, factor) in zip(others, coupling.terms[1:], strict=True):
            row = row.less(-factor, term)
        return row

    def _prescribed(
        self, made: ConstraintRows, joint: Joint, time: Scalar, functions: Mapping[str, Any]
    ) -> ConstraintRow:
        """Row of a prescribed acceleration; the start satisfies it between places and rates."""
        assert joint.motion is not None  # as of all prescribed ones
        row = made.of_rate(self.mechanism.joint_index[joint.name], joint.kind)
        return replace(row, residual=0.0, bias=sub(row.bias, moved(joint.motion, time, functions).acceleration))

    def views(self, state: Sequence[Scalar], functions: Mapping[str, Any] = FUNCTIONS) -> list[BodyInScalars]:
        """Poses and velocities of all bodies at a state laid out as by :meth:`start`, the ground last."""
        x, u = state[: self.nx], state[self.nx : self.nx + self.nu]
        views = [
            body.view(x[at_x], u[at_u], functions)
            for body, at_x, at_u in zip(self.bodies, self.x_slices, self.u_slices, strict=True)
        ]
        return [*views, GROUND]

    def connection(
        self,
        kind: str,
        a: str,
        b: str,
        at_a: Sequence[float],
        at_b: Sequence[float],
        frame_a: Array,
        frame_b: Array,
        length: float = 0.0,
    ) -> Connection:
        """Connection of two named bodies, from its places and axes in their frames."""
        index = self.mechanism.body_index
        A, B = ([clean(row) for row in frame] for frame in (frame_a, frame_b))
        return Connection(
            kind=kind,
            a=index[a],
            b=index[b],
            place_a=self._place(a, at_a),
            place_b=self._place(b, at_b),
            frame_a=A,
            frame_b=B,
            length=length,
        )

    def _place(self, body: str, position: Sequence[float]) -> list[float]:
        return [float(value) for value in np.array(position) - self._com[body]]

    def _apply(
        self,
        force: list[Scalar],
        views: list[BodyInScalars],
        body: int,
        push: Sequence[Scalar],
        arm: Sequence[Scalar],
        moment: Sequence[Scalar] = NONE,
    ) -> None:
        """Adds a force at an arm from the centre of mass, and a moment, to the loads along u."""
        if body < 0:
            return
        entries = self.bodies[body].projected(views[body], push, plus(cross(arm, push), moment))
        for index, entry in enumerate(entries, self.u_slices[body].start):
            force[index] = add(force[index], entry)

    def _add_point_loads(
        self, force: list[Scalar], views: list[BodyInScalars], functions: Mapping[str, Any], time: Scalar
    ) -> None:
        """Adds springs, bushings and applied forces to the loads along u."""
        for spring, (a, place_a, b, place_b) in zip(self.mechanism.springs, self._ends, strict=True):
            arm_a, arm_b = turned(views[a].R, place_a), turned(views[b].R, place_b)
            d = minus(plus(views[b].r, arm_b), plus(views[a].r, arm_a))
            length = functions["sqrt"](dot(d, d))
            stretch: Scalar = spring.stiffness * (1.0 - spring.length / length)
            if spring.damping:
                slide = minus(speed_at(views[b], arm_b), speed_at(views[a], arm_a))
                stretch = add(stretch, mul(spring.damping, dot(slide, d) / (length * length)))
            if spring.force is not None:
                slide = minus(speed_at(views[b], arm_b), speed_at(views[a], arm_a))
                pull = spring.force.pull(length, dot(slide, d) / length, functions, spring.name)
                stretch = add(stretch, pull / length)
            self._apply(force, views, a, scaled(stretch, d), arm_a)
            self._apply(force, views, b, scaled(-1.0, scaled(stretch, d)), arm_b)
        for bushing, (a, place_a, b, place_b) in zip(self.mechanism.bushings, self._bushed, strict=True):
            arm_a, arm_b = turned(views[a].R, place_a), turned(views[b].R, place_b)
            d = minus(plus(views[b].r, arm_b), plus(views[a].r, arm_a))
            slide = minus(speed_at(views[b], arm_b), speed_at(views[a], arm_a))
            motion = (d, slide, minus(views[b].w, views[a].w), views[a].w)
            pull, turn = bushing_load(bushing, views[a].R, views[b].R, motion, functions)
            self._apply(force, views, b, pull, arm_b, turn)
            self._apply(force, views, a, scaled(-1.0, pull), plus(arm_a, d), scaled(-1.0, turn))
        for applied, (a, place, b) in zip(self.mechanism.forces, self._forced, strict=True):
            load = applied.at(time, functions)
            load = turned(views[a].R, load) if applied.frame == "body" else load
            push, moment = (load, NONE) if applied.kind == "force" else (NONE, load)
            arm = turned(views[a].R, place)
            self._apply(force, views, a, push, arm, moment)
            back = minus(plus(views[a].r, arm), views[b].r)
            self._apply(force, views, b, scaled(-1.0, push), back, scaled(-1.0, moment))

    def _law(
        self,
        number: int,
        c: Connection,
        views: list[BodyInScalars],
        angles: list[Scalar],
        force: list[Scalar],
        effort: Callable[[int, Scalar, Scalar], Scalar],
        acts: bool,
    ) -> tuple[tuple[list[Scalar], list[Scalar]], list[Scalar]]:
        """Adds the spring, damper and actuators of a joint to the loads.

        ``effort``: force along a coordinate from drive and actuators. ``acts``: True if it is not zero and not the
        drive alone.

        Returns:
            Force and moment on the child at the joint, and rates of the integrated angles.
        """
        joint, a, b = self.mechanism.joints[number], views[c.a], views[c.b]
        push: list[Scalar] = [0.0, 0.0, 0.0]
        moment: list[Scalar] = [0.0, 0.0, 0.0]
        rates: list[Scalar] = []
        if not (joint.stiffness or joint.damping or joint.torque or acts or angles):
            return (push, moment), rates
        arm_a, arm_b = turned(a.R, c.place_a), turned(b.R, c.place_b)
        A, B = columns(product(a.R, c.frame_a)), columns(product(b.R, c.frame_b))
        turning = minus(b.w, a.w)
        d = minus(plus(b.r, arm_b), plus(a.r, arm_a))
        if joint.kind == JointKind.SPHERICAL:
            moment = scaled(-joint.damping, turning)
        elif joint.kind == JointKind.PRISMATIC:
            slide = minus(minus(speed_at(b, arm_b), speed_at(a, arm_a)), cross(a.w, d))
            slid, speed = dot(A[2], d), dot(A[2], slide)
            push = scaled(add(_along(joint, slid, speed), effort(number, slid, speed)), A[2])
        else:
            axes = [A[2]] if joint.kind == JointKind.REVOLUTE else [A[2], B[0]]
            speeds = [dot(axis, turning) for axis in axes]
            if angles:
                rates = speeds
            for axis_index, (axis, speed) in enumerate(zip(axes, speeds, strict=True)):
                angle = angles[axis_index] if angles else 0.0
                moment = plus(moment, scaled(add(_along(joint, angle, speed), effort(number, angle, speed)), axis))
        self._apply(force, views, c.b, push, arm_b, moment)
        self._apply(force, views, c.a, scaled(-1.0, push), plus(arm_a, d), scaled(-1.0, moment))
        return (push, moment), rates


def _along(joint: Any, q: Scalar, speed: Scalar) -> Scalar:
    """Force of a joint's own spring and damper along its coordinate."""
    spring = mul(-joint.stiffness, sub(q, float(joint.rest))) if joint.stiffness else 0.0
    return add(spring, mul(-joint.damping, speed) if joint.damping else 0.0)
