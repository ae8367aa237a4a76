"""Points that hold a tolerance with margin, and reasons why others do not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from invented import invented_budget, invented_study, measured_point, timed

from proofroll.core.comparison import Tolerance
from proofroll.core.engine_abilities import by_hand
from proofroll.core.errors import InputError
from proofroll.core.plugins import load_engine
from proofroll.report.tradeoff.tables import corner_table, default_quantities, tradeoff_parts
from proofroll.studies.tradeoff.records import Corner, MeasuredPoint, MeasuredQuantity, SparseRun, TradeoffStudy
from proofroll.studies.tradeoff.requirements import Requirements, absolute_tolerance, failure_reason, holding


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


def chosen(measured: TradeoffStudy, wanted: Requirements) -> str:
    """Engine of the cheapest point that holds a tolerance; empty if none does."""
    return next((held.engine for held in holding(measured, wanted)), "")


def why_not(measured: TradeoffStudy, wanted: Requirements, engine: str = "fast") -> str:
    """Reason why an engine's first point does not hold a tolerance; empty if it does."""
    (first, *_) = [item for item in measured.points if item.engine == engine]
    return failure_reason(measured, first, wanted, absolute_tolerance(measured, wanted)) or ""


FAST, MIDDLE, SLOW = point(1, "fast", 1e-3, 1e-2), point(2, "middle", 1e-2, 1e-4), point(3, "slow", 1e-1, 1e-7)


def test_the_cheapest_that_holds_with_margin() -> None:
    """The cheapest whose error is half the tolerance or less comes first, and a failure says by how much it is off."""
    measured = study(SLOW, FAST, MIDDLE)
    assert [held.engine for held in holding(measured, required(1e-3))] == ["middle", "slow"]
    assert "off by 0.01 m" in why_not(measured, required(1e-3))
    assert chosen(measured, required(1.5e-4)) == "slow"


def test_what_holds_only_on_the_grid_of_samples_is_excluded() -> None:
    """A tolerance that many samples alone make good is not held, and the reason names both intervals and the error."""
    sparse = SparseRun(1.0, {"z": 3e-2}, {"z": 5e-10}, "reached 2 s")
    lucky = point(1, "fast", 1e-3, 3e-2, sparse=sparse)
    said = why_not(study(lucky, MIDDLE), required(1e-3))
    assert said.startswith(
        "it holds only because its steps end at every sample: sampled every 1 s instead of 0.05 s, z"
    )
    assert "off by 0.03 m" in said
    lost = replace(lucky, sparse=replace(sparse, error={}, message="the steps became too short"))
    assert "the steps became too short" in why_not(study(lost, MIDDLE), required(1e-3))
    honest = point(1, "fast", 1e-3, 1e-5, sparse=replace(sparse, error={"z": 1e-5}))
    assert chosen(study(honest, MIDDLE), required(1e-3)) == "fast"


def test_the_range_is_shown_with_its_digits() -> None:
    """Parameters of a corner are those that a person would type."""
    there = replace(corner(1e-3), parameters={"speed": 6.125})
    table = corner_table(study(replace(FAST, corners=[there]), over={"speed": [2.125, 6.125]}), "z")
    assert str(table.title) == "Over speed 2.125 to 6.125: error of z [m]"
    assert [str(cell) for cell in table.columns[4].cells] == ["speed = 6.125"]


def test_a_percentage_is_of_the_scale() -> None:
    """One percent of a range of 0.1 m is 1 mm."""
    assert absolute_tolerance(study(FAST, MIDDLE), required(0.01, relative=True)) == pytest.approx(1e-3)


def test_a_percentage_of_what_has_no_size() -> None:
    """Where a quantity has no size, as the first slip of a ball that does not slip, a percentage of it is refused."""
    sizeless = {"z": MeasuredQuantity("m", None, 1e-13, "z", column=True)}
    with pytest.raises(InputError, match="z has no size here; give it in m"):
        holding(study(FAST, MIDDLE, quantities=sizeless), required(0.01, relative=True))
    assert chosen(study(FAST, MIDDLE, quantities=sizeless), required(1e-3)) == "middle"


