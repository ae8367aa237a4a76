"""Search for the mistakes of bookkeeping that explain what was seen of a robot: a layer, a start, or a motion.

Motions are tried at the steps that the program may have made and with each way in which programs treat gains: those
mistakes first that leave least in single intervals of the motion.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.air import TREATMENTS, AirRobot, AirScheme, steps_in_air
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import Mistake, SearchTime, fitted, mistakes, offsets_told
from proofroll.robots.control.bookkeeping.screen import LawMotions, MistakeScreen, Screened, SeenMotion
from proofroll.robots.control.record import LayerCause

Flags = NDArray[np.bool_]
_MOST = 3  # mistakes of one layer that are told
_CLOSES = 0.05  # part of a distance between motions that an explanation may leave
EXACT = 1e-3  # part of a distance that leaves nothing to explain
_CHANGED = 1e-2  # least change of a fitted size that is no error of a step
_ALIKE = 100.0  # explanations whose squares in the screen differ by no more are all tried
_NEAR = 0.7  # part of a distance that a mistake of the size in the screen may leave
_CLOSES_AT_START = 1e-3  # part of the distance of accelerations that an explanation may leave
_ROUND_OFF = 1e-9  # part of that distance that counts as nothing
_BISECTIONS = 14  # of a size that is a bound only: to four digits
_FOR_A_SIZE = 3.0  # what a fitted size must be better by


@dataclass(frozen=True)
class MistakeExplanation:
    """Mistake that explains what was seen.

    Attributes:
        mistake: the mistake.
        size: its size; 1 where it has none.
        after: largest distance that it leaves; of motions [rad, m, or 20 times as many per second].
        larger: True if any larger size leaves no more.
    """

    mistake: Mistake
    size: float
    after: float
    larger: bool = False

    @property
    def sentence(self) -> str:
        """The mistake with its size."""
        return self.mistake.sentence(self.size, larger=self.larger)

    @property
    def fitted(self) -> int:
        """Number of fitted sizes."""
        return self.mistake.sized + self.mistake.numbers

    @property
    def cause(self) -> LayerCause:
        """The same as the cause of a layer."""
        return LayerCause(self.mistake.id, self.sentence, self.size if self.mistake.sized else None, self.after)

    @property
    def rank(self) -> float:
        """Number by which explanations are sorted, the best first."""
        return self.after * (_FOR_A_SIZE if self.fitted else 1.0)

    @property
    def differs(self) -> bool:
        """True if the size is no error of a step."""
        item = self.mistake
        return not item.sized or item.id == "gravity" or math.isinf(item.none) or abs(self.size - 1) > _CHANGED


def explanations(
    candidates: Iterable[Mistake], tried: Callable[[Mistake], MistakeExplanation | None], time: SearchTime
) -> tuple[list[MistakeExplanation], int]:
    """Explanations by single mistakes, the best first, and the number of mistakes that were tried.

    Args:
        candidates: mistakes to be tried, one after another.
        tried: explanation by a mistake; None: it explains nothing.
        time: after which the search ends.
    """
    several, count = [], 0
    for mistake in candidates:
        if time.over:
            break
        count += 1
        if (explanation := tried(mistake)) is not None:
            several.append(explanation)
    return sorted(several, key=lambda item: (item.rank, item.fitted)), count


def best_size(mistake: Mistake, law: ControlLaw, left: Callable[[ControlLaw], Array]) -> tuple[float, float]:
    """Largest number that a mistake leaves with the size that fits best, and that size; infinite where none is known.

    ``left``: what a law leaves unexplained; NaN: it cannot be computed.
    """
    sizes = [1.0]
    if mistake.sized:
        sizes = [fitted(lambda size: left(mistake.changed(law, size)), start) for start in mistake.starts]
    return min((largest(left(mistake.changed(law, size))), size) for size in sizes)


def bounded(explanation: MistakeExplanation, left: Callable[[float], float], bound: float) -> MistakeExplanation:
    """The explanation itself; or its least size, where any larger one leaves no more than a bound.

    ``left``: of a size.
    """
    mistake, high = explanation.mistake, explanation.size
    if not mistake.at_least or high <= mistake.none or left(2 * high) > bound:
        return explanation
    low = mistake.none
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if left(middle) <= bound else (middle, high)
    return replace(explanation, size=high, larger=True)


def largest(left: Array) -> float:
    """Largest of some numbers by size; infinite where one is unknown."""
    size = float(np.abs(left).max(initial=0.0))
    return size if math.isfinite(size) else math.inf


class MotionSearch:
    """Search for the mistakes that explain the motion of a robot in the air.

    Args:
        mechanism: the robot.
        law: its controller's law as it should be.
        seen: motion that a program says it made; its interval is a whole number of each step.
        steps: possible steps of the program [s].
        time: of the search; None: as long as it needs.

    Attributes:
        before: distance without a mistake, with the step and the scheme that suit best.
        tried: words of the mistakes that were tried.

    Raises:
        InputError: a step does not divide the time between instants.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        law: ControlLaw,
        seen: SeenMotion,
        steps: Sequence[float],
        time: SearchTime | None = None,
    ) -> None:
        self.law, self.seen, self.tried = law, seen, set[str]()
        self._time = time or SearchTime()
        self._at_steps = [LawMotions(mechanism, law, seen, step) for step in steps]
        self.before, self._best = math.inf, (self._at_steps[0], self._at_steps[0].schemes[0])
        for motions, scheme in ((item, scheme) for item in self._at_steps for scheme in item.schemes):
            distance = motions.distance(law, scheme, self.before)
            if distance < self.before:
                self.before, self._best = distance, (motions, scheme)

    @property
    def right(self) -> bool:
        """True if the motion needs no mistake."""
        return self.before <= self.seen.bar

    @property
    def spread(self) -> float:
        """Distance between two motions without a mistake, by the two schemes that differ most."""
        return self._best[0].spread()

    @property
    def explicit(self) -> float:
        """Distance without a mistake, with kd at the velocity before a step."""
        return self._best[0].distance(self.law, AirScheme())

    @cached_property
    def imitated(self) -> bool:
        """True if the motion is that of kd at the velocity after a step h, and that of explicit kd with armatures.

        The armature of each joint is h kd more, which moves it alike where no effort is at its limit.
        """
        return self.right and self._best[0].imitated(self._best[1])

    @cached_property
    def explanations(self) -> Sequence[MistakeExplanation]:
        """Explanations at the step that suits best, the best first; empty if none is known, or none is needed."""
        best: list[MistakeExplanation] = []
        for motions in () if self.right else self._at_steps:
            several = self._explained(motions)
            best = min(best, several, key=lambda items: items[0].rank if items else math.inf)
            if self._time.over or (best and self._settles(best[0])):
                break
        return best

    def _settles(self, explanation: MistakeExplanation) -> bool:
        """True if an explanation leaves nothing to explain."""
        return explanation.after <= max(EXACT * self.before, self.seen.bar)

    def _explained(self, motions: LawMotions) -> list[MistakeExplanation]:
        """Explanations at a step, the best first; another pose is tried where a mistake leaves something to explain."""
        law, seen = self.law, self.seen
        screen = MistakeScreen(motions.mechanism, law, seen.q, seen.v, motions.step, motions.stride)
        steps = ((item, 1 / item.changed(law, 1.0).rate / motions.step) for item in mistakes(law))  # between instants
        whole = [item for item, count in steps if item.id != "rate" or abs(count - round(count)) <= 1e-6 * count]
        several: dict[str, MistakeExplanation] = {}
        enough = screen.unexplained
        for item in screen.best(whole, self._time):
            if item.left > enough or self._time.over:
                break
            words = item.mistake.words
            self.tried.add(words)
            settled = any(map(self._settles, several.values()))  # a rival of what leaves nothing is near at once
            trials = self._moved_alike(item, motions, _CLOSES if settled else _NEAR)
            for explanation in (trial for trial in trials if trial.differs):
                several[words] = min(several.get(words, explanation), explanation, key=lambda trial: trial.after)
                if self._settles(explanation):
                    enough = min(enough, _ALIKE * item.left)
        if not self._time.over and not any(map(self._settles, several.values())):
            poses = self._other_poses(motions, screen)
            several |= {item.mistake.words: item for item in sorted(poses, key=lambda item: item.after)[:1]}
        return sorted(several.values(), key=lambda item: item.rank / (_CLOSES if item.mistake.numbers else 1.0))

    def _moved_alike(self, item: Screened, motions: LawMotions, near: float) -> Iterator[MistakeExplanation]:
        """Explanations by a mistake, with the schemes of a treatment with which its motion comes near.

        ``near``: part of the distance without a mistake that is left with the size in the screen.
        """
        mistake, size = item.mistake, item.size

        def sized(sizes: Array) -> ControlLaw:
            return mistake.changed(self.law, max(mistake.least, float(sizes[0])))

        for scheme in motions.schemes_of(item.treatment):
            distance = motions.distance(mistake.changed(self.law, size), scheme, near * self.before)
            if math.isfinite(distance) and mistake.sized:
                size = max(mistake.least, float(motions.fit(sized, np.array([size]), scheme, rounds=3)[0]))
                distance = motions.distance(mistake.changed(self.law, size), scheme)
            if distance <= _CLOSES * self.before:
                bound = max(2 * distance, self.seen.bar)
                yield bounded(
                    MistakeExplanation(mistake, size, distance),
                    lambda size, scheme=scheme: motions.distance(mistake.changed(self.law, size), scheme),  # type: ignore[misc]
                    bound,
                )
                if distance <= self.seen.bar:
                    break

    def _other_poses(self, motions: LawMotions, screen: MistakeScreen) -> Iterator[MistakeExplanation]:
        """Explanations by another default pose, one number for each joint."""
        law = self.law
        if law.policy is None and not all(isinstance(item, float) for item in law.targets):
            return
        moved = partial(_moved, law)
        offsets_near = {treatment: screen.offsets(treatment) for treatment in TREATMENTS}
        left = {name: float(np.square(screen.left([moved(near)], name)).mean()) for name, near in offsets_near.items()}
        for treatment, near in sorted(offsets_near.items(), key=lambda item: left[item[0]]):
            for scheme in motions.schemes_of(treatment):
                if self._time.over:
                    return
                if math.isinf(motions.distance(moved(near), scheme, _NEAR * self.before)):
                    continue
                offsets = motions.fit(moved, near, scheme, rounds=4)
                distance = motions.distance(moved(offsets), scheme, _CLOSES * self.before)
                if math.isfinite(distance):
                    halved = [_moved(law, offsets * (1 - 0.5 * row)) for row in np.eye(len(offsets))]
                    bound = max(2 * distance, self.seen.bar)  # where half explains as well, an effort is clamped
                    clamped = [math.isfinite(motions.distance(item, scheme, bound)) for item in halved]
                    told = offsets_told(law.joints, offsets, np.flatnonzero(clamped).tolist())
                    item = another_pose(told, offsets)
                    explanation = MistakeExplanation(item, 1.0, distance)
                    yield explanation
                    if self._settles(explanation):
                        return


