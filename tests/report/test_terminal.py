"""What is printed: tables within 100 columns, and what to look at first in at most three lines."""

from __future__ import annotations

import copy
import io
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from proofroll.report.terminal import WIDTH, console, first_lines, part_lines, verdict_table


def test_the_table_of_verdicts_is_plain_where_nobody_watches(written: tuple[dict[str, Any], Path]) -> None:
    """Into a pipe go no colour codes and no boxes, and no line is longer than 100 characters."""
    out = io.StringIO()
    Console(file=out, width=WIDTH).print(verdict_table(written[0]["comparisons"][0]))
    text = out.getvalue()
    assert "\x1b" not in text
    assert not set(text) & set("│─┏┃━┼")
    assert max(map(len, text.splitlines())) <= WIDTH
    for row in written[0]["comparisons"][0]["rows"]:
        assert row["verdict"] in text


def test_the_console_is_as_wide_in_a_pipe_as_at_most_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What stands in a log does not depend on the window it was made in, unless COLUMNS says so."""
    monkeypatch.delenv("COLUMNS", raising=False)
    assert console().width == WIDTH


def entry(**more: Any) -> dict[str, Any]:
    """A further study that was not made."""
    return {"name": "file", "title": "A study", "missing": "", "study": None, "contradictions": [], "claims": []} | more


@pytest.mark.parametrize("unexpected", [[], ["alpha at speed=4 differs, " + 40 * "expected " + "otherwise"]])
@pytest.mark.parametrize("missing", ["", "It has not been made yet; proofroll tradeoff x makes it."])
def test_what_to_look_at_first_is_three_lines_at_most(
    written: tuple[dict[str, Any], Path], unexpected: list[str], missing: str
) -> None:
    """The unexpected before all, then what is missing; each line fits, whatever it quotes."""
    content = copy.deepcopy(written[0])
    content["comparisons"][0]["contradictions"] = unexpected
    content["tradeoffs"] = [entry(missing=missing)]
    lines = first_lines(content)
    assert 1 <= len(lines) <= 3
    assert all(len(line) <= WIDTH and "\n" not in line for line in lines)
    assert lines[0].startswith(
        "Look first at what was not expected (1)" if unexpected else ("Missing" if missing else "L")
    )
    assert bool(missing) == any("It has not been made yet" in line for line in lines)


def test_each_further_study_has_its_line(written: tuple[dict[str, Any], Path]) -> None:
    """How many statements and claims hold, how many boundaries are silent; nothing of a study that is not there."""
    content = dict(written[0])
    held = [{"holds": True}, {"holds": False}, {"holds": None}]
    stated = [item | {"ours": item["holds"] is None} for item in held]
    content["figures"] = [entry(study={"statements": stated}, name="figs")]
    content["tradeoffs"] = [entry(study={"points": [1, 2, 3]}, claims=held, name="speed"), entry(name="absent")]
    claims = [{"holds": True}, {"holds": None}]
    content["stability"] = [entry(study={"silent": 4, "boundaries": 9}, claims=claims, name="map")]
    assert part_lines(content) == [
        "figs: 1 of 2 statements and 0 of 1 of this project's own hold.",
        "speed: 3 points; 1 of 2 claims hold, 1 undecided.",
        "map: 4 of 9 boundaries are silent; 1 of 1 claims hold, 1 undecided.",
    ]
