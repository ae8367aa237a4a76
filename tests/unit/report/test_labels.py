"""Labels of engines and settings for readers."""

from __future__ import annotations

import pytest

from proofroll.report.labels import engine_title, engine_words


@pytest.mark.parametrize(
    ("code", "title"),
    [
        ("mujoco", "MuJoCo"),
        ("exudyn", "Exudyn"),
        ("pinocchio", "Pinocchio"),
        ("projection", "projection solver"),
        ("mujoco@3.8.1", "MuJoCo@3.8.1"),
        ("mujoco[dt=1e-3]", "MuJoCo[dt=1e-3]"),
        ("mujoco@a[dt=1e-3]", "MuJoCo@a[dt=1e-3]"),
        ("no_such_engine", "no_such_engine"),
    ],
)
def test_a_reader_sees_the_makers_spelling(code: str, title: str) -> None:
    """The name is that of the engine's makers; place and options stay, and what is not installed keeps its code."""
    assert engine_title(code) == title


@pytest.mark.parametrize(
    ("engine", "formulation", "words"),
    [
        ("mujoco", "joints", "MuJoCo joints"),
        ("reduced", "equations", "reduced equations"),
        ("mujoco", None, "MuJoCo"),
        ("mujoco", "", "MuJoCo"),
    ],
)
def test_no_word_is_said_twice(engine: str, formulation: str | None, words: str) -> None:
    """A formulation that the engine's name ends with is not repeated."""
    assert engine_words(engine, formulation) == words
