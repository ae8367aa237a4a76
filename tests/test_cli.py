"""The command line as a user meets it: standard output, standard error and exit code."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from proofroll import __version__ as proofroll_version
from proofroll.cli.command_groups import GROUPS
from proofroll.cli.options import require_pages
from proofroll.core.errors import Missing
from proofroll.files.scene_file import load_scene, scene_names
from proofroll.running.process import Worker

RUN = ["run", "sphere_in_cylinder", "--engine", "oracle", "--until", "0.1", "--every", "0.05"]
KEYS = {
    "scene", "engine", "settings", "status", "message", "until", "final", "events", "wall_seconds", "versions",
}  # fmt: skip
FINAL = {
    "time", "gamma", "z", "gamma_rate", "z_rate", "omega1", "omega2", "omega3", "N", "F2", "F3", "slip2", "slip3",
    "energy",
}  # fmt: skip

Proofroll = Callable[..., tuple[int, str, str]]


def with_option(name: str, value: str) -> list[str]:
    """The run above with one option replaced."""
    arguments = list(RUN)
    if name in arguments:
        arguments[arguments.index(name) + 1] = value
        return arguments
    return [*arguments, name, value]


def rk4(dt: str) -> list[str]:
    """The run above in an engine with a fixed step."""
    return with_option("--engine", f"projection[integrator=rk4,dt={dt}]")


BAD = {
    "unknown scene": ([*RUN[:1], "sphere_in_cone", *RUN[2:]], 2, ["scene = 'sphere_in_cone'", "sphere_in_cylinder"]),
    "unknown engine": (with_option("--engine", "adams"), 2, ["engine = 'adams'", "choose one of", "truth"]),
    "engine of another form": (with_option("--engine", "oracle[dt"), 2, ["engine = 'oracle[dt'", "name[key=value"]),
    "unknown parameter": (with_option("--set", "wheels=4"), 2, ["wheels = '4'", "choose from radius"]),
    "parameter of another form": (with_option("--set", "speed"), 2, ["--set = 'speed'", "parameter=value"]),
    "parameter twice": ([*RUN, "--set", "speed=3", "--set", "speed=4"], 2, ["speed is given twice"]),
    "unknown setting": (with_option("--engine", "oracle[step=1]"), 2, ["oracle: step = ", "choose from formulation"]),
    "unknown formulation": (with_option("--engine", "projection[formulation=new]"), 2, ["= 'new'", "euler"]),
    "a setting for the truth": (with_option("--engine", "truth[dt=1]"), 2, ["truth", "no settings"]),
    "ball as large as the cylinder": (with_option("--set", "radius=0.225"), 2, ["radius = 0.225", "cylinder_radius"]),
    "negative mass": (with_option("--set", "mass=-1"), 2, ["mass = -1", "above 0"]),
    "no mass": (with_option("--set", "mass=0"), 2, ["mass = 0", "above 0"]),
    "NaN": (with_option("--set", "mass=nan"), 2, ["mass = 'nan'", "finite"]),
    "infinity": (with_option("--set", "speed=inf"), 2, ["speed = 'inf'", "finite"]),
    "text for a number": (with_option("--set", "speed=fast"), 2, ["speed = 'fast'", "not a number"]),
    "asking by a parameter": (with_option("--set", "asks=0"), 2, ["asks = '0'", "ask for it with --ask"]),
    "commands for the terminal": (with_option("--set", "speed=\x1b[2J\x9b"), 2, ["speed = ", "not a number"]),
    "no speed": (with_option("--set", "speed=0"), 2, ["speed = ", "nothing to roll on"]),
    "dt of zero": (rk4("0"), 2, ["projection: dt = ", "greater than 0"]),
    "negative dt": (rk4("-1"), 2, ["dt = ", "greater than 0"]),
    "NaN for dt": (rk4("nan"), 2, ["dt = ", "nan"]),
    "dt that fits no sample": (rk4("3e-2"), 2, ["dt = 0.03", "divides"]),
    "negative end": (with_option("--until", "-1"), 2, ["until = -1", "not negative"]),
    "text for the end": (with_option("--until", "long"), 2, ["--until", "long"]),
    "NaN for the end": (with_option("--until", "nan"), 2, ["until = nan", "finite"]),
    "no interval": (with_option("--every", "0"), 2, ["every = 0", "positive"]),
    "no time limit": (with_option("--time-limit", "0"), 2, ["time_limit = 0", "positive"]),
    "endless time limit": (with_option("--time-limit", "inf"), 2, ["time_limit = inf", "finite"]),
    "NaN for the time limit": (with_option("--time-limit", "nan"), 2, ["time_limit = nan", "finite"]),
    "output in a file": (with_option("--out", "/dev/null/run.nc"), 2, ["/dev/null", "cannot be written"]),
    "output is a folder": (with_option("--out", "/tmp"), 2, ["--out = '/tmp'", "folder"]),
    "unknown option": ([*RUN, "--colour", "red"], 2, ["--colour"]),
    "unknown command": (["simulate"], 2, ["simulate"]),
    "no engine": (["run", "sphere_in_cylinder"], 2, ["--engine", "Choose one of truth, "]),
    "no file to judge": (["judge", "run.csv"], 2, ["run = 'run.csv': there is no such file"]),
    "neither is a file": (["judge", "pendulum", "run.txt"], 2, ["there is no such file, and run.txt is none either"]),
    "no scene to judge": (["judge", __file__], 2, ["scene = ", "proofroll judge FILE --scene SCENE"]),
    "no scene": (["run", "--engine", "truth"], 2, ["Missing argument", "scene"]),
    "engine not installed": (with_option("--engine", "absent"), 3, ["absent is not installed here", "pip install"]),
    "engine that cannot be loaded": (with_option("--engine", "misspelt"), 3, ["NoSuchClass"]),
    "engine that crashes": (with_option("--engine", "exits"), 3, ["exits crashed", "exit code 7", "no licence"]),
    "engine that raises": (with_option("--engine", "raises"), 3, ["raises crashed", "matrix is singular"]),
    "engine that diverges": (with_option("--engine", "not_a_number"), 3, ["not_a_number diverged", "not finite"]),
    "engine that commands": (with_option("--engine", "commands"), 3, ["commands diverged", "owned2J it stopped"]),
    "engine that refuses": (with_option("--engine", "refuses"), 3, ["refuses refused", "no wheel, no ball"]),
    "capability that is lacking": (with_option("--set", "rolling_resistance=1e-4"), 3, ["needs friction of contacts"]),
    "something else asked": (with_option("--ask", "colour"), 2, ["--ask = 'colour'", "choose orientation"]),
    "nothing to ask for": (
        ["run", "pendulum", "--engine", "truth", "--ask", "colour"], 2, ["--ask = 'colour'", "besides its motion"]
    ),
    "formulation of another scene": (
        ["run", "pendulum", "--engine", "mujoco[formulation=chart]"], 3, ["revolute joints; choose formulation=joints"]
    ),
    "nothing for a value": (with_option("--out", ""), 2, ["argument = ''", "this is empty"]),
    "picture in a file": (with_option("--plot", "/dev/null/run.svg"), 2, ["--plot = '/dev/null/run.svg'", "cannot be"]),
    "picture of another kind": (with_option("--plot", "run.gif"), 2, ["--plot = 'run.gif'", ".svg"]),
    "a model of another scene": (
        ["export", "pendulum", "x.xml", "--engine", "mujoco[formulation=chart]"], 3, ["needs revolute joints; choose"]
    ),
    "number of another kind": (["check", "arm.urdf", "--states", "1e9"], 2, ["--states = '1e9': give a whole number"]),
    "steps without number": (rk4("1e-300"), 2, ["dt = 1e-300", "steps from 0 s", "take a longer one"]),
    "numbers too large for numbers": (
        ["run", "pendulum", "--engine", "truth", "--set", "speed=1e300", "--until", "0.1"], 2, ["its cube overflows"]
    ),
    "a setting as an option": (["run", "pendulum", "--dt", "1e-3"], 2, ["--engine 'NAME[dt=…]'"]),
    "a parameter as an option": (["run", "pendulum", "--angle", "60 deg"], 2, ["--set 'angle=…'"]),
    "a misspelt option": (["run", "pendulum", "--engin", "truth"], 2, ["did you mean --engine?"]),
    "a misspelt engine": (["run", "pendulum", "--engine", "mujco"], 2, ["there is no such engine", "mujoco"]),
    "a misspelt scene": (["run", "pendullum", "--engine", "truth"], 2, ["choose one of pendulum, "]),
    "truth among engines": (["compare", "pendulum", "--engine", "truth"], 2, ["engines are held against it"]),
    "a line that is no TOML": (
        ["check", str(Path(__file__).parent / "plugins" / "broken.toml")], 2, ["at line 2, column 8): mass = = 1"]
    ),
    "a version in a name": (["engines", "add", "mujoco==99"], 2, ["add mujoco --requirement mujoco==VERSION"]),
    "no version": (["engines", "add", "mujoco"], 2, ["--requirement is missing", "mujoco==VERSION"]),
    "a scene for a map": (["stability", "/dev/null/scene.toml"], 2, ["scene.toml", "cannot be read"]),
    "orientation of an engine without": (with_option("--ask", "orientation"), 3, ["orientation of a ball"]),
    "ladder of nothing": (["ladder", "sphere_in_cylinder", "--quantity", "height"], 2, ["quantity = 'height'"]),
    "ladder of no length": (["ladder", "sphere_in_cylinder", "--until", "0"], 2, ["until = 0", "positive"]),
    "unknown comparison": (["compare", "no_such_claim"], 2, ["comparison = 'no_such_claim'"]),
    "unknown comparison to report": (["report", "no_such_claim"], 2, ["comparison = 'no_such_claim'"]),
    "unknown axis of a map": (["stability", "sphere_in_cylinder", "--axis", "speed"], 2, ["axis = 'speed'", "V0"]),
    "unknown scene of a map": (["stability", "sphere_in_cone"], 2, ["scene = 'sphere_in_cone'"]),
    "a file that asks for no map": (["stability", "comparisons/paper.toml"], 2, ['"stability" can be used here']),
    "no jobs": (["compare", "x", "--jobs", "0"], 2, ["--jobs"]),
}  # fmt: skip


@pytest.mark.one_in(2)
@pytest.mark.drill_of("dt of zero", "unknown setting")
@pytest.mark.parametrize(("arguments", "code", "words"), BAD.values(), ids=BAD.keys())
def test_bad_input(proofroll: Proofroll, arguments: list[str], code: int, words: list[str]) -> None:
    """Every bad input gives one line on standard error, nothing on standard output, and its exit code."""
    found, out, err = proofroll(*arguments, *(["--json"] if "run" in arguments and code == 2 else []))
    assert (found, err.count("\n")) == (code, 1), err
    assert err.startswith("proofroll: ")
    assert "Traceback" not in err
    assert (out + err).replace("\n", "").isprintable()
    for word in words:
        assert word in err
    if "diverged" not in err:  # then it is told how far the run came
        assert out == ""


def test_broken_toml(proofroll: Proofroll, tmp_path: Path) -> None:
    """A scene or comparison that is no TOML gives one line with the file and the place in it."""
    (tmp_path / "scene.toml").write_text("title = \n")
    for arguments in (["run", str(tmp_path), "--engine", "truth"], ["compare", str(tmp_path / "scene.toml")]):
        code, out, err = proofroll(*arguments)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "broken" in err
        assert "line 1" in err


@pytest.mark.drill
def test_an_engine_that_hangs(proofroll: Proofroll) -> None:
    """A hang ends at the time limit, as a crash of the engine."""
    code, out, err = proofroll(*with_option("--engine", "hangs"), "--time-limit", "2", "--json")
    assert code == 3
    assert err == "proofroll: hangs timeout: no result within 2 s; it was ended\n"
    assert json.loads(out)["status"] == "timeout"


@pytest.mark.drill
def test_run_json(proofroll: Proofroll) -> None:
    """``run --json`` prints one document with the promised keys, and nothing else anywhere."""
    code, out, err = proofroll(*RUN, "--set", "speed=5", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert set(found) >= KEYS
    assert set(found["final"]) >= FINAL
    assert found["engine"] == "oracle"
    assert found["parameters"].keys() == load_scene("sphere_in_cylinder").parameters.keys()  # with the defaults
    assert (found["parameters"]["speed"], found["parameters"]["radius"]) == (5.0, 0.025)
    assert found["settings"] == {"formulation": "only", "preset": "matched", "dt": 0.01}
    assert (found["status"], found["until"], found["events"]) == ("done", 0.1, [])
    assert found["final"]["time"] == pytest.approx(0.1)
    assert found["final"]["gamma"] == pytest.approx(2.5)
    assert found["final"]["N"] == pytest.approx(0.517 * 25 / 0.2)
    assert set(found["units"]) == set(found["final"])
    assert found["smallest"]["N"] == pytest.approx(0.517 * 25 / 0.2)


@pytest.mark.drill
def test_run_of_the_truth(proofroll: Proofroll) -> None:
    """The truth is an engine too, and gives its error bars."""
    code, out, _ = proofroll(*with_option("--engine", "truth"), "--json")
    found = json.loads(out)
    assert code == 0
    assert set(found) >= KEYS
    assert set(found["final"]) >= FINAL
    assert 0 < found["error_bars"]["z"] < 1e-11


def test_run_for_a_person(proofroll: Proofroll) -> None:
    """Without ``--json`` a run is a table with units, within 80 columns; one of no length is the initial state."""
    code, out, err = proofroll(*with_option("--until", "0"))
    assert (code, err) == (0, "")
    assert " gamma 0 rad " in " ".join(out.split())
    assert "smallest N " in out
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.nightly
def test_run_tells_events(proofroll: Proofroll) -> None:
    """Each event stands with its bracket; of a long sequence the first ones do, and how many more there are."""
    slips = ["run", "sphere_in_cylinder", "--engine", "truth", "--set", "mu_static=0.15"]
    said = [" ".join(proofroll(*slips, "--until", until)[1].split()) for until in ("0.5", "4")]
    place, bar = "of ball_on_wall at", r"± \de-\d+ s"
    assert re.search(rf"events: slip {place} 0\.1766679915\d* {bar}, stick {place} 0\.4120905738\d* {bar} \D", said[0])
    assert re.search(rf"stick {place} \S+ {bar} and 6 more", said[1])


def test_run_writes_netcdf(proofroll: Proofroll, tmp_path: Path) -> None:
    """``--out`` writes the trajectory over what was there, and leaves nothing else behind."""
    from proofroll.files.trajectory_file import read

    target = tmp_path / "new" / "run.nc"
    target.parent.mkdir()
    target.write_text("old")
    code, _, err = proofroll(*RUN, "--out", str(target))
    assert (code, err) == (0, "")
    assert read(target).sizes["time"] == 3
    assert [path.name for path in target.parent.iterdir()] == ["run.nc"]


def test_scenes(proofroll: Proofroll) -> None:
    """Scenes are listed by title, a short line each; one that is named with default, unit, meaning of parameters."""
    code, out, err = proofroll("scenes")
    assert (code, err) == (0, "")
    assert re.search("^sphere_in_cylinder +Sphere rolling on the inside", out, flags=re.MULTILINE)
    assert "rolling_resistance" not in out
    assert out.count("\n") == len(scene_names()) + 1
    assert max(map(len, out.splitlines())) <= 80
    code, out, err = proofroll("scenes", "sphere_in_cylinder")
    assert (code, err) == (0, "")
    assert re.search(r"^rolling_resistance +f +0 +m +", out, flags=re.MULTILINE)
    assert "inclined_plane" not in out
    code, _, err = proofroll("scenes", "no_such_scene")
    assert (code, err.count("\n")) == (2, 1)
    code, out, _ = proofroll("scenes", "--json")
    found = {scene["name"]: scene for scene in json.loads(out)}
    assert found["sphere_in_cylinder"]["parameters"]["speed"]["value"] == 4.0
    assert found["sphere_in_cylinder"]["parameters"]["speed"]["unit"] == "m/s"


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.nightly_of("proofroll compare pap-2-paper")
@pytest.mark.drill_of("proofroll run bric-2-bricard")
@pytest.mark.parametrize(
    ("words", "index", "found"),
    [
        ("proofroll sce", 1, "scenes"),
        ("proofroll run bric", 2, "bricard"),
        ("proofroll compare pap", 2, "paper"),
        ("proofroll compare x --engine exu", 4, "exudyn"),
    ],
)
def test_completion(words: str, index: int, found: str) -> None:
    """A shell completes commands, scenes, comparisons and engines."""
    asked = {"_PROOFROLL_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(index)}
    command = [str(Path(sys.executable).with_name("proofroll"))]
    done = subprocess.run(command, env=os.environ | asked, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == [found]


@pytest.mark.nightly
def test_a_scene_says_which_step_suits_it(proofroll: Proofroll) -> None:
    """A run that fails with a longer step than the scene asks for names the engine with that step, which works."""
    code, _, err = proofroll("run", "andrews_squeezer", "--engine", "exudyn", "--json")
    assert code == 3
    found = re.search("this scene asks for steps of 0.0001 s or less: --engine '(.*)'", err)
    assert found
    assert proofroll("run", "andrews_squeezer", "--engine", found[1], "--json")[0] == 0


@pytest.mark.drill
def test_engines(proofroll: Proofroll, monkeypatch: pytest.MonkeyPatch) -> None:
    """The engines are listed with what they provide, and one that is missing with the reason."""
    monkeypatch.setattr("proofroll.core.plugins.engine_names", lambda: ["absent", "misspelt", "oracle"])
    code, out, err = proofroll("engines", "--json")
    assert (code, err) == (0, "")
    found = {engine["name"]: engine for engine in json.loads(out)}
    assert found["oracle"]["status"] == "installed"
    of_contact = ["contact between bodies", "contact of spheres", "contact with bores"]
    assert found["oracle"]["provides"] == {"only": [*of_contact, "contacts that never slip (friction = inf)"]}
    assert found["absent"]["status"] == "missing"
    assert "no_such_module_anywhere" in found["absent"]["message"]
    assert found["misspelt"]["status"] == "broken"
    code, out, err = proofroll("engines", "--capabilities")
    assert (code, err) == (0, "")
    assert "no_such_module_anywhere" in " ".join(out.split())
    assert "a only (" in out
    rows = [line.split() for line in out.splitlines()]
    assert ["capability", "oracle"] in rows
    assert ["contact", "between", "bodies", "a"] in rows


def test_engines_are_listed_by_their_packages(proofroll: Proofroll, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without more the versions are those of the packages: no engine is loaded or started for them."""
    monkeypatch.setattr("proofroll.running.engine_questions.describe", None)
    monkeypatch.setattr("proofroll.core.plugins.load_engine", None)
    code, out, err = proofroll("engines")
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines()[:-1]}
    assert (code, err) == (0, "")
    assert rows["mujoco"] == [version("mujoco"), "mujoco"]
    assert rows["pinocchio"] == [version("pin"), "pin"]
    assert rows["projection"] == [proofroll_version, "proofroll"]
    monkeypatch.setattr("proofroll.core.plugins.package_of", lambda _: "no_such_package_anywhere")
    words = proofroll("engines")[1].split()
    assert words[words.index("mujoco") + 1 :][:3] == ["not", "installed", "no_such_package_anywhere"]


