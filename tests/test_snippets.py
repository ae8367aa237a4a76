"""The Python of pages under docs/ runs as one program each, and their links lead somewhere."""

from __future__ import annotations

import inspect
import re
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = {page.name: page.read_text(encoding="utf-8") for page in sorted(DOCS.glob("*.md"))}


def snippets(text: str) -> list[tuple[int, str]]:
    """Each Python block of a page, with its line; one that reads a report is run by ``report/test_long_table.py``."""
    blocks = re.finditer(r"^```python\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    return [(text[: block.start(1)].count("\n"), block[1]) for block in blocks if "out/report.json" not in block[1]]


@pytest.mark.nightly_of("control_a_robot.md", "surfaces.md", "agreement_in_your_tests.md")
@pytest.mark.drill
@pytest.mark.parametrize("name", [name for name, text in PAGES.items() if snippets(text)])
def test_the_python_of_a_page_runs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, assert_agrees: Callable[..., Any]
) -> None:
    """The snippets of a page run one after another, as a reader would type them, and so do the tests among them."""
    module = types.ModuleType(f"page_{Path(name).stem}")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.chdir(tmp_path)
    for line, source in snippets(PAGES[name]):
        exec(compile("\n" * line + source, str(DOCS / name), "exec"), vars(module))
    for function in [item for key, item in vars(module).items() if key.startswith("test_")]:
        wanted = inspect.signature(function).parameters
        function(**{"assert_agrees": assert_agrees} if "assert_agrees" in wanted else {})


@pytest.mark.parametrize("name", PAGES)
def test_links_of_a_page_lead_somewhere(name: str) -> None:
    """Every relative link leads to a file of the repository."""
    targets = [target for target in re.findall(r"\]\(([^)#]+)\)", PAGES[name]) if "://" not in target]
    built = {"vocabulary.md"}  # by `make docs`
    assert [target for target in targets if target not in built and not (DOCS / target).exists()] == []
