from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from flat_judging import judged_curve

from proofroll.core.convergence import Limit, falls_faster, richardson, tightest
from proofroll.core.verdict import (
    Allowance,
    Judgement,
    LimitResult,
    Refinement,
    RunCurve,
    TrueCurve,
    Verdict,
    judge_curve,
)

T = np.linspace(0, 2, 21)
TRUE = np.sin(3 * T)
MILLIMETRE = 1e-3


def verdict_of(
    error: float, limit: Limit | None = None, *, bar: float = 1e-12, tolerance: float = MILLIMETRE, ladder: bool = False
) -> Judgement:
    """The judgement of a curve that is off by ``error``."""
    return judged_curve(
        "z", "m", TRUE + error, TRUE, truth_error_bar=bar, tolerance=tolerance, scale=1.0, limit=limit, ladder=ladder
    )


def ladder(power: float, offset: float = 0.0) -> Limit:
    """The limit of curves of some order, the finest off by 0.01."""
    return richardson([TRUE + offset + 0.01 * h**power * (1 + 0.01 * h) for h in (4, 2, 1)], (4, 2, 1))


def errors(*off: float, declared: int | None = 1) -> Limit:
    """The limit of three curves that are off by so much, each step half of the one before."""
    return richardson([TRUE + value for value in off], (4, 2, 1), declared)


def tightened(*off: float) -> Limit:
    """The limit of curves that are off by so much, each by a tighter tolerance."""
    return tightest([TRUE + value for value in off])