COMPARISON = """
title = "A claim"
question = "Does it hold?"
scene = "sphere_in_cylinder"
until = 0.1
every = 0.01
vary = { speed = [4] }
tolerances.tight = { because = "the engine is the closed form", z = "1e-9 m", gamma = "1e-9 rad" }

[[rows]]
engine = "ENGINE"
tolerance = "tight"
"""


@pytest.mark.drill
@pytest.mark.nightly_of("exits-3", "absent-3")
@pytest.mark.drill_of("tiny-1")
@pytest.mark.parametrize(("engine", "code"), [("tiny", 1), ("exits", 3), ("absent", 3)])
def test_compare(proofroll: Proofroll, tmp_path: Path, engine: str, code: int) -> None:
    """A claim that a verdict contradicts ends with 1, an engine that is lost with 3."""
    (tmp_path / "claim.toml").write_text(COMPARISON.replace("ENGINE", engine))
    found, out, err = proofroll("compare", str(tmp_path / "claim.toml"), "--out", str(tmp_path / "out"), "--json")
    assert found == code, err
    document = json.loads(out)
    assert document["name"] == "claim"
    assert code == 3 or (document["as_expected"] is False and document["contradictions"])
    assert "Traceback" not in err


@pytest.mark.nightly
def test_compare_on_a_full_disk(tmp_path: Path) -> None:
    """A result that cannot be written ends the comparison with one line and exit 2, and blames no engine."""
    (tmp_path / "claim.toml").write_text(COMPARISON.replace("ENGINE", "projection"))
    program = (
        "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1024, resource.RLIM_INFINITY)); "
        "from proofroll.__main__ import main; main()"
    )
    arguments = ["compare", str(tmp_path / "claim.toml"), "--out", str(tmp_path / "out")]
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], check=False, capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 2, done.stderr
    assert "cannot be written (File too large); choose another folder with --out" in done.stderr
    assert "Traceback" not in done.stderr
    assert not done.stdout


