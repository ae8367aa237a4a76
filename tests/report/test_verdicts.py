"""What is shown of verdicts: rows with several answers, what ladders say, what is missing, and what is remarked."""

from __future__ import annotations

import dataclasses
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flat_judging import judged_curve
from folded import whole
from rich.console import Console

from proofroll.core.convergence import Limit, richardson
from proofroll.core.verdict import Verdict
from proofroll.report.comparison.conclusions import conclusions
from proofroll.report.comparison.plots import point_curves
from proofroll.report.comparison.records import ReportedComparison
from proofroll.report.comparison.summary import outcome_content
from proofroll.report.comparison.verdict_matrix import counted, rows_by_engine, title
from proofroll.report.labels import SYMBOLS, detail, verdict_text
from proofroll.report.page.first_sentences import three_sentences
from proofroll.report.page.html import page
from proofroll.report.page.records import report_content
from proofroll.report.terminal.verdicts import answer_lines, verdict_parts
from proofroll.running.case import Result, Status
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import Outcome, Run

TRUE = np.sin(np.linspace(0, 2, 21))
OTHER = Limit(TRUE + 0.05, 2e-4, 1.0)
SCATTERED = richardson([TRUE + off for off in (0.05, -0.04, 0.06)], (4, 2, 1), 1)
FALLING = richardson([TRUE + off for off in (0.1, 0.05, 0.028)], (4, 2, 1), 1)
SHOWN = (FALLING, SCATTERED, OTHER)
WRONG_WITHIN = Limit(TRUE + 4e-4, 1e-7, 2.0)


def answered(run: Run, error: float = 0.0, limit: Limit | None = None, **changes: Any) -> Run:
    """The run with one judgement, of z to a millimetre."""
    item = judged_curve("z", "m", TRUE + error, TRUE, truth_error_bar=1e-12, tolerance=1e-3, scale=1.0, limit=limit)
    done = Result(Status.DONE, "done", trajectory=run.result.trajectory)
    return dataclasses.replace(run, result=done, judgements=[item], contradictions=[], **{"missing": []} | changes)


def test_another_number_of_events_has_no_bar() -> None:
    """A run with an event too many has an error without end, and a limit that no bar is said of."""
    times, true = np.array([0.1, 0.2, 0.3]), np.array([0.1, 0.2])
    limit = Limit(times, 9e-13, 1.0)
    item = judged_curve("event_times", "s", times, true, truth_error_bar=0.0, tolerance=1e-3, scale=1.0, limit=limit)
    assert title(item, "").endswith("error ∞ ± 0 s, tolerance 1e-3; another limit")


def with_runs(outcome: Outcome, runs: Mapping[int, list[Run]]) -> Outcome:
    """The outcome with other runs of some rows, by their numbers."""
    rows = outcome.comparison.rows
    others = [run for run in outcome.runs if rows.index(run.row) not in runs]
    return dataclasses.replace(outcome, runs=[*(run for found in runs.values() for run in found), *others])


@pytest.fixture
def outcome(made: tuple[Outcome, Store]) -> Outcome:
    """Four rows: another limit; no limit; within tolerance with a wrong limit; incomplete on shared equations."""
    runs: dict[int, list[Run]] = {number: [] for number in range(4)}
    for run in made[0].runs:
        number = made[0].comparison.rows.index(run.row)
        runs[number].append(
            [
                answered(run, 0.05, OTHER),
                answered(run, 0.05, SCATTERED),
                answered(run, 5e-4, WRONG_WITHIN),
                answered(run, missing=["F2", "N"], shared="rests on the same equations as the truth itself (alike)"),
            ][number]
        )
    return with_runs(made[0], runs)


def printed(content: ReportedComparison, width: int = 80, *, orders: bool = False) -> str:
    """A comparison as it stands on a terminal of this width."""
    out = io.StringIO()
    console = Console(file=out, width=width, highlight=False)
    for part in verdict_parts(content, orders=orders):
        console.print(part, markup=False)
    return out.getvalue()


def told(content: ReportedComparison, *, orders: bool = False) -> str:
    """The same in one line."""
    return " ".join(printed(content, orders=orders).split())


