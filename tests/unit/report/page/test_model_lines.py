"""Lines for a reader's own model, from an answer that holds a tolerance."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from invented_answers import HELD, scene_answer

from proofroll.report.page import model_lines
from proofroll.studies.answer.answers import answer
from proofroll.studies.answer.question import AnswerQuestion
from proofroll.studies.judging.asked_tolerance import AskedTolerance

MUJOCO = "mujoco[formulation=joints,preset=tuned,dt=0.002]"


def test_a_command_and_a_test_ask_the_question_of_the_answer() -> None:
    """Both have scene, parameters, engine with all options, tolerance and length; the test is Python."""
    blocks = model_lines.of(scene_answer(HELD), HELD).blocks
    assert shlex.split(blocks["Check it"]) == [
        *("proofroll", "compare", "sphere_in_cylinder", "--engine", HELD.spec),
        *("--tolerance", "1e-4", "--set", "speed=3.0", "--until", "2.0"),
    ]
    test = blocks["Keep it, pytest"]
    compile(test, "test", "exec")
    for text in ('load_scene("sphere_in_cylinder", speed=3.0),', f'"{HELD.spec}",', "tolerance={'z': '0.0001 m'},"):
        assert text in test
    for text in ('because="1e-4 is close enough"', "until=2,", "every=0.02,"):
        assert text in test


def test_the_engines_own_lines_are_those_of_its_adapter() -> None:
    """MuJoCo's are MJCF with the step of the answer; an engine that is not here has a reason in their place."""
    there = model_lines.of(scene_answer(HELD), replace(HELD, engine="mujoco", spec=MUJOCO))
    assert 'timestep="0.002"' in there.blocks["In your model"]
    unknown = model_lines.of(scene_answer(HELD), HELD)
    assert "In your model" not in unknown.blocks
    assert "alpha" in unknown.note


@pytest.mark.nightly
def test_each_line_was_run(proofroll: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    """The command says yes, and the test passes, of the setting and the question that they were made from."""
    from proofroll.running.idle_workers import Workers
    from proofroll.running.runner import Runner
    from proofroll.running.store import Store
    from proofroll.testing import assert_agrees

    question = AnswerQuestion.of("pendulum", {"length": 0.7}, 0.5)
    runner = Runner(Store(tmp_path / "cases"), jobs=1, workers=Workers())
    asked = AskedTolerance.of(["1 mm"], question.loaded)
    (made,) = answer(question, [asked], ["mujoco[formulation=joints,preset=tuned]"], runner)
    assert made.taken is not None
    blocks = model_lines.of(made, made.taken).blocks
    _, *words = shlex.split(blocks["Check it"])
    code, out, _ = proofroll(*words, "--out", str(tmp_path))
    assert (code, out[:5]) == (0, "Yes: ")
    space: dict[str, Callable[..., None]] = {}
    exec(compile(blocks["Keep it, pytest"], "test", "exec"), space)
    space["test_pendulum"](assert_agrees)