@pytest.mark.nightly
def test_compare_keeps_reuses_and_mends_results(proofroll: Proofroll, tmp_path: Path) -> None:
    """A second comparison runs nothing and says the same; changed results are made again, and a line says so."""
    (tmp_path / "claim.toml").write_text(COMPARISON.replace("ENGINE", "oracle"))
    arguments = ["compare", str(tmp_path / "claim.toml"), "--out", str(tmp_path / "out"), "--json"]
    code, out, err = first = proofroll(*arguments)
    document = json.loads(out)
    assert (code, err, document["as_expected"], document["contradictions"]) == (0, "", True, [])
    cases = tmp_path / "out" / "cases"
    written = {path.name: path.stat().st_mtime_ns for path in cases.iterdir()}
    assert proofroll(*arguments) == first
    assert {path.name: path.stat().st_mtime_ns for path in cases.iterdir()} == written
    for trajectory in cases.glob("*.npz"):
        trajectory.write_bytes(trajectory.read_bytes()[:-1])
    code, out, err = proofroll(*arguments)
    assert (code, json.loads(out)["runs"][0]["verdict"]) == (0, document["runs"][0]["verdict"])
    assert err == "proofroll: 4 stored results were damaged and have been run again\n"


def test_compare_restricted_to_an_engine(proofroll: Proofroll, tmp_path: Path) -> None:
    """An engine that does not exist is a usage error that names those that do."""
    (tmp_path / "claim.toml").write_text(COMPARISON.replace("ENGINE", "oracle"))
    code, out, err = proofroll("compare", str(tmp_path / "claim.toml"), "--engine", "adams", "--out", str(tmp_path))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "there is no such engine; choose one of" in err