def test_no_error_is_seen_below_the_truths_own() -> None:
    """Nothing holds a tolerance that the truth does not resolve, not even a run that shows no error at all."""
    exact = study(point(4, "exact", 1e-2, 0.0))
    assert not chosen(exact, required(1.9e-13))
    assert "the truth itself is known only to 1e-13 m" in why_not(exact, required(1.9e-13), "exact")
    assert chosen(exact, required(1e-12)) == "exact"


def test_luck_is_not_believed() -> None:
    """A coarse run with a small error does not pass while finer runs of the same curve are worse."""
    lucky = point(1, "fast", 1e-3, 1e-6, envelope={"z": 1e-2})
    assert chosen(study(lucky, MIDDLE), required(1e-3)) == "middle"
    assert "luck" in why_not(study(lucky, MIDDLE), required(1e-3))


def test_no_step_holds_what_its_limit_of_small_steps_does_not() -> None:
    """Errors that pass zero far from the limit are luck, too; a limit that is not known so well excludes nothing."""
    lucky = point(1, "fast", 1e-3, 1e-6)
    another = invented_budget(curve=lucky.curve, model_form=1e-2, model_form_bar=1e-4)
    said = why_not(study(lucky, MIDDLE, budgets=[another]), required(1e-3))
    assert said == "its error of 1e-6 m is luck: 0.01 m remain in the limit of small steps"
    vague = study(lucky, MIDDLE, budgets=[replace(another, model_form_bar=1e-2)])
    assert chosen(vague, required(1e-3)) == "fast"


@pytest.mark.parametrize(
    ("corners", "said"),
    [([corner(2e-3)], "at speed = 6"), ([corner(None)], "ended at 1 s"), (None, "not checked")],
)
def test_what_fails_elsewhere_in_the_range_is_not_chosen(corners: Any, said: str) -> None:
    """A point that is off, or ends, or was never run at a corner of the range does not hold, and it says why."""
    measured = study(point(1, "fast", 1e-3, 1e-4, corners=corners), SLOW)
    assert chosen(measured, required(1e-3)) == "slow"
    assert said in why_not(measured, required(1e-3))


def test_equations_worked_out_by_hand_are_held_apart() -> None:
    """A closed form is not an engine: it is left out, unless it is asked for."""
    closed = point(0, "least", 1e-6, 1e-14, level="closed form")
    assert chosen(study(closed, MIDDLE), required(1e-3)) == "middle"
    assert chosen(study(closed, MIDDLE), required(1e-3, engines=("least",))) == "least"


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
    """Only what is asked for is chosen from; an unknown quantity is an error that says what was measured."""
    soft = point(4, "soft", 1e-2, 1e-5, level="engine contact", formulation="free")
    measured = study(MIDDLE, SLOW, soft)
    assert chosen(measured, required(1e-3, levels=("engine contact",))) == "soft"
    assert chosen(measured, required(1e-3, engines=("soft[formulation=free]",))) == "soft"
    assert not chosen(measured, required(1e-3, engines=("soft[formulation=chart]",)))
    with pytest.raises(InputError, match="measured are z"):
        holding(measured, Requirements("y", Tolerance(1e-3, False, "m")))


def test_why_a_finer_step_would_not_do() -> None:
    """Where the limit of small steps is off by more than the tolerance, the reason says that no step would do."""
    budgets = [invented_budget(curve=FAST.curve, model_form=5e-3, model_form_bar=1e-5)]
    assert "no step would do" in why_not(study(FAST, MIDDLE, budgets=budgets), required(1e-3))
    unsure = [invented_budget(curve=FAST.curve, model_form=5e-3, model_form_bar=4.9e-3)]
    said = why_not(study(FAST, MIDDLE, budgets=unsure), required(1e-3))
    assert "whether a finer step would suffice is not known: " in said
    assert "the limit of small steps is 5e-3 off, known to 4.9e-3" in said


def test_a_finer_step_that_holds_would_do() -> None:
    """Whatever is known of the limit of small steps, a step that holds the tolerance shows that a finer one does."""
    fine = point(4, "fast", 2e-3, 1e-5)
    for bar in (4.9e-3, None):
        unsure = [invented_budget(curve=FAST.curve, model_form=5e-3 if bar else None, model_form_bar=bar)]
        measured = study(FAST, fine, budgets=unsure)
        assert holding(measured, required(1e-3))[0].step == fine.step
        assert why_not(measured, required(1e-3)).endswith("; the step is too coarse")


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
