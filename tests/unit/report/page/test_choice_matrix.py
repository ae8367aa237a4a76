"""The matrix of engines and groups of scenes: what each cell says at each tolerance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from table_lines import ARM, FINER, FORCE, LINE, line

from proofroll.core.verdict import Verdict
from proofroll.report.long_table import TableLine
from proofroll.report.page.advice import advice
from proofroll.report.page.answer import answer
from proofroll.report.page.choice_cell import CANNOT, NO_RUN, PARTLY, ChoiceCell, speed
from proofroll.report.page.choice_matrix import ChoiceMatrix, ChoiceStudy, choice_matrix

STUDIES = {
    "arm": ChoiceStudy("An arm", "c0", {(0, ""): "c0.joints", (0, "mass=2"): "c0.joints.mass-2"}),
    "chain": ChoiceStudy("A chain", "c1"),
    "ball": ChoiceStudy("A ball", "c2"),
}


def at(
    lines: list[TableLine], decade: int, forces: bool = False, group: str = "trees", setting: str = ""
) -> ChoiceCell:
    """The cell of alpha's joints in a group."""
    found = choice_matrix(lines, STUDIES)
    row = next(item for item in found.rows if (item.engine, item.setting) == ("alpha", setting))
    column = next(item for item in found.columns if item.whole and item.group == group)
    return found.cell(row, column, 10.0**-decade, forces)


def test_a_cell_has_the_cheapest_run_that_holds_the_tolerance() -> None:
    """The step of the comparison, then a finer one of its ladder, then another setting, each with its cost."""
    assert at(ARM, 3)[:2] == (Verdict.AGREES, "≥ 100×")
    assert at(ARM, 4)[:2] == (Verdict.AGREES, "≈ 25×"), "its coarser step fails"
    assert at(ARM, 6)[:2] == (Verdict.AGREES, "≥ 5×"), "its only step"
    assert "alpha joints tuned at dt 1e-3 s: within 2e-7" in at(ARM, 6).title
    assert at(ARM, 3).href == "c0.joints"
    assert at(ARM, 6, setting="default").state == Verdict.CONVERGES, "what unfolds is that setting alone"


def lucky(*errors: float, **changes: Any) -> list[TableLine]:
    """Lines of a ladder with these errors at 1e-3 s and ever half of it; only the first has a verdict and a limit."""
    rungs = [line(error=error, step=1e-3 / 2**place, cost=0.1 * 2**place) for place, error in enumerate(errors)]
    return [replace(rungs[0], **changes), *(replace(rung, verdict="", limit="", order=None) for rung in rungs[1:])]


@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_small_error_at_one_step_is_luck_where_finer_steps_are_worse(precision: str) -> None:
    """An error counts as the largest of its own and of its next two finer steps, so that no luck is recommended."""
    another = {"verdict": "differs", "limit": "another limit", "limit_error": 5e-2, "limit_doubt": 1e-3}
    lines = lucky(1e-6, 2.5e-2, 3.75e-2, **another, precision=precision)
    cell = at(lines, 4)
    assert (cell.state, cell.cost) == (Verdict.DIFFERS, float("inf"))
    assert "its error of 1e-6 is luck" in cell.title, "what is seen at that step is said, too"
    assert answer(choice_matrix(lines, STUDIES), 1e-4, False).kinds[0].taken is None
    assert at(lucky(1e-6, 1e-3, 1e-7, limit="no limit shown"), 4)[:2] == (Verdict.AGREES, "2.5×"), "the finest holds"
    other = replace(lines[1], place="mass=2", error=1e-6)
    assert at([*lucky(1e-6, 1e-6), other, replace(other, step=1e-3)], 4).state == Verdict.AGREES, (
        "each place for itself"
    )