def test_one_refused_case_of_eleven_shows_the_ten(made: tuple[Outcome, Store]) -> None:
    """A row that was refused at one point says how the other ten ended, on the terminal and in the matrix."""
    run = made[0].runs[0]
    points = [{"speed": 3.0 + number} for number in range(11)]
    runs = [dataclasses.replace(answered(run), parameters=point) for point in points]
    runs[3] = dataclasses.replace(runs[3], result=Result(Status.REFUSED, "one coefficient only"), judgements=[])
    content = outcome_content(with_runs(made[0], {0: runs}))
    row = content.rows[0]
    assert row.verdict == "refused"
    assert verdict_text(row) == "refused 1/11 ✓10"
    assert row.reason == "at speed=6: one coefficient only"
    assert "at speed=6: one coefficient only" in told(content)
    of_row, runs_of_row = next(iter(rows_by_engine(content).values()))[0]
    assert (verdict_text(of_row, runs_of_row), of_row.observables["z"].verdict) == ("refused 1/11 ✓10", "agrees")
    ((at_point, run_there),) = next(iter(rows_by_engine(content, "speed=6").values()))[:1]
    assert (verdict_text(at_point, run_there), len(run_there)) == ("refused", 1)


def test_the_price_of_compiling_is_told(made: tuple[Outcome, Store]) -> None:
    """Where an engine takes long before its first step its row says so, and the page has a column; else neither."""
    run = made[0].runs[0]
    runs = {
        seconds: [dataclasses.replace(answered(run), result=dataclasses.replace(run.result, build_seconds=seconds))]
        for seconds in (0.02, 23.5)
    }
    contents = [outcome_content(with_runs(made[0], {0: one})) for one in runs.values()]
    quick, slow = (printed(content) for content in contents)
    assert "    24 s before its first step" in slow.splitlines()
    assert "first step" not in quick


def test_a_refusal_hides_no_difference_and_no_failure(made: tuple[Outcome, Store]) -> None:
    """Of a row the worse is said: what differs or failed at another point; the refusal is counted beside it."""
    run = made[0].runs[0]
    refused = dataclasses.replace(run, result=Result(Status.REFUSED, "no"), judgements=[], contradictions=[])
    off = answered(run, 0.05, OTHER)
    lost = dataclasses.replace(refused, result=Result(Status.CRASHED, "gone"))
    for runs, said in (([refused, off], "differs 1/2 ⊘1"), ([refused, lost], "failed 1/2 ⊘1")):
        assert verdict_text(outcome_content(with_runs(made[0], {0: runs})).rows[0]) == said


def test_a_refusal_is_told_as_one(made: tuple[Outcome, Store]) -> None:
    """The answer says that a setting refuses, with no word of failing; nor is it said not to have finished."""
    run = next(run for run in made[0].runs if run.row.engine == "alpha[formulation=fine,preset=default]")
    number = made[0].comparison.rows.index(run.row)
    result = Result(Status.REFUSED, "no wall, no ball")
    refused = dataclasses.replace(run, result=result, judgements=[], contradictions=[], missing=[])
    content = outcome_content(with_runs(made[0], {number: [refused]}))
    found = conclusions(content, [], None)
    assert "1 refuses the scene, or some case of it, with the reason" in found.answer
    assert "did not even finish" not in " ".join(found.sentences)
    assert "⊘ 1 refused" in counted(content)
    assert "1 refuses the scene, or some case of it" in three_sentences([content], {}, [])[0]
    text = whole(page(report_content([with_runs(made[0], {number: [refused]})], ""), [[]]))
    assert '<p class="status refused"><b>refused</b>: no wall, no ball</p>' in text


def test_another_limit_and_no_limit_are_two_answers_on_the_terminal(outcome: Outcome) -> None:
    """Below each row that does not agree it says which of the two it is; --orders adds order, limit error and bar."""
    content = outcome_content(outcome)
    text = told(content)
    assert "✗ alpha fine, matched, dt 1e-3 s z 0.05 of 1e-3 m" in text
    assert "order 1, smaller steps stay 0.05 m off" in text
    assert "smaller steps do not settle" in text
    assert "limit off by" not in text
    assert "order 1, limit off by 0.05 ± 2e-4 m" in told(content, orders=True)


