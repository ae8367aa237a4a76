"""docs/json.md has the fields that commands print with --json, no more and no fewer."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from robot_templates import urdf

TEXT = (Path(__file__).resolve().parents[1] / "docs" / "json.md").read_text(encoding="utf-8")
Proofroll = Callable[..., tuple[int, str, str]]
RUN = ["--engine", "oracle", "--until", "0.1", "--every", "0.05"]
CLAIM = """title = "A claim"
question = "Does it agree?"
scene = "sphere_in_cylinder"
until = 0.1
every = 0.05
timed = false
[tolerances.close]
because = "a look"
z = "1 %"
[[rows]]
engine = "oracle"
tolerance = "close"
"""


def fields(title: str) -> set[str]:
    """Fields that a section of the document has."""
    section = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert section is not None
    return set(re.findall(r"^\| `(\w+)` \|", section[1], flags=re.MULTILINE))


@pytest.mark.parametrize(
    ("title", "arguments"),
    [
        ("`scenes --json`", ["scenes"]),
        ("`check --json` of a scene or a study", ["check", "pendulum"]),
        ("`check --json` of a scene or a study", ["check", "claim.toml"]),
        ("`run --json`", ["run", "inclined_plane", *RUN]),
        ("`compare --json`", ["compare", "claim.toml"]),
        ("`engines --json`", ["engines"]),
    ],
    ids=["scenes", "check-scene", "check-study", "run", "compare", "engines"],
)
def test_fields(
    command_line: Proofroll,
    install_engines: Callable[[Mapping[str, str]], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    title: str,
    arguments: list[str],
) -> None:
    """The document has each field of its table, and the table each of the document."""
    install_engines({"oracle": "hostile:Oracle", "absent": "no_such_module_anywhere:Engine"})
    monkeypatch.chdir(tmp_path)
    Path("claim.toml").write_text(CLAIM, encoding="utf-8")
    code, out, _ = command_line(*arguments, "--json")
    found = json.loads(out)
    assert code in {0, 1}
    items = found if isinstance(found, list) else [found]
    if arguments == ["engines"]:  # those that cannot be asked say so instead
        items = [item for item in items if item["status"] == "installed"]
    assert items
    without = {"absent", "smallest_N", "error_bars", "trajectory", "plot"} if arguments[0] == "run" else set()
    for item in items:
        assert set(item) - without == fields(title)


def test_a_robot_file(proofroll: Proofroll, tmp_path: Path) -> None:
    """The document about a robot file has each field of its table, and the table each of the document."""
    robot = tmp_path / "arm.urdf"
    robot.write_text(urdf(), encoding="utf-8")
    _, out, _ = proofroll("check", str(robot), "--engine", "mujoco", "--states", "1", "--json")
    assert set(json.loads(out)) == fields("`check --json` of a robot file")
