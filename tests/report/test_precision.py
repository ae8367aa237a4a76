"""Work–precision pictures in a browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browsing import Visit
from folded import whole

Visiting = Callable[..., AbstractContextManager[Visit]]
PART = "[data-precision=evidence-invented]"
PICTURE = f"document.querySelector('{PART} .canvas')"
TRACES = f"{PICTURE}.data.filter((trace) => trace.name && trace.name !== 'choice')"


@pytest.fixture(scope="module")
def seen(report_page: Path, visit: Visiting) -> Iterator[Visit]:
    """The page with the pictures of its comparison drawn."""
    with visit(report_page, viewport={"width": 1280, "height": 900}) as opened:
        # Again, as the sections above have their heights only once they have been near.
        opened.wait(f"({PICTURE}.data ?? []).length > 0", opened.page.locator(PART).scroll_into_view_if_needed)
        yield opened


@pytest.mark.drill
def test_an_engine_has_one_colour_in_all_pictures(everything: Any, tmp_path: Path, visit: Visiting) -> None:
    """A curve has the colour that its engine has in the curves, also where another engine comes first."""
    table = everything.content.table
    content = replace(everything.content, table=replace(table, lines=table.lines[::-1]))
    page = replace(everything, content=content).write(tmp_path / "report.html")
    assert content.engines[:2] == ["alpha", "beta"]
    with visit(page, viewport={"width": 1280, "height": 900}) as opened:
        opened.wait(f"({PICTURE}.data ?? []).length > 0", opened.page.locator(PART).scroll_into_view_if_needed)
        drawn = opened.page.evaluate(f"{TRACES}.map((trace) => [trace.name, trace.line.color])")
        colours = [opened.page.evaluate(f"plots.paint('--e{at}')") for at in (0, 1)]
    assert [name for name, _ in drawn] == ["only", "fine default", "fine matched"]
    assert [colour for _, colour in drawn] == [colours[1], colours[0], colours[0]]


@pytest.mark.drill
def test_what_panels_show_is_said_once(everything: Any, tmp_path: Path) -> None:
    """The page's first picture says how to read it, with the id to which all others lead."""
    first = everything.content.comparisons[0]
    again = replace(first, name="again", title="Again")
    table = everything.content.table
    more = [replace(line, study="again") for line in table.lines if line.study == first.name]
    content = replace(everything.content, comparisons=[first, again], table=replace(table, lines=[*table.lines, *more]))
    page = replace(everything, content=content, curves=2 * everything.curves)
    assert len(content.precision) == 3
    text = whole(page.write(tmp_path / "report.html").read_text(encoding="utf-8"))
    assert text.count("Strong: each engine's cheapest") == text.count('id="panels"') == 1
    assert text.count('href="#panels"') == 2
    assert text.index('id="panels"') < text.index('href="#panels"')


@pytest.mark.drill
def test_each_engines_cheapest_choice_is_strong_and_named(seen: Visit) -> None:
    """Its line is broad and its name bold; of a point setting, step, error, cost and verdict are told."""
    assert [trace["name"] for trace in seen.page.evaluate(TRACES)] == ["fine matched", "fine default", "only"]
    widths = seen.page.evaluate(f"{TRACES}.map((trace) => trace.line.width)")
    assert widths[0] > widths[1], "the default does not hold it"
    names = seen.page.evaluate(f"{PICTURE}.layout.annotations.map(({{ text }}) => text)")
    assert "<b>alpha fine matched</b>" in names
    told = seen.page.evaluate(f"{TRACES}[1].hovertemplate[0]")
    for words in ("alpha fine default", "dt 1e-3 s", "error 0.001 of the size: does not hold 1e-4", "cost", "differs"):
        assert words in told
    assert seen.page.evaluate(f"{PICTURE}.data.filter((trace) => trace.name === 'choice').length") == 1
    assert seen.messages == []


@pytest.mark.drill
def test_names_do_not_cover_each_other(report_page: Path, visit: Visiting) -> None:
    """At any width; on a phone only the strong ones are there."""
    for width in (1280, 400):
        with visit(report_page, viewport={"width": width, "height": 900}) as opened:
            opened.wait(f"({PICTURE}.data ?? []).length > 0", opened.page.locator(PART).scroll_into_view_if_needed)
            boxes = opened.page.evaluate(
                f"[...document.querySelectorAll('{PART} .annotation')].map((name) => name.getBoundingClientRect())"
                ".map(({ left, right, top, bottom }) => [left, right, top, bottom])"
            )
            assert boxes
            for at, one in enumerate(boxes):
                for two in boxes[at + 1 :]:
                    apart = one[1] <= two[0] or two[1] <= one[0] or one[3] <= two[2] + 4 or two[3] <= one[2] + 4
                    assert apart, (width, one, two)
            texts = opened.page.evaluate(f"{PICTURE}.layout.annotations.map(({{ text }}) => text)")
            assert width > 700 or all(text.startswith("<b>") for text in texts)


