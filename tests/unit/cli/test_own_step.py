"""A person's own model: whether its step is good enough, and which line to change."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from invented_answers import BOUND, HELD
from robot_templates import urdf

from proofroll.cli.own_step import _change
from proofroll.core.errors import InputError
from proofroll.files.scene_sources import options_of
from proofroll.studies.answer.records import StepAnswer
from proofroll.studies.answer.setting_search import State
from proofroll.studies.comparison.default_comparison import default_comparison
from proofroll.studies.study_store import Measured

Proofroll = Callable[..., tuple[int, str, str]]
MODEL = "<mujoco><option {}/><worldbody><body><joint/><geom size='.1'/></body></worldbody></mujoco>"

SCREW = """<mujoco><worldbody><body pos="0 0 1"><joint name="s" type="slide" axis="0 0 1"/><geom size="0.05" mass="1"/>
<body><joint name="t" axis="0 0 1" frictionloss="0.05"/><geom type="cylinder" size="0.02 0.1" mass="0.2"/></body></body>
</worldbody><equality><joint joint1="t" joint2="s" polycoef="0 628.3185307179587 0 0 0"/></equality></mujoco>"""


@pytest.fixture
def model(tmp_path: Path) -> Callable[[str], Path]:
    """Writer of a model with options."""

    def write(options: str) -> Path:
        path = tmp_path / "mine.xml"
        path.write_text(MODEL.format(options), encoding="utf-8")
        return path

    return write


def test_options_of_a_model_are_settings(model: Callable[[str], Path]) -> None:
    """Integrator, step and cone are read, MuJoCo's own where the file has none; other options are named."""
    own = options_of(model("timestep='0.004' integrator='RK4' solver='CG' iterations='7'"))
    assert own is not None
    of_rows = {"solver": "CG", "iterations": "7", "noslip_iterations": "0"}
    assert (own.engine, own.settings) == ("mujoco", {"integrator": "RK4", "dt": "0.004", **of_rows})
    assert own.of_contacts == {"cone": "pyramidal", "impratio": "1.0"}
    assert (own.words, own.others) == ("RK4, dt 4e-3 s", [])
    usual = {"solver": "Newton", "iterations": "100", "noslip_iterations": "0"}
    assert options_of(model("")).settings == {"integrator": "Euler", "dt": "0.002", **usual}
    softened = "<flag refsafe='disable'/></option><default><joint solreffriction='0.03 1'/></default><option"
    explicit = "><flag eulerdamp='disable'/></option><option"
    assert options_of(model(explicit)).settings["eulerdamp"] == "False"
    assert "eulerdamp" not in options_of(model(f"integrator='implicitfast'{explicit}")).settings
    own = options_of(model(f"noslip_iterations='3'>{softened}"))
    assert own.settings["noslip_iterations"] == "3"
    assert own.others == ["flag refsafe", "solreffriction of 1 joint"]
    with pytest.raises(InputError, match="integrator is none that can be compared; choose Euler, RK4, implicitfast"):
        options_of(model("integrator='implicit'"))


def test_a_step_that_is_not_confirmed_is_no_line_to_change() -> None:
    """Where the step that would do is not confirmed, the command that looks for other settings is proposed."""
    advised = replace(HELD, spec="mujoco[formulation=joints,dt=1e-7]", state=State.UNCONFIRMED)
    made = StepAnswer(
        scene="pendulum", parameters={}, until=5.0, every=0.02, tolerance="1 mm", bounds=[BOUND], unjudged=[],
        changes=[], beyond="", open="", spec="mujoco[dt=0.002]", resolution="dt", step=2e-3, holds=False, luck="",
        bound=BOUND, error=1.0, status="done", message="", reached=5.0, held_until=0.1, seconds_per_second=1 / 160,
        advised=advised, spent=1.0, measured=Measured("2026", {}, {}, ""),
    )  # fmt: skip
    command = "proofroll recommend pendulum --lines --engine mujoco --tolerance '1 mm' --until 5.0"
    assert _change(made) == [f"Lines that do, if any: {command}"]


