"""README.md and CONTRIBUTING.md, and the page of the founding scene: whatever they tell a person to type works."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image

from proofroll.files.comparison_file import load_comparison
from proofroll.report.labels import engine_title, preset_name, step
from proofroll.running.case import EngineFacts

ROOT = Path(__file__).resolve().parents[1]
_SPEC = importlib.util.spec_from_file_location("made_from", ROOT / "docs" / "made_from.py")
assert _SPEC is not None
assert _SPEC.loader is not None
made_from = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(made_from)
# The page with the tables and pictures of the founding scene.
PAGE = ROOT / "docs" / "sphere_in_cylinder.md"


def blocks(name: str, language: str) -> list[str]:
    """The fenced blocks of a document in a language; an empty language is a block of commands."""
    text = (ROOT / name).read_text(encoding="utf-8")
    return re.findall(rf"^ *```{language}\n(.*?)^ *```$", text, flags=re.DOTALL | re.MULTILINE)


def commands(program: str) -> list[str]:
    """The command lines of README.md that start with a program, without their comments."""
    lines = [line.split("  #")[0].strip() for block in blocks("README.md", "") for line in block.splitlines()]
    return [line for line in lines if line.startswith(f"{program} ")]


# Makes what a command does take less long: one of the engines that tests/agreement runs all.
SHORTER = {"compare": " --engine projection"}
# Commands of the pages of the documentation, which tests/test_docs.py runs.
RUN_THERE = {
    line.split("  #")[0].strip()
    for path in (ROOT / "docs").glob("*.md")
    for line in path.read_text("utf-8").splitlines()
}
COMMANDS = {line + SHORTER.get(line.split()[1], "") for line in {*commands("proofroll")} - RUN_THERE} - RUN_THERE


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a person types the commands, one after the other."""
    return tmp_path_factory.mktemp("readme")


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.slow
@pytest.mark.parametrize("line", sorted(COMMANDS))
def test_a_command_of_the_readme_works(
    line: str, command_line: Callable[..., tuple[int, str, str]], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every proofroll command of the README that no page of the documentation has too ends as expected."""
    words = shlex.split(line)[1:]
    words = [str(ROOT / word) if word.startswith("comparisons/") else word for word in words]
    monkeypatch.chdir(folder)
    code, out, err = command_line(*words)
    assert code == 0, err
    assert out


@pytest.mark.parametrize("line", commands("make"))
def test_a_make_target_of_the_readme_exists(line: str) -> None:
    """Every make command of the README names a target that make would run."""
    done = subprocess.run(
        ["make", "--dry-run", *shlex.split(line)[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.drill
@pytest.mark.parametrize("source", blocks("README.md", "python"))
def test_a_snippet_of_the_readme_runs(source: str, tmp_path: Path) -> None:
    """Every Python snippet of the README runs in a fresh interpreter."""
    done = subprocess.run(
        [sys.executable, "-c", source], cwd=tmp_path, capture_output=True, text=True, timeout=1500, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md"])
def test_an_entry_point_is_valid_toml(name: str) -> None:
    """The entry points that a document tells an engine's author to write are valid and in our groups."""
    found = blocks(name, "toml")
    assert found
    for block in found:
        text = "\n".join(line.strip() for line in block.splitlines())
        groups = tomllib.loads(text)["project"]["entry-points"]
        assert groups.keys() <= {"proofroll.engines", "proofroll.bare_loops"}
        assert all(groups.values())


@pytest.mark.parametrize(
    ("page", "name"),
    [("README.md", "docs/picture.svg"), (PAGE.name, "regimes.svg"), (PAGE.name, "work_precision.svg")],
)
def test_a_picture_is_there(page: str, name: str) -> None:
    """Every picture that README and the page of the founding scene show is there, and is a picture."""
    document = ROOT / page if page == "README.md" else PAGE
    assert f"]({name})" in document.read_text(encoding="utf-8")
    path = document.parent / name
    assert path.is_file()
    assert "<svg" in path.read_text(encoding="utf-8")[:2000]


MARKS = {"agrees": "✓", "converges": "≈", "differs": "✗", "refused": "⊘"}


def test_the_picture_of_the_report_is_that_of_the_table() -> None:
    """The picture has the rows of the paper, each with a verdict that the table counts there, in 300 kB at most."""
    text = PAGE.read_text(encoding="utf-8")
    path = ROOT / "docs" / "report.png"
    assert "](docs/report.png)" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert path.stat().st_size <= 300_000
    shown = json.loads(Image.open(path).text["verdicts"])
    assert [engine for engine, _ in shown] == [row.engine for row in load_comparison("paper").rows]
    table = text.partition("<!-- verdicts:begin -->\n")[2].partition("<!-- verdicts:end -->")[0].splitlines()[2:]
    for (engine, verdict), cell in zip(shown, (line.split("|")[5] for line in table), strict=True):
        # a report judges the combinations of [brief]; the table also counts the other verdicts of a row
        assert verdict in cell or MARKS[verdict] in cell, engine


def verdict_lines(text: str) -> list[list[str]]:
    """The cells of the table of verdicts, without its head."""
    table = text.partition("<!-- verdicts:begin -->\n")[2].partition("<!-- verdicts:end -->")[0].splitlines()
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in table[2:]]