AGREES, DIFFERS, CONVERGES, OPEN = Verdict.AGREES, Verdict.DIFFERS, Verdict.CONVERGES, Verdict.UNCONFIRMED
NO_LADDER, WITHIN, ANOTHER = LimitResult.NO_LADDER, LimitResult.WITHIN, LimitResult.ANOTHER
NOT_SHOWN = LimitResult.NOT_SHOWN
MISSING = Limit(TRUE, math.nan, math.nan)  # stands for a ladder of which a rung is lacking
UNSETTLED = Limit(TRUE + 0.02, 0.01, math.nan, shown=False, regular=False, unsettled="after the impact at 0.502 s")
SCATTERS = (0.0, 1e-16, 1e-14, 2e-13, 3e-13, 1e-11, 1e-8)
# What is shown: error, limit, tolerance [m], verdict, how the limit stands, and words of the reason.
Case = tuple[float, Limit | None, float, Verdict, LimitResult, str]
CASES: dict[str, list[Case]] = {
    "an error up to the tolerance agrees where one step is all there is": [
        (0.999e-3, None, 1e-3, AGREES, NO_LADDER, "one step only"),
    ],
    "without a limit nothing speaks for convergence": [(0.01, None, 1e-3, DIFFERS, NO_LADDER, "beyond")],
    "as many digits are written as show a difference": [
        (1.000001e-3, None, 1e-3, DIFFERS, NO_LADDER, "error 1.000001e-3 m beyond 1e-3 m"),
        (2e-3, None, 1e-3, DIFFERS, NO_LADDER, "error 2e-3 m beyond 1e-3 m"),
    ],
    "what is not finite is never within a tolerance": [
        (math.nan, ladder(1), 1e-3, DIFFERS, WITHIN, "not finite"),
        (math.inf, ladder(1), 1e-3, DIFFERS, WITHIN, "not finite"),
    ],
    "where samples limited the steps a first tightening that changes next to nothing shows no wrong limit": [
        (2e-10, tightened(2e-10, 2e-10 + 7e-14, 2e-10 - 7e-12), 1e-3, AGREES, WITHIN, ""),
    ],
    "an adaptive engine whose samples set its steps is off by its own error, and by no other limit": [
        (2e-4, tightened(2e-4, 2e-4 + 3e-15), 1e-5, DIFFERS, NOT_SHOWN, "two tolerances give the same run"),
        (1e-6, tightened(1e-6, 1e-6 + 3e-15), 1e-5, AGREES, WITHIN, ""),
        (5e-3, tightened(5e-3, 5e-3, 5e-3), 1e-3, DIFFERS, NOT_SHOWN, "two tolerances give the same run"),
        (5e-3, tightened(5e-3, 5e-3, 4.99e-3), 1e-3, DIFFERS, NOT_SHOWN, "two tolerances give the same run"),
        (4e-3, tightened(4e-3, 5e-3, 5e-3), 1e-3, DIFFERS, NOT_SHOWN, "two tolerances give the same run"),
    ],
    "tightening until nothing changes shows a limit without an order": [
        (5e-3, tightened(5e-3, 2e-4, 1e-5), 1e-3, CONVERGES, WITHIN, ""),
        (5e-3, tightened(4e-3, 5e-3, 0.9e-3), 1e-3, DIFFERS, NOT_SHOWN, ""),
    ],
    "tightenings that change 1 mm, then 0.9 mm, may change nine times that: no agreement within 1 mm": [
        (0.5e-3, tightened(2.4e-3, 1.4e-3, 0.5e-3), 1e-3, OPEN, NOT_SHOWN, " 0.0081"),
    ],
    "within tolerance, with a limit known less well than that: agreement at this step alone": [
        (0.5e-3, errors(0.5e-3, 4e-3, -2e-3), 1e-3, OPEN, NOT_SHOWN, ""),
    ],
    "runs of which each halving adds as much as the one before do not confirm": [
        (0.4e-3, errors(0.1e-3, 0.4e-3, 0.7e-3), 1e-3, OPEN, NOT_SHOWN, ""),
        (2e-5, errors(0.5e-5, 1e-5, 2e-5), 1e-4, OPEN, NOT_SHOWN, ""),
    ],
    "one run that jumps, or curves that scatter, far inside the tolerance leave no doubt": [
        (2e-5, errors(0, 1e-7, 2e-5), 1e-4, AGREES, WITHIN, ""),
        (1e-5, errors(1e-5, -1e-5, 2e-5), 1e-3, AGREES, WITHIN, ""),
    ],
    "where a rung of the ladder gave no such curve agreement stays one of this step": [
        (0.5e-3, MISSING, 1e-3, OPEN, NOT_SHOWN, "not every step of the ladder"),
    ],
    "a drift by a hundredth of the tolerance shows no other limit at 1.05 of it, but at twice": [
        (1.05e-3, errors(1.07e-3, 1.06e-3, 1.05e-3), 1e-3, DIFFERS, NOT_SHOWN, ""),
        (2e-3, errors(2.02e-3, 2.01e-3, 2e-3), 1e-3, DIFFERS, ANOTHER, ""),
    ],
    "equal curves, or ones that differ by round-off, are their own limit": [
        (0.05, errors(0.05, 0.05, 0.05), 1e-3, DIFFERS, ANOTHER, ""),
        (0.05, errors(0.05, 0.05 + 1e-14, 0.05 - 1e-14), 1e-3, DIFFERS, ANOTHER, ""),
    ],
    "runs that do not settle show no limit, even where the last of them is within tolerance": [
        (1.2e-3, Limit(TRUE + 0.01, 0.05, math.nan, shown=False), 1e-3, DIFFERS, NOT_SHOWN, ""),
        (1.2e-3, errors(1.5e-3, 1.2e-3, 0.9e-3), 1e-3, DIFFERS, NOT_SHOWN, ""),
        (1.2e-3, errors(0.9e-3, -0.8e-3, 0.95e-3), 1e-3, DIFFERS, NOT_SHOWN, ""),
    ],
    "another limit and no limit are two answers, with order, limit error and bar": [
        (
            0.061,
            ladder(1, offset=0.05),
            1e-3,
            DIFFERS,
            ANOTHER,
            "error 0.061 m beyond 1e-3 m; another limit: off by 0.05 ± ",
        ),
        (0.061, ladder(1, offset=0.05), 1e-3, DIFFERS, ANOTHER, "order 1.04"),
        (0.05, errors(0.05, -0.04, 0.06), 1e-3, DIFFERS, NOT_SHOWN, "no limit shown: off by 0.06 ± 0.1 m, no order"),
    ],
    "a ladder that does not settle says behind which event": [
        (0.02, UNSETTLED, 1e-3, DIFFERS, NOT_SHOWN, "do not settle after the impact at 0.502 s: off by 0.02 ± 0.01 m"),
    ],
}


@pytest.mark.parametrize(
    ("error", "limit", "tolerance", "verdict", "result", "words"),
    [pytest.param(*case, id=name) for name, cases in CASES.items() for case in cases],
)
def test_a_ladder_has_its_verdict(
    error: float, limit: Limit | None, tolerance: float, verdict: Verdict, result: LimitResult, words: str
) -> None:
    """Each name of ``CASES`` says what is shown."""
    known = None if limit is MISSING else limit
    found = verdict_of(error, known, tolerance=tolerance, ladder=limit is not None)
    assert (found.verdict, found.limit) == (verdict, result)
    assert words in f"{found.reason} {found.limit_error_bar:.2g}" if known else words in found.reason
    assert result is not WITHIN or found.remarks == ()


