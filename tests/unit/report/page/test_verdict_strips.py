"""Dots of a comparison's settings on an axis of their errors over what is allowed."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from proofroll.core.verdict import Verdict
from proofroll.report.comparison.records import WorstJudgement
from proofroll.report.page import verdict_strips

ALLOWED = verdict_strips.place(1.0)


def judged(name: str, error: float, verdict: Verdict = Verdict.AGREES, tolerance: float = 1e-3) -> WorstJudgement:
    """Judgement of a quantity."""
    return WorstJudgement(
        observable=name, unit="m", error=error, truth_error_bar=0.0, tolerance=tolerance, scale=1.0, verdict=verdict,
        point="", largest=error,
    )  # fmt: skip


def row(*items: WorstJudgement, verdict: Verdict = Verdict.AGREES, short: str = "") -> Any:
    """A setting with its judged quantities."""
    claim = SimpleNamespace(short=short, expect=[Verdict.DIFFERS])
    facts = {"name": "alpha", "verdict": verdict, "reason": "it is off", "diagnosis": [], "remarks": []}
    return SimpleNamespace(**facts, claim=claim, observables={item.observable: item for item in items})


def test_a_dot_stands_at_the_worst_quantity_over_what_is_allowed() -> None:
    """Its place is logarithmic; what is far beyond the ends stands there; of two at one place the second is above."""
    rows = [row(judged("x", 1e-3)), row(judged("x", 1e-3)), row(judged("x", 1e-9), judged("y", 1e-5)), row()]
    dots = verdict_strips.strip(SimpleNamespace(rows=rows))  # type: ignore[arg-type]
    assert [dot.x for dot in dots] == pytest.approx([ALLOWED, ALLOWED, 50.0], abs=0.01)
    assert dots[0].y == verdict_strips.HEIGHT / 2 != dots[1].y
    assert [verdict_strips.place(value) for value in (0.0, 1e-20, 1e9, math.inf)] == [0.0, 0.0, 100.0, 100.0]
    assert pytest.approx(100 * 8 / 12, abs=0.01) == ALLOWED


def test_what_nobody_is_judged_by_is_no_worst_quantity() -> None:
    """It stands last among the quantities of a row, and alone gives no dot; an error where none is allowed is worst."""
    ill = judged("x", 1.0, Verdict.ILL_POSED)
    order = judged("order", 1.0, Verdict.DIFFERS, tolerance=0.0)
    assert [item.observable for item in verdict_strips.ranked(row(ill, judged("y", 2e-3), order))] == [
        "order",
        "y",
        "x",
    ]
    assert verdict_strips.strip(SimpleNamespace(rows=[row(ill)])) == []  # type: ignore[arg-type]
    assert judged("order", 0.0, tolerance=0.0).of_allowed == 0.0


def test_a_reason_is_that_of_the_file_where_it_is_about_the_verdict() -> None:
    """The words for an expected verdict stand for it; for another one what was found does."""
    found = row(verdict=Verdict.FAILED, short="springs are soft")
    assert verdict_strips.reason(found) == "it is off"
    assert verdict_strips.reason(row(verdict=Verdict.DIFFERS, short="springs are soft")) == "springs are soft"
