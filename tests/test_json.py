"""docs/json.md has the fields that commands print with --json, no more and no fewer."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Any

import pytest
import typer
from robot_templates import urdf

from proofroll.cli import app
from proofroll.core.certificate import Line
from proofroll.core.comparison import Band, ExceptAt, Row, Tolerance
from proofroll.core.diagnosis import Cause
from proofroll.files.json_data import MERGED
from proofroll.papers.blajer_2006.slip.onset import EngineOnset, OnsetStudy
from proofroll.papers.blajer_2006.truth.onset import Onset
from proofroll.report.changes import Against, RunChange
from proofroll.report.comparison.records import (
    ReportedComparison,
    ReportedRow,
    ReportedRun,
    ShownObservable,
    WorstJudgement,
)
from proofroll.report.ladder import Absence, KnownTruth, LadderContent, RungFound, SideFound, TermFound
from proofroll.report.page.first_screen import ReportedAnswer
from proofroll.robots.check.explain import RobotCause
from proofroll.robots.check.records import (
    DrawnBody,
    DrawnJoint,
    DrawnRobot,
    HeldLayer,
    ImporterRow,
    RobotCheck,
    UnlikeValue,
    UsedTruth,
)
from proofroll.robots.control.judge import RecordJudgement
from proofroll.robots.control.record import Layer, LayerCause
from proofroll.robots.files.robot_file import LintRemark
from proofroll.running.timing import Interval
from proofroll.studies.answer.records import (
    AllowedError,
    EngineAnswer,
    SceneAnswer,
    SettingTried,
    StepAnswer,
    StepTried,
)
from proofroll.studies.ladder.models import Ran
from proofroll.studies.stability.axes import Axis, Effort
from proofroll.studies.stability.records import (
    Boundary,
    BoundaryPoint,
    ExplainedBoundary,
    JudgedFile,
    MappedValue,
    StabilityStudy,
)
from proofroll.studies.study_store import Measured
from proofroll.studies.versions.two_runs import TwoRuns
from proofroll_drill.mutants.drilling import Mutated
from proofroll_drill.row import Drilled
from proofroll_fuzz.hunt import FoundKind, Hunt
from proofroll_fuzz.shrink import SmallestScene
from proofroll_fuzz.surprises import Surprise, SurpriseKind
from proofroll_throughput.study import Throughput, ThroughputRow

DOCS = Path(__file__).resolve().parents[1] / "docs"
TEXT = (DOCS / "json.md").read_text(encoding="utf-8")
Proofroll = Callable[..., tuple[int, str, str]]
RUN = ["--engine", "oracle", "--until", "0.1", "--every", "0.05"]
SLIPS = ["--set", "mu_static=0.12", "--until", "0.2"]
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


def section(title: str, text: str = TEXT) -> str:
    """What stands below a title."""
    found = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", text, flags=re.DOTALL | re.MULTILINE)
    assert found is not None
    return found[1]


def fields(title: str) -> set[str]:
    """Fields that a section of the document has."""
    return set(re.findall(r"^\| `(\w+)` \|", section(title), flags=re.MULTILINE))


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.nightly_of("check-study", "ladder", "engines")
@pytest.mark.drill_of("compare")
@pytest.mark.parametrize(
    ("title", "arguments"),
    [
        ("`scenes --json`", ["scenes"]),
        ("`check --json` of a scene or a study", ["check", "pendulum"]),
        ("`check --json` of a scene or a study", ["check", "claim.toml"]),
        ("`run --json`", ["run", "sphere_in_cylinder", *RUN]),
        ("`compare --json`", ["compare", "claim.toml"]),
        ("`ladder --json`", ["ladder", "sphere_in_cylinder", "--engine", "oracle", "--until", "0.1"]),
        ("`paper onset --json`", ["paper", "onset", "sphere_in_cylinder", *SLIPS, "--engine", "oracle"]),
        ("`balance --json`", ["balance", "pendulum", "--engine", "projection"]),
        ("`engines --json`", ["engines"]),
    ],
    ids=["scenes", "check-scene", "check-study", "run", "compare", "ladder", "onset", "balance", "engines"],
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
    assert code in ({3} if "onset" in arguments else {0, 1})  # 3: the engine that is asked cannot slip
    items = found if isinstance(found, list) else [found]
    if arguments == ["engines"]:  # those that cannot be asked say so instead
        items = [item for item in items if item["status"] == "installed"]
    assert items
    without = {"absent", "smallest", "error_bars", "trajectory", "plot"} if arguments[0] == "run" else set()
    for item in items:
        assert set(item) - without == fields(title)


@pytest.mark.drill
def test_a_robot_file(proofroll: Proofroll, tmp_path: Path) -> None:
    """The document about a robot file has each field of its table, and the table each of the document."""
    robot = tmp_path / "arm.urdf"
    robot.write_text(urdf(), encoding="utf-8")
    _, out, _ = proofroll("check", str(robot), "--engine", "mujoco", "--states", "1", "--json")
    assert set(json.loads(out)) == fields("`check --json` of a robot file")


def test_two_files_of_a_robot(proofroll: Proofroll, tmp_path: Path) -> None:
    """The document about two files has the fields of a robot file's and those of its own table."""
    robot = tmp_path / "arm.urdf"
    robot.write_text(urdf(), encoding="utf-8")
    _, out, _ = proofroll("check", str(robot), "--against", str(robot), "--states", "1", "--json")
    assert set(json.loads(out)) == fields("`check --json` of a robot file") | fields("`check --against --json`")


