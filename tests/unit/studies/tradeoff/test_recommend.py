"""Recommendations from measured points."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from invented import invented_budget, invented_study, measured_point, timed

from proofroll.core.comparison import Tolerance
from proofroll.core.engine_abilities import by_hand
from proofroll.core.errors import InputError
from proofroll.core.plugins import load_engine
from proofroll.files.json_data import plain
from proofroll.report.tradeoff.tables import answer_lines, corner_table, default_quantities, tradeoff_parts
from proofroll.studies.tradeoff.recommend import covers
from proofroll.studies.tradeoff.recommend import recommend as recommended
from proofroll.studies.tradeoff.records import Corner, MeasuredPoint, MeasuredQuantity, SparseRun, TradeoffStudy
from proofroll.studies.tradeoff.requirements import Requirements


def point(  # noqa: D103 -- one measured point
    number: int, engine: str, cost: float, error: float | None, *, formulation: str = "only", **more: Any
) -> MeasuredPoint:
    values: dict[str, Any] = {
        "id": number,
        "engine": engine,
        "settings": {"formulation": formulation, "preset": "matched", "dt": 10.0**-number},
        "step": 10.0**-number,
        "error": {"z": error},
        "corners": [corner(error)],
    }
    return measured_point(**(values | timed(cost) | more))


def corner(error: float | None) -> Corner:
    """One run at other parameters."""
    errors = {} if error is None else {"z": error}
    relative = {} if error is None else {"z": error / 0.1}
    return Corner({"speed": 6.0}, errors, relative, "ended at 1 s")


def study(*points: MeasuredPoint, **more: Any) -> TradeoffStudy:
    """What a trade-off study stores."""
    return invented_study(*points, **({"over": {"speed": [2.0, 6.0]}} | more))


def required(value: float, *, relative: bool = False, **more: Any) -> Requirements:
    """An error of z."""
    return Requirements("z", Tolerance(value, relative, "%" if relative else "m"), **more)


def recommend(measured: TradeoffStudy, wanted: Requirements) -> dict[str, Any]:
    """The recommendation as JSON has it."""
    return dict(plain(recommended(measured, wanted)))


FAST, MIDDLE, SLOW = point(1, "fast", 1e-3, 1e-2), point(2, "middle", 1e-2, 1e-4), point(3, "slow", 1e-1, 1e-7)


def test_the_cheapest_that_holds_with_margin() -> None:
    """The cheapest whose error is half the tolerance or less is chosen, between a runner-up and a failure."""
    answer = recommend(study(SLOW, FAST, MIDDLE), required(1e-3))
    assert answer["choice"]["engine"] == "middle"
    assert answer["runner_up"]["engine"] == "slow"
    assert answer["first_failure"]["engine"] == "fast"
    assert "off by 0.01 m" in answer["first_failure"]["reason"]
    assert answer["choice"]["error"] == 1e-4
    assert answer["choice"]["seconds_per_second"] == 1e-2
    assert recommend(study(FAST, MIDDLE, SLOW), required(1.5e-4))["choice"]["engine"] == "slow"


def test_what_holds_only_on_the_grid_of_samples_is_excluded() -> None:
    """A tolerance that many samples alone make good is no choice, and the reason names both intervals and the error."""
    sparse = SparseRun(1.0, {"z": 3e-2}, {"z": 5e-10}, "reached 2 s")
    lucky = point(1, "fast", 1e-3, 3e-2, sparse=sparse)
    answer = recommend(study(lucky, MIDDLE), required(1e-3))
    assert answer["choice"]["engine"] == "middle"
    said = answer["first_failure"]["reason"]
    assert said.startswith(
        "it holds only because its steps end at every sample: sampled every 1 s instead of 0.05 s, z"
    )
    assert "off by 0.03 m" in said
    lost = replace(lucky, sparse=replace(sparse, error={}, message="the steps became too short"))
    assert "the steps became too short" in recommend(study(lost, MIDDLE), required(1e-3))["first_failure"]["reason"]
    honest = point(1, "fast", 1e-3, 1e-5, sparse=replace(sparse, error={"z": 1e-5}))
    assert recommend(study(honest, MIDDLE), required(1e-3))["choice"]["engine"] == "fast"


def test_costs_that_cannot_be_told_apart_are_ties() -> None:
    """Points that hold the tolerance, and whose cost interval overlaps the choice's, are named; others are not."""
    near, far = point(4, "near", 1.15e-2, 1e-5), point(5, "far", 1.3e-2, 1e-5)
    failing = point(6, "failing", 1.05e-2, 1e-2)
    measured = study(FAST, MIDDLE, near, far, failing, SLOW)
    answer = recommend(measured, required(1e-3))
    assert answer["choice"]["engine"] == "middle"
    assert [tie["engine"] for tie in answer["ties"]] == ["near"]
    assert answer["ties"][0]["reason"]
    assert recommend(study(FAST, SLOW), required(1e-3))["ties"] == []
    assert any(line.startswith("Tie: near only") for line in answer_lines(recommended(measured, required(1e-3))))


