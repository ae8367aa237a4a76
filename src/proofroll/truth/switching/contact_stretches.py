"""Events and transitions of a mechanism whose bodies touch or whose joints switch, as both routes share them.

Each route adds its own equations and its own decisions on the next mode.
"""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.events import EventKind
from proofroll.elements.mechanism.contact.free_slides import FreeSlides, passing, unpressed
from proofroll.elements.mechanism.contact.joint_laws import rebounding
from proofroll.elements.mechanism.contact.modes import (
    FAINT,
    OPEN,
    REST,
    ContactMode,
    Features,
    changes,
    closed_in,
    direction_of,
    features_of,
    following,
    headed,
    modes_of,
    slip_velocity,
    with_features,
)
from proofroll.elements.mechanism.contact.rolling_and_spin import led_by_slip, opened, require_moving, shut_by_pressing
from proofroll.elements.mechanism.contact.touching import Touching, lying, torn
from proofroll.elements.mechanism.dynamics.switches import Settling
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.numerics.hybrid import Stretch, Transition
from proofroll.truth.switching.box_passing import beside_border, passed_boxes
from proofroll.truth.switching.contact_guards import (
    features_beyond,
    guards_of,
    leaves,
    lies_against,
    lost_grip,
    sharing,
    striking,
    unloaded,
)
from proofroll.truth.switching.contact_walks import AHEAD, ContactWalks, SwitchedEquations
from proofroll.truth.switching.planar_slip import BegunSlip, leaving_slips
from proofroll.truth.switching.standing_ends import Face, check_faces, check_spin
from proofroll.truth.switching.stopping_slip import StoppingSlip

# Least deceleration of rebounds whose time is summed, in natural units; below it is round-off.
_PULL = 1e-9
_GRIP = 2e-14  # error of the margin of a grip in both routes, by its barriers: of times, 1e-14 is seen
_SOON = 1e-3  # natural time by which a Runge-Kutta step shows a motion that begins smoothly: its error is below 1e-15
_LAST_TURN = 10 * FAINT  # speed at a turn of a slip, in natural units, up to which the turns that follow are summed
_LONGEST = 8  # impacts of one cycle at most
# Difference of the ratios of speeds and of intervals up to which a series is geometric: 5e-5 is seen, of round-off in
# intervals of 1e-6 natural times, and both differ by the speed itself.
_ALIKE = 1e-2


class Impact(NamedTuple):
    """An impact: its time, the contacts that it hits, and their closing speed, in natural units."""

    time: float
    contacts: frozenset[int]
    speed: float


class GeometricSeries(NamedTuple):
    """Infinitely many impacts still to come.

    Attributes:
        ratio: of the speeds of an impact and of that one cycle before.
        remaining: time until all are over.
        period: duration of the last cycle.
        contacts: all that were hit in it.
    """

    ratio: float
    remaining: float
    period: float
    contacts: frozenset[int]