def test_another_file_is_no_model(proofroll: Proofroll, tmp_path: Path) -> None:
    """A file without options of an engine is refused in one line."""
    (tmp_path / "mine.txt").write_text("dt = 2e-3")
    code, out, err = proofroll("compare", "pendulum", "--like", str(tmp_path / "mine.txt"), "--out", str(tmp_path))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "give the path of your own model or program of an engine, *.py or *.xml" in err
    err = proofroll("compare", "pendulum", "--like", str(tmp_path / "none.xml"), "--out", str(tmp_path))[2]
    assert "there is no such file" in err


@pytest.mark.nightly
def test_rows_of_models_with_options(tmp_path: Path, model: Callable[[str], Path]) -> None:
    """A model is compared with its own options, too, and the row names what it leaves out; a URDF has no such row."""
    rows = default_comparison(str(model("integrator='RK4' timestep='0.004' solver='CG'")), {}).rows
    (own,) = (row for row in rows if row.short)
    assert own.engine == "mujoco[formulation=joints,preset=default,integrator=RK4,dt=0.004,solver=CG]"
    assert own.short == "the file's own options"
    rows = default_comparison(str(model("")), {}).rows
    assert [row.engine for row in rows if row.short] == ["mujoco[formulation=joints,preset=default]"]
    unfit = default_comparison(str(model("integrator='implicit'")), {}).unfit
    assert "choose Euler, RK4, implicitfast" in unfit["the file's own options"]
    path = tmp_path / "arm.urdf"
    path.write_text(urdf())
    assert not any(row.short for row in default_comparison(str(path), {}).rows)


@pytest.mark.nightly
def test_the_creep_of_a_screw_shows(proofroll: Proofroll, tmp_path: Path) -> None:
    """A screw whose coupling creeps in plain MuJoCo is wrong in the row of the file, and right in matched."""
    path = tmp_path / "screw.xml"
    path.write_text(SCREW)
    _, out, _ = proofroll("compare", str(path), "--out", str(tmp_path), "--json")
    verdicts = {row["engine"]: row["verdict"] for row in json.loads(out)["rows"]}
    assert verdicts["mujoco[formulation=joints]"] == "agrees"
    assert verdicts["mujoco[formulation=joints,preset=default]"] == "differs"


@pytest.mark.drill
def test_the_line_to_change_is_named(proofroll: Proofroll, model: Callable[[str], Path], tmp_path: Path) -> None:
    """A step that is too coarse gets the line of one that would do, with which the same question is answered by yes."""
    asked = ["--until", "0.5", "--tolerance", "1e-3", "--out", str(tmp_path)]
    code, out, _ = proofroll("compare", "pendulum", "--like", str(model("timestep='0.01' solver='PGS'")), *asked)
    assert code == 1
    assert out.startswith("yours (Euler, dt 0.01 s): No: ")
    (line,) = (text.removeprefix("Change this line: ") for text in out.splitlines() if text.startswith("Change"))
    assert 'solver="PGS"' in line, "it is theirs, and stays"
    options = shlex.split(line.strip("</>"))[1:]
    code, out, _ = proofroll(
        "compare",
        "pendulum",
        "--like",
        str(model(" ".join(f'{x.split("=")[0]}="{x.split("=")[1]}"' for x in options))),
        *asked,
    )
    assert (code, out.partition(": ")[2][:4]) == (0, "Yes:")


@pytest.mark.nightly
def test_the_line_of_a_program_is_named(proofroll: Proofroll, tmp_path: Path) -> None:
    """An Exudyn program with too few steps gets the line that makes enough, with which the answer is yes."""
    program, asked = tmp_path / "program.py", ["--until", "0.2", "--tolerance", "1e-3", "--out", str(tmp_path)]

    def answered(lines: str) -> tuple[int, str]:
        program.write_text(
            f"simulationSettings.timeIntegration.endTime = 2\n{lines}\nmbs.SolveDynamic(simulationSettings)"
        )
        code, out, _ = proofroll("compare", "pendulum", "--like", str(program), *asked)
        return code, " ".join(out.split())

    code, out = answered("simulationSettings.timeIntegration.numberOfSteps = int(2 / 0.05)")
    assert code == 1
    assert out.startswith("yours (GeneralizedAlpha, dt 0.05 s, spectral radius 0.9): No: ")
    line = out.partition("Change this line: ")[2].partition(" Not compared")[0]
    code, out = answered(line)
    assert (code, out.partition("0.9): ")[2][:4]) == (0, "Yes:")
