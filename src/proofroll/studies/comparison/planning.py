"""Plans the cases of a comparison: every row at every point of its parameters, with its ladder of steps."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.comparison import Comparison, Edge, Row
from proofroll.core.engine import whole_steps
from proofroll.core.errors import InputError, ProofrollError, error_location
from proofroll.core.multi_element import represents
from proofroll.core.plugins import EngineSpec, parse_engine, place_of, plain_name
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grids, time_grid
from proofroll.core.truth import edge_between
from proofroll.files.scene_file import SceneFile, load_scene, read_scene_file
from proofroll.running.case import Case, EngineFacts
from proofroll.running.engine_questions import describe_each, on_scene, resolve, resolve_with_truth
from proofroll.running.idle_workers import Workers
from proofroll.running.process import processor_seconds
from proofroll.studies.cases import case_of

# Expected verdicts that allow a formulation that cannot represent the scene.
_UNFIT = frozenset({"failed", "refused", "another-scene"})
# Default factors of a ladder of steps.
_USUAL = [4.0, 2.0, 1.0]
# Ladders that replace it if its steps do not fit between samples, the cheapest first.
_LADDERS = (_USUAL, [2.0, 1.0, 0.5], [1.0, 0.5, 0.25])

# Largest number of points of a sweep at which a row has its whole ladder in any case.
_LADDER_POINTS = 5
_FIRST = " (the first "  # beginning of a remark in the title of a comparison


def point_name(parameters: Mapping[str, float | Edge]) -> str:
    """Text of a point of the parameters, e.g.

    ``speed=4, rolling_resistance=0.0005``; an edge is shown by its two ends.
    """
    ends = {key: value.edge_between if isinstance(value, Edge) else (value,) for key, value in parameters.items()}
    return ", ".join(f"{key}={'…'.join(f'{end:.12g}' for end in ends_of)}" for key, ends_of in ends.items())


def at_point(parameters: dict[str, float]) -> str:
    """Phrase with a point's parameters, e.g. `` at speed=4``; empty without parameters."""
    return f" at {point_name(parameters)}" if parameters else ""


@dataclass(frozen=True)
class Planned:
    """A row at a point, with factor on the step -> case of its ladder.

    The run's own case has the factor 1. A row of the formulation whose steps are the reference has no cases.

    Attributes:
        spare: True if its further steps are run only where results of the own steps ask for them.
    """

    row: Row
    parameters: dict[str, float]
    facts: EngineFacts | ProofrollError
    ladder: dict[float, Case] = field(default_factory=dict)
    spare: bool = False

    @property
    def is_reference(self) -> bool:
        """True if the truth is a reference by steps of its formulation."""
        return isinstance(self.facts, EngineFacts) and not self.ladder

    @property
    def witness(self) -> bool:
        """True if its engine cross-checks the truth."""
        return isinstance(self.facts, EngineFacts) and self.facts.witness

    @property
    def own_step(self) -> Planned:
        """The row with its own step alone."""
        return replace(self, ladder={factor: case for factor, case in self.ladder.items() if factor == 1})

    def keys(self, truths: Mapping[str, Case]) -> set[str]:
        """Keys of the cases that its judgement needs."""
        return {case.key for case in (truths[point_name(self.parameters)], *self.ladder.values())}