@pytest.mark.drill
@pytest.mark.parametrize("width", [400, 1280])
def test_a_picture_has_its_height_before_it_is_drawn(report_page: Path, visit: Visiting, width: int) -> None:
    """What lies below it stays in its place."""
    with visit(report_page, viewport={"width": width, "height": 900}) as opened:
        before = opened.page.evaluate(f"{PICTURE}.style.height")
        # Again, as the sections above have their heights only once they have been near.
        opened.wait(f"({PICTURE}.data ?? []).length > 0", opened.page.locator(PART).scroll_into_view_if_needed)
        assert opened.page.evaluate(f"{PICTURE}.style.height") == before


@pytest.mark.drill
def test_a_mouse_points_and_zooms(seen: Visit) -> None:
    """A point says what it is; a drag zooms, and a double click returns."""
    part = seen.page.locator(PART)
    mouse = seen.page.mouse

    def box_of(what: str) -> dict[str, float]:
        """Box of a drawn part in the middle of the screen."""
        part.locator(".canvas").evaluate("(canvas) => canvas.scrollIntoView({ block: 'center' })")
        return part.locator(what).first.bounding_box()

    # Each is repeated where it is waited for: what is drawn above may move the panels between a look and a click.
    def point() -> None:
        mouse.move(0, 0)
        box = box_of(".points path.point >> nth=-1")
        mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    def drag() -> None:
        box = box_of(".nsewdrag")
        mouse.move(box["x"] + 40, box["y"] + 40)
        mouse.down()
        mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=4)
        mouse.up()

    def reset() -> None:
        box = box_of(".nsewdrag")
        mouse.dblclick(box["x"] + 60, box["y"] + 60)

    seen.wait(f"document.querySelector('{PART} .hoverlayer').textContent.includes('of the size')", again=point)
    spans = f"JSON.stringify({PICTURE}.layout.xaxis.range)"
    whole = seen.page.evaluate(spans)
    seen.wait(f"{spans} !== {whole!r}", again=drag)
    seen.wait(f"{spans} === {whole!r}", again=reset)


@pytest.mark.drill
def test_quantity_tolerance_and_engines_are_chosen(seen: Visit) -> None:
    """An engine without forces has no curve of them; a coarser tolerance rings another; hidden engines are left out."""
    ring = f"{PICTURE}.data.find((trace) => trace.name === 'choice').x[0]"
    before = seen.page.evaluate(ring)
    slider = seen.page.locator("#tolerance")
    slider.press("Home")
    seen.wait(f"{ring} !== {before}")
    assert seen.page.evaluate(ring) > before
    seen.page.locator(f"{PART} select").select_option(label="forces (largest of all reactions)")
    seen.wait(f"{TRACES}.length === 2")
    seen.page.locator(f"{PART} select").select_option(index=0)
    seen.page.locator("[name=engine][value=alpha]").uncheck()
    seen.wait(f"{TRACES}.length === 1")
    seen.page.locator("[name=engine][value=alpha]").check()
    seen.wait(f"{TRACES}.length === 3")


@pytest.mark.drill
def test_an_error_beyond_all_size_is_left_out(everything: Any, tmp_path: Path, visit: Visiting) -> None:
    """A run that flew off to 1e30 is no point of the picture, whose axis ends at the size of the quantity."""
    table = everything.content.table
    wild = [
        replace(line, error=1e30) if line.preset == "default" and line.study == "invented" else line
        for line in table.lines
    ]
    content = replace(everything.content, table=replace(table, lines=wild))
    page = replace(everything, content=content).write(tmp_path / "report.html")
    with visit(page, viewport={"width": 1280, "height": 900}) as opened:
        # Again, as the sections above have their heights only once they have been near.
        opened.wait(f"({PICTURE}.data ?? []).length > 0", opened.page.locator(PART).scroll_into_view_if_needed)
        names = opened.page.evaluate(f"{TRACES}.map(({{ name }}) => name)")
        assert names
        assert "fine default" not in names
        assert opened.page.evaluate(f"{PICTURE}.layout.yaxis.range[1]") < 1
