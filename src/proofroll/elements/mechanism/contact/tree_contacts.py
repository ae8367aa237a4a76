"""Equations of motion of a mechanism whose bodies touch, in the coordinates of its tree.

Between events each contact is ``open``, ``slip``s (one row, friction against the slip), or ``stick``s (three rows).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from proofroll.core.last_results import LastResults
from proofroll.elements.mechanism.contact.coulomb import (
    NULL,
    contact_forces,
    least_motion_for,
    natural_rows,
    returning,
    robust_forces,
)
from proofroll.elements.mechanism.contact.free_slides import acting_ones, passing
from proofroll.elements.mechanism.contact.joint_laws import (
    JointContact,
    joint_contacts,
    line_response,
    mode_of_joints,
    off_stops,
    on_stops,
)
from proofroll.elements.mechanism.contact.modes import (
    EXACT,
    OPEN,
    Acting,
    ContactMode,
    Features,
    features_of,
    first_mode,
    forbidding_rows,
    heading_of,
    held_directions,
    turned,
    with_features,
)
from proofroll.elements.mechanism.contact.rolling_and_spin import (
    TurningFriction,
    moments_by_pressing,
    pressed_by,
    standing,
    turning_frictions,
    with_moments,
)
from proofroll.elements.mechanism.contact.sequences import groups_of, left_by, ordered, refuse_spread, sequences
from proofroll.elements.mechanism.contact.start import TOUCHING, at_start, touches
from proofroll.elements.mechanism.contact.states import ContactsNow, ContactSolution
from proofroll.elements.mechanism.contact.touching import Touching, guided, lying
from proofroll.elements.mechanism.dynamics.analysis import NO_RESPONSE, RANK
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion
from proofroll.elements.mechanism.dynamics.point_loads import kink_arguments
from proofroll.elements.mechanism.scene.drives import MODES
from proofroll.elements.mechanism.scene.kinks import held_sides
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array, cross, frame_of_axis, skew
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact, contact_moments, contact_sums, turned_bodies
from proofroll.elements.mechanism.scene.signal import FUNCTIONS

# Impulse, relative to the largest of an impact, that counts as none; a pressure nudged by 1e-6 makes such impulses.
_NO_IMPULSE = 1e-4
_ROUNDS = 2  # of the solution for forces: one, and one for its residual
_KEPT = 512  # states whose kinematics are kept: paths that part late have most of their samples in common
_ROUND_OFF = 1e-13  # of slides in a sequence of impacts, relative to the largest


def turning_row(motion: BodyMotion, bodies: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Angular velocity of a relative to b at a contact, its derivative by the velocities, its rate at v̇ = 0."""
    a, b = bodies
    parts = motion.w_WB, motion.J[:, 3:], motion.bias[:, 3:]
    turning, J, rate = (part[a] - part[b] for part in parts)
    return turning, J, rate


def slide_row(motion: BodyMotion, bodies: tuple[int, int], touch: Touching) -> tuple[Array, Array]:
    """Derivative of a contact's slide by the velocities, (3, nv), and rate of the slide at v̇ = 0, (3,); 0: absent."""
    J, bias = np.zeros((3, motion.J.shape[2])), np.zeros(3)
    if touch.absent:
        return J, bias
    for body, sign in zip(bodies, (1.0, -1.0), strict=True):
        arm, w = touch.place - motion.p_WB[body], motion.w_WB[body]
        J += sign * (motion.J[body, :3] - skew(arm) @ motion.J[body, 3:])
        turning = motion.bias[body, :3] + cross(motion.bias[body, 3:], arm)
        # the point of contact moves over the body, to places with other velocities
        bias += sign * (turning + cross(w, touch.place_rate - motion.v_WB[body]))
    return J, bias


