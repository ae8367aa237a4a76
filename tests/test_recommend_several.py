"""``proofroll recommend`` for several scenes, from the runs of a report."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest
from table_lines import ARM, line

from proofroll.files.json_data import plain
from proofroll.report.long_table import LongTable

Proofroll = Callable[..., tuple[int, str, str]]


@pytest.fixture
def report(tmp_path: Path) -> Path:
    """A report of an arm and of a ball, which only one engine holds."""
    ball = [
        line(study="ball", scene="ball", group="ball rolling", error=0.1),
        line(study="ball", scene="ball", group="ball rolling", engine="beta", error=1e-7, cost=0.7),
    ]
    made = {"environment": {"machine": "m", "versions": {}}, "date": "2026-01-01"}
    file = tmp_path / "report.json"
    file.write_text(json.dumps(made | {"table": plain(LongTable([*ARM, *ball]))}))
    return file


def test_several_scenes_are_advised_from_a_report(proofroll: Proofroll, report: Path) -> None:
    """By study, scene or group: a choice for each and over all, in the folder of results or where it is named."""
    code, out, err = proofroll(
        "recommend", "arm", "rolling", "--tolerance", "1e-3 of path", "--report", str(report), "--json"
    )
    assert (code, err) == (0, "")
    content = json.loads(out)
    assert content["tolerance"] == 1e-3
    assert content["shown_over"] == {"arm": 1.0, "ball": 1.0}
    assert [item["of"] for item in content["advice"]] == ["trees", "arm", "ball rolling", "ball", "all"]
    assert [item["choice"] for item in content["advice"][::2]] == [
        "alpha joints default at dt 1e-3 s", "beta joints default at dt 1e-3 s", "alpha joints, beta joints",
    ]  # fmt: skip
    code, out, _ = proofroll("recommend", "arm", "ball", "--tolerance", "0.1 %", "--out", str(report.parent))
    assert code == 0
    assert "Tolerance: 1e-3 of the path. Shown over 1 s." in out
    assert "Over all, 2 scenes, to 1e-3: alpha joints holds it in 1; beta joints brings it to 2." in " ".join(
        out.split()
    )


def test_forces_and_engines_of_several_scenes(proofroll: Proofroll, report: Path) -> None:
    """Forces count where they are asked for; among some engines nothing may hold it, which is exit code 1."""
    given = ("--report", str(report), "--tolerance", "0.1 %")
    code, out, _ = proofroll("recommend", "arm", "--forces", *given)
    assert code == 0
    assert "Tolerance: 1e-3 of the path, with forces." in out
    assert "alpha joints, tuned, dt 1e-3 s" in " ".join(out.split())
    assert proofroll("recommend", "arm", "--forces", *given[:-1], "1e-3")[1] == out, "a bare number is a part"
    (lines,) = (line.split(maxsplit=1)[1] for line in out.splitlines() if line.endswith("--lines"))
    assert "--forces" in lines
    assert "alpha" in proofroll(*shlex.split(lines), *given[:2])[2], "the command that is told names the same choice"
    code, out, _ = proofroll("recommend", "arm", "ball", "--engine", "alpha", *given)
    assert code == 1
    assert "nothing holds it for ball" in " ".join(out.split())


def test_names_of_a_list_and_names_that_a_report_lacks(proofroll: Proofroll, report: Path) -> None:
    """Names may be joined by commas, as in ``report --only``; a name without runs gets a command that works."""
    given = ("--tolerance", "1e-3 of path", "--report", str(report))
    code, out, _ = proofroll("recommend", "trees,rolling", *given)
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()[4:6]] == ["arm", "ball"]
    for name, advice in {
        "pendulum": f"{report} has no runs of it; proofroll report pendulum makes them",
        "nothing": f"{report} has no such scene, comparison or group; the groups there are trees, ball rolling",
    }.items():
        assert proofroll("recommend", "arm", name, *given)[::2] == (2, f"proofroll: scenes = '{name}': {advice}\n")


def test_forces_that_are_not_judged_are_no_failure(proofroll: Proofroll, report: Path) -> None:
    """Where some of the scenes have no judged forces the advice for them is by the motion, says so, and exits 0."""
    given = ("--forces", "--tolerance", "0.1 %", "--json", "--report", str(report))
    code, out, _ = proofroll("recommend", "arm", "ball", *given)
    assert code == 0
    ball = json.loads(out)["advice"][2]
    assert ball["choice"] == "beta joints default at dt 1e-3 s"
    assert ball["sentence"].startswith("Rolling balls: forces are not judged; for motion alone to 1e-3: take beta")


def test_without_a_tolerance_a_report_answers_for_that_of_its_first_screen(proofroll: Proofroll, report: Path) -> None:
    """Which is 1e-4 of the path; measured curves of one scene need one, and the line names the option."""
    code, out, _ = proofroll("recommend", "ball", "--report", str(report), "--json")
    assert (code, json.loads(out)["tolerance"]) == (0, 1e-4)
    code, out, err = proofroll("recommend", "pendulum")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "--tolerance = ''" not in err
    assert "--tolerance is missing" in err


def test_without_a_report_no_option_is_blamed_that_was_not_given(proofroll: Proofroll, tmp_path: Path) -> None:
    """The line names the file that is looked for, and what writes it."""
    code, out, err = proofroll("recommend", "arm", "ball", "--out", str(tmp_path))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"stored report = '{tmp_path}/report.json': cannot be read" in err
    assert "proofroll report writes one" in err


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["arm", "cart"], "has no such scene, comparison or group; the groups there are trees"),
        (["arm", "ball", "--measure"], "--measure"),
        (["arm", "ball", "--lines"], "it is for one scene; name one of arm, ball"),
        (["arm", "--lines", "--tolerance", "1e-9 of path"], "nothing that was measured holds the tolerance"),
        (["arm", "--lines"], "alpha"),
        (["arm", "ball", "--engine", "nobody"], "nobody"),
        (["arm", "ball", "--tolerance", "1 kg"], "its unit is m"),
        (["arm", "ball", "--forces", "--tolerance", "1 mm"], "motion and forces have different units; give a part"),
        (["arm", "--report", "nowhere.json"], "proofroll report writes one"),
    ],
)
def test_what_a_report_cannot_answer_is_one_line(
    proofroll: Proofroll, report: Path, more: list[str], words: str
) -> None:
    """A scene or an engine that it has not, an option of measured curves, a tolerance with a unit."""
    code, out, err = proofroll("recommend", "--report", str(report), "--tolerance", "1e-3", *more)
    assert (code, out) == (2, "")
    assert words in err
    assert len(err.splitlines()) <= 2


def test_one_group_is_advised_from_the_report_of_the_folder(proofroll: Proofroll, report: Path) -> None:
    """A group is no scene, but a report has its runs; its advice is that of the report's first screen."""
    code, out, err = proofroll("recommend", "rolling", "--out", str(report.parent), "--json")
    assert (code, err) == (0, "")
    assert json.loads(out)["advice"][0]["of"] == "ball rolling"


