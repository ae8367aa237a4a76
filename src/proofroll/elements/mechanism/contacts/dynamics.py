"""Equations of motion of a mechanism whose bodies touch, in the coordinates of its tree.

Between events each contact is ``open``, ``slip``s (one row, friction against the slip), or ``stick``s (three rows).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.elements.mechanism.analysis import RANK
from proofroll.elements.mechanism.contacts.acting import (
    OPEN,
    Acting,
    ContactMode,
    first_mode,
    heading_of,
    held_directions,
    turned,
)
from proofroll.elements.mechanism.contacts.coulomb import contact_forces, least_motion_for, robust_forces
from proofroll.elements.mechanism.contacts.geometry import BodyContact, pair_sums
from proofroll.elements.mechanism.contacts.joint_laws import (
    JointContact,
    joint_contacts,
    mode_of_joints,
    refuse_rubbing_stops,
)
from proofroll.elements.mechanism.contacts.sequences import groups_of, ordered, refuse_spread, sequences
from proofroll.elements.mechanism.contacts.start import STILL, closed_and_still, natural_scale, touches
from proofroll.elements.mechanism.contacts.touching import Touching, lying
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates, Solution
from proofroll.elements.mechanism.kinematics import BodyMotion
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.named_forces import named_forces
from proofroll.elements.mechanism.rotations import Array, cross, frame_of_axis, skew

# Impulse, relative to the largest of an impact, that counts as none; a pressure nudged by 1e-6 makes such impulses.
_NO_IMPULSE = 1e-4
_ROUND_OFF = 1e-13  # of slides in a sequence of impacts, relative to the largest


@dataclass(frozen=True)
class ContactsNow:
    """Kinematics and free accelerations of the contacts at one state, independent of the mode.

    Attributes:
        solution: of the mechanism without forces of contact.
        W: accelerations caused by unit forces along the velocities, (nv, nv).
        touching: geometry and rates of each contact.
        J: derivative of each slide by the velocities, (contacts, 3, nv).
        bias: rate of each slide where v̇ = 0, (contacts, 3).
    """

    solution: Solution
    W: Array
    touching: tuple[Touching, ...]
    J: Array
    bias: Array


@dataclass(frozen=True)
class ContactSolution:
    """Accelerations and forces in a mode.

    Attributes:
        state: state of the contacts that they belong to.
        mode: the mode, with lines of contacts as they lie now.
        acceleration: v̇, (nv).
        force: on body a of each contact [N], (contacts, 3); the smallest where they are not determinate.
        determinate: True for each determinate component of ``force``, (contacts, 3).
        determinate_sums: the same of the sum of forces of each pair with several contacts, (such pairs, 3).
        slide_rate: rate of each slide [m/s²], (contacts, 3).
        response: Painlevé's measure, above 0 in a possible motion: response to normal forces with friction over the
            response without.
        splits: ways to split a load that contacts share: changes of the normal forces, (contacts, ways).
        spread: change of v̇ with these, the whole of unit length.
    """

    state: ContactsNow
    mode: ContactMode
    acceleration: Array
    force: Array
    determinate: Any
    determinate_sums: Any
    slide_rate: Array
    response: float
    splits: Array
    spread: float

    def lasts(self, mode: ContactMode) -> float:
        """Time until an open contact closes at constant acceleration [s]; infinite: never."""
        times = [np.inf]
        for own, touch, rate in zip(mode, self.state.touching, self.slide_rate, strict=True):
            if own.kind == "open":
                opening = touch.normal @ rate + touch.normal_rate @ touch.slide
                roots = np.roots([opening / 2, touch.normal @ touch.slide, touch.gap])
                times += [root.real for root in roots if root.imag == 0 < root.real]
        return min(times)


class ContactDynamics:
    """A mechanism in the coordinates of its tree with its contacts: those between bodies, then laws of joints."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.equations = mechanism, JointCoordinates(mechanism)
        self._of_joints = joint_contacts(self.equations.switched)
        self.contacts: tuple[BodyContact | JointContact, ...] = (*mechanism.contacts, *self._of_joints)
        self.friction = np.array([contact.friction for contact in self.contacts])
        self._bounds = np.array([contact.bound for contact in self.contacts])
        self.sums = np.pad(pair_sums(mechanism.contacts), ((0, 0), (0, len(self._of_joints))))
        index = mechanism.body_index
        self._bodies = [(index[contact.body_a], index[contact.body_b]) for contact in mechanism.contacts]

    def at(self, q: Array, v: Array, time: float = 0.0) -> ContactsNow:
        """Kinematics and free accelerations for coordinates (nq) and velocities (nv) at a time [s]."""
        found = self.equations.solve(q, v, (), time=time)
        W: Array = np.asarray(np.linalg.inv(self.equations.inertial(found.motion)[1]), dtype=np.float64)
        if found.split is not None:
            W = W - found.split[0] @ found.split[0].T
        touching = touches(self.mechanism, found.motion)
        parts = [self._row(found.motion, k, each) for k, each in enumerate(touching)]
        for contact in self._of_joints:
            at = contact.joint.velocity
            touching += (contact.touching(float(q[contact.joint.coordinate]), float(v[at])),)
            parts.append((np.outer(contact.direction, np.eye(len(v))[at]), np.zeros(3)))
        J, bias = (np.array(part) for part in zip(*parts, strict=True))
        return ContactsNow(found, W, touching, J, bias)

    def _row(self, motion: BodyMotion, k: int, found: Touching) -> tuple[Array, Array]:
        """Derivative of a contact's slide by the velocities, (3, nv), and rate of the slide at v̇ = 0, (3,)."""
        J, bias = np.zeros((3, motion.J.shape[2])), np.zeros(3)
        for body, sign in zip(self._bodies[k], (1.0, -1.0), strict=True):
            arm, w = found.place - motion.p_WB[body], motion.w_WB[body]
            J += sign * (motion.J[body, :3] - skew(arm) @ motion.J[body, 3:])
            turning = motion.bias[body, :3] + cross(motion.bias[body, 3:], arm)
            # the point of contact moves over the body, to places with other velocities
            bias += sign * (turning + cross(w, found.place_rate - motion.v_WB[body]))
        return J, bias

    def solve(self, q: Array, v: Array, mode: ContactMode, time: float = 0.0) -> ContactSolution:
        """Accelerations and forces while each contact keeps the given mode, at a time [s].

        Raises:
            Diverged: a velocity moves nothing with inertia in this pose.
        """
        return self.solved(self.at(q, v, time), mode)

    def solved(self, state: ContactsNow, mode: ContactMode) -> ContactSolution:
        """Accelerations and forces at a state while each contact keeps the given mode; see :meth:`solve`."""
        mode = tuple(
            turned(own, found, J @ state.W @ J.T) if own.along else own
            for own, found, J in zip(mode, state.touching, state.J, strict=True)
        )
        rows, bias, along, owner = [np.zeros((0, state.W.shape[0]))], [np.zeros(0)], list[Array](), list[int]()
        force, known = np.zeros((len(mode), 3)), np.ones((len(mode), 3), dtype=bool)
        for k, (own, found) in enumerate(zip(mode, state.touching, strict=True)):
            directions = held_directions(own, found, presses=not self._bounds[k])
            rows.append(directions @ state.J[k])
            bias.append(directions @ state.bias[k])
            owner += [k] * len(directions)
            if own.kind == "slip":
                bias[-1] = bias[-1] + found.normal_rate @ found.slide
                heading = self.heading(own, found) if self.friction[k] or self._bounds[k] else np.zeros(3)
                force[k] = -self._bounds[k] * heading
                directions = directions - self.friction[k] * heading
            along += list(directions)
        K, free = np.concatenate(rows), state.solution.acceleration
        free = free + state.W @ np.einsum("kin,ki->n", state.J, force)
        if not owner:
            summed = np.ones((len(self.sums), 3), dtype=bool)
            return self._solution(state, mode, free, force, known, summed, 1.0, np.zeros((len(mode), 0)), 0.0)
        D = np.array([direction @ state.J[k] for direction, k in zip(along, owner, strict=True)])
        S, wanted = K @ state.W @ D.T, -(K @ free + np.concatenate(bias))
        smooth = K @ state.W @ K.T
        values, vectors = np.linalg.eigh(smooth)
        weak = values < RANK * values[-1]
        z = np.linalg.lstsq(S, wanted, rcond=RANK)[0] if weak.any() else np.linalg.solve(S, wanted)
        ways = np.linalg.svd(S)[2][len(S) - weak.sum() :].T if weak.any() else np.zeros((len(S), 0))
        splits, shifts = np.zeros((len(mode), ways.shape[1])), np.zeros((len(mode), 3, ways.shape[1]))
        for k, direction, size, loose in zip(owner, along, z, ways, strict=True):
            force[k] += size * direction
            shifts[k] += np.outer(direction, loose)
            splits[k] += float(direction @ state.touching[k].normal) * loose
            known[k] &= np.abs(direction) * np.linalg.norm(loose) <= RANK
        summed = np.linalg.norm(np.einsum("pk,kiw->piw", self.sums, shifts), axis=2) <= RANK
        for k, (own, found) in enumerate(zip(mode, state.touching, strict=True)):
            if own.kind == "stick" and own.along is not None:  # across its line the joints hold it, too
                alone = np.abs(cross(found.normal, np.array(own.along))) <= RANK
                known[k] &= alone
                summed[self.sums[:, k] > 0] &= alone
        whole = vectors[:, ~weak]  # without what the split of a shared load changes
        response = float(np.linalg.det(whole.T @ S @ whole) / np.linalg.det(whole.T @ smooth @ whole))
        spread = float(np.linalg.norm(state.W @ (D.T @ ways)))
        return self._solution(state, mode, free + state.W @ D.T @ z, force, known, summed, response, splits, spread)

    @staticmethod
    def heading(own: Acting, found: Touching) -> Array:
        """Unit direction in which a contact slips; its friction acts against it."""
        return heading_of(own, found)

    @staticmethod
    def _solution(
        state: ContactsNow,
        mode: ContactMode,
        acceleration: Array,
        force: Array,
        known: Any,
        summed: Any,
        response: float,
        splits: Array,
        spread: float,
    ) -> ContactSolution:
        slide_rate = state.J @ acceleration + state.bias
        return ContactSolution(state, mode, acceleration, force, known, summed, slide_rate, response, splits, spread)

    def rate(self, y: Array, mode: ContactMode) -> Array:
        """Right-hand side for the state (q, v, time)."""
        q, v, time = self.parts(y)
        return np.concatenate([self.equations.tree.rate(q, v), self.solve(q, v, mode, time).acceleration, [1.0]])

    def parts(self, y: Array) -> tuple[Array, Array, float]:
        """Coordinates, velocities and time [s] of a state."""
        nq = self.mechanism.nq
        return y[:nq], y[nq:-1], float(y[-1])

    def excess(self, y: Array) -> Array:
        """Relative excess of wanted efforts over their limits, (limited actuators,); below 0 within the limit."""
        q, v, time = self.parts(y)
        return np.array(
            [abs(m.wanted(time, q[at_q], v[at_v])) / m.bound - 1 for m, at_q, at_v in self.equations.limited]
        )

    def pushes(self, y: Array) -> Array:
        """Sign of each effort with a limit, (limited actuators,)."""
        q, v, time = self.parts(y)
        return np.array([np.sign(m.wanted(time, q[at_q], v[at_v])) for m, at_q, at_v in self.equations.limited])

    def eliminated(self, y: Array, mode: ContactMode) -> Array:
        """The state with violations of loops, closed contacts and unit quaternions removed."""
        y = np.append(self.equations.eliminated(y[:-1], ()), y[-1])
        q, v, time = self.parts(y)
        closed = [k for k, own in enumerate(mode) if own.kind != "open"]
        if not closed:
            return y
        state = self.at(q, v)
        normals = np.array([state.touching[k].normal @ state.J[k] for k in closed])
        gaps = np.array([state.touching[k].gap for k in closed])
        q = self.equations.tree.moved(q, -least_motion_for(state.W, normals, gaps))
        state = self.at(q, v)
        return np.concatenate([q, v - self._brought(state, v, mode), [time]])

    def _brought(self, state: ContactsNow, v: Array, mode: ContactMode) -> Array:
        """Velocities that closed contacts forbid, (nv): the part of v that violates their rows."""
        rows = [np.zeros((0, len(v)))]
        for k, own in enumerate(mode):
            if own.kind == "stick":
                rows.append(state.J[k])
            elif own.kind == "slip":
                rows.append(state.touching[k].normal[None] @ state.J[k])
        K = np.concatenate(rows)
        return least_motion_for(state.W, K, K @ v)

    def begin(self) -> tuple[ContactMode, float]:
        """Mode at the start, and its margin to another one: inf, or 0 if it is not unique.

        Raises:
            Refused: a joint with dry friction starts on a stop.
        """
        q, v = self.mechanism.start()
        scale = natural_scale(self.mechanism)
        turns = [isinstance(c, JointContact) and self.mechanism.joints[c.joint.number].kind != "prismatic"
                 for c in self.contacts]  # fmt: skip
        lengths = np.where(turns, 1.0, scale.length)
        closed, still = closed_and_still(self.at(q, v).touching, lengths, scale.rate)
        refuse_rubbing_stops(self.contacts, closed, 0.0)
        return self.decided(q, v, closed, still)

    def decided(
        self, q: Array, v: Array, closed: Sequence[bool], still: Sequence[bool], time: float = 0.0
    ) -> tuple[ContactMode, float]:
        """Mode that follows from the forces, and its margin to another one: inf, or 0 if it is not unique.

        Args:
            q: coordinates.
            v: velocities.
            closed: True for contacts whose gap is closed and does not open by its speed.
            still: True for those of them that do not slide either.
            time: at which drives and targets are taken [s].

        Raises:
            NotUnique: a disc lies flat.
        """
        state = self.at(q, v, time)
        which = [k for k, shut in enumerate(closed) if shut]
        self._refuse_flat(state, which, time)
        if not which:
            return tuple(OPEN for _ in closed), np.inf
        frames = {k: frame_of_axis(state.touching[k].normal)[:, [2, 0, 1]] for k in which}
        J = np.concatenate([frames[k].T @ state.J[k] for k in which])
        c = J @ state.solution.acceleration + np.concatenate([frames[k].T @ state.bias[k] for k in which])
        sliding: list[Array | None] = []
        for place, k in enumerate(which):
            found = state.touching[k]
            c[3 * place] += found.normal_rate @ found.slide
            across = frames[k][:, 1:].T @ found.slide
            sliding.append(None if still[k] else across / np.linalg.norm(across))
        G, names = J @ state.W @ J.T, [self.contacts[k].name for k in which]
        force, done, same = robust_forces(G, c, self.friction[which], sliding, names, self._bounds[which], time)
        mode, moves = [OPEN for _ in closed], (c + G @ force.ravel()).reshape(-1, 3)
        for place, k in enumerate(which):
            own = slice(3 * place, 3 * place + 3)
            slides = sliding[place]
            if slides is None:  # friction acts against the slide, and one that carries nothing has none
                slides = -force[place, 1:] if force[place, 1:].any() else moves[place, 1:]
            mode[k] = first_mode(done[place], frames[k], slides, G[own, own])
        return tuple(mode), np.inf if same else 0.0

    def struck(
        self, q: Array, v: Array, closed: Sequence[int], restitution: Array, time: float = 0.0
    ) -> tuple[Array, Array, float]:
        """Velocities after an impact, by Newton's law of restitution and Coulomb's law with the slip after the impact.

        Args:
            q: coordinates.
            v: velocities before it.
            closed: contacts whose gaps are closed.
            restitution: of each of them.
            time: of the impact, for messages [s].

        Returns:
            The velocities, the impulses (closed, 3), and the margin to another outcome: inf, or 0 if it is not unique.

        Raises:
            NotUnique: several contacts press each other, so that the outcome depends on an order; or a disc lies flat.
        """
        state = self.at(q, v)
        self._refuse_flat(state, closed, time)
        frames = [frame_of_axis(state.touching[k].normal)[:, [2, 0, 1]] for k in closed]
        J = np.concatenate([frame.T @ state.J[k] for frame, k in zip(frames, closed, strict=True)])
        c = J @ v
        c[::3] += restitution * np.minimum(c[::3], 0.0)
        G, names = J @ state.W @ J.T, [self.contacts[k].name for k in closed]
        sliding = [None] * len(closed)
        impulse, done, same = robust_forces(
            G, c, self.friction[list(closed)], sliding, names, time=time, least=_NO_IMPULSE
        )
        speeds, scale = (J @ v)[::3], float(np.abs(J @ v).max())
        hit = (speeds < -STILL * scale) | (impulse[:, 0] > STILL * impulse[:, 0].max())
        lossy = np.array([bool(self.contacts[k].friction or self.contacts[k].restitution) for k in closed])
        if not self.mechanism.together and ordered(G, lossy, hit):
            groups = groups_of([self.contacts[k].pair for k in closed], J @ v, together=False)

            def strike(response: Array, slides: Array, group: list[int]) -> Array:
                of = np.array([closed[k] for k in group])
                comes = slides.copy()
                comes[::3] += restitution[group] * np.minimum(comes[::3], 0.0)
                told = [names[k] for k in group]
                near = _ROUND_OFF * scale / float(np.abs(comes).max())
                none = [None] * len(of)
                return contact_forces(response, comes, self.friction[of], none, told, None, time, near)[0].ravel()

            outcomes = sequences(G, J @ v, groups, strike)
            jumps = state.W @ J.T @ np.vstack([impulse.ravel(), outcomes.impulses]).T
            refuse_spread(jumps, outcomes, [names[k] for k in np.flatnonzero(hit)], time)
            same = True
        after = v + state.W @ J.T @ impulse.ravel()
        # The impulses are found to some digits; what holds fixes the velocities to the last one.
        held = np.array([[way != "open", *[way == "stick"] * 2] for way in done]).ravel()
        after -= least_motion_for(state.W, J[held], (J @ (after - v) + c)[held])
        return after, impulse, np.inf if same else 0.0

    def _refuse_flat(self, state: ContactsNow, closed: Sequence[int], time: float) -> None:
        """Raises NotUnique if one of these contacts is of a disc that lies flat at a time [s]."""
        for k in closed:
            if state.touching[k].flat:
                raise lying(self.contacts[k].name, time)

    def sample(self, q: Array, v: Array, mode: ContactMode, time: float = 0.0) -> tuple[dict[str, Any], Array, Array]:
        """Fields of a record at one time [s], contact forces between bodies, and sums of pairs with several contacts.

        Forces [N], (contacts, 3), and sums [N], (such pairs, 3), are NaN where they are not determinate.
        """
        found, count = self.solve(q, v, mode, time), len(self._bodies)
        pressed = found.force[:count]
        load = np.einsum("kin,ki->n", found.state.J[:count], pressed)
        applied = np.zeros((len(self.mechanism.bodies) + 1, 6))
        for (a, b), each, force in zip(self._bodies, found.state.touching, pressed, strict=False):
            wrench = np.concatenate([force, cross(each.place, force)])
            applied[a] += wrench
            applied[b] -= wrench
        joints = mode_of_joints(self.equations.switched, self.contacts, mode)
        record = self.equations.sample(q, v, joints, time, load, applied)
        loose = {c.joint.number for c, own in zip(self._of_joints, found.determinate[count:], strict=True)
                 if not own[c.direction != 0].all()}  # fmt: skip
        named = [item.field in {"friction", "stop"} and item.number in loose for item in named_forces(self.mechanism)]
        record["named"] = np.where(named, np.nan, record["named"])
        sums = np.where(found.determinate_sums, self.sums[:, :count] @ pressed, np.nan)
        return record, np.where(found.determinate[:count], pressed, np.nan), sums
