"""Stability map of every engine, formulation and setting, along axes that take a scene to its extremes.

Each point of the map is a search for two boundaries on a ladder of steps or tolerances. All searches run side by side.
Every run is a stored case, so an interrupted map resumes where it was.
"""

import hashlib
import json
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from operator import attrgetter
from pathlib import Path

from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grids, time_grid
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import on_scene, resolve_with_truth
from proofroll.running.runner import Runner
from proofroll.studies.cases import case_of
from proofroll.studies.failure import TOO_SLOW, RunOutcome, Yardstick, run_outcome
from proofroll.studies.stability.axes import Axis, Effort
from proofroll.studies.stability.records import MappedValue
from proofroll.studies.swept_settings import Curve, curves_of

# Sampling intervals per natural time; the coarsest step is one of them, the finer ones divide it.
PER_PERIOD = 8
# Divisors of that interval for the finer steps, two per octave.
_FINEST = 17
_PARTS = [1, *(part for power in range(_FINEST) for part in (2 << power, 3 << power))]
# Most samples of a long run. The interval becomes an odd multiple of that above, so that the samples still visit all
# phases of an oscillation.
_MOST_SAMPLES = 400


@dataclass
class AxisValue:
    """A value of an axis for which there is a scene, with its truth.

    Attributes:
        axis: name of the axis.
        value: of the axis.
        parameters: of the scene, those that differ from the defaults.
        scene: with these parameters.
        until, every: length and sampling interval of every run [s].
        yardstick: truth and sizes by which runs are measured.
        problem: reason why there is no truth here.
    """

    axis: str
    value: float
    parameters: dict[str, float]
    scene: Scene
    until: float
    every: float
    yardstick: Yardstick = field(init=False)
    problem: str | None = None

    @property
    def steps(self) -> list[float]:
        """Fixed steps of the search, coarse first [s]."""
        return [self.scene.natural_time / PER_PERIOD / part for part in _PARTS]