def test_a_limit_beyond_the_tolerance_is_no_agreement() -> None:
    """A limit of small steps that misses the tolerance by more than its doubts outweighs the errors of its steps."""
    beyond = lucky(1e-6, 1e-6, 1e-6, verdict="differs", limit="another limit", limit_error=1e-3, limit_doubt=1e-5)
    assert at(beyond, 4).state == Verdict.DIFFERS
    assert "its limit of small steps is another" in at(beyond, 4).title
    assert at(beyond, 3).state == Verdict.AGREES
    assert at(lucky(5e-2, 2e-2, **{"limit_error": 1e-3, "limit_doubt": 1e-5}), 4).state == Verdict.DIFFERS
    near = lucky(5e-2, 2e-2, verdict="differs", limit="another limit", limit_error=1e-4, limit_doubt=1e-5)
    assert at(near, 2).state == Verdict.CONVERGES, "within the tolerance that a reader asks for finer steps come"
    vague = lucky(1e-6, 1e-6, limit_error=1e-3, limit_doubt=1e-3)
    assert at(vague, 4).state == Verdict.AGREES, "a limit that is not known so well accuses nobody"


def test_a_floor_of_single_precision_is_no_luck() -> None:
    """Below the best step of single precision errors grow by round-off; they do not count against larger steps."""
    lines = lucky(
        4e-5, 3e-5, 4e-4, limit="no limit shown", precision="single", floor="best step 5e-4 s: single precision"
    )
    assert at(lines, 4)[:2] == (Verdict.AGREES, "≥ 10×")
    assert at([replace(item, floor="") for item in lines], 4).state != Verdict.AGREES


def test_forces_count_where_they_are_asked_for() -> None:
    """With forces the same tolerance takes a finer run; an engine that reports none says so."""
    assert at(ARM, 2)[:2] == (Verdict.AGREES, "≥ 100×")
    assert at(ARM, 2, forces=True)[:2] == (Verdict.AGREES, "≈ 25×"), "its coarser step fails"
    told = replace(FORCE, engine="beta", row=7)
    assert at([LINE, told], 2, forces=True)[:2] == (Verdict.INCOMPLETE, "no forces")


def test_what_no_run_holds_shows_the_least_error_and_why() -> None:
    """Finer steps come closer, or the limit of small steps is another; the truth's own bar counts as error."""
    assert at(ARM, 8)[:2] == (Verdict.CONVERGES, "2e-7")
    wrong = [line(verdict="differs", limit="another limit", tolerance=1e-4)]
    assert at(wrong, 4)[:2] == (Verdict.DIFFERS, "5e-4")
    assert "its limit of small steps is another" in at(wrong, 4).title
    assert at([line(error=0.0, truth_error_bar=1e-5)], 6).state == Verdict.CONVERGES
    once = at([line(limit="no ladder")], 4)
    assert (once.state, "smaller steps were not run" in once.title) == (Verdict.DIFFERS, True)


def test_a_scene_without_judged_forces_takes_no_part_where_forces_count() -> None:
    """Alone it says so, and the answer does not call it unheld; in a group the other scenes decide."""
    assert at([LINE], 2, forces=True)[:2] == (Verdict.NOT_JUDGED, "no forces")
    assert not answer(choice_matrix([LINE], STUDIES), 1e-2, True).kinds[0].judged
    chain = replace(LINE, study="chain", scene="chain")
    assert at([*ARM, chain], 4, forces=True)[:2] == at(ARM, 4, forces=True)[:2]


def test_a_scene_without_judged_motion_takes_no_part() -> None:
    """Where laws alone are judged no cell is a verdict on an engine, and the group is decided by its other scenes."""
    laws = replace(LINE, role="residual", study="chain", scene="chain")
    assert at([laws], 2)[:2] == (Verdict.NOT_JUDGED, "no motion")
    assert at([*ARM, laws], 2)[:2] == at(ARM, 2)[:2]
    assert "Not judged for trees" in answer(choice_matrix([laws], STUDIES), 1e-2, False).sentence


def test_the_limit_of_forces_says_nothing_of_motion() -> None:
    """Where forces tend to another limit and the motion does not, that counts only where forces are asked for."""
    lines = [LINE, replace(FORCE, limit="another limit", verdict="differs")]
    assert at(lines, 4).state == Verdict.CONVERGES
    assert at(lines, 4, forces=True).state == Verdict.DIFFERS


