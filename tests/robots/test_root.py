"""``--root``: robot files whose includes lie above them, for every command that reads one."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from proofroll.cli import _made, app
from proofroll.files.scene_sources import ROOT

Proofroll = Callable[..., tuple[int, str, str]]
ARM = """<mujoco><include file="../shared/laws.xml"/><worldbody><body name="b">
<inertial pos="0 0 -0.3" mass="1" diaginertia="0.01 0.01 0.01"/><joint name="j" axis="0 1 0"/>
</body></worldbody></mujoco>"""
ASKED = ["--engine", "mujoco"]
SHORT = [*ASKED, "--until", "0.1"]


@pytest.fixture
def arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Robot file in a folder beside that of what it includes; its path from the folder that holds both."""
    monkeypatch.chdir(tmp_path)
    for name, text in {
        "robot/arm.xml": ARM,
        "shared/laws.xml": '<mujocoinclude><default><joint damping="0.1"/></default></mujocoinclude>',
    }.items():
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text, encoding="utf-8")
    return "robot/arm.xml"


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.nightly_of("run", "recommend", "ladder", "report")
@pytest.mark.drill_of("compare", "check")
@pytest.mark.parametrize(
    ("words", "more"),
    [(["check"], ASKED), (["run"], ["--engine", "truth", "--until", "0.1", "--out", "run.csv"]), (["compare"], SHORT),
     (["recommend"], SHORT), (["balance"], ASKED), (["export"], ["arm_of_mujoco.xml", *ASKED]),
     (["ladder"], SHORT), (["report"], ASKED), (["new", "probe"], ["--for", "mujoco"])],
    ids=["check", "run", "compare", "recommend", "balance", "export", "ladder", "report", "probe"],
)  # fmt: skip
def test_a_command_reads_below_the_root(proofroll: Proofroll, arm: str, words: list[str], more: list[str]) -> None:
    """Without the option one line names it; with it the command works, and later ones are as before."""
    code, _, err = proofroll(*words, arm, *more)
    assert (code, err.count("\n")) == (2, 1)
    assert "name one that holds all by --root" in err
    code, _, err = proofroll(*words, arm, *more, "--root", ".")
    assert code == 0, err
    assert ROOT not in os.environ


@pytest.mark.nightly
def test_runs_that_are_kept_are_read_below_the_root(proofroll: Proofroll, arm: str) -> None:
    """A stored run is shown and judged with the root, and the command that is proposed has it."""
    code, out, err = proofroll("run", arm, *SHORT, "--out", "run.nc", "--root", ".")
    assert code == 0, err
    assert f"--root {Path.cwd()}" in " ".join(out.split())
    for command in ("replay", "judge"):
        assert proofroll(command, "run.nc")[0] == 2
        assert proofroll(command, "run.nc", "--root", ".")[0] == 0


def test_a_root_that_is_none(proofroll: Proofroll, arm: str) -> None:
    """A folder that is not there, or does not hold the file, is one line."""
    for root, says in (("nowhere", "there is no such folder"), ("shared", "name one that holds it with --root")):
        code, out, err = proofroll("run", arm, "--engine", "truth", "--root", root)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert says in err


@pytest.mark.drill
def test_the_option_is_the_same_everywhere() -> None:
    """Each command that takes parameters or a controller of a scene takes a root, in the same words."""
    taken = {
        name: {word: item for item in command.params for word in item.opts}
        for name, command in _made(app, "").commands.items()
    }
    of_scenes = {name for name, options in taken.items() if {"--set", "--control"} & options.keys()}
    assert of_scenes >= {"check", "run", "compare", "recommend", "report", "judge", "export", "ladder", "balance"}
    assert {name for name in of_scenes if "--root" not in taken[name]} == set()
    for option in ("--root", "--set", "--control"):
        told = {options[option].help for name, options in taken.items() if option in options and name != "judge"}
        assert len(told) == 1, option
