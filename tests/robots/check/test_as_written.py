"""The file as it is, beside the copy without looks and contacts that engines are compared by."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from robot_templates import mjcf, urdf

from proofroll.core.errors import InputError
from proofroll.robots.check import check
from proofroll.robots.check.importer_row import row_with_copy
from proofroll.robots.check.records import ImporterRow
from proofroll.robots.files.meaning import CheckSettings
from proofroll.robots.files.reading import AsWritten
from proofroll.robots.protocol import Whole

Proofroll = Callable[..., tuple[int, str, str]]

pytestmark = pytest.mark.drill  # each imports an engine, or the first of them does
LOOKS = '<geom type="mesh" mesh="look" contype="0" conaffinity="0" mass="0"/>'


def _rows(path: Path, *engines: str, **given: Any) -> dict[str, ImporterRow]:
    return {row.engine: row for row in check.check(path, engines, CheckSettings(states=2, **given)).engines}


def test_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine that reads the file as it is says so; one that is fed says nothing; all say their names for people."""
    monkeypatch.setattr("proofroll.robots.files.reading.KNOWN_TITLES", titles := dict[str, str]())
    path = tmp_path / "robot.xml"
    path.write_text(mjcf())
    rows = _rows(path, "mujoco", "pinocchio", "exudyn")
    assert {name: row.as_written for name, row in rows.items()} == {
        "mujoco": "read", "pinocchio": "read", "exudyn": None,
    }  # fmt: skip
    assert titles == {"mujoco": "MuJoCo", "pinocchio": "Pinocchio", "exudyn": "Exudyn"}


def test_what_no_joint_moves_has_no_part(tmp_path: Path) -> None:
    """A body that is only set, and what is fixed to the world, is no mass that joints carry."""
    path = tmp_path / "robot.xml"
    path.write_text(mjcf(extra='<body name="goal" mocap="true"><geom size="0.1"/></body>'))
    assert _rows(path, "mujoco")["mujoco"].as_written == "read"


def test_refused(proofroll: Proofroll, tmp_path: Path) -> None:
    """A file whose looks are missing is compared without them, and the refusal of the file as it is is told once."""
    path = tmp_path / "robot.xml"
    mesh = '<asset><mesh name="look" file="absent.stl"/></asset><worldbody>'
    path.write_text(
        mjcf(base='<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>' + LOOKS).replace("<worldbody>", mesh)
    )
    code, out, _ = proofroll("check", str(path), "--engine", "mujoco", "--states", "2")
    assert code == 0
    said = " ".join(out.split())
    assert said.count("The file as it is: MuJoCo: refused (ValueError") == 1
    assert "absent.stl" in said


def test_base_and_options(tmp_path: Path) -> None:
    """The file as it is is read with the base and the options that were asked for."""
    path = tmp_path / "robot.urdf"
    path.write_text(urdf())
    for base in ("fixed", "free"):
        rows = _rows(path, "mujoco", "mujoco[fusestatic=false]", "pinocchio", base=base)
        assert {row.as_written for row in rows.values()} == {"read"}


def test_files_elsewhere(tmp_path: Path) -> None:
    """A file that names others outside its folder is not loaded as it is."""
    path = tmp_path / "robots" / "robot.urdf"
    path.parent.mkdir()
    path.write_text(urdf(tool='<visual><geometry><mesh filename="../tool.stl"/></geometry></visual>'))
    assert _rows(path, "mujoco")["mujoco"].as_written is None
    assert str(_rows(path, "mujoco", root=tmp_path)["mujoco"].as_written).startswith(("read", "refused"))


@pytest.mark.parametrize(
    ("whole", "said"),
    [(Whole(3, 2.0), "read"), (Whole(2, 2.0), "2 velocities"), (Whole(3, 2.01), "2.01 kg"), (None, "refused (why)")],
)
def test_another_model(whole: Whole | None, said: str) -> None:
    """A file that an engine holds with other velocities or another mass than its copy is not called read."""
    row = ImporterRow(engine="e", status="holds", held=Whole(3, 2.0))
    found = row_with_copy(AsWritten(whole, "" if whole else "why"), row)
    assert said in found
    assert (found == "read") == (said == "read")


def test_what_is_not_covered_is_ours(tmp_path: Path) -> None:
    """A refusal of what the check does not cover is not signed by an engine; that of a broken file is."""
    pytest.importorskip("mujoco")
    path = tmp_path / "robot.xml"
    tendon = '<tendon><fixed armature="0.1"><joint joint="k1" coef="1"/></fixed></tendon></mujoco>'
    path.write_text(mjcf().replace("</mujoco>", tendon))
    with pytest.raises(InputError, match="a tendon has armature, which the check does not cover") as caught:
        check.check(path, ["mujoco"])
    assert "mujoco" not in caught.value.advice
    path.write_text(mjcf(joint='damping="much"'))
    with pytest.raises(InputError, match=r"mujoco .* refuses it: ValueError") as caught:
        check.check(path, ["mujoco"])
    assert ".py" not in str(caught.value)


def test_no_joint_is_an_answer(tmp_path: Path) -> None:
    """An engine that keeps only a first tree in which nothing moves holds no joints, and the cause is named."""
    path = tmp_path / "robot.xml"
    path.write_text(mjcf().replace("<worldbody>", '<worldbody><body name="table"><geom size="1"/></body>'))
    row = _rows(path, "pinocchio")["pinocchio"]
    assert row.status == "explained"
    assert [cause.id for cause in row.causes] == ["first_tree_only"]


def test_json(proofroll: Proofroll, arm: Path) -> None:
    """The JSON has what engines do with the file as it is."""
    _, out, _ = proofroll("check", str(arm), "--engine", "pinocchio", "--states", "2", "--json")
    assert json.loads(out)["engines"][0]["as_written"] == "read"


def test_defaults_of_an_included_file(tmp_path: Path) -> None:
    """What an engine reads from a file and one that it includes, both with defaults, it reads from our copy."""
    pytest.importorskip("pinocchio")
    (tmp_path / "common.xml").write_text('<mujoco><default><geom condim="4"/></default></mujoco>')
    own = '<default><geom condim="3"/><default class="k"><joint damping="0.1"/></default></default><worldbody>'
    path = tmp_path / "robot.xml"
    path.write_text(mjcf(joint='class="k"').replace("<worldbody>", '<include file="common.xml"/>' + own))
    row = _rows(path, "pinocchio")["pinocchio"]
    assert (row.status, row.as_written) == ("explained", "read")
    assert [cause.id for cause in row.causes] == ["damping_left_out"]
