"""The report in a real browser with its network cut. Skipped where there is none."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browsing import UNDRAWN, Drawn, Visit

Visiting = Callable[..., AbstractContextManager[Visit]]


@pytest.mark.drill
def test_requests_and_errors_would_be_seen(tmp_path: Path, visit: Visiting) -> None:
    """The check above can fail: a page that asks for an image, raises an error and opens a dialog is caught at all."""
    file = tmp_path / "page.html"
    address = "http://proofroll.invalid/a.png"
    file.write_text(f"<!doctype html><img src='{address}'><script>alert('hello')</script><script>nothing()</script>")
    with visit(file) as seen:
        for words in ("alert: hello", "nothing is not defined", "net::ERR_FAILED"):
            seen.until(lambda words=words: any(words in message for message in seen.messages), what=words)
        assert seen.requested == [file.as_uri(), address]


@pytest.mark.drill
def test_every_section_says_something(report_page: Path, visit: Visiting) -> None:
    """No section is a bare heading; one that is emptied is found."""
    with visit(report_page, before=UNDRAWN) as seen:
        seen.unfold()
        ids = seen.page.evaluate("[...document.querySelectorAll('section[id]')].map((section) => section.id)")
        assert {"verdicts", "replay", "evidence-invented"} <= set(ids)
        assert seen.page.evaluate("reading.empty()") == []
        seen.page.evaluate("document.querySelector('#replay').innerHTML = '<h2>Replay</h2> <svg></svg>'")
        assert seen.page.evaluate("reading.empty()") == ["replay"]


@pytest.mark.nightly
def test_a_table_with_rows_below_says_so(report_page: Path, visit: Visiting) -> None:
    """A table that shows not all of its rows says that there are more, until the last one has been in sight."""
    region = ".scroll:has(.matrix)"
    table = f"document.querySelector('{region}')"
    says = f"getComputedStyle({table}, '::after').content"
    with visit(report_page, viewport={"width": 1280, "height": 420}) as seen:
        seen.near(region, f"{table}.dataset.sorts === ''")  # until then it is taken apart, and loses its place
        seen.page.evaluate(f"{table}.style.maxHeight = '6rem'")
        seen.wait(f"{says}.includes('more rows')")
        seen.page.evaluate(f"{table}.scrollTop = {table}.scrollHeight")
        seen.wait(f"{says} === 'none'")


@pytest.mark.drill
def test_figures_are_drawn_when_they_come_into_view(report_page: Path, drawn_page: Drawn) -> None:
    """None far below before, each after a reader has scrolled to it, one that is not there is missed.

    Read to its end like that, the page has made one request, its own, and the console is silent.
    """
    seen = drawn_page.seen
    figures = seen.page.locator("figure[data-o]")
    assert drawn_page.at_first == 0, "not before it is needed"
    assert figures.count() == 12, "six quantities at two points"
    assert drawn_page.empty == []
    assert seen.page.locator("figure[data-o] .main-svg").count() >= figures.count()
    assert seen.requested == [report_page.as_uri()]
    assert seen.messages == []
    seen.page.evaluate("document.querySelector('main').insertAdjacentHTML('beforeend', '<figure>none</figure>')")
    assert seen.draw(patience=0.1) == ["none"]
    seen.page.evaluate("document.querySelector('main').lastElementChild.remove()")


@pytest.mark.nightly
def test_links_lead_to_evidence_that_opens(report_page: Path, visit: Visiting) -> None:
    """Every link within the page ends at something one can see, however it was folded; a dead one is found."""
    with visit(report_page, before=UNDRAWN) as seen:
        assert seen.page.locator("a[href^='#']").count() > 50
        assert seen.page.evaluate("reading.lost(\"a[href^='#']\", 60_000)") == []
        seen.page.evaluate("document.querySelector('main').insertAdjacentHTML('beforeend', '<a href=\"#no\">x</a>')")
        assert seen.page.evaluate("reading.lost(\"a[href='#no']\", 100)") == ["#no"]
        assert seen.messages == []


@pytest.mark.nightly
def test_no_number_is_broken_at_its_hyphen(report_page: Path, visit: Visiting) -> None:
    """On a phone, with everything open, each number like 1e-4 stands in one line; without the care for it, not."""
    with visit(report_page, before=UNDRAWN, viewport={"width": 400, "height": 900}) as seen:
        seen.unfold()
        seen.page.evaluate(
            "document.querySelectorAll('main > section').forEach((it) => it.style.contentVisibility = 'visible')"
        )
        assert seen.page.evaluate("reading.broken()") == []
        seen.page.evaluate("document.querySelectorAll('.whole').forEach((it) => it.className = '')")
        assert len(seen.page.evaluate("reading.broken()")) > 1


@pytest.mark.drill
def test_what_is_folded_is_built_when_it_is_opened(everything: Any, tmp_path: Path, visit: Visiting) -> None:
    """Of two comparisons the second is a heading until it is opened; then its tables are built.

    Until everything is opened the page has few elements.
    """
    first = everything.content.comparisons[0]
    content = replace(everything.content, comparisons=[first, replace(first, name="again", title="Again")])
    both = replace(everything, content=content, curves=2 * everything.curves).write(tmp_path / "report.html")
    count = "document.querySelectorAll('*').length"
    with visit(both, before=UNDRAWN) as seen:
        few = seen.page.evaluate(count)
        assert seen.page.locator("#evidence-again table").count() == 0
        seen.page.locator("#verdicts-again > summary").press("Enter")
        seen.page.locator("#evidence-again > details > summary").press("Enter")
        seen.wait("document.querySelectorAll('#evidence-again table').length > 3")
        assert seen.page.locator("#evidence-again [data-engine='alpha']").count() > 0
    with visit(both, before=UNDRAWN) as seen:
        seen.unfold()
        assert seen.page.evaluate(count) > 1.5 * few
        assert seen.messages == []


@pytest.mark.nightly
def test_open_all_opens_all_and_closes_again(report_page: Path, visit: Visiting) -> None:
    """The button builds and opens every fold; pressed again, those are open that were so at first."""
    opened = "document.querySelectorAll('details[open]').length"
    with visit(report_page, before=UNDRAWN) as seen:
        first = seen.page.evaluate(opened)
        button = seen.page.locator("#unfold")
        button.click()
        seen.until(lambda: button.inner_text() == "Close all", what="all is open")
        assert seen.page.evaluate("document.querySelectorAll('[data-fold], details:not([open])').length") == 0
        assert button.get_attribute("aria-pressed") == "true"
        button.click()
        seen.until(lambda: button.inner_text() == "Open all", what="all is closed")
        assert seen.page.evaluate(opened) == first
        assert seen.messages == []


@pytest.mark.drill
def test_an_address_with_a_fragment_opens_its_evidence(report_page: Path, visit: Visiting) -> None:
    """A link from elsewhere into a folded part unfolds it, and what lies around it."""
    name = "evidence-invented.beta.speed-4"
    with visit(report_page, f"#{name}", before=UNDRAWN) as seen:
        seen.wait(f"document.getElementById('{name}')?.open")
        # what is folded is built once the browser has told that it opened
        seen.page.locator(f"[id='{name}'] table").first.wait_for()
        seen.wait(f"document.getElementById('{name}').getBoundingClientRect().top < innerHeight")


@pytest.mark.nightly
def test_a_command_is_copied(report_page: Path, visit: Visiting) -> None:
    """The button beside the command of a run copies it, letter by letter, also in a part that is unfolded later."""
    name = "evidence-invented.beta.speed-4"
    copied = "window.copied = []; navigator.clipboard.writeText = async (text) => { copied.push(text); };"
    with visit(report_page, f"#{name}", before=UNDRAWN + copied) as seen:
        command = seen.page.locator(f"[id='{name}'] dd > code", has_text="proofroll run")
        button = seen.page.locator(f"[id='{name}'] button.copy")
        button.click()
        seen.wait("copied.length === 1")
        assert seen.page.evaluate("copied[0]") == command.text_content()
        assert command.text_content().startswith("proofroll run ")
        seen.until(lambda: button.inner_text() == "copied", again=button.click, what="copied")
        seen.page.evaluate("() => { navigator.clipboard.writeText = () => Promise.reject(new Error('forbidden')); }")
        seen.until(lambda: button.inner_text() == "selected", again=button.click, what="selected")
        assert seen.page.evaluate("String(getSelection())") == command.text_content()
        assert seen.messages == []


@pytest.fixture(scope="module")
def drawn(drawn_page: Drawn) -> Visit:
    """The page, in which ``drawn`` are the figures of its first point and ``told`` counts the zooms told to these."""
    seen = drawn_page.seen
    seen.page.locator("figure[data-o]").first.scroll_into_view_if_needed()
    seen.page.evaluate(
        """() => {
          window.drawn = [...document.querySelectorAll('figure[data-p="0"] .canvas')];
          window.told = 0;
          drawn.forEach((element) => element.addEventListener("zoom", () => ++told));
        }"""
    )
    return seen


def place(seen: Visit, share: float, figure: int = 0) -> tuple[float, float]:
    """Where on the screen the truth of a figure is, at a share of its time axis."""
    return tuple(
        seen.page.evaluate(
            """([share, figure]) => {
              const element = drawn[figure], { left, top } = element.getBoundingClientRect();
              const { x, y } = element.data[0], at = Math.round(share * (x.length - 1));
              return [left + element.places.x(x[at]), top + element.places.y(y[at])];
            }""",
            [share, figure],
        )
    )


@pytest.mark.nightly
def test_zoom_in_one_figure_is_zoom_in_all(drawn: Visit) -> None:
    """Dragging in a figure sets the time axis of each, and is told once: nothing is passed back."""
    mouse = drawn.page.mouse
    (left, top), (right, _) = place(drawn, 0.25), place(drawn, 0.5)
    mouse.move(left, top)
    mouse.down()
    mouse.move(right, top, steps=4)
    mouse.up()
    drawn.wait("told >= 1")
    drawn.page.wait_for_timeout(200)  # one that was passed back would come now
    ranges = drawn.page.evaluate("drawn.map((element) => element.layout.xaxis.range.join(' '))")
    assert len(set(ranges)) == 1
    assert [float(end) for end in ranges[0].split()] == pytest.approx([0.25, 0.5], abs=0.02)
    assert drawn.page.evaluate("told") == 1
    whole = "drawn.every((element) => element.layout.xaxis.range[1] >= 1)"
    for _ in range(20):  # two clicks that a busy machine takes apart are no double one
        mouse.dblclick(left, top)
        drawn.page.wait_for_timeout(500)
        if drawn.page.evaluate(whole):
            break
    drawn.wait(whole)


@pytest.mark.drill
def test_pointer_in_one_figure_shows_the_time_in_all(drawn: Visit) -> None:
    """Where the pointer is on a curve, every other figure shows its truth, until the pointer leaves."""
    labels = "drawn.filter((element) => element.querySelector('.hovertext')).length"
    # A figure that is drawn anew meanwhile, after the zoom of another test, forgets where the pointer is.
    drawn.wait(f"{labels} === drawn.length", again=lambda: drawn.page.mouse.move(*place(drawn, 0.4)))
    drawn.page.mouse.move(2, 2)
    drawn.wait(f"{labels} === 0")


@pytest.mark.drill
def test_a_row_is_switched_off_in_every_figure(drawn: Visit) -> None:
    """The legend acts on all figures of a comparison, and says so to a screen reader."""
    hidden = "drawn.map((element) => element.data.filter((trace) => trace.visible === false).length)"
    button = drawn.page.locator('.legend [data-row="1"]').first
    button.click()
    drawn.wait(f"{hidden}.every((count) => count >= 2)")  # its curve and its distance
    assert button.get_attribute("aria-pressed") == "false"
    button.click()
    drawn.wait(f"{hidden}.every((count) => count === 0)")


def test_first_slips_and_bounds_of_friction_are_drawn(drawn: Visit) -> None:
    """A line with its name for each bound, and a marker for each first slip."""
    figure = drawn.page.locator("figure[data-o]", has_text="μ static = 0.3")
    assert figure.count() == 1
    assert figure.get_by_text("μ kinetic = 0.2").count() == 1
    slips = "(figure) => figure.querySelector('.canvas').data.filter((trace) => trace.name === 'first slip').length"
    assert figure.evaluate(slips) == 5, "of the truth and of four runs"


@pytest.mark.nightly
def test_the_contents_follow_the_reader(report_page: Path, visit: Visiting) -> None:
    """Wherever a reader is, the contents are in sight and mark the section that is being read."""
    with visit(report_page, before=UNDRAWN) as seen:
        for name in ("replay", "verdicts"):
            marked = "[...document.querySelectorAll('nav a[aria-current]')].map((link) => link.hash).join()"
            seen.near(f"#{name}", f"{marked} === '#{name}'")
            assert seen.page.evaluate("document.querySelector('nav').getBoundingClientRect().top") < 200
