"""Study of throughput: for engines, steps and numbers of copies the error of the worst copy and the cost of each."""

from __future__ import annotations

import dataclasses
import math
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from proofroll import InputError, Missing, ProofrollError, Refused
from proofroll.core.arrays import FloatArray
from proofroll.core.limits import RUN_TIME_LIMIT
from proofroll.core.observable import Role
from proofroll.core.plugins import engine_names, parse_engine, require_engine
from proofroll.core.scene import Scene
from proofroll.core.time_grid import require_whole_steps, time_grid
from proofroll.core.whole_turns import samples_between
from proofroll.report.labels import engine_words, setting_words, step
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.engine_questions import resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.process import status_of
from proofroll.running.runner import Runner
from proofroll.running.timing import machine
from proofroll.studies.cases import case_of, length_of, require_length, scene_of_run
from proofroll.studies.judging.reference import Reference
from proofroll_throughput.judging import JudgedCopies, judged_copies, references_of, twins_apart
from proofroll_throughput.measurement import CPU
from proofroll_throughput.variation import Variation, pattern_of

_MEASURED = "proofroll_throughput.measurement:measured"
SAMPLES = 20  # of a run, by default


@dataclass(frozen=True, kw_only=True)
class ThroughputRow:
    """One engine with some settings and a number of copies.

    Attributes:
        engine: as a command takes it.
        name: engine, formulation and setting for a reader.
        formulation, precision: of its settings.
        step: fixed step [s]; None: it has none.
        status, message: of the measurement, and the sentence of what failed.
        device: place of the computation, ``cpu`` for the processor.
        copies: number of copies.
        in_turn: reason for which they move one after the other; empty: they move together.
        worst: largest error of a copy whose states are finite; None: no copy has such.
        worst_copy: its number.
        worst_value: its value of the parameter.
        median: error that half of these copies do not exceed.
        twins_apart: largest difference of copies of one scene, of the largest number in an array of their states [1];
            None: no scene has two.
        not_finite: number of copies whose states are not finite to the end.
        microseconds: processor time of a copy and step [µs]; None: no fixed step, or no processor.
        seconds_per_second: processor time of a copy and simulated second [s/s]; None: no processor.
        seconds_before: processor time up to the end of the first step, building and compiling included [s].
    """

    engine: str
    name: str
    formulation: str = ""
    precision: str = ""
    step: float | None = None
    status: Status = Status.DONE
    message: str = ""
    device: str = ""
    copies: int = 0
    in_turn: str = ""
    worst: float | None = None
    worst_copy: int | None = None
    worst_value: float | None = None
    median: float | None = None
    twins_apart: float | None = None
    not_finite: int = 0
    microseconds: float | None = None
    seconds_per_second: float | None = None
    seconds_before: float | None = None

    @property
    def rate(self) -> float | None:
        """Copies times steps in a second of processor time; None without a cost."""
        return None if not self.microseconds else 1e6 / self.microseconds


@dataclass(frozen=True, kw_only=True)
class Throughput:
    """Result of a study of throughput.

    Attributes:
        scene: its name.
        parameter: name of the parameter in which copies differ.
        values: its values.
        until: length of the runs [s].
        quantity, unit: of the errors.
        error_bar: largest error bar of the truths.
        rows: of all engines, by engine, step and number of copies.
        date: of the measurement.
        machine: facts of the machine that affect speed.
    """

    scene: str
    parameter: str
    values: tuple[float, ...]
    until: float
    quantity: str
    unit: str
    error_bar: float
    rows: tuple[ThroughputRow, ...]
    date: str
    machine: Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class Question:
    """Question of a study of throughput.

    Attributes:
        scene: name or path.
        settings: values of the other parameters.
        variation: of the parameter in which copies differ.
        copies: numbers of copies.
        engines: as a person writes them; empty: all that are installed.
        steps: fixed steps [s]; empty: the step of each engine's own settings.
        until: length of the runs [s]; None: that of the scene.
        every: sampling interval [s]; None: a part of the length, at whole steps of every engine.
        quantity: observable of the errors; None: the one that decides the scene.
        time_limit: wall time of a row [s].
    """

    scene: str
    settings: Mapping[str, object]
    variation: Variation
    copies: Sequence[int]
    engines: Sequence[str] = ()
    steps: Sequence[float] = ()
    until: float | None = None
    every: float | None = None
    quantity: str | None = None
    time_limit: float = RUN_TIME_LIMIT


