"""The screen of ``proofroll compare``: the answer first, one line for each row, and what only options show."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from proofroll.core.verdict import LimitResult, Verdict
from proofroll.report.comparison.records import ReportedComparison, ReportedRow
from proofroll.report.comparison.summary import outcome_content
from proofroll.report.terminal.printable import spelled_out
from proofroll.report.terminal.verdicts import WIDTH, measure, verdict_parts
from proofroll.running.case import Result, Status
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import LadderRun, Outcome


@pytest.fixture
def content(made: tuple[Outcome, Store]) -> ReportedComparison:
    """The invented comparison; its last row has no engine."""
    return outcome_content(made[0])


def lines(content: ReportedComparison, **options: bool) -> list[str]:
    """Lines of the screen."""
    return "\n".join(map(str, verdict_parts(content, **options))).splitlines()


def with_rows(content: ReportedComparison, *changes: dict[str, Any]) -> ReportedComparison:
    """The comparison with its first rows changed, and no others."""
    rows = [dataclasses.replace(row, **change) for row, change in zip(content.rows, changes, strict=False)]
    runs = [run for run in content.runs if run.row < len(rows)]
    return dataclasses.replace(content, rows=rows, runs=runs, contradictions=[])


def off(row: ReportedRow, verdict: Verdict, error: float, **changes: Any) -> dict[str, Any]:
    """Changes of a row: its quantity z has this verdict and error, a millimetre is allowed."""
    item = dataclasses.replace(row.observables["z"], verdict=verdict, error=error, tolerance=1e-3, **changes)
    verdicts = dict.fromkeys(row.verdicts, 0) | {verdict: 2}
    return {"verdict": verdict, "verdicts": verdicts, "observables": {"z": item}, "worst": "z"}


def test_the_answer_comes_first(content: ReportedComparison) -> None:
    """What is wrong, how many agree, and what was not expected stand in the first three lines."""
    found = lines(content)
    assert found[0].startswith("alpha fine, as installed, dt 1e-3 s, is wrong: z is off by ")
    assert found[1].endswith(" engine settings agree.")
    assert found[2].startswith("Not as the file expects (1 of 2): ")
    words = "matched: documented options; an answer's best: the cheaper of matched, tuned."
    assert found[3:5] == [f"as installed: the engine's own options; {words}", ""]
    assert found[5].split() == ["setting", "worst", "error", "of", "allowed", "real", "time"]


def test_rows_are_one_line_and_in_order(content: ReportedComparison) -> None:
    """A row is a line of 80 columns at most: what agrees comes first, then what differs and what did not run."""
    rows = [line for line in lines(content) if line[:2] in {"✓ ", "◐ ", "✗ ", "· "}]
    assert [line[0] for line in rows] == ["✓", "◐", "✗", "·"]
    assert {len(line) for line in rows} == {WIDTH}


def test_witnesses_are_counted_and_listed_on_request(content: ReportedComparison) -> None:
    """A solver that cross-checks the truth is no row and no advice; the closing count has it, --witnesses lists it."""
    witness = with_rows(content, {"witness": True}, {}, {})
    assert not any("alpha fine, matched" in line for line in lines(witness))
    assert any("1 witness agrees." in line for line in lines(witness))
    assert any(line.startswith("✓ alpha fine, matched") for line in lines(witness, witnesses=True))
    alone = with_rows(content, {"witness": True})
    assert any(line.startswith("✓ alpha fine, matched") for line in lines(alone))


def test_all_quantities_are_listed_on_request(content: ReportedComparison) -> None:
    """Without --orders a row names its worst quantity, with it all that is judged."""
    assert not any(line.startswith("    F3 ") for line in lines(content))
    assert sum(line.startswith("    F3 ") for line in lines(content, orders=True)) == 2


@pytest.mark.parametrize(
    ("error", "coarser", "sign"), [(1e-9, "held", "≥ "), (0.5, "failed", ""), (None, "not run", "≥ ")]
)
def test_a_speed_is_a_bound_until_a_coarser_step_fails(
    made: tuple[Outcome, Store], error: float | None, coarser: str, sign: str
) -> None:
    """Steps of the ladder that are coarser than the row's own hold all tolerances, or fail, or were not run."""
    runs = []
    for run in made[0].runs:
        rungs = (
            [LadderRun(4e-3, Result(Status.DONE, ""), {x.observable: error for x in run.judgements})] if error else []
        )
        runs.append(dataclasses.replace(run, rungs=rungs))
    found = outcome_content(dataclasses.replace(made[0], runs=runs))
    assert (found.rows[0].coarser, {run.coarser for run in found.runs_of(0)}) == (coarser, {coarser})
    assert any(line.startswith("✓ alpha fine, matched") and line.endswith(f" {sign}5×") for line in lines(found))


def test_the_nearest_is_named_where_none_agrees(content: ReportedComparison) -> None:
    """It is named with its excess and, by its order, the step to try."""
    row = content.rows[0]
    none = with_rows(content, off(row, Verdict.CONVERGES, 3e-3, order=1.0))
    assert lines(none)[0] == (
        "No setting agrees. Nearest: alpha fine, matched, dt 1e-3 s: z, 3 times what is allowed; "
        "the next step to try is dt 2.5e-4 s."
    )
    assert "    order 1, its limit is right" in lines(none)


def test_all_agree_in_one_sentence(content: ReportedComparison) -> None:
    """They are counted."""
    row = content.rows[0]
    both = with_rows(content, {}, off(row, Verdict.AGREES, 0.0))
    assert lines(both)[0] == "All 2 engine settings agree."


def test_steps_that_were_not_run_make_nothing_wrong(content: ReportedComparison) -> None:
    """A row whose other steps were left out is not judged: they could have shown that its limit is right."""
    row = content.rows[0]
    reason = f"error; no limit shown: dt 2e-3 {Status.LEFT_OUT}: it has not been run yet"
    cut = with_rows(content, off(row, Verdict.DIFFERS, 3e-3, limit=LimitResult.NOT_SHOWN, reason=reason))
    text = "\n".join(lines(cut))
    assert "wrong" not in text
    assert "its other steps were not run" in text
    assert "1 is not judged" in text


def test_lengths_have_prefixes() -> None:
    """Errors of lengths are read as lengths; others keep their unit."""
    assert [measure(value, "m") for value in (0.5, 3.5e-4, 9.2e-8, 4e-10, 1e-14)] == [
        "0.5 m", "0.35 mm", "92 nm", "0.4 nm", "1e-14 m",
    ]  # fmt: skip
    assert measure(3.5e-4, "N m") == "3.5e-4 N m"


def test_signs_are_spelled_out_where_they_cannot_be_written() -> None:
    """An encoding without our signs has words and letters for them."""
    text = "✓ ≥ 5× ↘ ő"
    error = UnicodeEncodeError("ascii", text, 0, len(text), "")
    assert spelled_out(error)[0].startswith("ok")
