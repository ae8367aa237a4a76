"""The first screen: engines to take by scene, what was found of each, and the tolerance that a reader chooses."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browsing import UNDRAWN, Visit
from invented_answers import FINER, HELD, THROUGH, reported, scene_answer

from proofroll.report.page.first_screen import (
    FirstScreen,
    ReportedAnswer,
    answers_sentence,
    bar,
    figure_of,
    how,
    place_words,
)
from proofroll.studies.answer.setting_search import State

Visiting = Callable[..., AbstractContextManager[Visit]]


@pytest.fixture
def screen(everything: Any) -> FirstScreen:
    """The first screen of the page."""
    return FirstScreen(everything.content)


def test_a_chip_for_each_engine_and_one_for_a_part_of_proofroll(screen: FirstScreen) -> None:
    """Scenes are listed with the engine that wins them; a part of proofroll makes another chip; none is none."""
    other = ReportedAnswer(scene_answer(THROUGH, scene="four_bar"), "four_bar", "loops", "")
    whole = FirstScreen(replace(screen.content, answers=[*screen.content.answers, other]))
    assert [(chip.engine, chip.hollow, chip.words) for chip in whole.chips("1e-4")] == [
        ("alpha", False, "for sphere in cylinder (invented)"),
        ("beta", True, "for four bar"),
    ]
    assert [chip.title for chip in whole.chips("1e-6")] == ["None confirmed"]


def test_counts_are_of_engines(screen: FirstScreen) -> None:
    """Pairs of an engine and a scene are counted by what was found; what is not confirmed wins no scene."""
    counts = screen.counts("1e-4")
    assert counts.states == {"holds": 2, "unsure": 0, "finer": 1, "elsewhere": 0, "cannot": 0, "open": 0}
    assert (counts.scenes, counts.alone, counts.aided) == (1, 1, 0)
    through = ReportedAnswer(scene_answer(THROUGH, HELD), "x", "loops", "")
    unsure = ReportedAnswer(scene_answer(replace(HELD, state=State.UNCONFIRMED)), "y", "loops", "")
    others = FirstScreen(replace(screen.content, answers=[through, unsure]))
    assert others.counts("1e-4")[1:] == (2, 0, 1, 0)
    faster = ReportedAnswer(scene_answer(HELD, replace(THROUGH, state=State.UNCONFIRMED)), "z", "loops", "")
    assert FirstScreen(replace(screen.content, answers=[faster])).counts("1e-4")[1:] == (1, 1, 0, 1)
    assert [chip.title for chip in others.chips("1e-4")] == ["beta through a part of proofroll", "None confirmed"]
    assert answers_sentence([through, unsure]) == (
        "The fastest confirmed to hold 1e-4 of the path: beta for sphere in cylinder (x); "
        "none for sphere in cylinder (y)."
    )


def test_a_number_has_its_measure() -> None:
    """Each engine has speed, setting, step and error of what is allowed; or its state and what it needs at best."""
    assert figure_of(HELD) == "50×"
    assert how(HELD) == "fine, best, dt 1e-3 s; 2.5e-5 of 1e-4"
    assert how(THROUGH) == "only, as installed, dt 1e-3 s; 2.5e-5 of 1e-4; through proofroll's integrator"
    assert figure_of(FINER) == "· finer not run"
    assert "at best it needs dt 8e-5 s, 21 s of computing" in how(FINER)
    assert 0 < bar(HELD) < bar(THROUGH) <= 100
    assert bar(FINER) == 0
    assert (
        answers_sentence(reported())
        == "The fastest confirmed to hold 1e-4 of the path: alpha for sphere in cylinder (invented)."
    )
    assert place_words(scene_answer(HELD)) == "over 2 s, speed 3"
    assert answers_sentence([]) == "Nothing was run that could be advised."


@pytest.mark.nightly
def test_the_tolerance_that_is_chosen_is_shown_and_in_the_address(report_page: Path, visit: Visiting) -> None:
    """One part of the screen is seen, that of the tolerance; the address and the back button have it."""
    shown = "[...document.querySelectorAll('[data-tolerance]')].filter((part) => part.checkVisibility())"
    with visit(report_page, before=UNDRAWN) as seen:
        assert seen.page.evaluate(f"{shown}.map((part) => part.dataset.tolerance)") == ["1e-4"]
        seen.page.locator("#tolerance").select_option("1e-6")
        seen.wait("location.hash === '#tol=1e-6'")
        seen.wait(f"{shown}.length === 1 && {shown}[0].dataset.tolerance === '1e-6'")
        seen.page.go_back()
        seen.wait(f"{shown}[0].dataset.tolerance === '1e-4'")
        assert seen.messages == []
    with visit(report_page, "#tol=1e-6", before=UNDRAWN) as again:
        again.wait(f"{shown}[0].dataset.tolerance === '1e-6'")


@pytest.mark.drill
def test_the_first_screen_is_there_without_a_program(report_page: Path, screen: FirstScreen, visit: Visiting) -> None:
    """Chips and cards at the first tolerance are written; what needs a script is not shown."""
    with visit(report_page, java_script_enabled=False) as seen:
        assert not seen.page.locator(".ask").is_visible()
        text = " ".join(seen.page.locator("main").inner_text().split())
    for chip in screen.chips("1e-4"):
        assert f"{chip.title} {chip.words}" in text
    for item in (HELD, THROUGH, FINER):
        assert how(item) in text
        assert figure_of(item) in text


@pytest.mark.nightly_of("900", "1400")
@pytest.mark.drill
@pytest.mark.parametrize("width", [400, 900, 1400])
def test_nothing_moves_while_the_page_loads(report_page: Path, visit: Visiting, width: int) -> None:
    """The first screen keeps its place while scripts start, and nothing scrolls sideways.

    What scripts move they move at each load; a loaded machine may paint a page of which a part is read, at one of them.
    """
    before = """window.shifts = 0;
    const sum = (list) => list.getEntries().forEach((entry) => { window.shifts += entry.value; });
    new PerformanceObserver(sum).observe({ type: "layout-shift", buffered: true });"""
    shifts: list[float] = []
    while len(shifts) < 3 and min(shifts, default=1.0) >= 1e-3:
        with visit(report_page, before=before, viewport={"width": width, "height": 800}) as seen:
            seen.page.wait_for_timeout(500)
            shifts.append(seen.page.evaluate("window.shifts"))
            assert seen.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert min(shifts) < 1e-3


@pytest.mark.nightly
def test_lines_for_a_model_are_copied(report_page: Path, visit: Visiting) -> None:
    """A card's fold has a command and a test of the engine to take, each with a button that copies it."""
    copied = "window.copied = []; navigator.clipboard.writeText = async (text) => { copied.push(text); };"
    with visit(report_page, before=UNDRAWN + copied) as seen:
        seen.page.locator(".own summary").first.click()
        seen.page.get_by_role("button", name="copy: Check it").first.click()
        seen.wait("copied.length === 1")
        assert seen.page.evaluate("copied[0]").startswith("proofroll compare sphere_in_cylinder --engine ")
