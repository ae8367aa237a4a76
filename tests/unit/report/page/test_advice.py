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


def test_each_engine_is_told_beside_the_cheapest() -> None:
    """The choice with its step, another with how many times its cost, and those that never get there with why."""
    one = said([*ARM, BETA, WRONG, MUTE], 1e-3)[0]
    assert one == (
        "Trees to 1e-3: take alpha joints, default, dt 1e-3 s (100× real time); "
        "beta joints, default, dt 1e-3 s costs 50 times that; "
        "gamma joints does not get there (off by 0.02, its limit of small steps is another); "
        "delta joints does not get there (refused). "
        "If forces count, too, take alpha joints, tuned, dt 1e-3 s (5× real time)."
    )


def test_of_a_group_the_scene_that_costs_most_is_told_with_its_setting() -> None:
    """Where scenes need different settings, the cost is that of a named one; one that serves all is told."""
    exact = replace(FORCE, error=1e-9)
    fine = {"study": "chain", "scene": "chain", "setting": "tuned", "preset": "tuned", "step": 5e-4, "cost": 0.04}
    group = said([LINE, exact, replace(LINE, **fine), replace(exact, **fine), BETA], 1e-3)[0]
    assert group.startswith(
        "Trees to 1e-3: take alpha joints (25× real time; chain needs most: tuned at dt 5e-4 s); beta"
    )
    chain = replace(LINE, study="chain", scene="chain", cost=0.04)
    assert said([LINE, chain], 1e-3)[0].startswith(
        "Trees to 1e-3: take alpha joints, default, dt 1e-3 s (25× real time)."
    )


def test_the_choice_is_told_apart_from_its_sentence() -> None:
    """Name and cost are there for a program; where nothing holds it there are none."""
    found = advice(choice_matrix([LINE], STUDIES), 1e-3, False)[0]
    assert (found.of, found.choice, found.cost) == ("trees", "alpha joints default at dt 1e-3 s", 0.01)
    assert advice(choice_matrix([LINE], STUDIES), 1e-7, False)[0].choice is None


def test_where_nothing_holds_it_the_closest_is_named() -> None:
    """Nothing is advised; what comes closest says by how much it misses."""
    one = said([LINE, FORCE], 1e-5)[0]
    assert one.startswith("Trees to 1e-5: nothing that was run and timed holds it; alpha joints does not get there")
    assert "off by 5e-4, finer steps come closer" in one
    assert one.endswith("If forces count, too, nothing that was run and timed holds it.")


def test_forces_are_told_where_they_change_nothing_or_are_never_given() -> None:
    """The same choice, or none of whom forces are known."""
    exact = replace(FORCE, error=1e-9)
    assert said([LINE, exact], 1e-3)[0].endswith("It holds the forces, too.")
    assert said([LINE], 1e-3)[0].endswith("Forces are not judged there.")
    alone = "Trees: forces are not judged; for motion alone to 1e-3: take alpha joints, default, dt 1e-3 s"
    assert said([LINE], 1e-3, forces=True)[0] == f"{alone} (100× real time)."
    assert "with forces" in said([LINE, exact], 1e-3, forces=True)[0]


def test_of_a_group_only_scenes_with_judged_forces_are_told() -> None:
    """Where one scene of two has no forces that are judged, the other is named, and costs are not compared."""
    exact = replace(FORCE, error=1e-9)
    chain = replace(LINE, study="chain", scene="chain")
    group = said([LINE, exact, chain], 1e-3)[0]
    assert group.endswith(
        "In arm, where forces are judged, take alpha joints, default, dt 1e-3 s (100× real time) for both."
    )


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
    assert "beta joints was not judged" in said([*ARM, replace(beta, study="arm", scene="arm")], 1e-3)[0]