def test_many_ties_are_one_line() -> None:
    """Several ties in cost are counted in one line, which names the most accurate of them."""
    errors = (2e-5, 1e-6, 3e-5)
    near = [point(3 + k, f"near{k}", 1.01e-2, e, interval=[1e-2, 1.02e-2]) for k, e in enumerate(errors)]
    measured = study(FAST, replace(MIDDLE, interval=[9.9e-3, 1.01e-2]), *near)
    (line,) = [line for line in answer_lines(recommended(measured, required(1e-3))) if "same" in line]
    assert line.startswith("3 others cost the same within the measurement. Most accurate of them: near1 only")


def test_a_factor_is_a_number_as_a_person_writes_it() -> None:
    """What holds a tolerance thousands of times over is said without powers of ten."""
    reason = recommend(study(point(1, "fine", 1e-3, 2.5e-7)), required(1e-3))["choice"]["reason"]
    assert reason.startswith("more than 1000 times better than asked, and more than 1000 times at the worst of ")


def test_an_error_that_finer_steps_exceed_is_given_with_theirs() -> None:
    """Where the next finer steps are worse than the choice, the text says by how much, for that decides the margin."""
    lucky = replace(point(1, "lucky", 1e-3, 1e-5), envelope={"z": 1e-4})
    reason = recommend(study(lucky), required(1e-3))["choice"]["reason"]
    assert reason.startswith("up to 1e-4 m at the next finer steps, 10 times better than asked")


def test_the_range_is_shown_with_its_digits() -> None:
    """Parameters of a corner are those that a person would type."""
    there = replace(corner(1e-3), parameters={"speed": 6.125})
    table = corner_table(study(replace(FAST, corners=[there]), over={"speed": [2.125, 6.125]}), "z")
    assert str(table.title) == "Over speed 2.125 to 6.125: error of z [m]"
    assert [str(cell) for cell in table.columns[4].cells] == ["speed = 6.125"]


def test_a_percentage_is_of_the_scale() -> None:
    """One percent of a range of 0.1 m is 1 mm."""
    assert recommend(study(FAST, MIDDLE), required(0.01, relative=True))["tolerance"] == pytest.approx(1e-3)


def test_a_percentage_of_what_has_no_size() -> None:
    """Where a quantity has no size, as the first slip of a ball that does not slip, a percentage of it is refused."""
    sizeless = {"z": MeasuredQuantity("m", None, 1e-13, "z", column=True)}
    with pytest.raises(InputError, match="z has no size here; give it in m"):
        recommend(study(FAST, MIDDLE, quantities=sizeless), required(0.01, relative=True))
    assert recommend(study(FAST, MIDDLE, quantities=sizeless), required(1e-3))["choice"]["engine"] == "middle"


def test_no_error_is_seen_below_the_truths_own() -> None:
    """Nothing holds a tolerance that the truth does not resolve, not even a run that shows no error at all."""
    exact = point(4, "exact", 1e-2, 0.0)
    assert recommend(study(exact), required(1.9e-13))["choice"] is None
    assert (
        "the truth itself is known only to 1e-13 m" in recommend(study(exact), required(1.9e-13))["closest"]["reason"]
    )
    assert recommend(study(exact), required(1e-12))["choice"]["reason"].startswith("at least 10 times better")


def test_luck_is_not_believed() -> None:
    """A coarse run with a small error does not pass while finer runs of the same curve are worse."""
    lucky = point(1, "fast", 1e-3, 1e-6, envelope={"z": 1e-2})
    answer = recommend(study(lucky, MIDDLE), required(1e-3))
    assert answer["choice"]["engine"] == "middle"
    assert "luck" in answer["first_failure"]["reason"]


