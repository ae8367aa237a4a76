"""Sentences of answers: one from one record, with its measure, its doubts and what was not run."""

from __future__ import annotations

from dataclasses import replace

import pytest
from invented_answers import BOUND, COARSER, FINER, HELD, THROUGH, scene_answer

from proofroll.report.answer.sentences import (
    answer_lines,
    command_of,
    installed_words,
    measure,
    scope_sentence,
    sentence,
    step_sentence,
    taken_sentence,
)
from proofroll.studies.answer.records import AllowedError, SettingTried, StepAnswer, StepTried
from proofroll.studies.answer.setting_search import State
from proofroll.studies.study_store import Measured

METRES = AllowedError("positions", "m", 1e-3, 2.0, 1e-12, relative=False)
OWN = StepAnswer(
    scene="pendulum", parameters={}, until=5.0, every=0.02, tolerance="1 mm", bounds=[METRES], unjudged=[], changes=[],
    beyond="", open="",
    spec="alpha[dt=0.002]", resolution="dt", step=2e-3, holds=True, luck="", bound=METRES, error=1.2e-4, status="done",
    message="", reached=5.0, held_until=5.0, seconds_per_second=1 / 160, advised=replace(HELD, step=2e-3), spent=1.0,
    measured=Measured("2026", {}, {}, ""),
)  # fmt: skip


def test_what_holds_is_told_with_speed_error_and_time() -> None:
    """Setting, step, speed, error of what is allowed, quantity and time; a part of proofroll is named."""
    assert sentence(HELD, 2.0) == "alpha fine, best, dt 1e-3 s: 50× real time, 2.5e-5 of 1e-4 in z over 2 s."
    assert "(through proofroll's integrator): 100× real time" in sentence(THROUGH, 2.0)
    unsure = replace(HELD, state=State.UNCONFIRMED, why="the next step takes 9 s")
    assert sentence(unsure, 2.0).endswith("; not confirmed: the next step takes 9 s.")


def test_settings_are_told_in_two_words() -> None:
    """Beside the best settings stand those as installed: their cheapest step that holds, or how far off they are."""
    runs = [StepTried(2e-3, "done", 4.0, 2.0, 0.5, 1e-2), StepTried(5e-4, "done", 0.8, 2.0, 2.0, 4e-2)]
    tried = SettingTried("alpha[formulation=rough,preset=default]", State.DEARER, "", runs, "dt")
    assert installed_words(replace(HELD, settings=[tried])) == "as installed: rough, dt 5e-4 s: 25×, not confirmed"
    assert sentence(replace(HELD, settings=[tried]), 2.0).endswith(
        "; as installed: rough, dt 5e-4 s: 25×, not confirmed."
    )
    sure = replace(tried, state=State.HOLDS)
    assert installed_words(replace(HELD, settings=[sure])) == "as installed: rough, dt 5e-4 s: 25×"
    lucky = replace(tried, steps=[*runs, StepTried(2.5e-4, "done", 1.1, 2.0, 1.0, 8e-2)])
    assert installed_words(replace(HELD, settings=[lucky])) == (
        "as installed: dearer (rough, dt 2.5e-4 s is off by 1.1 times what is allowed)"
    )
    off = replace(tried, steps=runs[:1])
    assert installed_words(replace(HELD, settings=[off])) == (
        "as installed: dearer (rough, dt 2e-3 s is off by 4 times what is allowed)"
    )
    finer = installed_words(replace(HELD, settings=[replace(off, state=State.FINER)]))
    assert finer == "as installed: rough, dt 2e-3 s is off by 4 times what is allowed"
    refused = replace(tried, state=State.REFUSED, why="it cannot", steps=[])
    assert installed_words(replace(HELD, settings=[refused])) == "as installed: refused, it cannot"
    assert installed_words(replace(HELD, preset="default", settings=[tried])) == ""
    assert installed_words(replace(FINER, settings=[tried])) == ""


def test_what_was_not_run_is_no_verdict() -> None:
    """Finer steps than affordable are told with the error that was seen and the step that is needed at best."""
    assert sentence(FINER, 2.0) == (
        "gamma, dt 1e-3 s: finer not run; off by 7e-4 of 1e-4; at best it needs dt 8e-5 s, 21 s of computing; "
        "it holds until 0.5 s."
    )