def make_throughput(
    asked: Question, runner: Runner, progress: Callable[..., object] = lambda *_, **__: None
) -> Throughput:
    """Runs a study: the truths first, then each row in a process of its own.

    Args:
        asked: question.
        runner: of the truths.
        progress: called with a description before each row, a count and a total.

    Raises:
        InputError: a value of the question makes no sense.
        Refused: the scene has several elements, or no truth for a value.
    """
    until = length_of(asked.scene, asked.until)
    require_length(until)
    values = asked.variation.values
    scenes = [_scene(asked, value) for value in values]
    quantity = _quantity(scenes[0], asked.quantity)
    names = [*asked.settings, asked.variation.parameter]
    settings = _settings(asked, scenes[0], runner)
    steps = {facts.step for _, facts in settings if facts is not None and facts.step is not None}
    every = _whole_interval(until, steps) if asked.every is None else asked.every
    times = time_grid(until, every)
    for size in steps.intersection(asked.steps):
        require_whole_steps(times, size)

    def case(scene: Scene, facts: EngineFacts, **others: Any) -> Case:
        return case_of(asked.scene, scene, names, facts, until, every, time_limit=asked.time_limit, **others)

    progress("truths", 0, len(settings) * len(asked.copies))
    references = references_of(scenes, values, asked.variation.parameter, runner, case)
    if any(quantity not in reference.curves for reference in references):
        raise InputError("--quantity", quantity, "the truth does not determine it; choose another one")
    bars = [reference.true(quantity, reference.curves[quantity]).error_bar for reference in references]
    measuring = _Measuring(
        references=references, values=values, times=times, quantity=quantity, time_limit=asked.time_limit
    )
    rows: list[ThroughputRow] = []
    for row, facts in settings:
        if facts is None:
            rows.append(row)
            continue
        cases = [case(scene, facts) for scene in scenes]
        for count in asked.copies:
            progress(row.name)
            rows.append(measuring.row(row, cases, count))
            if rows[-1].in_turn or rows[-1].status is Status.REFUSED:
                break  # other numbers of copies would be the same runs
    return Throughput(
        scene=asked.scene,
        parameter=asked.variation.parameter,
        values=values,
        until=until,
        quantity=quantity,
        unit=scenes[0].observables[quantity].unit,
        error_bar=max(bars),
        rows=tuple(rows),
        date=date.today().isoformat(),
        machine=machine(),
    )


def _whole_interval(until: float, steps: Collection[float]) -> float:
    """Usual sampling interval [s]: whole steps of every engine, about a twentieth of the length.

    Args:
        until: length [s].
        steps: of all engines [s]; one that does not divide the length is left out.
    """
    counts = [round(until / size) for size in steps if _ends_at(until, size)]
    if not counts:
        return until / SAMPLES
    common = math.gcd(*counts)  # of the length: every step divides each of these equal parts
    return max(1, round(common / SAMPLES)) * until / common


def _ends_at(until: float, step: float) -> bool:
    """True if a whole number of steps is the length."""
    try:
        require_whole_steps(time_grid(until, until), step)
    except InputError:
        return False
    return True


def _scene(asked: Question, value: float) -> Scene:
    """Scene with a value of the parameter. Raises Refused if it has several elements."""
    scene = scene_of_run(asked.scene, {**asked.settings, asked.variation.parameter: value})
    if len(scene.elements) > 1:
        raise Refused(f"copies are of one mechanism, and {asked.scene} has {len(scene.elements)} elements")
    return scene


def _quantity(scene: Scene, name: str | None) -> str:
    """Name of the judged observable. Raises InputError unless runs have values of it at their samples."""
    chosen = name or scene.deciding
    if scene.observable(chosen, "--quantity").role not in {Role.MOTION, Role.REACTION}:
        raise InputError("--quantity", chosen, "runs have no values of it at their samples; choose a coordinate")
    return chosen