@dataclass(frozen=True)
class Plan:
    """Cases of a comparison, to be run together with those of others and then judged.

    Attributes:
        comparison: with its edges found.
        scene: with its default parameters.
        file: of the scene.
        scenes: :func:`point_name` -> scene at that point.
        truths: :func:`point_name` -> case of the truth.
        runs: all rows at all points.
    """

    comparison: Comparison
    scene: Scene
    file: SceneFile
    scenes: dict[str, Scene]
    truths: dict[str, Case]
    runs: list[Planned]

    @property
    def cases(self) -> list[Case]:
        """All cases; equal ones may occur several times, and the runner runs them once."""
        return [case for stage in self.stages for case in stage]

    @property
    def first_cases(self) -> list[Case]:
        """All cases but the steps that results of others may make needless."""
        return replace(self, runs=[run.own_step if run.spare else run for run in self.runs]).cases

    @property
    def stages(self) -> list[list[Case]]:
        """Cases in order of value if not all can be run: truths, runs of engines, and the other steps of their ladders.

        Those of witnesses come last: they cross-check the truth and cost no engine its time.
        """
        engines = [run for run in self.runs if not run.witness]
        witnesses = [run for run in self.runs if run.witness]
        parts: list[list[Case]] = []
        for runs in (engines, witnesses):
            parts += [[run.ladder[1] for run in runs if 1 in run.ladder], _further_steps(runs)]
        return [[*self.truths.values()], *parts]

    @property
    def ladders(self) -> list[Case]:
        """Cases of the further steps of all rows."""
        return _further_steps(self.runs)

    @property
    def brief(self) -> Plan:
        """The plan reduced to the combinations of a brief report."""
        return self._part(self.comparison.briefly())

    def shortened(self, until: float) -> Plan:
        """The plan up to an earlier time [s]."""

        def earlier(case: Case) -> Case:
            return replace(case, until=until, between=tuple(time for time in case.between if time < until))

        title = f"{self.comparison.title.partition(_FIRST)[0]}{_FIRST}{until:g} s, for which the budget suffices)"
        return replace(
            self,
            comparison=replace(self.comparison, until=until, title=title, cut=True),
            truths={name: earlier(case) for name, case in self.truths.items()},
            runs=[
                replace(run, ladder={factor: earlier(case) for factor, case in run.ladder.items()}) for run in self.runs
            ],
        )

    def ended(self, unfinished: Set[str]) -> Plan:
        """The plan without combinations that have ``unfinished`` cases; those of a brief report always stay."""
        left = {point_name(run.parameters) for run in self.runs if run.keys(self.truths) & unfinished}
        left -= self.brief.truths.keys()
        points = self.comparison.combinations()
        return self._part(self.comparison.at([point for point in points if point_name(point) not in left]))

    def _part(self, comparison: Comparison) -> Plan:
        """The plan reduced to the combinations of ``comparison``, which must be some of its own."""
        names = {point_name(point) for point in comparison.combinations()}
        truths = {name: case for name, case in self.truths.items() if name in names}
        return replace(
            self,
            comparison=comparison,
            truths=truths,
            runs=[run for run in self.runs if point_name(run.parameters) in names],
        )


def _further_steps(runs: Sequence[Planned]) -> list[Case]:
    return [case for run in runs for factor, case in run.ladder.items() if factor != 1]


def plan(comparison: Comparison, engines: Iterable[str] = (), workers: Workers | None = None) -> Plan:
    """Plan of a comparison, or of its rows of some engines only.

    An engine in another interpreter, ``mujoco@3.8.1``, runs the rows of ``mujoco`` there.

    Args:
        comparison: rows, points and times.
        engines: to which it is restricted; empty: all.
        workers: pool for questions to engines; None: new workers.

    Raises:
        InputError: an engine or setting that does not exist.
    """
    begin = processor_seconds()
    chosen = [parse_engine(text) for text in dict.fromkeys(engines)]
    numbered = [
        (i, row)
        for i, row in enumerate(comparison.rows)
        if not chosen or any(asked_for(row, spec) and not _moved(row, spec) for spec in chosen)
    ]
    for spec in chosen:
        numbered += [(i, moved) for i, row in enumerate(comparison.rows) if (moved := _moved(row, spec))]
    rows = [row for _, row in numbered]
    if not rows:
        names = ", ".join(dict.fromkeys(parse_engine(row.engine).name for row in comparison.rows))
        raise InputError(
            "engine",
            ", ".join(map(str, chosen)),
            f"{comparison.name} compares {names}; proofroll new comparison writes a file with others",
        )
    asked = scene_at(comparison, next(iter(comparison.variations(rows[0])), {}))
    resolved, truth_facts = row_facts(comparison, numbered, asked.requires, workers)
    comparison = with_edges(comparison)
    times = time_grid(comparison.until, comparison.every)
    steps = [facts.step if isinstance(facts, EngineFacts) else None for facts in resolved]
    rows = [_fitting(row, step, times) for row, step in zip(rows, steps, strict=True)]
    rungs = _rungs(rows, resolved, workers)
    scenes: dict[str, Scene] = {}
    truths: dict[str, Case] = {}
    runs: list[Planned] = []
    of_engines = {facts.step for facts in resolved if isinstance(facts, EngineFacts)}
    of_engines |= {rung.step for ladder in rungs for rung in ladder.values()}
    between = off_grids(times, of_engines)
    brief = comparison.briefly()
    for row, facts, ladder_facts in zip(rows, resolved, rungs, strict=True):
        with_ladder = _ladder_points(comparison.variations(row), brief.variations(row))
        for point in comparison.variations(row):
            name = point_name(point)
            if name not in scenes:
                scenes[name] = scene_at(comparison, point)
                case = _case(comparison, scenes[name].fully_asked, point, truth_facts)
                truths[name] = replace(case, between=between, engine=on_scene(truth_facts, scenes[name], workers))
            scene = scenes[name]
            if not isinstance(facts, EngineFacts):
                runs.append(Planned(row, point, facts))
                continue
            reference = next(iter(truths[name].engine.steps), "")
            ladder = {
                factor: _case(comparison, scene, point, rung, timed=comparison.timed and factor == 1)
                for factor, rung in ladder_facts.items()
                if facts.formulated != reference
            }
            spare = len(ladder) > 1 and point not in with_ladder
            runs.append(Planned(row, point, facts.on(scene.requires), ladder, spare=spare))
    spent = comparison.spent + processor_seconds() - begin
    try:
        scene = load_scene(comparison.scene)
    except InputError:  # of a robot file, which a parameter repairs
        if not scenes:
            raise
        scene = next(iter(scenes.values()))
    file = read_scene_file(comparison.scene)
    return Plan(
        comparison=replace(comparison, spent=spent), scene=scene, file=file, scenes=scenes, truths=truths, runs=runs
    )


