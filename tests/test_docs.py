"""The pages of docs/: what they tell a person to type works, in the order of the page, in one folder."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import re
import shlex
import subprocess
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest
import yaml
from named_commands import unknown_words

from proofroll.cli.report import report
from proofroll.core.engine import Sample
from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism, Point, Spring
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.files.comparison_file import comparison_names, further_comparison_names
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample
from proofroll.robots.control.controller import read_controller
from proofroll.running.idle_workers import Workers
from proofroll_fuzz.command import fuzz

ROOT = Path(__file__).resolve().parents[1]
# README.md and the pages whose snippets have tests of their own.
ELSEWHERE = {
    "agreement_in_your_tests",
    "two_simulators",
    "vocabulary",
    "write_an_engine",
    "write_an_element",
    "worker_protocol",
}
PAGES = sorted(path.stem for path in (ROOT / "docs").glob("*.md") if path.stem not in ELSEWHERE)
BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)
# Pages that the build of the documentation writes.
_BUILT = {"vocabulary", "maintain/map"}
# A file's first line names it, as a comment.
NAMED = re.compile(r"(?:#|<!--) ([\w./]+\.(?:toml|urdf))")


def blocks(page: str) -> list[tuple[str, str]]:
    """Language and text of each fenced block; a block of commands has none."""
    found = BLOCK.findall((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8"))
    return [(language, text) for language, text in found if not language.startswith("{")]  # Sphinx's own


def commands(text: str) -> list[tuple[list[str], int]]:
    """The words of each command, and the exit code that its comment tells."""
    found = []
    for line in text.splitlines():
        command, _, comment = line.partition("  #")
        code = re.search(r"exits (\d)", comment)
        found.append((shlex.split(command), int(code[1]) if code else 0))
    return found


# Makes what a command does take less long; programs of findings are run by tests/unit/studies/test_findings.py.
SHORTER = {
    "recommend": ["--until", "0.05"],
    "ladder": ["--rounds", "2"],
    "findings": ["--list"],
    "fuzz": ["--minutes", "1e-3"],  # one scene
    "throughput": ["--until", "0.05"],
}


# What these commands do on a cluster is run by tests/unit/cluster/test_cluster.py and tests/test_versions.py.
ON_A_CLUSTER = ["--scheduler", "local:1"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a person reads one page after the other."""
    return tmp_path_factory.mktemp("docs")


@pytest.fixture(scope="module")
def typed() -> set[str]:
    """What was typed there already; it need not be typed again."""
    return set()


