"""Equations of route 2 for bodies that touch: one linear system for accelerations and forces of joints and contacts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.core.last_results import LastResults
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.free_slides import FreeSlides, free_slides
from proofroll.elements.mechanism.contact.joint_laws import JointContact, joint_contacts, line_response, mode_of_joints
from proofroll.elements.mechanism.contact.modes import (
    EXACT,
    ContactMode,
    Features,
    features_of,
    forbidding_rows,
    heading_of,
    held_directions,
    turned,
)
from proofroll.elements.mechanism.contact.rolling_and_spin import (
    TurningFriction,
    moments_by_pressing,
    opposed_rates,
    standing,
    turning_frictions,
    with_moments,
)
from proofroll.elements.mechanism.contact.touching import Moving, Touching, touch
from proofroll.elements.mechanism.dynamics.switches import HOLDING, STOPPED, switched_joints
from proofroll.elements.mechanism.scene.kinks import Sides, held_sides
from proofroll.elements.mechanism.scene.rotations import Array, cross, frame_of_axis
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.signal import value_at
from proofroll.truth.bodies.maximal_coordinates import RANK, NumericEquations
from proofroll.truth.bodies.maximal_equations import FUNCTIONS, Switched

_AXES = np.eye(3)
_NULL = 1e-13  # singular value, relative to the largest, that is round-off
_ROUNDS = 2  # of a solution: one, and one for its residual
_KEPT = 4  # states whose rows and loads are kept


@dataclass(frozen=True)
class BodiesState:
    """Bodies at one state: rows of joints and contacts, and loads.

    Attributes:
        touching: geometry and sliding velocity of each contact.
        J: derivative of each sliding velocity with respect to u, (contacts, 3, nu).
        bias: rate of each sliding velocity at u̇ = 0, (contacts, 3).
        C, of_joints: independent rows of joints and loops, (rows, nu), and their biases.
        mass, force: mass matrix and loads: M u̇ = force + forces of joints and contacts.
        residual: violations of all rows of joints and loops.
        u: velocities, (nu).
        centres: centres of mass of the bodies, and the world's origin, (bodies + 1, 3).
        angle_rate: rates of the angles that are integrated.
    """

    touching: tuple[Touching, ...]
    J: Array
    bias: Array
    C: Array
    of_joints: Array
    mass: Array
    force: Array
    residual: Array
    u: Array
    centres: Array
    angle_rate: Array


@dataclass(frozen=True)
class BodiesSolution:
    """Accelerations and contact forces in a mode.

    Attributes:
        mode: the mode, with lines of contacts as they lie now.
        moved: u̇.
        force: on body a of each contact, (contacts, 3).
        slide: rate of each sliding velocity, (contacts, 3).
        parting: second rate of each gap, (contacts).
        response: Painlevé's measure, 1 without friction.
        loose: True if the forces are not unique.
        splits: ways to split a load that contacts share: changes of the normal forces, (contacts, ways).
        spread: change of ``moved`` with these, the whole of unit length.
        shifts: changes of all forces with these, (contacts, 3, ways).
    """

    mode: ContactMode
    moved: Array
    force: Array
    slide: Array
    parting: Array
    response: float
    loose: bool
    splits: Array
    spread: float
    shifts: Array


class ContactEquations:
    """Equations of a mechanism's separate bodies with its contacts."""

    def __init__(self, mechanism: Mechanism, equations: NumericEquations) -> None:
        self.mechanism, self.equations, self._switched = mechanism, equations, switched_joints(mechanism)
        self._of_joints = joint_contacts(self._switched)
        self._turning = turning_frictions(mechanism.contacts)
        self.contacts: tuple[BodyContact | JointContact | TurningFriction, ...] = (
            *mechanism.contacts,
            *self._of_joints,
            *self._turning,
        )
        self.friction = np.array([contact.friction for contact in self.contacts])
        self.static = np.array([contact.static for contact in self.contacts])
        self.bounds = np.array([contact.bound for contact in self.contacts])
        # contact whose normal force bounds the friction of each
        self.pressing = [k if (by := c.pressed_by) is None else by for k, c in enumerate(self.contacts)]
        index = mechanism.body_index
        self.pairs = [(index[contact.body_a], index[contact.body_b]) for contact in mechanism.contacts]
        self._com = [np.array(body.com) for body in mechanism.bodies] + [np.zeros(3)]
        self.limited = {k: actuator for k, actuator in enumerate(mechanism.actuators) if actuator.limit is not None}
        self._sides: tuple[int, ...] = ()
        self._last = LastResults[tuple[bytes, tuple[float, ...], Features | None], BodiesState](_KEPT)
        self._driven = [mechanism.joint_index[actuator.joint] for actuator in self.limited.values()]

    def at(self, state: Array, features: Features | None = None) -> BodiesState:
        """Rows and loads of the bodies at a state: coordinates, velocities, angles, and last the time [s].

        ``features``: of solids that touch; None: the nearest.
        """
        key = state.tobytes(), (*self.mechanism.held, *self._sides), features
        return self._last.of(key, lambda: self._at(state.copy(), features))

    def _at(self, state: Array, features: Features | None) -> BodiesState:
        e = self.equations.equations
        constrained, C, bias, half, force = self.equations.loaded(state[:-1], float(state[-1]), self.clamped(state))
        bodies = []
        for view, com in zip(constrained.views, self._com, strict=True):
            R, v, w = (np.array(part, dtype=float) for part in (view.R, view.v, view.w))
            arm = R @ com
            bodies.append(Moving(np.array(view.r) - arm, R, v - cross(w, arm), w))
        feature_numbers = [None] * len(self.pairs) if features is None else features[: len(self.pairs)]
        pairs = zip(self.mechanism.contacts, self.pairs, feature_numbers, strict=True)
        touching = tuple(touch(c, bodies[a], bodies[b], feature) for c, (a, b), feature in pairs)
        J, rates = np.zeros((len(self.contacts), 3, e.nu)), np.zeros((len(self.contacts), 3))
        for k, (pair, point) in enumerate(zip(self.pairs, touching, strict=True)):
            for body, sign in zip(pair, (1.0, -1.0), strict=True):
                if body < 0 or point.absent:
                    continue
                view = constrained.views[body]
                arm = point.place - np.array(view.r)
                for row, axis in zip(J[k], _AXES, strict=True):
                    entries = e.bodies[body].projected(view, axis.tolist(), cross(arm, axis).tolist())
                    row[e.u_slices[body]] += sign * np.array(entries, dtype=float)
                # ω × (ω × arm) of the material point, and ω × the velocity of the contact point relative to it
                rates[k] += sign * cross(view.w, point.place_rate - np.array(view.v))
        numbers = [contact.joint.number for contact in self._of_joints]
        coordinates = zip(*self.equations.along(state[:-1], numbers), strict=True) if numbers else ()
        moves = e.rate_rows(state[:-1].tolist(), numbers)
        for contact, (q, v), row in zip(self._of_joints, coordinates, moves, strict=True):
            k = len(touching)
            touching += (contact.touching(float(q), float(v)),)
            J[k][:, list(row.coefficients)] = np.outer(contact.direction, list(row.coefficients.values()))
            rates[k] = contact.direction * float(row.bias)
        speeds = (float(np.linalg.norm(np.array(view.w, dtype=float))) for view in constrained.views)
        fastest = max(speeds) if self._turning else 0.0
        for friction in self._turning:
            k, pressing_touch = len(touching), touching[friction.pressed_by]
            rows, relative = np.zeros((3, e.nu)), np.zeros(3)
            for body, sign in zip(self.pairs[friction.pressed_by], (1.0, -1.0), strict=True):
                if body < 0:
                    continue
                view = constrained.views[body]
                relative += sign * np.array(view.w, dtype=float)
                for row, axis in zip(rows, _AXES, strict=True):
                    entries = e.bodies[body].projected(view, [0.0, 0.0, 0.0], axis.tolist())
                    row[e.u_slices[body]] += sign * np.array(entries, dtype=float)
            touching += (friction.touching(pressing_touch, relative),)
            J[k] = friction.resisted(pressing_touch.normal, rows)
            rates[k] = friction.resisted_rate(pressing_touch, relative, np.zeros(3), fastest)
        mass = np.asarray(np.linalg.inv(half @ half.T), dtype=np.float64)
        C, bias = independent(C, bias, self.equations.rank)
        centres = np.array([view.r for view in constrained.views], dtype=float)
        residual = np.array([row.residual for row in constrained.rows], dtype=float)
        return BodiesState(
            touching=touching,
            J=J,
            bias=rates,
            C=C,
            of_joints=bias,
            mass=mass,
            force=force,
            residual=residual,
            u=state[e.nx : e.nx + e.nu],
            centres=centres,
            angle_rate=np.array(constrained.angle_rate, dtype=float),
        )

    def accelerated(self, state: BodiesState, mode: ContactMode) -> BodiesSolution:
        """Accelerations and forces while each contact keeps its mode."""
        if any(acting.along for acting in mode):
            pairs = zip(self.contacts, self.responses(state), strict=True)
            lines = [line_response(contact, G, state.touching) for contact, G in pairs]
            mode = tuple(map(turned, mode, state.touching, lines))
        aims = [
            -directions @ bias - (point.normal_rate @ point.slide if acting.kind == "slip" else 0.0)
            for directions, acting, point, bias in zip(
                self._held(state, mode), mode, state.touching, state.bias, strict=True
            )
        ]
        rubs = self.friction + self.bounds > 0
        headings = [heading_of(acting, point) if acting.kind == "slip" and rub else None
                    for acting, point, rub in zip(mode, state.touching, rubs, strict=True)]  # fmt: skip
        turning = np.array([point.normal_rate @ point.slide for point in state.touching])
        return self._solved(state, mode, headings, aims, state.force, -state.of_joints, state.bias, turning)

    def responses(self, state: BodiesState) -> Array:
        """Rates of each contact's slide by unit forces on it, other contacts open, (contacts, 3, 3)."""
        root = np.linalg.cholesky(state.mass)
        ways = np.linalg.solve(root, state.J.reshape(-1, len(state.u)).T)
        if len(state.C):
            joints = np.linalg.solve(root, state.C.T)
            ways = ways - joints @ np.linalg.lstsq(joints, ways, rcond=RANK)[0]
        scaled_rows = ways.T.reshape(*state.J.shape)
        return np.asarray(scaled_rows @ scaled_rows.swapaxes(1, 2))

    def coupled_responses(self, state: BodiesState, which: Sequence[int]) -> tuple[Array, Array]:
        """Changes of the velocities (nu, 3 contacts) and slides (3 contacts, 3 contacts) by unit impulses on contacts.

        Components of an impulse or a slide are along the normal and two directions of the surface.
        """
        frames = [frame_of_axis(state.touching[k].normal)[:, [2, 0, 1]] for k in which]
        J = np.concatenate([frame.T @ state.J[k] for frame, k in zip(frames, which, strict=True)])
        root = np.linalg.cholesky(state.mass)
        ways = np.linalg.solve(root, J.T)
        if len(state.C):
            joints = np.linalg.solve(root, state.C.T)
            ways = ways - joints @ np.linalg.lstsq(joints, ways, rcond=RANK)[0]
        return np.asarray(np.linalg.solve(root.T, ways)), np.asarray(ways.T @ ways)

    def _held(self, state: BodiesState, mode: ContactMode) -> list[Array]:
        """Directions in which each contact constrains the sliding velocity."""
        return [
            held_directions(acting, point, contact.presses)
            for acting, point, contact in zip(mode, state.touching, self.contacts, strict=True)
        ]

    def _solved(
        self,
        state: BodiesState,
        mode: ContactMode,
        headings: Sequence[Array | None],
        targets: Sequence[Array],
        right: Array,
        of_joints: Array,
        bias: Array,
        beyond: Array,
    ) -> BodiesSolution:
        """Solution x of M x − Cᵀλ − Dᵀz = right, C x = of_joints, K x = targets."""
        rows, pushes, aims, owner = [state.C], [state.C], [of_joints], list[tuple[int, Array]]()
        force, turning = np.zeros((len(mode), 3)), list[tuple[int, int, Array]]()
        for k, constrained in enumerate(self._held(state, mode)):
            rows.append(constrained @ state.J[k])
            aims.append(targets[k])
            heading = headings[k] if mode[k].kind == "slip" else None
            directions = constrained
            by = self.contacts[k].pressed_by
            if heading is not None and by is not None:
                turning.append((k, by, -self.friction[k] * heading))
            elif heading is not None:
                force[k] = -self.bounds[k] * heading
                directions = constrained - self.friction[k] * heading
            pushes.append(directions @ state.J[k])
            owner += [(k, direction) for direction in directions]
        right = right + np.einsum("kin,ki->n", state.J, force)
        if not owner:  # no contact holds anything: the rows of joints alone, which are independent
            x, none = accelerated_by(state.mass, right, state.C, of_joints), np.zeros((len(mode), 3, 0))
            slide = opposed_rates(self.contacts, state.touching, state.J @ x + bias)
            parting = (
                np.array([point.normal @ rate for point, rate in zip(state.touching, slide, strict=True)]) + beyond
            )
            return BodiesSolution(
                mode=mode,
                moved=x,
                force=force,
                slide=slide,
                parting=parting,
                response=1.0,
                loose=False,
                splits=none[:, 0],
                spread=0.0,
                shifts=none,
            )
        K, D = np.concatenate(rows), np.concatenate(pushes)
        moments = moments_by_pressing(turning, owner, [point.normal for point in state.touching])
        for k, place, moment in moments:
            D[len(state.C) + place] += moment @ state.J[k]
        nu, count = len(state.u), len(K)
        none = np.zeros((count, count))
        # Scaled by the inertia of each velocity and by the norm of each row, so a small body's moment does not count as
        # zero.
        by_velocity = 1 / np.sqrt(np.diag(state.mass))
        units = np.concatenate([by_velocity, 1 / np.linalg.norm(K * by_velocity, axis=1)])
        matrix, target = np.block([[state.mass, -D.T], [K, none]]), np.concatenate([right, *aims])
        system = matrix * units * units[:, None]
        answer, V = _answer(matrix, target, units)
        x, z = answer[:nu], answer[nu + len(state.C) :]
        plain = np.block([[state.mass, -K.T], [K, none]]) * units * units[:, None]
        sides, sizes, _ = np.linalg.svd(plain[nu:, :nu])
        rank = int((sizes > RANK).sum())
        # without what the split of a shared load changes
        whole = np.block([[np.eye(nu), np.zeros((nu, rank))], [np.zeros((count, nu)), sides[:, :rank]]])
        response = float(np.linalg.det(whole.T @ system @ whole) / np.linalg.det(whole.T @ plain @ whole))
        ways = np.zeros((len(system), 0))
        if rank < count:
            ways = units[:, None] * V[nu + rank :].T
            ways /= np.linalg.norm(ways[nu:], axis=0)
        splits, shifts = np.zeros((len(mode), ways.shape[1])), np.zeros((len(mode), 3, ways.shape[1]))
        for (k, direction), size, way in zip(owner, z, ways[nu + len(state.C) :], strict=True):
            force[k] += size * direction
            shifts[k] += np.outer(direction, way)
            splits[k] += float(direction @ state.touching[k].normal) * way
        for k, place, moment in moments:
            force[k] += z[place] * moment
            shifts[k] += np.outer(moment, ways[nu + len(state.C) + place])
        slide = opposed_rates(self.contacts, state.touching, state.J @ x + bias)
        parting = np.array([point.normal @ rate for point, rate in zip(state.touching, slide, strict=True)]) + beyond
        spread = float(np.linalg.norm(ways[:nu]))
        return BodiesSolution(
            mode=mode,
            moved=x,
            force=force,
            slide=slide,
            parting=parting,
            response=response,
            loose=rank < count,
            splits=splits,
            spread=spread,
            shifts=shifts,
        )

    def applied(self, state: BodiesState, force: Array) -> tuple[Array, Array]:
        """Forces, moments and N of contacts, (contacts, 7), and wrenches on bodies about their centres, (bodies, 6)."""
        moments = force[len(force) - len(self._turning) :]
        wrenches, force = np.zeros((len(self.mechanism.bodies) + 1, 6)), force[: len(self.pairs)]
        for pair, point, push in zip(self.pairs, state.touching, force, strict=False):
            for body, sign in zip(pair, (1.0, -1.0), strict=True):
                wrenches[body] += sign * np.concatenate([push, cross(point.place - state.centres[body], push)])
        for friction, moment in zip(self._turning, moments, strict=True):
            for body, sign in zip(self.pairs[friction.pressed_by], (1.0, -1.0), strict=True):
                wrenches[body, 3:] += sign * moment
        normals = np.array([touch.normal for touch in state.touching[: len(force)]]).reshape(-1, 3)
        return with_moments(force, self._turning, moments, np.einsum("ki,ki->k", normals, force)), wrenches[:-1]

    def rate(self, state: Array, mode: ContactMode) -> Array:
        """Time derivative of a state in a mode."""
        e, unit = self.equations.equations, self.equations.normalised(state)
        solution = self.accelerated(bodies := self.at(unit, features_of(mode)), mode)
        x, u = state[: e.nx], unit[e.nx : e.nx + e.nu]
        return np.array([*self.equations.moving(x, u), *solution.moved, *bodies.angle_rate, 1.0], dtype=float)

    def drawn(self, state: Array) -> Array:
        """Efforts with a limit before they are clamped, in parts of their limits."""
        if not self.limited:
            return np.zeros(0)
        drive_states = self.equations.along(self.equations.normalised(state[:-1]), self._driven)
        motors = zip(self.limited.values(), *drive_states, strict=True)
        return np.array([motor.wanted(state[-1], q, v) / motor.bound for motor, q, v in motors])

    def kinks(self, state: Array) -> Array:
        """See :meth:`ContactDynamics.kinks`."""
        sides = Sides(self.mechanism.kinks)
        functions = sides.functions(FUNCTIONS)
        self.equations.equations.at(self.equations.normalised(state[:-1]).tolist(), functions, time=float(state[-1]))
        for signal in self.mechanism.signals:
            value_at(signal, float(state[-1]), functions)
        return np.array(sides.arguments, dtype=float)

    def hold(self, signs: Sequence[int]) -> None:
        """See :meth:`ContactDynamics.hold`."""
        self._sides = tuple(signs)
        self.equations.functions = held_sides(self.mechanism.kinks, signs[len(self.limited) :], FUNCTIONS)

    def clamped(self, state: Array) -> Switched:
        """Switched state with the efforts that are clamped at their limits."""
        sides: Sequence[float] = self._sides[: len(self.limited)]
        sides = sides or [np.clip(part, -1, 1) if abs(part) > 1 else 0 for part in self.drawn(state)]
        pairs = zip(self.limited.items(), sides, strict=True)
        return Switched(clamped={k: float(side * m.bound) for (k, m), side in pairs if side})

    def switched(self, state: Array, mode: ContactMode) -> Switched:
        """Joints that are held or slide with friction in a mode, and clamped efforts."""
        joint_modes = mode_of_joints(self._switched, self.contacts, mode)
        pairs = list(zip(self._switched, joint_modes, strict=True))
        return self.clamped(state)._replace(
            held=tuple(joint.number for joint, joint_mode in pairs if joint_mode in HOLDING),
            stopped=tuple(joint.number for joint, joint_mode in pairs if joint_mode in STOPPED),
            push={joint.number: joint.push(joint_mode) for joint, joint_mode in pairs if joint.push(joint_mode)},
        )

    def eliminated(self, state: Array, mode: ContactMode) -> Array:
        """State without violations of joint rows, closed contacts and unit quaternions."""
        mode = standing(self.contacts, mode)
        e = self.equations.equations
        unit = np.append(self.equations.normalised(state[:-1]), state[-1])
        state = unit if np.abs(unit - state).max() > EXACT else state
        features = features_of(mode)
        presses, bodies = [contact.presses for contact in self.contacts], self.at(state, features)
        closed_contacts = [k for k, acting in enumerate(mode) if acting.kind != "open" and presses[k]]
        gaps = np.array([bodies.touching[k].gap for k in closed_contacts])
        slides = forbidding_rows(mode, bodies.touching, bodies.J, presses) @ bodies.u
        left = np.abs(np.concatenate([bodies.residual, bodies.C @ bodies.u, gaps, slides])).max(initial=0.0)
        if left <= EXACT:
            return state
        state = np.append(self.equations.eliminated(state[:-1]), state[-1])
        if not len(slides):
            return state
        bodies = self.at(state, features)
        if closed_contacts:
            normals = np.array([bodies.touching[k].normal @ bodies.J[k] for k in closed_contacts])
            gaps = np.array([bodies.touching[k].gap for k in closed_contacts])
            back = least_motion(bodies.mass, bodies.C, normals, gaps)
            state[: e.nx] -= self.equations.moving(state[: e.nx], back)
            state = self.equations.normalised(state)
            bodies = self.at(state, features)
        K = forbidding_rows(mode, bodies.touching, bodies.J, presses)
        state[e.nx : e.nx + e.nu] -= least_motion(bodies.mass, bodies.C, K, K @ bodies.u)
        return state