def test_one_scene_is_answered_from_the_report_of_the_folder(proofroll: Proofroll, tmp_path: Path) -> None:
    """A scene that OUT/report.json has is answered from it, with every engine and its cost; another from curves."""
    lines = [
        line(study="pendulum", scene="pendulum", group="trees", engine=engine, error=error, cost=cost)
        for engine, error, cost in (("alpha", 1e-6, 0.2), ("beta", 1e-7, 0.7), ("gamma", 0.5, 0.1))
    ]
    made = {"environment": {"machine": "m", "versions": {}}, "date": "2026-01-01"}
    (tmp_path / "report.json").write_text(json.dumps(made | {"table": plain(LongTable(lines))}))
    code, out, err = proofroll("recommend", "pendulum", "--out", str(tmp_path), "--json")
    assert (code, err) == (0, "")
    content = json.loads(out)
    assert len(content["engines"]) == 3
    assert {item["engine"]: (item["holds"], item["cost"]) for item in content["engines"]} == {
        "alpha joints": (True, 0.2), "beta joints": (True, 0.7), "gamma joints": (False, None),
    }  # fmt: skip
    text = proofroll("recommend", "pendulum", "--out", str(tmp_path))[1]
    assert text.startswith("Take alpha joints, default, dt 1e-3 s: ≥ 5× real time.\nTolerance: 1e-4 of the path.")
    assert "Shown over 1 s of " in text
    assert [row.split()[:2] for row in text.splitlines() if row[:1] in {"✓", "✗", "↘"}] == [
        ["✓", "alpha"], ["✓", "beta"], ["↘", "gamma"],
    ]  # fmt: skip
    code, _, err = proofroll("recommend", "heavy_top", "--tolerance", "1e-3", "--out", str(tmp_path))
    assert code == 2
    assert "no curves are stored" in err


def test_a_tolerance_means_the_same_everywhere(proofroll: Proofroll, report: Path) -> None:
    """With a percent sign or as a part of the path it is relative; otherwise it is in the unit of the motion."""
    given = ("recommend", "ball", "--report", str(report), "--json", "--tolerance")
    parts = [json.loads(proofroll(*given, text)[1]) for text in ("1e-3 of path", "0.1 %", "1e-3 of the path")]
    assert {(item["tolerance"], item["unit"]) for item in parts} == {(1e-3, "part of the path")}
    lengths = [json.loads(proofroll(*given, text)[1]) for text in ("1e-3", "1 mm", "1e-3 m")]
    assert {(item["tolerance"], item["unit"]) for item in lengths} == {(1e-3, "m")}


@pytest.mark.drill
def test_a_kind_without_a_report_is_told_what_makes_one(proofroll: Proofroll, tmp_path: Path) -> None:
    """A kind of scenes, or several in one word, needs a report: the command that makes it is told, exit 2."""
    made_by = {"loops": "proofroll report --only loops", "pendulum,cone": "proofroll report pendulum cone"}
    for name, command in made_by.items():
        code, _, err = proofroll("recommend", name, "--out", str(tmp_path))
        assert code == 2
        assert f"report.json, which is not there; {command} makes it" in err


def test_lines_of_a_choice_from_a_report(proofroll: Proofroll, tmp_path: Path) -> None:
    """They are those of the engine that the report says to take, and nothing else is printed."""
    mujoco = {"engine": "mujoco", "formulation": "joints", "preset": "tuned", "setting": "tuned", "step": 0.01}
    made = {"environment": {"machine": "m", "versions": {}}, "date": "2026-01-01"}
    table = LongTable([line(study="pendulum", scene="pendulum", error=1e-6, **mujoco)])
    (tmp_path / "report.json").write_text(json.dumps(made | {"table": plain(table)}))
    code, out, err = proofroll("recommend", "pendulum", "--lines", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    assert out.startswith('<option timestep="0.01"')