def test_no_step_holds_what_its_limit_of_small_steps_does_not() -> None:
    """Errors that pass zero far from the limit are luck, too; a limit that is not known so well excludes nothing."""
    lucky = point(1, "fast", 1e-3, 1e-6)
    another = invented_budget(curve=lucky.curve, model_form=1e-2, model_form_bar=1e-4)
    failure = recommend(study(lucky, MIDDLE, budgets=[another]), required(1e-3))["first_failure"]
    assert failure["reason"] == "its error of 1e-6 m is luck: 0.01 m remain in the limit of small steps"
    vague = study(lucky, MIDDLE, budgets=[replace(another, model_form_bar=1e-2)])
    assert recommend(vague, required(1e-3))["choice"]["engine"] == "fast"


@pytest.mark.parametrize(
    ("corners", "said"),
    [([corner(2e-3)], "at speed = 6"), ([corner(None)], "ended at 1 s"), (None, "not checked")],
)
def test_what_fails_elsewhere_in_the_range_is_not_chosen(corners: Any, said: str) -> None:
    """A point that is off, or ends, or was never run at a corner of the range is not recommended, and it says why."""
    answer = recommend(study(point(1, "fast", 1e-3, 1e-4, corners=corners), SLOW), required(1e-3))
    assert answer["choice"]["engine"] == "slow"
    assert said in answer["first_failure"]["reason"]
    assert answer["checked"]["parameters"] == {"speed": [2.0, 6.0]}


@pytest.mark.parametrize(
    ("measured", "engines", "answered"),
    [
        ([], [], True),
        ([], ["a"], True),
        (["a", "b"], ["a"], True),
        (["a", "b"], ["a[dt=1e-3]", "b"], True),
        (["a[dt=1e-3]"], ["a[dt=1e-3]"], True),
        (["a[dt=1e-3]"], ["a"], False),
        (["a", "b"], ["a", "c"], False),
        (["a"], [], False),
    ],
)
def test_a_study_answers_about_each_of_its_engines(measured: list[str], engines: list[str], answered: bool) -> None:
    """A study of some engines answers about any of these, and about no other; one of all answers about each."""
    assert covers(measured, engines) == answered


def test_nothing_beyond_what_was_measured() -> None:
    """Where nothing holds the tolerance there is no choice, and the closest point is named as such."""
    answer = recommend(study(FAST, MIDDLE), required(1e-9))
    assert answer["choice"] is None
    assert answer["closest"]["engine"] == "middle"
    assert "nothing is extrapolated" in answer["closest"]["reason"]
    assert "z is off by 1e-4 m" in answer["closest"]["reason"]
    assert answer["first_failure"] is None, "what is not chosen has nothing that is cheaper"


def test_a_largest_cost_that_is_too_small() -> None:
    """A choice that costs more than is allowed is named as such, with the most accurate that does not."""
    answer = recommend(study(FAST, MIDDLE, SLOW), required(1e-5, max_cost=0.02))
    assert answer["choice"]["engine"] == "slow"
    assert not answer["affordable"]
    assert answer["best_affordable"]["engine"] == "middle"
    assert recommend(study(FAST, MIDDLE, SLOW), required(1e-5, max_cost=0.2))["affordable"]


def test_equations_worked_out_by_hand_are_named_apart() -> None:
    """A closed form is not an engine: it is told as the least model, unless it is asked for."""
    closed = point(0, "least", 1e-6, 1e-14, level="closed form")
    answer = recommend(study(closed, MIDDLE), required(1e-3))
    assert answer["choice"]["engine"] == "middle"
    assert answer["least_model"]["engine"] == "least"
    assert recommend(study(closed, MIDDLE), required(1e-3, engines=("least",)))["choice"]["engine"] == "least"


def test_solvers_of_any_mechanism_are_no_equations_by_hand() -> None:
    """Of our engines only those with a ball's equations are left out of the contest, in studies and comparisons."""
    found = {
        (engine, formulation)
        for engine in ("exudyn", "mujoco", "pinocchio", "projection", "reduced")
        for formulation, level in load_engine(engine).levels.items()
        if by_hand(level)
    }
    assert found == {
        ("projection", "euler"), ("projection", "rotating_frame"), ("reduced", "equations"), ("reduced", "closed_form"),
    }  # fmt: skip