def _ladder_points(points: list[dict[str, float]], brief: list[dict[str, float]]) -> list[dict[str, float]]:
    """Points at which a row has its whole ladder in any case: those of a brief report first, spread evenly."""
    chosen: list[dict[str, float]] = []
    for group in (brief, [point for point in points if point not in brief]):
        count = min(len(group), _LADDER_POINTS - len(chosen))
        chosen += [group[index] for index in np.linspace(0, len(group) - 1, count).round().astype(int)]
    return chosen


def scene_at(comparison: Comparison, point: Mapping[str, float]) -> Scene:
    """Scene at a point of the parameters.

    Raises:
        InputError: the scene has no such parameter, or not with this value; the text names the comparison's file.
    """
    with error_location(f"{comparison.name}.toml"):
        return load_scene(comparison.scene, **point)


def asked_for(row: Row, spec: EngineSpec) -> bool:
    """True if a user who asks for an engine, perhaps with settings or at another place, asks for this row."""
    engine = parse_engine(row.engine)
    if spec.options:
        return engine.name == spec.name and dict(engine.options) == dict(spec.options)
    return engine.name in {spec.name, plain_name(spec.name)}


def _moved(row: Row, spec: EngineSpec) -> Row | None:
    """A row moved to its engine in another interpreter, ``mujoco@3.8.1``; None: it stays, or has another engine."""
    engine = parse_engine(row.engine)
    if spec.options or not place_of(spec.name) or engine.name != plain_name(spec.name):
        return None
    return replace(row, engine=str(replace(engine, name=spec.name)))


def row_facts(
    comparison: Comparison, rows: Sequence[tuple[int, Row]], requires: Collection[str], workers: Workers | None = None
) -> tuple[list[EngineFacts | ProofrollError], EngineFacts]:
    """Complete settings of rows, or an error for each, and those of the truth.

    Args:
        comparison: for messages.
        rows: index of each row in the file, and the row.
        requires: capabilities that the scene requires.
        workers: pool for the questions; None: new workers.

    Raises:
        InputError: an engine or setting that does not exist.
    """
    specs = [parse_engine(row.engine) for _, row in rows]
    resolved, truth = resolve_with_truth([(spec.name, spec.options) for spec in specs], workers, requires)
    for (index, row), facts in zip(rows, resolved, strict=True):
        if isinstance(facts, InputError):
            raise facts.within(f"{comparison.name}.toml: rows.{index}.engine", row.engine)
    return resolved, truth


def require_fit(comparison: Comparison, facts: Sequence[EngineFacts | ProofrollError], workers: Workers) -> None:
    """Checks that the scene allows every point, and that formulations and steps suit the scene and the samples.

    Rows that are expected to fail are not checked.

    Raises:
        InputError: the first that does not fit.
    """
    descriptions = describe_each([item.name for item in facts if isinstance(item, EngineFacts)], workers)
    times = time_grid(comparison.until, comparison.every)
    for point in comparison.combinations():
        ends = product(*(value.edge_between if isinstance(value, Edge) else (value,) for value in point.values()))
        numbers, *others = [dict(zip(point, values, strict=True)) for values in ends]
        scene, *_ = [scene_at(comparison, end) for end in (numbers, *others)]
        for index, (row, item) in enumerate(zip(comparison.rows, facts, strict=True)):
            if not isinstance(item, EngineFacts) or point not in comparison.combinations(row.only):
                continue
            description = descriptions[item.name]
            if isinstance(description, ProofrollError) or _UNFIT & set(row.expected(numbers)):
                continue
            formulation, place = item.settings["formulation"], f"{comparison.name}.toml: rows.{index}.engine"
            if not represents(scene, formulation, description.provides):
                lacking = ", ".join(sorted(scene.requires - set(description.provides[formulation])))
                advice = f"it does not have {lacking}{at_point(numbers)}; expect refused there, or leave it out"
                raise InputError(place, row.engine, advice)
            if (step := item.step) is None:
                continue
            if error := _misfit([1.0], step, times):
                raise error.within(place, row.engine)
            ladder = _fitting(row, step, times).ladder
            if _misfit(ladder, step, times):
                advice = "a step of it does not divide the interval between samples (`every`); "
                advice += f"{_fitting(replace(row, ladder=_USUAL), step, times).ladder} does"
                raise InputError(f"{place.removesuffix('engine')}ladder", ladder, advice)


