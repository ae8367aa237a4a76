"""CONTRIBUTING.md and the pages for maintainers are short, and lead to files that exist."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "proofroll"
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
WORKED_CHANGES = (ROOT / "docs" / "maintain" / "worked_changes.md").read_text(encoding="utf-8")
DECISIONS = sorted((ROOT / "docs" / "maintain" / "decisions").glob("*.md"))
MAP: dict[str, Any] = runpy.run_path(str(ROOT / "docs" / "module_map.py"))
# Parts of every kind of element or study: "the element's `kind.py`".
_OF_EACH = ("elements/*", "studies/*")


def rows() -> list[str]:
    """The lines of tables with at least one path in code."""
    return [line for line in (TEXT + WORKED_CHANGES).splitlines() if line.startswith("|") and paths(line)]


def paths(line: str) -> list[str]:
    """The paths in a line: names in code with a slash or the ending of a file."""
    return [name for name in re.findall(r"`([^`\s]+)`", line) if re.search(r"/|\.(py|md|toml|html|bib)$", name)]


def missing(line: str) -> list[str]:
    """The paths of a line that lead nowhere; a name without a folder lies beside the path before it."""
    found: list[str] = []
    before: list[Path] = []
    for name in paths(line):
        bases = [*before, SOURCE, ROOT, ROOT / "docs", *(folder for each in _OF_EACH for folder in SOURCE.glob(each))]
        places = [place for base in bases for place in base.glob(name.rstrip("/"))]
        if not places:
            found.append(name)
            continue
        folder = places[0] if places[0].is_dir() else places[0].parent
        before = [folder, *before]
    return found


@pytest.mark.parametrize("line", rows(), ids=lambda line: line.split("|")[1].strip()[:50])
def test_every_path_of_a_table_is_there(line: str) -> None:
    """Each path in a table of CONTRIBUTING.md is a file or a folder of this repository."""
    assert missing(line) == []


@pytest.mark.parametrize("line", rows(), ids=lambda line: line.split("|")[1].strip()[:50])
def test_every_row_of_a_table_is_short(line: str) -> None:
    """A row of a table in CONTRIBUTING.md has at most 200 characters; a longer one is two rows."""
    assert len(line) <= 200


def test_a_wrong_path_is_seen() -> None:
    """A path that is not there is named, and the others of its line are not."""
    assert missing("| a | `core/verdict.py`, `convergence.py`, `nowhere.py`, `studies/none/` |") == [
        "nowhere.py", "studies/none/",
    ]  # fmt: skip


def test_every_folder_of_tests_is_explained() -> None:
    """Each folder of tests has its place in the table of what tests guard."""
    folders = {path.parent.name for path in (ROOT / "tests").glob("*/test_*.py")}
    assert [name for name in sorted(folders) if f"`tests/{name}/`" not in TEXT] == []


def test_every_folder_of_the_package_is_on_the_map() -> None:
    """Each folder of the package has a row of the map."""
    folders = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    assert [name for name in sorted(folders) if f"| `{name}/` |" not in TEXT] == []


def test_a_test_lies_where_its_module_does() -> None:
    """A test file with the name of one module of the package, of two words or more, lies in that module's folder."""
    homes: dict[str, list[Path]] = {}
    for file in SOURCE.rglob("*_*.py"):
        homes.setdefault(f"test_{file.name}", []).append(file.parent.relative_to(SOURCE))
    tests = ROOT / "tests" / "unit"
    astray = [
        f"{file.relative_to(tests)} tests a module of {homes[file.name][0]}"
        for file in tests.rglob("test_*_*.py")
        if len(homes.get(file.name, [])) == 1 and homes[file.name] != [file.parent.relative_to(tests)]
    ]
    assert astray == []


def test_every_path_in_the_text_is_there() -> None:
    """A file or folder that a sentence names by a path is in the repository."""
    pages = [TEXT, WORKED_CHANGES, *(path.read_text(encoding="utf-8") for path in DECISIONS)]
    text = re.sub(r"^ *```.*?^ *```$", "", "\n".join(pages), flags=re.DOTALL | re.MULTILINE)
    named = {name.rstrip("/") for name in re.findall(r"`([\w./-]+(?:\.py|\.md|\.toml|/))`", text)}
    tops = (
        "findings",
        "changes",
        "src",
        "models",
        "comparisons",
        "docs",
        "examples",
        "fuzz",
        "throughput",
        "benchmarks",
        "tests",
    )
    there = [f"/{path.relative_to(ROOT)}" for top in tops for path in (ROOT / top, *(ROOT / top).rglob("*"))]
    there += [f"/{path.name}" for path in ROOT.iterdir()]
    assert [name for name in sorted(named) if not any(path.endswith(f"/{name}") for path in there)] == []


def test_documents_for_maintainers_are_short() -> None:
    """CONTRIBUTING.md has at most 10 kB, the changelog at most 80 lines of at most 200 characters."""
    assert len(TEXT.encode()) <= 10_000
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 80
    assert [line for line in lines if len(line) > 200] == []


def test_a_change_is_a_sentence() -> None:
    """Each line of a file in changes/ is one sentence of at most 200 characters."""
    files = sorted(path for path in (ROOT / "changes").iterdir() if path.name != "README.md")
    assert {path.suffix for path in files} <= {".md"}
    lines = [(path.name, line) for path in files for line in path.read_text(encoding="utf-8").splitlines() if line]
    assert [(name, line) for name, line in lines if len(line) > 200 or not line.endswith(".")] == []


@pytest.mark.parametrize("path", DECISIONS, ids=lambda path: path.stem)
def test_a_decision_is_dated(path: Path) -> None:
    """A decision is a file named by its date, with a title, the date and its reason."""
    date = re.match(r"\d{4}-\d\d-\d\d", path.name)
    assert date
    title, _, day, _, *reason = path.read_text(encoding="utf-8").splitlines()
    assert title.startswith("# ")
    assert day == f"*{date[0]}*"
    assert any(reason)


def test_the_map_has_every_module() -> None:
    """The map has a line with content for each module of the package."""
    lines = MAP["modules"]()
    assert lines.keys() == {path.relative_to(SOURCE).as_posix() for path in SOURCE.rglob("*.py")}
    assert [path for path, line in lines.items() if not line] == []
    assert "| `verdict.py` | " in MAP["document"]()


def test_the_map_prints_modules_by_word(capsys: pytest.CaptureFixture[str]) -> None:
    """Words choose the modules that the map prints, by path or content."""
    MAP["main"](["verdict", "core/"])
    printed = capsys.readouterr().out.splitlines()
    assert any(line.startswith("core/verdict.py: ") for line in printed)
    assert all("core/" in line and "verdict" in line.lower() for line in printed)
