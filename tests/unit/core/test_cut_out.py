"""What is cut out of the package runs without it, and holds nothing that is not called."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from proofroll.core.arrays import cross
from proofroll.core.cut_out import CutOut
from proofroll.core.engine import whole_steps
from proofroll.core.integrators import RungeKutta4
from proofroll.core.stalling import StepWatch
from proofroll.elements.ball_on_surface.surfaces import Surface
from proofroll.files.scene_file import load_scene


def made(cut: CutOut, more: str = "") -> dict[str, Any]:
    """What the text defines."""
    found: dict[str, Any] = {}
    exec(compile(f"{cut.head}\n{cut.text}\n{more}", "cut", "exec"), found)
    return found


def test_it_runs_without_the_package() -> None:
    """A class comes with the functions and constants that its methods need, in an order that can be executed."""
    cut = CutOut([RungeKutta4], ["begin", "advance", "x"])
    run = made(cut)["RungeKutta4"](0.1)
    run.begin(0.0, np.ones(1), lambda x: -x, lambda _, x: x, np.ones(1))
    run.advance(1.0)
    assert run.x == pytest.approx(math.exp(-1), rel=1e-5)
    assert {"RungeKutta4", "classical_step", "whole_steps"} <= set(cut.names)
    assert "proofroll" not in cut.head + cut.text


def test_a_statement_stands_once_with_what_it_is() -> None:
    """Two names of one assignment do not make it twice, and a constant keeps its comment."""
    text = CutOut([cross], []).text
    assert text.count("_NEXT, _LAST = ") == 1
    assert "Cross products of two vectors" in text
    assert "# A step is tiny below this part of the largest;" in CutOut([StepWatch], ["took"]).text


def test_of_docstrings_the_first_line_is_kept() -> None:
    """A program is read beside a bug report: it has one line for each definition, and no blank pairs of lines."""
    text = CutOut([RungeKutta4], ["begin", "advance", "x"]).text
    assert "Moves a state in time" in text
    assert "Attributes:" not in text
    assert "Args:" not in text
    assert "\n\n\n" not in text


def test_methods_that_nothing_calls_are_left_out() -> None:
    """Of a wall the program has what it asks for, and not the rest."""
    wall: Surface = load_scene("sphere_in_cylinder").elements[0].surface
    cut = CutOut([type(wall)], ["triad"])
    again = made(cut, f"WALL = {cut.literal(wall)}")["WALL"]
    assert again.triad(0.1, 0.2, 0.3) == wall.triad(0.1, 0.2, 0.3)
    assert not hasattr(again, "normal_gradient")


def test_an_error_of_the_package_is_one_that_programs_know() -> None:
    """A refusal of the package is a RuntimeError in a program."""
    with pytest.raises(RuntimeError, match="no whole number"):
        made(CutOut([whole_steps], []))["whole_steps"](0.0, 1.0, 0.3)


def test_values_are_written_with_every_digit() -> None:
    """Arrays, infinities and objects of other classes come back as they are; of an object what is asked for alone."""
    cut = CutOut([whole_steps], ["size", "limit"])
    value = SimpleNamespace(size=np.array([0.1, 1 / 3]), limit=(math.inf, None), unused=object())
    again = made(cut, f"VALUE = {cut.literal(value)}")["VALUE"]
    assert again.size.tolist() == [0.1, 1 / 3]
    assert again.limit == (math.inf, None)
    assert not hasattr(again, "unused")


def test_two_definitions_of_one_name_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program could hold but one of them."""
    for name in ("cut_one", "cut_two"):
        (tmp_path / f"{name}.py").write_text("def same():\n    return 1\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    import cut_one  # type: ignore[import-not-found]  # written above
    import cut_two  # type: ignore[import-not-found]

    with pytest.raises(ValueError, match="one name: same"):
        CutOut([cut_one.same, cut_two.same], [])
    for name in ("cut_one", "cut_two"):
        del sys.modules[name]
