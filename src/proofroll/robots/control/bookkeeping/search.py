"""Search for the mistake of bookkeeping that explains what was seen of a robot: a layer, a start, or a motion.

A motion is tried at the step of the program that is judged and with each way in which programs treat gains. Most
mistakes are given up at the first samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.air import AirRobot, Scheme, steps_in_air
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import Mistake, SearchTime, fitted, mistakes, offsets_told
from proofroll.robots.control.bookkeeping.screen import TREATMENTS, MistakeScreen, Screened
from proofroll.robots.control.bookkeeping.seen import LawMotions, SeenMotion
from proofroll.robots.control.record_layer import LayerCause

_CLOSES = 0.05  # part of a distance between motions that an explanation may leave
EXACT = 1e-3  # part of a distance that leaves nothing to explain
_CHANGED = 1e-2  # least change of a fitted size that is no error of a step
_ALIKE = 100.0  # explanations whose squares in the screen differ by no more are all tried
# Part of the distance that a window has to show, and its least samples; part that a mistake may leave in it at first.
_SHOWS, _LEAST, _NEAR = 0.2, 3, 0.4
_CLOSES_AT_START = 1e-3  # part of the distance of accelerations that an explanation may leave
_FOR_A_SIZE = 3.0  # what a fitted size must be better by


@dataclass(frozen=True)
class MistakeExplanation:
    """Mistake that explains what was seen.

    Attributes:
        mistake: the mistake.
        size: its size; 1 where it has none.
        after: largest distance that it leaves; of motions [rad, m, or 20 times as many per second].
    """

    mistake: Mistake
    size: float
    after: float

    @property
    def sentence(self) -> str:
        """The mistake with its size."""
        return self.mistake.sentence(self.size)

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
    return sorted(several, key=lambda item: item.rank), count


def best_size(mistake: Mistake, law: ControlLaw, left: Callable[[ControlLaw], Array]) -> tuple[float, float]:
    """Largest number that a mistake leaves with the size that fits best, and that size; infinite where none is known.

    ``left``: what a law leaves unexplained; NaN: it cannot be computed.
    """
    sizes = [1.0]
    if mistake.sized:
        sizes = [fitted(lambda size: left(mistake.changed(law, size)), start) for start in mistake.starts]
    return min((largest(left(mistake.changed(law, size))), size) for size in sizes)


def largest(left: Array) -> float:
    """Largest of some numbers by size; infinite where one is unknown."""
    size = float(np.abs(left).max(initial=0.0))
    return size if math.isfinite(size) else math.inf


@dataclass(frozen=True)
class MistakeSearch:
    """Result of a search.

    Attributes:
        before: distance without a mistake, with the scheme that suits best.
        explanations: the best first; empty if no known mistake explains what was seen, or none is needed.
        spread: distance between two motions without a mistake, by the two schemes that differ most.
        explicit: distance without a mistake, with kd at the velocity before a step.
        imitated: True if the motion is that of kd at the velocity after a step h, and that of explicit kd with an
            armature of h kd more at each joint as well, as where no effort is at its limit.
        tried: number of mistakes that were tried.
    """

    before: float
    explanations: Sequence[MistakeExplanation] = ()
    spread: float = 0.0
    explicit: float = 0.0
    imitated: bool = False
    tried: int = 0


def explained(
    mechanism: Mechanism, law: ControlLaw, seen: SeenMotion, step: float, time: SearchTime | None = None
) -> MistakeSearch:
    """Mistakes that explain the motion of a robot in the air.

    Args:
        mechanism: the robot.
        law: its controller's law as it should be.
        seen: motion that a program says it made; its interval is a whole number of steps.
        step: of the program [s].
        time: of the search; None: as long as it needs.

    Raises:
        InputError: the step does not divide the time between instants.
    """
    motions = LawMotions(mechanism, law, seen, step)
    plain = {scheme: motions.distance(law, scheme) for scheme in motions.schemes}
    scheme = min(plain, key=lambda name: plain[name])
    distance = plain[scheme]
    right = distance <= seen.bar
    trial = None if right else _Trial(motions, distance, scheme, time or SearchTime())
    return MistakeSearch(
        before=distance,
        explanations=() if trial is None else trial.explanations(),
        spread=motions.spread(),
        explicit=plain["explicit"],
        imitated=right and motions.imitated(scheme),
        tried=0 if trial is None else len(trial.tried),
    )


def _divides(step: float, period: float) -> bool:
    """True if a time between instants is a whole number of steps [s], so that a program can act at that rate."""
    return abs(period / step - round(period / step)) <= 1e-6 * period / step


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

    def explanation(mistake: Mistake) -> MistakeExplanation | None:
        left, size = best_size(mistake, law, off)
        item = MistakeExplanation(mistake, size, left)
        return item if left <= _CLOSES_AT_START * distance and item.differs else None

    several, count = explanations(mistakes(law), explanation, SearchTime())
    return MistakeSearch(distance, several, tried=count)


class _Trial:
    """Mistakes tried by motions of their own, those that promise most first.

    Attributes:
        motions: under laws.
        before: distance without a mistake.
        time: of the search.
        screen: of mistakes.
        window: number of the first samples in which a good part of the distance shows.
        plain: distance in the window without a mistake.
        tried: words of the mistakes that were tried.
    """

    def __init__(self, motions: LawMotions, distance: float, scheme: Scheme, time: SearchTime) -> None:
        self.motions, self.before, seen, self.time = motions, distance, motions.seen, time
        self.screen = MistakeScreen(motions.mechanism, motions.law, seen.q, seen.v, motions.step, motions.stride)
        count = len(seen.time)
        sizes = [float(np.abs(item).max()) for item in motions.differences(motions.law, scheme, count)]
        shows = next((row for row, size in enumerate(sizes) if size >= _SHOWS * distance), count - 1)
        self.window = min(count, max(_LEAST, shows + 2))
        self.plain = max(sizes[: self.window], default=distance)
        self.tried: set[str] = set()

    def explanations(self) -> tuple[MistakeExplanation, ...]:
        """Explanations, the best first; another pose is tried where a mistake leaves something to explain."""
        law, step = self.motions.law, self.motions.step
        candidates = [
            item for item in mistakes(law) if item.id != "rate" or _divides(step, 1 / item.changed(law, 1.0).rate)
        ]
        several = self._of_one_number(candidates)
        if not self.time.over and not any(map(self._settles, several)):
            several += sorted(self._other_pose(), key=lambda item: item.after)[:1]
        return tuple(sorted(several, key=lambda item: item.rank / (_CLOSES if item.mistake.numbers else 1.0)))

    def _settles(self, explanation: MistakeExplanation) -> bool:
        """True if an explanation leaves nothing to explain."""
        return explanation.after <= max(EXACT * self.before, self.motions.seen.bar)

    def _of_one_number(self, candidates: Sequence[Mistake]) -> list[MistakeExplanation]:
        """Explanations by mistakes of one size or none, until nothing is left to explain."""
        several: dict[str, MistakeExplanation] = {}
        enough = math.inf
        for item in self.screen.best(candidates):
            if item.left > enough or self.time.over:
                break
            self.tried.add(item.mistake.words)
            explanation = min(self._tried(item), key=lambda trial: trial.after, default=None)
            if explanation is not None and explanation.differs:
                rival = several.get(item.mistake.words, explanation)
                several[item.mistake.words] = min(rival, explanation, key=lambda trial: trial.after)
                if self._settles(explanation):
                    enough = min(enough, _ALIKE * item.left)
        return [*several.values()]

    def _tried(self, item: Screened) -> Iterator[MistakeExplanation]:
        """Explanations by a mistake, with the schemes of a treatment with which it comes near in the window."""
        motions, mistake, most = self.motions, item.mistake, _NEAR * self.plain
        near = []

        def sized(sizes: Array) -> ControlLaw:
            return mistake.changed(motions.law, max(0.0, float(sizes[0])))

        for scheme in motions.schemes_of(item.treatment):
            left = motions.left(mistake.changed(motions.law, item.size), scheme, self.window, most)
            near += [(largest(left), scheme)] if np.isfinite(left).all() else []
        for _, scheme in sorted(near):
            size = item.size
            for count in (self.window, len(motions.seen.time)) if mistake.sized else ():
                size = max(0.0, float(motions.fit(sized, np.array([size]), scheme, count, rounds=3)[0]))
            distance = motions.distance(mistake.changed(motions.law, size), scheme, _CLOSES * self.before)
            if math.isfinite(distance):
                yield MistakeExplanation(mistake, size, distance)
                if distance <= motions.seen.bar:
                    break

    def _other_pose(self) -> Iterator[MistakeExplanation]:
        """Explanations by another default pose, one number for each joint."""
        motions, law = self.motions, self.motions.law
        if law.policy is None and not all(isinstance(item, float) for item in law.targets):
            return
        moved = partial(_moved, law)
        fits = [(*self.screen.numbers(moved, len(law.joints), treatment), treatment) for treatment in TREATMENTS]
        for near, _, treatment in sorted(fits, key=lambda fit: fit[1]):
            for scheme in motions.schemes_of(treatment):
                if self.time.over:
                    return
                if math.isinf(motions.distance(moved(near), scheme, _NEAR * self.before)):
                    continue
                offsets = motions.fit(moved, near, scheme, len(motions.seen.time), rounds=4)
                distance = motions.distance(moved(offsets), scheme, _CLOSES * self.before)
                if math.isfinite(distance):
                    told = offsets_told(law.joints, offsets, self._clamped(offsets, scheme, distance))
                    item = Mistake("pose", told, "target", partial(_moved_by, offsets), numbers=len(offsets))
                    explanation = MistakeExplanation(item, 1.0, distance)
                    yield explanation
                    if self._settles(explanation):
                        return

    def _clamped(self, offsets: Array, scheme: Scheme, distance: float) -> list[int]:
        """Joints for which half of the offset explains a motion as well as all of it."""
        motions, law = self.motions, self.motions.law
        halved = [offsets * (1 - 0.5 * row) for row in np.eye(len(law.joints))]
        bound = max(2 * distance, motions.seen.bar)
        return [k for k, less in enumerate(halved) if math.isfinite(motions.distance(_moved(law, less), scheme, bound))]


def _moved(law: ControlLaw, offsets: Array) -> ControlLaw:
    """The law with another default pose."""
    targets = law.targets if law.policy is not None else tuple((np.array(law.targets) + offsets).tolist())
    return law.change(pose=law.pose + offsets, targets=targets)


def _moved_by(offsets: Array, law: ControlLaw, size: float) -> ControlLaw:
    return _moved(law, size * offsets)
