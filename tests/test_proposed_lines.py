"""Commands and lines that proofroll proposes: each was run as it stands, and asks the question that it stands under."""

from __future__ import annotations

import html
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from folded import whole

import proofroll as rolled
from proofroll.core.errors import InputError
from proofroll.files.comparison_file import load_comparison
from proofroll.files.data_folders import study_folders
from proofroll.files.scene_sources import ROOT
from proofroll.files.trajectory_file import write
from proofroll.report.parts import parts_of
from proofroll.studies.stability.claims import file_for
from proofroll.testing import assert_agrees

Proofroll = Callable[..., tuple[int, str, str]]
# Commands of which a page of comparisons has lines.
COMMANDS = ("compare", "run", "recommend", "report")
ARM = """<mujoco><include file="../of all/laws.xml"/><option timestep="0.004"/><worldbody><body name="b">
<inertial pos="0 0 -0.3" mass="1" diaginertia="0.01 0.01 0.01"/><joint name="j" axis="0 1 0"/></body></worldbody>
</mujoco>"""
LAWS = '<mujocoinclude><default><joint damping="0.1"/></default></mujocoinclude>'
CONTROL = 'pose = {j = 0.4}\n[[gains]]\njoints = "*"\nkp = 4\nkd = 0.1\n[start]\nq = {j = 0.3}\n'
ARM_FILE = "my robots/an arm/it.xml"
MAP = """study = "stability"
title = "A map of one's own"
question = "Up to which step?"
scene = "pendulum"
[[axes]]
name = "length"
unit = "m"
meaning = "length of the rod"
values = [0.5, 1.0]
parameters = {length = {}}
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A person's folder with a blank in its name, and in those of a robot, a controller and a scene of theirs."""
    folder = tmp_path / "a person's"
    for name, text in {
        ARM_FILE: ARM,
        "my robots/of all/laws.xml": LAWS,
        "my control.toml": CONTROL,
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(folder)
    return folder


def following(out: str, mark: str) -> list[str]:
    """Words of the command behind a mark in printed lines, which are wrapped; it ends before the next sentence."""
    text = " ".join(out.partition(mark)[2].split())
    assert text, out
    return shlex.split(re.split(r" (?=All quantities|The trajectory|Judged: |Not compared|The nearest)", text)[0])


def run_as_proposed(proofroll: Proofroll, words: list[str], *more: str) -> tuple[int, str]:
    """Exit code and output of a proposed command."""
    program, *arguments = words
    assert program == "proofroll"
    code, out, err = proofroll(*arguments, *more)
    return code, " ".join(f"{out} {err}".split())


@pytest.mark.drill
def test_a_run_is_compared_as_it_was(proofroll: Proofroll, mine: Path) -> None:
    """The comparison behind a run has its robot below its root, controller, place, parameters and all digits."""
    asked = ["--control", "my control.toml", "--set", "gravity=9.80665432", "--ground", "none", "--root", "my robots"]
    code, out, err = proofroll(
        "run", ARM_FILE, *asked, "--engine", "mujoco", "--until", "0.12300004", "--every", "0.12300004"
    )
    assert code == 0, err
    words = following(out, "is it right? ")
    given = ["--set", "gravity=9.80665432", "--set", "ground=0", "--control", "my control.toml"]
    asked = [ARM_FILE, "--engine", "mujoco", *given, "--until", "0.12300004", "--root", str(mine / "my robots")]
    assert words[2:] == asked


@pytest.mark.drill
def test_a_mapping_of_a_run_is_judged_with_its_scene(proofroll: Proofroll, mine: Path) -> None:
    """The scene and the parameters that a file has are read from it again; the line has what was given beside it."""
    made = rolled.simulate(rolled.load_scene("pendulum", length=0.123456789), "truth", until=0.3, every=0.05)
    made["q.pivot"] = np.degrees(made["q.pivot"])
    keep = ["q.pivot"]
    write(made[keep].assign_attrs(made.attrs), mine / "a run.npz")
    asked = ["--tolerance", "q.pivot=1e-6 rad", "--because", "no less", "--time-limit", "77.5"]
    code, out, err = proofroll("judge", "a run.npz", *asked)
    assert code == 1, f"{out}{err}"
    words = following(out, "Say so: ")
    assert words[2:-2] == ["a run.npz", *asked]
    code, told = run_as_proposed(proofroll, words)
    assert (code, told[:1]) == (0, "✓"), told


@pytest.mark.drill
def test_lines_for_a_model_hold_all_tolerances(proofroll: Proofroll, mine: Path) -> None:
    """The command that looks for other settings has each tolerance as an option, parameters, length and root."""
    asked = ["--tolerance", "positions=1e-12 m", "--tolerance", "p_WB=1 mm"]
    more = ["--set", "length=0.123456789", "--until", "0.32"]
    code, out, err = proofroll("compare", "pendulum", "--like", ARM_FILE, *asked, *more, "--root", "my robots")
    assert code == 1, f"{out}{err}"
    words = following(out, "Lines that do, if any: ")
    assert words[2:] == ["pendulum", "--lines", "--engine", "mujoco", *asked, *more, "--root", str(mine / "my robots")]


@pytest.mark.drill
def test_what_is_written_anew_can_be_used_as_proposed(proofroll: Proofroll, mine: Path) -> None:
    """A scene and a comparison of it pass every command that stands below them."""
    ended = []
    for words in (["scene", "swing"], ["comparison", "claim", "--scene", "swing"]):
        code, out, err = proofroll("new", *words)
        assert code == 0, err
        lines = [shlex.split(line) for line in out.splitlines()[1:]]
        assert len(lines) == 2
        ended += [run_as_proposed(proofroll, line)[0] for line in lines]
    assert ended == [0, 0, 0, 0]
    assert sorted(path.name for path in mine.iterdir() if path.suffix == ".toml") == ["claim.toml", "my control.toml"]


@pytest.mark.drill
def test_the_lines_of_a_probe_judge_its_record(proofroll: Proofroll, mine: Path) -> None:
    """The script of a robot below a root runs, and its record is judged with that root, as below the script's head."""
    code, out, err = proofroll("new", "probe", ARM_FILE, "--for", "mujoco", "--root", "my robots")
    assert code == 0, err
    script, judge = (shlex.split(line) for line in out.splitlines()[1:])
    assert shlex.join(judge) in Path(script[1]).read_text(encoding="utf-8")
    done = subprocess.run([sys.executable, *script[1:]], cwd=mine, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    code, told = run_as_proposed(proofroll, judge)
    assert code == 0, told


def test_a_study_that_is_no_comparison_names_its_command(proofroll: Proofroll, mine: Path) -> None:
    """The command has the path of the study as it was given, as one word."""
    (mine / "a map.toml").write_text(MAP, encoding="utf-8")
    code, out, err = proofroll("compare", "a map.toml")
    assert (code, out) == (2, "")
    assert shlex.split(err.partition("is no comparison; ")[2]) == ["proofroll", "report", "a map.toml", "runs", "it"]


@pytest.mark.drill
def test_a_map_of_ones_own_is_made_by_its_command(mine: Path) -> None:
    """A report names a map by the path that was given, one of the package by its name, and where its results lie."""
    (mine / "a map.toml").write_text(MAP, encoding="utf-8")
    _, parts = parts_of(["a map.toml", "stability_bounce"], ["mujoco[dt=1e-3]"], Path("my results"))
    lines = [shlex.split(part.head["command"]) for part in parts]
    asked = ["--engine", "mujoco[dt=1e-3]", "--out", "my results"]
    names = ["a map.toml", "stability_bounce"]
    assert sorted(lines) == [["proofroll", "stability", name, *asked] for name in names]
    assert [file_for(name).name for name in names] == ["a map", "stability_bounce"]
    assert file_for("a map.toml").axes[0].values == [0.5, 1.0]
    with pytest.raises(InputError, match="the file cannot be read"):
        file_for("no map.toml")


def test_a_comparison_is_found_by_what_it_was_asked_by(mine: Path) -> None:
    """The name or the path that was given leads to the file again, where its own name would be that of a scene."""
    shutil.copy(study_folders()[0] / "mechanisms" / "stop.toml", mine / "my claim.toml")
    for name in ("my claim.toml", "mechanisms/stop"):
        assert load_comparison(name).asked == name


@pytest.mark.nightly
@pytest.mark.parametrize("scene", ["swing", ARM_FILE])
def test_lines_of_a_page(proofroll: Proofroll, mine: Path, monkeypatch: pytest.MonkeyPatch, scene: str) -> None:
    """Each command and test of a page does what it stands for, of a scene and of a robot below a root."""
    given = ["--set", "gravity=9.80665432", "--root", "my robots"]
    if scene == "swing":
        assert proofroll("new", "scene", "swing")[0] == 0
        scene, given = "my scenes/swing", ["--set", "length=0.123456789"]
        shutil.move("swing", scene)
    tolerances = ["1 mm", "0.1 %", "positions=1 mm"]
    asked = [*given, *(word for text in tolerances for word in ("--tolerance", text))]
    engines = ["--engine", "mujoco[preset=matched]", "--engine", "exudyn"]
    code, out, err = proofroll("report", scene, *asked, *engines, "--out", "my results")
    assert code == 0, f"{out}{err}"
    page = whole((mine / "my results" / "report.html").read_text(encoding="utf-8"))
    texts = [html.unescape(re.sub(r"<[^>]+>", "", text)) for text in re.findall(r"<code>(.*?)</code>", page, re.DOTALL)]
    lines = {
        text: shlex.split(text) for text in dict.fromkeys(texts) if text.startswith("proofroll ") and scene in text
    }
    by_command = {name: [words for words in lines.values() if words[1] == name] for name in COMMANDS}
    assert {name for name, found in by_command.items() if not found} == set()
    root = ["--root", str(mine / "my robots")] if "--root" in given else []
    for words in (words for found in by_command.values() for words in found):
        assert words[words.index("--set") + 1] == given[1]
        assert words[-2:] == root or not root, words
    checks = by_command["compare"]
    assert {words[words.index("--tolerance") + 1] for words in checks} == set(tolerances)
    for words in checks:
        code, told = run_as_proposed(proofroll, words, "--out", "my results")
        assert (code, told[:5]) == (0, "Yes: "), told
    assert {run_as_proposed(proofroll, words)[0] for words in by_command["run"]} == {0}
    assert run_as_proposed(proofroll, by_command["recommend"][0])[0] == 0
    assert Path("cost.svg").read_text(encoding="utf-8").startswith("<svg")
    assert run_as_proposed(proofroll, by_command["report"][0])[0] == 0
    tests = [text for text in dict.fromkeys(texts) if "def test_" in text]
    assert len(tests) >= len(tolerances)
    for text in tests:
        space: dict[str, Callable[..., None]] = {}
        exec(compile(text, "test", "exec"), space)
        (test,) = (value for name, value in space.items() if name.startswith("test_"))
        test(*([assert_agrees, monkeypatch] if root else [assert_agrees]))
        monkeypatch.delenv(ROOT, raising=False)
