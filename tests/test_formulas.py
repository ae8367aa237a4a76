"""Formulas of the documentation are drawn when it is built, so that its pages show them without a network."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"
FORMULAS = runpy.run_path(str(DOCS / "formulas.py"))


def formulas(page: Path) -> list[str]:
    """The formulas of a page."""
    text = re.sub(r"^```.*?^```$|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    found = re.findall(r"\$\$(.+?)\$\$|(?<![\\\w$])\$([^$\n]+?)\$(?![\w$])", text, flags=re.DOTALL)
    return [display or inline for display, inline in found]


PAGES = [page for page in sorted(DOCS.glob("*.md")) if formulas(page)]


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.drill_of("method")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_formulas_of_a_page_are_drawn(page: Path) -> None:
    """Each formula is a picture with its text for those who do not see it."""
    for tex in dict.fromkeys(formulas(page)):
        found = FORMULAS["markup"](tex, 1)
        assert "<path" in found
        assert 'role="math" aria-label="' in found
        assert found.endswith("</svg></span>")  # no space before what follows it
        assert not re.search(r'(?:src|href)="(?!#)', found)


def test_no_page_asks_the_network_for_formulas() -> None:
    """No script from elsewhere draws them."""
    assert "mathjax" not in (DOCS / "conf.py").read_text(encoding="utf-8")


def test_the_search_finds_pages_before_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever Sphinx is called, the search has the scores that put objects of the reference last."""
    monkeypatch.chdir(tmp_path)
    scorer = Path(runpy.run_path(str(DOCS / "conf.py"))["html_search_scorer"]).read_text(encoding="utf-8")
    assert 'kind === "object"' in scorer
    assert "score - 100" in scorer


def test_definitions_of_the_glossary_are_lists() -> None:
    """A term and its definition are a list on the page, not a paragraph with a colon."""
    assert "deflist" in runpy.run_path(str(DOCS / "conf.py"))["myst_enable_extensions"]