@pytest.mark.nightly
def test_an_engine_that_is_asked_for_has_a_row(proofroll: Proofroll, tmp_path: Path) -> None:
    """An engine without a row in the file, also one with settings, has a verdict or a reason; nothing is dropped."""
    (tmp_path / "claim.toml").write_text(COMPARISON.replace("ENGINE", "oracle"))
    engines = ["--engine", "oracle[dt=0.005]", "--engine", "projection[formulation=dependent]"]
    code, out, err = proofroll("compare", str(tmp_path / "claim.toml"), *engines, "--out", str(tmp_path), "--json")
    assert (code, err) == (0, "")
    rows = json.loads(out)["rows"]
    assert [row["name"] for row in rows] == ["oracle", "projection"]
    assert all(row["verdict"] in {"agrees", "refused", "unconfirmed"} for row in rows)
    assert rows[0]["resolution_value"] == 0.005


@pytest.mark.nightly
def test_an_engine_of_a_report_without_a_row(proofroll: Proofroll, tmp_path: Path) -> None:
    """Beside an engine that has rows in a report, one that has none is named once; what was asked for is run."""
    (tmp_path / "claim.toml").write_text(COMPARISON.replace("ENGINE", "oracle"))
    engines = ["--engine", "mujoco", "--engine", "oracle"]
    code, out, err = proofroll("report", str(tmp_path / "claim.toml"), *engines, "--out", str(tmp_path))
    assert code == 0
    assert "oracle" in out
    said = "proofroll: mujoco is left out of claim: no row is of it; proofroll new comparison writes a file with one\n"
    assert err.count(said) == 1