def explained_start(
    mechanism: Mechanism, law: ControlLaw, acceleration: Array
) -> tuple[float, Sequence[MistakeExplanation]]:
    """Distance from accelerations (nv) at the start of a mechanism without a mistake [1/s²], and what explains them.

    They tell nothing of what shows later, as targets that come late after the first.
    """
    q, v = mechanism.start()

    def off(trial: ControlLaw) -> Array:
        robot = AirRobot(mechanism, trial)
        step = next(steps_in_air(robot, trial, (q, v), 1 / trial.rate, AirScheme()))
        return robot.solved(q, v, step.efforts).acceleration - acceleration

    distance = float(np.abs(off(law)).max())

    def explanation(mistake: Mistake) -> MistakeExplanation | None:
        left, size = best_size(mistake, law, off)
        item = MistakeExplanation(mistake, size, left if left > _ROUND_OFF * distance else 0.0)
        return item if left <= _CLOSES_AT_START * distance and item.differs else None

    return distance, explanations(mistakes(law), explanation, SearchTime())[0]


def _moved(law: ControlLaw, offsets: Array) -> ControlLaw:
    """The law with another default pose."""
    targets = law.targets if law.policy is not None else tuple((np.array(law.targets) + offsets).tolist())
    return law.change(pose=law.pose + offsets, targets=targets)


