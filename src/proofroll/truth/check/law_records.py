"""Records of the routes of a switching truth for the law check: states, forces and modes at points of their steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.events import EventKind
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.modes import ContactMode, features_of
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.check.law_states import stated_named
from proofroll.truth.check.laws.integrals import POINTS, RESOLVED, TO_SERIES, of_quaternion
from proofroll.truth.check.laws.record import Modes, Passage, Pieces
from proofroll.truth.check.laws.tiles import Tiles, joined_tiles
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, states_inside
from proofroll.truth.switching.contact_taylor import CompiledStretch
from proofroll.truth.switching.planar_slip import BegunSlip
from proofroll.truth.switching.stopping_slip import StoppingSlip
from proofroll.truth.tree.contact_tree import ContactTree

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


class LawRecorder:
    """Takes the record of one route for the law check, in SI units.

    A record at a state is a flat array: of each body place, rotation by rows, velocity, angular velocity; of each
    contact force, place, normal; efforts, drives, couplings; force and moment of each loop. Compiled modes give it by
    :func:`.stated_symbols`; ``state_of`` gives it at a state in a mode, in numbers.

    Attributes:
        second: natural unit of time [s].
    """

    def __init__(
        self,
        mechanism: Mechanism,
        units: Units,
        route: ContactTree | ContactBodies,
        state_of: Callable[[Array, ContactMode], Array],
    ) -> None:
        self._mechanism, self._units, self._route, self._state_of = mechanism, units, route, state_of
        self.second = units.time
        named, moment = named_forces(mechanism), units.force * units.length
        self._named_units = stated_named(
            mechanism, np.array([units.force if item.unit == "N" else moment for item in named])
        )

    def pieces(self, stretch: Stretch[ContactMode], *, numeric: bool) -> list[Pieces]:
        """Pieces of a stretch: of steps and of dense output apart; ``numeric``: those with forces in numbers, too."""
        numeric = numeric or isinstance(stretch, BegunSlip | StoppingSlip)  # a few pieces that no sample may lie on
        cut, stated = [piece for piece in self._cut(stretch) if numeric or piece.record is not None], []
        for coarse in (False, True):
            pieces = [piece for piece in cut if piece.coarse is coarse]
            if pieces:
                records = [
                    self._route.in_stretch(stretch, partial(self._in_numbers, stretch, piece.states))
                    if piece.record is None
                    else piece.record
                    for piece in pieces
                ]
                time, pace = (np.array([getattr(piece, name) for piece in pieces]) for name in ("time", "pace"))
                stated.append(self._stated(time, pace, np.array(records), stretch.mode, coarse=coarse))
        return stated

    def tiles(self, number: int, stretch: Stretch[ContactMode], pieces: Sequence[Pieces] | None) -> Tiles | None:
        """Poses and velocities in all pieces of the stretch of a number; None: it has none.

        ``pieces``: of :meth:`pieces`, which are all of a compiled stretch; None: not known.
        """
        if isinstance(stretch, CompiledStretch) and stretch.by is not None:
            parts = self.pieces(stretch, numeric=False) if pieces is None else pieces
            return joined_tiles([Tiles.of(part, number) for part in parts]) if parts else None
        cut = list(self._cut(stretch, whole=True))
        if not cut:
            return None
        time, pace = (np.array([getattr(piece, name) for piece in cut]) for name in ("time", "pace"))
        moving = self._moving(self._poses(np.concatenate([piece.states for piece in cut])).reshape(*time.shape, -1, 18))
        return Tiles(
            time=time * self._units.time,
            pace=pace * self._units.time,
            p=moving["p"],
            R=moving["R"],
            v=moving["v"],
            w=moving["w"],
            stretch=np.full(len(time), number),
            modes=(self._modes(stretch.mode),) * len(time),
            coarse=any(piece.coarse for piece in cut),
            resolved=np.full(len(time), not isinstance(stretch, StoppingSlip)),
        )

    def _poses(self, states: Array) -> Array:
        """Values of the bodies at states, (states, 18 bodies), in the order of a record."""
        if isinstance(self._route, ContactBodies):
            p, v, turned, w = self._route.equations.equations.poses_at(states[:, :-1])
        else:
            p, v, quaternions, w = map(np.array, zip(*map(self._route.bodies, states), strict=True))
            turned = of_quaternion(quaternions)
        return np.concatenate([p, turned.reshape(*p.shape[:2], 9), v, w], -1).reshape(len(states), -1)

    def _moving(self, of_bodies: Array) -> dict[str, Array]:
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

    def start(self, stretch: Stretch[ContactMode], pieces: Sequence[Pieces]) -> Pieces:
        """First point of a stretch with these pieces, as exact as its steps."""
        if pieces and self._reaches(pieces[0], 0, stretch.start):
            return pieces[0].points(0, 0)
        return self._at(stretch, stretch.start, stretch.first)

    def end(self, stretch: Stretch[ContactMode], pieces: Sequence[Pieces]) -> Pieces:
        """Last point of a stretch with these pieces, as exact as its steps."""
        if pieces and self._reaches(pieces[-1], -1, stretch.end):
            return pieces[-1].points(-1, -1)
        return self._at(stretch, stretch.end, stretch.last)

    def _reaches(self, pieces: Pieces, point: int, time: float) -> bool:
        """True if exact pieces begin or end at a time, but for its last digits: not where a slip fades away behind."""
        apart = abs(float(pieces.time[point, point]) / self._units.time - time)
        return not pieces.coarse and apart <= 4 * float(np.spacing(time))

    def _at(self, stretch: Stretch[ContactMode], time: float, state: Array) -> Pieces:
        record = self._route.in_stretch(stretch, partial(self._in_numbers, stretch, state[None]))
        mode = self._route.acting(stretch, state)
        return self._stated(np.full((1, 1), time), np.zeros((1, 1)), record[None], mode)

    def _in_numbers(self, stretch: Stretch[ContactMode], states: Array) -> Array:
        """Record of a stretch at states, (states, values)."""
        return np.array([self._state_of(state, self._route.acting(stretch, state)) for state in states])

    @staticmethod
    def passage(path: HybridPath[Stretch[ContactMode]], number: int, before: Pieces, after: Pieces) -> Passage:
        """Transition to a stretch of a path, from the end of the one before."""
        sooner, later = path.stretches[number - 1], path.stretches[number]
        change = path.transitions[number] if number < len(path.transitions) else None
        happenings = () if change is None else change.happenings
        border = features_of(sooner.mode) != features_of(later.mode)
        return Passage(
            before=before,
            after=after,
            impacts=frozenset(name for kind, name in happenings if kind == EventKind.IMPACT),
            settles=frozenset(name for kind, name in happenings if kind == EventKind.SETTLE),
            decided=sooner.guard is not None and not border,
        )

    def _stated(self, time: Array, pace: Array, record: Array, mode: ContactMode, *, coarse: bool = False) -> Pieces:
        """Pieces from records (pieces, points, values)."""
        m, units, shape, contacts = self._mechanism, self._units, time.shape, self._route.contacts
        count, joints, bodies = len(m.contacts), len(m.joints), len(m.bodies)
        sizes = [18 * bodies, 9 * len(contacts), len(m.actuators), len(m.prescribed), len(m.couplings)]
        of_bodies, of_contacts, effort, drives, coupling, loops = np.split(record, np.cumsum(sizes), -1)
        in_named = np.split(self._named_units, np.cumsum(sizes[2:4]))
        of_bodies, of_contacts = of_bodies.reshape(*shape, bodies, 18), of_contacts.reshape(*shape, -1, 9)
        length, force, moment = units.length, units.force, units.force * units.length
        moving, forces = self._moving(of_bodies), of_contacts[..., :3]
        drive = np.zeros((*shape, joints))
        for k, (joint, _, _) in enumerate(m.prescribed):
            drive[..., m.joint_index[joint.name]] = drives[..., k] * in_named[1][k]
        friction, stops = np.zeros((*shape, joints)), np.zeros((*shape, joints, 2))
        turning = {spins: np.zeros((*shape, count, 3)) for spins in (False, True)}
        for k, contact in enumerate(contacts[count:], count):
            if isinstance(contact, TurningFriction):
                turning[contact.spins][..., contact.pressed_by, :] = forces[..., k, :] * moment
                continue
            assert isinstance(contact, JointContact)  # the only other kind
            number = contact.joint.number
            push = (
                forces[..., k, :]
                @ contact.direction
                * (force if m.joints[number].kind == JointKind.PRISMATIC else moment)
            )
            if contact.side:
                stops[..., number, 0 if contact.side > 0 else 1] = push
            else:
                friction[..., number] = push
        return Pieces(
            time=time * units.time,
            pace=pace * units.time,
            p=moving["p"],
            R=moving["R"],
            v=moving["v"],
            w=moving["w"],
            effort=effort * in_named[0],
            coupling=coupling * in_named[2],
            drive=drive,
            loop=loops.reshape(*shape, len(m.loops), 6) * np.repeat([force, moment], 3),
            friction=friction,
            stops=stops,
            force=forces[..., :count, :] * force,
            place=of_contacts[..., :count, 3:6] * length,
            normal=of_contacts[..., :count, 6:],
            rolling=turning[False],
            spinning=turning[True],
            modes=self._modes(mode),
            coarse=coarse,
        )

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

    def _cut(self, stretch: Stretch[ContactMode], *, whole: bool = False) -> Iterator[_Piece]:
        """Pieces of a stretch; ``whole``: with the steps before the line of a slip that stops."""
        if isinstance(stretch, BegunSlip):
            edges = np.linspace(stretch.start, stretch.end, _PARTS + 1)
            for start, end in pairwise(edges):
                yield from self._parts(
                    start, end, lambda times: stretch.at(times).T, stretch.recorded if stretch.compiled else None
                )
        elif isinstance(stretch, StoppingSlip):
            # In the steps before its line, a slip has a direction by round-off alone
            begins = [stretch.start, *(step.time for step in stretch.steps)] if whole else [float(stretch.line[-1])]
            for start, end in pairwise([*begins, stretch.end]):
                if end > start:
                    yield from self._parts(start, end, lambda times: stretch.at(times).T, None)
        elif isinstance(stretch, CompiledStretch) and stretch.by is not None:
            recorded = stretch.by.record_of(stretch.mode, stretch.start)
            for start, end, inside_step in stretch.by.steps_of(stretch):
                yield from self._parts(start, end, inside_step, recorded, paced=True)
        elif stretch.dense:
            together = 1 if stretch.exact else _TOGETHER
            for begin in range(0, len(stretch.dense), together):
                steps = stretch.dense[begin : begin + together]
                start, last = steps[0][0], min(steps[-1][1], stretch.end)
                inside = steps[0][2] if len(steps) == 1 else partial(states_inside, steps)
                for piece in self._parts(start, last, inside, None) if last > start else ():
                    yield piece._replace(coarse=not stretch.exact)
        elif stretch.end > stretch.start:  # nothing moves
            half = (stretch.end - stretch.start) / 2
            states = np.repeat(stretch.first[None], len(POINTS), 0)
            yield _Piece((stretch.start + stretch.end) / 2 + half * POINTS, np.full(len(POINTS), half), states)

    def _rough(self, states: Array, span: float, record: Array | None = None) -> bool:
        """True if points do not resolve the states, (state, points), and turns of a piece, which takes a ``span``."""
        if _unresolved(states):
            return True
        if record is not None and len(record):
            moving = record[: 18 * len(self._mechanism.bodies)].reshape(-1, 18, len(POINTS))
            turning, spins = moving[:, 3:12], moving[:, 15:]
        else:
            turning, spins = self._turns(states)
        if float(np.abs(spins).max(initial=0.0)) * span > _TURN:
            return True
        # no state has a prescribed motion, which may turn bodies as no polynomial of the points does
        return bool(self._mechanism.prescribed) and _unresolved(turning.reshape(-1, len(POINTS)))

    def _turns(self, states: Array) -> tuple[Array, Array]:
        """Rotations and angular velocities of the bodies [rad/s] at states of a piece, (state, points).

        Where no motion is prescribed, which no state contains, those at both ends suffice.
        """
        rows = states.T if self._mechanism.prescribed else states.T[[0, -1]]
        poses = [self._route.bodies(y) for y in rows]
        turning = np.array([Rotation.from_quat(pose[2], scalar_first=True).as_matrix() for pose in poses]).T
        return turning, np.array([pose[3] for pose in poses])

    def _parts(
        self,
        start: float,
        end: float,
        inside: Callable[[Array], Any],
        recorded: Callable[[Array], tuple[Array, Array]] | None,
        *,
        paced: bool = False,
        depth: int = 0,
    ) -> Iterator[_Piece]:
        """Pieces of a step between values of its variable, halved until their points resolve states and turns.

        ``recorded``: record at states and rate of the time by that variable, which counts if it is ``paced``.
        """
        places = (start + end) / 2 + (end - start) / 2 * POINTS
        states = np.asarray(inside(places))
        time = states[-1] if paced else places
        record, pace = (np.zeros((0, 0)), np.ones(1)) if recorded is None else recorded(states)
        if depth < _HALVINGS and self._rough(states, time[-1] - time[0], record):
            middle = (start + end) / 2
            yield from self._parts(start, middle, inside, recorded, paced=paced, depth=depth + 1)
            yield from self._parts(middle, end, inside, recorded, paced=paced, depth=depth + 1)
            return
        rate = np.full(len(POINTS), (end - start) / 2) * (pace if paced else 1.0)
        yield _Piece(time, rate, states.T, record.T if len(record) else None)


def _unresolved(values: Array) -> bool:
    """True if the points of a piece do not resolve one of the values on it, (values, points)."""
    coefficients = np.abs(TO_SERIES @ values.T)
    return bool((coefficients[-2:].max(0) > RESOLVED * np.maximum(1.0, coefficients.max(0))).any())