@pytest.mark.drill
@pytest.mark.nightly_of("exits")
@pytest.mark.parametrize("engine", ["absent", "exits"])
def test_an_engine_that_fails_in_a_first_look(proofroll: Proofroll, tmp_path: Path, engine: str) -> None:
    """An engine that is missing or crashes ends a comparison without claims with exit 3, and has a row that says so."""
    code, out, err = proofroll(
        "compare", "sphere_in_cylinder", "--budget", "60", "--engine", engine, "--out", str(tmp_path)
    )
    assert code == 3, err
    assert f"{engine}" in out
    assert "1 fails." in out


@pytest.mark.nightly
def test_times_of_a_first_look(proofroll: Proofroll, tmp_path: Path) -> None:
    """``--until`` and ``--every`` are those of a scene's comparison; a comparison file has its own."""
    command = ["compare", "sphere_in_cylinder", "--engine", "oracle", "--out", str(tmp_path), "--json"]
    code, out, err = proofroll(*command, "--until", "0.2", "--every", "0.05")
    assert code == 0, err
    document = json.loads(out)
    assert (document["until"], document["every"]) == (0.2, 0.05)
    for option, value, words in (("--until", "1e308", "not negative, at most"), ("--every", "0", "positive")):
        code, out, err = proofroll(*command, option, value)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert words in err
    code, out, err = proofroll("compare", "stick_slip", "--until", "1")
    assert (code, out) == (2, "")
    assert "until = 1.0: a comparison file has its own times; name a scene instead" in err


