"""Rows of every comparison, at one point of their parameters, on the real engines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from proofroll.core.comparison import Comparison, Edge, Row
from proofroll.core.plugins import engine_names, load_engine, parse_engine, resolve_settings
from proofroll.core.verdict import Verdict
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.outcome import Outcome

# Of those that cost most [s]: past the last event, and as long as every row needs for its verdict; `make report` runs
# them to their ends.
SHORTER = {"stick_slip": 2.5, "paper": 1.0, "accuracy": 1.0}
# Rows that differ from the truth later, or whose ladder shows only later that it confirms nothing [s].
LATE = {
    ("paper", "exudyn[formulation=spheres]"): 2.0,
    ("accuracy", "mujoco[formulation=chart,dt=1e-4]"): 1.5,
}


def loaded(name: str) -> Comparison:
    """A comparison, no longer than its verdicts need."""
    comparison = load_comparison(name)
    return replace(comparison, until=SHORTER.get(name, comparison.until))


def until(comparison: Comparison, row: Row) -> float:
    """How long a row is run [s]."""
    return LATE.get((comparison.name, row.engine), comparison.until)


def held(comparison: Comparison) -> list[Row]:
    """The first row of each formulation for each expectation; `make report` runs the others."""
    first: dict[tuple[str, str | None, frozenset[Verdict]], Row] = {}
    for row in comparison.rows:
        spec = parse_engine(row.engine)
        first.setdefault((spec.name, spec.options.get("formulation"), frozenset(row.expect)), row)
    return list(first.values())


# Comparisons whose rows run before a change lands: what switches, and a loop. All others run every night, and
# `make report` runs all.
DAILY = {"bouncing_ball", "slider_crank"}
ROWS = [
    pytest.param(
        comparison,
        row,
        id=f"{comparison.name}-{row.engine}",
        marks=[] if comparison.name in DAILY else [pytest.mark.nightly],
    )
    for comparison in map(loaded, comparison_names())
    for row in held(comparison)
]


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """One store for all processes of the test run: equal cases of different comparisons run once."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if base.name.startswith("popen-") else base
    return Store(Path(shared) / "agreement")


def middle(comparison: Comparison, row: Row) -> dict[str, float]:
    """The middle one of the combinations of parameters that are varied."""
    points = replace(comparison, points=[]).variations(row)
    return points[len(points) // 2]


@pytest.fixture(scope="session")
def outcomes(store: Store) -> Callable[[Comparison, Row], Outcome]:
    """What a comparison finds at the middle of a row's parameters: once for all rows that have the same."""
    found: dict[tuple[str, str, float], Outcome] = {}

    def outcome(comparison: Comparison, row: Row) -> Outcome:
        point, end = middle(comparison, row), until(comparison, row)
        key = (comparison.name, str(point), end)
        if key not in found:
            rows = [
                other
                for other in held(comparison)
                if (middle(comparison, other), until(comparison, other)) == (point, end)
            ]
            # How fast it is belongs to no verdict, and would cost as much again.
            asked = replace(comparison, rows=rows, vary={}, points=[dict(point)], until=end, timed=False)
            found[key] = compare(asked, Runner(store, jobs=1))
        return found[key]

    return outcome


@pytest.mark.one_in(4)
@pytest.mark.nightly_of("paper", "accuracy", "four_bar")
@pytest.mark.drill
@pytest.mark.parametrize("name", comparison_names())
def test_each_engine_begins(name: str, tmp_path: Path) -> None:
    """The first row of each engine that is expected to run does so for two samples, held against the truth."""
    comparison = load_comparison(name)
    asked = [row for row in reversed(comparison.rows) if Verdict.REFUSED not in row.expect]
    first = {row.engine.partition("[")[0]: replace(row, ladder=[1.0]) for row in asked}
    rows = list(first.values())
    point = middle(comparison, rows[0])
    brief = replace(comparison, rows=rows, vary={}, points=[point], until=2 * comparison.every, timed=False)
    outcome = compare(brief, Runner(Store(tmp_path), jobs=1))
    assert [run.row.engine for run in outcome.runs if run.result.status is not Status.DONE] == []
    assert all(run.judgements for run in outcome.runs)


@pytest.mark.drill
@pytest.mark.slow
@pytest.mark.parametrize(("comparison", "row"), ROWS)
def test_row_is_as_the_comparison_expects(
    comparison: Comparison, row: Row, outcomes: Callable[[Comparison, Row], Outcome]
) -> None:
    """At the middle one of the combinations that are varied, the verdicts are those that the file states."""
    outcome = outcomes(comparison, row)
    (run,) = (run for run in outcome.runs if run.row.engine == row.engine)
    assert run.contradictions == []
    assert run not in outcome.lost


# Observables that hang on when slip begins.
EVENTS = {"first_slip", "event_times", "event_order"}
# The last event at the stair edge is at 2.174 s.
LAST_SPECIAL = 2.25


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("engine", ["pinocchio[formulation=impulses,preset=tuned,dt=5e-4]"])
def test_row_at_the_stair_edge(engine: str, store: Store) -> None:
    """Claims hold at a stair edge, where the time of slip is not judged."""
    comparison = loaded("stick_slip")
    (row,) = (row for row in comparison.rows if row.engine == engine)
    special = [point for point in comparison.points if isinstance(point["mu_static"], Edge)]
    comparison = replace(comparison, rows=[row], vary={}, points=special, until=LAST_SPECIAL)

    outcome = compare(comparison, Runner(store, jobs=1))

    assert outcome.contradictions == []
    assert outcome.lost == []
    (edge,) = outcome.runs
    assert edge.parameters["mu_static"] == 0.391459
    verdicts = {judgement.observable: judgement.verdict for judgement in edge.judgements}
    assert {verdicts[name] for name in EVENTS} == {Verdict.ILL_POSED}
    assert verdicts["energy_balance"] is Verdict.AGREES


# Formulation and preset -> why the paper's comparison leaves them out.
OMITTED = {
    ("projection", "euler", "tuned"): "the same equations as matched, compiled",
    ("projection", "rotating_frame", "tuned"): "the same equations as matched, compiled",
    ("projection", "dependent", "default"): "a fixed step; it stands in comparisons of mechanisms",
    ("projection", "dependent", "tuned"): "the same equations as matched, compiled",
    ("exudyn", "spheres", "default"): "differs from matched by a wider zone of friction",
    ("exudyn", "discs", "default"): "rolls circles on planes, no balls",
    ("exudyn", "discs", "matched"): "as default",
    ("pinocchio", "impulses", "default"): "differs from matched by a looser solver",
    ("reduced", "equations", "matched"): "shares its equations with the truth; what it reaches stands in accuracy",
    ("reduced", "equations", "tuned"): "the same equations, compiled",
    ("reduced", "closed_form", "matched"): "is the truth where it exists",
}


@pytest.mark.parametrize("name", engine_names())
def test_every_setting_is_shown(name: str) -> None:
    """Every preset of every formulation stands in the paper's comparison, or is left out for a stated reason."""
    engine = load_engine(name)
    specs = [parse_engine(row.engine) for row in load_comparison("paper").rows]
    settings = [resolve_settings(engine, spec.options) for spec in specs if spec.name == name]
    shown = {(name, item.formulation, item.preset) for item in settings}
    there_are = {
        (name, formulation, preset)
        for formulation, presets in engine.presets.items()
        if MechanismCapability.UNBOUNDED_FRICTION in engine.provides[formulation]
        for preset in presets
    }
    assert there_are - shown == {key for key in OMITTED if key[0] == name}