def _answer(matrix: Array, target: Array, units: Array) -> tuple[Array, Array]:
    """Smallest solution of a square system scaled by units, and its right singular vectors, (vectors, unknowns).

    Its residual is solved for once more: forces of heavy bodies that cancel on a light one leave few digits to it.
    """
    U, sizes, V = np.linalg.svd(matrix * units * units[:, None])
    kept, answer = sizes > _NULL * sizes[0], np.zeros(len(matrix))
    for _ in range(_ROUNDS):
        left = units * (target - matrix @ answer)
        answer = answer + units * (V[kept].T @ (U[:, kept].T @ left / sizes[kept]))
    return answer, np.asarray(V)


def slides_of(bodies: BodiesState) -> FreeSlides:
    """Slides of the contacts of bodies without forces of contacts."""
    free = accelerated_by(bodies.mass, bodies.force, bodies.C, -bodies.of_joints)
    loose: Array = np.asarray(np.linalg.inv(bodies.mass), dtype=np.float64)
    root = np.linalg.cholesky(bodies.mass)
    locked = np.linalg.qr(np.linalg.solve(root, bodies.C.T))[0]
    ways = np.linalg.solve(root.T, np.eye(len(root)) - locked @ locked.T)
    joint_force = bodies.mass @ free - bodies.force
    return free_slides(bodies.touching, bodies.J, bodies.bias, free, ways @ ways.T, loose, joint_force)


