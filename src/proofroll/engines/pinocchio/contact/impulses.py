"""Steps of a mechanism with contacts, dry friction and stops, by Pinocchio's terms and its contact solver.

Contacts are points in Pinocchio, posed in each step where the shapes are nearest. Its solver finds the impulses of a
step within the friction cones: by Coulomb's law, or by the convex problem without De Saxcé's term, where slipping
contacts separate.
"""

import math
from collections.abc import Sequence
from itertools import accumulate, compress, pairwise, starmap
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism.contact.rolling_and_spin import rolling_levers
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.contact.touching import ONE_POINT, Touching, touch
from proofroll.elements.mechanism.run.contacts import step_events
from proofroll.elements.mechanism.run.contacts.step_events import OPEN, SLIP, STICK
from proofroll.elements.mechanism.scene.rotations import Array, carried, dot, frame_of_axis
from proofroll.engines.pinocchio.contact.blocks import Block, BlockSolver
from proofroll.engines.pinocchio.contact.joint_rows import JointRows
from proofroll.engines.pinocchio.contact.shared_cones import SharedCones
from proofroll.engines.pinocchio.contact.step_terms import (
    LARGEST_FRICTION,
    Impulses,
    MovingBodies,
    SolverParts,
    StepTerms,
    solver_of,
)
from proofroll.engines.pinocchio.contact.turning_moments import Pressed, TurningImpulses
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree

# Approach speed, in steps of gravity, below which nothing rebounds.
_SOFT = 5.0
# Fraction of a gap that a step by the midpoint rule closes; closing all of it would eject what has penetrated.
_CLOSED = 0.5
# Largest gap that counts as closed, in falls by gravity of one step.
_NEAR = 2.0
# Part of the largest speed of a row that a speed along a normal has to be, to count.
_SMALL = 1e-9
_AT_REST = 1e-100  # speed of which no unit is made: quotients by it leave the range of floats [m/s, rad/s]
# Ratio of friction to its bound above which an impulse lies on the cone.
_INSIDE = 1 - 1e-6
_NO_CHANGE: Sequence[float] = (0.0, 0.0, 0.0)  # of slip and gap velocities
# Ratio of the contact's mobility in two directions of the surface above which PGS returns a wrong impulse.
_UNEQUAL = 2.0
# Largest coefficient of the first cone, and factor on it while an impulse lies on it. Narrower cones than needed cost
# iterations alone; of three contacts tried, ADMM finds all impulses in cones below 10, and not all in those above.
_NARROW, _WIDER = 1.0, 3.0


