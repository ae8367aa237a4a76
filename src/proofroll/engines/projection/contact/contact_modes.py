"""Contacts of bodies, and laws of joints beside them: open, slipping or sticking, ends of these modes, transitions.

Contact forces act along the velocities ν of the tree, whose mass matrix the projection provides. Between two
transitions the equations are smooth; a transition is located within a step by shorter steps of the same method. The
next mode follows from Coulomb's law at all contacts at once, by the same solver as in the truth's first route: so equal
decisions confirm nothing, but equal motions between them do.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.dop853 import Accept
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import EventKind
from proofroll.core.integrators import Integrator
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.coulomb import contact_forces
from proofroll.elements.mechanism.contact.joint_laws import JointContact, line_response, refuse_rubbing_stops
from proofroll.elements.mechanism.contact.modes import (
    FAINT,
    OPEN,
    ContactMode,
    changes,
    first_mode,
    held_directions,
    slip_velocity,
)
from proofroll.elements.mechanism.contact.rolling_and_spin import (
    opposed_rates,
    pressed_by,
    require_moving,
    shut_by_pressing,
)
from proofroll.elements.mechanism.contact.start import closed_and_still, natural_scale, start_digits
from proofroll.elements.mechanism.contact.touching import Touching, torn
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.signal import breaks, varies
from proofroll.engines.projection.contact.alternating import AlternatingMotion, Excess, ends_of_efforts
from proofroll.engines.projection.contact.contact_geometry import ContactGeometry
from proofroll.engines.projection.contact.contacts_there import (
    ContactsThere,
    landing_together,
    leaving,
    refuse_lying,
    system_of,
)
from proofroll.engines.projection.contact.recorded_modes import RANK, InMode, RecordedMode, recordable
from proofroll.engines.projection.contact.slip_directions import SlipDirections, balanced, led_direction
from proofroll.engines.projection.smooth.dependent import DependentCoordinates, SolvedState
from proofroll.engines.projection.smooth.elimination import Space
from proofroll.engines.projection.smooth.elimination import solved as divided

_OVERLAP = 1e-14  # overlap that is round-off, relative to the natural length
_STANDS = 1e-6  # acceleration, relative to the natural one, too small to start a motion
_WORTH = 50  # evaluations in a mode after which its equations are recorded, which takes as long as they do
_NOWHERE: Any = None, None  # last state and motion where there are none
_REST = 1e-2  # slip speed, relative to gravity times a fixed step, below which slips end together with another one


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
        tolerance: float,
    ) -> None:
        """Takes the size of a fixed ``step`` [s], or 0 and the relative ``tolerance`` of steps that adapt."""
        super().__init__(equations, stepper, accept, breaks(mechanism.signals))
        self._geometry = geometry = ContactGeometry(equations, mechanism)
        self._bodies, self._joints, self._turning = geometry.bodies, geometry.joints, geometry.turning
        self.contacts, self.friction = geometry.contacts, geometry.friction
        self._static = np.array([contact.static for contact in self.contacts])
        self._bounds = np.array([contact.bound for contact in self.contacts])
        self._presses = [contact.presses for contact in self.contacts]
        self._rubs = self.friction + self._bounds > 0
        scale = natural_scale(mechanism)
        self._unit = math.prod(scale)  # natural speed
        self._still, self._rate, self._length = FAINT * self._unit, scale.rate, scale.length
        # overlap of each contact when it opened, an error of the method: it is no impact
        self._overlap = np.zeros(len(self.contacts))
        slides = [mechanism.joints[switch.joint.number].kind == JointKind.PRISMATIC for switch in self._joints]
        slides = [True] * len(self._bodies) + slides + [False] * len(self._turning)
        # length of each contact's motion by 1 m, or by 1 rad
        self._arms = np.array([1.0 if slide else scale.length for slide in slides])
        slow = math.sqrt(tolerance) * self._unit
        self._slipping = SlipDirections(step, self._still / self._arms, slow / self._arms, tolerance**0.25)
        self._timed = any(map(varies, mechanism.signals))
        self._faint = max(self._still, _REST * step * float(np.linalg.norm(mechanism.gravity)))
        self._limited = {k: item for k, item in enumerate(mechanism.actuators) if item.limit is not None}
        self._mechanism, self._recordable = mechanism, recordable(mechanism, equations)
        self._last, self._kinds = _NOWHERE, tuple[str, ...]()
        self._recorded, self._uses = dict[tuple[str, ...], RecordedMode](), dict[tuple[str, ...], int]()
        start = np.append(equations.start, 0.0)
        self._limit_efforts(start)
        instant = self.at(start)
        closed_mask, resting = closed_and_still(
            instant.touching, scale.length / self._arms, scale.rate, start_digits(self.contacts)
        )
        refuse_rubbing_stops(self.contacts, closed_mask, 0.0)
        refuse_lying(self._bodies, instant.touching, closed_mask, 0.0)
        self.mode = tuple(OPEN for _ in self.contacts)
        self._enter(0.0, start, self._decided(instant, closed_mask, resting))

    def _limit_efforts(self, y: Array) -> None:
        """Sets the mode of each effort with a limit: linear, or clamped if the state requires more."""
        pairs = zip(self._limited.items(), self._equations.wanted(self._at(y)), strict=True)
        self._equations.applied.modes = {k: actuator.mode_of(effort) for (k, actuator), effort in pairs}

    def at(self, y: Array) -> ContactsThere:
        """Contacts at a state, with their response to forces."""
        equations, spaces, x = self._equations, list[Space](), self._at(y)

        def closing(space: Space, _: Array, push: Array) -> tuple[Array, Array]:
            spaces.append(space)
            return divided(space.H, push[:, None])[:, 0], np.zeros(0)

        free = equations.solve(x, 0.0, None if equations.coupled else closing)
        spaces = spaces or [equations.tree.space(free.bodies)]
        touching, J, rate = self._geometry.at(x, free, spaces[0].S.reshape(-1, 4, 4))
        flat = J.reshape(-1, J.shape[2]).T
        if equations.coupled:
            assert equations.split is not None  # of the last solution
            response = equations.split(flat, np.zeros((equations.coupled, flat.shape[1])))[0]
        else:
            response = divided(spaces[0].H, flat)
        response = response.reshape(-1, *J.shape[:2])
        return ContactsThere(touching=touching, J=J, response=response, rate=rate, free=free)

    def _rows(self, instant: ContactsThere, mode: ContactMode) -> list[tuple[int, Array]]:
        """Directions in which closed contacts are constrained, with their contact."""
        return [
            (k, direction)
            for k, (acting, touching) in enumerate(zip(mode, instant.touching, strict=True))
            for direction in held_directions(acting, touching, presses=self._presses[k])
        ]

    def forces(self, instant: ContactsThere, mode: ContactMode) -> Array:
        """Forces on body a of each contact in a mode [N], (contacts, 3); of friction against turning moments [N m].

        Raises:
            Diverged: friction makes a normal force negative (Painlevé).
        """
        headings = self._headings(instant, mode)
        led = [k for k in headings if self._rubs[k] and self._slipping.led(k)]
        if len(led) == 1:
            (k,) = led
            rate = self._slide_rates(instant, mode, headings, k)
            headings[k] = led_direction(headings[k], instant.touching[k].normal, rate)
        return self._forces_against(instant, mode, headings)

    def _headings(self, instant: ContactsThere, mode: ContactMode) -> dict[int, Array]:
        """Direction of each slip."""
        pairs = enumerate(zip(mode, instant.touching, strict=True))
        return {k: self._slipping.heading(k, touch) for k, (acting, touch) in pairs if acting.kind == "slip"}

    def _slide_rates(
        self, instant: ContactsThere, mode: ContactMode, headings: Mapping[int, Array], k: int
    ) -> Callable[[Array], Array]:
        """Rate of the slide of a contact by the direction that its friction acts against."""

        def rate(heading: Array) -> Array:
            rates = instant.slide_rate(self._forces_against(instant, mode, {**headings, k: heading}))
            return np.asarray(opposed_rates(self.contacts, instant.touching, rates)[k])

        return rate

    def _forces_against(self, instant: ContactsThere, mode: ContactMode, headings: Mapping[int, Array]) -> Array:
        """Forces as of :meth:`forces`, where friction of slips acts against given directions."""
        rows, force = self._rows(instant, mode), np.zeros((len(mode), 3))
        for k, heading in headings.items():
            if not self._presses[k]:
                force[k] = -self._bounds[k] * heading
        if not rows:
            return force
        system = system_of(instant, self.contacts, self.friction, headings, rows, instant.slide_rate(force))
        for (k, _), response in zip(rows, system.matrix.diagonal(), strict=True):
            if k in headings and response <= 0:
                raise Diverged(str(torn(self.contacts[k].name, self.t)))
        sizes = np.linalg.lstsq(system.matrix, system.targets, rcond=RANK)[0]
        return np.asarray(force + np.einsum("r,rki->ki", sizes, system.pushes))

    def _settled(self, y: Array, mode: ContactMode) -> Array:
        """State without velocities that violate closed contacts."""
        instant = self.at(y)
        rows = self._rows(instant, mode)
        if not rows:
            return y
        K = np.array([row @ instant.J[k] for k, row in rows])
        D = np.array([instant.response[:, k] @ row for k, row in rows])
        left = np.array([row @ instant.touching[k].slide for k, row in rows])
        return self._pushed(y, -D.T @ np.linalg.lstsq(K @ D.T, left, rcond=RANK)[0])

    def _pushed(self, y: Array, change: Array) -> Array:
        """State after a change of the velocities ν."""
        return np.append(self._equations.pushed(y[:-1], change), y[-1])

    def solve(self) -> tuple[SolvedState, Array, tuple[Touching, ...]]:
        """Equations of motion solved now, contact forces [N], (contacts, 3), and geometry of the contacts."""
        instant = self.at(self._stepper.x)
        force = self.forces(instant, self.mode)
        return self._equations.solve(self.x, np.einsum("kin,ki->n", instant.J, force)), force, instant.touching

    def sampled(self, joints: int) -> dict[str, Array]:
        """Contact forces [N], (contacts, 3); forces of dry friction and stops along the coordinates of all joints."""
        force, forces = self._in_mode(self._stepper.x).force, np.full((2, joints), np.nan)
        for contact in self._joints:
            forces[:, contact.joint.number] = 0.0
        along_joints = force[len(self._bodies) : len(force) - len(self._turning)]
        for contact, push in zip(self._joints, along_joints, strict=True):
            forces[int(contact.side != 0), contact.joint.number] += contact.direction @ push
        return {"contact_force": force[: len(self._bodies)], "friction": forces[0], "stop": forces[1]}

    def read(self) -> dict[str, Any]:
        """Geometry and laws of the contacts now, for :class:`.MechanismBuilt`."""
        instant = self.at(self._stepper.x)
        count = len(self._bodies)
        touching = instant.touching[:count]
        return {
            "contact_gap": np.array([contact.gap for contact in touching]),
            "contact_normal": np.array([contact.normal for contact in touching]),
            "contact_place": np.array([contact.place for contact in touching]),
            **coefficients_of(self._bodies),
            "contact_response": np.einsum("kin,nlj->kilj", instant.J[:count], instant.response[:, :count]),
        }

    def _rates(self, y: Array) -> Array:
        return self._in_mode(y).rates

    def _in_mode(self, y: Array) -> InMode:
        """Motion in the present mode, by its program if it is worth one; that of the last state is kept."""
        if y is self._last[0]:
            known: InMode = self._last[1]
            return known
        program = self._recorded.get(self._kinds)
        if program is None and self._kinds:
            self._uses[self._kinds] = self._uses.get(self._kinds, 0) + 1
            if self._uses[self._kinds] == _WORTH:
                self._recorded[self._kinds] = RecordedMode(self._mechanism, self.mode)
        motion = (program and program.at(y, self._slipping)) or self._in_numpy(y)
        self._last = y, motion
        return motion

    def _in_numpy(self, y: Array) -> InMode:
        instant = self.at(y)
        force = self.forces(instant, self.mode)
        rates = np.append(self._pushed_rates(y, instant, force), 1.0)
        return InMode(rates=rates, touching=instant.touching, force=force)

    def _pushed_rates(self, y: Array, instant: ContactsThere, force: Array) -> Array:
        """Time derivative of x with contact forces."""
        return self._equations.pushed_rates(y[:-1], instant.free, np.einsum("nki,ki->n", instant.response, force))

    def _look(self, y: Array) -> None:
        """Stores the directions of slips, to detect reversals."""
        x = y[:-1]
        if self._kinds in self._recorded:
            touching = self._in_mode(y).touching
        else:
            touching = self._geometry.touching(x, self._geometry.moving(x, self._equations.bodies(x)))

        def leading(k: int) -> Array:
            instant = self.at(y)
            headings = self._headings(instant, self.mode)
            rate = self._slide_rates(instant, self.mode, headings, k)
            gentle = self._rubs[k] and balanced(rate(headings[k]), rate(-headings[k]))
            return led_direction(headings[k], instant.touching[k].normal, rate) if gentle else np.zeros(3)

        self._slipping.look(float(y[-1]), self.mode, touching, leading)
        if any(acting.kind == "slip" for acting in self.mode):
            self._last = _NOWHERE  # their directions are others now

    def _enter(self, t: float, x: Array, mode: ContactMode) -> None:
        opened = [k for k, acting in enumerate(mode) if acting.kind == "open" and self.mode[k].kind != "open"]
        if opened:
            gaps = np.array([touching.gap for touching in self.at(x).touching])
            self._overlap[opened] = np.maximum(-gaps[opened], 0.0) + _OVERLAP * self._length
        x, self.mode, self._last = self._settled(x, mode), mode, _NOWHERE
        plain = self._recordable and all(acting.along is None for acting in mode)
        self._kinds = tuple(acting.kind for acting in mode) if plain else ()
        self._slipping.begin(mode)
        self._look(x)
        super()._enter(t, x, mode)

    def _excess(self, x: Array) -> list[Excess]:
        (_, touching, force), ends = self._in_mode(x), list[Excess]()
        decided_mode: ContactMode = ()
        stops = [isinstance(item, JointContact) and item.presses for item in self.contacts]
        shared = sum(
            acting.kind == "stick" or (acting.kind == "slip" and s) for acting, s in zip(self.mode, stops, strict=True)
        )
        for k, (acting, item) in enumerate(zip(self.mode, touching, strict=True)):
            by = self.contacts[k].pressed_by
            if acting.kind == "open":
                if by is None:
                    size = -item.gap - self._overlap[k]
                    ends.append(Excess(k, EventKind.IMPACT, size, -float(item.normal @ item.slide)))
                continue
            N = float((item if by is None else touching[by]).normal @ force[k if by is None else by])
            if self._presses[k]:
                ends.append(Excess(k, EventKind.LIFT_OFF, -N))
            if acting.kind == "slip" and self._rubs[k]:
                ends.append(Excess(k, "still", self._slipping.passed(k, item)))
            elif acting.kind == "stick" and np.isfinite(self._static[k]):  # what never slips opens, and does not slip
                bound = float(self._bounds[k] or self._static[k] * N)
                beyond = float(np.linalg.norm(force[k] - item.normal * (item.normal @ force[k]))) - bound
                if beyond > 0 and shared > 1:
                    # forces shared by several contacts are not unique: others may hold what this one cannot
                    decided_mode = decided_mode or self._decided(
                        self.at(x),
                        [part.kind != "open" for part in self.mode],
                        [part.kind == "stick" for part in self.mode],
                    )
                    beyond = -beyond if decided_mode[k].kind == "stick" else beyond
                ends.append(Excess(k, EventKind.SLIP, beyond))
        if not self._limited:
            return ends
        modes, efforts = list(self._equations.applied.modes.values()), self._equations.wanted(self._at(x))
        return ends + ends_of_efforts(self._limited.values(), modes, efforts, len(self.mode))

    def _next(self, x: Array, k: int, kind: str) -> tuple[Array, ContactMode, list[tuple[str, str]]]:
        old_mode, happened = self.mode, list[tuple[str, str]]()
        if k >= len(old_mode):
            number = list(self._limited)[k - len(old_mode)]
            self._equations.applied.modes = {**self._equations.applied.modes, number: kind}
            return x, old_mode, happened
        if kind == EventKind.LIFT_OFF:
            x = self._settled(x, old_mode)  # a closing speed that the method left would hit at once
        instant, closed_mask = self.at(x), [acting.kind != "open" for acting in old_mode]
        resting = [acting.kind == "stick" for acting in old_mode]
        if kind == EventKind.IMPACT:
            hits = landing_together(k, self._bodies, instant, old_mode, self._overlap, self._length, self.t)
            x, closed_mask, settles = self._struck(x, instant, hits)
            self._limit_efforts(x)  # the effort that a servo requires jumps with the velocity
            happened = [(EventKind.SETTLE if settles else EventKind.IMPACT, self.contacts[hit].name) for hit in hits]
            instant = self.at(x)
            resting = [slip <= self._still for slip in self._slips(instant)]
        elif kind == "still":
            slips = self._slips(instant)
            resting = [stuck or number == k or slips[number] <= self._faint for number, stuck in enumerate(resting)]
        if kind == EventKind.SLIP:
            mode = leaving(old_mode, k, self.forces(instant, old_mode)[k], instant.touching[k].normal)
            require_moving(self.contacts, mode, self.t)
        else:
            mode = self._decided(instant, closed_mask, resting)
        if kind == "still" and slips[k] > self._still and mode[k].kind == "slip":  # it has turned, not stopped
            mode = self._decided(
                instant, closed_mask, [stands and number != k for number, stands in enumerate(resting)]
            )
        names = {name for _, name in happened}
        happened += [
            event for event in changes(self.contacts, old_mode, mode, self._stands(x, mode)) if event[1] not in names
        ]
        return x, mode, happened

    def _slips(self, instant: ContactsThere) -> list[float]:
        """Slip speed of each contact [m/s]; of turning joints at the natural length."""
        pairs = zip(self._arms, instant.touching, strict=True)
        return [float(arm * np.linalg.norm(slip_velocity(touching))) for arm, touching in pairs]

    def _stands(self, y: Array, mode: ContactMode) -> bool:
        """True if velocities and accelerations in a mode are zero within round-off."""
        if self._timed or any(acting.kind == "slip" for acting in mode):
            return False
        instant = self.at(y := self._settled(y, mode))
        n, rate = len(self._equations.mass), self._pushed_rates(y, instant, self.forces(instant, mode))
        sizes = np.repeat([1.0, self._unit / self._rate], 3 * n)  # for velocities and angular velocities
        moves, will = (float(np.abs(sizes * part[7 * n : 13 * n]).max()) for part in (y, rate))
        return moves <= self._still and will <= _STANDS * self._unit * self._rate

    def _struck(self, x: Array, instant: ContactsThere, hits: Sequence[int]) -> tuple[Array, list[bool], bool]:
        """State after an impact by Newton's and Coulomb's laws; which contacts stay closed; True if it is the last."""
        which = [k for k, acting in enumerate(self.mode) if (acting.kind != "open" or k in hits) and self._presses[k]]
        frames, J, response = instant.framed(which)
        c = np.concatenate([frame.T @ instant.touching[k].slide for frame, k in zip(frames, which, strict=True)])
        hit, places = hits[0], [3 * which.index(k) for k in hits]
        e, sideways = self.contacts[hit].restitution, self.contacts[hit].tangential_restitution
        settles = self._settles(hit, -c[places[0]] * self._arms[hit] / self._unit, e)
        e, sideways = (0.0, 0.0) if settles else (e, sideways)
        for place in places:
            c[place : place + 3] *= [1 + e, 1 + sideways, 1 + sideways]
        x = self._pushed(x, response @ self._law(J @ response, c, which, [None] * len(which))[0].ravel())
        # by the speed, not the impulse: of a contact that the impact leaves alone that is round-off, of either sign
        parts = [float(touching.normal @ touching.slide) for touching in self.at(x).touching] * self._arms
        closed_mask = [
            bool(self._bounds[k]) or (k in which and parts[k] <= self._still and not (k in hits and e))
            for k in range(len(self.mode))
        ]
        closed_mask = shut_by_pressing(self.contacts, closed_mask)
        try:
            refuse_lying(self._bodies, instant.touching, [k in hits for k in range(len(self.mode))], self.t)
            refuse_rubbing_stops(self.contacts, closed_mask, self.t)
        except Refused as error:
            raise Diverged(str(error)) from None
        return x, closed_mask, settles

    def _law(self, G: Array, c: Array, which: Sequence[int], sliding: Sequence[Array | None]) -> tuple[Array, Any]:
        time = self.t if hasattr(self._stepper, "t") else 0.0
        try:
            numbers, names = list(which), [self.contacts[k].name for k in which]
            return contact_forces(
                G,
                c,
                self.friction[numbers],
                sliding,
                names,
                self._bounds[numbers],
                time,
                static=self._static[numbers],
                pressed_by=pressed_by(self.contacts, numbers),
            )
        except Refused as error:
            raise Diverged(str(error)) from None

    def _decided(self, instant: ContactsThere, closed_mask: Sequence[bool], resting: Sequence[bool]) -> ContactMode:
        """Mode that follows from the forces, for contacts that are closed, and at rest where ``resting``."""
        closed_mask = shut_by_pressing(self.contacts, closed_mask)
        which, mode = [k for k, shut in enumerate(closed_mask) if shut], [OPEN for _ in closed_mask]
        if not which:
            return tuple(mode)
        frames, J, response = instant.framed(which)
        c, sliding = np.zeros(3 * len(which)), list[Array | None]()
        for place, (frame, k) in enumerate(zip(frames, which, strict=True)):
            point = instant.touching[k]
            c[3 * place : 3 * place + 3] = frame.T @ instant.rate[k]
            if self._presses[k]:
                c[3 * place] += point.normal_rate @ point.slide
            slip = frame[:, 1:].T @ point.slide
            sliding.append(slip / np.linalg.norm(slip) if self._rubs[k] and slip.any() and not resting[k] else None)
        G = J @ response
        force, done = self._law(G, c, which, sliding)
        for place, (frame, k) in enumerate(zip(frames, which, strict=True)):
            part, slides = slice(3 * place, 3 * place + 3), sliding[place]
            response = line_response(self.contacts[k], frame @ G[part, part] @ frame.T, instant.touching)
            direction = -force[place, 1:] if slides is None else slides
            mode[k] = first_mode(done[place], frame, direction, frame.T @ response @ frame)
        return tuple(mode)


def coefficients_of(contacts: Sequence[BodyContact]) -> dict[str, Array]:
    """Coefficients of contacts by their names in :class:`.MechanismBuilt`."""
    laws = {"friction": "friction", "restitution": "restitution", "static": "static"}
    laws["tangential"] = "tangential_restitution"
    return {f"contact_{name}": np.array([getattr(contact, law) for contact in contacts]) for name, law in laws.items()}
