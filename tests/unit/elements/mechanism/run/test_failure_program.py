"""Programs that show what goes wrong with a mechanism."""

from __future__ import annotations

import dataclasses
import functools
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.program_text import FailedRun, imported_packages
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.studies.failure import Yardstick


@functools.cache
def true() -> Any:
    """The pendulum for 5 s."""
    return simulate(load_scene("pendulum"), until=5.0, every=0.1)


def written(engine: str, options: dict[str, Any]) -> str:
    """The program for a pendulum that lost its phase in 5 s."""
    scene, kind = load_scene("pendulum"), load_engine(engine)
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    settings, truth = resolve_settings(kind, options), true()
    part = kind.reproducer(scene, settings) if hasattr(kind, "reproducer") else None
    note = "" if part else "its equations are proofroll's"
    facts: dict[str, Any] = {"scene": "pendulum", "parameters": {}, "engine": engine, "version": "1"}
    facts |= {"settings": dataclasses.asdict(settings), "resolution": settings.resolution, "until": 5.0, "every": 0.1}
    case: dict[str, Any] = {"where": "a place", "boundary": "accurate", "silent": True}
    scale = Yardstick.of(scene, truth).scale
    failed = FailedRun(**facts, **case, failure="lost phase", truth=truth, scale=scale, allowed=0.01, note=note)
    return element.failure_program(failed, part)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("engine", "options", "needs"),
    [
        pytest.param(
            "mujoco",
            {"formulation": "joints", "preset": "default", "dt": 0.05},
            {"mujoco", "numpy"},
            marks=pytest.mark.drill,
        ),
        ("exudyn", {"formulation": "redundant", "preset": "default", "dt": 0.05}, {"exudyn", "numpy"}),
    ],
)
def test_a_program_shows_the_failure(tmp_path: Path, engine: str, options: dict[str, Any], needs: set[str]) -> None:
    """It runs with the engine alone and ends with 1."""
    text = written(engine, options)
    assert set(imported_packages(text)) == needs
    assert "proofroll" not in text
    program = tmp_path / "program.py"
    program.write_text(text, encoding="utf-8")
    ended = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (1, "")
    assert "lost phase: shown" in ended.stdout


@pytest.mark.drill
def test_equations_of_ours_ask_proofroll() -> None:
    """Where the equations that fail are this package's, the program runs them through it and says why."""
    text = written("projection", {"formulation": "dependent", "preset": "matched"})
    assert set(imported_packages(text)) == {"numpy", "proofroll"}
    assert "Why proofroll: its equations are proofroll's." in text


@pytest.mark.drill
def test_a_right_run_is_not_accused(tmp_path: Path) -> None:
    """With steps of a millisecond by RK4 the same program finds nothing."""
    program = tmp_path / "program.py"
    program.write_text(written("mujoco", {"formulation": "joints", "preset": "tuned"}), encoding="utf-8")
    ended = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.parametrize(
    ("scene", "engine", "options"),
    [
        ("bricard", "exudyn", {"formulation": "redundant", "preset": "matched"}),
        ("slider_crank", "exudyn", {"formulation": "redundant", "preset": "matched"}),
        ("oscillators", "exudyn", {"formulation": "tree", "preset": "matched"}),
    ],
)
def test_a_program_moves_as_the_adapter_does(scene: str, engine: str, options: dict[str, Any]) -> None:
    """Places, gain of energy and gaps are those of a run through proofroll, but for round-off."""
    loaded, kind, times = load_scene(scene), load_engine(engine), [0.0, 0.01, 0.02]
    text = kind.reproducer(loaded, resolve_settings(kind, options))
    assert "proofroll" not in text
    program: dict[str, Any] = {}
    exec(compile(text, "program", "exec"), program)
    places, energy, opened = map(np.array, zip(*program["run"](times), strict=True))
    run = simulate(loaded, engine, until=times[-1], every=times[1], **options)
    assert np.abs(places - run.positions.to_numpy()).max() < 1e-12
    gained = run.energy.to_numpy() - float(run.energy[0])
    assert np.abs(energy - energy[0] - gained).max() < 1e-12 * max(1.0, abs(float(run.energy[0])))
    assert abs(opened.max() - float(run.drift.max())) < 1e-12