@pytest.mark.parametrize("scatter", SCATTERS)
@pytest.mark.parametrize(("off", "verdict", "limit"), [(0.8e-3, AGREES, WITHIN), (1.5e-3, DIFFERS, ANOTHER)])
def test_scatter_far_below_the_tolerance_decides_nothing(
    scatter: float, off: float, verdict: Verdict, limit: LimitResult
) -> None:
    """A ladder is flat against the tolerance, however little it scatters and however well its truth is known."""
    found = verdict_of(off, errors(off, off + scatter, off - scatter), bar=1e-4)
    assert (found.verdict, found.limit) == (verdict, limit)


@pytest.mark.parametrize(
    ("error", "tolerance", "limit", "remarks"),
    [
        (0.01, MILLIMETRE, Limit(TRUE + 2.7e-14, 9.3e-15, 0.99999999994), 0),  # 3 of its bars, below the truth's own
        (0.01, MILLIMETRE, Limit(TRUE + 5e-13, 9.3e-15, 0.99999999994), 0),  # 50 of its bars
        (1.0, 0.41, Limit(TRUE + 7e-5, 1e-6, 2.0), 1),  # not quite the truth
    ],
)
def test_a_limit_within_tolerance_is_convergence(error: float, tolerance: float, limit: Limit, remarks: int) -> None:
    """Its distance is remarked where it is more than round-off, and the ladder is never too clean."""
    found = verdict_of(error, limit, tolerance=tolerance)
    assert (found.verdict, found.limit, len(found.remarks)) == (CONVERGES, WITHIN, remarks)


@pytest.mark.parametrize(
    ("on_grid", "off_grid", "verdict"),
    [
        (0.5e-3, 0.9e-3, Verdict.AGREES),
        (0.5e-3, 2e-3, Verdict.CONVERGES),
        (1e-6, 2e-3, Verdict.DIFFERS),
        (1e-6, 0.9e-3, Verdict.AGREES),
        (1e-6, math.inf, Verdict.DIFFERS),
    ],
)
def test_what_is_hidden_from_the_samples_differs(on_grid: float, off_grid: float, verdict: Verdict) -> None:
    """Between samples a run is held to its tolerance; the limit of the samples excuses an error of their size alone."""
    found = judged_curve(
        "z", "m", TRUE + on_grid, TRUE, truth_error_bar=1e-12, tolerance=MILLIMETRE, scale=1.0,
        limit=errors(4 * on_grid, 2 * on_grid, on_grid), ladder=True, between=(np.full(3, off_grid), np.zeros(3)),
    )  # fmt: skip
    assert found.verdict == verdict
    assert ("so the error is between them" in found.reason) == (verdict is Verdict.DIFFERS)
    assert found.error == max(on_grid, off_grid)


@pytest.mark.parametrize("declared", [1, 2, None])
def test_an_error_that_vanishes_by_luck_at_one_step_is_no_agreement(declared: int | None) -> None:
    """A run that is off by 50 mm (1 - h/1 ms) hits the truth at 1 ms; its ladder shows another limit, so it differs."""
    off = [50e-3 * (1 - h) for h in (1.0, 0.5, 0.25)]
    found = verdict_of(off[0], errors(*off, declared=declared))
    assert found.error < 1e-15
    assert (found.verdict, found.limit) == (Verdict.DIFFERS, LimitResult.ANOTHER)
    assert "within 1e-3 m" in found.reason
    assert "another limit: off by" in found.reason


def test_a_limit_by_another_order_than_the_schemes_is_in_doubt() -> None:
    """Three steps of order 1 of a scheme of order 2 may be chance: their limit beyond the tolerance is not shown."""
    off = [1.5e-3 * (1 - h) for h in (1.0, 0.5, 0.25)]
    found = verdict_of(off[0], errors(*off, declared=2))
    assert (found.verdict, found.limit) == (Verdict.UNCONFIRMED, LimitResult.NOT_SHOWN)
    assert found.limit_error == pytest.approx(1.5e-3)
    assert found.order == pytest.approx(1)
    beyond = verdict_of(20e-3 + off[0], errors(*(20e-3 + value for value in off), declared=2))
    assert (beyond.verdict, beyond.limit) == (Verdict.DIFFERS, LimitResult.ANOTHER)


