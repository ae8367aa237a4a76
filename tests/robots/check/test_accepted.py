"""Exit 1 is news: what a user accepts, what engines are fed without, and notes that repeat, are not."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from robot_templates import mjcf, urdf

from proofroll.robots.check.terminal import remark_lines
from proofroll.robots.files.robot_file import LintRemark

Proofroll = Callable[..., tuple[int, str, str]]

pytestmark = pytest.mark.drill  # each imports an engine, or the first of them does
BOTH = '<dynamics damping="0.7" friction="0.4"/>'


@pytest.fixture
def damped(tmp_path: Path) -> Path:
    """A URDF whose damping and friction Pinocchio leaves out."""
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(third=BOTH))
    return path


def test_accepted_causes(proofroll: Proofroll, damped: Path) -> None:
    """A difference exits 0 if all of its causes are accepted, and 1 if one is not; the causes are told all the same."""
    asked = ("check", str(damped), "--engine", "pinocchio", "--states", "2")
    assert proofroll(*asked)[0] == 1
    assert proofroll(*asked, "--accept", "damping_left_out")[0] == 1
    assert proofroll(*asked, "--accept", "damping_left_out", "--accept", "friction_left_out")[0] == 0
    code, out, _ = proofroll(*asked, "--accept", "damping_left_out, friction_left_out", "--json")
    (row,) = json.loads(out)["engines"]
    assert code == 0
    assert row["accepted"]
    assert {cause["id"] for cause in row["causes"]} == {"damping_left_out", "friction_left_out"}


def test_accepted_beside_the_file(proofroll: Proofroll, damped: Path) -> None:
    """Causes in a file beside the robot's are accepted together with those of the command."""
    asked = ("check", str(damped), "--engine", "pinocchio", "--states", "2")
    damped.with_suffix(".accept.toml").write_text('causes = ["damping_left_out"]')
    assert proofroll(*asked)[0] == 1
    assert proofroll(*asked, "--accept", "friction_left_out")[0] == 0


def test_no_such_cause(proofroll: Proofroll, damped: Path) -> None:
    """A cause that does not exist is refused where it is written."""
    code, _, said = proofroll("check", str(damped), "--accept", "damping")
    assert code == 2
    assert "--accept" in said
    damped.with_suffix(".accept.toml").write_text('causes = "damping_left_out"')
    code, _, said = proofroll("check", str(damped))
    assert code == 2
    assert "write a list of causes" in " ".join(said.split())


@pytest.mark.nightly
def test_what_an_engine_is_fed_without(proofroll: Proofroll, tmp_path: Path) -> None:
    """An engine without an importer does not make the command exit 1 by what it leaves out."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf(joint='armature="0.2"'))
    code, out, _ = proofroll("check", str(path), "--engine", "exudyn", "--states", "2", "--json")
    (row,) = json.loads(out)["engines"]
    assert row["status"] == "explained"
    assert row["fed"]
    assert code == 0


def test_repeated_findings() -> None:
    """Findings that say the same of several places are one line with their number."""
    found = [LintRemark("note", f"link l{n}", "it is turned") for n in range(138)]
    assert list(remark_lines(found)) == ["note: link l0, link l1 and 136 more: it is turned"]
    assert list(remark_lines(found[:2])) == ["note: link l0, link l1: it is turned"]


def test_notes_stand_below(proofroll: Proofroll, tmp_path: Path) -> None:
    """Warnings stand above the table, notes below it."""
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(extra="<gazebo/><wheel/>"))
    _, out, _ = proofroll("check", str(path), "--engine", "pinocchio", "--states", "2")
    assert out.index("warning: wheel") < out.index("joints mass") < out.index("note: gazebo")


def test_where_it_differs(proofroll: Proofroll, tmp_path: Path) -> None:
    """A difference names the body or joint, the state, the value that is held and the true one."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf(option='gravity="0 1 -3"'))
    _, out, _ = proofroll("check", str(path), "--engine", "pinocchio", "--states", "2")
    assert re.search(r"most at joint k[12]: \S+ at state [01], true", " ".join(out.split()))
    box = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(tool=box))
    _, out, _ = proofroll("check", str(path), "--engine", "mujoco", "--states", "2")
    assert re.search(r"most at body tip: mass 7\.3, true 1\.3", " ".join(out.split()))