@pytest.mark.parametrize(
    ("changes", "state"),
    [
        ({"status": "refused", "verdict": "refused", "message": "needs loops"}, Verdict.REFUSED),
        ({"status": "crashed", "verdict": "failed", "message": "it ended"}, Verdict.FAILED),
        ({"status": "missing", "verdict": "failed", "message": "not installed"}, Verdict.FAILED),
        ({"verdict": "ill-posed"}, Verdict.NOT_JUDGED),
    ],
)
def test_what_gave_no_result_says_so(changes: dict[str, Any], state: Verdict) -> None:
    """Refused, failed, and what nobody is judged by, each with its word; an engine that is not installed is missing."""
    missing = {} if "status" not in changes else {"quantity": "", "role": "", "error": None, "scale": None}
    found = at([line(**changes, **missing)], 4)
    assert (found.state, found.text) == (state, "missing" if changes.get("status") == "missing" else str(state))
    assert changes.get("message", "") in found.title


def test_a_run_holds_only_at_all_places() -> None:
    """One place beyond the tolerance, or without a result, is enough; what is ill-posed is left out."""
    heavy = line(place="mass=2", error=5e-2, cost=0.03)
    assert at([LINE, heavy], 3)[:2] == (Verdict.CONVERGES, "0.05")
    assert at([LINE, heavy], 3).href == "c0.joints.mass-2"
    assert at([LINE, replace(heavy, verdict="ill-posed")], 3).state == Verdict.AGREES
    assert at([LINE, replace(heavy, error=1e-4)], 3)[:2] == (Verdict.AGREES, "≥ 33×"), "the slowest place"
    assert at([LINE, FORCE, *FINER, heavy], 4).state != Verdict.AGREES, "the finer step was not run there"


def test_an_error_that_is_too_large_looks_so() -> None:
    """An error just beyond the tolerance has as many digits as tell it apart from that."""
    cell = at([line(error=1.004e-4)], 4)
    assert (cell.state, cell.text) == (Verdict.CONVERGES, "1.004e-4")
    assert "off by 1.004e-4" in cell.title


def test_a_group_holds_where_all_its_scenes_do() -> None:
    """All: from the slowest scene to the fastest; some: how many; each scene has a column of its own."""
    chain = [replace(item, study="chain", scene="chain", cost=0.5) for item in ARM]
    assert at([*ARM, *chain], 3)[:2] == (Verdict.AGREES, "≥ 2–100×")
    coarse = [line(study="chain", scene="chain", error=4e-2)]
    assert at([*ARM, *coarse], 3)[:2] == (Verdict.CONVERGES, "1 of 2")
    columns = choice_matrix([*ARM, *coarse, line(study="ball", scene="ball", group="ball rolling")], STUDIES).columns
    assert [(item.title, item.whole) for item in columns] == [
        ("Trees", True), ("arm", False), ("chain", False), ("Rolling balls", True), ("ball", False),
    ]  # fmt: skip


@pytest.fixture
def whole() -> ChoiceMatrix:
    """Three studies of two groups, two engines."""
    chain = [replace(item, study="chain", scene="chain") for item in ARM]
    beta = line(engine="beta", row=3, error=1e-9, cost=0.5)
    return choice_matrix([*ARM, *chain, beta, line(study="ball", group="ball rolling")], STUDIES)


def test_a_scene_that_was_left_out_says_nothing_against_those_that_ran() -> None:
    """A run for which the time did not suffice leaves its group to the scenes that ran; alone it is not judged."""
    gone = line(study="chain", scene="chain", status="left out", message="no time", verdict="not-judged", error=None)
    assert at([*ARM, gone], 4)[:2] == at(ARM, 4)[:2]
    other = replace(gone, engine="beta", status="done", verdict="agrees", error=1e-6, cost=1.0)
    assert at([*ARM, gone, other], 4)[:2] == at(ARM, 4)[:2], "also where another engine ran it"
    taken = answer(choice_matrix([*ARM, gone, other], STUDIES), 1e-4, False).kinds[0].taken
    assert taken is not None
    assert taken.name == "alpha joints default at dt 2.5e-4 s"
    assert at([gone], 4).state == Verdict.NOT_JUDGED


