"""Readers of robot files that belong to engines."""

from __future__ import annotations

import pytest

from proofroll.core.plugins import load_engine
from proofroll.robots.files.reading import load_reader


@pytest.mark.parametrize("engine", ["exudyn", "mujoco", "pinocchio"])
def test_a_reader_has_the_title_of_its_engine(engine: str) -> None:
    """A reader's title, by which a command does without the engine, is the one that the engine itself has."""
    assert load_reader(engine).title == load_engine(engine).title