@pytest.mark.nightly
def test_a_name_that_a_scene_and_a_comparison_share(proofroll: Proofroll, tmp_path: Path) -> None:
    """It means the comparison, with a row of what is asked for; with a budget, times or parameters, the scene.

    Exit code 3: the one engine that is asked for refuses, so nothing is judged.
    """
    given = ["compare", "heavy_top", "--out", str(tmp_path), "--engine", "oracle", "--json"]
    code, out, err = proofroll(*given)
    assert (code, err) == (3, "")
    rows = json.loads(out)["rows"]
    assert [(row["name"], row["verdict"]) for row in rows] == [("oracle", "refused")]
    for scene in (["--budget", "60"], ["--set", "mass=2"], ["--until", "0.1"]):
        code, out, err = proofroll(*given, *scene)
        assert (code, err) == (3, "")
        assert json.loads(out)["budget"] is not None


# The paper's case, and one that slips early, in an engine that locates its events.
PAPER = ["--set", "rolling_resistance=5e-4", "--set", "mu_static=0.35"]
EARLY = ["paper", "onset", "sphere_in_cylinder", "--set", "mu_static=0.12", "--until", "0.2"]
LOCATING = "pinocchio[formulation=impulses,preset=tuned]"  # in steps of 1e-3 s


@pytest.mark.nightly
def test_run_lists_events(proofroll: Proofroll) -> None:
    """With bounded friction ``run --json`` lists each slip and stick with its time and its bracket."""
    code, out, err = proofroll(
        "run", "sphere_in_cylinder", "--engine", LOCATING, *PAPER, "--until", "2.1", "--every", "0.05", "--json"
    )
    assert (code, err) == (0, "")
    events = json.loads(out)["events"]
    assert [set(event) for event in events] == [{"kind", "time", "time_low", "time_high", "name"}] * 2
    assert [event["kind"] for event in events] == ["slip", "stick"]
    for event, expected in zip(events, (1.720183172, 2.00812799), strict=True):
        assert event["time"] == pytest.approx(expected, abs=1e-3)
        assert event["time_low"] <= event["time"] <= event["time_high"] < event["time_low"] + 1.1e-3


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.nightly_of("pinocchio[formulation=impulses,preset=tuned]-0-agree-done")
@pytest.mark.parametrize(
    ("engine", "code", "verdict", "status"),
    [
        (LOCATING, 0, "agree", "done"),
        ("mujoco[formulation=geoms,preset=default]", 1, "disagree", "done"),
        ("refuses", 3, "refused", "refused"),
        ("absent", 3, "failed", "missing"),
    ],
)
def test_onset(proofroll: Proofroll, tmp_path: Path, engine: str, code: int, verdict: str, status: str) -> None:
    """An engine that slips with the truth ends with 0, one that does not with 1, one asked for in vain with 3."""
    found, out, err = proofroll(*EARLY, "--engine", engine, "--out", str(tmp_path), "--json")
    assert found == code, err
    assert "Traceback" not in err
    document = json.loads(out)
    assert set(document) >= {"scene", "parameters", "until", "truth", "engines"}
    assert set(document["truth"]) >= {
        "time", "by_mu", "by_f", "edge_below", "edge_above", "distance", "uncertainty", "verdict", "earliest", "latest",
    }  # fmt: skip
    assert document["truth"]["time"] == pytest.approx(0.14413074, abs=1e-8)
    (row,) = document["engines"]
    assert set(row) >= {"engine", "name", "settings", "status", "message", "onset", "difference", "verdict"}
    assert (row["engine"], row["verdict"], row["status"]) == (engine, verdict, status)
    assert (row["onset"] is not None) == (status == "done")
    if code == 0:
        assert set(row["onset"]) == {"kind", "time", "time_low", "time_high", "name"}
        assert abs(row["difference"]) < 1e-3


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("soon", "reached"), [(None, "reached 0.17 s"), (0.05, "reached 0.2 s")])
def test_onset_ends_soon_after_the_slip(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, soon: float | None, reached: str
) -> None:
    """An engine is ended a little after the true slip; one that has not slipped by then runs to the end."""
    if soon is not None:
        monkeypatch.setattr("proofroll.papers.blajer_2006.slip.onset._soon", lambda *_: soon)
    code, out, err = proofroll(*EARLY, "--engine", LOCATING, "--out", str(tmp_path), "--json")
    assert code == 0, err
    (row,) = json.loads(out)["engines"]
    assert (row["message"], row["verdict"]) == (reached, "agree")