def axis_values(name: str, axes: Sequence[Axis], effort: Effort) -> list[AxisValue | MappedValue]:
    """Values of all axes, without truths yet; a value that gives no scene is a MappedValue with the reason."""
    default = load_scene(name)
    values: list[AxisValue | MappedValue] = []
    for axis in axes:
        for value in effort.values_of(axis):
            # Parameters equal to their defaults are left out, so that axes share runs where they meet.
            defaults = {
                key: number for key, number in axis.at(default, value).items() if number != default.parameters[key]
            }
            try:
                scene = load_scene(name, **defaults)
            except ProofrollError as error:
                values.append(MappedValue(axis.name, value, defaults, str(error)))
                continue
            intervals = round(PER_PERIOD * (value if axis.horizon else effort.periods))
            stride = 1 + 2 * (intervals // (2 * _MOST_SAMPLES))
            every = stride * scene.natural_time / PER_PERIOD
            values.append(
                AxisValue(
                    axis=axis.name,
                    value=value,
                    parameters=defaults,
                    scene=scene,
                    until=every * max(1, intervals // stride),
                    every=every,
                )
            )
    return values


def measure(name: str, values: Sequence[AxisValue], runner: Runner, tell: Callable[[], None]) -> None:
    """Computes the truth at every value and sets its yardstick, and its problem if there is no truth."""
    _, facts = resolve_with_truth([], runner.workers)
    cases = [
        replace(
            case_at(name, value, on_scene(facts, value.scene, runner.workers), STUDY_TIME_LIMIT),
            between=off_grids(time_grid(value.until, value.every), [None, *value.steps]),
        )
        for value in values
    ]
    results = runner.run(cases, lambda *_: tell())
    for value, case in zip(values, cases, strict=True):
        result = results[case.key]
        truth = runner.store.stored(case).dataset if result.status == Status.DONE else None
        if truth is None:
            value.problem = f"there is no truth here: {result.message}"
        value.yardstick = Yardstick.of(value.scene, truth)


def case_at(name: str, value: AxisValue, facts: EngineFacts, limit: float) -> Case:
    """Case at a value with a time limit [s]."""
    return case_of(name, value.scene, value.parameters, facts, value.until, value.every, time_limit=limit)


@dataclass
class SearchResult:
    """Result of a search; rungs are numbered from the coarsest.

    Attributes:
        seen: rung -> outcome of its run.
        limit: first rung whose run is too long, or the number of rungs.
    """

    seen: dict[int, RunOutcome] = field(default_factory=dict)
    limit: int = 0

    def boundary(self, passes: Callable[[RunOutcome], bool]) -> tuple[int | None, int | None]:
        """Coarsest rung from which on all runs passed, and the failing rung next to it; None: there is no such rung.

        A rung that passes but is coarser than a failing one does not count: refining its step would make it fail.
        """
        failing = max((rung for rung, verdict in self.seen.items() if not passes(verdict)), default=None)
        holding = [rung for rung in self.seen if failing is None or rung > failing]
        return min(holding, default=None), failing


def search(size: int, stride: int) -> Generator[int, RunOutcome | None, SearchResult]:
    """Generator that yields rungs to run, receives their outcomes, and returns the result.

    It refines by ``stride`` rungs until a run is accurate, and a second one half a stride finer, too; the finest runs
    cost most. Then it bisects for both boundaries, and last runs the rung below each, since a pass right at a boundary
    may be luck. No rung is asked for twice. Sending None means that a rung is too long: it and all finer ones are left
    out.
    """
    result: SearchResult = SearchResult(limit=size)
    seen = result.seen
    rung, in_a_row = 0, 0
    while rung < result.limit:
        verdict = yield rung
        if verdict is None:
            result.limit = rung
            rung = (max(seen, default=-1) + rung) // 2
            if rung < 0 or rung in seen:
                break
            continue
        seen[rung] = verdict
        in_a_row = in_a_row + 1 if verdict.accurate else 0
        if in_a_row == 2:
            break
        following = rung + ((stride + 1) // 2 if verdict.accurate else stride)
        if following >= result.limit:
            following = (rung + result.limit) // 2
            if following == rung:
                break
        rung = following
    for passes in (attrgetter("stable"), attrgetter("accurate")):
        while (asked := _next(result, passes)) is not None:
            verdict = yield asked
            if verdict is None:
                result.limit = min(result.limit, asked)
            else:
                seen[asked] = verdict
    return result


def _next(search: SearchResult, passes: Callable[[RunOutcome], bool]) -> int | None:
    """Next rung to run for a boundary; None: the boundary is found."""
    holding, failing = search.boundary(passes)
    if holding is None:
        return None
    coarser = -1 if failing is None else failing
    middle = (coarser + holding) // 2
    rung = middle if middle > coarser else holding + 1
    return rung if rung < search.limit and rung not in search.seen else None


_TOLERANCES = [10.0**-power for power in range(1, 14)]
# Rungs skipped on the way down: a factor of four in the step, three decades of tolerance.
_STRIDE = {"dt": 4, "rtol": 3}
_WITNESS = "only cross-checks the truth; --engine maps it"
# A search stops after this many runs that met the time limit, as each finer one would meet it, too.
_TIMEOUTS = 2


@dataclass
class MapPoint:
    """One engine with its settings at one value of an axis.

    Attributes:
        curve: engine and settings.
        at: value of an axis.
        ladder: steps [s] or tolerances, coarse first.
        found: outcomes of the runs, by rung.
        cases, results: of the runs, by rung.
    """

    curve: Curve
    at: AxisValue
    ladder: list[float]
    found: SearchResult = field(default_factory=SearchResult)
    cases: dict[int, Case] = field(default_factory=dict)
    results: dict[int, Result] = field(default_factory=dict)

    def facts(self, rung: int) -> EngineFacts:
        """The engine with the settings of a rung."""
        facts = self.curve.facts
        return replace(facts, settings={**facts.settings, str(facts.resolution): self.ladder[rung]})

    def too_long(self, rung: int, effort: Effort) -> bool:
        """True if a run is not made: it takes too long, or several coarser runs met the time limit.

        The coarsest run is always made, even if it has more steps than allowed.
        """
        if self.timeouts >= _TIMEOUTS:
            return True
        if not rung or not self.curve.fixed_step:
            return False
        return self.at.until / self.ladder[rung] > effort.steps * (1 + 1e-9) or self._predicted(rung) > effort.seconds

    def _predicted(self, rung: int) -> float:
        """Processor time of a run as the coarsest that reached its end foretells [s]; 0: none did."""
        done = [number for number, result in self.results.items() if result.status == Status.DONE]
        if not done:
            return 0.0
        coarsest = min(done)
        seconds = self.results[coarsest].processor.get("advance", 0.0)
        return seconds * self.ladder[coarsest] / self.ladder[rung]

    @property
    def timeouts(self) -> int:
        """Count of runs that met the time limit."""
        return sum(result.status == Status.TIMEOUT for result in self.results.values())


@dataclass
class StabilityMap:
    """Stability map before it is summarised.

    Attributes:
        scene: name of the scene.
        default: the scene with its default parameters.
        axes, effort: question of the map.
        values: of the axes, with truths.
        points: every engine at every value.
        absent: engine -> why it is not on the map.
    """

    scene: str
    default: Scene
    axes: list[Axis]
    effort: Effort
    values: list[MappedValue]
    points: list[MapPoint]
    absent: dict[str, str]

    @property
    def runs(self) -> int:
        """Count of all runs."""
        return sum(len(point.results) for point in self.points)


Progress = Callable[[str, int], None]
Searching = Generator[int, RunOutcome | None, SearchResult]


def stability(
    scene: str,
    axes: Sequence[Axis],
    runner: Runner,
    *,
    engines: Iterable[str] = (),
    effort: Effort | None = None,
    progress: Progress | None = None,
) -> StabilityMap:
    """Maps the boundaries of engines.

    Args:
        scene: name or path; parameters that an axis does not change keep their defaults.
        axes: of the map.
        runner: runs the cases.
        engines: names or ``name[key=value,…]``; if empty all that are installed, without those that check the truth.
        effort: limits on the cost.
        progress: called with a text and the number of points finished since the last call.

    Raises:
        InputError: an unknown scene, parameter or engine.
    """
    effort = effort or Effort()
    tell: Progress = progress or (lambda _text, _count: None)
    default = load_scene(scene)
    curves, absent = curves_of(engines, runner.workers, default.requires)
    for curve in (curve for curve in curves if curve.facts.resolution is None):
        absent[curve.engine] = "has neither step nor tolerance: exact at any time, it has no boundary to look for"
    curves = [curve for curve in curves if curve.facts.resolution is not None]
    for curve in (curve for curve in curves if curve.fixed):
        advice = f"a map looks for the largest {curve.facts.resolution} itself; leave it out"
        raise InputError("engine", curve.engine, advice)
    if not engines:
        absent |= {curve.engine: _WITNESS for curve in curves if curve.facts.witness}
        curves = [curve for curve in curves if not curve.facts.witness]
    curves = _matched(curves) if effort.matched else curves
    asked = axis_values(scene, axes, effort)
    values = [axis_value for axis_value in asked if isinstance(axis_value, AxisValue)]
    measure(scene, values, runner, lambda: tell("the truth", 0))
    points = [
        MapPoint(curve, axis_value, axis_value.steps if curve.fixed_step else _TOLERANCES)
        for curve in curves
        for axis_value in values
    ]
    _search(scene, points, effort, runner, tell)
    refused = _refused(points)
    points = [point for point in points if point.curve.engine not in refused]
    mapped = [
        MappedValue(axis_value.axis, axis_value.value, axis_value.parameters, axis_value.problem)
        for axis_value in asked
    ]
    return StabilityMap(
        scene=scene,
        default=default,
        axes=list(axes),
        effort=effort,
        values=mapped,
        points=points,
        absent=absent | refused,
    )


def _refused(points: Sequence[MapPoint]) -> dict[str, str]:
    """Engine that refuses the scene at every value for the same reason -> that reason; it has no boundary."""
    endings: dict[str, set[tuple[str, str]]] = {}
    for point in points:
        answers = {(str(result.status), result.message) for result in point.results.values()}
        endings.setdefault(point.curve.engine, set()).update(answers)
    only = {engine: next(iter(answers)) for engine, answers in endings.items() if len(answers) == 1}
    return {engine: message for engine, (status, message) in only.items() if status == Status.REFUSED}


def _matched(curves: Sequence[Curve]) -> list[Curve]:
    """One curve for each formulation: the one with the matched settings, or else the first."""
    kept: dict[tuple[str, object], Curve] = {}
    for curve in curves:
        key = curve.facts.name, curve.facts.settings.get("formulation")
        if key not in kept or curve.facts.settings.get("preset") == "matched":
            kept[key] = curve
    return list(kept.values())


def _search(name: str, points: Sequence[MapPoint], effort: Effort, runner: Runner, tell: Progress) -> None:
    """Runs all searches side by side; each asks for its next case when the result of the last one arrives."""
    asking: dict[str, list[tuple[MapPoint, Searching, int]]] = {}
    results_by_key: dict[str, Result] = {}
    finished = 0

    def ended(point: MapPoint) -> None:
        nonlocal finished
        finished += 1
        words = f"{point.curve.facts.name}, {point.at.axis} = {point.at.value:g}"
        tell(f"{words}: {finished} of {len(points)} points", 1)

    def ask(point: MapPoint, searching: Searching, rung: int | None) -> list[Case]:
        """Advances a search to its next missing case; returns that case unless another search asked for it."""
        while rung is not None:
            if point.too_long(rung, effort):
                rung = _send(point, searching, None)
                continue
            case = point.cases[rung] = case_at(name, point.at, point.facts(rung), effort.limit)
            if case.key not in results_by_key:
                asking.setdefault(case.key, []).append((point, searching, rung))
                return [case] if len(asking[case.key]) == 1 else []
            rung = answer(point, searching, rung)
        ended(point)
        return []

    def answer(point: MapPoint, searching: Searching, rung: int) -> int | None:
        case = point.cases[rung]
        point.results[rung] = result = results_by_key[case.key]
        if result.status == Status.TIMEOUT:  # the outcome is open: a faster machine might have finished
            return _send(point, searching, None)
        dataset = None if result.trajectory is None else runner.store.stored(case).dataset
        return _send(point, searching, run_outcome(result, dataset, point.at.yardstick))

    def arrived(case: Case, result: Result) -> list[Case]:
        results_by_key[case.key] = result
        tell(case.engine.name, 0)
        further = []
        for point, searching, rung in asking.pop(case.key):
            further += ask(point, searching, answer(point, searching, rung))
        return further

    begun = []
    for point in points:
        searching: Searching = search(len(point.ladder), _STRIDE["dt" if point.curve.fixed_step else "rtol"])
        begun += ask(point, searching, next(searching))
    runner.follow(begun, arrived)


def _send(point: MapPoint, searching: Searching, outcome: RunOutcome | None) -> int | None:
    """Sends an outcome to a search; returns the next rung, or None when the search has ended."""
    try:
        return searching.send(outcome)
    except StopIteration as stop:
        point.found = stop.value
        return None


def failure_beyond(point: MapPoint, rung: int | None) -> RunOutcome | None:
    """Outcome on a failing rung; "too slow" if even the coarsest run takes too long; None: nothing failed."""
    if rung is not None:
        return point.found.seen[rung]
    if not point.found.seen and point.found.limit == 0:
        message = "even the coarsest run takes too long"
        return RunOutcome(
            stable=False, accurate=False, failure=TOO_SLOW, silent=False, error=None, time=None, message=message
        )
    return None


def stability_path(folder: Path, scene: str, axes: Sequence[Axis], engines: Sequence[str], effort: Effort) -> Path:
    """File of a map, named by a hash of the scene, the axes with their values, the engines and the effort."""
    identity = [load_scene(scene).digest, [asdict(axis) for axis in axes], sorted(engines), repr(effort)]
    digest = hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:10]
    return folder / "stability" / f"{Path(scene).name}-{digest}.json"
