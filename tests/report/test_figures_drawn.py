"""Figures in a real browser: both error bars, the keyboard, and colours that follow the screen and the paper."""

from __future__ import annotations

from typing import Any

import pytest
from browsing import Drawn, Visit

from proofroll.core.number_format import error

FIGURE = 'figure[data-p="0"][data-o="1"] .canvas'  # z at the first point


@pytest.fixture(scope="module")
def seen(drawn_page: Drawn) -> Visit:
    """The page with its figures; of its first row γ and z have limits. Each test leaves it as it was."""
    return drawn_page.seen


def traces(seen: Visit, condition: str) -> list[dict[str, Any]]:
    """Parts of the traces of the figure of z that fulfil a condition on ``t``."""
    found = seen.page.evaluate(
        f"""() => document.querySelector('{FIGURE}').data.filter((t) => {condition})
          .map(({{ x, y, meta, error_y, visible }}) => ({{ x, y, meta, error_y, visible }}))"""
    )
    return list(found)


def test_limits_have_the_engines_error_bar(seen: Visit) -> None:
    """A whisker of the limit's uncertainty about its distance; an exact limit is drawn by its uncertainty alone."""
    (limit,) = traces(seen, "t.xaxis === 'x2'")
    assert (limit["y"], limit["meta"]) == ([3e-7], 0)
    assert limit["error_y"]["array"] == [pytest.approx(1e-7)]
    assert limit["error_y"]["arrayminus"] == [pytest.approx(1e-7)]
    first = FIGURE.replace('data-o="1"', 'data-o="0"')
    exact = seen.page.evaluate(f"document.querySelector('{first}').data.find((t) => t.xaxis === 'x2').y")
    assert exact == [1e-12]


@pytest.mark.drill
def test_truth_and_tolerances_have_their_lines(seen: Visit, everything: Any) -> None:
    """The band ends at the truth's error bar; each tolerance is a line of the rows that have it, and goes with them."""
    z = everything.curves[0][0].observables[1]
    band = seen.page.evaluate(f"document.querySelector('{FIGURE}').layout.shapes.find((s) => s.type === 'rect').y1")
    assert band == z.error_bar > 0
    lines = traces(seen, "Array.isArray(t.meta)")
    assert {tuple(line["meta"]): line["y"][0] for line in lines} == {(0, 2): z.engines[0].tolerance, (1,): 1e-4}
    for shown in (False, True):
        seen.page.locator('.legend [data-row="1"]').first.click()
        expected = {(0, 2): True, (1,): shown}
        seen.until(
            lambda expected=expected: (
                {tuple(line["meta"]): line["visible"] for line in traces(seen, "Array.isArray(t.meta)")} == expected
            ),
            what="the line of the row that is switched",
        )


def test_largest_distance_in_the_figure_is_the_judged_error(seen: Visit, everything: Any) -> None:
    """What the eye reads off the curve is what the table says, to the digits shown."""
    runs = [run for run in everything.content.comparisons[0].runs if run.point == "speed=3"]
    for row in (0, 1, 2):
        (curve,) = traces(seen, f"t.yaxis === 'y2' && t.meta === {row} && t.xaxis !== 'x2'")
        judged = next(j for j in runs[row].judgements if j.observable == "z")
        assert error(max(y for y in curve["y"] if y is not None), 3) == error(judged.error, 3)


@pytest.mark.drill
def test_keyboard_reads_and_zooms(seen: Visit) -> None:
    """Arrows show the truth at a sample in every figure of the section and say it; plus zooms all; 0 returns."""
    canvas = seen.page.locator(FIGURE)
    canvas.focus()
    canvas.press("PageDown")
    canvas.press("ArrowRight")
    readout = seen.page.locator(".readout").first
    assert readout.get_attribute("aria-live") == "polite"
    seen.until(lambda: readout.text_content().startswith("truth at 0.22 s: γ "), what="the values at the sample")
    assert " m, N " in readout.text_content()
    shown = (
        "[...document.querySelectorAll('figure[data-p=\"0\"] .canvas')].filter((e) => e.querySelector('.hovertext'))"
    )
    seen.wait(f"{shown}.length === 6")
    canvas.press("Escape")
    seen.wait(f"{shown}.length === 0")
    ranges = """new Set([...document.querySelectorAll('figure[data-p="0"] .canvas')]
      .map((e) => e.layout.xaxis.range.map((end) => end.toFixed(3)).join(' ')))"""
    canvas.press("+")
    seen.wait(f"{ranges}.size === 1 && {ranges}.has('-0.030 0.470')")
    canvas.press("0")
    seen.wait(f"{ranges}.size === 1 && {ranges}.has('0.000 1.000')")


