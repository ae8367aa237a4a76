"""Contacts of bodies: open, slipping or sticking, ends of these modes, and transitions.

Contact forces act along the velocities ν of the tree, whose mass matrix the projection provides. Between two
transitions the equations are smooth; a transition is located within a step by shorter steps of the same method. The
next mode follows from Coulomb's law at all contacts at once, by the same solver as in the truth's first route: so equal
decisions confirm nothing, but equal motions between them do.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.arrays import cross
from proofroll.core.dop853 import Accept
from proofroll.core.errors import Diverged, Refused
from proofroll.core.integrators import Integrator
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contacts.acting import OPEN, Acting, ContactMode, changes, first_mode, slip_velocity
from proofroll.elements.mechanism.contacts.coulomb import PAINLEVE, contact_forces
from proofroll.elements.mechanism.contacts.start import closed_and_still, natural_scale
from proofroll.elements.mechanism.contacts.touching import Moving, Touching, touch
from proofroll.elements.mechanism.rotations import Array, frame_of_axis
from proofroll.elements.mechanism.signal import breaks, varies
from proofroll.engines.projection.alternating import AlternatingMotion, Excess, ends_of_efforts
from proofroll.engines.projection.dependent import DependentCoordinates, SolvedState
from proofroll.engines.projection.elimination import Space
from proofroll.engines.projection.elimination import solved as divided

_RANK = 1e-10  # smallest singular value of independent contact rows, relative to the largest
_STANDS = 1e-6  # acceleration, relative to the natural one, too small to start a motion
_REST = 1e-2  # slip speed, relative to gravity times a fixed step, below which slips end together with another one


class ContactsThere(NamedTuple):
    """Contacts at a state, without their forces.

    Attributes:
        touching: geometry and sliding velocity of each contact.
        J: derivative of each sliding velocity with respect to ν, (contacts, 3, nv).
        response: H⁻¹ Jᵀ with the mass matrix H, (nv, contacts, 3).
        rate: rate of each sliding velocity without contact forces, (contacts, 3).
    """

    touching: tuple[Touching, ...]
    J: Array
    response: Array
    rate: Array


class ContactMotion(AlternatingMotion[ContactMode]):
    """Motion of a tree with contacts; the last component of a state is the time."""

    alternates = "contacts"

    def __init__(
        self,
        equations: DependentCoordinates,
        mechanism: Mechanism,
        stepper: Integrator,
        accept: Accept,
        step: float,
    ) -> None:
        """Takes the size of a fixed ``step`` [s]; 0: the step adapts."""
        super().__init__(equations, stepper, accept, breaks(mechanism.signals))
        self.contacts, self._index = mechanism.contacts, mechanism.body_index
        self.friction = np.array([contact.friction for contact in self.contacts])
        scale = natural_scale(mechanism)
        self._unit = math.prod(scale)  # natural speed
        self._still, self._rate = scale.speed, scale.rate
        self._timed = any(map(varies, mechanism.signals))
        self._faint = max(self._still, _REST * step * float(np.linalg.norm(mechanism.gravity)))
        self._motors = {k: item for k, item in enumerate(mechanism.actuators) if item.limit is not None}
        start = np.append(equations.start, 0.0)
        self._limit_efforts(start)
        now = self.at(start)
        closed, still = closed_and_still(now.touching, np.full(len(self.contacts), scale.length), scale.rate)
        self._enter(0.0, start, self._decided(now, closed, still))

    def _limit_efforts(self, y: Array) -> None:
        """Sets the mode of each effort with a limit: linear, or clamped if the state requires more."""
        wanted = zip(self._motors.items(), self._equations.wanted(self._at(y)), strict=True)
        self._equations.applied.modes = {k: motor.mode_of(effort) for (k, motor), effort in wanted}

    def at(self, y: Array) -> ContactsThere:
        """Contacts at a state, with their response to forces."""
        equations, spaces, x = self._equations, list[Space](), self._at(y)

        def closing(space: Space, _: Array, push: Array) -> tuple[Array, Array]:
            spaces.append(space)
            return divided(space.H, push[:, None])[:, 0], np.zeros(0)

        free = equations.solve(x, 0.0, closing)
        moving = self._moving(x)
        touching = tuple(touch(each, moving[each.body_a], moving[each.body_b]) for each in self.contacts)
        S, origin = spaces[0].S.reshape(-1, 4, 4), free.bodies.origin
        J, rate = np.zeros((len(touching), 3, len(S))), np.zeros((len(touching), 3))
        for k, (contact, there) in enumerate(zip(self.contacts, touching, strict=True)):
            along = S[:, :3, :3] @ (there.place - origin) + S[:, :3, 3]
            for body, sign in ((contact.body_a, 1.0), (contact.body_b, -1.0)):
                i = self._index[body]
                if i >= 0:
                    J[k] += sign * (equations.tree.moves[i][:, None] * along).T
                    rate[k] += sign * self._material(x, free, i, moving[body], there)
        flat = J.reshape(-1, J.shape[2]).T
        return ContactsThere(touching, J, divided(spaces[0].H, flat).reshape(-1, *J.shape[:2]), rate)

    def _moving(self, x: Array) -> dict[str, Moving]:
        """Motion of the frames of all bodies, and of the world."""
        equations = self._equations
        r, _, v, _ = equations.parts(x)
        bodies = equations.bodies(x)
        moving = {"world": Moving(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))}
        for name, i in self._index.items():
            if i >= 0:
                R, w = bodies.rotation[i], bodies.spin[i]
                arm = R @ equations.com[i]
                moving[name] = Moving(r[i] - arm, R, v[i] - cross(w, arm), w)
        return moving

    def _material(self, x: Array, free: SolvedState, i: int, body: Moving, there: Touching) -> Array:
        """Rate of the velocity of a body's material at the contact point, which moves over the body."""
        arm = there.place - self._equations.parts(x)[0][i]
        turning = cross(body.R @ free.angular[i], arm) + cross(body.w, cross(body.w, arm))
        return np.asarray(free.linear[i] + turning + cross(body.w, there.place_rate - body.velocity(there.place)))

    def forces(self, now: ContactsThere, mode: ContactMode) -> Array:
        """Forces on body a of each contact in a mode [N], (contacts, 3).

        Raises:
            Diverged: friction makes a normal force negative (Painlevé).
        """
        rows = _rows(now, mode)
        along = [
            row - self.friction[k] * self._heading(k, now.touching[k]) if mode[k].kind == "slip" else row
            for k, row in rows
        ]
        force = np.zeros((len(mode), 3))
        if not rows:
            return force
        K = np.array([row @ now.J[k] for k, row in rows])
        D = np.array([now.response[:, k] @ direction for (k, _), direction in zip(rows, along, strict=True)])
        wanted = [-row @ now.rate[k] for k, row in rows]
        for i, (k, row) in enumerate(rows):
            if mode[k].kind == "slip":
                wanted[i] -= now.touching[k].normal_rate @ now.touching[k].slide
                if row @ now.J[k] @ D[i] <= 0:
                    raise Diverged(f"at t = {self.t:.6g} s " + PAINLEVE.format(name=self.contacts[k].name))
        sizes = np.linalg.lstsq(K @ D.T, np.array(wanted), rcond=_RANK)[0]
        for size, (k, _), direction in zip(sizes, rows, along, strict=True):
            force[k] += size * direction
        return force

    def _settled(self, y: Array, mode: ContactMode) -> Array:
        """State without velocities that violate closed contacts."""
        now = self.at(y)
        rows = _rows(now, mode)
        if not rows:
            return y
        K = np.array([row @ now.J[k] for k, row in rows])
        D = np.array([now.response[:, k] @ row for k, row in rows])
        left = np.array([row @ now.touching[k].slide for k, row in rows])
        return self._pushed(y, -D.T @ np.linalg.lstsq(K @ D.T, left, rcond=_RANK)[0])

    def _pushed(self, y: Array, change: Array) -> Array:
        """State after a change of the velocities ν."""
        return np.append(self._equations.pushed(y[:-1], change), y[-1])

    def _heading(self, k: int, there: Touching) -> Array:
        """Direction of a slip; after the end of the slip within a step, the direction before."""
        slip, toward = slip_velocity(there), self._toward[k]
        speed = float(np.linalg.norm(slip))
        if speed <= np.finfo(float).tiny:
            return toward
        return np.asarray(slip / speed if slip @ toward >= 0 else -slip / speed)

    def solve(self) -> tuple[SolvedState, Array, tuple[Touching, ...]]:
        """Equations of motion solved now, contact forces [N], (contacts, 3), and geometry of the contacts."""
        now = self.at(self._stepper.x)
        force = self.forces(now, self.mode)
        return self._equations.solve(self.x, np.einsum("kin,ki->n", now.J, force)), force, now.touching

    def read(self) -> dict[str, Any]:
        """Geometry and laws of the contacts now, for :class:`proofroll.elements.mechanism.sampling.MechanismBuilt`."""
        now = self.at(self._stepper.x)
        touching = now.touching
        return {
            "contact_gap": np.array([each.gap for each in touching]),
            "contact_normal": np.array([each.normal for each in touching]),
            "contact_place": np.array([each.place for each in touching]),
            "contact_friction": self.friction.copy(),
            "contact_restitution": np.array([contact.restitution for contact in self.contacts]),
            "contact_response": np.einsum("kin,nlj->kilj", now.J, now.response),
        }

    def _rates(self, y: Array) -> Array:
        now = self.at(y)
        load = np.einsum("kin,ki->n", now.J, self.forces(now, self.mode))
        return self._equations.rates(y[:-1], load)

    def _look(self, y: Array) -> None:
        """Stores the directions of slips, to detect reversals."""
        moving = self._moving(y[:-1])
        for k, (own, each) in enumerate(zip(self.mode, self.contacts, strict=True)):
            if own.kind == "slip":
                self._toward[k] = self._heading(k, touch(each, moving[each.body_a], moving[each.body_b]))

    def _enter(self, t: float, x: Array, mode: ContactMode) -> None:
        x, self.mode = self._settled(x, mode), mode
        self._toward = [np.array(own.heading or (0.0, 0.0, 0.0)) for own in mode]
        self._look(x)
        super()._enter(t, x, mode)

    def _excess(self, x: Array) -> list[Excess]:
        now = self.at(x)
        force, ends = self.forces(now, self.mode), list[Excess]()
        held: ContactMode = ()
        for k, (own, each) in enumerate(zip(self.mode, now.touching, strict=True)):
            if own.kind == "open":
                ends.append(Excess(k, "impact", -each.gap, -float(each.normal @ each.slide)))
                continue
            N = float(each.normal @ force[k])
            ends.append(Excess(k, "lift_off", -N))
            if own.kind == "slip" and self.friction[k]:
                ends.append(Excess(k, "still", -float(slip_velocity(each) @ self._toward[k])))
            elif own.kind == "stick":
                beyond = float(np.linalg.norm(force[k] - N * each.normal)) - self.friction[k] * N
                if beyond > 0 and sum(one.kind == "stick" for one in self.mode) > 1:
                    # forces shared by several sticking contacts are not unique: others may hold what this one cannot
                    held = held or self._decided(
                        now, [one.kind != "open" for one in self.mode], [one.kind == "stick" for one in self.mode]
                    )
                    beyond = -beyond if held[k].kind == "stick" else beyond
                ends.append(Excess(k, "slip", beyond))
        modes, wanted = list(self._equations.applied.modes.values()), self._equations.wanted(self._at(x))
        return ends + ends_of_efforts(self._motors.values(), modes, wanted, len(self.mode))

    def _next(self, x: Array, k: int, kind: str) -> tuple[Array, ContactMode, list[tuple[str, str]]]:
        was, happened = self.mode, list[tuple[str, str]]()
        if k >= len(was):
            motor = list(self._motors)[k - len(was)]
            self._equations.applied.modes = {**self._equations.applied.modes, motor: kind}
            return x, was, happened
        now, closed = self.at(x), [own.kind != "open" for own in was]
        still = [own.kind == "stick" for own in was]
        if kind == "impact":
            x, closed, settles = self._struck(x, now, k)
            self._limit_efforts(x)  # the effort that a servo requires jumps with the velocity
            happened = [("settle" if settles else "impact", self.contacts[k].name)]
            now = self.at(x)
            still = [bool(np.linalg.norm(slip_velocity(each)) <= self._still) for each in now.touching]
        elif kind == "still":
            slips = [float(np.linalg.norm(slip_velocity(each))) for each in now.touching]
            still = [stuck or own == k or slips[own] <= self._faint for own, stuck in enumerate(still)]
        mode = self._leaving(now, k) if kind == "slip" else self._decided(now, closed, still)
        if kind == "still" and slips[k] > self._still and mode[k].kind == "slip":  # it has turned, not stopped
            mode = self._decided(now, closed, [stands and own != k for own, stands in enumerate(still)])
        struck = {name for _, name in happened}
        happened += [one for one in changes(self.contacts, was, mode, self._stands(x, mode)) if one[1] not in struck]
        return x, mode, happened

    def _stands(self, y: Array, mode: ContactMode) -> bool:
        """True if nothing moves in a mode, or is about to move."""
        if self._timed or any(own.kind == "slip" for own in mode):
            return False
        now = self.at(y := self._settled(y, mode))
        load = np.einsum("kin,ki->n", now.J, self.forces(now, mode))
        n, rate = len(self._equations.mass), self._equations.rates(y[:-1], load)
        sizes = np.repeat([1.0, self._unit / self._rate], 3 * n)  # for velocities and angular velocities
        moves, will = (float(np.abs(sizes * part[7 * n : 13 * n]).max()) for part in (y, rate))
        return moves <= self._still and will <= _STANDS * self._unit * self._rate

    def _leaving(self, now: ContactsThere, k: int) -> ContactMode:
        """Mode in which a contact starts to slip, opposite to the friction that held it."""
        force, n = self.forces(now, self.mode)[k], now.touching[k].normal
        held = force - n * (n @ force)
        x, y, z = (-held / np.linalg.norm(held)).tolist()
        line = None if self.mode[k].along is None else (x, y, z)
        return (*self.mode[:k], Acting("slip", line, (x, y, z)), *self.mode[k + 1 :])

    def _struck(self, x: Array, now: ContactsThere, hit: int) -> tuple[Array, list[bool], bool]:
        """State after an impact by Newton's and Coulomb's laws; which contacts stay closed; True if it is the last."""
        which = [k for k, own in enumerate(self.mode) if own.kind != "open" or k == hit]
        frames, J, response = self._framed(now, which)
        c = np.concatenate([frame.T @ now.touching[k].slide for frame, k in zip(frames, which, strict=True)])
        speed, e = -c[3 * which.index(hit)], self.contacts[hit].restitution
        settles = self._settles(hit, speed / self._unit, e)
        e = 0.0 if settles else e
        c[3 * which.index(hit)] *= 1 + e
        impulse, _ = self._law(J @ response, c, which, [None] * len(which))
        x = self._pushed(x, response @ impulse.ravel())
        # by the speed, not the impulse: of a contact that the impact leaves alone that is round-off, of either sign
        leaves = [float(each.normal @ each.slide) > self._still for each in self.at(x).touching]
        closed = [k in which and not leaves[k] and not (k == hit and e) for k in range(len(self.mode))]
        return x, closed, settles

    def _framed(self, now: ContactsThere, which: Sequence[int]) -> tuple[list[Array], Array, Array]:
        """Normal and two tangents of some contacts; J along them, and response to forces along them."""
        frames = [frame_of_axis(now.touching[k].normal)[:, [2, 0, 1]] for k in which]
        J = np.concatenate([frame.T @ now.J[k] for frame, k in zip(frames, which, strict=True)])
        response = np.concatenate([now.response[:, k] @ frame for frame, k in zip(frames, which, strict=True)], 1)
        return frames, J, response

    def _law(self, G: Array, c: Array, which: Sequence[int], sliding: Sequence[Array | None]) -> tuple[Array, Any]:
        try:
            return contact_forces(G, c, self.friction[list(which)], sliding, [self.contacts[k].name for k in which])
        except Refused as error:
            raise Diverged(f"at t = {self.t if hasattr(self._stepper, 't') else 0.0:.6g} s: {error}") from None

    def _decided(self, now: ContactsThere, closed: Sequence[bool], still: Sequence[bool]) -> ContactMode:
        """Mode that follows from the forces, for contacts that are closed, and at rest where ``still``."""
        which, mode = [k for k, shut in enumerate(closed) if shut], [OPEN for _ in closed]
        if not which:
            return tuple(mode)
        frames, J, response = self._framed(now, which)
        c, sliding = np.zeros(3 * len(which)), list[Array | None]()
        for place, (frame, k) in enumerate(zip(frames, which, strict=True)):
            there = now.touching[k]
            c[3 * place : 3 * place + 3] = frame.T @ now.rate[k]
            c[3 * place] += there.normal_rate @ there.slide
            slip = frame[:, 1:].T @ there.slide
            sliding.append(None if still[k] else slip / np.linalg.norm(slip))
        G = J @ response
        force, done = self._law(G, c, which, sliding)
        for place, (frame, k) in enumerate(zip(frames, which, strict=True)):
            own, slides = slice(3 * place, 3 * place + 3), sliding[place]
            mode[k] = first_mode(done[place], frame, -force[place, 1:] if slides is None else slides, G[own, own])
        return tuple(mode)


def _rows(now: ContactsThere, mode: ContactMode) -> list[tuple[int, Array]]:
    """Directions in which closed contacts are constrained, with their contact: normal if slipping, all if sticking."""
    directions: list[tuple[int, Array]] = []
    for k, (own, each) in enumerate(zip(mode, now.touching, strict=True)):
        if own.kind == "slip":
            directions.append((k, each.normal))
        elif own.kind == "stick":
            directions += [(k, direction) for direction in np.eye(3)]
    return directions