def test_differences_that_follow_no_power_show_no_order_and_accuse_nobody() -> None:
    """Errors in a saw-tooth, as of steps that end beside an event: no order, and no limit that is not the truth."""
    saw = [TRUE + off * np.sin(k * T) for off, k in ((7.6e-3, 2), (16.7e-3, 5), (7.6e-3, 9))]
    settled = [TRUE + 3e-3 + off * np.sin(k * T) for off, k in ((7.6e-3, 2), (1e-3, 5), (1e-6, 9))]
    allowance, true = Allowance("q", "m", 0.1, 1.0), TrueCurve(TRUE, 1e-12)
    for curves in (saw, settled):
        found = judge_curve(allowance, RunCurve(curves[-1]), true, Refinement(richardson(curves, (4, 2, 1), 4), True))
        assert found.order is None
        assert found.remarks == ()


def test_steps_whose_errors_fall_ever_faster_show_no_other_limit() -> None:
    """Errors of 6.39, 2.67 and 0.766 that fall on to 0.0003 show order 1 by chance: they do not pass the truth."""
    wave, steps = np.cos(9 * T), (4, 2, 1)
    curves = [TRUE + error * wave for error in (6.39, 2.67, 0.766)]
    limit = richardson(curves, steps, 1)
    allowance, true = Allowance("w", "rad/s", 0.28, 28.0), TrueCurve(TRUE, 1e-12)
    assert falls_faster([6.39, 2.67, 0.766], steps)
    blind, found = (
        judge_curve(allowance, RunCurve(curves[-1]), true, Refinement(limit, ladder=True, faster=faster))
        for faster in (False, True)
    )
    assert (blind.limit, found.limit) == (LimitResult.ANOTHER, LimitResult.NOT_SHOWN)
    assert "a shorter step is needed: --engine NAME[dt=…]" in found.reason
    assert found.verdict is Verdict.DIFFERS


@pytest.mark.parametrize(
    "errors_of", [(4.0, 2.0, 1.0), (1.0, 2.0, 4.0), (5.0, 3.0, 2.0), (0.0, 0.0, 0.0), (6.4, 2.7, np.nan)]
)
def test_errors_of_one_order_or_of_another_limit_do_not_fall_faster(errors_of: tuple[float, float, float]) -> None:
    """Errors in proportion to the step, towards another limit, away from the truth or unknown tell as they did."""
    assert not falls_faster(errors_of, (4, 2, 1))


def shifted_in_time(t: np.ndarray) -> np.ndarray:
    """The motion a tenth of a millisecond late."""
    return 0.1 * np.sin(3 * (t - 1e-4))


def other_gravity(t: np.ndarray) -> np.ndarray:
    """A fall with standard gravity instead of 9.81 m/s²."""
    return 0.1 * np.sin(3 * t) - 0.05 * (9.80665 - 9.81) * t**2


def other_inertia(t: np.ndarray) -> np.ndarray:
    """A ball whose inertia is off by 0.1 %: its frequency by 0.02 %."""
    return 0.1 * np.sin(3 * 1.0002 * t)


@pytest.mark.parametrize("model", [shifted_in_time, other_gravity, other_inertia])
def test_a_wrong_limit_within_tolerance_is_remarked(model: Callable[[np.ndarray], np.ndarray]) -> None:
    """What stays within tolerance but whose limit is shown to be another agrees, and the judgement says so."""
    true = 0.1 * np.sin(3 * T)
    curves = [model(T) + 1e-6 * h**2 * np.cos(T) for h in (4, 2, 1)]
    found = judged_curve(
        "z", "m", curves[-1], true, truth_error_bar=1e-12, tolerance=MILLIMETRE, scale=0.2,
        limit=richardson(curves, (4, 2, 1), 2), ladder=True,
    )  # fmt: skip
    assert found.verdict is Verdict.AGREES
    (remark,) = found.remarks
    assert "limit of small steps is shown not to be the truth: off by" in remark
    assert "order 2" in remark