def test_an_answer_begins_with_what_to_take() -> None:
    """Then what does without a part of proofroll, the others, twice the step, and what was judged."""
    lines = list(answer_lines(scene_answer(THROUGH, HELD, FINER)))
    assert lines[0].startswith("Take beta only, as installed, dt 1e-3 s (through proofroll's integrator): 100× real")
    assert lines[1].startswith("Without a part of proofroll: alpha fine, best, dt 1e-3 s: 50×")
    assert [line[0] for line in lines[2:]] == ["·", "N", "J"]
    assert lines[3] == "Not good enough: twice the step is off by 4 times what is allowed."
    assert lines[4] == "Judged: z, every 0.02 s over 2 s. Not judged: attitude."
    pressed = replace(scene_answer(HELD), bounds=[replace(scene_answer(HELD).bounds[0], quantity="N", unit="N")])
    assert scope_sentence(pressed) == ("Judged: N, every 0.02 s over 2 s, forces from 0.02 s on. Not judged: attitude.")
    assert scope_sentence(replace(pressed, changes=[0.1, 0.5, 0.50000001])) == (
        "Judged: N, every 0.02 s over 2 s, forces from 0.02 s on, judged 0.02 s or more and claimed 0.04 s or more "
        "from a jump (at 0.1 s and 0.5 s). Not judged: attitude."
    )
    many = replace(pressed, changes=[0.1, 0.2, 0.3, 0.4, 0.5])
    assert "from a jump (at 5 times from 0.1 s to 0.5 s)" in scope_sentence(many)
    assert taken_sentence(scene_answer(FINER)) == "No engine is shown to hold 1e-4 of the path over 2 s."
    blurred = replace(scene_answer(), open="the truth itself is known to 1e-3 m of z only")
    assert taken_sentence(blurred) == "Nothing can be advised for 1e-4: the truth itself is known to 1e-3 m of z only."


def test_what_is_not_confirmed_is_not_advised() -> None:
    """Nothing is to be taken where nothing is confirmed; what may be faster than the advised one is named."""
    unsure = replace(THROUGH, state=State.UNCONFIRMED, why="the next step takes 9 s")
    told = taken_sentence(scene_answer(unsure, FINER))
    assert told.startswith("No engine is confirmed to hold 1e-4 of the path over 2 s; the fastest that may: beta only,")
    assert told.endswith("; not confirmed: the next step takes 9 s.")
    both = taken_sentence(scene_answer(HELD, unsure))
    assert both == f"Take {sentence(HELD, 2.0)} beta only may be 2 times faster, not confirmed."
    slower = replace(unsure, seconds_per_second=1.0)
    assert taken_sentence(scene_answer(HELD, slower)) == f"Take {sentence(HELD, 2.0)}"


def test_a_persons_step_is_good_enough_or_not() -> None:
    """Yes with twice the step, or a coarser one that does; no with the time that it holds, luck, and one that does."""
    assert step_sentence(OWN) == (
        "Yes: 0.12 mm of 1 mm over 5 s (dt 2e-3 s, 160× real time); twice the step does not do."
    )
    for tried, words in (
        (replace(COARSER, of_allowed=0.5), "is within it, but not confirmed"),
        (replace(COARSER, status="timeout", of_allowed=None), "takes too long"),
        (None, "was not run"),
    ):
        unsure = replace(OWN, advised=replace(OWN.advised, coarser=tried))
        assert step_sentence(unsure).endswith(f"; twice the step {words}.")
    coarser = replace(OWN, advised=replace(HELD, step=8e-3, seconds_per_second=1 / 640))
    assert step_sentence(coarser).endswith("; dt 8e-3 s would do, 4 times faster.")
    no_faster = replace(OWN, advised=replace(HELD, step=8e-3, seconds_per_second=1 / 170))
    assert step_sentence(no_faster).endswith("; dt 8e-3 s would do.")
    would = replace(HELD, bound=METRES, error=7.8e-4)
    no = replace(OWN, holds=False, error=1.7e-3, held_until=1.0, advised=would)
    assert step_sentence(no) == (
        "No: 1.7 mm of 1 mm over 5 s; it holds until 1 s; dt 1e-3 s would do (0.78 mm), 50× real time."
    )
    assert step_sentence(replace(no, held_until=0.0)).startswith("No: 1.7 mm of 1 mm over 5 s; dt 1e-3 s would do")
    unsure = replace(OWN.advised, state=State.UNCONFIRMED, why="the next step takes 9 s")
    perhaps = replace(OWN, holds=False, advised=unsure)
    assert perhaps.undecided
    assert not no.undecided
    assert step_sentence(perhaps) == (
        "Perhaps: 0.12 mm of 1 mm over 5 s (dt 2e-3 s, 160× real time); not confirmed: the next step takes 9 s."
    )
    lucky = replace(no, error=9e-4, luck="dt 1.6e-3 s is off by 2 times what is allowed")
    assert step_sentence(lucky).startswith("No: 0.9 mm of 1 mm over 5 s is luck: dt 1.6e-3 s is off by 2 times")
    lost = replace(no, status="diverged", message="not finite at 1.35 s", error=None, bound=None)
    assert step_sentence(lost).startswith("No: not finite at 1.35 s, it holds until 1 s; dt 1e-3 s would do")


def test_a_command_has_all_that_was_given() -> None:
    """Scene, engine with its step, tolerance, parameters and length."""
    assert command_of(scene_answer(HELD), HELD) == (
        "proofroll compare sphere_in_cylinder --engine 'alpha[formulation=fine,dt=0.001]' --tolerance 1e-4 "
        "--set speed=3.0 --until 2.0"
    )


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [(1.2e-4, "m", "0.12 mm"), (3e-8, "m", "30 nm"), (0.5, "m", "0.5 m"), (1e-3, "rad", "1e-3 rad"), (2.0, "1", "2")],
)
def test_a_length_has_a_prefix(value: float, unit: str, words: str) -> None:
    """Lengths below a centimetre are in mm, µm or nm; other quantities in their unit."""
    assert measure(value, unit) == words
    assert BOUND.relative
    assert COARSER.of_allowed == 4.0