def test_errors_that_still_fall_are_not_said_to_stay(made: tuple[Outcome, Store]) -> None:
    """Where the limit of small steps may be the truth, the step alone is called wrong; of an order more are asked."""
    run = made[0].runs[0]
    number = made[0].comparison.rows.index(run.row)
    contents = [outcome_content(with_runs(made[0], {number: [answered(run, 0.1, at)]})) for at in SHOWN]
    answers = [" ".join(answer_lines(content, [content.rows[number]])) for content in contents]
    assert [" is wrong at this step: z is off by 0.1 m." in answer for answer in answers] == [True, True, False]
    assert ["its limit needs smaller steps" in told(content) for content in contents] == [True, False, False]
    assert "do not settle" not in told(contents[0])


@pytest.mark.parametrize("width", [80, 100])
def test_nothing_is_cut_on_a_narrow_terminal(outcome: Outcome, width: int) -> None:
    """No line is too long, no word ends in an ellipsis, and each row is one line with its sign."""
    content = outcome_content(outcome)
    text = printed(content, width)
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    assert sorted(line[0] for line in text.splitlines() if " of 1e-3 m" in line) == sorted("✓✗✗◐")


def test_a_long_name_has_a_line_of_its_own(outcome: Outcome) -> None:
    """Numbers of a row whose name leaves no room for them stand below it, in their columns."""
    content = outcome_content(outcome)
    long = "options of the file: integrator, cone, solver"
    rows = [dataclasses.replace(row, setting=long) for row in content.rows]
    lines = printed(dataclasses.replace(content, rows=rows), 80).splitlines()
    begin = next(k for k, line in enumerate(lines) if long in line)
    assert " of 1e-3 m" not in lines[begin]
    assert re.match(r" {20,}z .* of 1e-3 m", lines[begin + 1])


def test_a_wrong_limit_within_tolerance_is_marked(outcome: Outcome) -> None:
    """The row agrees, and below it stands the limit's error; JSON, terminal and page have it."""
    content = outcome_content(outcome)
    row = content.rows[2]
    assert row.verdict == "agrees"
    assert "z agrees at this step only, its limit is 0.4 mm off" in told(content)
    assert "agrees*" in [verdict_text(*line) for lines in rows_by_engine(content).values() for line in lines]
    (remark,) = row.remarks
    assert "shown not to be the truth: off by 4e-4 ± 1e-7 m, order 2" in remark
    assert remark in told(content, orders=True)
    assert content.runs_of(2)[0].judgements[0].remarks


def test_what_could_not_be_judged_is_not_said_to_be_as_expected(made: tuple[Outcome, Store]) -> None:
    """Where a row expects to agree and there is no truth, nothing is contradicted, and nothing is confirmed either."""
    rows = made[0].comparison.rows
    runs = {rows.index(run.row): [answered(run)] for run in made[0].runs}
    content = outcome_content(with_runs(made[0], runs))
    assert "As the file expects." in told(content)
    assert "All of this was expected." in conclusions(content, [], None).answer
    assert counted(content).endswith("; as expected")
    nothing = Result(Status.NO_TRUTH, "there is no truth here")
    runs[0] = [dataclasses.replace(run, result=nothing, judgements=[]) for run in runs[0]]
    content = outcome_content(with_runs(made[0], runs))
    assert "Nothing contradicts the file; 1 of its runs could not be judged." in told(content)
    assert "Nothing of it was unexpected." in conclusions(content, [], None).answer
    assert counted(content).endswith("; nothing is contradicted")
    away = Result(Status.MISSING, "beta is not installed here")
    runs[0] = [dataclasses.replace(run, result=away) for run in runs[0]]
    assert "1 of its runs could not" in told(outcome_content(with_runs(made[0], runs)))


def test_where_nothing_is_claimed_nothing_is_said_to_be_expected(made: tuple[Outcome, Store]) -> None:
    """A scene without a file of claims expects nothing: neither its findings nor its heading say that it did."""
    comparison = made[0].comparison
    rows = [dataclasses.replace(row, expect=list(Verdict)) for row in comparison.rows]
    own = [rows[comparison.rows.index(run.row)] for run in made[0].runs]
    runs = [dataclasses.replace(run, row=row, contradictions=[]) for run, row in zip(made[0].runs, own, strict=True)]
    open_to_all = dataclasses.replace(comparison, rows=rows)
    content = outcome_content(dataclasses.replace(made[0], comparison=open_to_all, runs=runs))
    found = conclusions(content, [], None)
    assert "expected" not in found.answer
    assert found.sentences[-1] == "No file states expectations here, so nothing can contradict them."
    assert not re.search("expected|contradicted", counted(content))


