"""Search for the mistake of bookkeeping with which a robot in the air moves as it was seen to move.

Each mistake is tried by a motion of its own, at the step of the program that is judged and with each way in which
programs treat gains. Most are given up at the first samples.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.air import AirRobot, Scheme, steps_in_air
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import (
    Mistake,
    SearchTime,
    changed,
    fitted,
    mistakes,
    offsets_told,
)
from proofroll.robots.control.bookkeeping.screen import TREATMENTS, MistakeScreen, Screened, Treatment
from proofroll.robots.control.bookkeeping.seen import LawMotions, SeenMotion

# Most that is tried, where nothing simpler explains a motion.
Depth = Literal["a mistake", "a pair", "a pair with a pose"]
_CLOSES = 0.05  # part of a distance that an explanation may leave
EXACT = 1e-3  # part of a distance that leaves nothing to explain
_POSES = 5  # poses that are tried in full
_ALIKE = 100.0  # explanations whose squares in the screen differ by no more are all tried
_PAIRS = 8  # pairs that are tried in full
_CHANGED = 1e-2  # least change of a fitted size that is no error of a step
# Part of the distance that a window has to show, and its least samples; part that a mistake may leave in it at first.
_SHOWS, _LEAST, _NEAR = 0.2, 3, 0.4
_CLOSES_AT_START = 1e-3  # part of the distance of accelerations that an explanation may leave
_FOR_A_SIZE = 3.0  # what a fitted size must be better by


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


@dataclass(frozen=True)
class MistakeSearch:
    """Result of a search.

    Attributes:
        before: distance without a mistake, with the scheme that suits best.
        scheme: the one that suits best without a mistake.
        spread: distance between two motions without a mistake, by the two schemes that differ most.
        explanations: the best first; empty if no known mistake explains the motion, or none is needed.
        explicit: distance without a mistake, with kd at the velocity before a step.
        imitated: True if the motion is that of kd at the velocity after a step h, and that of explicit kd with an
            armature of h kd more at each joint as well, as where no effort is at its limit.
        tried: number of mistakes that were tried alone.
    """

    before: float
    scheme: Scheme
    spread: float
    explanations: tuple[MistakesFound, ...]
    explicit: float = 0.0
    imitated: bool = False
    tried: int = 0


def explained(
    mechanism: Mechanism,
    law: ControlLaw,
    seen: SeenMotion,
    step: float,
    depth: Depth = "a pair with a pose",
    time: SearchTime | None = None,
) -> MistakeSearch:
    """Mistakes that explain the motion of a robot in the air.

    Args:
        mechanism: the robot.
        law: its controller's law as it should be.
        seen: motion that a program says it made; its interval is a whole number of steps.
        step: of the program [s].
        depth: most that is tried, where nothing simpler explains the motion.
        time: of the search; None: as long as it needs.

    Raises:
        InputError: the step does not divide the time between instants.
    """
    search = LawMotions(mechanism, law, seen, step)
    plain = {scheme: search.distance(law, scheme) for scheme in search.schemes}
    scheme = min(plain, key=lambda name: plain[name])
    distance = plain[scheme]
    right = distance <= seen.bar
    trial = None if right else _Trial(search, distance, scheme, time or SearchTime())
    return MistakeSearch(
        before=distance,
        scheme=scheme,
        spread=search.spread(),
        explanations=() if trial is None else tuple(_explanations(trial, depth)),
        explicit=plain["explicit"],
        imitated=right and search.imitated(scheme),
        tried=0 if trial is None else len(trial.alone),
    )


def _divides(step: float, period: float) -> bool:
    """True if a time between instants is a whole number of steps [s], so that a program can act at that rate."""
    return abs(period / step - round(period / step)) <= 1e-6 * period / step


def _explanations(trial: _Trial, depth: Depth) -> list[MistakesFound]:
    """Explanations, the best first; the simplest are tried first, until nothing is left to explain."""
    law, step = trial.search.law, trial.search.step
    every = [item for item in mistakes(law) if item.id != "rate" or _divides(step, 1 / item.changed(law, 1.0).rate)]
    explanations = trial.best([(item,) for item in every], len(every) * len(TREATMENTS))
    if depth != "a mistake" and not trial.settled(explanations) and not trial.time.over:
        both = [pair for pair in itertools.combinations(every, 2) if _together(*pair)]
        explanations = _sorted([*explanations, *trial.best(both, _PAIRS)])
    if depth != "a mistake" and not trial.settled(explanations) and not trial.time.over:
        explanations = _sorted([*explanations, *trial.other_pose([None])])
    if depth == "a pair with a pose" and not trial.settled(explanations) and not trial.time.over:
        seconds = [item for item in every if item.id != "pose_missing" and math.isfinite(item.none)]
        explanations = _sorted([*explanations, *trial.other_pose(seconds)])
    return explanations


def _together(mistake: Mistake, second: Mistake) -> bool:
    """True if two mistakes can be made at once, and do not undo each other."""
    return mistake.id != second.id and {mistake.id, second.id} != {"clamp", "clamp_missing"}


def _sorted(explanations: Sequence[MistakesFound]) -> list[MistakesFound]:
    """Explanations, the best first; a second mistake, or a pose, has to close what a single one leaves."""
    return sorted(explanations, key=lambda item: item.after * _burden(item))


def _burden(item: MistakesFound) -> float:
    several = len(item.mistakes) > 1 or any(mistake.numbers for mistake in item.mistakes)
    return (_FOR_A_SIZE if item.fitted else 1.0) / (_CLOSES if several else 1.0)


def explained_start(mechanism: Mechanism, law: ControlLaw, acceleration: Array) -> MistakeSearch:
    """Mistakes that explain accelerations (nv) at the start of a mechanism; distances are in 1/s².

    They tell nothing of what shows later, as targets that come late after the first.
    """
    q, v = mechanism.start()

    def off(trial: ControlLaw) -> Array:
        robot = AirRobot(mechanism, trial)
        step = next(steps_in_air(robot, trial, (q, v), 1 / trial.rate, "explicit"))
        return robot.equations.solve(q, v, load=robot.load(step.efforts)).acceleration - acceleration

    distance = float(np.abs(off(law)).max())
    explanations = []
    for item in mistakes(law):
        sizes = [1.0]
        if item.sized:
            sizes = [fitted(lambda size, item=item: off(item.changed(law, size)), start) for start in item.starts]  # type: ignore[misc]  # bound now
        pairs = [(float(np.abs(off(item.changed(law, size))).max()), size) for size in sizes]
        left, size = min(pairs)
        if left <= _CLOSES_AT_START * distance and _differs(item, size):
            explanations.append(MistakesFound((item,), (size,), "explicit", left))
    explanations.sort(key=lambda item: item.after * (_FOR_A_SIZE if item.fitted else 1))
    return MistakeSearch(distance, "explicit", 0.0, tuple(explanations))


class _Trial:
    """Mistakes tried one after another, those that promise most first.

    Attributes:
        search: motions.
        before: distance without a mistake.
        screen: of mistakes.
        window: number of the first samples in which a good part of the distance shows.
        plain: distance in the window without a mistake.
        treatments: of gains with which poses are tried.
        time: of the search.
        alone: words of the mistakes that were tried alone.
    """

    def __init__(self, search: LawMotions, distance: float, scheme: Scheme, time: SearchTime) -> None:
        self.search, self.before, seen, self.time = search, distance, search.seen, time
        self.alone: set[str] = set()
        self.screen = MistakeScreen(search.mechanism, search.law, seen.q, seen.v, search.step, search.stride)
        count = len(seen.time)
        largest = [float(np.abs(item).max()) for item in search.differences(search.law, scheme, count)]
        shows = next((row for row, size in enumerate(largest) if size >= _SHOWS * distance), count - 1)
        self.window = min(count, max(_LEAST, shows + 2))
        self.treatments: tuple[Treatment, ...] = TREATMENTS
        self.plain = max(largest[: self.window], default=distance)

    def settled(self, explanations: Sequence[MistakesFound]) -> bool:
        """True if the best explanation leaves nothing to explain."""
        return bool(explanations) and explanations[0].after <= max(EXACT * self.before, self.search.seen.bar)

    def best(self, choices: Sequence[tuple[Mistake, ...]], most: int) -> list[MistakesFound]:
        """Explanations by these choices, the best first; ``most`` are tried, until nothing is left to explain."""
        explanations: dict[tuple[str, ...], MistakesFound] = {}
        enough = math.inf
        for item in self.screen.best(choices)[:most]:
            if item.left > enough or self.time.over:
                break
            self.alone |= {item.mistakes[0].words} if len(item.mistakes) == 1 else set()
            tried = min(self.tried(item), key=lambda trial: trial.after, default=None)
            if tried is not None and all(map(_differs, tried.mistakes, tried.sizes)):
                name = tuple(mistake.words for mistake in item.mistakes)
                explanations[name] = min(explanations.get(name, tried), tried, key=lambda trial: trial.after)
                if self.settled([tried]):
                    enough = min(enough, _ALIKE * item.left)
        return _sorted([*explanations.values()])

    def tried(self, item: Screened) -> Iterator[MistakesFound]:
        """Explanations by mistakes at once, with the schemes of a treatment with which they come near in the window."""
        search, chosen, count, bound = self.search, item.mistakes, len(self.search.seen.time), _CLOSES * self.before
        near = []
        for scheme in (name for name in search.schemes if name.startswith(item.treatment)):
            left = search.differences(changed(search.law, chosen, item.sizes), scheme, self.window, _NEAR * self.plain)
            largest = max((float(np.abs(row).max()) for row in left), default=math.inf)
            if len(left) == self.window and largest <= _NEAR * self.plain:
                near.append((largest, scheme))
        for _, scheme in sorted(near):
            sizes = item.sizes
            if item.sized:
                sizes = search.fitted(chosen, sizes, scheme, self.window, rounds=3)
                sizes = search.fitted(chosen, sizes, scheme, count, rounds=3)
            distance = search.distance(changed(search.law, chosen, sizes), scheme, bound)
            if math.isfinite(distance):
                yield MistakesFound(chosen, sizes, scheme, distance)
                if distance <= search.seen.bar:
                    break

    def other_pose(self, seconds: Sequence[Mistake | None]) -> list[MistakesFound]:
        """Explanations by another default pose, one number for each joint, alone (None) or with a second mistake."""
        search, law, count = self.search, self.search.law, len(self.search.seen.time)
        if law.policy is None and not all(isinstance(item, float) for item in law.targets):
            return []
        fits = []
        for second, treatment in itertools.product(seconds, self.treatments):
            if self.time.over:
                return []
            moved = partial(_moved, law, second)
            size = len(law.joints) + int(second is not None and second.sized)
            fits.append((*self.screen.numbers(moved, size, treatment), moved, second, treatment))
        self.treatments = (min(fits, key=lambda fit: fit[1])[-1],)
        explanations = []
        for near, _, moved, second, treatment in sorted(fits, key=lambda fit: fit[1])[:_POSES]:
            for scheme in (name for name in search.schemes if name.startswith(treatment)):
                if self.time.over:
                    break
                if math.isinf(search.distance(moved(near), scheme, _NEAR * self.before)):
                    continue
                values = search.fit(moved, near, scheme, count, 4)
                distance = search.distance(moved(values), scheme, _CLOSES * self.before)
                if not math.isfinite(distance):
                    continue
                offsets = values[: len(law.joints)]
                change = partial(_scaled_by, partial(_moved, law, None), offsets)
                told = offsets_told(law.joints, offsets, self._clamped(moved, values, scheme, distance))
                item = Mistake(id="pose", words=told, layer="target", changed=change, numbers=len(offsets))
                both = (item,) if second is None else (item, second)
                sizes = (1.0, _size(second, values))[: len(both)]
                explanations.append(MistakesFound(both, sizes, scheme, distance))
                if self.settled(explanations[-1:]):
                    return explanations[-1:]
        return _sorted([item for item in explanations if all(map(_differs, item.mistakes, item.sizes))])[:1]

    def _clamped(
        self, moved: Callable[[Array], ControlLaw], values: Array, scheme: Scheme, distance: float
    ) -> list[int]:
        """Joints for which half of the offset explains a motion as well as all of it."""
        halved = {k: values * (1 - 0.5 * (np.arange(len(values)) == k)) for k in range(len(self.search.law.joints))}
        bound = max(2 * distance, self.search.seen.bar)
        return [k for k, less in halved.items() if math.isfinite(self.search.distance(moved(less), scheme, bound))]


def _moved(law: ControlLaw, second: Mistake | None, values: Array) -> ControlLaw:
    """The law with another pose, off by the first values, and a second mistake, whose size the last value changes."""
    offsets = values[: len(law.joints)]
    targets = law.targets if law.policy is not None else tuple((np.array(law.targets) + offsets).tolist())
    law = law.change(pose=law.pose + offsets, targets=targets)
    return law if second is None else second.changed(law, _size(second, values))


def _size(second: Mistake | None, values: Array) -> float:
    """Size of a mistake that differs by the last value from none."""
    if second is None or not second.sized:
        return 1.0
    return max(0.0, float(values[-1]) + second.none)


def _scaled_by(law: Callable[[Array], ControlLaw], values: Array, _: ControlLaw, size: float) -> ControlLaw:
    return law(size * values)


def _differs(item: Mistake, size: float) -> bool:
    """True if a size is no error of a step."""
    return not item.sized or item.id == "gravity" or math.isinf(item.none) or abs(size - 1) > _CHANGED