STALE = "the table of verdicts in docs/sphere_in_cylinder.md is stale; make readme"


def complaint(text: str, settings: list[EngineFacts], now: str) -> str:
    """Why the table of verdicts cannot be that of today's comparison, settings and versions; empty if it can."""
    comparison, lines = load_comparison("paper"), verdict_lines(text)
    if len(lines) != len(comparison.rows):
        return f"{STALE}: {len(lines)} lines for {len(comparison.rows)} rows"
    for row, found, cells in zip(comparison.rows, settings, lines, strict=True):
        shown = step(found.resolution, found.settings.get(str(found.resolution)))
        expected = [
            engine_title(found.name),
            str(found.settings.get("formulation")),
            preset_name(found.settings["preset"]),
            shown,
        ]
        if cells[:4] != expected:
            return f"{STALE}: it has {cells[:4]}, the comparison {expected}"
        allowed = {*row.expect, *(verdict for exception in row.except_at for verdict in exception.expect)}
        if cells[4].split()[1].rstrip("*") not in allowed:
            return f"{STALE}: {row.engine} is expected to show {' or '.join(sorted(allowed))}, it has {cells[4]}"
    return "" if made_from.stamped(text) == now else f"{STALE}: comparison, scene, settings or versions have changed"


@pytest.mark.drill
def test_the_verdict_table_is_of_today() -> None:
    """Rows, settings, steps and verdicts are those of the comparison, and what it was made from has not changed."""
    settings = made_from.facts("paper")
    now = made_from.stamp("paper", settings)
    text = PAGE.read_text(encoding="utf-8")
    assert complaint(text, settings, now) == ""

    table = text.partition("<!-- verdicts:begin -->\n")[2].partition("<!-- verdicts:end -->")[0]
    first = table.splitlines(keepends=True)[2]
    for old, new in (
        (first, ""),
        ("| dt 1e-3 s |", "| dt 2e-3 s |"),
        ("✗ differs", "✓ agrees"),
        (f"made-from {now}", "made-from 0"),
        (f"<!-- verdicts:made-from {now} -->", ""),
    ):
        assert old in text
        assert "make readme" in complaint(text.replace(old, new), settings, now), new


def test_the_stamp_of_the_verdict_table_follows_what_it_is_made_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A setting, an engine's pin, a claim, what a brief report runs, an engine's model change it; a title does not."""
    files = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "models" / "sphere_in_cylinder").iterdir())
    for name in ["comparisons/paper.toml", *files, "pyproject.toml", "constraints.txt"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    monkeypatch.setattr(made_from, "data_folder", lambda name: tmp_path / name)
    settings = [EngineFacts("oracle", "1", "code", {"dt": 1e-3}, "dt", 2)]

    def now() -> str:
        return made_from.stamp("paper", settings, tmp_path)

    def change(name: str, old: str, new: str) -> None:
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert old in text
        (tmp_path / name).write_text(text.replace(old, new, 1), encoding="utf-8")

    first = now()
    assert made_from.stamp("paper", [dataclasses.replace(settings[0], settings={"dt": 2e-3})], tmp_path) != first
    change("comparisons/paper.toml", 'title = "', 'title = "Another: ')
    change("constraints.txt", "ruff==", "ruff==9")
    assert now() == first
    for name, old, new in (
        ("comparisons/paper.toml", "speed = [2, 4, 6]", "speed = [2, 4, 7]"),
        ("comparisons/paper.toml", "speed = [4]", "speed = [6]"),
        ("models/sphere_in_cylinder/scene.toml", "0.517", "0.518"),
        ("models/sphere_in_cylinder/mujoco_chart.xml", "timestep", "otherstep"),
        ("constraints.txt", "exudyn==", "exudyn==9"),
    ):
        before = now()
        change(name, old, new)
        assert now() != before, name


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md"])
def test_links_lead_somewhere(name: str) -> None:
    """Every relative link of a document leads to a file of the repository."""
    text = (ROOT / name).read_text(encoding="utf-8")
    targets = [target for target in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in target]
    assert targets
    assert [target for target in targets if not (ROOT / target).exists()] == []
