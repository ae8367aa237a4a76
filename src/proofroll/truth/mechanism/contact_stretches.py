"""Integration and events of a mechanism whose bodies touch, as both routes share them.

Each route adds its own equations and its own decisions on the next mode.
"""

from abc import abstractmethod
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Protocol

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.events import EventKind
from proofroll.core.last_results import LastResults
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contacts.acting import (
    FAINT,
    ContactMode,
    Features,
    changes,
    closed_in,
    features_of,
    headed,
    modes_of,
    slip_velocity,
    with_features,
)
from proofroll.elements.mechanism.contacts.joint_laws import rebounding
from proofroll.elements.mechanism.contacts.touching import Touching, lying, torn
from proofroll.elements.mechanism.contacts.turning import opened, shut_by_pressing
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.signal import varies
from proofroll.truth.hybrid import Stretch, StretchLaw, Transition
from proofroll.truth.mechanism.contact_guards import (
    AT_REST,
    SLIP_ENDED,
    STANDS,
    ContactGuard,
    SolvedContacts,
    Touchable,
    faint_time,
    features_beyond,
    guard_value,
    guards_of,
    leaves,
    noise_of,
    pressing,
    sharing,
    striking,
)
from proofroll.truth.mechanism.contact_taylor import CompiledMode, CompiledModes, CompiledStretch, ModeSymbols
from proofroll.truth.mechanism.followed_paths import CLOSE
from proofroll.truth.mechanism.planar_slip import BegunSlip, begun_slip, leaving_slips
from proofroll.truth.mechanism.stretches import Stretches
from proofroll.truth.picard import PicardSteps

_KEPT = 4  # solutions that are kept
_AHEAD = 1e-9  # time step, relative to the natural time, after which an effort is compared with its limit
_CLAMPED = 1e-9  # difference of an effort from its limit, relative to the limit, up to which it starts at the limit
# Difference of compiled accelerations from others, relative to the largest, up to which they are the same: the
# direction of a slip of 2e-8 is known to 1e-8.
_SAME_RATES = 1e-6
# Integration of a slip to rest: decrease of its logarithm in a step, and slip speed at the end.
_DECAY, _NOTHING = 2.0, 1e-12


class _Equations(Protocol):
    mechanism: Mechanism
    contacts: tuple[Touchable, ...]

    def rate(self, state: Array, mode: ContactMode, /) -> Array: ...

    def eliminated(self, state: Array, mode: ContactMode, /) -> Array: ...

    def excess(self, state: Array, /) -> Array: ...

    def pushes(self, state: Array, /) -> Array: ...


