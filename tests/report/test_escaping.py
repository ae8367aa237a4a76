"""Whatever a scene, an engine or a message says is shown as it is written and does nothing: seen in a real browser."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest
from browsing import UNDRAWN, Drawn, Visit
from poison import Poison

from proofroll.report.labels import symbol

Visiting = Callable[..., AbstractContextManager[Visit]]

PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
# What became of poison: whose ran, elements made of it, scripts, and attributes that would run.
HARM = """() => {
  const acts = (element) => [...element.attributes].some(({ name }) => name.startsWith("on"));
  const count = (selector) => document.querySelectorAll(selector).length;
  const handlers = [...document.querySelectorAll("*")].filter(acts).length;
  return [window.poisoned ?? [], count("img, b.poison, textarea, [autofocus]"), count("script"), handlers];
}"""
# A handler of an attribute is told of the focus: when a browser gives it by itself, if at all, is not the page's doing.
FELT = """(
  document.querySelectorAll("[onfocus]").forEach((element) => element.dispatchEvent(new FocusEvent("focus"))),
  window.poisoned !== undefined
)"""
# The replay's words are poisoned in a test of its own: among its data are pictures and a program.
TEXT = """() => {
  const body = document.body.cloneNode(true);
  body.querySelectorAll("script, style, svg, .replay").forEach((element) => element.remove());
  return body.textContent;
}"""


@pytest.fixture(scope="module")
def poison() -> Poison:
    """Remembers what it gave to whom."""
    return Poison()


@pytest.fixture(scope="module")
def poisoned_page(everything: Any, poison: Poison, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page that has every part of a report, each string in it poisoned."""
    others = poison.content(dataclasses.replace(everything.content, replay=None))
    bad = dataclasses.replace(
        everything,
        content=dataclasses.replace(others, replay=everything.content.replay),
        curves=poison.content(everything.curves, names=False),
    )
    return bad.write(tmp_path_factory.mktemp("poisoned") / "report.html")


@pytest.fixture(scope="module")
def poisoned(poisoned_page: Path, visit: Visiting) -> Iterator[Visit]:
    """That page, unfolded and drawn, save figures of its second point: the same strings are on those of the first."""
    with visit(poisoned_page) as seen:
        seen.unfold()
        assert seen.draw("figure:not([data-p='1'])") == []
        yield seen


@pytest.mark.drill
def test_nothing_that_others_write_runs(drawn_page: Drawn, poisoned_page: Path, poisoned: Visit) -> None:
    """Read to its end, unfolded, drawn, pointed at and clicked through: no script, element or handler of theirs.

    The label at the pointer shows the poison as text.
    """
    page = poisoned.page
    for seen in (drawn_page.seen, poisoned):  # the script of a picture comes once the replay has been in sight
        seen.near(".replay", "document.querySelector('.replay').dataset.ready === ''")
    scripts = drawn_page.seen.page.evaluate(HARM)[2]
    for number in range(3):
        page.locator(".legend button").nth(number).click()
    page.evaluate(
        """() => {
          const element = document.querySelector("figure[data-o] .canvas");
          chart.hover(element, 1, 9);
        }"""
    )
    label = page.locator("figure[data-o] .hovertext").first
    assert "</script></style></title></textarea><script>(window.poisoned" in label.text_content()
    assert "&amp;&lt;%{y}{{7*7}}" in label.text_content()
    assert page.evaluate(HARM) == [[], 0, scripts, 0]
    assert poisoned.requested == [poisoned_page.as_uri()]
    spoilt = "> attribute "  # numbers of a drawing that poison made none of: left out by the browser, which says so
    assert [message for message in poisoned.messages if spoilt not in message] == []


@pytest.mark.nightly
def test_poison_would_be_felt(poisoned_page: Path, poison: Poison, tmp_path: Path, visit: Visiting) -> None:
    """The check above can fail: one string that is let through once, as text or in an attribute, does its harm."""
    text = poisoned_page.read_text(encoding="utf-8")
    title = poison.dose("An invented comparison")
    written = html.escape(title).replace("&quot;", "&#34;").replace("&#x27;", "&#39;")  # as jinja writes it
    for mark in (f">{written}", f'="Verdicts: {written}"'):
        assert mark in text, mark
        file = tmp_path / "page.html"
        file.write_text(text.replace(mark, mark.replace(written, title), 1), encoding="utf-8")
        with visit(file) as seen:
            seen.wait(FELT)
            ran, elements, *_ = seen.page.evaluate(HARM)
            assert set(ran) == {int(poison.doses["An invented comparison"])}
            assert elements >= 1


@pytest.mark.nightly
def test_everything_that_others_write_is_shown_as_it_is_written(
    report_page: Path, poisoned_page: Path, poison: Poison, visit: Visiting
) -> None:
    """Each string that the page shows is shown with its poison, letter by letter; none is dropped or read as markup."""
    clean, bad = (text_of(page, visit) for page in (report_page, poisoned_page))
    # Shown instead of a name, where the page does not know the quantity: it has the poison of that name.
    instead = {symbol(name) for name in poison.doses if symbol(name) != name}
    found = [text for text in poison.said - instead if len(text) > 9 and text in clean]
    # A text within a longer one is shown as a part of that one.
    shown = [text for text in found if not any(text in other and text != other for other in found)]
    lost = [text for text in shown if " ".join(poison.dose(text).split()) not in bad]
    assert len(shown) > 20
    assert lost == []


def text_of(page: Path, visit: Visiting) -> str:
    """All text of a page but what its figures draw, which ``TEXT`` leaves out."""
    with visit(page, before=UNDRAWN) as seen:
        seen.unfold()
        return " ".join(seen.page.evaluate(TEXT).split())


@pytest.mark.nightly
def test_long_words_of_others_do_not_widen_a_phone(poisoned_page: Path, visit: Visiting) -> None:
    """A name without a gap is broken or scrolls in its region."""
    with visit(poisoned_page, **PHONE) as seen:
        seen.unfold()
        assert seen.page.evaluate("reading.wide()") == [0, []]
