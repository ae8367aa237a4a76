"""Rows of a study of throughput: single runs, batches, and batches whose copies disturb each other."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from batched import BATCHES

from proofroll.core.time_grid import require_whole_steps, time_grid
from proofroll_throughput.study import SAMPLES, _whole_interval

_RANGE = ("throughput", "pendulum", "--vary", "angle=0.5:1.5:3", "--until", "0.1", "--step", "1e-3")
Proofroll = Callable[..., tuple[int, str, str]]


@pytest.fixture
def rows(
    command_line: Proofroll, install_engines: Callable[[Mapping[str, str]], None], tmp_path: Path
) -> Callable[..., list[dict[str, Any]]]:
    """Rows of the study with some engines and numbers of copies."""
    install_engines(BATCHES)

    def run(copies: str, *engines: str) -> list[dict[str, Any]]:
        chosen = [word for engine in engines for word in ("--engine", engine)]
        code, out, err = command_line(*_RANGE, "--copies", copies, *chosen, "--out", str(tmp_path), "--json")
        assert code == 0, err
        return list(json.loads(out)["rows"])

    return run


@pytest.mark.parametrize("until", [0.05, 0.5, 1.0, 0.053, 0.7])
@pytest.mark.parametrize("steps", [(), (1e-3,), (1e-3, 5e-4), (1e-3, 1 / 3000), (2.5e-4,), (1e-3, 3e-1)])
def test_samples_lie_at_whole_steps_of_every_engine(until: float, steps: tuple[float, ...]) -> None:
    """Each step that ends with the run divides the usual sampling, which is near a twentieth of the length."""
    times = time_grid(until, _whole_interval(until, steps))
    for step in steps:
        if abs(until / step - round(until / step)) < 1e-9 * until / step:
            require_whole_steps(times, step)
    assert SAMPLES - 4 <= len(times) - 1 <= SAMPLES + 6
    assert times[-1] == until


@pytest.mark.drill
def test_a_step_that_does_not_divide_the_asked_sampling_is_refused(command_line: Proofroll) -> None:
    """A person's own step and interval that do not fit are one line before any run, with a step that does."""
    code, _, err = command_line(*_RANGE, "--engine", "mujoco", "--every", "0.0025")
    assert (code, err.count("\n")) == (2, 1)
    (advised,) = re.findall(r"divides the interval, as (\S+) s", err)
    assert 0.0025 / float(advised) == pytest.approx(3)


@pytest.mark.nightly
def test_copies_cost_and_err_as_single_runs(rows: Callable[..., list[dict[str, Any]]]) -> None:
    """Copies of a batch have the error of single runs, at the same value; twins are equal and no number is lost."""
    single, one, many = rows("1,7", "mujoco[integrator=Euler]", "batched[integrator=Euler]")
    assert (single["copies"], one["copies"], many["copies"]) == (3, 1, 7)
    assert (single["in_turn"], one["in_turn"], many["in_turn"]) == ("its adapter moves no copies together", "", "")
    assert single["worst"] == many["worst"] > one["worst"]
    assert single["worst_value"] == many["worst_value"]
    assert one["worst_value"] == 1.0
    assert (single["twins_apart"], one["twins_apart"], many["twins_apart"]) == (None, None, 0.0)
    assert single["not_finite"] == many["not_finite"] == 0
    for row in (single, one, many):
        assert row["microseconds"] == pytest.approx(1e3 * row["seconds_per_second"])
        assert row["seconds_before"] > 0
        assert (row["device"], row["step"], row["precision"]) == ("cpu", 1e-3, "double")


@pytest.mark.drill
def test_a_copy_that_reads_its_neighbour_shows(rows: Callable[..., list[dict[str, Any]]]) -> None:
    """Twins with other neighbours end apart, though places, which are judged, are right."""
    (row,) = rows("7", "mixing")
    assert 1e-5 < row["twins_apart"] < 1e-2


@pytest.mark.nightly
def test_a_table_and_a_picture_name_the_device(
    command_line: Proofroll, install_engines: Callable[[Mapping[str, str]], None], tmp_path: Path
) -> None:
    """The table has a line for each row, says which runs come one after the other, and the picture names the device."""
    install_engines(BATCHES)
    picture = tmp_path / "picture.svg"
    words = ("--engine", "mujoco", "--engine", "batched", "--copies", "1,4", "--plot", str(picture))
    code, out, err = command_line(*_RANGE, *words, "--out", str(tmp_path))
    assert code == 0, err
    assert len(re.findall(r"^MuJoCo joints, .* dt 1e-3 s +\d", out, flags=re.MULTILINE)) == 3
    assert "One after the other (its adapter moves no copies together): MuJoCo joints" in out
    assert "On cpu (" in out
    drawn = picture.read_text(encoding="utf-8")
    assert "cpu: " in drawn
    assert "copies × steps in a second of processor time" in drawn
