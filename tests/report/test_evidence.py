"""The evidence of a comparison: curves with both error bars, everything that is claimed, and cost with intervals."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flat_judging import judged_curve

from proofroll.core.columns import PERIOD, UNCERTAIN
from proofroll.core.comparison import ExceptAt, Row, Tolerance
from proofroll.core.dataset import observe
from proofroll.core.number_format import error
from proofroll.core.verdict import Verdict
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import StoredTrajectory, write
from proofroll.report.comparison.plots import MOST_POINTS, kept, point_curves
from proofroll.report.comparison.records import clean_cost
from proofroll.report.comparison.tables import cost_interval, cost_title, costs, expectations
from proofroll.report.page.html import page
from proofroll.report.page.records import report_content
from proofroll.report.styles import OUTLINES, engine_colours, styles
from proofroll.running.case import Result, Status
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.comparison.planning import point_name


def test_rough_curves_keep_extrema_ends_and_gaps() -> None:
    """Whatever the curve: its largest and smallest sample are drawn, its ends too, and no more than wanted."""
    rng = np.random.default_rng(7)
    for length in (401, 1000, 20001):
        for _ in range(25):
            one, other = np.cumsum(rng.normal(size=length)), rng.normal(size=length)
            one[rng.integers(0, length, 9)] = np.nan
            at = kept([one, other])
            assert at.size <= 2 * MOST_POINTS
            assert np.all(np.diff(at) > 0)
            wanted = {0, length - 1, np.nanargmax(one), np.nanargmin(one), np.argmax(other), np.argmin(other)}
            assert wanted <= set(at.tolist())
    ended = np.where(np.arange(2000) < 700, 1.0, np.nan)
    assert np.isnan(ended[kept([ended])]).any(), "what is not there is not drawn"


@pytest.mark.drill
def test_largest_error_that_is_drawn_is_the_judged_one(made: tuple[Outcome, Store], tmp_path: Path) -> None:
    """Of thousands of samples with one that sticks out, to all digits that the page shows."""
    outcome, _ = made
    store, point = Store(tmp_path), {"speed": 4.0}
    name = "speed=4"
    scene = load_scene("sphere_in_cylinder", **point)
    point_of_made = outcome.points[name]
    true = point_of_made.trajectory.dataset
    times = np.linspace(0.0, 1.0, 6001)
    fine = true.interp(time=times)
    file = store.trajectory(point_of_made.case)
    write(fine, file)
    run = next(run for run in outcome.runs if run.parameters == point)
    assert run.case is not None
    off = fine.copy(deep=True)
    rng = np.random.default_rng(3)
    for curve in ("gamma", "z", "N", "F2", "F3"):
        noise = rng.normal(size=times.size) * 1e-6
        noise[rng.integers(10, times.size)] = -1.23456789e-4
        off[curve] = off[curve] + noise
    write(off, store.trajectory(run.case))
    expected = observe(scene, fine)
    judged = {
        key: judged_curve(key, "", curve, expected[key], truth_error_bar=0.0, tolerance=1.0, scale=1.0, limit=None)
        for key, curve in observe(scene, off).items()
        if key in {"gamma", "z", "N", "F2", "F3"}
    }
    run = dataclasses.replace(run, trajectory=store.stored(run.case))
    point_there = dataclasses.replace(point_of_made, trajectory=StoredTrajectory(file))
    one = dataclasses.replace(outcome, runs=[run], points={name: point_there})
    drawn = {item.name: item.engines[0] for item in point_curves(one)[0].observables}
    for key, judgement in judged.items():
        assert len(drawn[key].at or ()) < times.size / 5
        largest = max(abs(value) for value in drawn[key].difference if value is not None)
        assert error(largest, 3) == error(judgement.error, 3), key


def test_turns_that_no_sample_tells_are_no_error_of_a_curve(made: tuple[Outcome, Store], tmp_path: Path) -> None:
    """An angle whose turns are uncertain is drawn on the turns of the truth, as it is judged, in a short run too."""
    outcome, run = made[0], made[0].runs[0]
    store, point = Store(tmp_path / "cases"), outcome.points[point_name(run.parameters)]
    assert run.case is not None
    assert point.reference is not None
    turned = point.reference.dataset.copy(deep=True).isel(time=slice(30))
    turned["gamma"] = turned["gamma"] + 1e-3 + 4 * np.pi
    turned["gamma"].attrs |= {UNCERTAIN: "samples are far apart", PERIOD: 2 * np.pi}
    write(turned, store.trajectory(run.case))
    one = dataclasses.replace(outcome, runs=[dataclasses.replace(run, trajectory=store.stored(run.case))])
    gamma = next(item for item in point_curves(one)[0].observables if item.name == "gamma")
    assert gamma.engines[0].difference[:30] == pytest.approx([1e-3] * 30)
    assert gamma.engines[0].difference[30] is None


def test_tolerances_and_limits_go_with_the_curves(made: tuple[Outcome, Store]) -> None:
    """A judged curve has its tolerance; one with a ladder its limit; one that was not judged neither."""
    outcome, _ = made
    first = outcome.runs[0]
    limited = [
        dataclasses.replace(judgement, limit_error=3.21e-7, limit_error_bar=1.5e-8, order=2.0)
        if judgement.observable == "z"
        else dataclasses.replace(judgement, limit_error=np.inf, limit_error_bar=1.0)
        for judgement in first.judgements
        if judgement.observable != "F3"
    ]
    runs = [dataclasses.replace(first, judgements=limited), *outcome.runs[1:]]
    curves = point_curves(dataclasses.replace(outcome, runs=runs))[0].observables
    drawn = {item.name: next(engine for engine in item.engines if engine.row == 0) for item in curves}
    z = next(judgement for judgement in first.judgements if judgement.observable == "z")
    assert drawn["z"].tolerance == pytest.approx(z.tolerance, rel=1e-3)
    assert drawn["z"].limit == [3.21e-7, 1.5e-8, 2.0]
    assert drawn["gamma"].limit == [None, 1.0, None], "what is not finite is null"
    assert not {"tolerance", "limit"} & set(plain(drawn["F3"]))
    assert "limit" not in plain(curves[0].engines[1])


def test_no_two_rows_of_an_engine_look_alike_and_none_by_colour_alone() -> None:
    """Symbols differ within an engine; beyond a dozen they are hollow. Each has an outline for the legend."""
    row = SimpleNamespace(name="alpha", formulation="one", preset="matched", verdict="agrees")
    rows: list[Any] = [row] * 20 + [SimpleNamespace(**vars(row) | {"name": "beta"})]
    looks = [(style.colour, style.symbol) for style in styles(rows)]
    assert len(set(looks)) == 21
    assert {symbol.removesuffix("-open") for _, symbol in looks} == set(OUTLINES)


def test_an_engine_has_one_colour_on_a_page() -> None:
    """Whatever engine comes first in a comparison, colours follow the order of the page; no two are alike."""
    rows: Any = [
        SimpleNamespace(name=name, formulation="one", preset="", verdict="agrees") for name in ("beta", "new", "alpha")
    ]
    beta, new, alpha = (style.colour for style in styles(rows, ["alpha", "beta"]))
    assert (beta, new) == (alpha + 1, alpha + 2)
    assert {alpha, beta, new}.isdisjoint(engine_colours().values())


def test_cost_has_an_interval_where_there_is_one() -> None:
    """Six runs or more: 95 % or more; three: their range, which holds the median in three cases of four; one: none."""

    def told(*timings: float) -> str:
        cost = clean_cost(Result(Status.DONE, "done", timings=[*timings]))
        run: Any = SimpleNamespace(cost=cost, timings=timings)
        return f"{cost_interval(cost)}; {cost_title(run)}"

    assert told() == "–; not timed"
    assert told(2.0) == "–; one clean run, so no interval is known"
    assert told(3.0, 1.0, 2.0) == "1 to 3; median of 3 clean runs; 1 to 3 s/s holds it with 75 %"
    assert told(1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 9.0).endswith("1 to 9 s/s holds it with 98.4 %")


def test_costs_are_on_the_page(made: tuple[Outcome, Store], parse: Any) -> None:
    """Slowest and fastest case of each timed row with their intervals; a row that never ran has no line."""
    outcome, _ = made
    seconds = [[0.2, 0.25, 0.3], [0.4, 0.45, 0.5]]
    runs, seen = [], 0
    for run in outcome.runs:
        timings = seconds[seen] if run.row is outcome.runs[0].row else run.result.timings
        seen += run.row is outcome.runs[0].row
        runs.append(dataclasses.replace(run, result=dataclasses.replace(run.result, timings=timings)))
    content = report_content([dataclasses.replace(outcome, runs=runs)], "proofroll report invented")
    lines = costs(content.comparisons[0])
    assert len(lines) == 3
    assert [run.cost.value for run in lines[0][1:] if run.cost] == [0.45, 0.25]
    text = " ".join(parse(page(content, [point_curves(made[0])])).text.split())
    assert "0.4 to 0.5" in text
    assert "0.2 to 0.3" in text


def test_all_that_is_claimed_of_a_row_is_said() -> None:
    """Bounds of its own, orders, limits, and the points at which something else is expected."""
    row = Row(
        "alpha", "band",
        except_at=[ExceptAt({"speed": [2.0, 4.0]}, [Verdict.CONVERGES, Verdict.DIFFERS])],
        only={"tilt": [0.1]},
        order={"z": (1.9, 2.1)},
        limit={"gamma": Tolerance(1e-6, False, "rad")},
        bound={"N": Tolerance(1e-3, True)},
    )  # fmt: skip
    entry: Any = SimpleNamespace(
        name="alpha", formulation=None, setting="", resolution=None, engine="alpha", resolution_value=None, claim=row,
    )  # fmt: skip
    assert expectations([entry])[0].further == (
        "N within 0.1 % of its scale",
        "order of z 1.9 to 2.1",
        "limit of γ within 1e-6 rad",
        "converges or differs at speed=2 or 4",
        "run only at tilt=0.1",
    )


def test_legend_has_lines_symbols_and_verdicts_and_can_be_reached(html: str, parse: Any) -> None:
    """Every row is a button that says whether it is pressed; every figure can be focused and has a text."""
    elements = parse(html)
    buttons = [attributes for tag, attributes in elements.tags if tag == "button" and "data-row" in attributes]
    assert len(buttons) == 2 * 4
    assert all(button["aria-pressed"] == "true" for button in buttons)
    canvases = [attributes for _, attributes in elements.tags if attributes.get("class") == "canvas"]
    assert len(canvases) == 2 * 6
    assert all(canvas["tabindex"] == "0" and canvas["aria-label"] for canvas in canvases)
    outlines = {attributes["d"] for tag, attributes in elements.tags if tag == "path"}
    assert len(outlines & set(OUTLINES.values())) == 2
    legend = re.findall(r'<button type="button" aria-pressed="true" data-row="0">.*?</button>', html, re.DOTALL)
    assert all("fine, matched" in item or "fine matched" in item for item in legend)
    assert all('<b class="v agrees" title="agrees">✓</b></button>' in item for item in legend)
    assert len(legend) == 2


def test_whatever_the_limits_the_page_is_json(made: tuple[Outcome, Store], unpack: Any) -> None:
    """Curves with limits that are not finite do not break the script's data."""
    content = report_content([made[0]], "proofroll report invented")
    curves = point_curves(made[0])
    engines = curves[0].observables[0].engines
    engines[0] = dataclasses.replace(engines[0], limit=[None, None, None])
    assert json.loads(unpack(page(content, [curves]), "curves"))["points"]
