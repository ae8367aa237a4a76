"""Comparison from Python, of a comparison file or of a scene alone."""

from collections.abc import Sequence
from pathlib import Path

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
        engines: those to be run; by default all of the comparison, or all that can represent the scene.
        out: folder for results; stored results are reused.
        jobs: workers at once; by default one for each core.
        budget: processor time of all runs of a scene [s]; by default 60.
        **parameters: of a scene, in SI units.

    Raises:
        InputError: an argument names something unknown or makes no sense.
    """
    workers = Workers()
    if means_scene(name, alone=bool(parameters or budget)):
        comparison = default_comparison(name, parameters, workers, budget or BUDGET)
    elif parameters or budget:
        given = next(iter(parameters), "budget")
        raise InputError(given, parameters.get(given, budget), "a comparison file has its own; name a scene instead")
    else:
        comparison = load_comparison(name)
    return comparing.compare(comparison, Runner(Store(Path(out) / "cases"), jobs=jobs, workers=workers), engines)
