"""Equations of route 2 of bodies that touch: each body alone, one linear system of motion, joints and contacts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.elements.mechanism.contacts.acting import ContactMode, heading_of, held_directions
from proofroll.elements.mechanism.contacts.geometry import BodyContact
from proofroll.elements.mechanism.contacts.joint_laws import JointContact, joint_contacts, mode_of_joints
from proofroll.elements.mechanism.contacts.touching import Moving, Touching, touch
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.rotations import Array, cross
from proofroll.elements.mechanism.switches import HOLDING, STOPPED, switched_joints
from proofroll.truth.mechanism.maximal_coordinates import RANK, NumericEquations
from proofroll.truth.mechanism.maximal_equations import Switched

_AXES = np.eye(3)


@dataclass(frozen=True)
class BodiesState:
    """Bodies at one state: rows of joints and contacts, and what drives them.

    Attributes:
        touching: of each contact.
        J: derivative of each slide by the velocities, (contacts, 3, nu).
        bias: rate of each slide where u̇ = 0, (contacts, 3).
        C, of_joints: independent rows of joints and loops, (rows, nu), and their biases.
        mass, force: M u̇ = force + what holds.
        u: velocities, (nu).
        centres: of mass of the bodies, and the world's origin, (bodies + 1, 3).
    """

    touching: tuple[Touching, ...]
    J: Array
    bias: Array
    C: Array
    of_joints: Array
    mass: Array
    force: Array
    u: Array
    centres: Array


@dataclass(frozen=True)
class BodiesSolution:
    """Accelerations u̇ and forces of contact in a mode; or velocities and impulses after an impact.

    Attributes:
        moved: u̇, or u after an impact.
        force: on body a of each contact, (contacts, 3).
        slide: rate of each slide, or each slide after an impact, (contacts, 3).
        parting: second rate of each gap, or its rate beyond what the law of impact returns, (contacts).
        response: Painlevé's measure, 1 without friction.
        loose: whether the forces are not determinate.
    """

    moved: Array
    force: Array
    slide: Array
    parting: Array
    response: float
    loose: bool


class ContactEquations:
    """The equations of a mechanism's bodies with its contacts."""

    def __init__(self, mechanism: Mechanism, equations: NumericEquations) -> None:
        self.mechanism, self.equations, self._switched = mechanism, equations, switched_joints(mechanism)
        self._of_joints = joint_contacts(self._switched)
        self.contacts: tuple[BodyContact | JointContact, ...] = (*mechanism.contacts, *self._of_joints)
        self.friction = np.array([contact.friction for contact in self.contacts])
        self.bounds = np.array([contact.bound for contact in self.contacts])
        index = mechanism.body_index
        self._pairs = [(index[contact.body_a], index[contact.body_b]) for contact in mechanism.contacts]
        self._com = [np.array(body.com) for body in mechanism.bodies] + [np.zeros(3)]
        self._limited = {k: motor for k, motor in enumerate(mechanism.actuators) if motor.limit is not None}
        self._driven = [mechanism.joint_index[motor.joint] for motor in self._limited.values()]

    def at(self, state: Array) -> BodiesState:
        """Bodies at a state, as :meth:`NumericEquations.rate` has them; its last component is the time [s]."""
        e = self.equations.equations
        found, C, bias, half, force = self.equations.loaded(state[:-1], float(state[-1]), self.clamped(state))
        bodies = []
        for view, com in zip(found.views, self._com, strict=True):
            R, v, w = (np.array(part, dtype=float) for part in (view.R, view.v, view.w))
            arm = R @ com
            bodies.append(Moving(np.array(view.r) - arm, R, v - cross(w, arm), w))
        pairs = zip(self.mechanism.contacts, self._pairs, strict=True)
        touching = tuple(touch(c, bodies[a], bodies[b]) for c, (a, b) in pairs)
        J, rates = np.zeros((len(self.contacts), 3, e.nu)), np.zeros((len(self.contacts), 3))
        for k, (pair, each) in enumerate(zip(self._pairs, touching, strict=True)):
            for body, sign in zip(pair, (1.0, -1.0), strict=True):
                if body < 0:
                    continue
                view = found.views[body]
                arm = each.place - np.array(view.r)
                for row, axis in zip(J[k], _AXES, strict=True):
                    entries = e.bodies[body].projected(view, axis.tolist(), cross(arm, axis).tolist())
                    row[e.u_slices[body]] += sign * np.array(entries, dtype=float)
                # ω × (ω × arm) of the material, and ω × its way under the place of contact
                rates[k] += sign * cross(view.w, each.place_rate - np.array(view.v))
        numbers = [contact.joint.number for contact in self._of_joints]
        coordinates = zip(*self.equations.along(state[:-1], numbers), strict=True) if numbers else ()
        moves = e.rate_rows(state[:-1].tolist(), numbers)
        for contact, (q, v), row in zip(self._of_joints, coordinates, moves, strict=True):
            k = len(touching)
            touching += (contact.touching(float(q), float(v)),)
            J[k][:, list(row.coefficients)] = np.outer(contact.direction, list(row.coefficients.values()))
            rates[k] = contact.direction * float(row.bias)
        mass = np.asarray(np.linalg.inv(half @ half.T), dtype=np.float64)
        C, bias = _independent(C, bias)
        centres = np.array([view.r for view in found.views], dtype=float)
        return BodiesState(touching, J, rates, C, bias, mass, force, state[e.nx : e.nx + e.nu], centres)

    def accelerated(self, state: BodiesState, mode: ContactMode) -> BodiesSolution:
        """Accelerations and forces while each contact does what the mode says."""
        wanted = [
            -held @ bias - (found.normal_rate @ found.slide if own.kind == "slip" else 0.0)
            for held, own, found, bias in zip(self._held(state, mode), mode, state.touching, state.bias, strict=True)
        ]
        rubs = self.friction + self.bounds > 0
        headings = [heading_of(own, found) if own.kind == "slip" and rub else None
                    for own, found, rub in zip(mode, state.touching, rubs, strict=True)]  # fmt: skip
        turning = np.array([found.normal_rate @ found.slide for found in state.touching])
        return self._solved(state, mode, headings, wanted, state.force, -state.of_joints, state.bias, turning)

    def _held(self, state: BodiesState, mode: ContactMode) -> list[Array]:
        """Directions that each contact holds."""
        return [
            held_directions(own, found, presses=not bound)
            for own, found, bound in zip(mode, state.touching, self.bounds, strict=True)
        ]

    def struck(
        self, state: BodiesState, mode: ContactMode, headings: Sequence[Array | None], after: Sequence[float]
    ) -> BodiesSolution:
        """Velocities after an impact in which contacts do so; ``after``: normal speeds of those that do not open."""
        wanted = [
            held @ found.normal * speed
            for held, found, speed in zip(self._held(state, mode), state.touching, after, strict=True)
        ]
        still = np.zeros(len(state.of_joints))
        bias = np.zeros((len(mode), 3))
        return self._solved(state, mode, headings, wanted, state.mass @ state.u, still, bias, -np.array(after))

    def _solved(
        self,
        state: BodiesState,
        mode: ContactMode,
        headings: Sequence[Array | None],
        wanted: Sequence[Array],
        right: Array,
        of_joints: Array,
        bias: Array,
        beyond: Array,
    ) -> BodiesSolution:
        """The linear system M x − Cᵀλ − Dᵀz = right, C x = of_joints, K x = wanted."""
        rows, along, aims, owner = [state.C], [state.C], [of_joints], list[tuple[int, Array]]()
        force = np.zeros((len(mode), 3))
        for k, held in enumerate(self._held(state, mode)):
            rows.append(held @ state.J[k])
            aims.append(wanted[k])
            heading = headings[k] if mode[k].kind == "slip" else None
            rubs = np.zeros(3) if heading is None else heading
            force[k] = -self.bounds[k] * rubs
            directions = held - self.friction[k] * rubs
            along.append(directions @ state.J[k])
            owner += [(k, direction) for direction in directions]
        right = right + np.einsum("kin,ki->n", state.J, force)
        K, D = np.concatenate(rows), np.concatenate(along)
        nu, count = len(state.u), len(K)
        none = np.zeros((count, count))
        # In units of the inertia of each velocity and of what each row moves: a small body's moment is no zero.
        by_velocity = 1 / np.sqrt(np.diag(state.mass))
        units = np.concatenate([by_velocity, 1 / np.linalg.norm(K * by_velocity, axis=1)])
        system = np.block([[state.mass, -D.T], [K, none]]) * units * units[:, None]
        answer = units * np.linalg.lstsq(system, units * np.concatenate([right, *aims]), rcond=1e-13)[0]
        x, z = answer[:nu], answer[nu + len(state.C) :]
        plain = np.block([[state.mass, -K.T], [K, none]]) * units * units[:, None]
        loose = bool(np.linalg.matrix_rank(plain[nu:, :nu], RANK) < count)
        response = 1.0 if loose else float(np.linalg.det(system) / np.linalg.det(plain))
        for (k, direction), size in zip(owner, z, strict=True):
            force[k] += size * direction
        slide = state.J @ x + bias
        parting = np.array([found.normal @ one for found, one in zip(state.touching, slide, strict=True)]) + beyond
        return BodiesSolution(x, force, slide, parting, response, loose)

    def applied(self, state: BodiesState, force: Array) -> tuple[Array, Array]:
        """Forces of bodies' contacts, and what they do to the bodies about their centres of mass, (bodies, 6)."""
        wrenches, force = np.zeros((len(self.mechanism.bodies) + 1, 6)), force[: len(self._pairs)]
        for pair, each, push in zip(self._pairs, state.touching, force, strict=False):
            for body, sign in zip(pair, (1.0, -1.0), strict=True):
                wrenches[body] += sign * np.concatenate([push, cross(each.place - state.centres[body], push)])
        return force, wrenches[:-1]

    def rate(self, state: Array, mode: ContactMode) -> Array:
        """Right-hand side."""
        e, unit = self.equations.equations, self.equations.normalised(state)
        found = self.accelerated(self.at(unit), mode)
        x, u = state[: e.nx], unit[e.nx : e.nx + e.nu]
        angles = self.equations.loaded(unit[:-1])[0].angle_rate if e.angles else []
        return np.array([*self._moving(x, u), *found.moved, *angles, 1.0], dtype=float)

    def _wanted(self, state: Array) -> Array:
        """Efforts of the actuators with a limit before it clamps them [N m, N]."""
        if not self._limited:
            return np.zeros(0)
        q, v = self.equations.along(self.equations.normalised(state[:-1]), self._driven)
        return np.array([m.wanted(state[-1], *at) for m, *at in zip(self._limited.values(), q, v, strict=True)])

    def excess(self, state: Array) -> Array:
        """Efforts that are wanted beyond their limits, as parts of these."""
        return np.abs(self._wanted(state)) / [motor.bound for motor in self._limited.values()] - 1

    def clamped(self, state: Array) -> Switched:
        """Efforts that are at their limits."""
        wanted = zip(self._limited.items(), self._wanted(state), strict=True)
        return Switched(clamped={k: float(np.clip(w, -m.bound, m.bound)) for (k, m), w in wanted if abs(w) > m.bound})

    def switched(self, state: Array, mode: ContactMode) -> Switched:
        """Joints that are held or rub in a mode, and efforts that are at their limits."""
        own = mode_of_joints(self._switched, self.contacts, mode)
        pairs = list(zip(self._switched, own, strict=True))
        return self.clamped(state)._replace(
            held=tuple(joint.number for joint, now in pairs if now in HOLDING),
            stopped=tuple(joint.number for joint, now in pairs if now in STOPPED),
            push={joint.number: joint.push(now) for joint, now in pairs if joint.push(now)},
        )

    def _moving(self, x: Array, u: Array) -> list[float]:
        """Rates of the coordinates."""
        e = self.equations.equations
        bodies = zip(e.bodies, e.x_slices, e.u_slices, strict=True)
        return [rate for body, at_x, at_u in bodies for rate in body.rate(x[at_x].tolist(), u[at_u].tolist())]

    def eliminated(self, state: Array, mode: ContactMode) -> Array:
        """The state with violations of rows, closed contacts and unit quaternions removed."""
        e = self.equations.equations
        state = np.append(self.equations.eliminated(state[:-1]), state[-1])
        closed = [k for k, own in enumerate(mode) if own.kind != "open"]
        if not closed:
            return state
        found = self.at(state)
        normals = np.array([found.touching[k].normal @ found.J[k] for k in closed])
        gaps = np.array([found.touching[k].gap for k in closed])
        back = _least_motion(found, normals, gaps)
        state[: e.nx] -= np.array(self._moving(state[: e.nx], back), dtype=float)
        state = self.equations.normalised(state)
        found = self.at(state)
        sticking = [found.J[k] for k in closed if mode[k].kind == "stick"]
        sliding = [found.touching[k].normal[None] @ found.J[k] for k in closed if mode[k].kind == "slip"]
        K = np.concatenate([*sticking, *sliding])
        state[e.nx : e.nx + e.nu] -= _least_motion(found, K, K @ found.u)
        return state


def _independent(C: Array, bias: Array) -> tuple[Array, Array]:
    """Independent rows that say what all of them do."""
    if not C.size:
        return C, bias
    U, values, Vt = np.linalg.svd(C, full_matrices=False)
    rank = int((values > RANK * values[0]).sum())
    return Vt[:rank], (U[:, :rank].T @ bias) / values[:rank]


def _least_motion(found: BodiesState, K: Array, violation: Array) -> Array:
    """Smallest motion, measured by inertia, that makes these violations of rows K, and none of joints."""
    rows = np.concatenate([K, found.C])
    root = np.linalg.cholesky(found.mass)
    into = np.linalg.solve(root, rows.T)
    aims = np.concatenate([violation, np.zeros(len(found.C))])
    return np.asarray(np.linalg.solve(root.T, np.linalg.lstsq(into.T, aims, rcond=RANK)[0]))