class ImpulseSteps:
    """Steps of a tree with contacts, dry friction and stops of joints.

    Attributes:
        q, v, t: configuration, velocity, time [s].
        restitution: of each contact [1].
        events: of the contacts.
        joints: joint rows, numbered after the contacts.
        blocks: solver that goes on where Pinocchio's ADMM stops.
        sharing: cones that turns share with slips, which blocks alone solve.
        ahead: bodies later in a step, or in a sample.
        coming: impulses of the next step, where a sample has found them.
    """

    def __init__(self, tree: JointTree, settings: PinocchioSettings) -> None:
        """Starts at time 0.

        Raises:
            Refused: Pinocchio's solver returns wrong impulses for such contacts, or has no cone of theirs, or one point
                does not hold a body.
        """
        bodies = {body for contact in tree.mechanism.contacts for body in (contact.body_a, contact.body_b)}
        self._tree, self._model, self._bodies = tree, tree.model, MovingBodies(tree, bodies)
        self._data, self.ahead = self._bodies.data, MovingBodies(tree, bodies)
        self._placed = [self._data.oMi[joint] for joint in range(tree.model.njoints)]  # where they are at any time
        self.coming: Impulses | None = None
        self._settings, self._dt = settings, float(settings.dt or 0.0)
        self._midpoint = settings.integrator == "midpoint"
        mechanism, self.contacts = tree.mechanism, tree.mechanism.contacts
        self.events = step_events.StepEvents(self.contacts, self._dt)
        self.q, self.v, self.t, self._gravity = tree.q0, tree.v0, 0.0, float(np.linalg.norm(mechanism.gravity))
        held = step_events.least_slip(mechanism.gravity, self._dt)
        self._held = [held if contact.friction else -1.0 for contact in self.contacts]
        self._touching, self._index = natural_scale(mechanism).gap, mechanism.body_index
        self.restitution = np.array([contact.restitution for contact in self.contacts])
        self.joints = JointRows(tree)
        stops = [item.joint.restitution for item in self.joints.stops]
        self._returned = [*self.restitution.tolist(), *(0.0 for _ in self.joints.friction), *stops]
        self._moments = TurningImpulses(tree, float(settings.solver_tolerance or 0.0))
        self._pressed_by = [friction.pressed_by for friction in self._moments.frictions]
        self._solvers: dict[tuple[int, ...], SolverParts] = {}
        self.blocks = BlockSolver(float(settings.solver_tolerance or 0.0))
        nv, self._all = tree.model.nv, tuple(range(len(self.contacts)))
        self.sharing = sharing = SharedCones(tree, settings)
        ends = list(accumulate([*(3 + turns for turns in sharing.turns), *[1] * len(self.joints.J)], initial=0))
        self._rows = list(starmap(range, pairwise(ends)))  # numbers of the rows of each contact and joint row
        self._slides = [row for rows in self._rows[: len(self.contacts)] for row in rows[-3:]]
        numbers = np.arange(nv)
        self._upper = np.minimum.outer(numbers, numbers) * nv + np.maximum.outer(numbers, numbers)
        # Impulses that impose motions without contacts, and velocities by a unit rate of each.
        self._motions: tuple[Array, Array] = np.zeros(0), np.zeros((tree.model.nv, 0))
        try:
            terms = self.terms(self.q, self.v, self._dt)
            for k, (point, J) in enumerate(zip(terms.touching, terms.J, strict=True)):
                mobility = (J @ terms.inverse @ J.T).diagonal().tolist()
                self._check(k, mobility, point.flat and point.gap <= self._touching)
        except Diverged as error:
            raise Refused(str(error)) from None

    def _check(self, k: int, mobility: Sequence[float], flat: bool) -> None:
        """Checks that a point holds contact ``k``, with its mobility along its three rows, and that PGS is right there.

        Raises:
            Diverged: a body stands on an edge, or PGS returns a wrong impulse.
        """
        if flat:
            raise Diverged(f"{self.contacts[k].name} {ONE_POINT}")
        if self._settings.solver != "pgs" or not self.contacts[k].friction:
            return
        if max(mobility[:2]) > _UNEQUAL * min(mobility[:2]):
            raise Diverged(
                f"Pinocchio's PGS returns a wrong impulse where a contact gives way {_UNEQUAL:g} times as much in one "
                f"direction as across it, as {self.contacts[k].name} does at {self.t:g} s; set solver=admm"
            )

    def step(self) -> None:
        """Makes one step from the present state.

        Raises:
            Diverged: Pinocchio's solver does not find the impulses.
        """
        kick, self.coming = self.coming or self.kick(self.q, self.v), None
        if self.events:
            self.events.observe(self.t + self._dt, kick.states)
        if self._midpoint:
            middle = pin.integrate(self._model, self.q, 0.5 * self._dt * self.v)
            self.q = pin.integrate(self._model, middle, 0.5 * self._dt * kick.v)
        else:
            self.q = pin.integrate(self._model, self.q, self._dt * kick.v)
        self.v = kick.v

    def kick(self, q: Array, v: Array) -> Impulses:
        """Impulses of the step from a state; changes nothing but scratch data."""
        late = 0.5 * self._dt * self._midpoint
        if self._midpoint:
            q = pin.integrate(self._model, q, late * v)
        terms = self.terms(q, v, self._dt, late)
        turning = [_NO_CHANGE] * len(terms.touching)
        if self._midpoint or any(self._returned):
            turning = self._turning(q, v, terms, self._dt - late)
        shifts = self._shifts(terms, q, v, turning)
        return self._turned(q, v, terms, shifts, self._dt, convex=self._settings.convex)

    def beginning(self, span: float, *, convex: bool) -> Impulses:
        """Impulses of a short time from now on, with the turning of the contacts (J̇v); open gaps stay open."""
        terms = self.terms(self.q, self.v, span)
        shifts = [0.0] * len(terms.rows)
        for rows, changes in zip(self._rows, self._turning(self.q, self.v, terms, span), strict=False):
            shifts[rows[-3] : rows[-1] + 1] = changes
        apart = [touch.absent or touch.gap > self._touching for touch in terms.touching]
        apart += [False] * len(self.joints.friction) + [not item.closed(self.q) for item in self.joints.stops]
        for rows in compress(self._rows, apart):
            shifts[rows[-1]] = math.inf
        return self._turned(self.q, self.v, terms, shifts, span, convex=convex)

    def read(self) -> dict[str, Any]:
        """Normals, positions and widest cones of contact points in Pinocchio, with gaps of the shapes at its poses."""
        terms = self.terms(self.q, self.v, self._dt)
        world, inverse, touching = np.array(terms.frames) @ terms.J, terms.inverse, terms.touching
        solver, data = self._solver(self._all), self._data
        normal, place = np.zeros((2, len(touching), 3))
        for k, point in enumerate(solver.points):
            point.setFriction(self._friction(k))
            normal[k] = (data.oMi[point.joint1_id] * point.joint1_placement).rotation[:, 2]
            place[k] = (data.oMi[point.joint2_id] * point.joint2_placement).translation
        return {
            "contact_gap": np.array([touch.gap for touch in touching]),
            "contact_normal": normal,
            "contact_place": place,
            "contact_friction": np.array([point.getFriction() for point in solver.points]),
            "contact_restitution": self.restitution.copy(),
            "contact_rolling": rolling_levers(self._moments.frictions, len(touching)) + self.sharing.rolling,
            "contact_tangential": np.array([contact.tangential_restitution for contact in self.contacts]),
            "contact_response": np.einsum("kin,nm,ljm->kilj", world, inverse, world),
        }

    def terms(self, q: Array, v: Array, span: float, late: float = 0.0) -> StepTerms:
        """Terms of a step of length ``span`` [s]; ``q`` belongs to the time ``late`` [s] after its start."""
        tree, model, data = self._tree, self._model, self._data
        touching = self.touched(self._bodies, q, v, [None] * len(self.contacts))
        tree.now = self.t + late
        pulls = tree.pulls(data) if tree.pushed else None
        tau = tree.drives(q, v)
        rate = pin.aba(model, data, q, v, tau, pulls) if pulls else pin.aba(model, data, q, v, tau)
        free = v + span * rate
        inverse = pin.computeMinverse(model, data, q).take(self._upper)  # of which it gives the upper half alone
        if len(tree.geared):
            free, inverse = self._driven(q, free, inverse, span, late)
        pin.computeJointJacobians(model, data, q)
        frames, all_of = [frame_of_axis(point.normal) for point in touching], self._solver(self._all)
        contact_rows = [self._posed(all_of, k, *placed) for k, placed in enumerate(zip(touching, frames, strict=True))]
        if self.sharing:
            contact_rows = [
                row for k, rows in enumerate(contact_rows) for row in (self.sharing.rows(data, k, frames[k]), rows)
            ]
        rows = np.concatenate([*contact_rows, self.joints.J])
        J = rows[self._slides if self.sharing else slice(len(self._slides))].reshape(-1, 3, model.nv)
        into = inverse @ rows.T
        return StepTerms(
            rows=rows,
            J=J,
            free=free,
            at_free=rows @ free,
            inverse=inverse,
            into=into,
            response=rows @ into,
            touching=touching,
            frames=frames,
        )

    def _driven(self, q: Array, free: Array, inverse: Array, span: float, late: float) -> tuple[Array, Array]:
        """Velocity without impulses and inverse mass matrix where motions are imposed, whose impulses hold in a step.

        A driven joint has the rate of its motion at the end of the step, and comes back to its place.
        """
        tree, rows = self._tree, self._tree.geared
        time, tree.now = tree.now, self.t + late
        off = tree.apart(q)[0]
        tree.now = self.t + span
        rates = tree.apart(q)[1] - (_CLOSED if self._midpoint else 1.0) * off / self._dt
        tree.now = time
        into = inverse @ rows.T
        motor_responses = into @ np.linalg.inv(rows @ into)
        self._motions = np.array(np.linalg.solve(rows @ into, rates - rows @ free), dtype=float), motor_responses
        return free + motor_responses @ (rates - rows @ free), inverse - motor_responses @ into.T

    def unsure(self, span: float) -> Array:
        """Velocities by which errors of each row within the tolerance change those after a ``span`` [s], (rows, nv)."""
        terms = self.terms(self.q, self.v, span)
        rows, free, inverse = terms.rows, terms.free, terms.inverse
        speed = float(np.abs(rows @ free).max(initial=0.0)) * float(self._settings.solver_tolerance or 0.0)
        ways = rows @ inverse
        ease = np.einsum("ri,ri->r", rows, ways)
        changes: Array = speed * ways[ease > 0] / ease[ease > 0, None]
        return changes

    def touched(self, bodies: MovingBodies, q: Array, v: Array, features: Sequence[int | None]) -> list[Touching]:
        """Geometry of the contacts in a state, each with the features that touch; None: the nearest."""
        moving = bodies.at(q, v)
        return [
            touch(contact, moving[contact.body_a], moving[contact.body_b], feature)
            for contact, feature in zip(self.contacts, features, strict=True)
        ]

    def _turning(self, q: Array, v: Array, terms: StepTerms, span: float) -> list[Sequence[float]]:
        """Changes of slip and gap velocities within a ``span`` [s] in which joint velocities are constant (J̇v)."""
        later = pin.integrate(self._model, q, span * v)
        touching_later = self.touched(self.ahead, later, v, [contact.feature for contact in terms.touching])
        return [
            (frame.T @ (carried(later_point.slide, later_point.normal, point.normal) - point.slide)).tolist()
            for frame, point, later_point in zip(terms.frames, terms.touching, touching_later, strict=True)
        ]

    def _posed(self, solver: SolverParts, number: int, contact_point: Touching, frame: Array) -> Array:
        """Poses the ``number``-th point of a solver and returns its rows, shape (3, nv)."""
        point, place = solver.points[number], pin.SE3(frame, contact_point.place)
        point.joint1_placement = self._placed[point.joint1_id].actInv(place)
        point.joint2_placement = self._placed[point.joint2_id].actInv(place)
        point.calc(self._model, self._data, solver.point_datas[number])
        rows: Array = point.jacobian(self._model, self._data, solver.point_datas[number])
        return rows.reshape(3, -1)  # of a model of one velocity Pinocchio gives a vector

    def _solver(self, which: tuple[int, ...]) -> SolverParts:
        if which not in self._solvers:
            models, datas = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
            rows, count = (*self.joints.friction, *self.joints.stops), len(self.contacts)
            for k in which:
                if k < count:
                    contact = self.contacts[k]
                    b, a = (self._joint(body) for body in (contact.body_b, contact.body_a))
                    point = pin.PointContactConstraintModel(self._model, b, pin.SE3.Identity(), a, pin.SE3.Identity())
                    point.setFriction(self._friction(k))
                    models.append(pin.ConstraintModel(point))
                else:
                    models.append(rows[k - count].model)
                datas.append(models[len(models) - 1].createData())
            points = [models[i].extract() for i in range(len(which))]
            tolerance, kind = float(self._settings.solver_tolerance or 0.0), self._settings.solver or "admm"
            chosen = [row for k in which for row in self._rows[k]]
            self._solvers[which] = SolverParts(
                points=points,
                point_datas=[datas[i].extract() for i in range(len(which))],
                ends=list(accumulate(len(self._rows[k]) for k in which)),
                rows=slice(None) if len(which) == len(self._rows) else chosen,
                models=models,
                datas=datas,
                solver=solver_of(kind, tolerance, len(chosen)),
            )
        return self._solvers[which]

    def _friction(self, k: int) -> float:
        """Coefficient of a contact in Pinocchio, which has no unbounded friction."""
        return min(self.contacts[k].friction, LARGEST_FRICTION[self._settings.solver or "admm"])

    def _joint(self, body: str) -> int:
        k = self._index[body]
        return 0 if k < 0 else int(self._model.frames[self._tree.body[k]].parentJoint)

    def _shifts(self, terms: StepTerms, q: Array, v: Array, turning: Sequence[Sequence[float]]) -> list[float]:
        """Terms added to slip and gap velocities [m/s], one for each row; inf along a normal: the gap cannot close.

        ``turning``: changes of these velocities within the step, which do not matter in an impact.
        """
        count, dt, speeds = len(terms.touching), self._dt, (terms.rows @ v).tolist()
        begin, shifts = count + len(self.joints.friction), [0.0] * len(speeds)
        gaps = [math.inf if touch.absent else touch.gap for touch in terms.touching]
        for k, gap in [*enumerate(gaps), *enumerate((item.gap(q) for item in self.joints.stops), begin)]:
            row = self._rows[k][-1]
            e, approach, bend = self._returned[k], speeds[row], abs(turning[k][2]) if k < count else 0.0
            hits = e and -e * approach > _SOFT * (self._gravity * dt + bend)
            shifts[row] = math.inf
            if self._midpoint:
                if gap <= max(self._touching, _NEAR * self._gravity * dt**2):
                    back = max(_CLOSED * gap / dt, -_SOFT * self._gravity * dt) if k >= begin else _CLOSED * gap / dt
                    shifts[row] = e * approach if hits else back
                    if k < count and not hits:
                        shifts[row - 2 : row + 1] = turning[k][0], turning[k][1], back + turning[k][2]
            else:
                hits = hits and gap + dt * (approach - dt * self._gravity) <= 0
                shifts[row] = e * approach if hits else gap / dt
            if hits and k < count and (rebound := self.contacts[k].tangential_restitution):
                shifts[row - 2 : row] = rebound * speeds[row - 2], rebound * speeds[row - 1]
        return shifts

    def _turned(
        self, q: Array, v: Array, terms: StepTerms, shifts: Sequence[float], span: float, *, convex: bool
    ) -> Impulses:
        """Impulses of a step that begins with the velocity ``v``, with those of friction against turning.

        An impact has no moment of friction.
        """
        if not self._moments.frictions:
            return self._solved(terms, shifts, span, convex=convex)
        J, touching = terms.J, terms.touching
        rows = self._moments.rows(self._data, touching, terms.frames, J)
        approach, soft_speed = (J[:, 2] @ v).tolist(), -_SOFT * self._gravity * span
        soft = [speed >= soft_speed for speed in approach]
        if not all(soft):  # a curved wall turns away from a fast ball
            turning = self._turning(q, v, terms, span)
            soft = [a >= soft_speed - _SOFT * abs(bend) for a, (_, _, bend) in zip(approach, turning, strict=True)]

        def pressed(impulses: Array) -> Pressed:
            loaded = terms
            if impulses.any():
                free, at_free = terms.free + terms.inverse @ impulses, terms.at_free + impulses @ terms.into
                loaded = terms._replace(free=free, at_free=at_free)
            kick = self._solved(loaded, shifts, span, convex=convex)
            return kick, [dot(touching[k].normal, kick.impulse[k]) if soft[k] else 0.0 for k in self._pressed_by]

        kick, moments, impulses = self._moments.found(rows, J, v, terms.inverse, pressed, self.t)
        by_contact = kick.moment.copy()
        for k, moment in zip(self._pressed_by, moments, strict=True):
            by_contact[k] += moment
        return kick._replace(moment=by_contact, driving=kick.driving - self._motions[1].T @ impulses)

    def _solved(self, terms: StepTerms, shifts: Sequence[float], span: float, *, convex: bool) -> Impulses:
        """Impulses of dry friction and of all contacts and stops that would close, also due to other impulses."""
        free, at_free, frames = terms.free, terms.at_free, terms.frames
        count, v, own_rows, added = len(frames), free, self._rows, np.array(shifts)
        rubs = count + len(self.joints.friction)
        gaps = [k for k in (*self._all, *range(rubs, len(own_rows))) if math.isfinite(shifts[own_rows[k][-1]])]
        impulse, along_rows, which = np.zeros((count, 3)), np.zeros(len(own_rows) - count), tuple(range(count, rubs))
        moment = np.zeros((count, 3))
        states = [OPEN] * count
        grown, pushed = bool(which), np.zeros(len(free))
        alone, motor_responses = self._motions
        speeds = at_free.tolist()
        while True:
            closing = set[int]()
            for k in gaps:
                of_row = speeds[own_rows[k].start : own_rows[k].stop]
                # a speed that is round-off of its rows would be the unit of impulses, in which slips are huge
                if of_row[-1] + shifts[own_rows[k][-1]] < -_SMALL * max(map(abs, of_row)):
                    closing.add(k)
            if not grown and closing.issubset(which):
                driving = alone - motor_responses.T @ pushed if alone.size else alone
                for k, held in enumerate(self._held):
                    if states[k] == SLIP:
                        slips = [speeds[row] + shifts[row] for row in own_rows[k][:-1]]
                        states[k] = STICK if math.hypot(*slips) <= held else SLIP
                seen = tuple(states)
                return Impulses(v=v, impulse=impulse, states=seen, moment=moment, along=along_rows, driving=driving)
            which, grown = tuple(sorted(closing.union(which))), False
            parts = self._solver(which)
            response, g = terms.response[:, parts.rows], (at_free + added)[parts.rows]
            got = self._by_any(which, response[parts.rows], g, terms, span, convex=convex)
            v, pushed = free + terms.into[:, parts.rows] @ got, terms.rows[parts.rows].T @ got if alone.size else pushed
            speeds, sizes = (at_free + response @ got).tolist(), got.tolist()
            impulse[:], moment[:], along_rows[:] = 0.0, 0.0, 0.0
            for end, k in zip(parts.ends, which, strict=True):
                if k < count:
                    impulse[k] = frames[k] @ got[end - 3 : end]
                    turns, (F1, F2, N) = got[end - len(own_rows[k]) : end - 3], sizes[end - 3 : end]
                    F, bound = math.hypot(F1, F2, *turns), _INSIDE * self.contacts[k].friction * N
                    states[k] = step_events.state_of(N, F, bound)
                    if turns.size:
                        moment[k] = self.sharing.moment(k, frames[k], turns)
                else:
                    along_rows[k - count] = sizes[end - 1]

    def _by_any(
        self, which: tuple[int, ...], G: Array, g: Array, terms: StepTerms, span: float, *, convex: bool
    ) -> Array:
        """Impulses as by :meth:`_found`, or by blocks, which go first from where Pinocchio's ADMM stopped.

        Raises:
            Diverged: neither finds them.
        """
        if not self.blocks.solved and not self.sharing:
            try:
                return self._found(which, G, g, terms, span, convex=convex)
            except Diverged:
                if convex or self._settings.solver != "admm":
                    raise
        count, rubbing, parts, diagonal = len(self.contacts), self.joints.friction, dict[int, Block](), G.diagonal()
        for k, end in zip(which, self._solver(which).ends, strict=True):
            if k < count:
                self._check(k, diagonal[end - 3 : end].tolist(), terms.touching[k].flat)
                turns = self.sharing.turns[k]
                parts[k] = Block(end - 3 - turns, self._friction(k), turns=turns)
            else:
                rubs = k < count + len(rubbing)
                parts[k] = Block(end - 1, None, span * rubbing[k - count].joint.friction if rubs else math.inf)
        return self.blocks.impulses(G, g, parts, lambda: self._found(which, G, g, terms, span, convex=convex))

    def _found(
        self, which: tuple[int, ...], G: Array, g: Array, terms: StepTerms, span: float, *, convex: bool
    ) -> Array:
        """Impulses of the contacts and joint rows ``which`` [N s, N m s].

        ``G`` is their Delassus matrix, ``g`` their velocity without impulses and with shifts. An impulse inside a cone
        is also that of any wider one, and Pinocchio's ADMM diverges with wide ones: each is as narrow as it can be.

        Raises:
            Diverged: Pinocchio's solver does not find them.
        """
        self.sharing.require_none(self.t)
        count, solver = len(self.contacts), self._solver(which)
        # Pinocchio's tolerances and regularisations are numbers without scale: 1e-8, below which its ADMM adapts
        # its penalty the wrong way, would be a large part of the impulses of short steps or light bodies. In these
        # units of speed and impulse the problem is the same for all masses, steps and lengths.
        speeds, mobility = [abs(speed) for speed in g.tolist()], G.diagonal().tolist()
        fastest = max(speeds)
        speed = max(*(speeds[end - 1] for end in solver.ends), _SMALL * fastest) if fastest > _AT_REST else 1.0
        unit = speed / max(mobility)
        points = []
        for row, (end, k) in enumerate(zip(solver.ends, which, strict=True)):
            if k < count:
                point, mu = solver.points[row], self._friction(k)
                self._check(k, mobility[end - 3 : end], terms.touching[k].flat)
                if which != self._all:  # else as of the terms
                    self._posed(solver, row, terms.touching[k], terms.frames[k])
                points.append((point, end, mu))
                point.setFriction(min(mu, _NARROW))
            elif k < count + len(self.joints.friction):
                solver.points[row].setTimeStep(span / unit)  # bounds are forces; the default step would be 1 s
                solver.points[row].calc(self._model, self._data, solver.point_datas[row])
        solve, options, result = solver.solver
        options.solve_ncp = not convex
        tolerance = float(self._settings.solver_tolerance or 0.0)
        # a product of impulses and velocities, which both have the tolerance; velocities are 1 along normals
        least = tolerance * max(1.0, fastest / speed)
        options.absolute_complementarity_tol = least
        operator, in_units = pin.DelassusOperatorDense(G * (unit / speed)), g / speed
        while True:
            result.reset()
            if not solve.solve(operator, in_units, solver.models, solver.datas, options, result):
                raise Diverged(
                    f"Pinocchio's {self._settings.solver} solver did not reach "
                    f"solver_tolerance={self._settings.solver_tolerance:g} at {self.t:g} s; a larger one may do"
                )
            impulses = result.retrieveConstraintImpulses()
            sizes, narrow = impulses.tolist(), []
            for point, end, mu in points:
                friction = point.getFriction()
                bound = friction * sizes[end - 1]
                if friction < mu and math.hypot(*sizes[end - 3 : end - 1]) + least >= bound > least:
                    narrow.append((point, mu))
            if not narrow:
                return np.asarray(unit * impulses)
            for point, mu in narrow:
                point.setFriction(min(_WIDER * point.getFriction(), mu))