def test_restricted_to_engines_settings_and_levels() -> None:
    """Only what is asked for is chosen from; an engine that was not measured is an error that says what was."""
    soft = point(4, "soft", 1e-2, 1e-5, level="engine contact", formulation="free")
    measured = study(MIDDLE, SLOW, soft)
    assert recommend(measured, required(1e-3, levels=("engine contact",)))["choice"]["engine"] == "soft"
    assert recommend(measured, required(1e-3, engines=("soft[formulation=free]",)))["choice"]["engine"] == "soft"
    assert recommend(measured, required(1e-3, engines=("soft[formulation=chart]",)))["choice"] is None
    with pytest.raises(InputError, match="measured are middle, slow, soft"):
        recommend(measured, required(1e-3, engines=("other",)))
    with pytest.raises(InputError, match="measured are z"):
        recommend(measured, Requirements("y", Tolerance(1e-3, False, "m")))


def test_why_a_finer_step_would_not_do() -> None:
    """Where the limit of small steps is off by more than the tolerance, the reason says that no step would do."""
    budgets = [invented_budget(curve=FAST.curve, model_form=5e-3, model_form_bar=1e-5)]
    answer = recommend(study(FAST, MIDDLE, budgets=budgets), required(1e-3))
    assert "no step would do" in answer["first_failure"]["reason"]
    unsure = [invented_budget(curve=FAST.curve, model_form=5e-3, model_form_bar=4.9e-3)]
    said = recommend(study(FAST, MIDDLE, budgets=unsure), required(1e-3))["first_failure"]["reason"]
    assert "whether a finer step would suffice is not known: " in said
    assert "the limit of small steps is 5e-3 off, known to 4.9e-3" in said


def test_a_finer_step_that_is_recommended_would_do() -> None:
    """Whatever is known of the limit of small steps, a step that holds the tolerance shows that a finer one does."""
    fine = point(4, "fast", 2e-3, 1e-5)
    for bar in (4.9e-3, None):
        unsure = [invented_budget(curve=FAST.curve, model_form=5e-3 if bar else None, model_form_bar=bar)]
        answer = recommend(study(FAST, fine, budgets=unsure), required(1e-3))
        assert answer["choice"]["step"] == fine.step
        assert answer["first_failure"]["reason"].endswith("; the step is too coarse")


def printed(measured: TradeoffStudy) -> list[str]:
    """Lines of a trade-off's screen."""
    return [" ".join(str(part).split()) for part in tradeoff_parts(measured, ["z"], every_point=False)]


def test_a_tradeoff_answers_first() -> None:
    """What to take at 1e-4 of the size, whether it leads elsewhere, what is next, and a column for each tolerance."""
    fast, fine = point(1, "fast", 1e-3, 1e-6), point(2, "fine", 0.1, 1e-12)
    found = printed(study(fast, fine))
    assert found[0] == (
        "Take fast only, matched, dt 0.1 s: 1000× real time at 1e-4 of the size of z. It leads wherever it holds; "
        "next is fine only: 10× real time."
    )
    assert found[2:5] == [
        "× real time, cheapest that holds 1e-3 1e-4 1e-6 1e-8",
        "fast only 1000× 1000× – –",
        "fine only 10× 10× 10× 10×",
    ]
    assert printed(study(point(1, "rough", 1e-3, 1.0)))[0] == "Nothing that was measured holds 1e-4 of the size of z."


def test_a_cost_whose_timings_scatter_is_unknown() -> None:
    """An interval wider than a factor of two is no speed: a mark in the table, the factor in a sentence."""
    found = printed(study(replace(point(1, "fast", 1e-3, 1e-6), interval=(1e-3, 17e-3))))
    assert "speed unknown (its timings differ by a factor of 17)" in found[0]
    assert found[3:5] == ["fast only ? ? – –", "?: unknown, its timings differ by more than a factor of 2."]


def test_what_has_no_curve_is_no_column() -> None:
    """A study by the order of events, of which the truth has no curve, shows what else it has."""
    assert default_quantities(study(FAST, quantity="event_order")) == ["z"]


def test_what_every_run_has_exactly_is_no_column() -> None:
    """Forces that are zero in the truth and in every run choose no engine; a run that ended early has none."""
    known = {name: MeasuredQuantity("m", 0.1, 1e-13, name, column=True) for name in ("z", "forces", "gear")}
    points = [
        measured_point(error={"z": 1e-2, "forces": 0.0, "gear": 0.0}),
        measured_point(error={"z": 1e-4, "forces": 0.0, "gear": 1e-3}),
        measured_point(error={"z": None, "forces": None, "gear": None}),
    ]
    assert default_quantities(study(*points, quantities=known)) == ["z", "gear"]
