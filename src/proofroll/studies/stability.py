"""Where every engine, formulation and setting stops being right, along axes that take a scene to its extremes.

Each point of the map is a search for two boundaries on a ladder of steps or tolerances. All searches go on side by
side: each round runs what they ask for next. Every run is a stored case, so an interrupted map resumes where it was.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from proofroll.case import Case, EngineFacts, Result, Status
from proofroll.errors import ProofrollError
from proofroll.recording import time_grid
from proofroll.runner import Runner, resolve
from proofroll.scene import Scene
from proofroll.scene_file import load_scene
from proofroll.studies.axes import Axis, thinned
from proofroll.studies.bisection import Found, search
from proofroll.studies.failure import Failure, Outcome, Yardstick, judge
from proofroll.studies.sweep import Curve, Question, case_of, curves_of
from proofroll.trajectory import read
from proofroll.truth.natural import natural_time

# Sampling intervals per natural time; the coarsest step is one of them, the finer ones divide it.
PER_PERIOD = 8
# More samples than these are not kept of a long run: the interval becomes an odd number of the above, so that the
# samples still visit all phases of an oscillation.
_MOST_SAMPLES = 400
# Parts into which a sampling interval is divided, about two per octave.
_FINEST = 17
_PARTS = [1, *(part for power in range(_FINEST) for part in (2 << power, 3 << power))]
_TOLERANCES = [10.0**-power for power in range(1, 14)]
# Rungs skipped on the way down: a factor of four in the step, three decades of tolerance.
_STRIDE = {"dt": 4, "rtol": 3}
# A run with an eighth-order method gets longer as this power of its tolerance.
_PER_DECADE = 1 / 8
# The truth is computed by two routes at the tightest tolerance, once per place.
_TRUTH_LIMIT = 60.0
# After so many runs that met the limit of time a search goes no further: each finer one would too.
_TIMEOUTS = 2


@dataclass(frozen=True)
class Effort:
    """How much a map may cost.

    Attributes:
        periods: length of every run in natural times; an axis may say otherwise.
        values: largest number of values per axis, or None.
        patience: a run that is expected to take longer is too slow [s].
        limit: one that does take longer is ended [s]; a worker's start counts.
    """

    periods: float = 3.0
    values: int | None = None
    patience: float = 1.0
    limit: float = 8.0


QUICK = Effort(values=3, patience=0.5, limit=5.0)


@dataclass
class Place:
    """A value of an axis: the scene there, and the truth.

    Attributes:
        axis, value: where.
        parameters: of the scene, those that differ from the defaults.
        scene: with them, or None if it does not exist; then ``problem`` says why.
        until, every: length and sampling interval of every run [s].
        yardstick: what runs are measured by, or None if there is no scene.
        problem: why there is no truth here.
    """

    axis: Axis
    value: float
    parameters: dict[str, float]
    scene: Scene | None = None
    period: float = 0.0
    until: float = 0.0
    every: float = 0.0
    yardstick: Yardstick | None = None
    problem: str | None = None


@dataclass
class MapPoint:
    """One engine with its settings at one place.

    Attributes:
        curve, place: which.
        ladder: steps [s] or tolerances, coarse first.
        found: outcomes of the runs, by rung.
        cases, results: of the runs, by rung.
    """

    curve: Curve
    place: Place
    ladder: list[float]
    found: Found[Outcome] = field(default_factory=Found)
    cases: dict[int, Case] = field(default_factory=dict)
    results: dict[int, Result] = field(default_factory=dict)

    def facts(self, rung: int) -> EngineFacts:
        """The engine with the settings of a rung."""
        facts = self.curve.facts
        return dataclasses.replace(facts, settings={**facts.settings, str(facts.resolution): self.ladder[rung]})

    def expected(self, rung: int) -> float:
        """Wall seconds that a run is expected to take, from the coarser runs that got somewhere; 0: unknown.

        Their trend counts, for an engine that halves its own steps takes as long with a coarse one; a single run says
        only that it will not be longer than in proportion to the steps.
        """
        known = sorted((item, result.wall_seconds) for item, result in self.results.items() if result.wall_seconds)
        known = [item for item in known if item[0] < rung]
        if not known:
            return 0.0
        last, seconds = known[-1]
        power = 1.0 if self.curve.fixed_step else _PER_DECADE
        if len(known) > 1 and self.curve.fixed_step:
            before, earlier = known[-2]
            steps = np.log(self.ladder[before] / self.ladder[last])
            power = float(np.clip(np.log(seconds / earlier) / steps, 0.0, 1.0))
        return float(seconds * (self.ladder[last] / self.ladder[rung]) ** power)

    @property
    def timeouts(self) -> int:
        """How many runs met the limit of time."""
        return sum(result.status == Status.TIMEOUT for result in self.results.values())


@dataclass
class StabilityMap:
    """What the study found.

    Attributes:
        scene: name of the scene.
        axes, effort: what was asked.
        places: the values of the axes.
        points: every engine at every place.
        absent: engine -> why it is not on the map.
    """

    scene: str
    axes: list[Axis]
    effort: Effort
    places: list[Place]
    points: list[MapPoint]
    absent: dict[str, str]

    @property
    def runs(self) -> int:
        """How many runs there were."""
        return sum(len(point.results) for point in self.points)


Progress = Callable[[str, int], None]
Searching = Generator[int, Outcome | None, Found[Outcome]]


def stability(
    scene: str,
    axes: Sequence[Axis],
    runner: Runner,
    *,
    engines: Iterable[str] = (),
    effort: Effort | None = None,
    progress: Progress | None = None,
) -> StabilityMap:
    """Maps the boundaries.

    Args:
        scene: name of the scene; what an axis does not change keeps its default.
        axes: along which.
        runner: where the cases run.
        engines: names or ``name[key=value,…]``; all that are installed if empty.
        effort: how much it may cost.
        progress: called with a short text and the number of points finished since the last call.

    Raises:
        InputError: something that does not exist.
    """
    effort = effort or Effort()
    tell: Progress = progress or (lambda _text, _count: None)
    curves, absent = curves_of(engines, runner.workers)
    places = _places(scene, axes, effort)
    _measure(scene, places, runner, tell)
    points = [
        MapPoint(curve, place, _ladder(curve, place)) for curve in curves for place in places if place.scene is not None
    ]
    _search(scene, points, effort, runner, tell)
    return StabilityMap(scene, list(axes), effort, places, points, absent)


def _places(name: str, axes: Sequence[Axis], effort: Effort) -> list[Place]:
    default = load_scene(name)
    found = []
    for axis in axes:
        for value in thinned(axis.values, effort.values) if effort.values else axis.values:
            place = Place(axis, value, axis.at(default, value))
            found.append(place)
            try:
                scene = load_scene(name, **place.parameters)
            except ProofrollError as error:
                place.problem = str(error)
                continue
            place.scene, place.period = scene, natural_time(scene.rolling)
            intervals = round(PER_PERIOD * (value if axis.horizon else effort.periods))
            stride = 1 + 2 * (intervals // (2 * _MOST_SAMPLES))
            place.every = stride * place.period / PER_PERIOD
            place.until = place.every * max(1, intervals // stride)
    return found


def _measure(name: str, places: Sequence[Place], runner: Runner, tell: Progress) -> None:
    """The truth of every place, or why there is none."""
    (facts,) = resolve([("truth", {})], runner.workers)
    if not isinstance(facts, EngineFacts):
        raise facts
    cases = {id(place): _case(name, place, facts, _TRUTH_LIMIT) for place in places if place.scene is not None}
    results = runner.run(cases.values(), lambda *_: tell("the truth", 0))
    for place in places:
        if place.scene is None:
            continue
        case = cases[id(place)]
        result = results[case.key]
        truth = read(runner.store.trajectory(case)) if result.status == Status.DONE else None
        if truth is None:
            place.problem = f"there is no truth here: {result.message}"
        times = time_grid(place.until, place.every)
        place.yardstick = Yardstick.of(place.scene.rolling, times, truth)


def _case(name: str, place: Place, facts: EngineFacts, limit: float) -> Case:
    assert place.scene is not None  # the caller looked
    question = Question(name, place.parameters, place.until, place.scene.rolling.surface.coordinates[-1])
    return dataclasses.replace(case_of(question, place.scene, facts, place.every), time_limit=limit)


def _ladder(curve: Curve, place: Place) -> list[float]:
    if not curve.fixed_step:
        return list(_TOLERANCES)
    return [place.period / PER_PERIOD / part for part in _PARTS]


def _search(name: str, points: Sequence[MapPoint], effort: Effort, runner: Runner, tell: Progress) -> None:
    """Runs all searches, round by round."""
    waiting: list[tuple[MapPoint, Searching, int]] = []
    for point in points:
        searching: Searching = search(len(point.ladder), _STRIDE["dt" if point.curve.fixed_step else "rtol"])
        waiting.append((point, searching, next(searching)))

    def told(case: Case, _: Result) -> None:
        tell(case.engine.name, 0)

    while waiting:
        wanted: list[tuple[MapPoint, Searching, int]] = []
        for point, searching, rung in waiting:
            asked: int | None = rung
            while asked is not None and _too_slow(point, asked, effort):
                asked = _send(point, searching, None)
            if asked is None:
                tell(_label(point), 1)
            else:
                wanted.append((point, searching, asked))
        for point, _, rung in wanted:
            point.cases[rung] = _case(name, point.place, point.facts(rung), effort.limit)
        results = runner.run([point.cases[rung] for point, _, rung in wanted], told)
        waiting = []
        for point, searching, rung in wanted:
            case = point.cases[rung]
            point.results[rung] = result = results[case.key]
            dataset = None if result.trajectory is None else read(runner.store.trajectory(case))
            assert point.place.yardstick is not None  # points have a scene
            asked = _send(point, searching, judge(result, dataset, point.place.yardstick))
            if asked is None:
                tell(_label(point), 1)
            else:
                waiting.append((point, searching, asked))


def _too_slow(point: MapPoint, rung: int, effort: Effort) -> bool:
    allowed = effort.patience if len(point.results) > 1 else effort.limit
    return point.timeouts >= _TIMEOUTS or point.expected(rung) > allowed


def _send(point: MapPoint, searching: Searching, outcome: Outcome | None) -> int | None:
    """Gives an answer to a search; returns what it asks next, or None when it has ended."""
    try:
        return searching.send(outcome)
    except StopIteration as stop:
        point.found = stop.value
        return None


def _label(point: MapPoint) -> str:
    return f"{point.curve.facts.name}, {point.place.axis.name} = {point.place.value:g}"


def failure_beyond(point: MapPoint, rung: int | None) -> Outcome | None:
    """The outcome on a failing rung; where no run was affordable at all, that it is too slow."""
    if rung is not None:
        return point.found.seen[rung]
    if not point.found.seen and point.found.limit == 0:
        message = "even the coarsest run is expected to take too long"
        return Outcome(False, False, Failure.TOO_SLOW, False, None, None, message)
    return None
