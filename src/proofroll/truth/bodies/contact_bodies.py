"""Route 2 of a mechanism that switches: separate bodies, modes of contacts and laws of joints found by trial."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.free_slides import FreeSlides, acting_ones
from proofroll.elements.mechanism.contact.joint_laws import off_stops
from proofroll.elements.mechanism.contact.modes import (
    OPEN,
    REST,
    Acting,
    ContactMode,
    Features,
    closed_in,
    direction_of,
    features_of,
    following,
    modes_of,
    slip_velocity,
    with_features,
)
from proofroll.elements.mechanism.contact.rolling_and_spin import led_by_slip, shut_by_pressing, standing
from proofroll.elements.mechanism.contact.sequences import groups_of
from proofroll.elements.mechanism.contact.start import closed_and_still, start_digits
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.rotations import Array, cross, frame_of_axis
from proofroll.truth.bodies.body_impacts import ImpactLaw, impulses_in_turn
from proofroll.truth.bodies.contact_body_symbols import BodySymbols
from proofroll.truth.bodies.contact_equations import (
    BodiesSolution,
    BodiesState,
    ContactEquations,
    accelerated_by,
    slides_of,
)
from proofroll.truth.bodies.contact_trials import SLACK, all_held, consistent, follow, next_trial, provisional
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.numerics.hybrid import Transition
from proofroll.truth.switching.contact_guards import SolvedContacts, pressing, sharing
from proofroll.truth.switching.contact_stretches import ContactStretches
from proofroll.truth.switching.contact_taylor import ModeSymbols
from proofroll.truth.switching.held_route import BodyStates

_MOST = 6  # largest number of closed contacts of which all modes are tried: each has up to four
_PIVOTS = 4  # exchanges at most of a search by pivots, for each contact
_CLEAR = 1e-6  # relative margin above which a mode found by pivots is the only one
Trial = Callable[[ContactMode, Sequence[Array | None]], BodiesSolution]


class ContactBodies(ContactStretches):
    """Stretches of a mechanism in the coordinates of its separate bodies.

    Implements :class:`proofroll.truth.numerics.hybrid.HybridRoute`.
    """

    def __init__(self, equations: ContactEquations, tolerance: float, size: float) -> None:
        self.equations, self._rubs = equations, equations.friction + equations.bounds > 0
        super().__init__(equations, len(equations.equations.equations.start()), tolerance, size)
        self._after_velocities = len(equations.equations.equations.angles)

    def _symbols(self) -> ModeSymbols | None:
        return BodySymbols(self.equations)

    @property
    def start(self) -> Array:
        """State at time 0."""
        return np.append(self.equations.equations.equations.start(), 0.0)

    def bodies(self, state: Array) -> BodyStates:
        """Places, velocities, quaternions and angular velocities of all bodies, world axes."""
        p, v, turned, w = self.equations.equations.poses(state[:-1])
        return p, v, Rotation.from_matrix(turned).as_quat(scalar_first=True), w

    def begin(self) -> Transition[ContactMode]:
        """See the protocol."""
        touching = self.equations.at(state := self.start).touching
        closed_mask, resting_mask = closed_and_still(touching, np.ones(len(touching)), 1.0, start_digits(self.contacts))
        features = tuple(touch.feature for touch in touching)
        rough = modes_of(shut_by_pressing(self.contacts, closed_mask), resting_mask, features)
        rough = self._moved_on(state, rough)
        state = self.equations.eliminated(state, rough)
        mode, margin = self.decided(state, rough)
        return Transition(state, mode, (), margin)

    def _decided(self, state: Array, rough: ContactMode, leaving: Sequence[int] = ()) -> tuple[ContactMode, float]:
        mode, margin = self._by_trial(state, rough, leaving)
        return with_features(mode, features_of(rough)), margin

    def _by_trial(self, state: Array, rough: ContactMode, leaving: Sequence[int]) -> tuple[ContactMode, float]:
        """See :meth:`_decided`; the features of the mode are still to be set."""
        if not any(closed_in(rough)):
            return rough, np.inf
        bodies = self.equations.at(state, features_of(rough))
        closed_mask = acting_ones(self.contacts, rough, slides_of(bodies))
        ways = off_stops(self.contacts, closed_mask)
        sticks = [acting.kind == "stick" and closed_mask[k] and k not in ways for k, acting in enumerate(rough)]
        ways = {k: np.array(acting.heading) for k, acting in enumerate(rough) if acting.heading} | ways

        def trial(mode: ContactMode, headings: Sequence[Array | None]) -> BodiesSolution:
            directed = [
                acting if heading is None or acting.along is not None else Acting("slip", None, direction_of(heading))
                for acting, heading in zip(mode, headings, strict=True)
            ]
            return self.equations.accelerated(bodies, tuple(directed))

        free_motion = accelerated_by(bodies.mass, bodies.force, bodies.C, -bodies.of_joints)
        free = float(np.abs(bodies.J @ free_motion + bodies.bias).max())
        if any(sticks) and not leaving and not ways:
            resting = self._resting(bodies, closed_mask, sticks)
            if all_held(self.equations, bodies, resting, free):
                return resting, np.inf
        best = self._tried(bodies, closed_mask, sticks, ways, trial, free, leaving)[0]
        return self._completed(bodies, closed_mask, sticks, best, free)

    def _resting(self, bodies: BodiesState, closed_mask: Sequence[bool], resting_mask: Sequence[bool]) -> ContactMode:
        """Mode in which all that rests sticks, and the rest slips as it does."""
        lines = provisional(self.equations, bodies, closed_mask)
        mode = list[Acting]()
        for acting, rub, rests, touch in zip(lines, self._rubs, resting_mask, bodies.touching, strict=True):
            if acting.kind == "open" or (rub and rests):
                mode.append(acting)
            elif not rub:
                mode.append(acting._replace(kind="slip"))
            else:
                slip = slip_velocity(touch)
                way = direction_of(slip / (float(np.linalg.norm(slip)) or 1.0))
                mode.append(Acting("slip", None if acting.along is None else way, way))
        return standing(self.contacts, tuple(mode))

    def _completed(
        self,
        bodies: BodiesState,
        closed_mask: Sequence[bool],
        resting_mask: Sequence[bool],
        best: tuple[float, BodiesSolution, ContactMode],
        free: float,
    ) -> tuple[ContactMode, float]:
        """Mode with all contacts closed that do not part, and its margin; the mode itself where forces then differ.

        Of contacts that share a load, as corners of one face, some can carry nothing of it and not part either.
        """
        kept, solution, mode = best
        size = max(float(np.abs(solution.slide).max()), free) or 1.0
        idle = [
            k
            for k, acting in enumerate(mode)
            if closed_mask[k]
            and acting.kind == "open"
            and solution.parting[k] <= SLACK * size
            and self.contacts[k].presses
        ]
        if not idle:
            return mode, kept
        lines, whole = provisional(self.equations, bodies, closed_mask), list(mode)
        for k in idle:
            touch = bodies.touching[k]
            way = solution.slide[k] if resting_mask[k] else touch.slide
            whole[k] = following(
                lines[k], way - touch.normal * (touch.normal @ way), resting_mask[k] and self._rubs[k], SLACK * size
            )
        if any(whole[k].kind == "slip" and np.isinf(self.contacts[k].friction) for k in idle):
            return mode, kept  # what carries nothing moves on, and pressed by anything it would stick
        full = self.equations.accelerated(bodies, tuple(whole))
        shares = sharing(full.splits)
        apart = float(np.abs(full.moved - solution.moved).max())
        moves = full.spread > RANK or apart > SLACK * max(free, float(np.abs(full.moved).max()))
        if moves or not set(idle) <= set(shares):
            return mode, kept
        normals = pressing(tuple(whole), bodies.touching, full.force, full.splits)[self.equations.pressing]
        margins = [
            self._kept(k, acting, resting_mask[k], bodies, full, float(normals[k]), free)
            for k, acting in enumerate(whole)
            if closed_mask[k]
        ]
        return tuple(whole), max(0.0, min(margins))

    def _struck(
        self, state: Array, rough: ContactMode, laws: Sequence[float], sideways: Sequence[float]
    ) -> tuple[Array, list[bool], float]:
        bodies = self.equations.at(state, features_of(rough))
        which = np.flatnonzero(closed_in(rough)).tolist()
        ways, G = self.equations.coupled_responses(bodies, which)
        slides = np.concatenate(
            [frame_of_axis(bodies.touching[k].normal)[:, [2, 0, 1]].T @ bodies.touching[k].slide for k in which]
        )
        impact_laws = [ImpactLaw(self.contacts[k], laws[k], sideways[k]) for k in which]
        together = self.equations.mechanism.together
        groups = groups_of([self.contacts[k].pair for k in which], slides, together=together)
        impulses = impulses_in_turn(G, slides, groups, impact_laws, float(state[-1]))
        e = self.equations.equations.equations
        state = state.copy()
        state[e.nx : e.nx + e.nu] += ways @ impulses
        parting, stays = (slides + G @ impulses)[::3], [False] * len(self.contacts)
        for k, away in zip(which, parting, strict=True):
            stays[k] = bool(away <= REST)
        return state, stays, np.inf

    def _tried(
        self,
        bodies: BodiesState,
        closed_mask: Sequence[bool],
        resting_mask: Sequence[bool],
        ways: Mapping[int, Array],
        trial: Trial,
        free: float,
        leaving: Sequence[int] = (),
    ) -> list[tuple[float, BodiesSolution, ContactMode]]:
        """Candidate modes that violate no inequality, best first: relative margin, solution, mode.

        ``ways``: directions of slips that the present slide does not tell.
        ``free``: largest slide, or rate of a slide, without forces, to which margins are relative if those with forces
        are less; ``leaving``: contacts that static friction no longer holds.

        Raises:
            Refused: there is none, or it is not found.
        """
        count = sum(closed_mask)
        slips = [ways.get(k, slip_velocity(touch)) for k, touch in enumerate(bodies.touching)]
        choices = [
            list(self._candidates(k, acting, resting_mask[k], slips[k]))
            for k, acting in enumerate(provisional(self.equations, bodies, closed_mask))
        ]
        for k in np.flatnonzero(slides_of(bodies).moved & resting_mask & self._rubs).tolist():
            choices[k] = [option for option in choices[k] if option.kind != "slip"]
        for k in leaving:
            choices[k] = [option for option in choices[k] if option.kind != "stick"]
        exchanged = self._exchanged(bodies, choices, resting_mask, trial, free)
        if exchanged is not None and (count > _MOST or (exchanged[0] > _CLEAR and not exchanged[1].loose)):
            return [exchanged]
        if count > _MOST:
            raise Refused(
                f"{count} contacts are closed at once, and exchanges of one after the other lead to no mode that keeps "
                "all inequalities of contact, as where contacts that begin to slip share a load"
            )
        unique, shared = (list[tuple[float, BodiesSolution, ContactMode]]() for _ in range(2))
        for mode in consistent(self.contacts, choices):
            attempt = self._headed(bodies, mode, resting_mask, trial)
            if attempt is None:
                continue
            solution, headed = attempt
            normals = pressing(headed, bodies.touching, solution.force, solution.splits)[self.equations.pressing]
            apart = (
                self._kept(k, headed[k], resting_mask[k], bodies, solution, float(normals[k]), free)
                for k in range(len(mode))
                if closed_mask[k]
            )
            if (least := min(apart, default=np.inf)) >= -SLACK:
                (shared if solution.loose else unique).insert(0, (max(least, 0.0), solution, headed))
        kept = shared + unique
        if not kept:
            raise Refused("nothing that the contacts can do keeps all inequalities of contact")
        return sorted(kept, key=lambda candidate: -candidate[0])

    def _exchanged(
        self,
        bodies: BodiesState,
        choices: Sequence[Sequence[Acting]],
        resting_mask: Sequence[bool],
        trial: Trial,
        free: float,
    ) -> tuple[float, BodiesSolution, ContactMode] | None:
        """Mode of :meth:`_tried` by pivots: what violates its inequality most is exchanged; None: that leads nowhere.

        The first mode has all contacts closed, those that may stick sticking.
        """
        mode = [next((option for option in options if option.kind != "open"), OPEN) for options in choices]
        follow(self.contacts, mode, choices)
        for _ in range(_PIVOTS * (1 + len(mode))):
            attempt = self._headed(bodies, tuple(mode), resting_mask, trial)
            if attempt is None:
                return None
            solution, headed = attempt
            normals = pressing(headed, bodies.touching, solution.force, solution.splits)[self.equations.pressing]
            kept = [
                self._kept(k, headed[k], resting_mask[k], bodies, solution, float(normals[k]), free)
                if len(options) > 1
                else np.inf
                for k, options in enumerate(choices)
            ]
            if min(kept, default=np.inf) >= -SLACK:
                return max(min(kept, default=np.inf), 0.0), solution, headed
            worst = min(kept)
            # of contacts that share a load, the one that is pressed least is exchanged
            k = min(
                (k for k, value in enumerate(kept) if value <= worst + SLACK),
                key=lambda k: float(bodies.touching[k].normal @ solution.force[k]),
            )
            mode[k] = next_trial(self.contacts[k], headed[k], choices[k], solution.force[k], float(normals[k]))
            follow(self.contacts, mode, choices)
        return None

    def _candidates(self, k: int, acting: Acting, at_rest: bool, slip: Array) -> Iterator[Acting]:
        """Candidate modes of a contact; ``slip``: along its slip, of any length."""
        mu, bound = self.equations.friction[k], self.equations.bounds[k]
        if acting.kind == "open" or self.contacts[k].presses:
            yield OPEN
        if acting.kind == "open":
            return
        if not at_rest and np.isinf(mu):
            name = self.contacts[k].name
            raise Refused(f"{name} would slip, but has friction = inf; give it a number")
        if not at_rest or not (mu or bound):
            x, y, z = (slip / (float(np.linalg.norm(slip)) or 1.0)).tolist()
            yield Acting("slip", None if acting.along is None else (x, y, z), (x, y, z))
            return
        yield Acting("stick", acting.along)
        if np.isinf(mu):
            return
        if acting.along is None:
            yield Acting("slip")
        else:
            x, y, z = acting.along
            yield Acting("slip", (x, y, z), (x, y, z))
            yield Acting("slip", (-x, -y, -z), (-x, -y, -z))

    def _headed(
        self, bodies: BodiesState, mode: ContactMode, resting_mask: Sequence[bool], trial: Trial
    ) -> tuple[BodiesSolution, ContactMode] | None:
        """Solution and mode of a candidate, with unknown slip directions solved for.

        None: none is consistent, or contacts that begin to rub share forces.
        """
        from scipy.optimize import root

        frames = [frame_of_axis(touch.normal) for touch in bodies.touching]
        unknown = [k for k, acting in enumerate(mode) if acting.kind == "slip" and acting.heading is None]

        def directions(angles: Array) -> list[Array]:
            return [
                np.cos(angle) * frames[k][:, 0] + np.sin(angle) * frames[k][:, 1]
                for k, angle in zip(unknown, angles, strict=True)
            ]

        def tried(angles: Array) -> BodiesSolution:
            given_headings = dict(zip(unknown, directions(angles), strict=True))
            headings = [
                given_headings.get(k, None if acting.heading is None or not mu else np.array(acting.heading))
                for k, (acting, mu) in enumerate(zip(mode, self.equations.friction, strict=True))
            ]
            return trial(mode, headings)

        def sideways(angles: Array) -> Array:
            slides = tried(angles).slide
            across_slide = zip(unknown, directions(angles), strict=True)
            return np.array([float(cross(way, slides[k]) @ bodies.touching[k].normal) for k, way in across_slide])

        initial = tried(np.zeros(len(unknown)))
        begins = (
            acting.kind == "slip" and rub and rests
            for acting, rub, rests in zip(mode, self._rubs, resting_mask, strict=True)
        )
        if initial.loose and any(begins):
            return None  # whatever the directions are
        if not unknown:
            return initial, mode

        def toward(slide: Array) -> Array:
            return np.array([np.arctan2(frames[k][:, 1] @ slide[k], frames[k][:, 0] @ slide[k]) for k in unknown])

        # near the way without friction, or with a friction of any direction
        starts = [toward(slides_of(bodies).rates), toward(initial.slide)]
        starts.append(toward(tried(starts[1]).slide))  # as a moment against motion turns the slip, and not the motion
        for start, turn in itertools.product(starts, (0.0, 1.0, -1.0, 2.0, -2.0)):
            answer = root(sideways, start + turn, tol=1e-15)
            solution, ways = tried(answer.x), dict(zip(unknown, directions(answer.x), strict=True))
            size = float(np.abs(solution.slide).max()) or 1.0
            ahead = all(float(way @ solution.slide[k]) > 0 for k, way in ways.items())
            if np.abs(answer.fun).max() <= SLACK * size and ahead:
                headed = (
                    Acting("slip", None, direction_of(ways[k])) if k in ways else acting
                    for k, acting in enumerate(mode)
                )
                return solution, tuple(headed)
        return None

    def _kept(
        self,
        k: int,
        acting: Acting,
        at_rest: bool,
        bodies: BodiesState,
        solution: BodiesSolution,
        normal: float,
        free: float,
    ) -> float:
        """Margin of a contact's inequalities, relative to forces or speeds; negative: one is violated."""
        touch, mu, bound = bodies.touching[k], float(self.equations.friction[k]), float(self.equations.bounds[k])
        size_f, size_s = float(np.abs(solution.force).max()), max(float(np.abs(solution.slide).max()), free) or 1.0
        if acting.kind == "open":
            moves = float(np.linalg.norm(solution.slide[k])) * led_by_slip(self.contacts[k], solution.mode)
            resists = self.contacts[k].pressed_by is not None and moves <= SLACK * size_s
            return np.inf if resists else (float(solution.parting[k]) - moves) / size_s
        normal = np.inf if bound else normal
        if not size_f:
            return np.inf
        if acting.kind == "stick":
            if not np.isfinite(mu):
                return normal / size_f
            force = solution.force[k]
            friction = float(np.linalg.norm(force - touch.normal * (touch.normal @ force)))
            return min(normal, (bound or self.equations.static[k] * normal) - friction) / size_f
        if not at_rest or not (mu or bound):
            return normal / size_f
        assert acting.heading is not None  # known by now
        return min(normal / size_f, float(np.dot(acting.heading, solution.slide[k])) / size_s)

    def forces(self, state: Array, mode: ContactMode) -> tuple[Array, Array]:
        """Forces of contacts, and wrenches on the bodies; see :meth:`.ContactEquations.applied`."""
        bodies = self.equations.at(self.equations.equations.normalised(state), features_of(mode))
        return self.equations.applied(bodies, self.equations.accelerated(bodies, mode).force)

    def recorded(
        self, second: MaximalCoordinates, times: Array, states: Array, modes: Iterable[ContactMode]
    ) -> tuple[Record, Array]:
        """Record at times, by rows of all joints, and forces, moments and N of contacts, (times, contacts, 7)."""
        samples = [  # one after the other, for the last states are kept
            (*self.forces(state, mode), self.equations.switched(state, mode))
            for state, mode in zip(states, modes, strict=True)
        ]
        pressed, wrenches, switched = zip(*samples, strict=True)
        functions = self.equations.equations.functions
        return second.recorded(times, states[:, :-1], switched, wrenches, functions), np.array(pressed)

    def _touching(self, state: Array, features: Features | None) -> Sequence[Touching]:
        return self.equations.at(state, features).touching

    def _free_slides(self, state: Array, rough: ContactMode) -> FreeSlides:
        return slides_of(self.equations.at(state, features_of(rough)))

    def _solution(self, state: Array, mode: ContactMode) -> SolvedContacts:
        bodies = self.equations.at(self.equations.equations.normalised(state), features_of(mode))
        solution = self.equations.accelerated(bodies, mode)
        return SolvedContacts(
            touching=bodies.touching,
            mode=solution.mode,
            velocity=bodies.u,
            acceleration=solution.moved,
            slide_rate=solution.slide,
            force=solution.force,
            response=solution.response,
            splits=solution.splits,
            spread=solution.spread,
            shifts=solution.shifts,
        )
