"""Advice in words: what to take, what else there is, what forces change, and what serves all."""

from __future__ import annotations

from dataclasses import replace

from table_lines import ARM, FORCE, LINE, line

from proofroll.report.long_table import TableLine
from proofroll.report.page.advice import advice
from proofroll.report.page.choice_matrix import ChoiceStudy, choice_matrix

STUDIES = {name: ChoiceStudy(f"A {name}", f"c{number}") for number, name in enumerate(("arm", "chain"))}
BETA = line(engine="beta", row=3, error=1e-9, cost=0.5)
WRONG = line(engine="gamma", row=4, error=2e-2, cost=0.3, limit="another limit", verdict="differs")
MUTE = line(engine="delta", row=5, error=None, cost=None, status="refused", message="no loops", verdict="refused")


def said(lines: list[TableLine], tolerance: float, forces: bool = False) -> list[str]:
    """The sentences."""
    return [item.sentence for item in advice(choice_matrix(lines, STUDIES), tolerance, forces)]


def test_the_sentence_has_the_words_of_the_answer() -> None:
    """The choice with its step and speed, the next engine with how many times its cost, and the choice with forces."""
    assert said([*ARM, BETA, WRONG, MUTE], 1e-3)[0] == (
        "Trees to 1e-3: take alpha joints, default, dt 1e-3 s (≥ 100× real time); next: beta joints, 50× the cost, "
        "lead open; if forces count: alpha joints, ≥ 5×."
    )


def test_the_choice_is_told_apart_from_its_sentence() -> None:
    """Name and cost are there for a program; where nothing holds it there are none."""
    found = advice(choice_matrix([LINE], STUDIES), 1e-3, False)[0]
    assert (found.of, found.choice, found.cost) == ("trees", "alpha joints default at dt 1e-3 s", 0.01)
    assert advice(choice_matrix([LINE], STUDIES), 1e-7, False)[0].choice is None


def test_where_nothing_holds_it_the_closest_is_named() -> None:
    """Nothing is advised; what comes closest says by how much it misses."""
    assert said([LINE, FORCE], 1e-5)[0] == (
        "Trees to 1e-5: none; closest alpha joints: off by 5e-4, finer steps come closer."
    )


def test_forces_are_told_where_they_change_nothing_or_are_never_given() -> None:
    """The same choice, or none of whom forces are known."""
    exact = replace(FORCE, error=1e-9)
    assert said([LINE, exact], 1e-3)[0].endswith("if forces count: ✓ the same choice.")
    assert said([LINE], 1e-3)[0].endswith("if forces count: not judged.")
    alone = "Trees: forces are not judged; for motion alone to 1e-3: take alpha joints, default, dt 1e-3 s"
    assert said([LINE], 1e-3, forces=True)[0] == f"{alone} (≥ 100× real time); next: no other engine holds it."
    assert "Trees to 1e-3 with forces: take" in said([LINE, exact], 1e-3, forces=True)[0]


def test_over_all_few_formulations_cover_what_can_be_covered() -> None:
    """The one that holds most studies first, then what adds to it; studies without any are named."""
    chain = [replace(item, study="chain", scene="chain") for item in (LINE, BETA)]
    assert said([*ARM, *chain], 1e-3)[-1] == "Over all, 2 scenes, to 1e-3: alpha joints holds it in 2."
    assert said([*ARM, *chain], 1e-6)[-1] == (
        "Over all, 2 scenes, to 1e-6: alpha joints holds it in 1; beta joints brings it to 2."
    )
    coarse = replace(LINE, study="chain", scene="chain")
    assert said([*ARM, coarse], 1e-6)[-1].endswith("alpha joints holds it in 1; nothing holds it for chain.")


def test_a_study_without_judged_motion_is_no_part_of_all() -> None:
    """Where laws alone are judged nothing is said not to hold the tolerance, and the studies are counted without it."""
    laws = replace(LINE, role="residual", study="chain", scene="chain")
    assert said([*ARM, laws], 1e-3)[-1] == said(ARM, 1e-3)[-1]
    assert said([laws], 1e-3)[-1] == "Over all: motion is judged in no scene."


def test_what_was_left_out_is_not_told_to_fail() -> None:
    """An engine without time was not judged; a scene where none had any is told so and no part of all."""
    late = replace(LINE, study="chain", scene="chain", status="left out", verdict="not-judged", error=None, cost=None)
    beta = replace(late, engine="beta", row=3)
    reason = "no run could be judged, for lack of time or of a truth."
    _, arm, chain, whole = said([*ARM, late, beta], 1e-3)
    assert arm.startswith("arm (A arm) to 1e-3: take alpha")
    assert chain == f"chain (A chain) to 1e-3: {reason}"
    assert whole == said(ARM, 1e-3)[-1]
    assert said([late], 1e-3) == [
        f"Trees to 1e-3: {reason}", f"chain (A chain) to 1e-3: {reason}", f"Over all: {reason}",
    ]  # fmt: skip