def independent(C: Array, bias: Array, most: int) -> tuple[Array, Array]:
    """Independent rows equivalent to all, at ``most`` so many; those of a planar body in its plane are round-off."""
    if not C.size:
        return C, bias
    U, values, Vt = np.linalg.svd(C, full_matrices=False)
    rank = min(most, int((values > RANK * values[0]).sum()))
    return Vt[:rank], (U[:, :rank].T @ bias) / values[:rank]


def least_motion(mass: Array, C: Array, K: Array, violation: Array) -> Array:
    """Motion of least kinetic energy that produces these violations of rows K, and none of rows C."""
    root = np.linalg.cholesky(mass)
    into = np.linalg.solve(root, np.concatenate([K, C]).T)
    aims = np.concatenate([violation, np.zeros(len(C))])
    return np.asarray(np.linalg.solve(root.T, np.linalg.lstsq(into.T, aims, rcond=RANK)[0]))


def accelerated_by(mass: Array, load: Array, C: Array, aims: Array) -> Array:
    """Solution x of M x − Cᵀλ = load, C x = aims, for independent rows C."""
    root = np.linalg.cholesky(mass)
    free = np.linalg.solve(root, load)
    if len(C):
        basis, R = np.linalg.qr(np.linalg.solve(root, C.T))
        free = free + basis @ (np.linalg.solve(R.T, aims) - basis.T @ free)
    return np.asarray(np.linalg.solve(root.T, free))