def test_a_right_limit_is_not_remarked() -> None:
    """An engine of second order with the truth as its limit has no remark, at whatever step."""
    for h in (1.0, 0.1, 1e-4):
        curves = [TRUE + 1e-4 * (k * h) ** 2 * np.cos(T) for k in (4, 2, 1)]
        limit = richardson(curves, (4, 2, 1), 2)
        found = judged_curve(
            "z", "m", curves[-1], TRUE, truth_error_bar=1e-14, tolerance=MILLIMETRE, scale=1.0, limit=limit, ladder=True
        )
        assert (found.verdict, found.remarks) == (Verdict.AGREES, ())


def test_an_extrapolation_that_is_off_by_a_few_of_its_bars_is_not_remarked() -> None:
    """Error bars of limits are estimates; nobody is told to have another limit by eight of them."""
    for bars, count in ((8, 0), (12, 1)):
        assert len(verdict_of(1e-4, Limit(TRUE + bars * 1e-6, 1e-6, 2.0)).remarks) == count


@pytest.mark.parametrize("declared", [1, 2, None])
def test_a_term_of_lower_order_is_no_other_limit(declared: int | None) -> None:
    """The errors 4 mm x² + 1.5 mm x vanish with the step x; no ladder of them shows another limit than the truth."""
    off = [4e-3 * x**2 + 1.5e-3 * x for x in (4.0, 2.0, 1.0)]
    found = verdict_of(off[-1], errors(*off, declared=declared), tolerance=1e-4)
    assert (found.verdict, found.limit) == (Verdict.DIFFERS, LimitResult.NOT_SHOWN)
    assert found.limit_error is not None
    assert found.limit_error_bar is not None
    assert found.limit_error <= found.limit_error_bar


def test_converges_if_the_limit_is_the_truth() -> None:
    """Beyond the tolerance, with the truth as the limit of small steps, the step alone is too coarse."""
    found = verdict_of(0.011, ladder(1))
    assert (found.verdict, found.limit) == (Verdict.CONVERGES, LimitResult.WITHIN)
    assert found.order == pytest.approx(1, abs=0.1)
    assert found.limit_error is not None
    assert found.limit_error_bar is not None
    assert found.limit_error <= found.limit_error_bar * (1 + 1e-9) < 0.0055


def test_round_off_decides_about_no_remark() -> None:
    """A limit off by round-off has ten times as much room; beyond it, whether scatter grew or fell says nothing."""
    for off, bar, shown, count in ((1e-12, 1e-15, True, 0), (1e-11, 1e-15, True, 1), (1e-10, 1e-12, False, 1)):
        found = verdict_of(0.0, Limit(TRUE + off, bar, math.nan, shown), bar=1e-15)
        assert (found.verdict, len(found.remarks)) == (Verdict.AGREES, count)


@pytest.mark.parametrize("error", [0.0, 1e-14, 1e-13, 1.0])
def test_a_tolerance_below_the_error_bar_of_the_truth_judges_nobody(error: float) -> None:
    """Where the truth is known to 3.8e-13 m, 1e-13 m is no tolerance: neither agreement nor difference counts."""
    for limit in (None, Limit(TRUE + error, 1e-16, 2.0)):
        found = verdict_of(error, limit, bar=3.8e-13, tolerance=1e-13)
        assert found.verdict is Verdict.NOT_JUDGED
        assert "truth's error bar 3.8e-13 m exceeds the tolerance 1e-13 m" in found.reason
    assert verdict_of(0.0, bar=3.8e-13, tolerance=4e-13).verdict is Verdict.AGREES


@pytest.mark.parametrize("bar", [0.9e-3, 2e-3, math.inf])
def test_a_reference_is_not_called_a_truth(bar: float) -> None:
    """Where a reference is not known well enough, its bar or its silence is told as that of a reference."""
    allowance, run = Allowance("z", "m", MILLIMETRE, 1.0), RunCurve(TRUE + 1.8e-3)
    told = judge_curve(allowance, run, TrueCurve(TRUE, bar)).reason
    assert "truth" in told
    by_steps = judge_curve(allowance, run, TrueCurve(TRUE, bar, source="reference"))
    assert by_steps.verdict is Verdict.NOT_JUDGED
    assert by_steps.reason == told.replace("truth", "reference")


@pytest.mark.parametrize("error", [0.2e-3, 1.8e-3])
def test_an_error_that_the_truth_cannot_place_is_not_judged(error: float) -> None:
    """Where the truth's own error bar reaches across the tolerance nobody is said to agree or to differ."""
    found = verdict_of(error, bar=0.9e-3)
    assert found.verdict is Verdict.NOT_JUDGED
    assert found.reason.endswith("m ± 9e-4 m, the truth's error bar, may be within 1e-3 m or beyond")
    assert verdict_of(0.05e-3, bar=0.9e-3).verdict is Verdict.AGREES
    assert verdict_of(1.95e-3, bar=0.9e-3).verdict is Verdict.DIFFERS


