"""What ``proofroll run`` says of one run."""

from __future__ import annotations

import dataclasses
import io
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

from proofroll.core.events import Event
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import write
from proofroll.report.run.run import run_content, run_lines, value_text
from proofroll.running.case import Result, Status


def _case(scene: str, **parameters: float) -> Any:
    engine = SimpleNamespace(name="e", settings={}, precision="double")
    return SimpleNamespace(scene=scene, parameters=parameters, engine=engine, until=1.0, every=0.1, asks=())


@pytest.mark.parametrize(("scene", "name", "value"), [("inclined_plane", "tilt", 0.2), ("pendulum", "mass", 2.0)])
def test_all_numbers_of_the_scene_are_told(scene: str, name: str, value: float, tmp_path: Path) -> None:
    """Parameters that nobody set stand in the document beside those that were set, for every kind of scene."""
    content = run_content(_case(scene, **{name: value}), Result(Status.MISSING, "not installed"), tmp_path / "run.npz")
    assert content.parameters == dict(load_scene(scene, **{name: value}).parameters)
    assert content.parameters[name] == value
    assert len(content.parameters) > 3
    assert (content.until, content.every) == (1.0, 0.1)


def test_a_variable_without_value_says_why(tmp_path: Path) -> None:
    """It stands below the table with its reason, once for all such variables, and no line has a nan or is too long."""
    units = {"units": "N", "long_name": "a force"}
    nothing = ("time", np.full(2, np.nan), units | {"absent": "not determined by the equations"})
    held = {f"force.a_joint_{number}.z": nothing for number in range(9)}
    dataset = xr.Dataset(held | {"x": ("time", np.ones(2), units)}, {"time": ("time", [0.0, 1.0], {"units": "s"})})
    write(dataset, tmp_path / "run.npz")
    case = _case("pendulum")
    result = Result(Status.DONE, "reached 1 s", trajectory="run.npz", wall_seconds=0.1)

    content = run_content(case, result, tmp_path / "run.npz")
    shown = Console(file=io.StringIO(), width=80)
    for line in run_lines(content):
        shown.print(line)
    text = shown.file.getvalue()

    assert content.absent == dict.fromkeys(held, "not determined by the equations")
    assert np.isnan(content.final["force.a_joint_0.z"])
    assert "nan" not in text
    assert text.count("not determined by the equations") == 1
    assert all(name in text for name in held)
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize(
    ("seconds", "said"), [(0.25, "1 s of wall time, after 0.25 s before the first step"), (None, "1 s of wall time")]
)
def test_what_comes_before_the_first_step_is_told(seconds: float | None, said: str, tmp_path: Path) -> None:
    """The seconds of building, with what an engine compiles, stand beside those of the run."""
    result = Result(Status.DONE, "reached 1 s", wall_seconds=1.0, build_seconds=seconds)
    content = run_content(_case("pendulum"), result, tmp_path / "none.npz")
    assert content.build_seconds == seconds
    lines = run_lines(dataclasses.replace(content, final={"time": 1.0}, units={"time": "s"}))
    assert said in [str(line) for line in lines]


def test_an_event_says_to_what_it_happens(tmp_path: Path) -> None:
    """Of several contacts or joints the name stands with the kind; an event without a name has none."""
    result = Result(Status.DONE, "reached 1 s", wall_seconds=1.0)
    content = run_content(_case("pendulum"), result, tmp_path / "none.npz")
    events = [Event("lift_off", 0.5, 0.4, 0.6, "left"), Event("slip", 0.7, 0.7, 0.7)]
    lines = run_lines(dataclasses.replace(content, final={"time": 1.0}, units={"time": "s"}, events=events))
    (said,) = [str(line) for line in lines if str(line).startswith("events: ")]
    assert said.startswith("events: lift-off of left at 0.5 ± 0.1 s, slip at 0.7")


@pytest.mark.parametrize(
    ("value", "bar", "size", "text"),
    [
        (1.23456789012345, None, 2.0, "1.23456789012"),
        (1.23456789012345, 2e-5, 2.0, "1.2346"),
        (1234.5678, 0.3, 2000.0, "1235"),
        (-6.6e-16, None, 1.0, "0"),
        (-6.6e-16, None, 1e-3, "-6.6e-16"),
        (-1.7e-15, 7.7e-14, 0.0, "0"),
        (float("nan"), 1e-9, 1.0, "–"),
    ],
)
def test_digits_end_at_the_error_bar(value: float, bar: float | None, size: float, text: str) -> None:
    """No digit below the bar is written, round-off of the largest value of a dimension is 0, and no value a dash."""
    assert value_text(value, bar, size) == text


def test_positions_come_first_and_forces_on_request(tmp_path: Path) -> None:
    """Positions stand before velocities, energies and forces; many forces are counted only, unless asked for."""
    result = Result(Status.DONE, "reached 1 s", wall_seconds=1.0)
    units = {"time": "s", "E": "J", "v": "m/s", "x": "m", "q": "rad"} | {f"force.{axis}": "N" for axis in "abcd"}
    final = dict.fromkeys(units, 1.0)
    content = run_content(_case("pendulum"), result, tmp_path / "none.npz")
    content = dataclasses.replace(content, final=final, units=units)
    texts = []
    for forces in (False, True):
        shown = Console(file=io.StringIO(), width=80)
        for line in run_lines(content, forces=forces):
            shown.print(line)
        texts.append(shown.file.getvalue())
    names = [line.split()[0] for line in texts[0].splitlines()[3:8]]
    assert names == ["time", "x", "q", "v", "E"]
    assert "force.a" not in texts[0]
    assert "4 forces and moments are not shown; --forces shows them" in texts[0]
    assert "force.a" in texts[1]


@pytest.mark.parametrize("tracked", [False, True])
def test_a_body_without_tracked_points_is_shown_where_it_is(tracked: bool, tmp_path: Path) -> None:
    """The places of bodies stand among the values, with their error bar, where a scene tracks no point."""
    metres = {"units": "m", "long_name": "places", "error_bar": 1e-9}
    variables: dict[str, Any] = {"p_WB": (("time", "body", "xyz"), np.array([[[0.0, 0, 0]], [[1.0, 2, 3]]]), metres)}
    variables |= {"middle.x": ("time", np.ones(2), metres)} if tracked else {}
    coordinates = {"time": ("time", [0.0, 1.0], {"units": "s"}), "body": ["box"]}
    write(xr.Dataset(variables, coordinates), tmp_path / "run.npz")
    result = Result(Status.DONE, "reached 1 s", trajectory="run.npz", wall_seconds=0.1)
    content = run_content(_case("pendulum"), result, tmp_path / "run.npz")
    places = {name: value for name, value in content.final.items() if name.startswith("box.")}
    assert places == ({} if tracked else {"box.x": 1.0, "box.y": 2.0, "box.z": 3.0})
    assert tracked or (content.error_bars or {})["box.z"] == 1e-9