ROBOT = (RobotCheck, LintRemark, UsedTruth, ImporterRow, HeldLayer, RobotCause, DrawnRobot, DrawnBody, DrawnJoint)
COMPARISON = (
    ReportedComparison, ReportedRow, ReportedRun, WorstJudgement, Cause, Row, ExceptAt, Tolerance, Interval, Line,
    ShownObservable, Band,
)  # fmt: skip
LADDER = (LadderContent, RungFound, Ran, TermFound, SideFound, KnownTruth, Absence)
MAP = (StabilityStudy, Axis, BoundaryPoint, Boundary, ExplainedBoundary, MappedValue, Effort, Measured, JudgedFile)


@pytest.mark.parametrize(
    ("page", "title", "records"),
    [
        ("json.md", "`check --json` of a robot file", ROBOT),
        ("json.md", "`check --against --json`", (UnlikeValue,)),
        ("json.md", "`judge --robot --json`", (RecordJudgement, Layer, LayerCause)),
        ("json.md", "`compare --json`", COMPARISON),
        ("json.md", "`stability --json`", MAP),
        (
            "answers.md",
            "JSON",
            (SceneAnswer, StepAnswer, EngineAnswer, AllowedError, StepTried, SettingTried),
        ),
        ("json.md", "`ladder --json`", LADDER),
        ("json.md", "`paper onset --json`", (OnsetStudy, EngineOnset, Onset)),
        (
            "json.md",
            "The other commands",
            (
                Against,
                RunChange,
                TwoRuns,
                ReportedAnswer,
                Drilled,
                Mutated,
                Hunt,
                FoundKind,
                SmallestScene,
                Surprise,
                SurpriseKind,
                Throughput,
                ThroughputRow,
            ),
        ),
    ],
    ids=["robots", "against", "record", "compare", "stability", "answers", "ladder", "onset", "others"],
)
def test_fields_of_records(page: str, title: str, records: tuple[type, ...]) -> None:
    """Each field of what a command prints as records is named where its JSON is described."""
    named = set(re.findall(r"`(\w+)`", section(title, (DOCS / page).read_text(encoding="utf-8"))))
    missing = {
        kind.__name__: {item.name for item in fields_of(kind) if item.metadata != MERGED} - named for kind in records
    }
    assert {name: found for name, found in missing.items() if found} == {}


def _with_json(group: Any, before: str = "") -> Iterator[str]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _with_json(command, f"{before}{name} ")
        if any("--json" in option.opts for option in command.params):
            yield f"{before}{name}"


def test_each_command_that_prints_json_is_described() -> None:
    """What takes --json has its section, or its line, in the pages about JSON."""
    described = TEXT + (DOCS / "answers.md").read_text(encoding="utf-8")
    lacking = [
        name for name in _with_json(typer.main.get_command(app)) if not re.search(rf"`{name}( --json)?`", described)
    ]
    assert lacking == []