def test_a_cell_without_a_cost_says_so() -> None:
    """What holds the tolerance and was not timed is told in words beside its sign, which stands once."""
    found = at([line(error=1e-9, cost=None)], 4)
    assert (found.state, found.text) == (Verdict.AGREES, "not timed")


@pytest.mark.parametrize(
    ("cost", "clean", "text"),
    [
        (0.011, True, "91×"), (0.011, False, "≈ 90×"), (0.053, False, "≈ 19×"), (0.024, False, "≈ 40×"),
        (0.82, False, "≈ 1.2×"), (3.4e-4, True, "2900×"), (4.0, True, "0.25×"), (0.0, True, "not timed"),
    ],
)  # fmt: skip
def test_a_cost_is_told_as_a_speed(cost: float, clean: bool, text: str) -> None:
    """Times real time: two digits of clean runs, coarse steps of rough ones."""
    assert speed(cost, clean) == text


def test_a_scene_counts_once_however_many_studies_use_it() -> None:
    """Two studies of one scene are one scene; another scene is a second."""
    again = [replace(item, study="chain") for item in ARM]
    other = [replace(item, study="ball", scene="ball") for item in ARM]
    found = choice_matrix([*ARM, *again, *other], STUDIES)
    assert [(item.name, item.whole, len(item.scenes)) for item in found.columns] == [
        ("trees", True, 2), ("arm", False, 1), ("ball", False, 1),
    ]  # fmt: skip


def test_the_cheapest_run_of_all_studies_counts_at_the_same_case() -> None:
    """Of one case the best of both studies; of two cases both have to be held, and the scene's own has the speed."""
    better = line(study="chain", setting="fast", error=1e-9, cost=0.001)
    assert at([*ARM, better], 3)[:2] == (Verdict.AGREES, "≥ 1000×")
    worse = line(study="chain", error=4e-2)
    assert at([*ARM, worse], 3).state == Verdict.AGREES
    longer = {"study": "chain", "case": "speed=2", "own_case": False}
    assert at([*ARM, replace(better, **longer, cost=1.0)], 3)[:2] == (Verdict.AGREES, "≥ 100×"), "the scene's own"
    assert at([*ARM, replace(worse, **longer)], 3)[:2] == (PARTLY, "1 of 2 cases")
    assert "speed=2: alpha joints" in at([*ARM, replace(worse, **longer)], 3).title, "what all cases share is left out"
    once = [*ARM, replace(better, **longer, engine="beta")]
    cell = at(once, 3)
    assert (cell.state, cell.why) == (PARTLY, "was not run in the others; holds 1 of 2 cases")
    assert answer(choice_matrix(once, STUDIES), 1e-3, False).kinds[0].taken is None


def test_what_cannot_be_represented_is_told_from_what_was_not_run(whole: ChoiceMatrix) -> None:
    """A formulation that lacks what a scene requires cannot; one that provides it, or is not known, was not run."""
    row = next(item for item in whole.rows if item.engine == "beta")
    column = next(item for item in whole.columns if item.group == "ball rolling")
    assert whole.cell(row, column, 1e-4, False) == ChoiceCell(NO_RUN, "", "was not run in this report")
    needs = {name: study._replace(requires=frozenset({"a wall"})) for name, study in STUDIES.items()}
    for provided, state in (([], CANNOT), (["a wall"], NO_RUN)):
        told = replace(whole, studies=needs, provides={"beta": {"joints": provided}})
        cell = told.cell(row, column, 1e-4, False)
        assert (cell.state, "lacks “a wall”" in cell.title) == (state, state == CANNOT)