def test_who_is_silent_or_shares_equations_is_marked(outcome: Outcome) -> None:
    """A run without forces is incomplete by name; one on the truth's own equations is never the closest to it."""
    content = outcome_content(outcome)
    row = content.rows[3]
    assert (row.verdict, row.missing) == ("incomplete", ["F2", "N"])
    assert row.reason == "agrees, but does not report F2, N"
    assert detail(row) == "does not report F2, N"
    assert row.remarks == ["rests on the same equations as the truth itself (alike)"]
    assert "z 0 of 1e-3 m – does not report F2, N" in told(content)
    assert counted(content) == "4 settings: ✓ 1 agrees, ◐ 1 incomplete, ✗ 2 differs; as expected"
    said = three_sentences([content], {}, [])[0]
    assert said.startswith("Of 4 settings in one comparison, 1 agrees with the truth in every observable")


def test_the_page_says_all_of_it(outcome: Outcome, parse: Any) -> None:
    """Matrix, evidence and remarks name the kind of difference, its numbers, what is missing and what is shared."""
    content = report_content([outcome], "proofroll report invented")
    text = " ".join(parse(page(content, [point_curves(outcome)])).text.split())
    for words in (
        "✗ differs another limit",
        "✗ differs no limit shown",
        "another limit: off by 0.05 ± 2e-4 m, order 1",
        "no limit shown: off by 0.06 ± 0.1 m, no order",
        "within tolerance, but the limit of small steps is shown not to be the truth",
        "◐ incomplete does not report F2, N",
        "rests on the same equations as the truth itself (alike)",
    ):
        assert words in text, words


@pytest.mark.parametrize(("other", "alike"), [(1.0005, True), (1.01, False)])
def test_rows_of_one_scheme_are_no_witnesses_for_one_another(
    made: tuple[Outcome, Store], parse: Any, other: float, alike: bool
) -> None:
    """Two engines with one step and the same errors in all that is judged are named; with others they are not."""
    rows, runs = made[0].comparison.rows, dict[int, list[Run]]()
    for run in made[0].runs:
        number = rows.index(run.row)
        found = answered(run, 3e-4 * (other if number == 2 else 1.0 + 0.5 * number))
        second = dataclasses.replace(found.judgements[0], observable="gamma", unit="rad")
        runs.setdefault(number, []).append(dataclasses.replace(found, judgements=[*found.judgements, second]))
    outcome = with_runs(made[0], runs)
    content = report_content([outcome], "proofroll report invented")
    said = (
        "Same integration scheme (agreement is not independent evidence): "
        "alpha fine matched, beta: equal errors to three digits."
    )
    page_text = " ".join(parse(page(content, [point_curves(outcome)])).text.split())
    assert (said in page_text) is alike
    assert (said in told(outcome_content(outcome))) is alike


@pytest.mark.parametrize(("third", "shared"), [("semi-implicit Euler", True), ("RK4", False)])
def test_rows_of_one_declared_scheme_are_named_whatever_their_errors(
    made: tuple[Outcome, Store], third: str, shared: bool
) -> None:
    """Settings of two engines that declare one scheme of fixed steps are no witnesses for one another, others are."""
    content = outcome_content(made[0])
    declared = ["", "semi-implicit Euler", third, ""]
    rows = [dataclasses.replace(row, scheme=said) for row, said in zip(content.rows, declared, strict=True)]
    said = (
        "Same integration scheme (agreement is not independent evidence): "
        "alpha fine as installed, beta: semi-implicit Euler."
    )
    assert (said in told(dataclasses.replace(content, rows=rows))) is shared


def test_every_verdict_is_documented() -> None:
    """The page about verdicts has a line for each word with its sign; that about JSON names all."""
    docs = Path(__file__).parents[2] / "docs"
    page, json = ((docs / f"{name}.md").read_text(encoding="utf-8") for name in ("read_a_verdict", "json"))
    for verdict in Verdict:
        assert f"| {SYMBOLS[verdict]} *{verdict}* |" in page
        assert f"`{verdict}`" in json
