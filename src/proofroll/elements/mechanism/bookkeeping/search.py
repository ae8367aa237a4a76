"""Search for the mistake of bookkeeping with which a robot in the air moves as it was seen to move.

Each mistake is tried by a motion of its own, at the step of the program that is judged and with each way in which
programs treat gains. Most are given up at the first samples.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from proofroll.core.diagnosis.fitting import least_squares_parameters
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism.bookkeeping.air import SCHEMES, AirRobot, Scheme, steps_in_air
from proofroll.elements.mechanism.bookkeeping.law import ControlLaw
from proofroll.elements.mechanism.bookkeeping.mistakes import Mistake, fitted, mistakes, offsets_told
from proofroll.elements.mechanism.joint_kinds import WITH_QUATERNION, JointKind
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.rotations import Array

SHOWN = 0.1  # s: a mistake of bookkeeping shows in the air within it
WHOLE = 1e-6  # part of a step by which an interval may miss a whole number of steps
_RATES = 0.05  # s: weight of velocities beside places, the time in which a mistake shows
_CLOSES = 0.05  # part of a distance that an explanation may leave
_FIRST = 4  # pairs are made of so many best mistakes, each with every other one
_SMALL = 1e-3  # least size that slopes are scaled by [rad, m, kg m² or 1]
_CHANGED = 1e-2  # least change of a fitted size that is no error of a step
# Distance that is none; the same in parts of the rounding of the motion's numbers.
_NOTHING, _OF_ROUNDING = 1e-9, 30.0
# Part of the distance that a window has to show, and its least samples; part that a mistake may leave in it at first.
_SHOWS, _LEAST, _NEAR = 0.2, 3, 0.4
_OPPOSITE: tuple[Scheme, ...] = ("explicit", "implicit")  # schemes that differ most
_CLOSES_AT_START = 1e-3  # part of the distance of accelerations that an explanation may leave
_FOR_A_SIZE = 3.0  # what a fitted size must be better by


@dataclass(frozen=True)
class SeenMotion:
    """Motion of a robot in the air, from time 0 at equal intervals.

    Attributes:
        time: [s].
        q, v: coordinates and velocities of the mechanism, (times, nq) and (times, nv).
        rounding: of its numbers.
    """

    time: Array
    q: Array
    v: Array
    rounding: float = 0.0

    @property
    def bar(self) -> float:
        """Distance from another motion that is none."""
        return max(_NOTHING, _OF_ROUNDING * self.rounding)

    def until(self, end: float) -> SeenMotion:
        """The motion up to a time [s]."""
        count = int(np.searchsorted(self.time, end * (1 + 1e-9), side="right"))
        return replace(self, time=self.time[:count], q=self.q[:count], v=self.v[:count])


@dataclass(frozen=True)
class MistakesFound:
    """Mistakes that explain a motion.

    Attributes:
        mistakes: one or two; none: the motion without a mistake.
        sizes: of each; 1 where it has none.
        scheme: with which the motion comes out.
        after: largest distance from the motion that was seen [rad, m, or 20 times as many per second].
    """

    mistakes: tuple[Mistake, ...]
    sizes: tuple[float, ...]
    scheme: Scheme
    after: float

    @property
    def sentence(self) -> str:
        """All mistakes with their sizes."""
        return "; and ".join(item.sentence(size) for item, size in zip(self.mistakes, self.sizes, strict=True))

    @property
    def fitted(self) -> int:
        """Number of fitted sizes."""
        return sum(item.sized + item.numbers for item in self.mistakes)


@dataclass
class _Search:
    mechanism: Mechanism
    law: ControlLaw
    seen: SeenMotion
    step: float
    robots: dict[tuple[bytes, float], AirRobot] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.stride = round(float(self.seen.time[1] - self.seen.time[0]) / self.step)
        self.turning = np.zeros(self.mechanism.nq, dtype=bool)
        self.quaternions = []
        for joint, at in zip(self.mechanism.joints, self.mechanism.q_slices, strict=True):
            self.turning[at] = joint.kind == JointKind.REVOLUTE
            if joint.kind in WITH_QUATERNION:
                self.quaternions.append(slice(at.stop - 4, at.stop))
        self.schemes: list[Scheme] = [name for name in SCHEMES if self.quaternions or not name.endswith("_base")]

    def robot(self, law: ControlLaw) -> AirRobot:
        """Robot with the armature and the gravity of a law."""
        key = (law.armature.tobytes(), law.gravity)
        if key not in self.robots:
            self.robots[key] = AirRobot(self.mechanism, law)
        return self.robots[key]

    def apart(self, row: int, q: Array, v: Array) -> Array:
        """Differences between a state and the one seen at a sample."""
        off = q - self.seen.q[row]
        off[self.turning] = (off[self.turning] + math.pi) % (2 * math.pi) - math.pi
        for at in self.quaternions:
            off[at] = 2 * (q[at] * np.sign(q[at] @ self.seen.q[row][at]) - self.seen.q[row][at])
        return np.concatenate([off, _RATES * (v - self.seen.v[row])])

    def differences(self, law: ControlLaw, scheme: Scheme, count: int, bound: float = math.inf) -> list[Array]:
        """Differences at the first samples, until one exceeds the bound or the motion blows up."""
        found: list[Array] = []
        start = (self.seen.q[0].copy(), self.seen.v[0].copy())
        steps = steps_in_air(self.robot(law), law, start, self.step, scheme)
        try:
            for row, item in enumerate(itertools.islice(steps, 0, self.stride * (count - 1) + 1, self.stride)):
                found.append(self.apart(row, item.q, item.v))
                if not np.abs(found[-1]).max() <= bound:
                    break
        except (Diverged, Refused):
            pass
        return found

    def spread(self) -> float:
        """Distance between motions under the law by explicit and by implicit steps."""
        one, other = (np.array(self.differences(self.law, name, len(self.seen.time))) for name in _OPPOSITE)
        return float(np.abs(one - other).max()) if one.shape == other.shape else math.inf

    def distance(self, law: ControlLaw, scheme: Scheme, bound: float = math.inf) -> float:
        """Largest difference at all samples; infinite if it exceeds the bound."""
        count = len(self.seen.time)
        found = self.differences(law, scheme, count, bound)
        if len(found) < count:
            return math.inf
        largest = max(float(np.abs(item).max()) for item in found)
        return largest if largest <= bound else math.inf

    def fitted(
        self, chosen: Sequence[Mistake], sizes: Sequence[float], scheme: Scheme, count: int, rounds: int = 8
    ) -> tuple[float, ...]:
        """Sizes of mistakes with which the first samples fit best."""
        at, found = [k for k, item in enumerate(chosen) if item.sized], np.array(sizes, dtype=float)

        def law(values: Array) -> ControlLaw:
            trial = found.copy()
            trial[at] = np.maximum(values, 0.0)
            return changed(self.law, chosen, trial.tolist())

        if at:
            found[at] = np.maximum(self.fit(law, found[at], scheme, count, rounds), 0.0)
        return tuple(found.tolist())

    def fit(self, law: Callable[[Array], ControlLaw], start: Array, scheme: Scheme, count: int, rounds: int) -> Array:
        """Numbers of a law with which the first samples fit best."""
        scale = np.maximum(np.abs(start), _SMALL)

        def left(parts: Array) -> Array:
            differences = self.differences(law(scale * parts), scheme, count)
            return np.concatenate(differences) if len(differences) == count else np.array(np.nan)

        return np.asarray(scale * least_squares_parameters(left, start / scale, 1.0, rounds))


def changed(law: ControlLaw, chosen: Sequence[Mistake], sizes: Sequence[float]) -> ControlLaw:
    """The law with some mistakes of these sizes."""
    for item, size in zip(chosen, sizes, strict=True):
        law = item.changed(law, size)
    return law


@dataclass(frozen=True)
class MistakeSearch:
    """Result of a search.

    Attributes:
        before: distance without a mistake, with the scheme that suits best.
        scheme: the one that suits best without a mistake.
        spread: distance between two motions without a mistake, by the two schemes that differ most.
        explanations: the best first; empty if no known mistake explains the motion, or none is needed.
    """

    before: float
    scheme: Scheme
    spread: float
    explanations: tuple[MistakesFound, ...]


def explained(
    mechanism: Mechanism, law: ControlLaw, seen: SeenMotion, step: float, *, deep: bool = True
) -> MistakeSearch:
    """Mistakes that explain the motion of a robot in the air.

    Args:
        mechanism: the robot.
        law: its controller's law as it should be.
        seen: motion that a program says it made; its interval is a whole number of steps.
        step: of the program [s].
        deep: True if another pose and pairs of mistakes are tried where none alone explains it.

    Raises:
        InputError: the step does not divide the time between instants.
    """
    search = _Search(mechanism, law, seen, step)
    plain = {scheme: search.distance(law, scheme) for scheme in search.schemes}
    scheme = min(plain, key=lambda name: plain[name])
    before = plain[scheme]
    if before <= seen.bar:
        return MistakeSearch(before, scheme, search.spread(), ())
    trial = _Trial(search, before, scheme)
    every = mistakes(law)
    found = trial.best([(item,) for item in every])
    if not found and deep:
        found = sorted(trial.other_pose(), key=lambda item: item.after)[:1]
    if not found and deep:
        firsts = sorted(every, key=trial.promise)[:_FIRST]
        both = {frozenset((first.words, second.words)): (first, second) for first in firsts for second in every}
        found = trial.best([pair for pair in both.values() if pair[0].id != pair[1].id])
    return MistakeSearch(before, scheme, search.spread(), tuple(found))


def explained_start(mechanism: Mechanism, law: ControlLaw, acceleration: Array) -> MistakeSearch:
    """Mistakes that explain accelerations (nv) at the start of a mechanism; distances are in 1/s².

    They tell nothing of what shows later, as targets that come late after the first.
    """
    q, v = mechanism.start()

    def off(trial: ControlLaw) -> Array:
        robot = AirRobot(mechanism, trial)
        first = next(steps_in_air(robot, trial, (q, v), 1 / trial.rate, "explicit"))
        return robot.equations.solve(q, v, load=robot.load(first.efforts)).acceleration - acceleration

    before = float(np.abs(off(law)).max())
    found = []
    for item in mistakes(law):
        sizes = [1.0]
        if item.sized:
            sizes = [fitted(lambda size, item=item: off(item.changed(law, size)), start) for start in item.starts]  # type: ignore[misc]  # bound now
        pairs = [(float(np.abs(off(item.changed(law, size))).max()), size) for size in sizes]
        after, size = min(pairs)
        if after <= _CLOSES_AT_START * before and _differs(item, size):
            found.append(MistakesFound((item,), (size,), "explicit", after))
    found.sort(key=lambda item: item.after * (_FOR_A_SIZE if item.fitted else 1))
    return MistakeSearch(before, "explicit", 0.0, tuple(found))


class _Trial:
    """Mistakes tried one after another.

    Attributes:
        search: motions.
        before: distance without a mistake.
        first: schemes that are tried first: those that differ most, and the one that suits best without a mistake.
        window: number of the first samples in which a good part of the distance shows.
    """

    def __init__(self, search: _Search, before: float, scheme: Scheme) -> None:
        self.search, self.before, self.first = search, before, tuple(dict.fromkeys((*_OPPOSITE, scheme)))
        count = len(search.seen.time)
        largest = [float(np.abs(item).max()) for item in search.differences(search.law, scheme, count)]
        shows = next((row for row, size in enumerate(largest) if size >= _SHOWS * before), count - 1)
        self.window = min(count, max(_LEAST, shows + 2))
        self.plain = max(largest[: self.window], default=before)

    def best(self, choices: Sequence[tuple[Mistake, ...]]) -> list[MistakesFound]:
        """Explanations by these choices, the best first."""
        found = []
        for chosen in choices:
            tried = [*self.tried(chosen)]
            found += [min(tried, key=lambda item: item.after)] if tried else []
        real = [item for item in found if all(map(_differs, item.mistakes, item.sizes))]
        return sorted(real, key=lambda item: item.after * (_FOR_A_SIZE if item.fitted else 1))

    def tried(self, chosen: tuple[Mistake, ...]) -> Iterator[MistakesFound]:
        """Explanations by mistakes at once: with each scheme, if with one of two they come near in the window."""
        count, bound = len(self.search.seen.time), _CLOSES * self.before
        near = [rough for scheme in self.first if (rough := self.rough(chosen, scheme)) is not None]
        if not near:
            return
        sizes, _ = min(near, key=lambda item: item[1])
        fits = any(item.sized for item in chosen)
        for scheme in self.search.schemes:
            trial = self.search.fitted(chosen, sizes, scheme, self.window) if fits else sizes
            if fits:
                left = self.search.differences(changed(self.search.law, chosen, trial), scheme, self.window, bound)
                if len(left) < self.window or not np.abs(left[-1]).max() <= bound:
                    continue
                trial = self.search.fitted(chosen, trial, scheme, count, rounds=3)
            after = self.search.distance(changed(self.search.law, chosen, trial), scheme, bound)
            if math.isfinite(after):
                yield MistakesFound(chosen, trial, scheme, after)

    def rough(self, chosen: tuple[Mistake, ...], scheme: Scheme) -> tuple[tuple[float, ...], float] | None:
        """Sizes with which mistakes come near in the window, and the distance; None: they do not."""
        found, bound = [], _NEAR * self.plain
        for start in itertools.product(*(item.starts if item.sized else (1.0,) for item in chosen)):
            sizes = start
            if any(item.sized for item in chosen):
                sizes = self.search.fitted(chosen, start, scheme, self.window, rounds=4)
            left = self.search.differences(changed(self.search.law, chosen, sizes), scheme, self.window, bound)
            largest = max((float(np.abs(item).max()) for item in left), default=math.inf)
            if len(left) == self.window and largest <= bound:
                found.append((sizes, largest))
        return min(found, key=lambda item: item[1]) if found else None

    def other_pose(self) -> Iterator[MistakesFound]:
        """Explanations by another default pose, one number for each joint."""
        law, count, bound = self.search.law, len(self.search.seen.time), _CLOSES * self.before

        def moved(values: Array) -> ControlLaw:
            pose = law.pose + values
            held = law.targets if law.policy is not None else tuple((np.array(law.targets) + values).tolist())
            return law.change(pose=pose, targets=held)

        if law.policy is None and not all(isinstance(item, float) for item in law.targets):
            return
        none, near = np.zeros(len(law.joints)), []
        for scheme in self.first:
            values = self.search.fit(moved, self.search.fit(moved, none, scheme, self.window, 3), scheme, count, 5)
            near.append((self.search.distance(moved(values), scheme), tuple(values.tolist())))
        distance, best = min(near)
        for scheme in self.search.schemes if distance <= _NEAR * self.before else ():
            values = self.search.fit(moved, np.array(best), scheme, count, 3)
            after = self.search.distance(moved(values), scheme, bound)
            if math.isfinite(after):
                told = offsets_told(law.joints, values)
                item = Mistake("pose", told, "target", partial(_scaled_by, moved, values), numbers=len(values))
                yield MistakesFound((item,), (1.0,), scheme, after)

    def promise(self, item: Mistake) -> float:
        """Mean square of the difference that a mistake leaves, the less the better; sizes are fitted in the window."""
        count, left = len(self.search.seen.time), []
        for start in item.starts if item.sized else (1.0,):
            sizes: tuple[float, ...] = (start,)
            if item.sized:
                sizes = self.search.fitted((item,), sizes, "explicit", self.window, rounds=4)
            found = self.search.differences(changed(self.search.law, (item,), sizes), "explicit", count)
            left.append(float(np.mean(np.square(found))) if len(found) == count else math.inf)
        return min(left)


def _scaled_by(law: Callable[[Array], ControlLaw], values: Array, _: ControlLaw, size: float) -> ControlLaw:
    return law(size * values)


def _differs(item: Mistake, size: float) -> bool:
    """True if a size is no error of a step."""
    return not item.sized or item.id == "gravity" or abs(size - 1) > _CHANGED
