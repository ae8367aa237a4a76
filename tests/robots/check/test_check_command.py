"""``proofroll check``: what it prints, writes and returns."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from robot_templates import inertial, mjcf, urdf

from proofroll.report.terminal.screen import console
from proofroll.robots.check import check
from proofroll.robots.check.layers import LAYERS
from proofroll.robots.check.records import DrawnRobot, HeldLayer, ImporterRow, RobotCheck, UsedTruth
from proofroll.robots.check.terminal import SHORT, WIDTH, lines, table
from proofroll.robots.files.meaning import CheckSettings

Proofroll = Callable[..., tuple[int, str, str]]

pytestmark = pytest.mark.drill  # each imports an engine, or the first of them does
Install = Callable[[Mapping[str, str]], None]


def test_what_our_feed_leaves_out_is_no_fault_of_the_engine(proofroll: Proofroll, tmp_path: Path) -> None:
    """Of an engine without an importer a cause is told of our feed: another mark, no remedy, no exit 1.

    Elements of one name are counted.
    """
    path = tmp_path / "robot.urdf"
    text = urdf(first='<dynamics friction="0.7"/>')
    path.write_text(text.replace("</robot>", "<gazebo/><gazebo/><transmission/></robot>"))
    code, out, _ = proofroll("check", str(path), "--engine", "exudyn")
    said = " ".join(out.split())
    assert code == 0
    assert re.search(r"Exudyn [\d.]+ ◐ ", said)
    assert ", as we feed it, differs in forward dynamics by " in said
    assert "Do: " not in said
    assert "note: 2 × gazebo, transmission: options for one program" in said


def test_json(proofroll: Proofroll, arm: Path) -> None:
    """The JSON has the file, its kind and findings, and for every engine version, layers and causes."""
    names = ("mujoco", "pinocchio", "exudyn")
    asked = [word for name in names for word in ("--engine", name)]
    code, out, _ = proofroll("check", str(arm), *asked, "--states", "3", "--json")
    content = json.loads(out)
    assert code == 0
    assert content["kind"] == "urdf"
    assert content["truth"]["difference"] < 1e-14
    engines = {row["engine"]: row for row in content["engines"]}
    for name in names:
        row = engines[name]
        assert row["version"]
        assert row["message"] is None
        assert row["causes"] == []
        assert set(row["layers"]) >= {"mass", "kinematics", "bodies", "mass matrix", "gravity", "bias"}
        assert all(set(layer) == {"difference", "tolerance", "holds"} for layer in row["layers"].values())


def test_a_difference(proofroll: Proofroll, tmp_path: Path) -> None:
    """A difference makes the command exit 1, names the cause with its numbers, and keeps within 80 columns."""
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(first='<dynamics damping="0.7"/>'))
    code, out, _ = proofroll("check", str(path), "--engine", "pinocchio", "--out", str(tmp_path / "out"))
    assert code == 1
    assert max(map(len, out.splitlines())) <= 80
    said = " ".join(out.split())
    assert "explained by: damping is not used in the forward dynamics; with that hypothesis" in said
    assert "Do: subtract damping" in said
    kept = json.loads((tmp_path / "out" / "check.json").read_text())
    (cause,) = kept["engines"][0]["causes"]
    assert cause["layer"] == "forward dynamics"
    assert cause["before"] > 1e-2
    assert cause["after"] < 1e-10


@pytest.mark.parametrize("law", ["", 'damping="2"', 'solreffriction="0.05 1" solimpfriction="0.6 0.8 0.001 0.5 2"'])
def test_softness_of_dry_friction(proofroll: Proofroll, tmp_path: Path, law: str) -> None:
    """MuJoCo holds an MJCF with dry friction, and the creep that is told is that of its own run under a load."""
    mujoco = pytest.importorskip("mujoco")
    body = '<body name="a"><joint name="h" axis="0 1 0" frictionloss="0.3" {}/><geom size="0.1" pos="0.3 0 0"/></body>'
    text = f"<mujoco><worldbody>{body.format(law)}</worldbody></mujoco>"
    path = tmp_path / "dry.xml"
    path.write_text(text)
    code, out, _ = proofroll("check", str(path), "--engine", "mujoco")
    assert code == 0
    model = mujoco.MjModel.from_xml_string(text.replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>'))
    data = mujoco.MjData(model)
    data.qfrc_applied[:] = 0.3 / 2
    mujoco.mj_step(model, data, 5000)
    told = re.search(r"joint h creeps at up to (\S+) rad/s", " ".join(out.split()))
    assert told is not None
    assert float(told[1]) == pytest.approx(2 * data.qvel[0], rel=0.05)


def test_wide_table(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A row in which every layer fails, and a long name, fit into 80 columns without a number cut off or put below."""
    layers = {layer: HeldLayer(1.234e-12 * 7**n, 0.0, False) for n, layer in enumerate(LAYERS)}
    name = "pybullet[inertia_from_file=false]"
    rows = [
        ImporterRow(engine=name, version="3.2.7", status="differs", layers=layers),
        ImporterRow(engine="mujoco", version="4.0.0", status="crashed"),
    ]
    truth, robot = UsedTruth("us", 0.0, 1, 0, 1), DrawnRobot("robot", [], {})
    content = RobotCheck("robot.urdf", "urdf", "fixed", [], truth, LAYERS, rows, robot)
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    console().print(table(content))
    heading, *shown = capsys.readouterr().out.splitlines()
    assert max(map(len, (heading, *shown))) <= 80
    assert heading.split() == ["engine", *SHORT.values()]
    assert shown[0].count("e-") == len(LAYERS)
    assert shown[0].count("…") == 1
    assert shown[1].strip() == "3.2.7"
    assert "!" in shown[2]


