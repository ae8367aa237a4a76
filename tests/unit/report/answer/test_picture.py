"""Picture of an answer: every run of the search by cost and error."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from invented_answers import FINER, HELD, scene_answer

from proofroll.report.answer.picture import lines_of, svg
from proofroll.report.styles import engine_colours
from proofroll.studies.answer.records import SettingTried, StepTried
from proofroll.studies.answer.setting_search import State

STEPS = [
    StepTried(4e-3, "diverged", None, 0.5, 0.1, 1e-3, "it fell"),
    StepTried(2e-3, "done", 4.0, 2.0, 0.5, 1e-2),
    StepTried(1e-3, "done", 0.25, 2.0, 2.0, 2e-2),
]
TRIED = SettingTried("alpha[formulation=fine,preset=matched]", State.HOLDS, "", STEPS)
MADE = scene_answer(replace(HELD, settings=[TRIED]), FINER)


def places(picture: str) -> list[tuple[float, float]]:
    """Places of the runs in a picture [px]."""
    return [(float(x), float(y)) for x, y in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', picture)]


def test_each_run_that_reached_its_end_is_a_point() -> None:
    """A finer step is to the right and below; what is allowed is a line between a run that holds and one that fails."""
    (line,) = lines_of(MADE)
    assert (line.engine, line.words) == ("alpha", "alpha fine, matched")
    (coarse_x, coarse_y), (fine_x, fine_y) = places(svg(MADE))
    assert coarse_x < fine_x
    allowed = float(re.search(r'd="M58 ([\d.]+)H', svg(MADE))[1])  # type: ignore[index]  # the line is there
    assert coarse_y < allowed < fine_y
    assert "0.25 of what is allowed, 50× real time" in svg(MADE)


def test_a_file_of_its_own_is_svg_with_the_colours_of_the_page() -> None:
    """It can be read as XML, and names the colour of the engine; a page has its own."""
    alone = svg(MADE, alone=True)
    assert ElementTree.fromstring(alone).tag == "{http://www.w3.org/2000/svg}svg"
    assert '[data-dot="alpha"]{--c:#' in alone
    assert "<style>" not in svg(MADE)


def test_nothing_is_drawn_of_runs_that_failed() -> None:
    """An answer without a run that reached its end has no picture."""
    failed = replace(TRIED, steps=STEPS[:1])
    assert svg(scene_answer(replace(HELD, settings=[failed]))) == ""


@pytest.mark.parametrize("others", [[], ["alpha"], ["alpha", "mujoco@3.8.1"]])
def test_an_engine_has_one_colour_in_every_report(others: list[str]) -> None:
    """The colours of installed engines differ, and do not hang on the engines that a report has."""
    own = engine_colours()
    assert engine_colours(others).items() >= own.items()
    assert len({own[name] for name in ("exudyn", "mujoco", "pinocchio", "projection", "reduced")}) == 5