def another_pose(words: str, offsets: Array) -> Mistake:
    """Mistake of a default pose that is off by these offsets [rad or m]."""
    return Mistake("pose", words, "target", lambda law, size: _moved(law, size * offsets), numbers=len(offsets))


@dataclass(frozen=True)
class LayerTrials:
    """Trials of laws at one layer of a record.

    Attributes:
        parts: largest difference of each column in parts of its bar, under a law; NaN: it cannot be computed.
        left: all differences in parts of the sizes of their columns, row by row, under a law.
        fitting: further mistakes under a law, whose numbers fit what it leaves.
    """

    parts: Callable[[ControlLaw], Array]
    left: Callable[[ControlLaw], Array]
    fitting: Callable[[ControlLaw], Iterator[Mistake]]


@dataclass(frozen=True)
class _Told:
    """A mistake with a size, and the law with it."""

    mistake: Mistake
    size: float
    law: ControlLaw

    @property
    def numbers(self) -> int:
        """Number of fitted numbers."""
        return self.mistake.numbers + (self.mistake.sized and self.size not in {0.0, -1.0})


def mistakes_together(
    candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime
) -> LayerCause | None:
    """Cause that names two or three mistakes with which every column holds; None where none are found.

    Each closes columns and leaves right ones right; what none closes alone is left to pairs, a mistake whose size is
    known and another one.
    """
    several = _one_by_one(candidates, law, trials, time) or _pair(candidates, law, trials, time)
    if not 1 < len(several) <= _MOST:
        return None
    residual = float(np.abs(trials.left(several[-1].law)).max(initial=0.0))
    sentence = "; and ".join(item.mistake.sentence(item.size) for item in several)
    return LayerCause(" + ".join(item.mistake.id for item in several), sentence, None, residual)


