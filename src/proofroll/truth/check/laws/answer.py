"""The check of an answer: what a truth publishes, held against the motion that was followed and against the laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.contacts import slip_of
from proofroll.truth.check.laws.impacts import held
from proofroll.truth.check.laws.integrals import cross, integral
from proofroll.truth.check.laws.joints import law_of, target_of
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.motion import Turns, changed_velocity, laws_at_all_times, start_of
from proofroll.truth.check.laws.record import SPREAD, Array, BodyPoses, Modes, PublishedEvent, PublishedValues
from proofroll.truth.check.laws.residuals import COARSE, INSTANT, LAWS, STRUCK, LawResiduals
from proofroll.truth.check.laws.samples import force_laws, kinetic_energy, on_the_motion
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.signals import value_of
from proofroll.truth.check.laws.strikes import kicked, strikes_follow, struck_borders
from proofroll.truth.check.laws.tiles import Places, Tiles
from proofroll.truth.check.laws.values import values_follow

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Mechanism


_GROWTH = 1e3  # natural accelerations by which velocities may grow in the instant before a slip has a direction
_ROOM = 1e-11  # accuracy of the time of an event, relative to it and to a second
_LAST_REBOUNDS = 1e-4  # natural times that rebounds take which are summed, where their ratio is not known
_BEFORE_END = 1e-6  # part of the time before the end of a motion in which an event may be left out


def changes_of(scene: LawScene, tiles: Tiles, published: PublishedValues, residuals: LawResiduals, last: float) -> None:
    """Checks all events before a ``last`` time [s]."""
    borders = np.flatnonzero(tiles.stretch[1:] != tiles.stretch[:-1])
    ends, begins, jumps = tiles.time[borders, -1], tiles.time[borders + 1, 0], changed_velocity(scene, tiles)[borders]
    hits, slips = list[PublishedEvent](), _slips(scene, tiles)
    for number, end, begin, jump in zip(borders.tolist(), ends.tolist(), begins.tolist(), jumps.tolist(), strict=True):
        if end >= last * (1 - _BEFORE_END):
            continue
        room = _ROOM * (1 + begin)
        near = [
            item
            for item in published.changes
            if item.low - room - _settling_time(scene, published.changes, item) <= begin
            and end <= item.high + room + (INSTANT / scene.rate if item.jumps else 0.0)  # a rebound that is none
        ]
        time = np.array([[begin]])
        least = STRUCK + _GROWTH * scene.rate * max(begin - end, 0.0)
        if jump > least and not any(item.jumps for item in near):
            residuals.note("change", "a jump of velocities", np.ones((1, 1)), 1.0, time)
        turned = {name for name, slip in slips if slip[number, -2] @ slip[number + 1, 1] < 0}
        for names in (_changed(scene, tiles.modes[number], tiles.modes[number + 1]), turned):
            if names and not any(_of(item.name, name) for item in near for name in names):
                residuals.note("change", min(names), np.ones((1, 1)), 1.0, time)
        hits += near if jump > least else []
    contacts = {contact.name for contact in scene.contacts if contact.alone}
    for item in published.changes:
        if item.of_effort or item.time >= last * (1 - _BEFORE_END):
            continue
        apart = np.maximum(
            np.maximum(ends - item.high, item.low - _settling_time(scene, published.changes, item) - begins), 0.0
        )
        apart = np.append(apart, abs(item.time) if item.time <= 0 else np.inf)
        off = max(min(float(apart.min()), 1 + item.time), item.low - item.time, item.time - item.high)
        residuals.note("change", item.name, np.array([[off]]), 1 + abs(item.time), np.array([[item.time]]))
        if item.strikes and item.low > 0 and item.name in contacts and item not in hits:
            residuals.note("change", item.name, np.ones((1, 1)), 1.0, np.array([[item.time]]))


def _settling_time(scene: LawScene, changes: Sequence[PublishedEvent], item: PublishedEvent) -> float:
    """Time before a settling, and what follows it at once, at which the motion may rest already [s].

    That is twice the time that rebounds take in their last ratio.
    """
    if not any(entry.settles and abs(entry.time - item.time) <= _ROOM * (1 + item.time) for entry in changes):
        return 0.0
    hits = [entry.time for entry in changes if entry.strikes and entry.name == item.name and entry.time < item.time]
    spans, least = np.diff(hits[-3:]), _LAST_REBOUNDS / scene.rate
    if len(spans) < 2 or not 0 < spans[1] < spans[0]:
        return least
    ratio = float(spans[1] / spans[0])
    return max(least, 2 * float(spans[1]) * ratio / (1 - ratio))


def _of(event: str, place: str) -> bool:
    """True if an event of a pair or joint is that of a place, which may be one of several."""
    return place == event or place.startswith(f"{event}.")


def _changed(scene: LawScene, sooner: Modes, later: Modes) -> set[str]:
    """Names of contacts and joints whose modes differ."""
    places = zip(scene.contacts, sooner.contacts, later.contacts, strict=True)
    names = {contact.name for contact, mode, next_mode in places if mode != next_mode}
    for number, joint in enumerate(scene.mechanism.joints):
        modes = [(item.friction[number], item.stops[number]) for item in (sooner, later)]
        names |= {joint.name} if modes[0] != modes[1] else set()
    return names


def _slips(scene: LawScene, tiles: Tiles) -> list[tuple[str, Array]]:
    """Names of joints and contacts with friction, and what slips in all tiles [m/s, rad/s]; 0 where they stick."""
    of_joints = [
        (joint.name, scene.free(number, tiles)[0].rate[..., None], [mode.friction[number] for mode in tiles.modes])
        for number, joint in enumerate(scene.mechanism.joints)
        if joint.friction
    ]
    of_contacts = [
        (contact.name, slip_of(contact, tiles), [mode.contacts[k] for mode in tiles.modes])
        for k, contact in enumerate(scene.contacts)
        if contact.pair.friction and {"plane", "sphere"} & {contact.shape_a.kind, contact.shape_b.kind}
    ]
    slipping = ((name, slip, np.array(modes) == "slip") for name, slip, modes in (*of_joints, *of_contacts))
    return [(name, slip * slips[:, None, None]) for name, slip, slips in slipping]


def works_follow(
    scene: LawScene, tiles: Tiles, turns: Turns, places: Places, published: PublishedValues, residuals: LawResiduals
) -> None:
    """Checks works of drives at samples, whose places in tiles are given."""
    names = [name for name in published.values if name.startswith("work.")]
    if not names:
        return
    control, bars = scene.mechanism.control, published.bars
    natural = scene.mass.sum() * scene.speed**2
    for data in scene.mechanism.actuators:
        if control is not None and data.name in control.actuators:
            continue
        number = scene.mechanism.joint_index[data.joint]
        rate = scene.free(number, tiles)[0].rate
        force = law_of(data, value_of(data.target, tiles.time), turns[number, 0], rate)
        work, size = (_summed(values, tiles) for values in (force * rate, np.abs(force * rate)))
        name = f"work.effort.{data.name}"
        _note(
            name, (published.values[name], places.at(work), natural + places.at(size)), published, residuals, bars[name]
        )
    rubs = [k for k, contact in enumerate(scene.contacts) if contact.pair.friction]
    if any(
        {"slip", SPREAD} & {*(mode.contacts[k] for k in rubs), *mode.rolling, *mode.spinning} for mode in tiles.modes
    ):
        return
    energy, parts = kinetic_energy(scene, tiles)
    lost, borders = np.zeros(len(energy)), struck_borders(scene, tiles)  # by what is struck
    lost[borders + 1] = energy[borders + 1, 0] - energy[borders, -1]
    loads = BodyLoads(scene, tiles)
    power, size = loads.power + 0.0, loads.power_size + 0.0
    for number in range(len(scene.mechanism.joints)):
        joint_power = _passive_power(scene, tiles, turns, number)
        power, size = power + joint_power, size + np.abs(joint_power)
    work = energy - energy[0, 0] - _summed(power, tiles) + (kicked(scene, tiles) - np.cumsum(lost))[:, None]
    sizes = natural + places.at(_summed(size, tiles) + parts) + float(parts[0, 0])
    value = np.sum([published.values[name] for name in names], axis=0)
    _note("all drives", (value, places.at(work), sizes), published, residuals, sum(bars[name] for name in names))


def held_efforts(
    scene: LawScene, tiles: Tiles, turns: Turns, places: Places, published: PublishedValues, residuals: LawResiduals
) -> None:
    """Checks efforts that a controller holds: they follow from the state at the instant at which it sets them."""
    control, natural = scene.mechanism.control, scene.force * scene.length
    if control is None or control.held != "effort" or control.policy is not None:
        return
    first_tiles = np.searchsorted(tiles.stretch, tiles.stretch[places.tile])  # tile with which the stretch begins
    for k, data in enumerate(scene.mechanism.actuators):
        if data.name not in control.actuators:
            continue
        number = scene.mechanism.joint_index[data.joint]
        begun, effort = turns[number, 0][first_tiles, :1], published.pieces.effort[..., k]
        rates = scene.free(number, tiles)[0].rate[first_tiles, :1]
        law = law_of(data, target_of(control, data, published.pieces.time), begun, rates)
        residuals.note("effort", data.name, effort - law, np.abs(effort) + natural, published.pieces.time)


def _note(
    name: str, values: tuple[Array, Array, Array], published: PublishedValues, residuals: LawResiduals, bar: float
) -> None:
    """Takes a published work, that of the laws, and its size [J]."""
    value, work, size = values
    residuals.note("work", name, (value - work)[:, None], size[:, None], published.pieces.time, bar)


def _summed(values: Array, tiles: Tiles) -> Array:
    """Integral since the start at the points of tiles."""
    parts = integral(values, tiles.pace)
    ends = np.concatenate([[0.0], np.cumsum(parts[:, -1])[:-1]])
    return np.asarray(parts + ends[:, None])


def _passive_power(scene: LawScene, tiles: Tiles, turns: Turns, number: int) -> Array:
    """Power of the spring, the damper, the torque and the dry friction of a joint."""
    joint, total = scene.mechanism.joints[number], np.zeros(tiles.time.shape)
    if joint.kind == JointKind.FREE:
        return total
    for k, (_, rate, _) in enumerate(scene.free(number, tiles)):
        force = -joint.damping * rate
        if joint.nq in {1, 2}:
            force = force - joint.stiffness * (turns[number, k] - joint.rest)
        if joint.nq == 1:
            force = force + value_of(joint.torque, tiles.time) - joint.friction * np.sign(rate)
        total = total + force * rate
    return total


_BESIDE = 1e-9  # time beside the end of a stretch, relative to it and to a second, that counts as that end
_UNCERTAIN = 4e-5  # part of the time before a horizon in which what it hangs on may happen, and is no event
_EXACT = 1e-14  # round-off of times, relative to them and to a second
_INSTANT = 1e-6  # part of an interval of a controller beside an instant, where forces are those of either side


class AnswerCheck:
    """Laws of a mechanism, to which what a truth publishes is held.

    Attributes:
        residuals: remainders of the laws.
        samples, held: numbers of samples, and of those on a piece of the motion.
        between: number of stretches in whose middle laws are held.
    """

    def __init__(self, mechanism: Mechanism, length: float, rate: float) -> None:
        """Takes a mechanism in SI units with its natural length [m] and rate [1/s]."""
        self._scene = LawScene(mechanism, length, rate)
        self.residuals, self.samples, self.held = LawResiduals(rate=rate, known_alone=True), 0, 0
        self.between = 0

    def take(
        self,
        published: PublishedValues,
        tiles: Tiles,
        asked: Array,
        end: float,
        horizon: float,
        between: PublishedValues | None = None,
    ) -> None:
        """Checks an answer.

        Args:
            published: the answer.
            tiles: the motion that was followed.
            asked: times that were asked for [s].
            end: time before which the truth ends, or inf [s].
            horizon: time from which the question is ill-posed, or inf [s]: from there on nothing is held.
            between: motion and forces in the middle of each stretch.
        """
        scene, residuals, time = self._scene, self.residuals, published.pieces.time[:, 0]
        residuals.coarse = COARSE if tiles.coarse else 1.0
        self.samples = len(time)
        self._times(time, asked, end)
        if not np.isfinite(published.pieces.p).all():  # a motion that is not unique has no values
            return
        last, sure = float(time[-1]), horizon * (1 - _BESIDE)
        if not sure > 0:
            return
        tiles = tiles.ordered(np.flatnonzero(tiles.time[:, 0] <= min(sure, max(last, tiles.time[0, 0]))))
        last = min(last, sure)
        turns = laws_at_all_times(scene, tiles, residuals, last)
        struck = any(item.jumps and item.low <= 0 for item in published.changes)
        for moving in (published.pieces, tiles):
            if moving.time[0, 0] == 0:
                start_of(scene, moving, residuals, struck)
                break
        changes_of(scene, tiles, published, residuals, min(last, horizon - _UNCERTAIN * max(1 / scene.rate, horizon)))
        strikes_follow(scene, tiles, turns, published, residuals, min(last, sure))
        reached = time.copy()
        for item in published.changes:  # within the bracket of an event a sample is that of the later side
            reached[(item.low <= time) & (time < item.time)] = item.time
        places = tiles.holding(reached)
        # of a sample at the last time where stretches meet, which is that of the later side, there is no piece
        late = (time >= tiles.time[-1, -1] - _BESIDE * (1 + time)) & self._at_borders(published.pieces.time, tiles)
        for item in published.changes:  # at an instant of an impact values are of either side
            late |= item.jumps & (item.low - _EXACT * (1 + time) <= time) & (time <= item.high + _EXACT * (1 + time))
        rows = np.flatnonzero(places.held & (time < sure) & ~late)
        self.held = len(rows)
        if rows.size:
            published, places = self._of(published, turns, places, rows)
            determinate_reactions(scene, published, residuals)
            works_follow(scene, tiles, turns, places, published, residuals)
            first = tiles.at(np.ix_([0], [0]), self._turns(turns, tiles.holding(tiles.time[0, :1])))
            begun = first.time[0, 0] == 0 and not struck
            values_follow(scene, published, residuals, first if begun else published.pieces)
            self._forces(published, tiles, places)
        if between is not None:
            time = between.pieces.time[:, 0]
            places = tiles.holding(time)
            apart = ~self._at_borders(between.pieces.time, tiles)
            rows = np.flatnonzero(places.held & (time < min(sure, end * (1 - _BESIDE))) & apart)
            self.between = len(rows)
            if rows.size:
                between, places = self._of(between, turns, places, rows)
                held_efforts(scene, tiles, turns, places, between, residuals)
                self._forces(between, tiles, places)

    def _of(
        self, published: PublishedValues, turns: Turns, places: Places, rows: NDArray[np.intp]
    ) -> tuple[PublishedValues, Places]:
        """Some samples with their whole turns, and their places."""
        published, places = published.of(rows), places.of(rows)
        return replace(published, pieces=replace(published.pieces, turns=self._turns(turns, places))), places

    def _forces(self, published: PublishedValues, tiles: Tiles, places: Places) -> None:
        """Checks that samples at places are on the motion, and their forces where these do not jump."""
        scene, residuals = self._scene, self.residuals
        on_the_motion(scene, tiles, places, published, residuals)
        modes = [tiles.modes[tile] for tile in places.tile]
        between = ~(
            self._at_instants(published.pieces.time[:, 0]) | self._at_borders(published.pieces.time, tiles, kinks=True)
        )
        for mode in dict.fromkeys(modes):
            chosen = np.flatnonzero(np.array([item == mode for item in modes]) & between)
            if chosen.size:
                part = published.of(chosen)
                part = replace(part, pieces=replace(part.pieces, modes=mode))
                force_laws(scene, tiles, places.of(chosen), part, residuals)

    def sentence(self) -> str:
        """Clause on the samples that hold all laws."""
        laws = sum(law in self.residuals.largest for law in LAWS)
        middles = f" and in the middle of {self.between} stretch{'es' * (self.between != 1)}" if self.between else ""
        return f"what is published holds {laws} laws at {self.held} of {self.samples} samples{middles}"

    def _times(self, time: Array, asked: Array, end: float) -> None:
        """Samples are those that were asked for, and none before the end is missing."""
        residuals, count = self.residuals, min(len(time), len(asked))
        due = int(np.sum(asked < end * (1 - _INSTANT))) if np.isfinite(end) else len(asked)
        off = np.abs(time[:count] - asked[:count]) / (1 + np.abs(asked[:count]))
        residuals.note("times", "", off[:, None], 1.0, time[:count, None])
        if len(time) < due or len(time) > len(asked):
            residuals.note("times", "a sample", np.ones((1, 1)), 1.0, time[-1:, None])

    def _turns(self, turns: Turns, places: Places) -> Array:
        """Coordinates at the samples for their whole turns, (samples, 1, joints, 2)."""
        values = np.zeros((len(places.tile), 1, len(self._scene.mechanism.joints), 2))
        for (number, k), coordinates in turns.items():
            values[:, 0, number, k] = places.at(coordinates)
        return values

    def _at_borders(self, time: Array, tiles: Tiles, *, kinks: bool = False) -> NDArray[np.bool_]:
        """True where stretches meet, where forces are of either side; ``kinks``: of a scene with kinks at both ends."""
        ends = tiles.borders
        if kinks and self._scene.mechanism.kinks:
            ends = np.append(ends, [tiles.time[0, 0], tiles.time[-1, -1]])
        return np.asarray((np.abs(time - ends) <= _BESIDE * (1 + np.abs(ends))).any(1))

    def _at_instants(self, time: Array) -> NDArray[np.bool_]:
        """True at instants of a controller, where forces are those of either side."""
        control = self._scene.mechanism.control
        if control is None:
            return np.zeros(len(time), dtype=bool)
        return np.asarray(np.abs(time * control.rate - np.round(time * control.rate)) < _INSTANT)


_RANK = 1e-11  # singular value, relative to the largest, below which reactions are not independent
_FIXED, _FREE = 1e-9, 1e-4  # change of a component, relative to the largest, that is none, and that is one


def determinate_reactions(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Checks, without contacts, that unknown components change at one of three samples, and known ones at none."""
    wrenches, m = published.reactions[:, 0], scene.mechanism
    unknown, last, most = np.isnan(wrenches).all(0), len(wrenches) - 1, np.zeros(wrenches.shape[1:])
    if scene.contacts or not (unknown.any() or m.loops):
        return
    for row in {0, last // 2, last}:
        most = np.maximum(most, _changes(scene, published.pieces.at([row])))
    # drives and couplings have reactions of their own, by which further components may change
    passive = not m.couplings and all(joint.motion is None for joint in m.joints)
    wrong = np.where(unknown, (most < _FIXED) & passive, (most > _FREE) & np.isfinite(wrenches).all(0))
    for connection, parts in zip(scene.connections, wrong, strict=True):
        residuals.note("unknown", connection.name, parts[None, None].astype(float), 1.0, published.pieces.time[:1])


def _changes(scene: LawScene, poses: BodyPoses) -> Array:
    """Change of each component, (connections, 6), by reactions that together move nothing, relative to the largest."""
    centres, reactions, columns = scene.centres(poses)[0][0, 0], list[Array](), list[Array]()
    for number, connection in enumerate(scene.connections):
        place = scene.placed(connection, poses).origin_b[0, 0]
        for force, moment in held(scene, poses, connection):
            reactions.append(np.zeros((len(scene.connections), 6)))
            reactions[-1][number] = *force, *moment
            effect = np.zeros((len(scene.mass), 6))
            for body, sign in ((connection.b, 1.0), (connection.a, -1.0)):
                effect[body] += sign * np.array([*force, *(cross(place - centres[body], force) + moment)])
            columns.append(effect[:-1].ravel())
    if not columns:
        return np.zeros((len(scene.connections), 6))
    _, sizes, vectors = np.linalg.svd(np.array(columns).T)
    null = vectors[int((sizes > _RANK * sizes.max(initial=0.0)).sum()) :]
    changes = np.linalg.norm(null @ np.array(reactions).reshape(len(reactions), -1), axis=0).reshape(-1, 6)
    return np.asarray(changes / max(float(changes.max(initial=0.0)), np.finfo(float).tiny))
