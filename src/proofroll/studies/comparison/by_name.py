"""Comparisons by name: of a comparison file, or the default comparison of a scene."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from proofroll.core.comparison import Band, Comparison
from proofroll.core.errors import InputError
from proofroll.core.plugins import parse_engine
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import load_scene, means_scene, read_scene_file
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison import compare as comparing
from proofroll.studies.comparison.default_comparison import BUDGET, asked_rows, default_comparison
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.comparison.planning import asked_for
from proofroll.studies.judging.asked_tolerance import AskedTolerance


def compare(
    name: str,
    engines: Sequence[str] = (),
    *,
    out: str | Path = "out",
    jobs: int | None = None,
    budget: float | None = None,
    until: float | None = None,
    every: float | None = None,
    **parameters: float,
) -> Outcome:
    """Compares engines with the truth, as ``proofroll compare`` does; a notebook shows the outcome as a table.

    Args:
        name: of a comparison, or the path of its file; or of a scene, the path of its folder or of a robot file.
        engines: to be run, each as ``name`` or ``name[key=value,…]``; by default all of the comparison, or all that
            can represent the scene. An engine without a row gets rows that claim nothing.
        out: folder for results; stored results are reused.
        jobs: workers at once; by default one for each core.
        budget: processor time of all runs of a scene [s]; by default 60.
        until: last time of a scene [s]; by default its duration, at most 2 s.
        every: sampling interval of a scene [s]; by default about a fiftieth of that.
        **parameters: of a scene, in SI units.

    Raises:
        InputError: an argument names something unknown or makes no sense.
    """
    workers = Workers()
    runner = Runner(Store(Path(out) / "cases"), jobs=jobs, workers=workers)
    loaded = comparison_named(name, parameters, workers, budget, engines=engines, until=until, every=every)
    return comparing.compare(loaded, runner, engines)


def comparison_named(
    name: str,
    parameters: Mapping[str, Any],
    workers: Workers,
    budget: float | None,
    scheduler: str | None = None,
    engines: Sequence[str] = (),
    until: float | None = None,
    every: float | None = None,
    tolerance: Sequence[str] = (),
) -> Comparison:
    """Comparison of this name, or the default comparison of a scene, within a budget.

    Args:
        name: of a comparison or a scene.
        parameters: of a scene, those that differ from the defaults.
        workers: pool for the questions to engines.
        budget: processor time of all runs of a scene [s]; None: the default, or no limit on a cluster.
        scheduler: of the cluster, or None.
        engines: engines of the user; those without a row in the comparison's file get rows that claim nothing.
        until: last time of a scene [s]; None: the default.
        every: sampling interval of a scene [s]; None: the default.
        tolerance: texts of the tolerance of a scene, as of :class:`AskedTolerance`; empty: the default.

    Raises:
        InputError: there is neither, or a budget, times or parameters were given for a comparison, which has its own.
    """
    if budget is not None and not 1 <= budget < math.inf:
        raise InputError("budget", budget, "give the processor time of all runs in seconds, at least 1")
    times = {key: value for key, value in (("until", until), ("every", every)) if value is not None}
    if means_scene(name, alone=bool(budget or parameters or times or tolerance)):
        if budget and scheduler:
            raise InputError("budget", budget, "runs on a cluster have none; drop --scheduler")
        seconds = None if scheduler else budget or BUDGET
        made = default_comparison(name, parameters, workers, seconds, engines, until, every)
        return by_tolerance(made, parameters, tolerance) if tolerance else made
    if budget:
        raise InputError("budget", budget, "a comparison file runs all that it asks for; name a scene, or use report")
    for key, value in parameters.items():
        raise InputError(key, value, "a comparison file has its own points; name a scene instead")
    for key, value in times.items():
        raise InputError(key, value, "a comparison file has its own times; name a scene instead")
    if tolerance:
        raise InputError("tolerance", tolerance[0], "a comparison file has its own; name a scene, or an --engine, too")
    return _with_rows_of(load_comparison(name), engines, workers)


def by_tolerance(comparison: Comparison, parameters: Mapping[str, Any], texts: Sequence[str]) -> Comparison:
    """The default comparison of a scene, judged by a person's tolerance.

    Raises:
        InputError: the tolerance has another form, or bounds nothing of the scene.
    """
    asked = AskedTolerance.of(texts, load_scene(comparison.scene, **parameters))
    bands = {name: Band(f"{asked.text} was asked for", asked.bounds) for name in comparison.bands}
    return replace(comparison, bands=bands)


def _with_rows_of(comparison: Comparison, engines: Sequence[str], workers: Workers) -> Comparison:
    """The comparison with rows of the engines that are asked for and have none; they claim nothing."""
    absent = [text for text in engines if not any(asked_for(row, parse_engine(text)) for row in comparison.rows)]
    if not absent:
        return comparison
    scene, file = load_scene(comparison.scene), read_scene_file(comparison.scene)
    rows = asked_rows(scene, file, workers, absent, comparison.rows[0].tolerance)
    return replace(comparison, rows=[*comparison.rows, *rows])