def test_onset_where_nobody_was_asked_for(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Among engines that were not asked for by name a refusal is an answer; what a person reads fits 100 columns."""
    monkeypatch.setattr("proofroll.papers.blajer_2006.slip.onset.default_engines", lambda _: ["refuses"])
    code, out, err = proofroll(*EARLY, "--out", str(tmp_path))
    assert code == 0, err
    assert "first slips at 0.144130" in out
    assert "refused" in out
    assert max(map(len, out.splitlines())) <= 100


def test_onset_without_a_ball(proofroll: Proofroll) -> None:
    """A scene that has no ball on a surface is refused for that, and not for friction that it has not."""
    code, out, err = proofroll("paper", "onset", "pendulum")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "one ball that begins to roll in an upright cylinder" in err
    assert "mu_static" not in err


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ([], ["mu_static", "never slips", "--set mu_static="]),
        (["mu_static=inf"], ["mu_static", "never slips", "--set mu_static="]),
        (["mu_static=-1"], ["mu_static = -1", "at least 0"]),
        (["mu_static=0.3", "mu_kinetic=0.4"], ["mu_kinetic = 0.4", "at most mu_static = 0.3"]),
        (["mu_static=nan"], ["mu_static = 'nan'", "finite"]),
    ],
    ids=["unbounded", "infinite", "negative", "kinetic above static", "NaN"],
)
def test_onset_of_friction_that_makes_no_sense(
    proofroll: Proofroll, tmp_path: Path, settings: list[str], words: list[str]
) -> None:
    """Friction without a bound, or with one that makes no sense, gives one line and the exit code of wrong usage."""
    given = [word for setting in settings for word in ("--set", setting)]
    code, out, err = proofroll("paper", "onset", "sphere_in_cylinder", *given, "--out", str(tmp_path), "--json")
    assert (code, out) == (2, "")
    for word in words:
        assert word in err
    assert "Traceback" not in err
    assert err.startswith("proofroll: ")
    assert err.count("\n") == 1


MAP = """
study = "regimes"
title = "A map"
question = "What becomes of the ball?"
scene = "sphere_in_cylinder"
until = 0.5
rolling_resistance = [0.0]
speed = { low = 2, high = 6, count = 3 }
mu_static = { low = 0.05, high = 0.8, count = 3 }
"""


@pytest.mark.drill
def test_regimes(proofroll: Proofroll, tmp_path: Path) -> None:
    """A map of 3 x 3 runs is printed as one JSON document, the same that is written beside the picture."""
    (tmp_path / "map.toml").write_text(MAP)
    arguments = ["paper", "regimes", str(tmp_path / "map.toml"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    code, out, err = proofroll(*arguments, "--json")
    assert code == 0, err
    document = json.loads(out)
    assert set(document) == {"maps", "regimes"}
    (found,) = document["maps"]
    assert set(found) >= {
        "rolling_resistance", "until", "runs", "counts", "outside_boundaries", "speed", "mu_static", "regime",
        "first_slip",
    }  # fmt: skip
    assert (found["rolling_resistance"], found["until"], found["runs"], found["outside_boundaries"]) == (0, 0.5, 9, 0)
    assert found["counts"] == {"never slips": 4, "slips and recovers": 1, "falls": 4}
    assert (found["speed"], found["mu_static"]) == ([2, 4, 6], pytest.approx([0.05, 0.425, 0.8]))
    assert [found["first_slip"][i][j] is None for i in range(3) for j in range(3)] == [
        document["regimes"][str(found["regime"][i][j])] == "never slips" for i in range(3) for j in range(3)
    ]
    assert json.loads((tmp_path / "out" / "regimes.json").read_text()) == document
    assert "<svg" in (tmp_path / "out" / "regimes.svg").read_text()[:2000]


def test_regimes_of_a_file_without_a_map(proofroll: Proofroll, tmp_path: Path) -> None:
    """A comparison asks for no map, which one line says."""
    (tmp_path / "claim.toml").write_text(COMPARISON.replace("ENGINE", "oracle"))
    code, out, err = proofroll(
        "paper", "regimes", str(tmp_path / "claim.toml"), "--out", str(tmp_path / "out"), "--json"
    )
    assert (code, out) == (2, "")
    assert 'study = "regimes"' in err
    assert err.startswith("proofroll: ")
    assert err.count("\n") == 1


@pytest.mark.drill
@pytest.mark.own_workers
def test_a_run_takes_one_process(proofroll: Proofroll, monkeypatch: pytest.MonkeyPatch) -> None:
    """The process that tells the engine's settings also makes the run: starting another costs as much as both."""
    started = []

    class Counted(Worker):
        def __init__(self, *arguments: Any) -> None:
            started.append(self)
            super().__init__(*arguments)

    monkeypatch.setattr("proofroll.running.interpreters.Worker", Counted)
    code, _, err = proofroll("run", "sphere_in_cylinder", "--engine", "reduced", "--until", "0.1", "--json")
    assert (code, len(started)) == (0, 1), err


def test_help_and_version(proofroll: Proofroll) -> None:
    """Help names every command; the version is that of the package; no command at all is wrong usage with help."""
    code, out, _ = proofroll("--help")
    assert code == 0
    lines = out.splitlines()
    assert len(lines) < 24  # with the line of the next command
    assert max(map(len, lines)) <= 80
    rows = [re.fullmatch(r"(\w*) +(\w+)  +([A-Z].*)", line) for line in lines[2:]]
    assert [row[2] for row in rows if row] == [name for names in GROUPS.values() for name in names]
    assert [row[1] for row in rows if row and row[1]] == list(GROUPS)
    assert all(row[3].endswith(".") and "..." not in row[3] for row in rows if row)  # no summary is cut
    assert proofroll("--version") == (0, "proofroll 0.1.0\n", "")
    assert proofroll()[0] == 2
    code, out, err = proofroll("new")
    assert (code, err, out.startswith("Usage: ")) == (2, "", True)


@pytest.mark.nightly_of("-")
@pytest.mark.drill
@pytest.mark.parametrize(
    ("shell", "shown"),
    [
        ("PYTHONIOENCODING=ascii", "N?rsett"),
        ("", ""),
    ],
)
def test_a_poor_output(shell: str, shown: str) -> None:
    """A terminal that has not our signs shows others, and a closed output shows nothing; neither ends the command."""
    command = f"{shell} {sys.executable} -m proofroll cite {'' if shell else '>&-'}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert shown in done.stdout


@pytest.mark.drill
def test_a_map_of_stability(proofroll: Proofroll, tmp_path: Path) -> None:
    """One JSON document with the boundaries of every point; the map and the programs lie beside the cases."""
    file = tmp_path / "made.toml"
    file.write_text(
        'study = "stability"\ntitle = "t"\nquestion = "q"\nscene = "sphere_in_cylinder"\n'
        '[[axes]]\nname = "V0"\nunit = "m/s"\nmeaning = "speed"\nvalues = [4]\nparameters.speed = {}\n'
        '[[claims]]\nengine = "projection"\nboundary = "stable"\nnever = true\nbecause = "to be contradicted"\n'
    )
    engine = "projection[formulation=rotating_frame,preset=default]"
    arguments = ["stability", str(file), "--engine", engine, "--quick", "--jobs", "1", "--out", str(tmp_path / "out")]
    code, out, err = proofroll(*arguments, "--json")
    found = json.loads(out)
    assert code == 1, err
    assert {"points", "silent", "failures", "boundaries", "runs"} <= found.keys()
    (point,) = found["points"]
    assert {
        "engine",
        "settings",
        "axis",
        "value",
        "largest_stable",
        "largest_accurate",
        "failure",
        "silent",
    } <= point.keys()
    assert 0 < point["largest_accurate"] <= point["largest_stable"]
    assert found["claims"]["contradictions"]
    assert {path.suffix for path in (tmp_path / "out" / "stability").glob("sphere*") if path.is_file()} == {
        ".json",
        ".html",
    }
    (page,) = (tmp_path / "out" / "stability").glob("*.html")
    text = page.read_text(encoding="utf-8")
    assert 'class="heat"' in text
    assert "projection solver rotating frame, as installed" in text


@pytest.mark.nightly
def test_a_reader_that_stops_reading() -> None:
    """Output into a pipe that is closed early, as by head, is no error, while a command writes or at its end."""
    for words in ("scenes --json", "scenes", "--version"):
        reader, writer = os.pipe()
        os.close(reader)
        asked = [sys.executable, "-m", "proofroll", *words.split()]
        done = subprocess.run(asked, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
        os.close(writer)
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.drill
def test_a_width_of_nothing(command_line: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    """COLUMNS=0, as some shells say of a window of unknown size, is taken for 80."""
    shown = {}
    for width in ("0", "80"):
        monkeypatch.setenv("COLUMNS", width)
        shown[width] = command_line("findings", "--list")
    assert shown["0"] == shown["80"]
    assert shown["0"][1].strip()


@pytest.mark.drill
def test_run_with_orientation(proofroll: Proofroll, tmp_path: Path) -> None:
    """``--ask orientation`` makes an engine follow it that otherwise would not."""
    from proofroll.files.trajectory_file import read

    arguments = with_option("--engine", "projection[formulation=rotating_frame]")
    for asked in ([], ["--ask", "orientation"]):
        code, out, err = proofroll(*arguments, *asked, "--out", str(tmp_path / "run.nc"))
        assert (code, err) == (0, "")
        assert ("q_WB" in read(tmp_path / "run.nc")) == bool(asked)
        assert ("attitude.w " in out) == bool(asked)


@pytest.mark.nightly
def test_ladder(proofroll: Proofroll, tmp_path: Path) -> None:
    """The ladder is two tables and sentences within 100 columns, or one JSON document; a missing engine exits 3."""
    arguments = ["ladder", "sphere_in_cylinder", "--engine", "laddered", "--until", "0.1", "--out", str(tmp_path)]
    arguments += ["--rounds", "2"]
    code, out, err = proofroll(*arguments, "--tolerance", "1e-3")
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 100
    assert "The cheapest within 0.001 m is laddered" in " ".join(out.split())
    code, out, err = proofroll(*arguments, "--engine", "absent", "--json")
    assert (code, err) == (3, "")
    found = json.loads(out)
    assert set(found) >= {"rungs", "terms", "findings", "quantity", "unit", "truth", "machine"}
    assert found["absent"]["absent"]["status"] == "missing"


def test_a_page_is_refused_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where what draws pages is not installed, one line says so before anything is run."""
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "itables" else name)
    with pytest.raises(Missing, match=r"pages need itables, .*: pip install 'proofroll\[report\]'"):
        require_pages()