def may_close(candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime) -> bool:
    """True if one mistake or more close every column."""
    return bool(_one_by_one(candidates, law, trials, time) or _pair(candidates, law, trials, time)) or time.over


def _one_by_one(
    candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime
) -> Sequence[_Told]:
    """Mistakes with which every column holds, those first that close most; the last two may be a pair."""
    several: list[_Told] = []
    while (wrong := trials.parts(law) > 1).any() and len(several) < _MOST and not time.over:
        rest = [item for item in candidates if item.id not in {before.mistake.id for before in several}]
        changed = changed_columns(rest, law, trials.left, trials.left(law).reshape(-1, len(wrong)))
        near = [item for item in rest if np.any(changed[item.words] & wrong)]
        steps = [(closed, item) for item in _sized(near, law, trials) if (closed := _closed(item, trials, wrong))]
        more = [max(steps, key=lambda step: (step[0], -step[1].numbers))[1]] if steps else []
        if not more and several:
            more = _pair(rest, law, trials, time)
        if not more:
            return ()
        several, law = [*several, *more], more[-1].law
    return () if wrong.any() else several


def _closed(item: _Told, trials: LayerTrials, wrong: Flags) -> int:
    """Number of wrong columns that a mistake closes; 0 if it leaves a right one wrong, or cannot be computed."""
    parts = trials.parts(item.law)
    return int((wrong & (parts <= 1)).sum()) if np.all(parts[~wrong] <= 1) and np.isfinite(parts).all() else 0


def _pair(candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime) -> list[_Told]:
    """Two mistakes that close every column, with the fewest fitted numbers; empty where none are found."""
    best: list[_Told] = []
    wrong = trials.parts(law) > 1
    changed = changed_columns(candidates, law, trials.left, trials.left(law).reshape(-1, len(wrong)))
    candidates = [item for item in candidates if np.any(changed[item.words] & wrong)]
    for first in _known(candidates, law):
        if not np.all(trials.parts(first.law)[~wrong] <= 1):
            continue
        beside = wrong & ~changed[first.mistake.words]
        others = [item for item in candidates if item.id != first.mistake.id and np.all(changed[item.words][beside])]
        fitting = (_Told(item, 1.0, item.changed(first.law, 1.0)) for item in trials.fitting(first.law))
        for second in itertools.chain(_sized(others, first.law, trials), fitting):
            if time.over:
                return best
            if np.all(trials.parts(second.law) <= 1) and (not best or second.numbers < best[1].numbers):
                best = [first, second]
    return best


def changed_columns(
    candidates: Sequence[Mistake], law: ControlLaw, left: Callable[[ControlLaw], Array], right: Array
) -> dict[str, Flags]:
    """Columns in which a mistake changes a row at a size from which its fit begins, by the words of each mistake.

    A column in which two change nothing stays wrong. ``left``: under a law; ``right``: without a mistake, by rows.
    """
    changed = {item.words: np.zeros(right.shape[1], bool) for item in candidates}
    for item in candidates:
        for size in item.starts if item.sized else (1.0,):
            trial = left(item.changed(law, size))
            changed[item.words] |= trial.size != right.size or np.any(trial.reshape(right.shape) != right, axis=0)
    return changed


def _known(candidates: Sequence[Mistake], law: ControlLaw) -> Iterator[_Told]:
    """Mistakes without a size to be fitted: those without one, and a size of 0 or -1 that has words of its own."""
    for item in candidates:
        sizes = [1.0] if not item.sized else [0.0] * bool(item.absent) + [-1.0] * bool(item.opposite)
        yield from (_Told(item, size, item.changed(law, size)) for size in sizes)


def _sized(candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials) -> Iterator[_Told]:
    """Mistakes with known sizes, then with sizes that fit best what a law leaves."""
    yield from _known(candidates, law)
    for item in candidates:
        changed = partial(item.changed, law)
        for start in item.starts if item.sized else ():
            size = fitted(lambda size, changed=changed: trials.left(changed(size)), start)  # type: ignore[misc]
            yield _Told(item, size, changed(size))
