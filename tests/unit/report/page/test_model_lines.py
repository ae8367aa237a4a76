"""Lines for a reader's own model, from the cell of a matrix that holds a tolerance."""

from __future__ import annotations

import shlex
from dataclasses import replace

from table_lines import line

from proofroll.report.page import model_lines
from proofroll.report.page.choice_cell import ChoiceCell
from proofroll.report.page.choice_matrix import ChoiceStudy, choice_matrix

REAL = line(
    scene="four_bar", engine="mujoco", formulation="joints", preset="tuned", setting="tuned", step=0.05, error=1e-9
)


def cell(**changes: object) -> ChoiceCell:
    """Cell of one run."""
    matrix = choice_matrix([replace(REAL, until=0.5, place="", **changes)], {REAL.study: ChoiceStudy("A scene", "s")})
    return matrix.standing(matrix.engines[0], matrix.columns[0], 1e-4, False)


def test_a_command_and_a_test_have_the_run_with_its_step_and_its_length() -> None:
    """Both name scene, engine with all options, and until; samples lie on steps; the test has tolerance and date."""
    blocks = model_lines.of(cell(), 1e-4, "2026-11-28").blocks
    spec = "mujoco[formulation=joints,preset=tuned,dt=0.05]"
    assert shlex.split(blocks["Check it"])[2:] == [
        *("four_bar", "--engine", spec),
        *("--until", "0.5", "--every", "0.05"),
    ]
    test = blocks["Keep it, pytest"]
    compile(test, "test", "exec")
    for text in ('"four_bar",', f'"{spec}",', 'tolerance="0.01 %"', 'because="report of 2026-11-28"', "until=0.5"):
        assert text in test


def test_changed_parameters_are_in_the_command_and_in_the_test() -> None:
    """A case that is not the scene's own is asked for by its parameters."""
    cell_there = cell()
    assert cell_there.run is not None
    there = cell_there._replace(run=replace(cell_there.run, place="speed=4, mass=0.5"))
    blocks = model_lines.of(there, 1e-5, "2026-11-28").blocks
    assert shlex.split(blocks["Check it"])[-4:] == ["--set", "speed=4", "--set", "mass=0.5"]
    assert 'load_scene("four_bar", speed=4, mass=0.5),' in blocks["Keep it, pytest"]
    compile(blocks["Keep it, pytest"], "test", "exec")


def test_the_engines_own_lines_are_those_of_its_adapter() -> None:
    """MuJoCo's are MJCF with the step of the run; an engine that is not here has a reason in their place."""
    assert 'timestep="0.05"' in model_lines.of(cell(), 1e-4, "").blocks["In your model"]
    unknown = model_lines.of(cell(engine="alpha"), 1e-4, "")
    assert "In your model" not in unknown.blocks
    assert "alpha" in unknown.note
