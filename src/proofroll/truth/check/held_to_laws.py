"""Law check: records of a route, transitions of the published one up to the first violation, works of drives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.events import EventKind
from proofroll.core.pace import PACE, OutOfTime
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.modes import ContactMode, features_of
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import SMOOTH
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check.laws.integrals import POINTS, RESOLVED, TO_SERIES, of_quaternion
from proofroll.truth.check.laws.record import Modes, Passage, Pieces, stated
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.tiles import Tiles, joined_tiles
from proofroll.truth.check.laws.transitions import transition
from proofroll.truth.followed_paths import CLOSE
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, first_close, states_inside
from proofroll.truth.switching.contact_taylor import CompiledStretch
from proofroll.truth.switching.held_route import HeldPath
from proofroll.truth.switching.planar_slip import BegunSlip
from proofroll.truth.switching.stopping_slip import StoppingSlip
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.work_of_drives import WorkAlong

_Path = HybridPath[Stretch[ContactMode]]
_TURN = 1.0  # rad, by which bodies turn in a piece at most: more is not resolved by its points
_HALVINGS = 7  # of a step into pieces at most
_TOGETHER = 3  # steps of DOP853 that the points of a piece resolve
_PARTS = 8  # into which the first instants of a slip are cut: a force that jumps inside is located to one of them


class _Piece(NamedTuple):
    """Times, rates of the time by -1 to 1, states and, if they are compiled, records at the points of a piece."""

    time: Array
    pace: Array
    states: Array
    record: Array | None = None
    coarse: bool = False


class _Window(NamedTuple):
    """A part of a step between values of its variable, with its states.

    ``recorded``: record at states and rate of the time by that variable, which is the time where there is none.
    """

    start: float
    end: float
    inside: Callable[[Array], Any]
    recorded: Callable[[Array], tuple[Array, Array]] | None = None
    coarse: bool = False

    def piece(self) -> _Piece:
        """The window as a piece."""
        places = (self.start + self.end) / 2 + (self.end - self.start) / 2 * POINTS
        states, half = np.asarray(self.inside(places)), np.full(len(POINTS), (self.end - self.start) / 2)
        if self.recorded is None:
            return _Piece(places, half, states.T, coarse=self.coarse)
        record, pace = self.recorded(states)
        recorded = record.T if len(record) else None
        return _Piece(time=states[-1], pace=half * pace, states=states.T, record=recorded, coarse=self.coarse)

    def halves(self) -> tuple[_Window, _Window]:
        """Both of its halves."""
        middle = (self.start + self.end) / 2
        return self._replace(end=middle), self._replace(start=middle)


class LawRecorder:
    """Takes the record of one route for the checks, in SI units.

    A compiled mode records at a state, by :func:`.stated_symbols`: of each body place, rotation by rows, velocity,
    angular velocity; then the forces of drives. Other modes have both in numbers.

    Attributes:
        path: in natural units.
        held: held values along it; None: there are none.
        second: natural unit of time [s].
    """

    def __init__(
        self,
        mechanism: Mechanism,
        units: Units,
        route: ContactTree | ContactBodies,
        path: HybridPath[Stretch[ContactMode]],
        held_path: HeldPath | None,
        named_at: Callable[[Array, Iterable[ContactMode]], Array],
    ) -> None:
        """Takes a mechanism in SI units; ``named_at``: named forces at states of the route in modes."""
        self._mechanism, self._units, self._route, self._named_at = mechanism, units, route, named_at
        self.path, self.held, self.second = path, held_path, units.time
        self._moment = units.force * units.length
        self._drives = [number for number, _ in working(mechanism)]
        self._drive_units = np.array(
            [units.force if item.unit == "N" else self._moment for _, item in working(mechanism)]
        )

    def tiles(self, number: int, *, drives: bool = False) -> Tiles | None:
        """Poses and velocities in all pieces of a stretch, and forces of ``drives``; None: there are none."""
        stretch = self.path.stretches[number]
        cut = self._cut(stretch)
        if not cut:
            return None
        time, pace = (np.array([getattr(piece, name) for piece in cut]) for name in ("time", "pace"))
        begun = float(stretch.line[-1]) if isinstance(stretch, StoppingSlip) else stretch.start
        wide, resolved = 18 * len(self._mechanism.bodies), time.mean(1) > begun
        states = np.concatenate([piece.states for piece in cut])
        record = [piece.record for piece in cut if piece.record is not None]
        poses = np.concatenate(record)[:, :wide] if record else self._poses(states)
        forces = np.zeros((len(states), 0))
        if drives and resolved.all():
            forces = np.concatenate(record)[:, wide:] if record else self._forces_of_drives(stretch, states)
        return Tiles(
            time=time * self._units.time,
            pace=pace * self._units.time,
            **self._moving(poses.reshape(*time.shape, -1, 18)),
            stretch=np.full(len(time), number),
            modes=(self._modes(stretch.mode),) * len(time),
            coarse=any(piece.coarse for piece in cut),
            resolved=resolved,
            drives=forces.reshape(*time.shape, -1) * (self._drive_units if forces.size else 1.0),
        )

    def _forces_of_drives(self, stretch: Stretch[ContactMode], states: Array) -> Array:
        """Forces of drives at states of a stretch, (states, drives), in natural units."""
        modes = (self._route.acting(stretch, state) for state in states)
        return self._route.in_stretch(stretch, lambda: self._named_at(states, modes)[:, self._drives])

    def _poses(self, states: Array) -> Array:
        """Values of the bodies at states, (states, 18 bodies), in the order of a record."""
        if isinstance(self._route, ContactBodies):
            p, v, turned, w = self._route.equations.equations.poses(states[:, :-1], SMOOTH)
        else:
            p, v, quaternions, w = map(np.array, zip(*map(self._route.bodies, states), strict=True))
            turned = of_quaternion(quaternions)
        return np.concatenate([p, turned.reshape(*p.shape[:2], 9), v, w], -1).reshape(len(states), -1)

    def _moving(self, of_bodies: Array) -> dict[str, Any]:
        """Poses and velocities in SI units, the world last, from values (pieces, points, bodies, 18)."""
        length, shape = self._units.length, of_bodies.shape[:2]
        world = np.broadcast_to(np.concatenate([np.zeros(3), np.eye(3).ravel(), np.zeros(6)]), (*shape, 1, 18))
        of_bodies = np.concatenate([of_bodies, world], 2)
        return {
            "p": of_bodies[..., :3] * length,
            "R": of_bodies[..., 3:12].reshape(*of_bodies.shape[:3], 3, 3),
            "v": of_bodies[..., 12:15] * (length / self._units.time),
            "w": of_bodies[..., 15:] / self._units.time,
        }

    def ending(self, number: int) -> Pieces:
        """End of a stretch before another; if something is decided there, with forces of contacts, stops, friction."""
        stretch, later = self.path.stretches[number : number + 2]
        mode, m, count = self._route.acting(stretch, stretch.last), self._mechanism, len(self._mechanism.contacts)
        if stretch.guard is None and np.array_equal(stretch.last, later.first):  # as at an instant of a controller
            return stated(m, self._modes(mode), **self._point(stretch.end, stretch.last))
        touching, forces = self._route.in_stretch(stretch, lambda: self._route.borne(stretch.last, mode))
        fields, units = self._point(stretch.end, stretch.last), self._units
        pieces = stated(m, self._modes(mode), **fields)
        for contact, force in zip(self._route.contacts, forces, strict=True):
            if isinstance(contact, TurningFriction):
                moments = pieces.spinning if contact.spins else pieces.rolling
                moments[0, 0, contact.pressed_by] = force * self._moment
            elif isinstance(contact, JointContact):
                joint = contact.joint.number
                unit = units.force if m.joints[joint].kind == JointKind.PRISMATIC else self._moment
                efforts = pieces.stops[0, 0, joint] if contact.side else pieces.friction[0, 0, joint : joint + 1]
                efforts[1 if contact.side < 0 else 0] = unit * float(force @ contact.direction)
        pieces.force[0, 0] = forces[:count] * units.force
        for k, touch in enumerate(touching[:count]):
            pieces.place[0, 0, k], pieces.normal[0, 0, k] = touch.place * units.length, touch.normal
        return pieces

    def passage(self, number: int, ending: Pieces) -> Passage:
        """Transition to a stretch, from the end of the one before."""
        sooner, later = self.path.stretches[number - 1 : number + 1]
        change = self.path.transitions[number] if number < len(self.path.transitions) else None
        happenings = () if change is None else change.happenings
        border = features_of(sooner.mode) != features_of(later.mode)
        modes = self._modes(self._route.acting(later, later.first))
        return Passage(
            before=ending,
            after=stated(self._mechanism, modes, **self._point(later.start, later.first)),
            impacts=frozenset(name for kind, name in happenings if kind == EventKind.IMPACT),
            settles=frozenset(name for kind, name in happenings if kind == EventKind.SETTLE),
            decided=sooner.guard is not None and not border,
        )

    def _point(self, time: float, state: Array) -> dict[str, Array]:
        """Poses and velocities at a state, as those of a piece of one point."""
        moving = self._moving(self._poses(state[None]).reshape(1, 1, -1, 18))
        return {"time": np.full((1, 1), time * self._units.time), "pace": np.zeros((1, 1)), **moving}

    def _modes(self, mode: ContactMode) -> Modes:
        """Modes by their places in the record."""
        m, contacts = self._mechanism, self._route.contacts
        count, joints = len(m.contacts), len(m.joints)
        friction, stops = ["open"] * joints, [["open", "open"] for _ in range(joints)]
        turning = {spins: ["open"] * count for spins in (False, True)}
        for contact, acting in zip(contacts[count:], mode[count:], strict=True):
            if isinstance(contact, TurningFriction):
                turning[contact.spins][contact.pressed_by] = acting.kind
            elif isinstance(contact, JointContact) and contact.side:
                stops[contact.joint.number][0 if contact.side > 0 else 1] = acting.kind
            elif isinstance(contact, JointContact):
                friction[contact.joint.number] = acting.kind
        return Modes(
            contacts=tuple(acting.kind for acting in mode[:count]),
            rolling=tuple(turning[False]),
            spinning=tuple(turning[True]),
            friction=tuple(friction),
            stops=tuple((low, high) for low, high in stops),
        )

    def _windows(self, stretch: Stretch[ContactMode]) -> Iterator[_Window]:
        """Parts of a stretch that are polynomials, as far as it tells."""
        if isinstance(stretch, BegunSlip):
            for start, end in pairwise(np.linspace(stretch.start, stretch.end, _PARTS + 1)):
                yield _Window(start, end, lambda times: stretch.at(times).T)
        elif isinstance(stretch, StoppingSlip):
            for start, end in pairwise([stretch.start, *(step.time for step in stretch.steps), stretch.end]):
                if end > start:
                    yield _Window(start, end, lambda times: stretch.at(times).T)
        elif isinstance(stretch, CompiledStretch) and stretch.by is not None:
            recorded = stretch.by.record_of(stretch.mode, stretch.start)
            for start, end, inside_step in stretch.by.steps_of(stretch):
                yield _Window(start, end, inside_step, recorded)
        elif stretch.dense:
            together = 1 if stretch.exact else _TOGETHER
            for begin in range(0, len(stretch.dense), together):
                steps = stretch.dense[begin : begin + together]
                start, last = steps[0][0], min(steps[-1][1], stretch.end)
                inside = steps[0][2] if len(steps) == 1 else partial(states_inside, steps)
                if last > start:
                    yield _Window(start, last, inside, coarse=not stretch.exact)

    def _cut(self, stretch: Stretch[ContactMode]) -> list[_Piece]:
        """Pieces of a stretch: its windows, halved until points resolve states and turns, in order of time."""
        windows, pieces = list(self._windows(stretch)), list[_Piece]()
        if not windows and stretch.end > stretch.start:  # nothing moves
            half = (stretch.end - stretch.start) / 2
            states = np.repeat(stretch.first[None], len(POINTS), 0)
            return [_Piece((stretch.start + stretch.end) / 2 + half * POINTS, np.full(len(POINTS), half), states)]
        for halvings in range(_HALVINGS + 1):
            made = [window.piece() for window in windows]
            rough = self._rough(made) if windows and halvings < _HALVINGS else [False] * len(made)
            pieces += [piece for piece, again in zip(made, rough, strict=True) if not again]
            halved = [window.halves() for window, again in zip(windows, rough, strict=True) if again]
            windows = [half for halves in halved for half in halves]
        return sorted(pieces, key=lambda piece: float(piece.time[0]))

    def _rough(self, pieces: Sequence[_Piece]) -> list[bool]:
        """True for each piece whose points do not resolve its states, or turns of its bodies."""
        # no state has a prescribed motion, which may turn bodies as no polynomial of the points does
        prescribed = bool(self._mechanism.prescribed)
        points = slice(None) if prescribed else [0, -1]
        bare = [piece.states[points] for piece in pieces if piece.record is None]
        poses = iter(np.split(self._poses(np.concatenate(bare)), len(bare)) if bare else ())
        return [self._is_rough(piece, next(poses) if piece.record is None else piece.record) for piece in pieces]

    def _is_rough(self, piece: _Piece, record: Array) -> bool:
        """True if points do not resolve the states, and turns by poses at all points or at both ends of a piece."""
        if _unresolved(piece.states.T):
            return True
        moving = record[:, : 18 * len(self._mechanism.bodies)].T.reshape(-1, 18, len(record))
        turning, spins = moving[:, 3:12], moving[:, 15:]
        # an angle whose rate changes needs more points
        fastest = np.abs(spins).max(initial=0.0) + np.ptp(spins, axis=-1).max(initial=0.0)
        prescribed = bool(self._mechanism.prescribed)
        return bool(fastest * (piece.time[-1] - piece.time[0]) > _TURN) or (
            prescribed and _unresolved(turning.reshape(-1, len(POINTS)))
        )


def _unresolved(values: Array) -> bool:
    """True if the points of a piece do not resolve one of the values on it, (values, points)."""
    coefficients = np.abs(TO_SERIES @ values.T)
    return bool((coefficients[-2:].max(0) > RESOLVED * np.maximum(1.0, coefficients.max(0))).any())


def of_tree(
    mechanism: Mechanism, units: Units, tree: ContactTree, path: _Path, held_path: HeldPath | None = None
) -> LawRecorder:
    """A path of the first route; ``mechanism`` in SI units."""
    dynamics = tree.dynamics

    def named_at(states: Array, modes: Iterable[ContactMode]) -> Array:
        parts = ((*dynamics.parts(state), mode) for state, mode in zip(states, modes, strict=True))
        named = [dynamics.sample(q, v, mode, time)[0]["named"] for q, v, time, mode in parts]
        return np.asarray(np.nan_to_num(named))  # what is not determinate does no work

    return LawRecorder(mechanism, units, tree, path, held_path, named_at)


def of_bodies(
    mechanism: Mechanism,
    units: Units,
    bodies: ContactBodies,
    second: MaximalCoordinates,
    path: _Path,
    held_path: HeldPath | None = None,
) -> LawRecorder:
    """A path of the second route; ``second``: its equations of all joints."""

    def named_at(states: Array, modes: Iterable[ContactMode]) -> Array:
        return bodies.recorded(second, states[:, -1], states, modes)[0].named

    return LawRecorder(mechanism, units, bodies, path, held_path, named_at)


class HeldMotion(NamedTuple):
    """Outcome of the law check.

    Attributes:
        end: time of the first violation of a law, or up to which the limit of a truth lets routes be held to them, in
            natural units; inf: there is none.
        text: its reason.
        laws: sentence of the outcome; empty after a violation, and where there are no transitions.
        works: work of drives along each route.
        tiles: of the first route.
    """

    end: float
    text: str
    laws: str
    works: list[WorkAlong]
    tiles: Tiles | None


def held_to_laws(mechanism: Mechanism, units: Units, routes: Sequence[LawRecorder]) -> HeldMotion:
    """Outcome of the law check of the first route, which is published; what another one misses is in the bars.

    Args:
        mechanism: in SI units.
        units: natural units of the routes and paths.
        routes: all.

    Raises:
        Refused: a law is violated from the start.
    """
    # beyond an early end of one path the other may be on another branch, and beyond a close decision all is open
    paths = [route.path for route in routes]
    early = min((path.stretches[-1].end for path in paths if not path.known), default=np.inf)
    walks = [_Walk(mechanism, units, route) for route in routes]
    try:
        PACE.follow("laws", np.inf)
        parts = walks[0].through(min(early, first_close(paths, CLOSE)) * (1 - CLOSE))
        for walk in walks[1:] if working(mechanism) else ():
            walk.through(0.0)
    finally:
        PACE.leave()
    works, residuals, tiles = [walk.work for walk in walks], walks[0].residuals, _joined(parts, routes[0])
    tiles = None if tiles is None else replace(tiles, impulses=tuple(walks[0].impulses))
    text, reached = residuals.broken("the motion that was followed"), min(walk.reached for walk in walks)
    if residuals.first is None:
        text = "" if np.isinf(reached) else PACE.reason
        return HeldMotion(end=reached, text=text, laws=residuals.held(), works=works, tiles=tiles)
    if residuals.first.time <= CLOSE * units.time:
        raise Refused(text)
    return HeldMotion(end=residuals.first.time / units.time, text=text, laws="", works=works, tiles=tiles)


def tiles_of(route: LawRecorder, until: float) -> Tiles | None:
    """Poses and velocities in all pieces of a route that begin before a time in natural units; None: there are none."""
    count = sum(stretch.start < until for stretch in route.path.stretches) or 1
    return _joined([route.tiles(number) for number in range(count)], route)


def _joined(parts: Sequence[Tiles | None], route: LawRecorder) -> Tiles | None:
    """Tiles of all stretches of a route; None: there are none."""
    tiles = [part for part in parts if part is not None]
    borders = np.array([stretch.start for stretch in route.path.stretches[1:]]) * route.second
    return replace(joined_tiles(tiles), borders=borders) if tiles else None


def work_along(mechanism: Mechanism, units: Units, tree: ContactTree, path: _Path) -> WorkAlong:
    """Work of drives along another path of the first route; ``mechanism`` in SI units."""
    walk = _Walk(mechanism, units, of_tree(mechanism, units, tree, path))
    if working(mechanism):
        walk.through(0.0)
    return walk.work


class _Walk:
    """Takes the record of one route along its path.

    Attributes:
        residuals: remainders of the laws of transitions.
        work: of drives.
        impulses: time of each impact that driven joints take a part of [s], and the impulses along these.
        reached: start of the first stretch that the limit of a truth leaves out, in natural units; inf: there is none.
    """

    def __init__(self, mechanism: Mechanism, units: Units, route: LawRecorder) -> None:
        self._route, scale = route, (units.length, 1 / units.time)
        self._scene, self.residuals = LawScene(mechanism, *scale), LawResiduals(rate=scale[1])
        self.work, self._working = WorkAlong(mechanism, *scale), bool(working(mechanism))
        self.impulses, self.reached = list[tuple[float, dict[int, float]]](), np.inf

    def through(self, end: float) -> list[Tiles | None]:
        """Tiles of all stretches; transitions are judged up to a time in natural units."""
        parts, ending, route = list[Tiles | None](), None, self._route
        fastest, unjudged = dict[str, float](), LawResiduals(rate=self.residuals.rate)
        for number, stretch in enumerate(route.path.stretches):
            try:
                if number:
                    PACE.reached(stretch.start)
            except OutOfTime:
                self.reached = stretch.start
                break
            if route.held is not None:
                route.held.recall(stretch.start)
            if ending is not None:
                residuals = self.residuals if stretch.start < end else unjudged
                passage = route.passage(number, ending)
                if pulses := transition(self._scene, passage, residuals, fastest):
                    self.impulses.append((stretch.start * route.second, pulses))
                self.work.passes(passage, pulses)
            parts.append(route.tiles(number, drives=self._working))
            if self._working and (part := parts[-1]) is not None:
                self.work.take(part)
            goes_on = stretch is not route.path.stretches[-1] and (stretch.end < end or self._working)
            ending = route.ending(number) if goes_on else None
        return parts
