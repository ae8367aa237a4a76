"""The report on paper: as a browser prints it."""

from __future__ import annotations

import io
import json
import re
import unicodedata
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from browsing import UNDRAWN, Visit
from pypdf import PdfReader

Visiting = Callable[..., AbstractContextManager[Visit]]

# A4 between our margins, in CSS pixels of 1/96 inch.
PAPER = {"width": round((210 - 2 * 10) / 25.4 * 96), "height": round((297 - 12 - 15) / 25.4 * 96)}
MOST_PAGES = 6
# Numbers of verdicts as wide as they become.
WIDEN = "document.querySelectorAll('.matrix .cell b').forEach((number) => { number.lastChild.data = ' 9.99e-13'; })"
FIRST_POINT = "[...document.querySelectorAll('figure[data-p=\"0\"] .canvas')].filter((e) => e.data).length"
COLOURS = """() => [getComputedStyle(document.body).backgroundColor,
  getComputedStyle(document.querySelector("figure[data-o] .xtick text")).fill]"""


@pytest.fixture(scope="module")
def on_paper(report_page: Path, visit: Visiting) -> tuple[PdfReader, list[list[str]], list[int]]:
    """The page as a PDF, printed in the dark; its colours before, on paper and afterwards; figures before and on it."""
    with visit(report_page, color_scheme="dark", viewport={"width": 900, "height": 300}) as seen:
        assert seen.draw("figure[data-o='0'][data-p='0']") == []
        colours = [seen.page.evaluate(COLOURS)]
        figures = [seen.page.evaluate(FIRST_POINT)]
        noted = f"window.onPaper = ({COLOURS})(); window.figures = {FIRST_POINT};"
        seen.page.evaluate(f"addEventListener('beforeprint', () => {{ {noted} }})")
        content = seen.page.pdf(
            format="A4", prefer_css_page_size=True, print_background=True, tagged=True, outline=True
        )
        assert seen.messages == []
        seen.wait(f"JSON.stringify(({COLOURS})()) === {json.dumps(json.dumps(colours[0], separators=(',', ':')))}")
        colours += [seen.page.evaluate("onPaper"), seen.page.evaluate(COLOURS)]
        figures += [seen.page.evaluate("figures")]
    return PdfReader(io.BytesIO(content)), colours, figures


@pytest.fixture(scope="module")
def printed(on_paper: tuple[PdfReader, list[list[str]], list[int]]) -> PdfReader:
    """The page as a PDF."""
    return on_paper[0]


@pytest.mark.nightly
def test_nothing_is_cut_off_at_the_edge_of_the_paper(report_page: Path, visit: Visiting) -> None:
    """Every table is as wide as it is and no wider than the paper; a table too wide would be found.

    Contents, buttons and what is folded are not there.
    """
    with visit(report_page, viewport=PAPER, before=UNDRAWN) as seen:
        seen.page.emulate_media(media="print")
        for folded in ("nav", ".skip", "button[data-all]", ".chapter .heat", ".run", ".replay-play"):
            assert not seen.page.locator(folded).locator("visible=true").count(), folded
        seen.page.evaluate("document.querySelectorAll('.point > details, .kept').forEach((it) => { it.open = true; })")
        seen.wait("document.querySelectorAll('.matrix').length === 3")  # a busy machine takes a moment
        matrices = seen.page.locator(".matrix")
        assert all(matrices.nth(number).is_visible() for number in range(3))
        seen.page.evaluate(WIDEN)
        assert seen.page.evaluate("reading.cut()") == [[], []]
        seen.page.add_style_tag(
            content=".matrix { min-width: 60rem } h1 { overflow: auto; max-width: 2rem; white-space: nowrap }"
        )
        wide, hidden = seen.page.evaluate("reading.cut()")
        assert any("matrix" in name for name in wide)
        assert any(name.startswith("H1") for name in hidden)


@pytest.mark.drill
def test_pdf_holds_the_verdicts_and_is_short(printed: PdfReader) -> None:
    """The text of each verdict is in the file; no page is empty, and all of them are few."""
    pages = [unicodedata.normalize("NFKC", page.extract_text()) for page in printed.pages]  # without ligatures
    text = " ".join(" ".join(pages).split())
    assert 2 <= len(pages) <= MOST_PAGES
    assert all(page.strip() for page in pages)
    for word in ("An invented comparison", "✓ agrees", "✗ differs", "gamma is not installed here"):
        assert word in text, word
    assert text.count("not expected") >= 2
    assert "Skip to the answer" not in text


@pytest.mark.nightly
def test_pdf_has_bookmarks_and_a_title(printed: PdfReader) -> None:
    """A reader of the file finds their way by the headings."""
    titles = [entry.title for entry in printed.outline if not isinstance(entry, list)]
    assert titles == ["An invented comparison"]
    assert "Verdicts and evidence" in [entry.title for entry in printed.outline[1] if not isinstance(entry, list)]
    assert printed.metadata is not None
    assert printed.metadata.title == "proofroll: which engine can be trusted"


@pytest.mark.nightly
def test_what_was_never_looked_at_is_drawn_for_paper(on_paper: tuple[PdfReader, list[list[str]], list[int]]) -> None:
    """A figure far below the screen has no picture until the page is printed, once its parts are here."""
    before, printed = on_paper[2]
    assert before < printed == 6


@pytest.mark.nightly
def test_paper_is_white_in_the_dark(on_paper: tuple[PdfReader, list[list[str]], list[int]]) -> None:
    """Who reads on a dark screen prints dark on white, the figures too, and then has their dark screen back."""
    before, (ground, ink), after = on_paper[1]
    assert ground == "rgb(255, 255, 255)"
    assert max(int(part) for part in re.findall(r"\d+", ink)) < 60
    assert after == before != [ground, ink]