def test_an_engine_stands_by_its_formulations() -> None:
    """By the best of them in each scene; some scenes are told as partly, none by the worst."""
    chain = {"study": "chain", "scene": "chain"}
    lines = [
        line(error=1e-9, cost=0.1),
        line(error=1e-9, cost=0.3, **chain),
        line(formulation="maps", row=1, error=1e-9, cost=0.01),
        line(formulation="maps", row=1, error=0.5, cost=0.01, **chain),
    ]
    found = choice_matrix(lines, STUDIES)
    standing = found.standing("alpha", found.kinds[0], 1e-4, False)
    assert (set(standing.formulation.split(", ")), standing.cost) == ({"joints", "maps"}, 0.3)
    found = choice_matrix(lines[2:], STUDIES)
    standing = found.standing("alpha", found.kinds[0], 1e-4, False)
    assert (standing.state, standing.text) == (PARTLY, "1 of 2")
    assert [cell.holds for cell in standing.by_scene] == [True, False]
    assert found.standing("alpha", found.kinds[0], 1e-12, False).text == "0 of 2"


def test_what_holds_all_scenes_comes_before_what_is_cheaper_in_some() -> None:
    """Scenes differ in cost: what ran only in a kind's cheap scene does not answer for the kind."""
    both = [line(error=1e-9, cost=0.5), line(error=1e-9, cost=2.0, study="chain", scene="chain")]
    found = choice_matrix([*both, line(engine="beta", row=3, error=1e-9, cost=0.1)], STUDIES)
    ranked = found.standings(found.kinds[0], 1e-4, False)
    assert [(item.engine, item.state) for item in ranked] == [("alpha", Verdict.AGREES), ("beta", PARTLY)]
    late = line(
        engine="beta",
        row=3,
        study="chain",
        scene="chain",
        status="left out",
        verdict="not-judged",
        error=None,
        cost=None,
    )
    unfinished = choice_matrix([both[0], line(engine="beta", row=3, error=1e-9, cost=0.1), late], STUDIES)
    assert unfinished.standings(unfinished.kinds[0], 1e-4, False)[0].engine == "beta", "lack of time is no failure"
    sentence = advice(unfinished, 1e-4, False)[0].sentence
    assert "beta joints, default, dt 1e-3 s (≥ 10× real time)" in sentence


def test_the_best_engine_of_a_kind_is_near_the_cheapest_in_most_scenes() -> None:
    """Two of three scenes at a tenth of the cost outweigh a third that is not held; of equals most scenes count."""
    scenes = [{"study": name, "scene": name} for name in ("arm", "chain", "ball")]
    fast = [line(error=1e-9, cost=0.1, **scene) for scene in scenes[:2]]
    slow = [line(engine="beta", row=3, error=1e-9, cost=1.0, **scene) for scene in scenes]
    found = choice_matrix([*fast, *slow], STUDIES)
    column = found.kinds[0]
    assert [(item.engine, item.held) for item in found.standings(column, 1e-4, False)] == [("alpha", 2), ("beta", 3)]
    equal = [replace(item, cost=0.1) for item in slow]
    found = choice_matrix([*fast, *equal], STUDIES)
    assert [item.engine for item in found.standings(found.kinds[0], 1e-4, False)] == ["beta", "alpha"]


def test_a_speed_is_a_least_one_until_a_coarser_step_fails() -> None:
    """Another setting's coarser step, or one that was not run, tells nothing; one that diverged does."""
    fine, coarse = line(error=1e-9, step=1e-3), line(error=1e-9, step=2e-3, cost=0.005)
    lost = replace(coarse, status="diverged", verdict="failed", error=None, cost=None)
    assert at([fine], 4).open
    assert at([fine, coarse], 4).open, "the coarsest of both"
    assert not at([fine, replace(coarse, error=0.5)], 4).open
    assert not at([fine, lost], 4).open
    assert at([fine, replace(coarse, error=0.5, row=8, setting="tuned")], 4).open
    assert not at([replace(fine, step=None, resolution="")], 4).open, "a closed form has no steps"


def test_a_scene_of_two_kinds_has_two_columns() -> None:
    """By its parameters one scene may roll in one comparison and slip in another: neither answers for the other."""
    rolls = line(study="arm", scene="wall", group="rolling", error=1e-9, cost=0.1)
    slips = line(study="chain", scene="wall", group="slipping", error=1e-9, cost=0.5)
    found = choice_matrix([rolls, slips], STUDIES)
    costs = [found.standing("alpha", column, 1e-4, False).cost for column in found.columns]
    assert costs == [0.1, 0.1, 0.5, 0.5]