class ContactStretches(Stretches[ContactMode]):
    """Stretches of a mechanism with contacts, and transitions; the last component of a state is the time.

    Implements :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    _after_velocities = 0  # components of a state after the velocities, without the time
    _begins_by = 14  # nodes of the first instants of a slip from rest
    _by_collocation = False  # integrator of compiled modes: collocation, or Taylor series

    def __init__(self, equations: _Equations, length: int, tolerance: float, size: float) -> None:
        """Takes the length of a state without time, the tolerance of each step, the mechanism's size."""
        super().__init__(length + 1, tolerance)
        self._equations, self.contacts, self._size = equations, equations.contacts, size
        self._timed = any(map(varies, equations.mechanism.signals))
        self._last = LastResults[tuple[bytes, ContactMode], SolvedContacts](_KEPT)
        self._used: dict[str, None] = {}
        symbols = self._symbols()
        self._compiled = (
            None if symbols is None else CompiledModes(symbols, self.contacts, length + 1, self._by_collocation)
        )

    @property
    def integrators(self) -> str:
        """Names of the integrators that this route has used."""
        return " and ".join(self._used) or "DOP853"

    def _symbols(self) -> ModeSymbols | None:
        """Equations in symbols; None: the route has none."""
        return None

    def _solved(self, state: Array, mode: ContactMode) -> SolvedContacts:
        """Motion and forces at a state."""
        return self._last.of((state.tobytes(), mode), lambda: self._solution(state, mode))

    @abstractmethod
    def _solution(self, state: Array, mode: ContactMode) -> SolvedContacts:
        """Motion and forces at a state."""

    @abstractmethod
    def _touching(self, state: Array, features: Features) -> Sequence[Touching]:
        """Geometry and sliding velocity of each contact at a state; ``features``: of solids that touch."""

    @abstractmethod
    def _decided(self, state: Array, rough: ContactMode, leaving: int | None = None) -> tuple[ContactMode, float]:
        """Mode that follows from the forces, and its relative margin from another mode.

        ``rough``: what is open, moves or stands; ``leaving``: contact that static friction no longer holds.
        """

    @abstractmethod
    def _struck(
        self, state: Array, rough: ContactMode, laws: Sequence[float], sideways: Sequence[float]
    ) -> tuple[Array, list[bool], float]:
        """State after an impact, contacts that stay closed, and the relative margin from another outcome.

        Contacts that are not open in ``rough`` may take impulses; ``laws``, ``sideways``: normal and tangential
        restitution of each contact in this impact.
        """

    def _law(self, state: Array, mode: ContactMode) -> StretchLaw:
        guards, equations = guards_of(self.contacts, mode), self._equations
        # sign of the guard of an effort: it reaches its limit, or comes back from it
        side = np.zeros(0)
        if len(equations.excess(state)):
            side = np.where(equations.excess(state + _AHEAD * equations.rate(state, mode)) > 0, 1.0, -1.0)
        noise = np.where(np.abs(excess := equations.excess(state)) < _CLAMPED, 2 * np.abs(excess), 0.0)
        return StretchLaw(
            rates=lambda y: equations.rate(y, mode),
            guards=lambda y: np.append(self._guards(y, mode, guards), -side * equations.excess(y)),
            corrected=lambda y: equations.eliminated(y, mode),
            noise=np.append(noise_of(guards, self._size), noise),
            near=np.append([CLOSE * (guard.kind == "close") for guard in guards], np.zeros_like(noise)),
        )

    def _guards(self, state: Array, mode: ContactMode, guards: Sequence[ContactGuard]) -> FloatArray:
        solved, contacts = self._solved(state, mode), self.contacts
        normals = pressing(solved.mode, solved.touching, solved.force, solved.splits)
        return np.array([guard_value(guard, mode, contacts, solved, normals) for guard in guards])

    @override
    def walk(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        if self._stands(state, mode):
            return Stretch(start=time, end=until, mode=mode, first=state, last=state, guard=None)
        if any(own.leads for own in mode):
            return self._begun(time, state, mode, until)
        guards = guards_of(self.contacts, mode)
        share = next((number for number, guard in enumerate(guards) if guard.kind == "share"), None)
        if share is not None and self._guards(state, mode, [guards[share]])[0] > 0:
            return Stretch(start=time, end=time, mode=mode, first=state, last=state, guard=share)
        start, begun = self._kicked(time, state, mode)
        stretch = self._walked(begun, start, mode, until)
        end, last = stretch.end, stretch.last
        if stretch.guard is not None and stretch.guard < len(guards):
            k, kind, _ = guards[stretch.guard]
            if kind == "still":
                last = self._spent(last, mode, k, stretch)
                end += float(last[-1] - stretch.last[-1])
        return replace(stretch, start=time, first=state, end=end, last=last)

    def _begun(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """First instants of a slip from rest in the plane, which end before another contact changes."""
        name = next(contact.name for contact, own in zip(self.contacts, mode, strict=True) if own.leads)
        guards = guards_of(self.contacts, mode)
        others = [guard for guard in guards if guard.kind != "still" or not mode[guard.contact].leads]

        def clear(y: Array, now: ContactMode) -> bool:
            return bool(np.all(self._guards(y, now, others) <= noise_of(others, self._size)))

        rate, solve, count = self._equations.rate, self._solved, self._begins_by
        begun = begun_slip(time, state, mode, until, rate, solve, clear, count, name)
        last = self._equations.eliminated(begun.last, begun.mode)
        goes_on = None if begun.end >= until else len(guards)
        return replace(begun, last=last, guard=goes_on)

    def _walked(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """Stretch by a compiled mode, or by DOP853 where there is none, and near singular poses, where it fails."""
        compiled = self._by_symbols(state, mode)
        if compiled is not None:
            with suppress(Diverged):
                stretch = compiled.walk(self._law(state, mode), mode, time, state, until)
                self._used.setdefault("collocation" if self._by_collocation else "Taylor series")
                return stretch
        self._used.setdefault("DOP853")
        return super().walk(time, state, mode, until)

    def _by_symbols(self, state: Array, mode: ContactMode) -> CompiledMode | None:
        """Compiled mode, if all parts of the mechanism have a rule in symbols and no load is shared."""
        solved = self._solved(state, mode)
        if self._compiled is None or solved.splits.shape[1]:
            return None
        compiled = self._compiled.of(mode, self._clamped(state, mode))
        if compiled is None:
            return None
        rates = compiled.values(state[None], mode)[2][0]
        place = len(state) - 1 - len(solved.acceleration) - self._after_velocities
        apart = np.abs(rates[place : place + len(solved.acceleration)] - solved.acceleration).max()
        agrees = apart <= _SAME_RATES * max(1.0, float(np.abs(solved.acceleration).max()))
        return compiled if agrees else None

    def _clamped(self, state: Array, mode: ContactMode) -> tuple[int, ...]:
        """Sign of each effort that is at its limit in a stretch from a state, 0 of others, of those with a limit."""
        equations = self._equations
        if not len(equations.excess(state)):
            return ()
        ahead = state + _AHEAD * equations.rate(state, mode)
        signs = np.where(equations.excess(ahead) > 0, equations.pushes(ahead), 0.0)
        return tuple(int(sign) for sign in signs)

    @override
    def within(self, stretch: Stretch[ContactMode], times: Array) -> Array:
        if isinstance(stretch, BegunSlip):
            return np.array([self._equations.eliminated(state, stretch.mode) for state in stretch.at(times)])
        if isinstance(stretch, CompiledStretch) and stretch.by is not None:
            return stretch.by.within(self._law(stretch.first, stretch.mode), stretch, times)
        return super().within(stretch, times)

    def _spent(self, state: Array, mode: ContactMode, k: int, stretch: Stretch[ContactMode]) -> Array:
        """State at the end of a slip below FAINT, by collocation in the logarithm of the slip speed.

        The slower a slip, the faster it turns: its equations are stiff in time, and smooth in that logarithm.
        """
        if mode[k].along is not None:
            return state

        def one(y: Array) -> tuple[float, Array]:
            touching = self._touching(y, features_of(mode))
            now = tuple(headed(own, each) for own, each in zip(mode, touching, strict=True))
            change = faint_time(touching[k], self._solved(y, now).slide_rate[k]) * self._equations.rate(y, now)
            return float(np.linalg.norm(slip_velocity(touching[k]))), change

        def decay(states: Array) -> tuple[Array, Array]:
            """Slip speeds, and changes of states (state, places) until the slip would stop at its present rate."""
            speeds, changes = zip(*map(one, states.T), strict=True)
            return np.array(speeds), np.array(changes).T

        compiled = stretch.by if isinstance(stretch, CompiledStretch) else None
        function = decay if compiled is None else compiled.decay_of(mode, k)
        steps, place = PicardSteps(lambda states: function(states)[1]), 0.0
        last = float(np.log(np.maximum(function(state[:, None])[0], _NOTHING) / _NOTHING)[0])
        while place < last:
            place, state, _ = steps.step(place, state, min(last, place + _DECAY))
        return np.asarray(state + function(state[:, None])[1][:, 0])

    def _kicked(self, time: float, state: Array, mode: ContactMode) -> tuple[Array, float]:
        """State and time shortly after a slip in the plane starts from rest, when it has a direction."""
        solved, wait = self._solved(state, mode), 0.0
        for k, own in enumerate(mode):
            begins = own.kind == "slip" and own.along is None and self.contacts[k].friction
            if begins and np.linalg.norm(slip_velocity(solved.touching[k])) < FAINT:
                wait = max(wait, 2 * FAINT / float(np.linalg.norm(solved.slide_rate[k])))
        return (state, time) if not wait else (state + wait * self._equations.rate(state, mode), time + wait)

    def change(self, stretch: Stretch[ContactMode]) -> Transition[ContactMode]:
        """See the protocol."""
        guards = guards_of(self.contacts, stretch.mode)
        if stretch.guard is None or stretch.guard >= len(guards):  # a break of the rates, an effort, a slip begun
            return Transition(stretch.last, stretch.mode, ())
        k, kind, border = guards[stretch.guard]
        if kind == "tear":
            slipping = zip(self.contacts, stretch.mode, strict=True)
            raise torn(next(c.name for c, own in slipping if own.kind == "slip" and c.friction), stretch.end)
        if kind == "flat":
            raise lying(self._equations.mechanism.contacts[k], stretch.end)
        solved = self._solved(stretch.last, stretch.mode)
        if kind in {"turn", "pass"}:
            return Transition(stretch.last, solved.mode, ()) if kind == "turn" else self._passed(stretch, k, border)
        if kind == "share" or (kind == "lift" and k in sharing(solved.splits)):
            # No split of the load is left, or each moves another way.
            return Transition(stretch.last, None, (), margin=0.0)
        if kind == "lift" or (kind == "break" and leaves(self.contacts[k], k, solved)):
            lifted = EventKind.LIFT_OFF, self.contacts[k].name
            return Transition(stretch.last, opened(self.contacts, stretch.mode, k), (lifted,))
        if kind == "break":
            return self._broken(stretch, k)
        return self._stopped(stretch) if kind == "still" else self._impact(stretch, k)

    def _broken(self, stretch: Stretch[ContactMode], k: int) -> Transition[ContactMode]:
        """Transition where friction no longer holds a contact; of a slip with less friction all forces jump."""
        contacts, mode = self.contacts, list(stretch.mode)
        if contacts[k].static > contacts[k].friction:
            return self._after(stretch, stretch.last, [own.kind != "open" for own in mode], (), leaving=k)
        leaving = leaving_slips(contacts, stretch.mode, self._solved(stretch.last, stretch.mode), k)
        for number, own in leaving.items():
            mode[number] = own
        return Transition(stretch.last, tuple(mode), tuple((EventKind.SLIP, contacts[k].name) for k in leaving))

    def _passed(self, stretch: Stretch[ContactMode], k: int, border: int) -> Transition[ContactMode]:
        """Transition where the nearest features of solids are left by a border: rates of normals jump, slips go on."""
        features = features_beyond(stretch.mode, k, border, self._touching, stretch.last, self._size)
        if stretch.mode[k].kind == "open":
            return Transition(stretch.last, with_features(stretch.mode, features), ())
        after = self._after(stretch, stretch.last, closed_in(stretch.mode), (), features=features)
        return replace(after, happenings=tuple(item for item in after.happenings if item[0] != EventKind.TURN))

    def _impact(self, stretch: Stretch[ContactMode], hit: int) -> Transition[ContactMode]:
        """Transition at an impact."""
        contacts, law, features = self.contacts, self.contacts[hit].restitution, features_of(stretch.mode)
        touching = self._touching(stretch.last, features)
        hits = striking(stretch.mode, touching, hit, stretch.end, self._size)
        # dry friction of joints and of turning gives no impulse
        closed = [
            (own.kind != "open" or k in hits) and contact.presses
            for k, (own, contact) in enumerate(zip(stretch.mode, contacts, strict=True))
        ]
        laws = [contact.restitution if k in hits else 0.0 for k, contact in enumerate(contacts)]
        sideways = [contact.tangential_restitution if k in hits else 0.0 for k, contact in enumerate(contacts)]
        speed, delay = -float(touching[hit].normal @ touching[hit].slide), 0.0
        rough = modes_of(closed, closed, features)
        state, stays, margin = self._struck(stretch.last, rough, laws, sideways)
        if self._settles(hit, speed, law):
            modes, normal = (rebounding(contacts, stretch.mode, hit), stretch.mode), touching[hit].normal
            pull, falling = (-float(normal @ self._solved(state, mode).slide_rate[hit]) for mode in modes)
            delay = self._bouncing(self.contacts[hit].name, speed * law, pull, law, max(falling, 0.0))
            state, stays, margin = self._struck(stretch.last, rough, [0.0] * len(closed), [0.0] * len(closed))
        stays = [stay or bool(contact.bound) for stay, contact in zip(stays, contacts, strict=True)]
        settled = [bool(delay) and contacts[k].pair == contacts[hit].pair for k in hits]
        kinds = (EventKind.SETTLE if over else EventKind.IMPACT for over in settled)
        happened = tuple((kind, contacts[k].name) for kind, k in zip(kinds, hits, strict=True))
        return self._after(stretch, state, stays, happened, margin, delay)

    def _stopped(self, stretch: Stretch[ContactMode]) -> Transition[ContactMode]:
        """Transition where a slip stops: alone, or with all others.

        Bodies that turn while they slide stop all their slips at once: then all slips below FAINT count as stopped.
        """
        closed, solved = closed_in(stretch.mode), self._solved(stretch.last, stretch.mode)
        slides = [k for k, own in enumerate(stretch.mode) if own.kind == "slip"]
        slips = np.linalg.norm([slip_velocity(solved.touching[k]) for k in slides], axis=1)
        if slips.max() <= FAINT:
            ended = self._after(stretch, stretch.last, closed, (), stopped=FAINT)
            if ended.mode is not None and self._stands(ended.state, ended.mode):
                return replace(ended, blur=float((slips / np.linalg.norm(solved.slide_rate[slides], axis=1)).max()))
        return self._after(stretch, stretch.last, closed, ())

    def _after(
        self,
        stretch: Stretch[ContactMode],
        state: Array,
        closed: Sequence[bool],
        happened: tuple[tuple[str, str], ...],
        margin: float = np.inf,
        delay: float = 0.0,
        stopped: float = SLIP_ENDED,
        leaving: int | None = None,
        features: Features | None = None,
    ) -> Transition[ContactMode]:
        """Transition to the mode that follows from the forces; contacts not faster than ``stopped`` are at rest.

        ``features``: of solids that touch from now on; None: the same.
        """
        closed, before = shut_by_pressing(self.contacts, closed), features_of(stretch.mode)
        features = before if features is None else features
        slips = [float(np.linalg.norm(slip_velocity(each))) for each in self._touching(state, features)]
        still = [shut and slip <= stopped for shut, slip in zip(closed, slips, strict=True)]
        rough = modes_of(closed, still, features)
        state = self._equations.eliminated(state, rough)
        mode, sure = self._decided(state, rough, leaving)
        # A slip in the plane may have turned since it began: its sense is that of the last step.
        sliding = self._touching(stretch.visited[-1][1] if stretch.visited else stretch.first, before)
        was = tuple(
            own._replace(along=own.along or headed(own, each).heading)
            for own, each in zip(stretch.mode, sliding, strict=True)
        )
        changed = changes(self.contacts, was, mode, self._stands(state, mode))
        struck = {name for _, name in happened}
        happenings = (*happened, *(item for item in changed if item[1] not in struck))
        return Transition(state, mode, happenings, margin=np.inf if delay else min(margin, sure), delay=delay)

    def _stands(self, state: Array, mode: ContactMode) -> bool:
        """True if nothing moves or is about to move."""
        if self._timed or any(own.kind == "slip" for own in mode):
            return False
        solved = self._solved(state, mode)
        return float(np.abs(solved.velocity).max()) <= AT_REST and float(np.abs(solved.acceleration).max()) <= STANDS
