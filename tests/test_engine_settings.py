"""Settings of an engine in brackets, ``NAME[key=value]``, mean the same in every command that takes them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from robot_templates import urdf

Proofroll = Callable[..., tuple[int, str, str]]
ENGINE = "projection[preset=default,dt=2e-3]"
CONTROL = '[[gains]]\njoints = "*"\nkp = 20\nkd = 2\n'
# Command -> its arguments; {robot} and {control} are files.
PATHS = {
    "run of a scene": "run pendulum --until 0.1",
    "run of a robot": "run {robot} --until 0.02",
    "run under control": "run {robot} --control {control} --until 0.02",
    "matrices under control": "run {robot} --control {control} --matrices",
    "export": "export pendulum {folder}/x.xml",
    "comparison of a scene": "compare pendulum --until 0.1",
    "comparison of a file": "compare inclined_plane",
    "comparison of a robot": "compare {robot} --until 0.02",
    "comparison under control": "compare {robot} --control {control} --until 0.02",
    "step under control": "compare {robot} --control {control} --until 0.02 --tolerance 1e-3",
    "recommendation for a scene": "recommend pendulum --until 0.1 --tolerance 1e-3",
    "recommendation under control": "recommend {robot} --control {control} --until 0.02 --tolerance 1e-3",
    "balance": "balance pendulum",
    "balance under control": "balance {robot} --control {control}",
}
# This engine writes no files and no matrices, and the answer about a step names the one that would do, too.
NO_OWN_STEP = {"export", "matrices under control", "step under control"}
WRONG = {
    "setting": ("projection[dtt=1e-3]", ["projection: dtt = '1e-3': there is no such setting", "did you mean dt?"]),
    "value": ("projection[dt=fast]", ["projection: dt = 'fast': give a number"]),
    "engine": ("projektion[dt=1e-3]", ["engine = 'projektion': there is no such engine", "did you mean projection?"]),
    "form": ("projection[dt]", ["engine = 'projection[dt]': write key=value instead of 'dt'"]),
}


@pytest.fixture
def arguments(tmp_path: Path) -> Callable[[str], list[str]]:
    """Arguments of a command, with its files."""
    robot, control = tmp_path / "arm.urdf", tmp_path / "control.toml"
    robot.write_text(urdf())
    control.write_text(CONTROL)

    def of(path: str) -> list[str]:
        return PATHS[path].format(robot=robot, control=control, folder=tmp_path).split()

    return of


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.nightly_of("balance under control")
@pytest.mark.parametrize("path", PATHS)
def test_a_wrong_setting_is_told_alike(
    command_line: Proofroll, arguments: Callable[[str], list[str]], path: str
) -> None:
    """Every command answers an unknown setting, a wrong value, name and form with one line and exit code 2."""
    for engine, words in WRONG.values():
        code, out, err = command_line(*arguments(path), "--engine", engine)
        assert (code, out, err.count("\n")) == (2, "", 1), err
        for word in words:
            assert word in err


@pytest.mark.one_in(4)
@pytest.mark.nightly_of(
    "balance under control",
    "comparison of a file",
    "comparison of a scene",
    "comparison under control",
    "recommendation for a scene",
    "run of a robot",
    "run under control",
)
@pytest.mark.drill
@pytest.mark.parametrize("path", sorted(PATHS.keys() - NO_OWN_STEP))
def test_a_step_in_brackets_is_the_one_that_is_taken(
    command_line: Proofroll, arguments: Callable[[str], list[str]], path: str, tmp_path: Path
) -> None:
    """Every command takes the step of 2 ms, and with it alone gives its answer."""
    kept = [] if path.startswith(("run", "balance")) else ["--out", str(tmp_path / "out")]
    code, out, err = command_line(*arguments(path), "--engine", ENGINE, *kept, "--json")
    assert code == 0, err
    steps = set(map(float, re.findall(r'(?:"dt": |"spec": "[^"]*dt=)([0-9.e-]+)', out)))
    assert steps <= {0.002}
    assert steps or ENGINE in out


@pytest.mark.drill
def test_a_map_of_stability_takes_no_step(command_line: Proofroll) -> None:
    """A step in brackets is refused where it is what the map looks for."""
    code, _, err = command_line("stability", "pendulum", "--engine", ENGINE)
    assert code == 2
    assert "a map looks for the largest dt itself; leave it out" in err
