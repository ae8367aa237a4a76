"""What is printed: tables within 100 columns, and what to look at first in at most three lines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from folded import whole

from proofroll.core.verdict import Verdict
from proofroll.report.page.records import ReportContent
from proofroll.report.parts import PartEntry
from proofroll.report.terminal.screen import WIDEST, console
from proofroll.report.terminal.tables import first_lines, part_lines
from proofroll.report.terminal.verdicts import verdict_parts


@pytest.mark.drill
def test_a_comparison_without_its_truth_is_one_sentence(everything: Any, tmp_path: Path) -> None:
    """What the time did not suffice for at all is told once, on the terminal and in each section of the page."""
    found = everything.content.comparisons[0]
    unjudged = Verdict.NOT_JUDGED
    rows = [replace(row, verdict=unjudged, verdicts={unjudged: 2}) for row in found.rows]
    lacking = replace(found, name="lacking", title="Lacking", rows=rows, beyond_budget=["the truth", "alpha, dt 0.1"])
    said = "Not judged: the processor time did not suffice for the truth: 4 settings."
    assert list(verdict_parts(lacking)) == ["Lacking", said]
    content = replace(everything.content, comparisons=[found, lacking])
    both = replace(everything, content=content, curves=2 * everything.curves)
    text = whole(both.write(tmp_path / "report.html").read_text(encoding="utf-8"))
    assert said in text
    assert "Verdicts: Lacking" not in text
    assert content.beyond_budget.endswith("2. The same command goes on with them.")
    assert replace(content, comparisons=[lacking]).beyond_budget.endswith("2. Too little for any truth: give more.")
    assert len(list(verdict_parts(replace(lacking, beyond_budget=["alpha, dt 0.1"])))) > 3, "the truth is there"


def test_the_console_is_as_wide_in_a_pipe_as_at_most_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What stands in a log does not depend on the window it was made in, unless COLUMNS says so."""
    monkeypatch.delenv("COLUMNS", raising=False)
    assert console().width == WIDEST


def entry(**more: Any) -> PartEntry:
    """A further study that was not made."""
    return PartEntry(**{"name": "file", "title": "A study", "question": "", "scene": "", "command": ""} | more)


def claimed(**more: Any) -> Any:
    """A further study that was made, with claims."""
    return SimpleNamespace(**more)


@pytest.mark.parametrize("unexpected", [[], ["alpha at speed=4 differs, " + 40 * "expected\n" + "otherwise"]])
@pytest.mark.parametrize("missing", ["", "It has not been made yet; proofroll stability x makes it."])
def test_what_to_look_at_first_is_three_sentences_at_most(
    content: ReportContent, unexpected: list[str], missing: str
) -> None:
    """The unexpected before all, then what is missing; whatever is quoted arrives whole, without breaks of its own."""
    comparison = replace(content.comparisons[0], contradictions=unexpected)
    lines = first_lines(replace(content, comparisons=[comparison], entries={"stability": [entry(missing=missing)]}))
    assert 1 <= len(lines) <= 3
    assert not any("\n" in line for line in lines)
    assert not unexpected or lines[0].endswith("otherwise")
    assert lines[0].startswith(
        "Look first at the unexpected result (1)" if unexpected else ("Missing" if missing else "1 setting differs")
    )
    assert bool(missing) == any("It has not been made yet" in line for line in lines)


def test_each_further_study_has_its_line(content: ReportContent) -> None:
    """How many statements and claims hold, how many boundaries are silent; nothing of a study that is not there."""
    held = [claimed(holds=holds) for holds in (True, False, None)]
    stated = [{"holds": item.holds, "ours": item.holds is None} for item in held]
    entries: dict[str, Any] = {
        "figures": [entry(study={"statements": stated}, name="figs")],
        "regimes": [],
        "stability": [claimed(study=claimed(silent=4, boundaries=9), claims=held, name="map"), entry(name="absent")],
    }
    assert part_lines(replace(content, entries=entries)) == [
        "figs: 1 of 2 statements and 0 of 1 of this project's own hold.",
        "map: 4 of 9 boundaries are silent; 1 of 2 claims hold, 1 undecided.",
    ]
