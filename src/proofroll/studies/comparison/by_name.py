"""Comparisons by name: of a comparison file, or the default comparison of a scene."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from proofroll.core.comparison import Comparison
from proofroll.core.errors import InputError
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import means_scene
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison import compare as comparing
from proofroll.studies.comparison.default_comparison import BUDGET, default_comparison
from proofroll.studies.comparison.outcome import Outcome


def compare(
    name: str,
    engines: Sequence[str] = (),
    *,
    out: str | Path = "out",
    jobs: int | None = None,
    budget: float | None = None,
    **parameters: float,
) -> Outcome:
    """Compares engines with the truth, as ``proofroll compare`` does; a notebook shows the outcome as a table.

    Args:
        name: of a comparison, or the path of its file; or of a scene, the path of its folder or of a robot file.
        engines: to be run; by default all of the comparison, or all that can represent the scene.
        out: folder for results; stored results are reused.
        jobs: workers at once; by default one for each core.
        budget: processor time of all runs of a scene [s]; by default 60.
        **parameters: of a scene, in SI units.

    Raises:
        InputError: an argument names something unknown or makes no sense.
    """
    workers = Workers()
    runner = Runner(Store(Path(out) / "cases"), jobs=jobs, workers=workers)
    return comparing.compare(comparison_named(name, parameters, workers, budget), runner, engines)


def comparison_named(
    name: str, parameters: Mapping[str, Any], workers: Workers, budget: float | None, scheduler: str | None = None
) -> Comparison:
    """Comparison of this name, or the default comparison of a scene, within a budget.

    Args:
        name: of a comparison or a scene.
        parameters: of a scene, those that differ from the defaults.
        workers: pool for the questions to engines.
        budget: processor time of all runs of a scene [s]; None: the default, or no limit on a cluster.
        scheduler: of the cluster, or None.

    Raises:
        InputError: there is neither, or a budget or parameters were given for a comparison, which has its own.
    """
    if budget is not None and not 1 <= budget < math.inf:
        raise InputError("budget", budget, "give the processor time of all runs in seconds, at least 1")
    if means_scene(name, alone=bool(budget or parameters)):
        if budget and scheduler:
            raise InputError("budget", budget, "what runs on a cluster has none; drop --scheduler")
        return default_comparison(name, parameters, workers, None if scheduler else budget or BUDGET)
    if budget:
        raise InputError("budget", budget, "a comparison file runs all that it asks for; name a scene, or use report")
    for key, value in parameters.items():
        raise InputError(key, value, "a comparison file has its own points; name a scene instead")
    return load_comparison(name)
