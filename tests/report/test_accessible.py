"""The report is read with a keyboard, on a phone, in the dark and without colour: measured in a real browser."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from itertools import pairwise
from pathlib import Path

import pytest
from browsing import UNDRAWN, Visit

Visiting = Callable[..., AbstractContextManager[Visit]]

# A line of the tree of what a screen reader says, without a name in quotes.
SILENT = re.compile(r'^ *- (?:link|button|region|img)\b(?! ".).*', flags=re.MULTILINE)
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}

# WCAG 2.2, 1.4.3: text and what is behind it; all of ours is small.
LEAST_CONTRAST = 4.5


@pytest.fixture(scope="module")
def seen(report_page: Path, visit: Visiting) -> Iterator[Visit]:
    """The page without its figures, on a screen that is quickly painted; each test leaves it as it was."""
    with visit(report_page, before=UNDRAWN, viewport={"width": 1280, "height": 300}) as opened:
        yield opened


@pytest.fixture
def unfolded(seen: Visit) -> Iterator[Visit]:
    """The page with everything unfolded."""
    folded = "[...document.querySelectorAll('details:not([open])')]"
    seen.page.evaluate(f"window.folded = {folded}")
    seen.unfold()
    yield seen
    seen.page.evaluate("folded.forEach((fold) => { fold.open = false; })")


@pytest.mark.drill
def test_tab_reaches_everything_in_order_and_shows_where_it_is(seen: Visit) -> None:
    """Each link, button, fold and scrolling table gets the focus once, in the page's order, outlined and in sight."""
    reachable = seen.page.evaluate("reading.reachable()")
    kinds = " ".join(reachable)
    assert kinds.count("A.v ") >= 8, "verdict links"
    assert kinds.count("BUTTON") >= 6, "legend"
    assert kinds.count("SUMMARY") >= 5
    assert kinds.count("DIV.scroll") >= 5
    seen.page.evaluate("() => { window.visited = reading.visits(); }")
    for _ in range(len(reachable) + 20):  # a browser may stop at something that scrolls besides
        seen.page.keyboard.press("Tab")
    visited = [focus for focus in seen.page.evaluate("visited") if focus["number"] >= 0]
    for focus in visited:
        assert focus["outlined"], reachable[focus["number"]]
        assert focus["seen"], reachable[focus["number"]]
    # After the last the browser begins again.
    numbers = [focus["number"] for focus in visited]
    left_out = sorted(set(range(len(reachable))) - set(numbers))
    assert numbers[: len(reachable)] == list(range(len(reachable))), [reachable[number] for number in left_out]


@pytest.mark.drill
def test_keys_do_what_the_mouse_does(seen: Visit) -> None:
    """Enter follows a verdict and folds a part, space presses a button of the legend."""
    link = seen.page.locator(".matrix .cell a").first
    link.press("Enter")
    address = (link.get_attribute("href") or "").removeprefix("#")
    evidence = seen.page.locator(f"[id='{address}']")  # an address has points, which "#…" would take for classes
    seen.wait(f"document.getElementById('{address}')?.open")
    evidence.locator("table").first.wait_for()  # built once the browser has told that its fold opened
    evidence.locator("summary").press("Enter")
    evidence.locator("table").first.wait_for(state="hidden")
    button = seen.page.locator(".legend [data-row]").first
    for pressed in ("false", "true"):
        button.press("Space")
        seen.until(lambda pressed=pressed: button.get_attribute("aria-pressed") == pressed, what="the button's state")


@pytest.mark.drill
def test_headings_form_an_outline(unfolded: Visit) -> None:
    """One title; no level is skipped on the way down; no heading is empty, and none hides from a screen reader."""
    levels, texts = unfolded.page.evaluate(
        """() => {
          const found = [...document.querySelectorAll("h1, h2, h3, h4, h5, h6")].filter((h) => h.checkVisibility());
          return [found.map((h) => Number(h.tagName[1])), found.map((h) => h.textContent.trim())];
        }"""
    )
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert all(texts)
    tree = unfolded.page.locator("body").aria_snapshot()
    assert tree.count("heading ") == len(levels)


@pytest.mark.drill
def test_everything_that_is_used_has_a_name(unfolded: Visit) -> None:
    """Links, buttons, scrolling regions and figures are announced by a name, not by silence; silence would be found."""

    def silent() -> list[str]:
        return SILENT.findall(unfolded.page.locator("body").aria_snapshot())

    assert silent() == []
    unfolded.page.evaluate("document.querySelector('main').append(document.createElement('button'))")
    assert len(silent()) == 1
    unfolded.page.evaluate("document.querySelector('main').lastChild.remove()")


@pytest.mark.nightly
def test_a_phone_scrolls_down_only(report_page: Path, visit: Visiting) -> None:
    """Nothing is wider than 390 pixels; what must be, scrolls in a region of its own; text too wide would be found."""
    with visit(report_page, **PHONE) as seen:
        assert seen.page.evaluate("reading.wide()") == [0, []]
        seen.unfold()
        assert seen.draw("figure:not([data-p='1'])") == []  # those of the second point are as wide
        assert seen.page.evaluate("reading.wide()") == [0, []]
        seen.page.evaluate("document.querySelector('h1').style.minWidth = '600px'")
        seen.wait("reading.wide()[0] > 0")  # the screen that a phone emulates follows a moment later
        _, wide = seen.page.evaluate("reading.wide()")
        assert any(name.startswith("H1") for name in wide)


@pytest.mark.nightly_of("light")
@pytest.mark.drill
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_differs_from_its_background(unfolded: Visit, scheme: str) -> None:
    """Every text, those of verdicts among them, has the contrast that small text needs; faint text would be found."""
    page = unfolded.page
    page.emulate_media(color_scheme=scheme)
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (ground == "rgb(251, 251, 252)") == (scheme == "light")
    for verdict in ("agrees", "differs"):
        assert page.locator(f".cell .v.{verdict}").count() > 0
    assert page.evaluate("reading.faint", LEAST_CONTRAST) == []
    faint = page.add_style_tag(
        content=".cell .v.agrees { color: color-mix(in srgb, var(--agrees) 50%, var(--agrees-bg)) }"
    )
    found = page.evaluate("reading.faint", LEAST_CONTRAST)
    assert len(found) >= page.locator(".cell .v.agrees").count()
    faint.evaluate("(style) => style.remove()")


@pytest.mark.drill
def test_nobody_who_asked_for_stillness_sees_motion(seen: Visit) -> None:
    """With reduced motion preferred, nothing scrolls, fades or turns by itself."""
    style = seen.page.add_style_tag(content="h1 { transition: color 2s } .answer { animation: none 3s infinite }")
    assert "H1. " in seen.page.evaluate("reading.moving()"), "what a part of the page may ask for"
    seen.page.emulate_media(reduced_motion="reduce")
    assert seen.page.evaluate("reading.moving()") == []
    style.evaluate("(style) => style.remove()")