INK = f"getComputedStyle(document.querySelector('{FIGURE} .xtick text')).fill"
SKETCH = "getComputedStyle(document.querySelector('.drawing .ball')).stroke"
GROUND = "getComputedStyle(document.body).backgroundColor"


@pytest.mark.nightly
def test_colours_follow_the_screen_while_it_is_open_and_paper_is_white(seen: Visit) -> None:
    """Page, figures and drawings change with the scheme, a zoom stays; for print they are light in any scheme."""
    light = [seen.page.evaluate(INK), seen.page.evaluate(SKETCH), seen.page.evaluate(GROUND)]
    seen.page.evaluate(f"chart.zoom(document.querySelector('{FIGURE}'), [0.25, 0.5])")
    seen.page.emulate_media(color_scheme="dark")
    seen.wait(f"{INK} !== '{light[0]}' && {SKETCH} !== '{light[1]}' && {GROUND} !== '{light[2]}'")
    assert seen.page.evaluate(f"document.querySelector('{FIGURE}').layout.xaxis.range") == [0.25, 0.5]
    dark = seen.page.evaluate(INK)
    seen.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert seen.page.evaluate(INK) == light[0]
    seen.page.evaluate("dispatchEvent(new Event('afterprint'))")
    seen.wait(f"{INK} === '{dark}'")
    seen.page.emulate_media(color_scheme="light")
    seen.wait(f"{INK} === '{light[0]}'")
    seen.page.locator(FIGURE).press("0")
    seen.wait(f"document.querySelector('{FIGURE}').layout.xaxis.range[1] === 1")


# Of each figure: who is named at the ends, number of curves, and whether names overlap or are cut off at the right.
NAMES = """() => [...document.querySelectorAll('figure[data-o] .canvas')].map((canvas) => {
  const names = [...canvas.querySelectorAll('.annotation text')].filter((text) => text.textContent.startsWith('●'));
  const boxes = names.map((text) => text.getBoundingClientRect()), right = canvas.getBoundingClientRect().right;
  const meets = (one, other) => one.top < other.bottom - 1 && other.top < one.bottom - 1;
  const ends = canvas.layout.annotations.filter(({ name }) => name === 'end');
  return {
    told: ends.flatMap(({ hovertext }) => hovertext.split('\\n')),
    curves: canvas.data.filter(({ mode, visible, meta }) =>
      visible && mode.includes('lines') && !Array.isArray(meta)).length,
    overlap: boxes.some((one, k) => boxes.slice(k + 1).some((other) => meets(one, other))),
    cut: boxes.some((box) => box.right > right + 1),
  };
})"""


def test_curves_are_named_at_their_ends(drawn_page: Drawn) -> None:
    """Each figure names the truth and every setting that it shows, in names that neither overlap nor are cut off."""
    figures = drawn_page.seen.page.evaluate(NAMES)
    assert figures
    for figure in figures:
        assert "truth" in figure["told"]
        assert any(word.startswith("alpha") for word in figure["told"])
        assert len(figure["told"]) <= figure["curves"]
        assert not figure["overlap"]
        assert not figure["cut"]


@pytest.mark.drill
def test_names_at_ends_follow_the_zoom(seen: Visit) -> None:
    """A zoom to a part of the time moves the names to where the curves end there; back, they are as before."""
    names = f"""document.querySelector('{FIGURE}').layout.annotations.filter(({{ name }}) => name === 'end')
      .map(({{ y, text }}) => `${{y.toFixed(2)}} ${{text}}`).join()"""
    before = seen.page.evaluate(names)
    canvas = seen.page.locator(FIGURE)
    canvas.focus()
    canvas.press("Home")
    canvas.press("+")
    seen.wait(f"{names} !== {before!r}")
    canvas.press("0")
    seen.wait(f"{names} === {before!r}")
    canvas.press("Escape")