class ContactDynamics:
    """A mechanism in the coordinates of its tree with its contacts: of bodies, laws of joints, friction of turning.

    Attributes:
        turning: friction against turning, the last of the contacts.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.equations = mechanism, JointCoordinates(mechanism)
        self._of_joints = joint_contacts(self.equations.switched)
        self.turning = turning_frictions(mechanism.contacts)
        self.contacts: tuple[BodyContact | JointContact | TurningFriction, ...] = (
            *mechanism.contacts,
            *self._of_joints,
            *self.turning,
        )
        self.friction = np.array([contact.friction for contact in self.contacts])
        self._static = np.array([contact.static for contact in self.contacts])
        self._bounds = np.array([contact.bound for contact in self.contacts])
        self._sums = contact_sums(mechanism.contacts)
        index = mechanism.body_index
        self._bodies = [(index[contact.body_a], index[contact.body_b]) for contact in mechanism.contacts]
        self._held: tuple[int, ...] = ()
        self._last = LastResults[tuple[bytes, bytes, float, tuple[object, ...], Features | None], ContactsNow](_KEPT)

    def at(self, q: Array, v: Array, time: float = 0.0, features: Features | None = None) -> ContactsNow:
        """Kinematics and free accelerations for coordinates (nq) and velocities (nv) at a time [s].

        ``features``: of solids that touch; None: the nearest.
        """
        key = q.tobytes(), v.tobytes(), time, (*self.mechanism.held, *self._held), features
        return self._last.of(key, lambda: self._at(q.copy(), v.copy(), time, features))

    def _at(self, q: Array, v: Array, time: float, features: Features | None) -> ContactsNow:
        solution = self.equations.solve(q, v, (), time=time)
        mass, C = self.equations.inertial(solution.motion)[1], solution.C
        mass = self.equations.weighted(mass, np.zeros(len(v)), C, np.zeros(len(C)))[0]
        loose = W = np.asarray(np.linalg.inv(mass), dtype=np.float64)
        if solution.split is not None:
            W = W - solution.split[0] @ solution.split[0].T
        touching = touches(self.mechanism, solution.motion, features)
        parts = [slide_row(solution.motion, self._bodies[k], touch) for k, touch in enumerate(touching)]
        for contact in self._of_joints:
            velocity = contact.joint.velocity
            touching += (contact.touching(float(q[contact.joint.coordinate]), float(v[velocity])),)
            parts.append((np.outer(contact.direction, np.eye(len(v))[velocity]), np.zeros(3)))
        fastest = float(np.linalg.norm(solution.motion.w_WB, axis=1).max()) if self.turning else 0.0
        for friction in self.turning:
            touch = touching[friction.pressed_by]
            turning, J, rate = turning_row(solution.motion, self._bodies[friction.pressed_by])
            touching += (friction.touching(touch, turning),)
            parts.append((friction.resisted(touch.normal, J), friction.resisted_rate(touch, turning, rate, fastest)))
        J = np.array([row for row, _ in parts]).reshape(-1, 3, len(v))
        bias = np.array([rate for _, rate in parts]).reshape(-1, 3)
        return ContactsNow(
            contacts=self.contacts, solution=solution, mass=mass, W=W, loose=loose, touching=touching, J=J, bias=bias
        )

    def solve(self, q: Array, v: Array, mode: ContactMode, time: float = 0.0) -> ContactSolution:
        """Accelerations and forces while each contact keeps the given mode, at a time [s].

        Raises:
            Diverged: a velocity moves nothing with inertia in this pose.
        """
        return self.solved(self.at(q, v, time, features_of(mode)), mode)

    def solved(self, state: ContactsNow, mode: ContactMode) -> ContactSolution:
        """Accelerations and forces at a state while each contact keeps the given mode; see :meth:`solve`."""
        mode = tuple(
            turned(acting, touch, line_response(contact, J @ state.W @ J.T, state.touching)) if acting.along else acting
            for contact, acting, touch, J in zip(self.contacts, mode, state.touching, state.J, strict=True)
        )
        rows, bias, pushes, owner = [np.zeros((0, state.W.shape[0]))], [np.zeros(0)], list[Array](), list[int]()
        force, turning = np.zeros((len(mode), 3)), list[tuple[int, int, Array]]()
        for k, (acting, touch) in enumerate(zip(mode, state.touching, strict=True)):
            contact = self.contacts[k]
            directions = held_directions(acting, touch, contact.presses)
            rows.append(directions @ state.J[k])
            bias.append(directions @ state.bias[k])
            owner += [k] * len(directions)
            if acting.kind == "slip":
                bias[-1] = bias[-1] + touch.normal_rate @ touch.slide
                heading = self.heading(acting, touch) if self.friction[k] or self._bounds[k] else np.zeros(3)
                force[k] = -self._bounds[k] * heading
                if contact.pressed_by is None:
                    directions = directions - self.friction[k] * heading
                else:
                    turning.append((k, contact.pressed_by, -self.friction[k] * heading))
            pushes += list(directions)
        K, free = np.concatenate(rows), state.solution.acceleration
        free = free + state.W @ np.einsum("kin,ki->n", state.J, force)
        if not owner:
            none = np.zeros((len(mode), 3, 0))
            return ContactSolution(state, mode, acceleration=free, force=force, response=1.0, shifts=none, spread=0.0)
        D = np.array([direction @ state.J[k] for direction, k in zip(pushes, owner, strict=True)])
        owned = list(zip(owner, pushes, strict=True))
        moments = moments_by_pressing(turning, owned, [touch.normal for touch in state.touching])
        for k, place, moment in moments:
            D[place] += moment @ state.J[k]
        S, aims = K @ state.W @ D.T, -np.concatenate(bias)
        smooth = K @ state.W @ K.T
        units = natural_rows(K @ state.loose @ K.T)
        values, vectors = np.linalg.eigh(smooth * np.outer(units, units))
        weak, even = values < max(NULL * values[-1], NO_RESPONSE), S * np.outer(units, units)
        U, sizes, V = np.linalg.svd(even)
        rank = len(S) - int(weak.sum())
        ways = units[:, None] * V[rank:].T
        ways /= np.linalg.norm(ways, axis=0)
        kept = slice(0, int((sizes[:rank] > NULL * sizes[0]).sum()))
        z, bound = np.zeros(len(S)), free
        # forces of a heavy body that cancel on a light one leave digits to the second round
        for _ in range(_ROUNDS):
            step = state.W @ (state.mass @ (bound - free) + D.T @ z)
            left = U[:, kept].T @ (units * (aims - K @ (free + step)))
            change = units * (V[kept].T @ (left / sizes[kept]))
            z, free = z + change, free + step + state.W @ (D.T @ change)
        shifts = np.zeros((len(mode), 3, ways.shape[1]))
        for k, direction, size, loose in zip(owner, pushes, z, ways, strict=True):
            force[k] += size * direction
            shifts[k] += np.outer(direction, loose)
        for k, place, moment in moments:
            force[k] += z[place] * moment
            shifts[k] += np.outer(moment, ways[place])
        whole = units[:, None] * vectors[:, ~weak]  # without what the split of a shared load changes
        response = float(np.linalg.det(whole.T @ S @ whole) / np.linalg.det(whole.T @ smooth @ whole))
        spread = float(np.linalg.norm(state.W @ (D.T @ ways)))
        return ContactSolution(state, mode, free, force, response=response, shifts=shifts, spread=spread)

    @staticmethod
    def heading(acting: Acting, touch: Touching) -> Array:
        """Unit direction in which a contact slips; its friction acts against it."""
        return heading_of(acting, touch)

    def rate(self, y: Array, mode: ContactMode) -> Array:
        """Right-hand side for the state (q, v, time)."""
        q, v, time = self.parts(y)
        return np.concatenate([self.equations.tree.rate(q, v), self.solve(q, v, mode, time).acceleration, [1.0]])

    def parts(self, y: Array) -> tuple[Array, Array, float]:
        """Coordinates, velocities and time [s] of a state."""
        nq = self.mechanism.nq
        return y[:nq], y[nq:-1], float(y[-1])

    def drawn(self, y: Array) -> Array:
        """Efforts with a limit before they are clamped, in parts of their limits."""
        q, v, time = self.parts(y)
        return np.array([m.wanted(time, q[at_q], v[at_v]) / m.bound for m, at_q, at_v in self.equations.limited])

    def kinks(self, y: Array) -> Array:
        """Arguments of the kinks of all laws, see :class:`~proofroll.elements.mechanism.scene.kinks.Sides`."""
        q, v, time = self.parts(y)
        return kink_arguments(self.mechanism, self.equations.tree.at(q, v), time)

    def hold(self, signs: Sequence[int]) -> None:
        """Keeps efforts with a limit at it, by their sign, or within it (0), and then the sides of kinks.

        Without signs all follow the state.
        """
        count = len(self.equations.limited)
        self.equations.sides = tuple(MODES[sign + 1] for sign in signs[:count])
        self.equations.functions = held_sides(self.mechanism.kinks, signs[count:], FUNCTIONS)
        self._held = tuple(signs)

    def eliminated(self, y: Array, mode: ContactMode) -> Array:
        """The state with violations of loops, closed contacts and unit quaternions removed."""
        mode = standing(self.contacts, mode)
        (q, v, time), presses = self.parts(y), [contact.presses for contact in self.contacts]
        closed_contacts = [k for k, acting in enumerate(mode) if acting.kind != "open" and presses[k]]
        unit = self.equations.tree.normalised(q)
        q = on_stops(
            [self.contacts[k] for k in closed_contacts], unit if np.abs(unit - q).max(initial=0.0) > EXACT else q
        )
        state = self.at(q, v, time, features := features_of(mode))
        gaps = np.array([state.touching[k].gap for k in closed_contacts])
        solution, K = state.solution, forbidding_rows(mode, state.touching, state.J, presses)
        left = [solution.rows.residual, solution.C @ v, gaps, K @ v]
        if np.abs(np.concatenate(left)).max(initial=0.0) > EXACT:
            y = np.append(self.equations.eliminated(y[:-1], ()), time)
            if not len(K):
                return y
            (q, v, _), state = self.parts(y), self.at(*self.parts(y), features)
            normals = np.array([state.touching[k].normal @ state.J[k] for k in closed_contacts]).reshape(-1, len(v))
            gaps = np.array([state.touching[k].gap for k in closed_contacts])
            q = self.equations.tree.moved(q, -least_motion_for(state.W, normals, gaps)) if closed_contacts else q
            state = self.at(q, v, time, features)
            K = forbidding_rows(mode, state.touching, state.J, presses)
            v = v - least_motion_for(state.W, K, K @ v)
        return np.concatenate([q, v, [time]])

    def begin(self) -> tuple[ContactMode, float]:
        """Mode at the start, and its margin to another one: inf, or 0 if it is not unique."""
        (q, v), rough = self.mechanism.start(), self.rough_start()
        return self.decided(q, v, passing(rough, self.at(q, v, 0.0, features_of(rough)).free_slides))

    def rough_start(self) -> ContactMode:
        """Modes at the start by the gaps and the slides: open, slip where a closed contact slides, else stick."""
        return at_start(self.mechanism, self.contacts, self.at(*self.mechanism.start()).touching)

    def decided(
        self, q: Array, v: Array, rough: ContactMode, time: float = 0.0, leaving: Sequence[int] = ()
    ) -> tuple[ContactMode, float]:
        """Mode that follows from the forces, and its margin to another one: inf, or 0 if it is not unique.

        Args:
            q: coordinates.
            v: velocities.
            rough: modes by the gaps and the slides: open, slip where a closed contact slides, stick where it does not.
            time: at which drives and targets are taken [s].
            leaving: contacts that static friction no longer holds.

        Raises:
            NotUnique: a disc lies flat, or capsules touch along a line.
        """
        state = self.at(q, v, time, features_of(rough))
        closed_mask = acting_ones(self.contacts, rough, state.free_slides)
        which = [k for k, shut in enumerate(closed_mask) if shut]
        self._refuse_flat(state, which, time)
        self._refuse_guided(state, which, time)
        if not which:
            return rough, np.inf
        frames = {k: frame_of_axis(state.touching[k].normal)[:, [2, 0, 1]] for k in which}
        J = np.concatenate([frames[k].T @ state.J[k] for k in which])
        c = J @ state.solution.acceleration + np.concatenate([frames[k].T @ state.bias[k] for k in which])
        sliding, ways = list[Array | None](), off_stops(self.contacts, closed_mask)
        for place, k in enumerate(which):
            touch = state.touching[k]
            if self.contacts[k].presses:
                c[3 * place] += touch.normal_rate @ touch.slide
            across = frames[k][:, 1:].T @ ways.get(k, rough[k].heading or touch.slide)
            sliding.append(None if rough[k].kind == "stick" and k not in ways else across / np.linalg.norm(across))
        G, names = J @ state.W @ J.T, [self.contacts[k].name for k in which]
        moved = state.free_slides.moved[which]
        across = np.array([[False, alone, alone] for alone in moved]).ravel()
        G[across], G[:, across] = 0.0, 0.0  # round-off, which would pass for a response
        c[across & np.repeat([slip is None for slip in sliding], 3)] = 0.0
        static = self._static.copy()
        static[list(leaving)] = self.friction[list(leaving)]
        force, done, same = robust_forces(
            G,
            c,
            self.friction[which],
            sliding,
            names,
            self._bounds[which],
            time,
            static=static[which],
            pressed_by=pressed_by(self.contacts, which),
        )
        mode, moves = [OPEN for _ in closed_mask], (c + G @ force.ravel()).reshape(-1, 3)
        for place, k in enumerate(which):
            part = slice(3 * place, 3 * place + 3)
            slides = sliding[place]
            if slides is None:  # friction acts against the slide, and one that carries nothing has none
                slides = -force[place, 1:] if force[place, 1:].any() else moves[place, 1:]
            by_force = line_response(self.contacts[k], frames[k] @ G[part, part] @ frames[k].T, state.touching)
            mode[k] = first_mode(done[place], frames[k], slides, frames[k].T @ by_force @ frames[k])
        return with_features(tuple(mode), features_of(rough)), np.inf if same else 0.0

    def struck(
        self,
        q: Array,
        v: Array,
        closed_contacts: Sequence[int],
        restitution: Array,
        time: float = 0.0,
        sideways: Array | None = None,
        features: Features | None = None,
        *,
        margin: bool = True,
    ) -> tuple[Array, Array, float]:
        """Velocities after an impact, by Newton's law of restitution and Coulomb's law with the slip after the impact.

        Args:
            q: coordinates.
            v: velocities before it.
            closed_contacts: contacts whose gaps are closed.
            restitution: of each of them.
            time: of the impact, for messages [s].
            sideways: tangential restitution of each of them; None: none has any.
            features: of solids that touch; None: the nearest.
            margin: False: it is not asked for, and inf, which takes half the time.

        Returns:
            The velocities, the impulses (contacts, 3), the margin to another outcome: inf, or 0 if it is not unique.

        Raises:
            NotUnique: several contacts press each other, so that their order counts; or one is along a line.
        """
        state = self.at(q, v, time, features)
        self._refuse_flat(state, closed_contacts, time)
        frames = [frame_of_axis(state.touching[k].normal)[:, [2, 0, 1]] for k in closed_contacts]
        J = np.concatenate([frame.T @ state.J[k] for frame, k in zip(frames, closed_contacts, strict=True)])
        sideways = np.zeros(len(closed_contacts)) if sideways is None else sideways
        c = returning(J @ v, restitution, sideways)
        G, names = J @ state.W @ J.T, [self.contacts[k].name for k in closed_contacts]
        numbers = list(closed_contacts)
        law, static = (self.friction[numbers], [None] * len(numbers), names, None, time), self._static[numbers]
        if margin:
            impulse, done, same = robust_forces(G, c, *law, _NO_IMPULSE, static)
        else:
            (impulse, done), same = contact_forces(G, c, *law, static=static), True
        speeds, scale = (J @ v)[::3], float(np.abs(J @ v).max())
        hit = (speeds < -TOUCHING * scale) | (impulse[:, 0] > TOUCHING * impulse[:, 0].max())
        lossy = np.array([bool(self.contacts[k].friction or self.contacts[k].restitution) for k in closed_contacts])
        if not self.mechanism.together and ordered(G, lossy, hit):
            groups = groups_of([self.contacts[k].pair for k in closed_contacts], J @ v, together=False)

            def strike(response: Array, slides: Array, group: list[int]) -> Array:
                of = np.array([numbers[k] for k in group])
                comes = returning(slides, restitution[group], sideways[group])
                told = [names[k] for k in group]
                near = _ROUND_OFF * scale / float(np.abs(comes).max())
                none = [None] * len(of)
                laws = self.friction[of], none, told, None, time, near, self._static[of]
                return contact_forces(response, comes, *laws)[0].ravel()

            outcomes = sequences(G, J @ v, groups, strike)
            jumps = state.W @ J.T
            told = [names[k] for k in np.flatnonzero(hit)]
            once, *turns = (
                left_by(J @ v + G @ impulses, TOUCHING * scale) for impulses in (impulse.ravel(), *outcomes.impulses)
            )
            alike = all(turn == once for turn in turns)
            refuse_spread(jumps @ outcomes.impulses.T, outcomes, told, time, jumps @ impulse.ravel(), alike=alike)
            same = True
        velocities = v + state.W @ J.T @ impulse.ravel()
        # The impulses are found to some digits; what holds fixes the velocities to the last one.
        held_rows = np.array([[way != "open", *[way == "stick"] * 2] for way in done]).ravel()
        velocities -= least_motion_for(state.W, J[held_rows], (J @ (velocities - v) + c)[held_rows])
        return velocities, impulse, np.inf if same else 0.0

    def _refuse_flat(self, state: ContactsNow, closed_contacts: Sequence[int], time: float) -> None:
        """Raises NotUnique if one of these contacts is along an edge or a line at a time [s]."""
        for k in closed_contacts:
            if state.touching[k].flat:
                raise lying(self.mechanism.contacts[k], time)

    def _refuse_guided(self, state: ContactsNow, closed_contacts: Sequence[int], time: float) -> None:
        """Raises NotUnique if joints keep one of these contacts with friction from opening at a time [s]."""
        for k in closed_contacts:
            if k < len(self._bodies) and self.friction[k]:
                normal, J = state.touching[k].normal @ state.J[k], state.J[k]
                if normal @ state.W @ normal <= NO_RESPONSE * np.trace(J @ state.loose @ J.T):
                    raise guided(self.mechanism.contacts[k].name, time)

    def sample(self, q: Array, v: Array, mode: ContactMode, time: float = 0.0) -> tuple[dict[str, Any], Array, Array]:
        """Fields of a record at one time [s], forces and moments of contacts between bodies, and sums of the forces.

        Forces [N], moments against turning [N m], normal forces [N] where that of components is not, (contacts, 7), and
        the :func:`contact_sums` [N] with the :func:`contact_moments` [N m], (sums, 3), are NaN if not determinate.
        """
        solution, count = self.solve(q, v, mode, time), len(self._bodies)
        joints = mode_of_joints(self.equations.switched, self.contacts, mode)

        def record(force: Array) -> dict[str, Any]:
            return self.equations.sample(q, v, joints, time, *self.loads(solution.state, force))

        fields, pressed = record(solution.force), solution.force[:count]
        for shift in np.moveaxis(solution.undetermined, 2, 0):  # what another distribution changes is not determinate
            others = record(solution.force + self._borne(solution.state, shift))
            for name in ("wrench", "named"):
                fields[name] = np.where(np.abs(others[name] - fields[name]) > RANK, np.nan, fields[name])
        motion, places = solution.state.solution.motion, np.array([touch.place for touch in solution.state.touching])
        bodies, m = turned_bodies(self.mechanism.contacts), self.mechanism
        turned = [(k, np.array(m.bodies[k].com)) for k in map(m.body_index.__getitem__, bodies)]
        centres = [motion.p_WB[k] + motion.R_WB[k] @ com for k, com in turned]

        def summed(forces: Array) -> Array:
            forces = forces[..., :count, :]
            return np.concatenate(
                [self._sums @ forces, contact_moments(m.contacts, centres, places[:count], forces)], axis=-2
            )

        moved = np.abs(summed(np.moveaxis(solution.undetermined, 2, 0))).max(axis=0, initial=0.0)
        sums = np.where(moved <= RANK, summed(pressed), np.nan)
        forces = np.where(solution.determinate, solution.force, np.nan)
        N = np.where(solution.determinate.all(axis=1), np.nan, solution.normal_forces)  # the whole force tells it
        moments = forces[count + len(self._of_joints) :]
        return fields, with_moments(forces[:count], self.turning, moments, N[:count]), sums

    def _borne(self, state: ContactsNow, shift: Array) -> Array:
        """Part of a change of all forces, (contacts, 3), that friction against turning can bear about its axes."""
        borne = shift.copy()
        for k, friction in enumerate(self.turning, len(self._bodies) + len(self._of_joints)):
            borne[k] = friction.resisted(state.touching[friction.pressed_by].normal, shift[k][:, None])[:, 0]
        return borne

    def loads(self, state: ContactsNow, force: Array) -> tuple[Array, Array]:
        """Loads by contacts of bodies: along the velocities, and about the world's origin, (bodies + 1, 6)."""
        count = len(self._bodies)
        of_bodies = [k for k, contact in enumerate(self.contacts) if not isinstance(contact, JointContact)]
        load = np.einsum("kin,ki->n", state.J[of_bodies], force[of_bodies])
        applied = np.zeros((len(self.mechanism.bodies) + 1, 6))
        for (a, b), touch, push in zip(self._bodies, state.touching, force[:count], strict=False):
            wrench = np.concatenate([push, cross(touch.place, push)])
            applied[a] += wrench
            applied[b] -= wrench
        for k, friction in enumerate(self.turning, count + len(self._of_joints)):
            a, b = self._bodies[friction.pressed_by]
            applied[a, 3:] += force[k]
            applied[b, 3:] -= force[k]
        return load, applied