@pytest.mark.parametrize(("count", "said"), [(1, "1 velocity, 1 state"), (6, "6 velocities, 6 states")])
def test_one_is_not_many(count: int, said: str) -> None:
    """What was read is counted in words that fit the number."""
    truth = UsedTruth("us", 0.0, count, 0, count)
    content = RobotCheck("robot.urdf", "urdf", "fixed", [], truth, LAYERS, [], DrawnRobot("robot", [], {}))
    assert next(lines(content)) == f"robot.urdf: URDF, fixed base, {said}"


def test_page_escapes(proofroll: Proofroll, tmp_path: Path) -> None:
    """The page shows names from the file as text, loads nothing, and marks what is held differently."""
    path = tmp_path / "robot.urdf"
    evil = "&lt;script&gt;alert(1)&lt;/script&gt;"
    box = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
    path.write_text(urdf(tool=box).replace('"tip"', f'"{evil}"').replace('name="arm"', f'name="{evil}"'))
    code, _, _ = proofroll("check", str(path), "--engine", "mujoco", "--out", str(tmp_path / "out"))
    page = (tmp_path / "out" / "check.html").read_text()
    assert code == 1
    assert "<script" not in page
    assert evil in page
    assert 'class="revolute wrong"' in page
    assert "//" not in page


BAD_READERS = {
    "Crashing": ("crashed", "SIGABRT"),
    "Raising": ("refused", "RuntimeError: cannot <b>read</b> [bold]this[/bold]"),
    "Broken": ("crashed", "the reader of broken failed"),
    "Odd": ("crashed", "two joints are called 'j1'"),
    "Misshapen": ("crashed", "position j1 has shape (4, 3), not (2, 3)"),
}


@pytest.mark.nightly
def test_bad_readers(proofroll: Proofroll, install_readers: Install, arm: Path) -> None:
    """An importer that crashes, raises or is mistaken is a row beside the others."""
    install_readers({name.lower(): name for name in BAD_READERS})
    asked = [word for name in (*BAD_READERS, "pinocchio") for word in ("--engine", name.lower())]
    code, out, _ = proofroll("check", str(arm), *asked, "--states", "2", "--json")
    *rows, good = json.loads(out)["engines"]
    assert code == 1
    for row, (status, said) in zip(rows, BAD_READERS.values(), strict=True):
        assert row["status"] == status
        assert said in row["message"]
    assert good["status"] == "holds"


