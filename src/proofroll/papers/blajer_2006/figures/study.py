"""Runs from which figures are drawn: those of one engine, and the same runs of the truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import ProofrollError
from proofroll.core.plugins import parse_engine
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.figures.definition import Figures, PlannedRun
from proofroll.papers.blajer_2006.figures.quantities import TIME, known, quantity
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import describe, resolve
from proofroll.running.runner import Runner
from proofroll.studies.cases import case_of

if TYPE_CHECKING:
    import xarray as xr

ORIENTATION = "orientation"
TRUTH = "truth"


@dataclass(frozen=True)
class FigureRun:
    """One run of an engine or of the truth.

    Attributes:
        body: the scene's ball with the run's parameters.
        result: result of the run.
        dataset: trajectory up to the run's end; None if there is none.
        start: Euler angles φ, θ, ψ of the body's axes at time 0 [rad].
    """

    body: RollingBall
    result: Result
    dataset: xr.Dataset | None
    start: tuple[float, float, float]

    @property
    def done(self) -> bool:
        """True if the run reached its intended end."""
        return self.result.status is Status.DONE and self.dataset is not None

    def curve(self, name: str, until: float | None = None) -> FloatArray | None:
        """A quantity up to a time [s], shape (time,); None: it is not in the trajectory, or there is none."""
        if self.dataset is None:
            return None
        values = quantity(name, self.body, self.dataset, self.start)
        if values is None or until is None:
            return values
        return values[self.dataset[TIME].to_numpy() <= until * (1 + 1e-12)]


@dataclass(frozen=True)
class FigureRuns:
    """All runs of a file of figures.

    Attributes:
        figures: the file.
        facts: the engine with complete settings.
        runs: runs of the engine, by name.
        truths: runs of the truth, by name.
        units: unit of every quantity.
    """

    figures: Figures
    facts: EngineFacts
    runs: dict[str, FigureRun]
    truths: dict[str, FigureRun]
    units: dict[str, str]

    @property
    def engine(self) -> str:
        """The engine and its formulation, for a legend."""
        return " ".join(filter(None, (self.facts.name, str(self.facts.settings.get("formulation", "")))))

    @property
    def lost(self) -> list[str]:
        """Sentences on the runs that did not reach their end."""
        made = [(self.engine, self.runs), (TRUTH, self.truths)] if self.truths is not self.runs else [
            (self.engine, self.runs)
        ]  # fmt: skip
        return [
            f"{name}, {run}: {item.result.status}, {item.result.message}"
            for name, items in made
            for run, item in items.items()
            if not item.done
        ]


def run_figures(
    figures: Figures, runner: Runner, engine: str | None = None, progress: Callable[[Case, Result], None] | None = None
) -> FigureRuns:
    """Runs every case of a file in one engine and in the truth; stored results are reused.

    Raises:
        InputError, Missing: the engine does not exist or is not installed.
    """
    chosen = engine or figures.engine
    names = {chosen: parse_engine(chosen), TRUTH: parse_engine(TRUTH)}
    names |= {planned.engine: parse_engine(planned.engine) for planned in figures.runs.values() if planned.engine}
    known_facts = dict[str, EngineFacts]()
    resolved = resolve([(spec.name, spec.options) for spec in names.values()], runner.workers)
    for name, facts_of in zip(names, resolved, strict=True):
        if isinstance(facts_of, ProofrollError):
            raise facts_of
        known_facts[name] = facts_of
    # Orientation is requested only of an engine that has it: without it all but the angles can still be drawn.
    facts, spec, asks = known_facts[chosen], names[chosen], tuple[str, ...]()
    if spec.name != TRUTH and figures.wants_orientation:
        provided = describe(spec.name, runner.workers).provides[str(facts.settings.get("formulation"))]
        asks = (ORIENTATION,) if MechanismCapability.ORIENTATION in provided else ()
    cases, truths = dict[str, Case](), dict[str, Case]()
    for name, planned in figures.runs.items():
        run_engine = planned.engine if planned.engine and spec.name != TRUTH else chosen
        cases[name] = _case(figures, planned, known_facts[run_engine], asks if run_engine == chosen else ())
        truths[name] = _case(figures, planned, known_facts[TRUTH], ())
    results = runner.run([*cases.values(), *truths.values()], progress)

    def made(asked: dict[str, Case]) -> dict[str, FigureRun]:
        return {name: _made(figures, case, results[case.key], runner) for name, case in asked.items()}

    engine_runs = made(cases)
    body = next(iter(engine_runs.values())).body
    return FigureRuns(
        figures=figures,
        facts=facts,
        runs=engine_runs,
        truths=engine_runs if spec.name == TRUTH else made(truths),
        units=known(body),
    )


def _case(figures: Figures, planned: PlannedRun, facts: EngineFacts, asks: tuple[str, ...]) -> Case:
    parameters, every = planned.parameters, planned.every
    scene = load_scene(figures.scene, asks=asks, **parameters)
    limit = figures.time_limit
    return case_of(figures.scene, scene, parameters, facts, figures.until, every or figures.every, time_limit=limit)


def _made(figures: Figures, case: Case, result: Result, runner: Runner) -> FigureRun:
    path = runner.store.trajectory(case)
    dataset = read(path) if result.trajectory is not None and path.is_file() else None
    if dataset is not None and "body" in dataset.dims:  # a ball that may slip is a body, the only one
        dataset = dataset.isel(body=0, drop=True)
    return FigureRun(rolling_ball(load_scene(figures.scene, **case.parameters)), result, dataset, figures.start_angles)


def study_content(study: FigureRuns) -> dict[str, Any]:
    """Data of the figures' sources for JSON: article, scene, engine, versions, runs."""
    figures = study.figures
    versions: dict[str, str] = {}
    for made in (*study.runs.values(), *study.truths.values()):
        versions |= made.result.versions
    return {
        "title": figures.title,
        "source": figures.source,
        "scene": figures.scene,
        "engine": {"name": study.facts.name, "settings": study.facts.settings},
        "until": figures.until,
        "every": figures.every,
        "versions": versions,
        "runs": [
            {
                "name": name,
                "parameters": planned.parameters,
                "status": study.runs[name].result.status.value,
                "message": study.runs[name].result.message,
                "truth": study.truths[name].result.message,
            }
            for name, planned in figures.runs.items()
        ],
        "lost": study.lost,
    }