class ImpactSeries:
    """Impacts of a motion so far, by pairs: those of one pair repeat in cycles where they accumulate.

    Between slow impacts forces are constant, so that intervals shrink as speeds do (G. W. Housner, 1963).
    """

    def __init__(self) -> None:
        self._all, self._of_pairs = list[Impact](), dict[str, list[Impact]]()

    def after(self, pair: str, impact: Impact) -> GeometricSeries | None:
        """Series that an impact on a pair belongs to; None: it belongs to none. The impact is kept."""
        self._all.append(impact)
        impacts = self._of_pairs.setdefault(pair, [])
        impacts.append(impact)
        for length in range(1, min(_LONGEST, (len(impacts) - 1) // 2) + 1):
            again = zip(impacts[-length - 1 :], impacts[-2 * length - 1 : -length], strict=True)
            if any(late.contacts != early.contacts for late, early in again):
                continue
            last, middle, earliest = (impacts[-1 - cycles * length] for cycles in range(3))
            period, previous_period = last.time - middle.time, middle.time - earliest.time
            if not 0 <= last.speed < middle.speed:
                continue
            ratio = last.speed / middle.speed
            # of impacts at one time the periods are round-off
            if 0 < period < previous_period and abs(period / previous_period - ratio) <= _ALIKE:
                hit = (entry.contacts for entry in self._all if entry.time > middle.time)
                return GeometricSeries(ratio, period * ratio / (1 - ratio), period, frozenset().union(*hit))
        return None


class ContactStretches(ContactWalks):
    """Stretches of a mechanism that switches, and transitions between them.

    Implements :class:`proofroll.truth.numerics.hybrid.HybridRoute`.
    """

    def __init__(self, equations: SwitchedEquations, length: int, tolerance: float, size: float) -> None:
        """Takes the length of a state without time, the tolerance of each step, the mechanism's size."""
        super().__init__(equations, length, tolerance, size)
        self._settles, self._series = Settling(), ImpactSeries()
        self.faces: Sequence[Face] = ()  # ends of cylinders, whose corners touch together
        self._before: ContactMode = ()  # of the last stretch

    def early(self) -> Self:
        """The same route, which sums rebounds one before, at twice the speed at least."""
        route = copy(self)
        route._settles, route._series, route._span = Settling(early=True), ImpactSeries(), None
        return route

    @abstractmethod
    def _decided(self, state: Array, rough: ContactMode, leaving: Sequence[int] = ()) -> tuple[ContactMode, float]:
        """Mode that follows from the forces, and its relative margin from another mode.

        ``rough``: what is open, moves or stands; ``leaving``: contacts that static friction no longer holds.
        """

    def decided(self, state: Array, rough: ContactMode, leaving: Sequence[int] = ()) -> tuple[ContactMode, float]:
        """The same of all contacts: those that nothing presses or parts stay closed, and move on as if they were open.

        See :meth:`_decided` for the arguments.
        """
        idle = unpressed(self.contacts, closed_in(rough), self._free_slides(state, rough))
        if not idle:
            return self._decided(state, rough, leaving)
        opened_mode = [acting._replace(kind="open") if k in idle else acting for k, acting in enumerate(rough)]
        mode, margin = self._decided(state, tuple(opened_mode), leaving)
        solved, whole = self._solved(state, mode), list(mode)
        for k in idle:
            touch, rests = solved.touching[k], rough[k].kind == "stick"
            way = solved.slide_rate[k] if rests else touch.slide
            way, rests = way - touch.normal * (touch.normal @ way), rests and bool(self.contacts[k].friction)
            whole[k] = following(rough[k]._replace(kind="stick", heading=None), way, rests, REST)
            whole[k] = whole[k]._replace(feature=rough[k].feature)
        return tuple(whole), margin

    @abstractmethod
    def _free_slides(self, state: Array, rough: ContactMode) -> FreeSlides:
        """Slides of the contacts without their forces; ``rough``: what is open, moves or stands."""

    def _moved_on(self, state: Array, rough: ContactMode) -> ContactMode:
        """Rough modes with a slip in place of each rest that loops or motions end, whatever friction does.

        Where the rate vanishes, too, as of a cam that begins smoothly, the slide shortly afterwards tells the sense.
        """
        slides = self._free_slides(state, rough)
        rough = passing(rough, slides)
        rests = [k for k, acting in enumerate(rough) if acting.kind == "stick" and slides.moved[k]]
        if not rests:
            return rough
        others = tuple(
            OPEN._replace(feature=acting.feature) if k in rests else acting for k, acting in enumerate(rough)
        )
        mode, step, rates = self._decided(state, others)[0], [0.0, 0.5, 0.5, 1.0], list[Array]()
        for part in step:
            rates.append(self._equations.rate(state + part * _SOON * rates[-1] if rates else state, mode))
        ahead = state + _SOON * np.array([1.0, 2.0, 2.0, 1.0]) / 6 @ np.array(rates)
        touching, modes = self._touching(ahead, features_of(rough)), list(rough)
        for k in rests:
            slip = slip_velocity(touching[k])
            if (speed := float(np.linalg.norm(slip))) > REST:
                modes[k] = rough[k]._replace(kind="slip", heading=direction_of(slip / speed))
        return tuple(modes)

    @abstractmethod
    def _struck(
        self, state: Array, rough: ContactMode, laws: Sequence[float], sideways: Sequence[float]
    ) -> tuple[Array, list[bool], float]:
        """State after an impact, contacts that stay closed, and the relative margin from another outcome.

        Contacts that are not open in ``rough`` may take impulses; ``laws``, ``sideways``: normal and tangential
        restitution of each contact in this impact.
        """

    @staticmethod
    def _bouncing(name: str, rebound: float, pull: float, restitution: float, falling: float | None = None) -> float:
        """Time until the rebounds of a joint or contact are over, from the speed of the first and its decelerations.

        ``pull``: on the way out; ``falling``: on the way back, less by friction (None: the same).

        Raises:
            Refused: nothing pulls it back, in natural units, as where impacts on another joint end its rebounds.
        """
        if not pull > _PULL:
            raise Refused(
                f"rebounds of {name} shrink to nothing, and no force pulls it back between them, as where joints or "
                "contacts hit each other without end: no route sums these; ask for an earlier end of the run"
            )
        slower = 1.0 if falling is None else math.sqrt(falling / pull)  # impact speed over rebound speed
        return (1 + (1 / slower if slower else 0.0)) * rebound / (pull * (1 - restitution * slower))

    def walk(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """See the protocol; ends of cylinders stay flat, and do not spin where they rub."""
        if not self.faces:
            return super().walk(time, state, mode, until)
        check_faces(self.faces, mode if time == 0.0 else self._before, mode, time)
        self._before, features = mode, features_of(mode)
        self._check_spin(closed_in(mode), self._touching(state, features), time)
        stretch = super().walk(time, state, mode, until)
        self._check_spin(closed_in(mode), self._touching(stretch.last, features), time)
        return stretch

    def _check_spin(self, closed_mask: Sequence[bool], touching: Sequence[Touching], time: float) -> None:
        check_spin(self.faces, closed_mask, touching, [contact.friction for contact in self.contacts], time)

    def change(self, stretch: Stretch[ContactMode]) -> Transition[ContactMode]:
        """See the protocol."""
        transition = self._changed(stretch)
        return replace(transition, blur=max(transition.blur, stretch.blur))

    def _changed(self, stretch: Stretch[ContactMode]) -> Transition[ContactMode]:
        if isinstance(stretch, BegunSlip):
            mode = tuple(acting._replace(leads=False) for acting in stretch.mode_at(stretch.end))
            stretch = replace(stretch, mode=mode)
        guards = guards_of(self.contacts, stretch.mode)
        if stretch.guard is None or not 0 <= stretch.guard < len(guards):  # a break, a slip begun, an effort, a kink
            k = -1 if stretch.guard is None else stretch.guard - len(guards)
            turned = {k: not self._signs[k]} if k >= 0 else {}
            plain = Transition(stretch.last, stretch.mode, self._of_efforts(turned))
            return self.jumped(stretch) if k >= len(self._limited) and self._jumping else plain
        k, kind, border = guards[stretch.guard]
        if kind == "tear":
            slipping = zip(self.contacts, stretch.mode, strict=True)
            raise torn(next(c.name for c, acting in slipping if acting.kind == "slip" and c.friction), stretch.end)
        if kind == "flat":
            raise lying(self._equations.mechanism.contacts[k], stretch.end)
        solved = self._solved(stretch.last, stretch.mode)
        passes = kind == "pass" or (kind == "close" and self._beside(stretch, k))
        if passes or kind == "turn":
            return self._passed(stretch, k, border) if passes else Transition(stretch.last, solved.mode, ())
        if kind == "share" or (kind == "lift" and k in sharing(solved.splits)):
            return self._unshared(stretch, unloaded(solved) if kind == "lift" else [])
        if kind == "lift" or (kind == "break" and leaves(self.contacts[k], k, solved)):
            lifted = EventKind.LIFT_OFF, self.contacts[k].name
            return Transition(stretch.last, opened(self.contacts, stretch.mode, k), (lifted,))
        if kind in {"break", "grip"}:
            return replace(self._broken(stretch, k), blur=_GRIP * max(1.0, stretch.end) * (kind == "grip"))
        return self._stopped(stretch, k) if kind == "still" else self._impact(stretch, k)

    def jumped(self, stretch: Stretch[ContactMode]) -> Transition[ContactMode]:
        """Transition at the end of a stretch where forces jump: the mode is decided anew."""
        old_signs, transition = self._signs, self._after(stretch, stretch.last, closed_in(stretch.mode), ())
        if transition.mode is None:
            return transition
        pairs = enumerate(zip(old_signs, self._clamped(transition.state, transition.mode), strict=True))
        jumps = self._of_efforts({k: bool(new_sign) for k, (old_sign, new_sign) in pairs if old_sign != new_sign})
        return replace(transition, happenings=(*transition.happenings, *jumps))

    def _of_efforts(self, limited: Mapping[int, bool]) -> tuple[tuple[str, str], ...]:
        """Events of efforts, by their numbers: True for one that reaches its limit, False for one that leaves it."""
        if self._equations.mechanism.contacts:
            return ()  # beside contacts of bodies no engine reports them
        kinds = {True: EventKind.SATURATE, False: EventKind.RELEASE}
        return tuple((kinds[reached], self._limited[k]) for k, reached in limited.items() if k < len(self._limited))

    def _broken(self, stretch: Stretch[ContactMode], k: int) -> Transition[ContactMode]:
        """Transition where friction no longer holds a contact, or contacts that share a load if ``k`` is -1.

        Of a slip with less friction all forces jump.
        """
        contacts, solved = self.contacts, self._solved(stretch.last, stretch.mode)
        grips = {k: solved.force[k]}
        if k < 0:
            lost = lost_grip(contacts, solved)
            if lost.lifting:
                return self._unshared(stretch, unloaded(solved))
            if not lost.one_way(solved.touching):
                names = ", ".join(contacts[number].name for number in lost.slipping)
                raise Refused(
                    f"no distribution of friction over {names} holds from t = {stretch.end:.6g} s on, and they begin "
                    "to slip in different directions: no route of the truth follows that; end before, or take more "
                    "friction"
                )
            grips = {number: lost.force[number] for number in lost.slipping}
        if any(contacts[number].static > contacts[number].friction for number in grips):
            return self._after(stretch, stretch.last, closed_in(stretch.mode), (), leaving=tuple(grips))
        mode, leaving = list(stretch.mode), leaving_slips(stretch.mode, solved, grips)
        for number, acting in leaving.items():
            mode[number] = acting
        require_moving(contacts, tuple(mode), stretch.end)
        return Transition(stretch.last, tuple(mode), tuple((EventKind.SLIP, contacts[k].name) for k in leaving))

    def _unshared(self, stretch: Stretch[ContactMode], leaving: Sequence[int]) -> Transition[ContactMode]:
        """Transition where no even split of a load is left: contacts leave that bear nothing in any split.

        Without these each split moves another way.
        """
        if not leaving:
            return Transition(stretch.last, None, (), margin=0.0)
        mode = stretch.mode
        for number in leaving:
            mode = opened(self.contacts, mode, number)
        return Transition(stretch.last, mode, tuple((EventKind.LIFT_OFF, self.contacts[k].name) for k in leaving))

    def _ahead(self, stretch: Stretch[ContactMode]) -> Array:
        """State shortly after a stretch would have gone on."""
        return np.asarray(stretch.last + AHEAD * self._equations.rate(stretch.last, stretch.mode))

    def _beside(self, stretch: Stretch[ContactMode], k: int) -> bool:
        """True for a corner of a box that comes down on a border of a face as it passes it: it strikes nothing."""
        of_boxes = k < len(bodies := self._equations.mechanism.contacts) and bodies[k].box_slot is not None
        return of_boxes and beside_border(bodies, stretch.mode, k, self._touching, self._ahead(stretch))

    def _passed(self, stretch: Stretch[ContactMode], k: int, border: int) -> Transition[ContactMode]:
        """Transition where the nearest features of solids are left by a border: rates of normals jump, slips go on."""
        state, mode, of_bodies = stretch.last, stretch.mode, self._equations.mechanism.contacts
        if of_bodies[k].box_slot is None:
            closed_mask, features = closed_in(mode), features_beyond(mode, k, border, self._touching, state, self._size)
        else:
            states = state, self._ahead(stretch)
            closed_mask, features = passed_boxes(of_bodies, mode, (k, border), self._touching, states, self._size)
        if mode[k].kind == "open" and closed_mask == closed_in(mode):
            return Transition(state, with_features(mode, features), ())
        transition = self._after(stretch, state, closed_mask, (), features=features)
        return replace(
            transition, happenings=tuple(item for item in transition.happenings if item[0] != EventKind.TURN)
        )

    def _impact(self, stretch: Stretch[ContactMode], hit: int) -> Transition[ContactMode]:
        """Transition at an impact."""
        contacts, law, features = self.contacts, self.contacts[hit].restitution, features_of(stretch.mode)
        touching = self._touching(stretch.last, features)
        hits = striking(contacts, stretch.mode, touching, hit, stretch.end, self._size)
        self._check_spin([k in hits for k in range(len(contacts))], touching, stretch.end)
        # dry friction of joints and of turning gives no impulse
        closed_mask = [
            (k in hits or lies_against(acting, touch, self._size)) and contact.presses
            for k, (acting, touch, contact) in enumerate(zip(stretch.mode, touching, contacts, strict=True))
        ]
        laws = [contact.restitution if k in hits else 0.0 for k, contact in enumerate(contacts)]
        sideways = [contact.tangential_restitution if k in hits else 0.0 for k, contact in enumerate(contacts)]
        speed, delay = -float(touching[hit].normal @ touching[hit].slide), 0.0
        series = self._series.after(contacts[hit].pair, Impact(stretch.end, frozenset(hits), speed))
        rough = modes_of(closed_mask, closed_mask, features)
        state, stays, margin = self._struck(stretch.last, rough, laws, sideways)
        if series is not None:
            margin = np.inf  # what impacts leave repeats, however slow they are
        alternates = series is not None and (not law or len(series.contacts) > len(hits))
        if self._settles(hit, speed, series.ratio if series is not None and alternates else law):
            if series is not None and alternates:
                return self._settled(stretch, state, stays, series, speed)
            self._check_alternation(hits, touching)
            modes, normal = (rebounding(contacts, stretch.mode, hit), stretch.mode), touching[hit].normal
            pull, falling = (-float(normal @ self._solved(state, mode).slide_rate[hit]) for mode in modes)
            delay = self._bouncing(self.contacts[hit].name, speed * law, pull, law, max(falling, 0.0))
            state, stays, margin = self._struck(stretch.last, rough, [0.0] * len(closed_mask), [0.0] * len(closed_mask))
        stays = [stay or bool(contact.bound) for stay, contact in zip(stays, contacts, strict=True)]
        settled = [bool(delay) and contacts[k].pair == contacts[hit].pair for k in hits]
        kinds = (EventKind.SETTLE if over else EventKind.IMPACT for over in settled)
        happened = tuple((kind, contacts[k].name) for kind, k in zip(kinds, hits, strict=True))
        return self._after(stretch, state, stays, happened, margin, delay)

    def _check_alternation(self, hits: Sequence[int], touching: Sequence[Touching]) -> None:
        """Raises Refused if rebounds that are summed reverse a slip that none of them lessens."""
        for k in hits:
            contact, slip = self.contacts[k], float(np.linalg.norm(slip_velocity(touching[k])))
            if contact.tangential_restitution == 1 and np.isinf(contact.friction) and slip > REST:
                raise Refused(
                    f"{contact.name} closes after infinitely many impacts, each of which reverses its slip, so that it "
                    "has no last direction; end the run earlier, take tangential_restitution below 1, or give friction "
                    "a bound"
                )

    def _check_slips_end(self, closed_mask: Sequence[bool], slips: Sequence[float], stopped: float) -> None:
        """Raises Refused if an impact leaves a slip where the contact stays closed and friction has no bound."""
        for shut, slip, contact in zip(closed_mask, slips, self.contacts, strict=True):
            if shut and slip > stopped and np.isinf(contact.friction) and contact.tangential_restitution:
                raise Refused(
                    f"{contact.name} stays closed after an impact whose tangential_restitution leaves a slip, which "
                    "friction without a bound stops at once: the two contradict each other; give friction a bound, or "
                    "leave tangential_restitution out"
                )

    def _settled(
        self, stretch: Stretch[ContactMode], state: Array, stays: Sequence[bool], series: GeometricSeries, speed: float
    ) -> Transition[ContactMode]:
        """Transition at an impact of a ``speed`` whose further ones are summed: all contacts of the series close.

        Slips that are not faster have stopped by then. The error of the sum is relative to the speed.
        """
        touching, features = self._touching(state, features_of(stretch.mode)), features_of(stretch.mode)
        shuts = {k for k in series.contacts if touching[k].gap <= speed * series.period}
        closed_mask = [
            k in shuts or stay or bool(contact.bound)
            for k, (stay, contact) in enumerate(zip(stays, self.contacts, strict=True))
        ]
        happened = tuple((EventKind.SETTLE, self.contacts[k].name) for k in sorted(shuts))
        transition = self._after(
            stretch, state, closed_mask, happened, delay=series.remaining, stopped=max(speed, REST), features=features
        )
        return replace(transition, blur=speed * series.remaining)

    def _stopped(self, stretch: Stretch[ContactMode], k: int) -> Transition[ContactMode]:
        """Transition where a slip stops: alone, or with all others; in the plane first to its last instants.

        Bodies that turn while they slide stop all their slips at once: then all slips below FAINT count as stopped.
        """
        if stretch.mode[k].along is None and not isinstance(stretch, BegunSlip | StoppingSlip):
            ending = stretch.mode[k]._replace(stops=True)
            return Transition(stretch.last, (*stretch.mode[:k], ending, *stretch.mode[k + 1 :]), ())
        if not stretch.summed and (rocked := self._rocked_to_rest(stretch, k)):
            mode = tuple(acting._replace(stops=j in rocked) for j, acting in enumerate(stretch.mode))
            return Transition(stretch.last, mode, ((EventKind.TURN, self.contacts[k].name),))
        closed_mask, solved = closed_in(stretch.mode), self._solved(stretch.last, stretch.mode)
        slides = [k for k, acting in enumerate(stretch.mode) if acting.kind == "slip"]
        slips = np.linalg.norm([slip_velocity(solved.touching[k]) for k in slides], axis=1)
        if slips.max() <= FAINT:
            ended = self._after(stretch, stretch.last, closed_mask, (), stopped=FAINT)
            if ended.mode is not None and self._stands(ended.state, ended.mode):
                return replace(ended, blur=float((slips / np.linalg.norm(solved.slide_rate[slides], axis=1)).max()))
        return self._after(stretch, stretch.last, closed_mask, ())

    def _rocked_to_rest(self, stretch: Stretch[ContactMode], k: int) -> set[int]:
        """A contact whose slip turns ever faster, and its resistance against motion, if they rest when that is over.

        With an arm longer than that of friction a ball goes to and fro: its speed falls by the same part each time.
        """
        for j, contact in enumerate(self.contacts):
            if contact.pressed_by == k and led_by_slip(contact, stretch.mode):
                speed = float(np.linalg.norm(self._touching(stretch.last, features_of(stretch.mode))[j].slide))
                series = self._series.after(contact.pair, Impact(stretch.end, frozenset({j}), speed))
                if series is not None and speed <= _LAST_TURN:
                    self._rests_in = series.remaining
                    return {j, k}
        return set()

    def _after(
        self,
        stretch: Stretch[ContactMode],
        state: Array,
        closed_mask: Sequence[bool],
        happened: tuple[tuple[str, str], ...],
        margin: float = np.inf,
        delay: float = 0.0,
        stopped: float = REST,
        leaving: Sequence[int] = (),
        features: Features | None = None,
    ) -> Transition[ContactMode]:
        """Transition to the mode that follows from the forces; contacts not faster than ``stopped`` are at rest.

        ``features``: of solids that touch from now on; None: the same.
        """
        closed_mask, old_features = shut_by_pressing(self.contacts, closed_mask), features_of(stretch.mode)
        features = old_features if features is None else features
        slips = [float(np.linalg.norm(slip_velocity(touch))) for touch in self._touching(state, features)]
        self._check_slips_end(closed_mask, slips, stopped)
        resting = [shut and slip <= stopped for shut, slip in zip(closed_mask, slips, strict=True)]
        rough = self._moved_on(state, modes_of(closed_mask, resting, features))
        state = self._equations.eliminated(state, rough)
        mode, sure = self.decided(state, rough, leaving)
        # A slip in the plane may have turned since it began: its sense is that of the last step.
        sliding = self._touching(stretch.visited[-1][1] if stretch.visited else stretch.first, old_features)
        old_mode = tuple(
            acting._replace(along=acting.along or headed(acting, touch).heading)
            for acting, touch in zip(stretch.mode, sliding, strict=True)
        )
        mode_events = changes(self.contacts, old_mode, mode, self._stands(state, mode))
        struck_names = {name for _, name in happened}
        happenings = (*happened, *(item for item in mode_events if item[1] not in struck_names))
        return Transition(state, mode, happenings, margin=np.inf if delay else min(margin, sure), delay=delay)
