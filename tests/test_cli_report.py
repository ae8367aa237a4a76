"""The command ``report`` as a user meets it, with studies of a second each."""

from __future__ import annotations

import html
import itertools
import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from folded import whole

from proofroll.cli.report import _of_groups
from proofroll.report.page.growing import Report
from proofroll.running.store import alone_in
from proofroll.running.time_budget import TimeBudget
from proofroll.studies.comparison import compare
from proofroll.studies.comparison.outcome import Outcome

Proofroll = Callable[..., tuple[int, str, str]]

COMPARISON = """
title = "A claim"
question = "Does it hold?"
scene = "sphere_in_cylinder"
until = 0.1
every = 0.01
timed = false
vary = { speed = [4] }
tolerances.tight = { because = "the engine is the closed form", z = "1e-9 m", gamma = "1e-9 rad" }

[[rows]]
engine = "oracle"
tolerance = "tight"
"""
STABILITY = """
study = "stability"
title = "Speed"
question = "Where does it break?"
scene = "sphere_in_cylinder"

[[axes]]
name = "speed"
unit = "m/s"
meaning = "how fast it begins"
values = [4]
parameters.speed = {}
"""
FIGURES = """
study = "figures"
title = "Figures"
source = "somebody"
scene = "sphere_in_cylinder"
engine = "projection[formulation=rotating_frame]"
until = 0.3
every = 0.01
runs.free = { label = "free", parameters = { speed = 4 } }

[[figures]]
name = "height"
caption = "The height."
panels = [{ y = ["z"], runs = ["free"] }]

[[statements]]
says = "ω3 is constant"
source = "section 3"
runs = ["free"]
of = "omega3"
measure = "every"
stated = "STATED"
"""


def files(tmp_path: Path, **texts: str) -> list[str]:
    """Paths of files with these texts."""
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    return [str(tmp_path / f"{name}.toml") for name in texts]