def _rungs(
    rows: list[Row], resolved: list[EngineFacts | ProofrollError], workers: Workers | None
) -> list[dict[float, EngineFacts]]:
    """Factor -> facts of each rung of every row's ladder, as far as the engine allows the scaled resolution."""
    asked: list[tuple[int, float, EngineFacts]] = []
    for index, (row, facts) in enumerate(zip(rows, resolved, strict=True)):
        if isinstance(facts, EngineFacts) and facts.resolution is not None:
            step = facts.settings[facts.resolution]
            most = 1.0 if facts.resolution == "rtol" else np.inf  # an rtol of 1 or more would ask for nothing
            factors = [factor for factor in row.ladder if factor != 1 and step * _scaled(facts, factor) < most]
            asked += [(index, factor, facts) for factor in factors]
    scaled = [
        (facts.name, {**facts.settings, facts.resolution: facts.settings[facts.resolution] * _scaled(facts, factor)})
        for _, factor, facts in asked
        if facts.resolution is not None
    ]
    ladders = [{1.0: facts} if isinstance(facts, EngineFacts) else {} for facts in resolved]
    for (index, factor, _), scaled_facts in zip(asked, resolve(scaled, workers), strict=True):
        if isinstance(scaled_facts, EngineFacts):
            ladders[index][factor] = scaled_facts
    return ladders


def _scaled(facts: EngineFacts, factor: float) -> float:
    """Factor on the resolution: where a step is doubled, a tolerance is loosened by a decade."""
    return factor if facts.resolution == "dt" else float(10 ** np.log2(factor))


def _case(
    comparison: Comparison, scene: Scene, point: dict[str, float], facts: EngineFacts, timed: bool = False
) -> Case:
    limits = {"timed": timed, "time_limit": comparison.time_limit}
    return case_of(comparison.scene, scene, point, facts, comparison.until, comparison.every, **limits)


def with_edges(comparison: Comparison) -> Comparison:
    """The comparison with the value of every edge found.

    Raises:
        InputError: the truth finds no edges of this parameter, or none between the two values.
    """
    points = [dict(point) for point in comparison.points]
    for point in points:
        for name, value in point.items():
            if isinstance(value, Edge):
                point[name] = _edge_found(comparison, point, name, value)
    return replace(comparison, points=points)


def _edge_found(comparison: Comparison, point: dict[str, float | Edge], name: str, edge: Edge) -> float:
    place = f"{comparison.name}: points: {name}"
    low, high = edge.edge_between
    others = {key: value for key, value in point.items() if isinstance(value, float)}
    scene = load_scene(comparison.scene, **{**others, name: high})
    try:
        jump = edge_between(scene, name, low, high, comparison.until)
    except InputError as error:
        raise InputError(place, error.value, error.advice) from None
    if jump is None:
        raise InputError(place, list(edge.edge_between), f"nothing jumps between these values of {name}")
    return jump


def _misfit(factors: Sequence[float], step: float, times: FloatArray) -> InputError | None:
    """Error for a ladder whose steps do not divide the sampling intervals (the last may be shorter), or None."""
    for factor in factors:
        for start, end in (times[:2].tolist(), times[-2:].tolist()):
            try:
                whole_steps(start, end, factor * step)
            except InputError as error:
                return error
    return None


def _fitting(row: Row, step: float | None, times: FloatArray) -> Row:
    """The row, with a ladder that fits the samples if it has the default one and that does not fit."""
    if step is None or row.ladder != _USUAL:
        return row
    ladder = next((factors for factors in _LADDERS if _misfit(factors, step, times) is None), row.ladder)
    return replace(row, ladder=list(ladder))
