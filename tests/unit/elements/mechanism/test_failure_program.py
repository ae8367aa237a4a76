"""Programs that show what goes wrong with a mechanism."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from proofroll.core.errors import Refused
from proofroll.core.failed_run import FailedRun, imported
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.studies.failure import Yardstick


def written(engine: str, options: dict[str, Any]) -> str:
    """The program for a pendulum that lost its phase in 5 s."""
    scene, kind = load_scene("pendulum"), load_engine(engine)
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    settings, truth = resolve_settings(kind, options), simulate(scene, until=5.0, every=0.1)
    try:
        part, note = kind.reproducer(scene, settings), ""
    except Refused as error:
        part, note = None, str(error)
    facts: dict[str, Any] = {"scene": "pendulum", "parameters": {}, "engine": engine, "version": "1"}
    facts |= {"settings": dataclasses.asdict(settings), "resolution": "dt", "until": 5.0, "every": 0.1}
    case: dict[str, Any] = {"where": "a place", "boundary": "accurate", "silent": True}
    scale = Yardstick.of(scene, truth).scale
    failed = FailedRun(**facts, **case, failure="lost phase", truth=truth, scale=scale, allowed=0.01, note=note)
    return element.failure_program(failed, part)


@pytest.mark.parametrize(
    ("engine", "options", "needs"),
    [
        ("mujoco", {"formulation": "joints", "preset": "default", "dt": 0.05}, {"mujoco", "numpy", "sys"}),
        ("pinocchio", {"formulation": "null_space", "preset": "default", "dt": 0.1}, {"numpy", "proofroll", "sys"}),
    ],
)
def test_a_program_shows_the_failure(tmp_path: Path, engine: str, options: dict[str, Any], needs: set[str]) -> None:
    """It runs with the engine alone, or says why it asks proofroll, and ends with 1; at a small step with 0."""
    text = written(engine, options)
    assert set(imported(text)) == needs
    assert ("Why proofroll" in text) == ("proofroll" in needs)
    program = tmp_path / "program.py"
    program.write_text(text, encoding="utf-8")
    ended = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (1, "")
    assert "lost phase: shown" in ended.stdout


def test_a_right_run_is_not_accused(tmp_path: Path) -> None:
    """With steps of a millisecond by RK4 the same program finds nothing."""
    program = tmp_path / "program.py"
    program.write_text(written("mujoco", {"formulation": "joints", "preset": "tuned"}), encoding="utf-8")
    ended = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