@pytest.fixture(autouse=True)
def unsearched(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """No engine is searched for the first screen, which takes longest, but where a test asks for it."""
    if "searched" not in request.node.name:
        monkeypatch.setattr(import_module("proofroll.cli.report"), "search_answers", lambda *_: None)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where reports of the same runs are written, one over the other."""
    return tmp_path_factory.mktemp("out")


@pytest.mark.nightly
def test_a_report_of_several_studies(proofroll: Proofroll, tmp_path: Path, out: Path) -> None:
    """Stages on standard error, tables and the place on standard output, and both files with what they name."""
    names = files(tmp_path, claim=COMPARISON, figures=FIGURES.replace("STATED", "-160"))
    code, said, err = proofroll("report", *names, "--out", str(out))
    assert code == 0, err
    assert "1 of 3, comparisons" in err
    assert "3 of 3, figures" in err
    assert f"All as expected. {out / 'report.html'} · report.json · report.csv" in " ".join(said.split())
    assert "✓  1 of  1  claim" in said
    assert max(map(len, said.splitlines())) <= 80
    content = json.loads((out / "report.json").read_text(encoding="utf-8"))
    (figures,) = content["figures"]
    assert figures["study"]["statements"][0]["holds"] is True
    assert content["stability"] == []
    html = whole((out / "report.html").read_text(encoding="utf-8"))
    assert "1 of 1 statements hold" in html
    assert 'id="figures0-height-' in whole((out / "studies.html").read_text(encoding="utf-8"))
    for run in content["comparisons"][0]["runs"]:
        assert (out / run["trajectory"]).is_file()


@pytest.mark.drill
def test_a_statement_that_does_not_hold_is_a_contradiction(proofroll: Proofroll, tmp_path: Path, out: Path) -> None:
    """Exit code 1, named in what to look at first, and on the page; a report needs no comparison."""
    names = files(tmp_path, figures=FIGURES.replace("STATED", "-150"))
    code, said, _ = proofroll("report", *names, "--out", str(out))
    assert code == 1
    assert "Look first at the unexpected result (1): ω3 is constant (free)" in said
    assert "Nothing was compared in this report" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.nightly
def test_a_part_that_fails_does_not_take_the_report_away(
    proofroll: Proofroll, tmp_path: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit code 3 and one line on standard error; the comparison is on the page, and what is missing too."""
    names = files(tmp_path, claim=COMPARISON, speed=STABILITY)

    def fail(*_: object, **__: object) -> None:
        raise MemoryError("no memory left")

    monkeypatch.setattr("proofroll.report.stability.part.make_stability", fail)
    code, said, err = proofroll("report", *names, "--out", str(out))
    assert code == 3
    (again,) = re.findall(r"no memory left; proofroll stability (.*) makes it\.", " ".join(err.split()))
    assert shlex.split(again)[1:] == ["--out", str(out)]
    assert Path(shlex.split(again)[0]).name == "speed.toml", "which is its own file"
    assert "Traceback" not in err
    assert "Missing (1): Speed" in said
    html = (out / "report.html").read_text(encoding="utf-8")
    assert "no memory left" in whole(html)
    assert "A claim" in html


@pytest.mark.drill
def test_a_stopped_report_keeps_what_has_ended_and_goes_on(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C in the second of two comparisons: the page has the first; the same command runs no case again."""
    oracle = COMPARISON.replace('"oracle"', '"reduced[formulation=closed_form]"')
    names = files(tmp_path, first=oracle, second=oracle.replace("[4]", "[3]").replace("A claim", "Another claim"))
    command = ["report", *names, "--out", str(tmp_path / "out"), "--jobs", "1"]
    judged, evaluate = [], compare.evaluate

    def stop_in_the_second(*arguments: Any) -> Outcome:
        judged.append(arguments)
        if len(judged) == 2:
            raise KeyboardInterrupt
        return evaluate(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(compare, "evaluate", stop_in_the_second)
        code, said, err = proofroll(*command)
    assert (code, said) == (130, "")
    assert "the first of 2 comparisons is in" in err
    assert "stopped: 1 of 2 comparisons are in" in err
    assert "the same command continues from there" in err
    content = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert [item["title"] for item in content["comparisons"]] == ["A claim"]
    assert content["awaited"] == ["Another claim"]
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "out" / "cases").iterdir()}
    code, _, err = proofroll(*command)
    assert code == 0, err
    assert {file: file.stat().st_mtime_ns for file in before} == before
    content = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert [item["title"] for item in content["comparisons"]] == ["A claim", "Another claim"]
    assert content["awaited"] == []


@pytest.mark.nightly
def test_progress_counts_comparisons(proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While cases run it is said how many comparisons have ended, and about how long the rest will take."""
    said: list[str] = []

    @contextmanager
    def noted(*_: Any, **__: Any) -> Iterator[Callable[..., None]]:
        yield lambda text, **_: said.append(text)

    monkeypatch.setattr("proofroll.cli.options.progress_bar", noted)
    oracle = COMPARISON.replace('"oracle"', '"reduced[formulation=closed_form]"')
    names = files(tmp_path, first=oracle, second=oracle.replace("[4]", "[3]"))
    code, _, err = proofroll("report", *names, "--out", str(tmp_path / "out"), "--jobs", "1")
    assert code == 0, err
    assert "0 of 2 comparisons ended, about" in said[0]
    assert "s left, " in said[0]
    ended = [int(text.removeprefix("1 of 2: ").partition(" of ")[0]) for text in said]
    assert ended == sorted(ended)
    assert (ended.count(2), ended[-1]) == (1, 2), "with the last case of the second"


@pytest.mark.drill
def test_what_no_report_has_is_one_line(proofroll: Proofroll, tmp_path: Path) -> None:
    """A file for another study, and a name that does not exist, are wrong usage before anything runs."""
    for name in (*files(tmp_path, other='study = "opinion"', list='study = ["a"]'), "nothing"):
        code, said, err = proofroll("report", name, "--out", str(tmp_path / "out"))
        assert (code, said, err.count("\n")) == (2, "", 1)
    assert not (tmp_path / "out").exists()


@pytest.mark.nightly
def test_a_page_after_the_first_comparison(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A report without names shows the first comparison before it runs the others, names those, and is brief."""
    text = COMPARISON.replace('"oracle"', '"reduced[formulation=closed_form]"')
    varied = text.replace("{ speed = [4] }", "{ speed = [2, 4] }\nbrief = { speed = [4] }")
    files(tmp_path, first=f"order = 1\n{varied}", second=text.replace("A claim", "Another claim"))
    (tmp_path / "balls").mkdir()
    (tmp_path / "balls" / "third.toml").write_text(text, encoding="utf-8")
    for module in ("comparison_file", "toml"):
        monkeypatch.setattr(f"proofroll.files.{module}.study_folders", lambda: (tmp_path,))
    pages = []
    write = Report.write

    def noted(report: Report, out: Path) -> None:
        write(report, out)
        pages.append((out / "report.html").read_text(encoding="utf-8"))

    monkeypatch.setattr(Report, "write", noted)
    code, said, err = proofroll("report", "--out", str(tmp_path / "out"))
    assert code == 0, err
    first, *_, last = pages
    assert "This page is not whole yet.</b> Still being run: Another claim." in first
    assert "not whole yet" not in last
    assert "1 further combinations of parameters are left out here; <code>proofroll compare first</code>" in whole(last)
    content = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert content["awaited"] == []
    assert [run["parameters"] for run in content["comparisons"][0]["runs"]] == [{"speed": 4.0}]
    assert content["left_out"] == ["balls/third"]
    assert "<dt>Left out</dt><dd><details><summary>1 comparison</summary>" in first
    assert "Their names: <code>balls/third</code>." in whole(first)
    assert "left out: 1 (balls 1). proofroll report --budget 3600 runs all" in " ".join(said.split())


@pytest.mark.nightly
def test_a_budget_is_spent_briefly_first_and_grows(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every comparison is brief before one grows, what is left out contradicts nothing, the same command goes on."""
    text = COMPARISON.replace('"oracle"', '"reduced[formulation=closed_form]"')
    varied = text.replace("{ speed = [4] }", "{ speed = [2, 4] }\nbrief = { speed = [4] }")
    files(tmp_path, first=f"order = 1\n{varied}")
    (tmp_path / "balls").mkdir()
    (tmp_path / "balls" / "second.toml").write_text(varied.replace("0.1", "0.2"), encoding="utf-8")
    for module in ("comparison_file", "toml"):
        monkeypatch.setattr(f"proofroll.files.{module}.study_folders", lambda: (tmp_path,))
    command = ["report", "--out", str(tmp_path / "out"), "--jobs", "1", "--budget", "90"]

    def made(most: int) -> tuple[list[list[float]], list[str], str]:
        begun: list[str] = []

        def few(_: TimeBudget, case: str, __: int) -> float:
            begun.append(case)
            return 60.0 if len(begun) <= most else 0.0

        with monkeypatch.context() as patch:
            patch.setattr(TimeBudget, "begin", few)
            patch.setattr(TimeBudget, "end", lambda *_, **__: None)
            code, said, err = proofroll(*command)
        assert code == 0, err
        content = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
        found = content["comparisons"]
        speeds = [[run["parameters"]["speed"] for run in item["runs"]] for item in found]
        return speeds, [run["verdict"] for item in found for run in item["runs"]], " ".join(said.split())

    speeds, verdicts, said = made(most=3)
    assert (speeds, verdicts) == ([[4.0], [4.0]], ["agrees", "not-judged"])
    assert "Runs left out for lack of processor time: 1." in said
    assert "did not suffice" not in said
    assert "Runs left out for lack of processor time: 1. The same command goes on with them." in said
    assert "lack of processor time: 1" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    speeds, verdicts, said = made(most=3)
    assert (speeds, set(verdicts)) == ([[2.0, 4.0], [4.0]], {"agrees"})
    assert "left out" not in said
    speeds, verdicts, said = made(most=3)
    assert (speeds, set(verdicts)) == ([[2.0, 4.0], [2.0, 4.0]], {"agrees"})


@pytest.mark.nightly
def test_a_used_budget_begins_no_further_study(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is named with the reason and the command that makes it, and the exit code is that of a report without it."""
    (name,) = files(tmp_path, figures=FIGURES.replace("STATED", "-160"))
    spent = itertools.count(0.0, 40.0)
    monkeypatch.setattr(import_module("proofroll.cli.report"), "_processor_seconds", lambda: next(spent))
    code, said, err = proofroll("report", name, "--out", str(tmp_path / "out"), "--budget", "30")
    assert code == 0, err
    assert "Missing (1): Figures: Not run: the budget is used; proofroll" in " ".join(said.split())
    assert "the budget is used" in whole((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))


@pytest.mark.nightly
def test_a_second_report_into_one_folder(tmp_path: Path) -> None:
    """While a report is being made in a folder, another one says so and waits."""
    asked = [sys.executable, "-m", "proofroll", "report", "inclined_plane", "--out", str(tmp_path)]
    with alone_in(tmp_path, lambda: None), subprocess.Popen(asked, stderr=subprocess.PIPE, text=True) as second:
        assert second.stderr is not None
        assert "this one waits for it" in second.stderr.readline()
        second.terminate()
    assert not (tmp_path / "report.html").exists()


@pytest.mark.nightly
def test_a_planted_change_of_one_per_cent_is_found_and_nothing_else(
    command_line: Proofroll,
    install_engines: Callable[[Mapping[str, str]], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """An adapter that begins to move one per cent too fast is named; the engine beside it is not."""
    text = COMPARISON.replace('z = "1e-9 m", gamma = "1e-9 rad"', 'z = "10 %", gamma = "10 %"')
    (claim,) = files(tmp_path, claim=text + '\n[[rows]]\nengine = "steady"\ntolerance = "tight"\n')
    arguments = ["report", claim, "--jobs", "1", "--fresh", "--out"]
    install_engines({"oracle": "hostile:Oracle", "steady": "hostile:Steady"})
    assert command_line(*arguments, str(tmp_path / "old"))[0] == 0
    old = tmp_path / "old" / "report.json"
    code, out, _ = command_line(*arguments, str(tmp_path / "same"), "--against", str(old))
    assert code == 0
    # Without what a busy machine adds on the scatter of costs.
    assert "Of 6 runs in both reports, changed: nothing" in " ".join(out.split()), "two with their ladders"
    monkeypatch.setenv("PROOFROLL_TEST_OFF", "0.01")
    code, out, _ = command_line(*arguments, str(tmp_path / "new"), "--against", str(old))
    assert code == 1
    changes = json.loads((tmp_path / "new" / "report.json").read_text(encoding="utf-8"))["against"]["changes"]
    assert {(item["study"], item["run"].split()[0]) for item in changes} == {("claim", "steady")}
    assert len(changes) == 3, "the run and both rungs of its ladder"
    assert "steady" in (tmp_path / "new" / "report.html").read_text(encoding="utf-8").split('id="changes"')[1][:4000]
    assert "error of" in " ".join(out.split())


@pytest.mark.drill
def test_only_some_groups_of_scenes_are_run(proofroll: Proofroll, tmp_path: Path) -> None:
    """--only takes the comparisons of these groups, by name or by a word of it; others are one line of advice."""
    text = COMPARISON.replace("sphere_in_cylinder", "four_bar").replace("vary = { speed = [4] }", "")
    text = text.replace('z = "1e-9 m", gamma = "1e-9 rad"', 'positions = "1e-9 m"')
    claim, other = files(tmp_path, claim=COMPARISON, other=text)
    code, _, err = proofroll("report", claim, other, "--only", "wheels", "--out", str(tmp_path / "out"))
    assert code == 2
    assert "groups are ball rolling, loops" in " ".join(err.split())
    assert _of_groups([claim, other], "loops") == [other]
    assert _of_groups([claim, other], "rolling, loops") == [claim, other]
    assert _of_groups([claim, other], "ball rolling") == [claim]


@pytest.mark.nightly
def test_each_scene_is_searched_for_the_first_screen(proofroll: Proofroll, tmp_path: Path) -> None:
    """Page, terminal and JSON have one sentence from one record, which recommend and compare find and print, too."""
    given = ["double_pendulum", "--engine", "mujoco", "--out", str(tmp_path)]
    code, said, err = proofroll("report", *given, "--tolerance", "1e-4")
    assert code == 0, err
    code, recommended, err = proofroll("recommend", *given, "--tolerance", "1e-4")
    assert (code, err) == (0, "")
    code, compared, err = proofroll("compare", *given)
    assert code == 0, err
    content = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    (entry,) = content["answers"]
    sentence = entry["sentence"]
    assert sentence.startswith("Take MuJoCo joints, ")
    assert f"double pendulum: {sentence}" in " ".join(said.split())
    page = whole((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert entry["answer"]["engines"][0]["spec"] in page
    assert sentence in html.unescape(re.sub(r"</?span[^>]*>", "", page))
    assert " ".join(recommended.split()).startswith(sentence)
    assert " ".join(compared.split()).startswith(f"To 1e-4 of the path: {sentence}")
