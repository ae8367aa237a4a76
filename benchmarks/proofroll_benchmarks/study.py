"""Cost of a whole study beside its engines: all of them, each with cases that last a second or more."""

from __future__ import annotations

import dataclasses
import math
import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from proofroll.core.errors import ProofrollError
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, EngineFacts, Result
from proofroll.running.engine_questions import describe, lent_workers, resolve
from proofroll.running.process import Worker
from proofroll.running.runner import Runner
from proofroll.running.store import Store

SCENE, EVERY = "sphere_in_cylinder", 0.02
JOBS = 2
# A case counts once it lasts this long inside the engine [s].
LEAST_SECONDS = 1.0
GOAL = 0.25
# Causes that are the engine's own time.
INSIDE = ("advance", "clean runs")
# Longer runs would go on for minutes at the speed of the slowest model [s].
_LONGEST = 200.0
POINTS: Sequence[Mapping[str, float]] = ({}, {"rolling_resistance": 5e-4})


def study_cases(engines: Sequence[str], seconds: float = LEAST_SECONDS) -> list[Case]:
    """Two cases per formulation that has the preset ``matched``, each as long as it takes to last ``seconds``.

    One is without rolling resistance and one with, both with timed clean runs. What a process costs is shared by an
    engine's cases, and a study with one case for each would be no usual one.

    Raises:
        ProofrollError: an engine cannot be asked.
    """
    needed, described = load_scene(SCENE).requires, {name: describe(name) for name in engines}
    wanted = [
        (name, {"formulation": formulation, "preset": "matched"})
        for name, said in described.items()
        for formulation, presets in said.presets.items()
        if "matched" in presets and needed <= set(said.provides[formulation])
    ]
    cases = []
    with lent_workers(None) as workers:
        for facts in resolve(wanted, workers):
            if not isinstance(facts, EngineFacts):
                raise facts
            for parameters in POINTS:
                digest = load_scene(SCENE, **parameters).digest
                short = Case(SCENE, dict(parameters), digest, facts, until=EVERY * 10, every=EVERY, timed=True)
                rate = workers.speed(short)
                if rate:
                    # What is measured is a short stretch; a little more than asked for makes up for that.
                    steps = max(10, math.ceil(1.2 * seconds / rate / EVERY))
                    cases.append(dataclasses.replace(short, until=min(steps * EVERY, _LONGEST)))
    return cases


def bench_study(
    engines: Sequence[str],
    jobs: int = JOBS,
    seconds: float = LEAST_SECONDS,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Runs the cases in a store of its own, and says where wall time × workers went.

    The settings are resolved within the measured time, as in every study, and cases that did not last are shown but
    judged with the others: what a study costs is judged as a whole. Wall time depends on other work of the machine:
    the load average of the minute before stands beside it.
    """
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None  # before anything of ours runs
    cases = study_cases(engines, seconds)
    with tempfile.TemporaryDirectory() as folder:
        start, processor = time.perf_counter(), -time.process_time()
        runner = Runner(Store(Path(folder)), jobs=jobs)
        resolve([(case.engine.name, case.engine.settings) for case in cases], runner.workers)
        resolved = time.perf_counter() - start
        results = runner.run(cases, progress=lambda case, _: progress(case.engine.name) if progress else None)
        wall, processor = time.perf_counter() - start, processor + time.process_time()
    cases_run = [(case, results[case.key]) for case in cases]
    return {
        "goal": GOAL,
        "jobs": jobs,
        "load_before": load,
        "wall_seconds": wall,
        **account([result.spent for _, result in cases_run], wall * jobs, resolved),
        "processor": by_processor([result.processor for _, result in cases_run], processor),
        "cases": [_row(case, result) for case, result in cases_run],
        "first_answer": {name: first_answer(name) for name in engines},
    }


def account(spent: Sequence[Mapping[str, float]], available: float, resolved: float = 0.0) -> dict[str, Any]:
    """Shares of the available wall seconds × workers: outside the engines, and by cause.

    Args:
        spent: of each case, by cause [s].
        available: wall seconds × workers.
        resolved: wall seconds in which settings were resolved, before the cases.
    """
    causes: dict[str, float] = {}
    for case in spent:
        for cause, value in case.items():
            causes[cause] = causes.get(cause, 0.0) + value
    causes["resolving settings"] = resolved
    causes["waiting"] = available - sum(causes.values())
    inside = sum(causes.get(cause, 0.0) for cause in INSIDE)
    shares = {cause: value / available for cause, value in sorted(causes.items(), key=lambda item: -item[1])}
    outside = 1 - inside / available
    return {"outside": outside, "within_goal": outside <= GOAL, "shares": shares}


def by_processor(spent: Sequence[Mapping[str, float]], parent: float) -> dict[str, Any]:
    """Account as :func:`account`, of the processor seconds that the study took, whatever else the machine computes.

    Waiting costs none. What a machine with as many idle cores as workers would take lies between this and that.

    Args:
        spent: of each case, by cause [s].
        parent: of the process that asks [s].
    """
    available = parent + sum(value for case in spent for value in case.values())
    accounted = account([*spent, {"parent": parent}], available)
    del accounted["shares"]["waiting"], accounted["shares"]["resolving settings"]
    return accounted | {"seconds": available}


def _row(case: Case, result: Result) -> dict[str, Any]:
    total = sum(result.spent.values())
    inside = sum(result.spent.get(cause, 0.0) for cause in INSIDE)
    return {
        "engine": case.engine.name,
        "formulation": case.engine.settings["formulation"],
        "parameters": case.parameters,
        "status": result.status.value,
        "until": case.until,
        "seconds": total,
        "outside": 1 - inside / total if total else None,
        "spent": result.spent,
    }


def first_answer(engine: str) -> float | None:
    """Wall seconds from starting a worker process to its first answer about an engine; None if it gives none."""
    with Worker() as worker:
        try:
            worker.request({"do": "resolve", "engine": engine, "options": {}}, 60.0)
        except ProofrollError:
            return None
        return worker.waited