def test_a_difference_that_may_be_the_sampling_alone_is_not_judged() -> None:
    """An event that a run shows 7 ms off, but only between two times 50 ms apart, is no difference of 2 ms."""
    late = {"truth_error_bar": 1e-9, "tolerance": 2e-3, "scale": 1.0, "limit": None}
    times = np.array([0.2727])
    found = judged_curve("first_slip", "s", times + 7e-3, times, own_bar=25e-3, **late)
    assert found.verdict is Verdict.NOT_JUDGED
    assert "error 7e-3 s ± 0.025 s, known only between two times" in found.reason
    assert judged_curve("first_slip", "s", times + 7e-3, times, own_bar=1e-3, **late).verdict is Verdict.DIFFERS


def test_a_wide_bracket_excuses_no_more_than_the_samples_do() -> None:
    """An event that is given to within the whole run differs as if the samples told it, and agrees by luck alone."""
    late = {"truth_error_bar": 1e-9, "tolerance": 2e-3, "scale": 1.0, "limit": None, "own_bar": 2.0}
    times = np.array([0.2727])
    for off, verdict in ((0.3, Verdict.DIFFERS), (7e-3, Verdict.NOT_JUDGED), (1e-3, Verdict.AGREES)):
        found = judged_curve("first_slip", "s", times + off, times, sampled_bar=10e-3, **late)
        assert found.verdict is verdict
        assert ("by luck" in "".join(found.remarks)) == (verdict is Verdict.AGREES)


def test_a_limit_of_other_events_is_told_without_numbers() -> None:
    """Where the limit has not as many events as the truth there is no distance to tell."""
    found = judged_curve(
        "event_times", "s", np.ones(3), np.ones(2), truth_error_bar=9e-13, tolerance=2e-3, scale=1.0, ladder=True,
        limit=Limit(np.ones(3), 0.0, math.nan),
    )  # fmt: skip
    assert found.verdict is Verdict.DIFFERS
    assert found.reason.endswith("another limit: 3 events, the truth has 2")


@pytest.mark.parametrize("error", [0.0, 1e-3, 1.0])
def test_an_ill_posed_question_has_one_word_for_every_run(error: float) -> None:
    """Ill-posed belongs to the question: a run that happens to be near its truth has the same verdict as another."""
    found = judged_curve("z", "m", TRUE + error, TRUE, tolerance=1e-3, ill_posed="two bodies hit at once")
    assert found.verdict is Verdict.ILL_POSED
    assert "ill-posed" in found.reason


def test_verdicts_are_ordered_from_best_to_worst() -> None:
    """Summaries take the worst verdict by this order."""
    assert list(Verdict) == [
        "agrees", "unconfirmed", "incomplete", "converges", "ill-posed", "not-judged", "another-scene",
        "refused", "differs", "failed",
    ]  # fmt: skip


def test_a_limit_of_events_that_are_not_the_truths_says_so() -> None:
    """Where a ladder gives more events than there are, no number stands for how far the limit is off."""
    three = np.array([0.1, 0.2, 0.3])
    found = judged_curve(
        "event_times", "s", three, TRUE[:2], truth_error_bar=0.0, tolerance=1e-3, scale=1.0,
        limit=Limit(three, 9e-13, 2.0), ladder=True,
    )  # fmt: skip
    assert found.verdict == Verdict.DIFFERS
    assert found.reason.startswith("3 events, the truth has 2; ")
    assert "–" not in found.reason


@pytest.mark.parametrize(("magnitude", "remarks"), [(0.0, 1), (1.0, 0)])
def test_round_off_of_large_numbers_in_their_difference_is_not_remarked(magnitude: float, remarks: int) -> None:
    """A gap of 3e-16 m of a ball a metre from the origin is no other limit, though the gap itself is small."""
    gap = np.full(TRUE.shape, 3e-16)
    found = judged_curve(
        "gap", "m", gap, 0 * TRUE, truth_error_bar=1e-18, tolerance=1e-6, scale=1e-4,
        limit=Limit(gap, 0.0, float("nan")), ladder=True, magnitude=magnitude,
    )  # fmt: skip
    assert len(found.remarks) == remarks
