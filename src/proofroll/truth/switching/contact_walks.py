"""Integration of a mechanism whose bodies touch or whose joints switch, as both routes share it.

Each route adds its own equations and its own decisions on the next mode.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Protocol, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.core.event_location import locate_rise_within
from proofroll.core.last_results import LastResults
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import (
    FAINT,
    REST,
    ROUND_OFF,
    ContactMode,
    Features,
    features_of,
    headed,
    slip_velocity,
)
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.switches import REDUNDANT
from proofroll.elements.mechanism.scene.bushing import LARGEST
from proofroll.elements.mechanism.scene.kinks import JUMP
from proofroll.elements.mechanism.scene.rotations import Array, cross, from_quaternion
from proofroll.elements.mechanism.scene.signal import varies
from proofroll.truth.followed_paths import CLOSE, TOLERANCES
from proofroll.truth.numerics.hybrid import (
    StoppedWithin,
    Stretch,
    StretchLaw,
    integrate_to_guard,
    states_at,
    states_inside,
)
from proofroll.truth.switching.contact_guards import (
    ContactGuard,
    SolvedContacts,
    Touchable,
    borne_forces,
    faint_time,
    guard_value,
    guards_of,
    noise_of,
    pressing,
)
from proofroll.truth.switching.contact_taylor import CompiledMode, CompiledModes, CompiledStretch, ModeSymbols
from proofroll.truth.switching.held_route import BodyStates
from proofroll.truth.switching.kink_sides import noise_at_start, refuse_jolts, sides_ahead
from proofroll.truth.switching.planar_slip import SHORTEST, BegunSlip, begun_slip, held_or_stopped, led_by
from proofroll.truth.switching.stopping_slip import StoppingSlip, stopping_slip

_T = TypeVar("_T")
_KEPT = 4  # solutions that are kept
AHEAD = 1e-9  # time step, relative to the natural time, after which an effort is compared with its limit
_CLAMPED = 1e-9  # difference of an effort from its limit, relative to the limit, up to which it starts at the limit
# Difference of compiled accelerations from others, relative to the largest, up to which they are the same: the
# direction of a slip of 2e-8 is known to 1e-8.
_SAME_RATES = 1e-6

# Angle [rad] and number of steps by which the direction is found in which a slip stops.
_NEARBY, _TURNS = 1e-3, 2
_NO_PRESSURE = 1e-13  # force of a contact, in natural units, that is round-off where nothing presses it
_ONE_WAY = 1e-12  # difference of directions in which slips start together
# Guard of the first instants of a slip, which goes on.
_GOES_ON = -1
_INSTANT = 4  # last digits of a time in which nothing moves, as after an event at the end of a run
_LOOKS = 32  # at the turn of bushings in a step, which is resolved by half as many points


class SwitchedEquations(Protocol):
    """Equations of a route."""

    mechanism: Mechanism
    contacts: tuple[Touchable, ...]

    def rate(self, state: Array, mode: ContactMode, /) -> Array:
        """Time derivative of a state in a mode."""

    def eliminated(self, state: Array, mode: ContactMode, /) -> Array:
        """State without violations of what holds."""

    def drawn(self, state: Array, /) -> Array:
        """Efforts with a limit before they are clamped, in parts of their limits."""

    def kinks(self, state: Array, /) -> Array:
        """Arguments of the kinks of laws, which are at a kink where theirs is zero."""

    def hold(self, signs: Sequence[int], /) -> None:
        """Keeps efforts with a limit at it, by their sign, or within it (0), and then the sides of kinks.

        Without signs all follow the state.
        """


class ContactWalks(ABC):
    """Stretches of a mechanism that switches; the last component of a state is the time."""

    _after_velocities = 0  # components of a state after the velocities, without the time
    _begins_by = 14  # nodes of the first instants of a slip from rest
    _by_collocation = False  # integrator of compiled modes: collocation, or Taylor series

    def __init__(self, equations: SwitchedEquations, length: int, tolerance: float, size: float) -> None:
        """Takes the length of a state without time, the tolerance of each step, the mechanism's size."""
        self._tolerance = np.full(length + 1, tolerance)
        self._span: float | None = None  # length of the last stretch by DOP853
        self._equations, self.contacts, self._size = equations, equations.contacts, size
        self._timed = any(map(varies, equations.mechanism.signals))
        self._last = LastResults[tuple[bytes, tuple[float, ...], ContactMode], SolvedContacts](_KEPT)
        self._limited = [item.name for item in equations.mechanism.actuators if item.limit is not None]
        # of efforts at their limits, and sides of the kinks of laws, in the present stretch
        self._signs: tuple[int, ...] = ()
        self._jumping = any(JUMP in names for names in equations.mechanism.kinks.values())
        self._used: dict[str, None] = {}
        self._rests_in = 0.0  # time until a slip that turns ever faster is over
        symbols = self._symbols()
        self._compiled = (
            None if symbols is None else CompiledModes(symbols, self.contacts, length + 1, self._by_collocation)
        )

    @property
    def integrators(self) -> str:
        """Names of the integrators that this route has used, with what failed where one stood in for another."""
        return " and ".join(self._used) or "DOP853"

    def _symbols(self) -> ModeSymbols | None:
        """Equations in symbols; None: the route has none."""
        return None

    def _solved(self, state: Array, mode: ContactMode) -> SolvedContacts:
        """Motion and forces at a state."""
        key = state.tobytes(), self._equations.mechanism.held, mode
        return self._last.of(key, lambda: self._solution(state, mode))

    @abstractmethod
    def _solution(self, state: Array, mode: ContactMode) -> SolvedContacts:
        """Motion and forces at a state."""

    def borne(self, state: Array, mode: ContactMode) -> tuple[Sequence[Touching], Array]:
        """Geometry of all contacts at a state in a mode, and forces that they can bear, (contacts, 3)."""
        solved = self._solution(state, mode)
        return solved.touching, borne_forces(self.contacts, solved.touching, solved)

    @abstractmethod
    def _touching(self, state: Array, features: Features | None) -> Sequence[Touching]:
        """Geometry and sliding velocity of each contact at a state; ``features``: of solids that touch."""

    def _law(self, state: Array, mode: ContactMode, signs: tuple[int, ...] | None = None) -> StretchLaw:
        """Equations of a stretch from a state; ``signs``: of efforts at their limits there, if they are known."""
        guards, equations = guards_of(self.contacts, mode), self._equations
        signs = self._clamped(state, mode) if signs is None else signs
        excess = np.abs(equations.drawn(state)) - 1
        noise = np.where(np.abs(excess) < _CLAMPED, 2 * np.abs(excess), 0.0)
        if len(sides := np.array(signs[len(self._limited) :], dtype=float)):
            farthest = float(np.abs(self.bodies(state)[0]).max(initial=1.0))  # at least the natural length
            noise = np.append(noise, noise_at_start(state, sides, equations.kinks, farthest))
        of_guards = noise_of(guards, self._size)
        for number, value in enumerate(self._guards(state, mode, guards) if guards else ()):
            if guards[number].kind in {"lift", "break"} and abs(value) <= _NO_PRESSURE:
                of_guards[number] = _NO_PRESSURE
        return StretchLaw(
            rates=lambda y: self._held(signs, lambda: equations.rate(y, mode)),
            guards=lambda y: self._guards_and_limits(y, mode, guards, signs),
            corrected=lambda y: equations.eliminated(y, mode),
            noise=np.append(of_guards, noise),
            near=np.append([CLOSE * (guard.kind == "close") for guard in guards], np.zeros_like(noise)),
        )

    @abstractmethod
    def bodies(self, state: Array) -> BodyStates:
        """Places, velocities, quaternions and angular velocities of all bodies, world axes."""

    def _held(self, signs: Sequence[int], value: Callable[[], _T]) -> _T:
        """A value while efforts at their limits and kinks keep their sides."""
        self._equations.hold(signs)
        try:
            return value()
        finally:
            self._equations.hold(())

    def in_stretch(self, stretch: Stretch[ContactMode], value: Callable[[], _T]) -> _T:
        """A value while kinks keep the sides that they have in a stretch, also at its end."""
        if not self._equations.mechanism.kinks:
            return value()
        return self._held(self._clamped(stretch.first, stretch.mode), value)

    def _guards(self, state: Array, mode: ContactMode, guards: Sequence[ContactGuard]) -> FloatArray:
        if not guards:
            return np.zeros(0)
        solved, contacts = self._solved(state, mode), self.contacts
        normals = pressing(solved.mode, solved.touching, solved.force, solved.splits)
        return np.array([guard_value(guard, mode, contacts, solved, normals) for guard in guards])

    def _guards_and_limits(
        self, state: Array, mode: ContactMode, guards: Sequence[ContactGuard], signs: Sequence[int]
    ) -> FloatArray:
        """Values of guards, of efforts with a limit by the side from which these come, and of kinks."""
        count, equations = len(self._limited), self._equations
        side = np.array([1.0 if sign else -1.0 for sign in signs[:count]])
        sides = np.array(signs[count:], dtype=float)
        of_kinks = -sides * equations.kinks(state) if len(sides) else sides
        return np.concatenate(
            [self._guards(state, mode, guards), -side * (np.abs(equations.drawn(state)) - 1), of_kinks]
        )

    def walk(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """See the protocol."""
        state, old_signs = np.append(state[:-1], time), self._signs
        self._signs = self._clamped(state, mode)
        if time > 0.0 and old_signs[len(self._limited) :] != self._signs[len(self._limited) :]:
            count, mechanism = len(self._limited), self._equations.mechanism
            refuse_jolts(mechanism, time, old_signs[count:], self._signs[count:])
        if not self._equations.mechanism.contacts and self._solved(state, mode).shifts.any():
            raise Refused(REDUNDANT)
        if until - time <= _INSTANT * np.spacing(time) or self._stands(state, mode):
            return Stretch(start=time, end=until, mode=mode, first=state, last=state, guard=None)
        stopping = next((k for k, acting in enumerate(mode) if acting.stops), None)
        if stopping is not None:
            return self._stopping(time, state, mode, stopping)
        led = self._led_from_rest(state, mode)
        if any(acting.leads for acting in led):
            with suppress(*([] if led is mode else [Refused])):
                return self._begun(time, state, led, until)
        guards = guards_of(self.contacts, mode)
        share = next((number for number, guard in enumerate(guards) if guard.kind == "share"), None)
        if share is not None and self._guards(state, mode, [guards[share]])[0] > 0:
            return Stretch(start=time, end=time, mode=mode, first=state, last=state, guard=share)
        kicked_state, kick_end = self._kicked(time, state, mode)
        try:
            stretch = self._walked(kick_end, kicked_state, mode, until)
        except StoppedWithin as stopped:
            if stopped.stretch is not None:
                stopped.stretch = replace(stopped.stretch, start=time, first=state)
            raise
        return replace(stretch, start=time, first=state)

    def _begun(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """First instants of a slip from rest in the plane, which end before another contact changes."""
        name = next(contact.name for contact, acting in zip(self.contacts, mode, strict=True) if acting.leads)
        compiled = self.by_symbols(state, mode)
        led = led_by(mode, self._equations.rate, self._solved) if compiled is None else compiled.led(mode, time)
        begun = begun_slip(time, state, mode, until, led, self._begins_by, name)
        begun = begun if compiled is None else replace(begun, compiled=led)
        law, guards, signs = self._law(state, mode, self._signs), guards_of(self.contacts, mode), self._signs

        def values(times: FloatArray) -> FloatArray:
            if compiled is not None:
                return led(begun.at(times), begun.directions_at(times)).guards
            pairs = zip(times.tolist(), begun.at(times), strict=True)
            return np.array([self._guards_and_limits(y, begun.mode_at(t), guards, signs) for t, y in pairs])

        grazes = list[float]()
        rise = locate_rise_within(values, time, begun.end, law.noise, True, law.near, grazes)
        guard = _GOES_ON if begun.end < until else None
        if rise is not None:
            end, guard = rise
            k, kind = (guards[guard].contact, guards[guard].kind) if guard < len(guards) else (-1, "")
            stops = kind == "still" and mode[k].leads
            if not stops and end <= time + SHORTEST:
                raise held_or_stopped(name, time)
            begun = replace(begun, end=end, last=begun.at(np.array([end]))[0])
            if stops:  # the error of the speed, as a time
                slows = self._solved(begun.last, begun.mode_at(end)).slide_rate[k]
                begun = replace(begun, blur=TOLERANCES[1] / float(np.linalg.norm(slows)))
        last = self._equations.eliminated(begun.last, mode)
        return replace(begun, last=last, guard=guard, grazes=grazes)

    def _walked(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """Stretch by a compiled mode, or by DOP853 where there is none, and near singular poses, where it fails."""
        compiled, by_states = self.by_symbols(state, mode), "DOP853"
        if compiled is not None:
            name = "collocation" if self._by_collocation else "Taylor series"
            stretch = self.walk_compiled(compiled, time, state, mode, until)
            if stretch is not None:
                self._used.setdefault(name)
                return stretch
            by_states = f"DOP853 where {name} failed"
        self._used.setdefault(by_states)
        stretch = integrate_to_guard(
            self._law(state, mode, self._signs), mode, time, state, until, self._tolerance, self._span
        )
        self._span = stretch.end - time if stretch.end > time else None
        return stretch

    def walk_compiled(
        self, compiled: CompiledMode, time: float, state: Array, mode: ContactMode, until: float
    ) -> Stretch[ContactMode] | None:
        """Stretch by a compiled mode; None: its steps fail, or a bushing turns further than its law says."""
        try:
            stretch = compiled.walk(self._law(state, mode, self._signs), mode, time, state, until)
        except StoppedWithin:  # it is out of time
            raise
        except Diverged:
            return None
        return None if self._overturns(compiled, stretch) else stretch

    def _overturns(self, compiled: CompiledMode, stretch: Stretch[ContactMode]) -> bool:
        """True if a bushing turns further than its rotation vector is unique, which compiled equations do not ask."""
        mechanism = self._equations.mechanism
        if not mechanism.bushings or not isinstance(stretch, CompiledStretch):
            return False
        steps = compiled.steps_of(stretch)
        states = (y for start, end, inside in steps for y in inside(np.linspace(start, end, _LOOKS)).T)
        world = np.eye(3)
        for state in states:
            turns = [*map(from_quaternion, self.bodies(state)[2]), world]
            pairs = (
                (mechanism.body_index[item.body_a], mechanism.body_index[item.body_b]) for item in mechanism.bushings
            )
            if any(
                item.turned(turns[a], turns[b]) > LARGEST
                for item, (a, b) in zip(mechanism.bushings, pairs, strict=True)
            ):
                return True
        return False

    def by_symbols(self, state: Array, mode: ContactMode) -> CompiledMode | None:
        """Compiled mode, if all parts of the mechanism have a rule in symbols and no load is shared."""
        solved = self._held(self._signs, lambda: self._solution(state, mode))
        if self._compiled is None or solved.splits.shape[1]:
            return None
        compiled = self._compiled.of(mode, self._signs)
        if compiled is None:
            return None
        rates = compiled.values(state[None], mode)[2][0]
        place = len(state) - 1 - len(solved.acceleration) - self._after_velocities
        apart = np.abs(rates[place : place + len(solved.acceleration)] - solved.acceleration).max()
        agrees = apart <= _SAME_RATES * max(1.0, float(np.abs(solved.acceleration).max()))
        return compiled if agrees else None

    def _clamped(self, state: Array, mode: ContactMode) -> tuple[int, ...]:
        """Sign of each effort that is at its limit in a stretch from a state, 0 of others, of those with a limit.

        After these the sides of the kinks of laws.
        """
        equations, signs = self._equations, list[int]()
        if self._limited:
            ahead = equations.drawn(state + AHEAD * equations.rate(state, mode))
            signs = [int(np.sign(part)) if abs(part) > 1 else 0 for part in ahead.tolist()]
        if not equations.mechanism.kinks:
            return tuple(signs)

        def rates(y: Array, sides: tuple[int, ...]) -> Array:
            return self._held((*signs, *sides), lambda: equations.rate(y, mode))

        return (*signs, *sides_ahead(state, equations.kinks, rates))

    def _law_inside(self, state: Array, mode: ContactMode) -> StretchLaw:
        """Equations for states inside a stretch, which are no successive steps."""
        return self._law(state, mode)

    def within(self, stretch: Stretch[ContactMode], times: Array) -> Array:
        """See the protocol."""
        if isinstance(stretch, BegunSlip | StoppingSlip):
            return np.array([self._equations.eliminated(state, stretch.mode) for state in stretch.at(times)])
        if isinstance(stretch, CompiledStretch) and stretch.by is not None:
            return stretch.by.within(self._law_inside(stretch.first, stretch.mode), stretch, times)
        if stretch.exact:
            return states_inside(stretch.dense, times).T
        if not stretch.visited:
            return np.array([stretch.first for _ in times])
        return states_at(self._law_inside(stretch.first, stretch.mode), stretch.visited, times, self._tolerance)

    def acting(self, stretch: Stretch[ContactMode], state: Array) -> ContactMode:
        """Mode at a state within a stretch, with the directions of slips that its integration took."""
        time, mode = float(state[-1]), stretch.mode
        if isinstance(stretch, BegunSlip):
            return stretch.mode_at(time)
        if isinstance(stretch, StoppingSlip):
            return self._as_it_goes(stretch.line if time >= stretch.line[-1] else state, mode)
        if isinstance(stretch, CompiledStretch) and stretch.visited and time > stretch.visited[0][0]:
            return self._as_it_goes(state, mode)
        return mode

    def _as_it_goes(self, state: Array, mode: ContactMode) -> ContactMode:
        """Mode with the present directions of slips in the plane, however slow."""
        if not any(acting.kind == "slip" and acting.along is None for acting in mode):
            return mode
        touching = self._touching(state, features_of(mode))
        return tuple(headed(acting, touch) for acting, touch in zip(mode, touching, strict=True))

    def _stopping(self, time: float, state: Array, mode: ContactMode, k: int) -> StoppingSlip:
        """Last instants of a slip below FAINT, or of one that turns ever faster, until all its turns are over.

        The duration of its straight line, with that of the error of the speed, is the uncertainty of the end.
        """

        def one(y: Array) -> tuple[float, Array]:
            current_mode, touch = self._as_it_goes(y, mode), self._touching(y, features_of(mode))[k]
            change = faint_time(touch, self._solved(y, current_mode).slide_rate[k]) * self._equations.rate(
                y, current_mode
            )
            return float(np.linalg.norm(slip_velocity(touch))), change

        def by_states(states: Array) -> tuple[Array, Array]:
            speeds, changes = zip(*map(one, states.T), strict=True)
            return np.array(speeds), np.array(changes).T

        def line_of(y: Array) -> tuple[Array, Array] | None:
            if not rests_in:
                return self._straight_end(y, self._as_it_goes(y, mode), k)
            change = np.append((self._equations.eliminated(y, sticking) - y)[:-1], rests_in)
            return change, change

        rests_in, self._rests_in = self._rests_in, 0.0
        sticking = tuple(acting._replace(kind="stick", stops=False) if acting.stops else acting for acting in mode)

        compiled = self.by_symbols(state, mode)
        decay = by_states if compiled is None else compiled.decay_of(mode, k, time)
        guard = guards_of(self.contacts, mode).index(ContactGuard(k, "still"))
        slip = stopping_slip(time, state, mode, guard, decay, line_of)
        slows = self._solved(slip.line, self._as_it_goes(slip.line, mode)).slide_rate[k]
        last = self._equations.eliminated(slip.last, sticking)
        blur = (ROUND_OFF + TOLERANCES[1]) / float(np.linalg.norm(slows))
        return replace(slip, last=last, blur=blur, summed=rests_in > 0)

    def _straight_end(self, state: Array, mode: ContactMode, k: int) -> tuple[Array, Array] | None:
        """Changes of a state until a slip stops along one direction, by its first rates and in fact; None: it turns.

        The direction is that in which the slip stops, found at half the time. The slip has to have it within round-off,
        and its slowing to be even within round-off, in the second order.
        """
        touch = self._touching(state, features_of(mode))[k]
        slip, normal = slip_velocity(touch), touch.normal
        rate, slows = self._equations.rate(state, mode), self._solved(state, mode).slide_rate[k]
        speed = float(np.linalg.norm(slip))
        if not speed or not slows.any():
            return None
        first_duration = faint_time(touch, slows)
        half = state + first_duration / 2 * rate
        direction, across = slip / speed, cross(normal, slip / speed)

        def held(angle: float) -> tuple[ContactMode, Array]:
            x, y, z = (np.cos(angle) * direction + np.sin(angle) * across).tolist()
            turned = (*mode[:k], mode[k]._replace(heading=(x, y, z), leads=True), *mode[k + 1 :])
            return turned, self._solved(half, turned).slide_rate[k]

        angle_before, angle = _NEARBY, 0.0
        residual_before, residual = (float(held(turn)[1] @ across) for turn in (angle_before, angle))
        for _ in range(_TURNS):
            if residual == residual_before:
                break
            turn = angle - residual * (angle - angle_before) / (residual - residual_before)
            if abs(turn) * speed > 2 * ROUND_OFF:
                return None
            angle_before, residual_before, angle, residual = angle, residual, turn, float(held(turn)[1] @ across)
        turned_mode, slows = held(angle)
        duration = faint_time(touch, slows)
        uneven = abs(duration - first_duration) / (duration or 1.0)
        if abs(angle) * speed > ROUND_OFF or uneven**2 * speed > ROUND_OFF or not duration:
            return None
        return duration * rate, duration * self._equations.rate(half, turned_mode)

    def _led_from_rest(self, state: Array, mode: ContactMode) -> ContactMode:
        """The mode, in which slips in the plane lead that start from rest in one direction."""
        begins = [
            k
            for k, (acting, contact) in enumerate(zip(mode, self.contacts, strict=True))
            if acting.kind == "slip" and acting.along is None and acting.heading and contact.friction
        ]
        if not begins or any(acting.leads for acting in mode):
            return mode
        touching, headings = self._touching(state, features_of(mode)), np.array([mode[k].heading for k in begins])
        moves = any(np.linalg.norm(slip_velocity(touching[k])) > REST for k in begins)
        if moves or float(np.abs(headings - headings[0]).max()) > _ONE_WAY:
            return mode
        return tuple(acting._replace(leads=True) if k in begins else acting for k, acting in enumerate(mode))

    def _kicked(self, time: float, state: Array, mode: ContactMode) -> tuple[Array, float]:
        """State and time shortly after a slip in the plane starts from rest, when it has a direction."""
        solved, wait = self._solved(state, mode), 0.0
        for k, acting in enumerate(mode):
            begins = acting.kind == "slip" and acting.along is None and self.contacts[k].friction
            if begins and np.linalg.norm(slip_velocity(solved.touching[k])) < FAINT:
                wait = max(wait, 2 * FAINT / float(np.linalg.norm(solved.slide_rate[k])))
        return (state, time) if not wait else (state + wait * self._equations.rate(state, mode), time + wait)

    def _stands(self, state: Array, mode: ContactMode) -> bool:
        """True if nothing moves or will after one natural time: round-off of a state at rest is not integrated."""
        if self._timed or any(acting.kind == "slip" for acting in mode):
            return False
        solved = self._solved(state, mode)
        speeds = np.abs([*solved.velocity, *solved.acceleration])
        return float(speeds.max()) <= ROUND_OFF
