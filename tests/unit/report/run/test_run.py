"""What ``proofroll run`` says of one run."""

from __future__ import annotations

import dataclasses
import io
import itertools
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from proofroll.core.events import Event
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import write
from proofroll.report.run.last_values import short_names, value_text
from proofroll.report.run.run import event_csv, run_content, run_lines
from proofroll.running.case import Result, Status
from proofroll.running.simulation import simulate


def _case(scene: str, **parameters: float) -> Any:
    engine = SimpleNamespace(name="e", settings={}, precision="double", step=None)
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
    ("seconds", "said"),
    [
        (2.5, "e reached 1 s in 0.1 s (10× real time), after 2.5 s before the first step."),
        (0.25, "e reached 1 s in 0.1 s (10× real time)."),
        (None, "e reached 1 s in 0.1 s (10× real time)."),
    ],
)
def test_the_first_line_is_the_answer(seconds: float | None, said: str, tmp_path: Path) -> None:
    """Who reached what time, how fast in real time; seconds of building stand beside it where they are many."""
    result = Result(Status.DONE, "reached 1 s", wall_seconds=0.1, build_seconds=seconds)
    content = run_content(_case("pendulum"), result, tmp_path / "none.npz")
    assert content.build_seconds == seconds
    lines = run_lines(dataclasses.replace(content, final={"time": 1.0}, units={"time": "s"}), checked="a command")
    assert [str(lines[0]), str(lines[-1])] == [said, "is it right? a command"]


@pytest.mark.parametrize(("engine", "activity"), [("mujoco", "advance"), ("truth", "truth")])
def test_other_processes_make_no_run_dearer(engine: str, activity: str, tmp_path: Path) -> None:
    """The computing that is told is processor time where that is shorter than what the clock shows."""
    case = _case("pendulum")
    case.engine.name = engine
    result = Result(Status.DONE, "reached 1 s", wall_seconds=9.0, processor={activity: 0.25})
    content = run_content(case, result, tmp_path / "none.npz")
    lines = run_lines(dataclasses.replace(content, final={"time": 1.0}, units={"time": "s"}))
    assert "0.25 s" in str(lines[0])
    assert "9 s" not in str(lines[0])


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
    """Positions stand before energies and forces; many forces are counted, velocities and the time are for --all."""
    result = Result(Status.DONE, "reached 1 s", wall_seconds=1.0)
    units = {"time": "s", "E": "J", "v": "m/s", "x": "m", "q": "rad"} | {f"force.{axis}": "N" for axis in "abcd"}
    final = dict.fromkeys(units, 1.0)
    content = run_content(_case("pendulum"), result, tmp_path / "none.npz")
    content = dataclasses.replace(content, final=final, units=units)
    texts = []
    for options in ({"forces": False}, {"forces": True}, {"forces": False, "everything": True}):
        shown = Console(file=io.StringIO(), width=80)
        for line in run_lines(content, **options):
            shown.print(line)
        texts.append(shown.file.getvalue())
    assert [line.split() for line in texts[0].splitlines()[2:4]] == [["x", "1", "m", "E", "1", "J"], ["q", "1", "rad"]]
    assert "force.a" not in texts[0]
    assert "4 forces and moments: --forces" in texts[0]
    assert "force.a" in texts[1]
    names = [line.split()[0] for line in texts[2].splitlines()[3:8]]
    assert names == ["time", "x", "q", "v", "E"]
    assert "force.a" in texts[2]


def _range(text: str) -> list[str]:
    low, _, high = text.partition("-")
    return [str(number) for number in range(int(low), int(high) + 1)] if high else [text]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["a", "a.b", "c"]),
            st.sampled_from(["", ".1", ".2", ".3", ".30"]),
            st.sampled_from(["", ".x", ".y"]),
        ),
        unique=True,
    )
)
def test_short_names_keep_every_name_once(parts: list[tuple[str, str, str]]) -> None:
    """Written together, names of components and numbered contacts stand for exactly the names that were given."""
    names = ["".join(part) for part in parts]
    told: list[str] = []
    for text in short_names(names):
        choices = [[one for each in part.split("|") for one in _range(each)] for part in text.split(".")]
        told += [".".join(choice) for choice in itertools.product(*choices)]
    assert sorted(told) == sorted(names)


def test_corners_with_equal_values_are_one_row(tmp_path: Path) -> None:
    """Eight corners, of which four touch, take two rows for their gaps and one for all forces that are zero."""
    result = Result(Status.DONE, "reached 1 s", wall_seconds=1.0)
    gaps = {f"gap.touch.{corner}": 0.4 * (corner % 2) for corner in range(1, 9)}
    forces = {f"force.touch.{corner}.{axis}": 0.0 for corner in range(1, 9) for axis in "xyz"}
    content = run_content(_case("pendulum"), result, tmp_path / "none.npz")
    units = dict.fromkeys(gaps, "m") | dict.fromkeys(forces, "N")
    content = dataclasses.replace(content, final=gaps | forces, units=units)
    shown = Console(file=io.StringIO(), width=80)
    for line in run_lines(content, everything=True):
        shown.print(line)
    rows = [line.split()[:2] for line in shown.file.getvalue().splitlines()[3:6]]
    assert rows == [
        ["gap.touch.1|3|5|7", "0.4"],
        ["gap.touch.2|4|6|8", "0"],
        ["force.touch.1-8.x|y|z", "0"],
    ]


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


@pytest.mark.drill
def test_bounces_stand_in_the_table_and_in_the_file_of_events(tmp_path: Path) -> None:
    """Each impact has its energies and the next apex in the document, on the terminal and in a CSV of all events."""
    write(simulate(load_scene("spinning_bounce"), "truth", until=1.0), tmp_path / "run.npz")
    result = Result(Status.DONE, "reached 1 s", trajectory="run.npz", wall_seconds=0.1)
    content = run_content(_case("spinning_bounce"), result, tmp_path / "run.npz")
    assert content.bounces is not None
    assert [round(item.energy_after, 9) for item in content.bounces] == [0.875809978, 0.532676936]
    shown = Console(file=io.StringIO(), width=100)
    for line in run_lines(content):
        shown.print(line)
    row = next(line for line in shown.file.getvalue().splitlines() if line.startswith("0.319"))
    assert row.split() == ["0.319275428", "1.5756", "0.875809977641", "0.32"]
    head, first, last = event_csv(content).splitlines()
    assert head.endswith("kind,name,energy_before [J],energy_after [J],height [m]")
    assert first.split(",")[3:5] == ["impact", "contact"]
    assert float(first.split(",")[-1]) == pytest.approx(0.32, rel=1e-12)
    assert last.endswith(",")  # its apex lies behind the end