@pytest.mark.daily("findings", "json", "licences", "write_a_scene")
@pytest.mark.drill
@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)])
def test_a_page_can_be_followed(
    page: str,
    folder: Path,
    typed: set[str],
    command_line: Callable[..., tuple[int, str, str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every file and command of a page works, one after the other; scripts for other systems parse."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison._UNTIL", 0.2)
    for language, text in blocks(page):
        if language in {"toml", "xml"}:
            named = NAMED.match(text)
            assert named, text
            (folder / named[1]).parent.mkdir(exist_ok=True)
            (folder / named[1]).write_text(text.partition("\n")[2], encoding="utf-8")
        elif language == "sh":
            subprocess.run(["bash", "-n", "-c", text], check=True)
        elif language == "yaml":
            assert yaml.safe_load(text)
        elif language != "python":  # which tests/test_snippets.py runs, without what commands leave
            assert language == "", f"nothing executes {language}"
            for words, code in commands(text):
                assert words[0] == "proofroll"
                if words[-2:] == ON_A_CLUSTER:
                    words = words[:-2]  # noqa: PLW2901 -- the rest of the same command
                if " ".join(words) in typed:
                    continue
                typed.add(" ".join(words))
                found, out, err = command_line(*words[1:], *SHORTER.get(words[1], []))
                assert found == code, (words, err, out)


def test_every_page_is_in_the_contents() -> None:
    """No page is left out of the table of contents, and none is named there that is not."""
    contents = "\n".join((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8") for page in ("index", "gallery"))
    trees = re.findall(r"```\{toctree\}\n(.*?)```", contents, flags=re.DOTALL)
    named = [line for tree in trees for line in tree.splitlines() if line and not line.startswith(":")]
    docs = ROOT / "docs"
    written = {path.relative_to(docs).with_suffix("").as_posix() for path in docs.rglob("*.md")}
    pages = {page for page in written if not page.startswith("examples/")} | _BUILT
    assert {page for page in pages if not any(fnmatch(page, pattern) for pattern in named)} == {"index"}
    assert [pattern for pattern in named if not any(fnmatch(page, pattern) for page in pages)] == []


def test_the_workflow_runs_the_two_commands() -> None:
    """The workflow of the public CI parses, covers every Python that is supported, and runs what a person types."""
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    (job,) = workflow["jobs"].values()
    assert job["strategy"]["matrix"]["python"] == ["3.11", "3.12", "3.13"]
    commands = [step["run"] for step in job["steps"] if "run" in step]
    assert commands == [".ci/run", "make report"]
    within = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    made = [line for line in within if line.startswith("make ")]
    assert {word for line in made for word in line.split()} >= {"check", "docs", "test"}
    for line in [*commands[1:], *made]:
        subprocess.run(["make", "--dry-run", *shlex.split(line)[1:]], cwd=ROOT, check=True, capture_output=True)


def test_the_gallery_makes_what_is_lacking_or_changed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Without names a scene is made again only when what decides its page has changed; with names that one."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    gallery = importlib.import_module("gallery")
    made, stamps = [], {"a": "1", "b": "1"}
    monkeypatch.setattr(gallery, "DOCS", tmp_path / "docs")
    monkeypatch.setattr(gallery, "PICTURES", tmp_path / "docs" / "gallery")
    monkeypatch.setattr(gallery, "scene_names", lambda: ["a", "b", "of_nothing"])
    monkeypatch.setattr(gallery, "comparisons", lambda: {name: (name, name) for name in stamps})
    monkeypatch.setattr(gallery, "facts", lambda *_: [])
    monkeypatch.setattr(gallery, "stamp", lambda name, _: stamps[name])

    def section(scene: str, *_: object) -> str:
        made.append(scene)
        return f"# {scene}\n\nIts text.\n"

    monkeypatch.setattr(gallery, "section", section)
    (tmp_path / "docs").mkdir()
    for names, expected in (([], ["a", "b", "of_nothing"]), ([], []), (["b"], ["b"])):
        made.clear()
        gallery.main(names)
        assert made == expected
    stamps["a"] = "2"
    made.clear()
    gallery.main([])
    assert made == ["a"]


@pytest.mark.drill
def test_no_page_of_the_gallery_is_stale(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each page was made from today's comparison, scene, settings and pinned libraries; a changed one is noticed."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    gallery = importlib.import_module("gallery")
    known = gallery.comparisons()
    kept = gallery.pages()
    assert kept.keys() == set(gallery.scene_names())
    with_one_changed = kept | {"four_bar": kept["four_bar"].replace("made from ", "made from 0")}
    stale = gallery.stale(with_one_changed, known, Workers())
    assert list(stale) == ["four_bar"], "make gallery"
    assert stale["four_bar"] in kept["four_bar"], "make gallery"


def test_no_robot_on_its_page_is_stale(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Each section was made from today's controllers, engines and libraries; of packages that are away it stays."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    robots = importlib.import_module("robots")
    page = robots.PAGE.read_text(encoding="utf-8")
    kept = robots.sections(page)
    assert page.startswith(robots.HEAD.format(rate=robots.RATE))
    assert not [entry.name for entry in robots.stale(page) if entry.name in kept], "python docs/robots.py FOLDER"
    assert "solo12" in [entry.name for entry in robots.stale(page.replace("solo12 made from ", "solo12 made from 0"))]
    monkeypatch.setattr(robots, "PAGE", tmp_path / "robots.md")
    monkeypatch.setattr(robots, "located", lambda *_: None)
    robots.PAGE.write_text(page.replace("solo12 made from ", "solo12 made from 0"), encoding="utf-8")
    robots.main([])
    assert robots.sections(robots.PAGE.read_text(encoding="utf-8")).keys() == robots.sections(page).keys()


def test_the_controllers_of_robots_are_what_the_page_says(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A trot swings diagonal legs alike about the pose that a hold holds, and both start with the same tilt."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    robots = importlib.import_module("robots")
    names = [f"{leg}_{part}" for leg in ("FL", "FR", "HL", "HR") for part in ("HAA", "HFE", "KFE")]
    entry, pose = robots.entries()[0], dict.fromkeys(names, 0.5)
    assert robots.phases([name for name in names if name.endswith("HFE")]) == {
        "FL_HFE": 0.0, "FR_HFE": np.pi, "HL_HFE": np.pi, "HR_HFE": 0.0,
    }  # fmt: skip
    assert robots.phases(["left", "right"]) == {"left": 0.0, "right": np.pi}
    for motion, count in (("hold", 0), ("trot", 8)):
        (tmp_path / "c.toml").write_text(robots.controller(entry, motion, pose), encoding="utf-8")
        read = read_controller(tmp_path / "c.toml")
        assert (read.rate, len(read.targets)) == (50, count)
        assert np.linalg.norm(read.start.base[3:]) == pytest.approx(1)
        assert read.start.drop == 0.01
        assert read.ground.feet == entry.feet


def test_the_first_page_shows_the_matrix_of_the_gallery(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Both pages include the matrix, which is that of the records in the gallery's own pages, and the grid has all."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    gallery = importlib.import_module("gallery")
    pages = {name: gallery.pages()[name] for name in gallery.scene_names()}
    written = (ROOT / "docs" / "gallery" / "matrix.inc").read_text(encoding="utf-8")
    monkeypatch.setattr(gallery, "PICTURES", tmp_path)
    gallery.write_matrix(pages.values())
    assert (tmp_path / "matrix.inc").read_text(encoding="utf-8") == written
    for page in ("index", "gallery"):
        assert "{include} gallery/matrix.inc" in (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    assert (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8") == f"{gallery.HEAD}\n{gallery.grid(pages)}"
    trees = {"alpha": ["agrees", "not-judged", "differs"], "be_ta": ["converges"], "gamma": ["not-judged"]}
    lines = gallery.choice_table({"trees": trees, "loops": {"alpha": ["agrees"]}}).splitlines()
    assert lines[3:6] == ["| alpha | ✓ 1/2 | ✓ |", "| be_<wbr>ta | ↘ |  |", "| gamma | □ |  |"]
    for sign in set(
        re.findall(r"[^\w\s|/:-]", written.replace("<wbr>", "").partition("```\n\n")[0].partition("|---")[2])
    ):
        assert f"{sign} " in written.partition("```\n\n")[2], sign


def test_the_gallery_gives_no_error_bar_where_no_motion_is_unique() -> None:
    """A page whose engines are held to laws alone has no error bar and no errors, and there are such pages."""
    pages = [page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "gallery").glob("*.md")]
    laws_alone = [page for page in pages if "laws of mechanics alone" in page]
    assert {page.partition("\n")[0].removeprefix("# ") for page in laws_alone} >= {"cradle", "dominoes", "painleve_rod"}
    assert not [page for page in laws_alone if "Error bar" in page or "positions [m]" in page]


def test_the_nightly_workflow_parses_and_runs_what_there_is() -> None:
    """Its YAML and its scripts parse, its commands have the options that they use, and its comparisons exist."""
    workflow = yaml.safe_load((ROOT / "docs" / "nightly.yml").read_text(encoding="utf-8"))
    assert workflow[True]["schedule"]  # YAML reads "on" as true
    (job,) = workflow["jobs"].values()
    scripts = [step["run"] for step in job["steps"] if "run" in step]
    for script in scripts:
        subprocess.run(["bash", "-n", "-c", script], check=True)
    comparing, fuzzing = scripts[-2:]
    (names,) = re.findall(r"proofroll report ([a-z_ ]+) --out", comparing)
    assert set(names.split()) <= {*comparison_names(), *(Path(name).name for name in further_comparison_names())}
    for command, script in ((report, comparing), (fuzz, fuzzing)):
        options = {f"--{name.replace('_', '-')}" for name in inspect.signature(command).parameters}
        assert set(re.findall(r"--[a-z]+", script)) <= options
    assert "://" not in (ROOT / "docs" / "nightly.yml").read_text(encoding="utf-8")


GIVEN_BACK = (Sample, MechanismSample, BallSample, MechanismBuilt, BallBuilt)


# Beginnings of names of modules; entry points and files have names with dots, too.
_ROOMS = "core|elements|engines|files|running|studies|truth|conformance|papers|robots|cli"
_FILES = ("csv", "json", "html", "md", "py", "toml")


def modules_named(text: str) -> list[str]:
    """Names of modules of the package, or of what is in one, that a page has in code."""
    found = re.findall(rf"`(?:proofroll\.)?((?:{_ROOMS})\.[\w.]+)`", text)
    return [name for name in found if name.rpartition(".")[2] not in _FILES]


@pytest.mark.parametrize("page", [*(f"docs/{page}.md" for page in PAGES), "README.md", "CONTRIBUTING.md"])
def test_modules_that_a_page_names_are_there(page: str) -> None:
    """Each module, or class or function of one, that prose names in code can be imported by that name."""
    missing = []
    for name in modules_named((ROOT / page).read_text(encoding="utf-8")):
        place, _, member = f"proofroll.{name}".rpartition(".")
        try:
            importlib.import_module(f"{place}.{member}")
        except ImportError:
            try:
                getattr(importlib.import_module(place), member)
            except (ImportError, AttributeError):
                missing.append(name)
    assert missing == []


@pytest.mark.parametrize("page", [*(f"docs/{page}.md" for page in PAGES), "README.md", "CONTRIBUTING.md"])
def test_commands_that_a_page_names_are_there(page: str) -> None:
    """Each command that prose names in code is one, with the options that stand behind it."""
    assert unknown_words((ROOT / page).read_text(encoding="utf-8")) == []


def test_a_command_that_is_gone_is_seen() -> None:
    """A command, and an option of a command, that are not there are found in prose; those of today are not."""
    text = "`proofroll robots`, `proofroll run SCENE --plot run.html`, `proofroll recommend SCENE --best`, `--other`"
    assert unknown_words(text) == ["robots", "recommend --best"]


def test_a_module_that_is_gone_is_seen() -> None:
    """Names of modules are read with the package's name and without it; files are none."""
    text = "`elements.mechanism.commands`, `proofroll.core.engine`, `report.json`, `truth.html`"
    assert modules_named(text) == ["elements.mechanism.commands", "core.engine"]


@pytest.mark.parametrize("kind", [Mechanism, Body, Joint, Loop, Spring, Point, *GIVEN_BACK])
def test_authors_of_engines_find_each_field(kind: type) -> None:
    """The tables of fields have all that an engine is given and gives back, and nothing that these have not."""
    text = (ROOT / "docs" / "write_an_engine.md").read_text(encoding="utf-8")
    rows = text.partition("### Fields of a mechanism\n")[2].partition("### Capabilities\n")[0].splitlines()
    table: dict[str, set[str]] = {}
    owner = ""
    for line in rows:
        if line.startswith("| ") and line.count("|") >= 4:
            first, names, *_ = (part.strip() for part in line.strip("|").split("|"))
            owner = first.partition("`")[2].partition("`")[0] or owner
            table.setdefault(owner, set()).update(re.findall(r"`(\w+)", names))
    fields = {item.name for item in dataclasses.fields(kind)}
    if kind is not Sample and issubclass(kind, Sample):
        fields -= {item.name for item in dataclasses.fields(Sample)}
    assert fields <= table[kind.__name__]
    assert all(hasattr(kind, name) or name in fields for name in table[kind.__name__])