def _settings(asked: Question, scene: Scene, runner: Runner) -> list[tuple[ThroughputRow, EngineFacts | None]]:
    """Rows without a measurement, each with the facts of its engine; None: the engine cannot be asked."""
    specs = [parse_engine(text) for text in asked.engines or engine_names()]
    for spec in specs:
        require_engine(spec.name)
        if asked.steps and "dt" in spec.options:
            raise InputError("--step", asked.steps[0], f"{spec} has a step of its own; leave one out")
    answers = resolve([(spec.name, spec.options) for spec in specs], runner.workers, scene.requires)
    settings: list[tuple[ThroughputRow, EngineFacts | None]] = []
    for spec, answer in zip(specs, answers, strict=True):
        if isinstance(answer, EngineFacts):
            able = scene.requires <= set(answer.provides.get(answer.settings["formulation"], ()))
            if not asked.engines and (answer.witness or not able):
                continue
            steps = asked.steps if answer.resolution == "dt" else ()
            finer = [replace(spec, options={**spec.options, "dt": size}) for size in steps] or [spec]
            for item, facts in zip(
                finer,
                resolve([(one.name, one.options) for one in finer], runner.workers, scene.requires),
                strict=True,
            ):
                if not isinstance(facts, EngineFacts):
                    raise facts
                settings.append((_named(str(item), facts), facts))
        elif isinstance(answer, Missing) or not asked.engines:
            row = ThroughputRow(engine=str(spec), name=str(spec), status=status_of(answer), message=str(answer))
            settings.append((row, None))
        else:
            raise answer
    return settings


def _named(engine: str, facts: EngineFacts) -> ThroughputRow:
    """Row of an engine with settings, without a measurement."""
    formulation = str(facts.settings.get("formulation", ""))
    size = step(facts.resolution, facts.settings[facts.resolution] if facts.resolution else None)
    words = engine_words(facts.name, formulation, facts.title), setting_words(engine, facts), size
    return ThroughputRow(
        engine=engine,
        name=", ".join(filter(None, words)),
        formulation=formulation,
        precision=facts.precision,
        step=facts.step,
    )


@dataclass(frozen=True)
class _Measuring:
    """Measurement of rows.

    Attributes:
        references: truth of each value.
        values: of the parameter.
        times: of the judged samples [s].
        quantity: judged observable.
        time_limit: wall time of a row [s].
    """

    references: Sequence[Reference]
    values: Sequence[float]
    times: FloatArray
    quantity: str
    time_limit: float

    def row(self, row: ThroughputRow, cases: Sequence[Case], count: int) -> ThroughputRow:
        """Row with a measurement of a number of copies, in a process of its own, whose caches are empty."""
        engine, step_size = cases[0].engine.name, cases[0].engine.step
        between = samples_between(self.references[0].scene, self.times, step_size)
        sampled = np.unique(np.concatenate([self.times, between]))
        pattern = pattern_of(count, len(self.values))
        workers = Workers()
        with tempfile.TemporaryDirectory() as folder:
            arguments = {
                "cases": [dataclasses.asdict(case) for case in cases],
                "pattern": pattern,
                "times": sampled.tolist(),
                "folder": folder,
            }
            try:
                require_whole_steps(self.times, step_size)
                with workers.lend(engine) as worker:
                    answer = worker.request(
                        {"do": "call", "function": _MEASURED, "arguments": arguments}, self.time_limit
                    )
                if "groups" not in answer:
                    raise Refused(answer["message"])
                times = sampled, self.times
                judged = judged_copies(answer["groups"], Path(folder), self.references, times, self.quantity)
            except ProofrollError as error:
                status = Status.REFUSED if isinstance(error, Refused) else status_of(error)
                return replace(row, copies=count, status=status, message=str(error))
            finally:
                workers.close()
        return self._judged(row, answer, judged)

    def _judged(self, row: ThroughputRow, answer: Mapping[str, Any], judged: Sequence[JudgedCopies]) -> ThroughputRow:
        """Row with the errors of its copies and their cost."""
        count = sum(len(item.copies) for item in judged)
        finite = sorted((item.error, item.index, item.copies) for item in judged if item.error is not None)
        errors = [error for error, _, copies in finite for _ in copies]
        row = replace(
            row,
            device=answer["device"],
            copies=count,
            in_turn=answer["why"],
            message=next((item.failure for item in judged if item.failure), ""),
            not_finite=count - len(errors),
            twins_apart=twins_apart(judged),
            seconds_before=answer["seconds_before"],
        )
        if finite:
            worst, index, copies = finite[-1]
            value, median = self.values[index], float(np.median(errors))
            row = replace(row, worst=worst, worst_copy=copies[0], worst_value=value, median=median)
        if row.device != CPU:
            return replace(row, message=f"processor time does not measure {row.device}")
        seconds, steps = answer["seconds"] / count, answer["steps"]
        return replace(
            row,
            microseconds=None if steps is None else 1e6 * seconds / steps,
            seconds_per_second=seconds / float(self.times[-1]),
        )
