"""Answers by a reference by steps: its own formulation is neither run nor advised."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")
pytestmark = pytest.mark.nightly

Proofroll = Callable[..., tuple[int, str, str]]
OWN = "its steps are the reference, which is no judge of itself"
STOOL = """<mujoco model="stool"><worldbody><geom name="floor" type="plane" size="0 0 1"/>
<body name="seat" pos="0 0 0.101"><freejoint name="root"/><geom name="ball" size="0.1" mass="1" friction="0.4"
priority="1"/><body name="arm"><joint name="h" axis="0 1 0"/><inertial mass="0.1" pos="0 0 0.1"
diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody>
<actuator><position joint="h" kp="2" kv="0.1"/></actuator></mujoco>"""


@pytest.fixture
def asked(tmp_path: Path) -> list[str]:
    """A robot that lands on its floor, its controller, and what is asked."""
    path, control = tmp_path / "stool.xml", tmp_path / "stand.toml"
    path.write_text(STOOL)
    control.write_text("rate = 50\n[ground]\n")
    options = ["--control", str(control), "--until", "0.1", "--tolerance", "1 mm", "--out", str(tmp_path / "out")]
    return [str(path), *options]


def test_no_reference_is_advised_by_itself(proofroll: Proofroll, asked: list[str]) -> None:
    """The formulation of the reference is not run, and the answer says why; other engines are judged by it."""
    _, out, _ = proofroll("recommend", *asked, "--engine", "pinocchio", "--engine", "mujoco", "--json")
    answer = json.loads(out)
    states = {item["engine"]: (item["state"], item["why"], item["settings"]) for item in answer["engines"]}
    assert states["pinocchio"] == ("cannot", OWN, [])
    assert states["mujoco"][0] == "holds"


def test_no_step_of_a_reference_is_judged_by_it(proofroll: Proofroll, asked: list[str]) -> None:
    """A step of its formulation is neither good enough nor not: it is not judged, with exit code 3."""
    code, out, _ = proofroll("compare", *asked, "--engine", "pinocchio[formulation=impulses,dt=1e-3]")
    assert code == 3
    assert out.startswith(f"Not judged: {OWN}.")