def test_a_reader_that_hangs(proofroll: Proofroll, install_readers: Install, arm: Path) -> None:
    """An importer that never answers is a row after the time limit."""
    install_readers({"bad": "Hanging"})
    code, out, _ = proofroll("check", str(arm), "--engine", "bad", "--time-limit", "1", "--json")
    (row,) = json.loads(out)["engines"]
    assert code == 1
    assert row["status"] == "timeout"
    assert "no result within 1 s" in row["message"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--engine", "nothing"], "reads no robot files"),
        (["--engine", "mujoco[nothing=true]"], "there is no such option; it has fusestatic"),
        (["--engine", "mujoco[fusestatic=2]"], "is true or false"),
        (["--base", "loose"], "choose one of fixed, free"),
        (["--states", "0"], "0"),
    ],
)
def test_bad_options(proofroll: Proofroll, arm: Path, arguments: list[str], said: str) -> None:
    """An option that is wrong gives one line and exit code 2."""
    code, out, err = proofroll("check", str(arm), *arguments)
    assert code == 2
    assert said in err
    assert out == ""
    assert err.count("\n") == 1


def test_what_cannot_be(proofroll: Proofroll, tmp_path: Path) -> None:
    """A file with an inertia that no body has is compared, and not called right though an engine holds it."""
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(tip=inertial(ixx="0.01", iyy="0.01", izz="0.9")))
    code, out, _ = proofroll("check", str(path), "--engine", "pinocchio", "--states", "1")
    assert code == 1
    assert "error: link tip: its inertia breaks the triangle inequality" in out


def test_what_is_no_number(proofroll: Proofroll, tmp_path: Path) -> None:
    """A number that MuJoCo compiles though it is none is refused by name."""
    path = tmp_path / "robot.xml"
    path.write_text(mjcf(joint='armature="nan"'))
    code, out, err = proofroll("check", str(path), "--engine", "mujoco", "--states", "1")
    assert (code, out) == (2, "")
    assert "robot.xml: armature of k1 = 'nan': numbers must be finite" in err
    joints = '<equality><joint joint1="k1" joint2="k2" polycoef="0 nan 0 0 0"/></equality></mujoco>'
    path.write_text(mjcf().replace("</mujoco>", joints))
    code, out, err = proofroll("check", str(path), "--engine", "mujoco", "--states", "1")
    assert (code, out) == (2, "")
    assert "robot.xml: multiplier of k1 = 'nan': numbers must be finite" in err


def test_nothing_moves(proofroll: Proofroll, tmp_path: Path) -> None:
    """A robot without moving joints is no question; a free base makes it one."""
    path = tmp_path / "robot.urdf"
    path.write_text(f'<robot name="stone"><link name="stone">{inertial()}</link></robot>')
    code, _, err = proofroll("check", str(path))
    assert code == 2
    assert "nothing in it moves; try --base free" in err
    code, _, _ = proofroll("check", str(path), "--base", "free", "--engine", "mujoco")
    assert code == 0


@pytest.mark.nightly
@pytest.mark.own_workers
def test_who_compiles_a_file_also_reads_it(proofroll: Proofroll, tmp_path: Path, started_workers: list[str]) -> None:
    """The engine that defines the format is started once: for what the file means, and for what the engine holds."""
    path = tmp_path / "robot.xml"
    path.write_text(mjcf())
    assert proofroll("check", str(path), "--engine", "mujoco", "--states", "2")[0] == 0
    assert len(started_workers) == 1


def test_an_answer_that_cannot_be_judged(monkeypatch: pytest.MonkeyPatch, arm: Path) -> None:
    """A mistake while one engine's answer is judged is that engine's row; the other rows arrive."""
    honest = check.importer_row

    def importer_row(*given: Any) -> ImporterRow:
        if given[3].name == "exudyn":
            raise ZeroDivisionError("planted")
        return honest(*given)

    monkeypatch.setattr(check, "importer_row", importer_row)
    odd, other = check.check(arm, ["exudyn", "pinocchio"], CheckSettings(states=2)).engines
    assert odd.status == "crashed"
    assert "ZeroDivisionError: planted" in str(odd.message)
    assert other.status == "holds"
