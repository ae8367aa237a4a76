"""The first screen in a browser: everything follows the question, rows unfold, engines are filtered, cells explain."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browsing import UNDRAWN, Visit

from proofroll.report.page.answer import answer
from proofroll.report.page.choice_matrix import DECADES
from proofroll.report.page.first_screen import FirstScreen

Visiting = Callable[..., AbstractContextManager[Visit]]
SHOWN = """[...document.querySelectorAll('#choice tr[data-place]')].map((row) =>
  [...row.cells].slice(1).map((cell) => { const part = cell.firstElementChild;
    return [cell.className.split(' ')[0], part.title || part.dataset.tip, cell.classList.contains('best')]; }))"""


@pytest.fixture(scope="module")
def seen(report_page: Path, visit: Visiting) -> Iterator[Visit]:
    """The page on a small screen, without its figures."""
    with visit(report_page, before=UNDRAWN, viewport={"width": 900, "height": 600}) as opened:
        yield opened


@pytest.fixture
def screen(everything: Any) -> FirstScreen:
    """The first screen of the page."""
    return FirstScreen(everything.content)


def expected(screen: FirstScreen, decade: int, forces: bool) -> list[list[list[object]]]:
    """Look, tooltip and frame of every cell."""
    best = screen.best(answer(screen.matrix, 10.0**-decade, forces))
    return [
        [
            [f"s-{view.look}", view.title, best[at] == place]
            for at, column in enumerate(screen.matrix.columns)
            for view in [screen.cell(row, column, 10.0**-decade, forces)]
        ]
        for place, row in enumerate(screen.rows)
    ]


def ask(seen: Visit, decade: int, forces: bool) -> None:
    """Asks for a tolerance by the keys of the slider."""
    slider = seen.page.locator("#tolerance")
    slider.focus()
    slider.press("Home")
    for _ in range(decade - DECADES.start):
        slider.press("ArrowRight")
    seen.page.locator("#forces").set_checked(forces)
    place = (len(DECADES) if forces else 0) + decade - DECADES.start
    seen.wait(f"document.getElementById('choice').dataset.at === '{place}'")


@pytest.mark.drill
def test_everything_follows_the_question(seen: Visit, screen: FirstScreen) -> None:
    """Cells, frames, chips and advice are those of the answer at each tolerance; so with forces."""
    for decade, forces in [(DECADES.start, False), (6, False), (4, True), (4, False)]:
        ask(seen, decade, forces)
        assert seen.page.evaluate(SHOWN) == expected(screen, decade, forces)
        found = answer(screen.matrix, 10.0**-decade, forces)
        chips = [
            " ".join(text.split())
            for text in seen.page.locator("#answer-chips li > span:last-child").all_text_contents()
        ]
        assert chips == [f"{chip.title} {chip.words}" for chip in found.chips]
        dots = "[...document.querySelectorAll('#answer-chips li')].map((chip) => chip.querySelectorAll('.dot').length)"
        assert seen.page.evaluate(dots) == [len(chip.engines) for chip in found.chips]
        assert seen.page.locator("#answer-cards > li").count() == len(found.kinds)
        too = [f"Forces, too: {kind.forces_words}" for kind in found.kinds if not forces]
        assert [text.strip() for text in seen.page.locator("#answer-cards .too").all_inner_texts()] == too
        assert len(too) == (0 if forces else len(found.kinds))
        assert seen.page.locator("#uses tbody tr:not(.group)").count() == len(found.scenes)
        assert f"1e-{decade} of the path" in seen.page.locator("#tolerance").get_attribute("aria-valuetext")
        assert ("largest" in seen.page.locator("#asked").inner_text()) == forces


def test_rows_unfold_to_formulations_and_settings(seen: Visit) -> None:
    """An engine's button shows its formulations, theirs the settings; folding an engine folds both."""
    rows = seen.page.locator("#choice tr[data-engine='alpha']:visible")
    assert rows.count() == 1
    engine = seen.page.locator("#choice [data-unfold='alpha']")
    engine.press("Enter")
    seen.until(lambda: (engine.get_attribute("aria-expanded"), rows.count()) == ("true", 2), what="formulations")
    seen.page.locator("#choice [data-unfold='alpha fine']").press("Enter")
    seen.until(lambda: rows.count() == 4, what="matched and default")
    engine.press("Enter")
    seen.until(lambda: rows.count() == 1, what="all folded")


def test_columns_are_kinds_or_single_scenes(seen: Visit, screen: FirstScreen) -> None:
    """One of both kinds of columns is shown."""
    shown = seen.page.locator("#choice thead th:visible")
    assert shown.count() == 1 + len(screen.matrix.kinds)
    seen.page.get_by_role("button", name="single scenes").click()
    single = len(screen.matrix.columns) - len(screen.matrix.kinds)
    seen.until(lambda: shown.count() == 1 + single, what="single scenes")
    seen.page.get_by_role("button", name="kinds", exact=True).click()
    seen.until(lambda: shown.count() == 1 + len(screen.matrix.kinds), what="kinds")


def test_an_engine_is_hidden_on_the_whole_page_and_in_the_answer(seen: Visit, screen: FirstScreen) -> None:
    """One box takes its rows out of matrix, cards and verdicts; the answer is that of the others; all come back."""
    ask(seen, 4, False)
    rows = seen.page.locator("[data-engine='alpha']:visible")
    before, framed = rows.count(), seen.page.evaluate(SHOWN)
    box = seen.page.locator("[name=engine][value=alpha]")
    box.uncheck()
    seen.wait("document.getElementById('asked').textContent.includes('alone')")
    seen.until(lambda: rows.count() == 0, what="alpha is hidden")
    others = {name for name in screen.matrix.engines if name != "alpha"}
    found = answer(screen.matrix, 1e-4, False, others)
    chips = seen.page.locator("#answer-chips li > span:last-child").all_text_contents()
    assert [" ".join(text.split()) for text in chips] == [f"{chip.title} {chip.words}" for chip in found.chips]
    box.check()
    seen.wait("!document.getElementById('asked').textContent.includes('alone')")
    seen.until(lambda: rows.count() == before, what="alpha is back")
    assert seen.page.evaluate(SHOWN) == framed


@pytest.fixture(scope="module")
def two_kinds(everything: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of the comparison and of another one whose scene is of another kind."""
    content = everything.content
    alike = [replace(line, study="again", scene="arm", group="trees") for line in content.table.lines]
    again = replace(content.comparisons[0], name="again", title="Again", scene="arm", group="trees")
    table = replace(content.table, lines=[*content.table.lines, *alike])
    content = replace(content, comparisons=[content.comparisons[0], again], table=table)
    both = replace(everything, content=content, curves=2 * everything.curves)
    return both.write(tmp_path_factory.mktemp("kinds") / "report.html")


@pytest.mark.drill
def test_the_question_is_in_the_address(two_kinds: Path, visit: Visiting) -> None:
    """Tolerance, forces, kind and open rows are written, survive a link to a place, and are read again."""
    with visit(two_kinds, before=UNDRAWN) as first:
        first.page.locator("#tolerance").focus()
        first.page.keyboard.press("ArrowRight")
        first.page.locator("#forces").check()
        first.page.locator("#kind").select_option("trees")
        first.wait("location.hash === '#tol=1e-5&forces=1&kinds=trees'")
        first.page.locator("#choice [data-unfold='alpha']").press("Enter")
        first.wait("location.hash.includes('open=alpha')")
        first.page.locator(".rail a[href='#verdicts']").click()
        first.wait("location.hash.endsWith('&at=verdicts') && location.hash.includes('tol=1e-5')")
        kept = first.page.evaluate("location.hash")
    with visit(two_kinds, kept, before=UNDRAWN) as again:
        again.wait("document.getElementById('choice').dataset.at === '10'")
        assert again.page.locator("#tolerance").input_value() == "5"
        assert again.page.locator("#forces").is_checked()
        assert again.page.locator("#kind").input_value() == "trees"
        assert again.page.locator("#choice [data-unfold='alpha']").get_attribute("aria-expanded") == "true"
        again.wait("document.getElementById('verdicts').getBoundingClientRect().top < innerHeight / 3")
        assert again.page.locator("#answer-cards > li:visible h2").all_inner_texts() == ["Trees"]
        assert all(text.endswith("for trees") for text in again.page.locator("#answer-chips li").all_inner_texts())
        again.page.evaluate("location.hash = ''")
        again.wait("document.getElementById('choice').dataset.at === '2'")
        assert again.page.locator("#kind").input_value() == ""
        assert again.messages == []


@pytest.mark.drill
def test_facts_stand_above_the_cards(two_kinds: Path, everything: Any, visit: Visiting) -> None:
    """Agreement, silent errors, limits and statements of the paper are told of all scenes, or of the chosen kind."""
    kept = everything.content.kept()
    (statements, section), total = kept.statements[0], sum(kept.verdicts.values())
    with visit(two_kinds, before=UNDRAWN) as seen:
        facts = seen.page.locator("#facts > li")
        told = [" ".join(text.split()) for text in facts.all_inner_texts()]
        assert told[0].startswith(f"{2 * kept.verdicts['agrees']} of {2 * total} settings agree")
        assert told[1].startswith(f"{2 * kept.silent} are wrong without a warning. Worst: {kept.worst}")
        assert told[2].startswith(f"{kept.passed} of {kept.boundaries} limits of stability")
        assert told[3].startswith(statements.replace("statements", "statements of the paper"))
        assert facts.locator("a").get_attribute("href") == f"#{section}"
        ends = "['#facts', '#answer-cards'].map((name) => document.querySelector(name).getBoundingClientRect().top)"
        above, below = seen.page.evaluate(ends)
        assert above < below
        seen.page.locator("#kind").select_option("trees")
        seen.until(lambda: facts.count() == 2, what="facts of one kind")
        assert f"of {total} settings" in facts.first.inner_text()
        assert seen.page.locator("#answer-one tbody th").all_inner_texts() == ["arm"], "its scenes, beside its card"
        edges = "['#answer-one', '#answer-cards'].map((name) => document.querySelector(name).getBoundingClientRect())"
        scenes, cards = seen.page.evaluate(f"{edges}.map(({{ left, right }}) => [left, right])")
        assert cards[1] < scenes[0]
        assert cards[1] - cards[0] <= 340
        seen.page.locator("#kind").select_option("")
        seen.until(lambda: seen.page.locator("#answer-one *").count() == 0, what="all kinds")
    assert everything.content.kept("trees").statements == []


@pytest.mark.drill
def test_the_back_button_returns_to_the_question_before(report_page: Path, visit: Visiting) -> None:
    """Each question is a step of the back button, however far the slider was drawn; a fold is none."""
    with visit(report_page, before=UNDRAWN) as seen:
        slider = seen.page.locator("#tolerance")
        slider.focus()
        for decade in (5, 6):
            seen.page.keyboard.press("ArrowRight")
            seen.wait(f"location.hash === '#tol=1e-{decade}'")
        seen.page.locator("#choice [data-unfold='alpha']").press("Enter")
        seen.wait("location.hash.includes('open=alpha')")
        seen.page.go_back()
        seen.wait("location.hash === '#tol=1e-5'")
        seen.until(lambda: slider.input_value() == "5", what="the slider is back")
        seen.page.go_back()
        seen.until(lambda: slider.input_value() == "4", what="the first question")
        seen.wait("document.getElementById('choice').dataset.at === '2'")


@pytest.mark.drill
def test_the_link_to_an_answer_is_copied(report_page: Path, visit: Visiting) -> None:
    """The button copies the address of the page with the question, and says so."""
    copied = "window.copied = []; navigator.clipboard.writeText = async (text) => { copied.push(text); };"
    with visit(report_page, "#tol=1e-6", before=UNDRAWN + copied) as seen:
        button = seen.page.get_by_role("button", name="Copy link to this answer")
        button.click()
        seen.wait("copied.length === 1")
        assert seen.page.evaluate("copied[0]") == f"{report_page.as_uri()}#tol=1e-6"
        seen.until(lambda: seen.page.locator(".ask .copy").inner_text() == "copied", what="copied")


@pytest.mark.drill
def test_lines_for_a_model_follow_the_question(written: tuple[Any, Path], visit: Visiting) -> None:
    """A row's and a card's button open a command and a test of the cheapest engine, and of any other that holds it."""
    copied = "window.copied = []; navigator.clipboard.writeText = async (text) => { copied.push(text); };"
    with visit(written[1] / "report.html", before=UNDRAWN + copied) as seen:
        dialog, title = seen.page.locator("#model"), seen.page.locator("#model-title")
        for button in ("#answer-cards [data-model]", "#uses [data-model]"):
            seen.page.locator(button).first.click()
            dialog.wait_for()
            taken = seen.page.locator("#uses tbody tr:not(.group) b").first.inner_text()
            assert title.inner_text().endswith(taken)
            seen.page.keyboard.press("Escape")
            dialog.wait_for(state="hidden")
        ask(seen, 8, False)
        seen.page.locator("#uses [data-model]").first.click()
        assert 'tolerance="1e-06 %"' in dialog.inner_text()
        dialog.get_by_role("button", name="copy: Check it").click()
        seen.wait("copied.length === 1")
        assert seen.page.evaluate("copied[0]").startswith("proofroll compare sphere_in_cylinder --engine ")
        dialog.get_by_role("button", name="Close").click()
        dialog.wait_for(state="hidden")
        assert seen.messages == []


def test_cells_lead_to_their_evidence(seen: Visit) -> None:
    """Each link of the matrix has its target on the page."""
    there: list[bool] = seen.page.evaluate(
        "Promise.all([...document.querySelectorAll('#choice a')].map(async (a) => !!await folds.find(a.hash.slice(1))))"
    )
    assert there
    assert all(there)


def test_the_cells_are_one_stop_of_the_tab_key(seen: Visit) -> None:
    """Arrows, Home and End walk; the cell that has the focus explains itself, until Escape closes that."""
    assert seen.page.locator("#choice .in[tabindex='0']").count() == 1
    first = seen.page.locator("#choice .in[tabindex='0']")
    first.focus()
    seen.page.locator("#tip b").wait_for()
    seen.page.evaluate("() => new Promise((done) => { scrollBy(0, 30); addEventListener('scroll', done); })")
    seen.page.locator("#tip b").wait_for()
    assert seen.page.locator("#tip b").inner_text()
    cell = "document.activeElement.closest('td, th')"
    row, at = f"{cell}.parentElement.dataset.place", f"{cell}.cellIndex"
    start = seen.page.evaluate(f"[{row}, {at}]")
    seen.page.keyboard.press("ArrowDown")
    seen.wait(f"{row} !== '{start[0]}'")
    seen.page.keyboard.press("ArrowUp")
    seen.wait(f"{row} === '{start[0]}' && {at} === {start[1]}")
    seen.page.keyboard.press("Home")
    seen.wait(f"{at} === 0")
    seen.page.keyboard.press("Escape")
    seen.page.locator("#tip").wait_for(state="hidden")


@pytest.mark.drill
def test_the_first_screen_is_there_without_a_program(report_page: Path, screen: FirstScreen, visit: Visiting) -> None:
    """Chips, cards, matrix and advice at the first tolerance are written; what needs a script is not shown."""
    with visit(report_page, java_script_enabled=False) as seen:
        assert not seen.page.locator(".ask").is_visible()
        text = " ".join(seen.page.locator("main").inner_text().split())
    for chip in screen.first.chips:
        assert f"{chip.title} {chip.words}" in text
    for words in [kind.forces_words for kind in screen.first.kinds]:
        assert f"Forces, too: {words}" in text
    for row in screen.rows:
        if row.level == "engine":
            for column in screen.matrix.kinds:
                assert screen.cell(row, column, 1e-4, False).main in text
    for item in screen.first.scenes:
        assert item.column.title in text


def test_the_matrix_can_be_had_as_a_file(seen: Visit) -> None:
    """CSV: a line for each row, folded or not, of which each cell says what it shows."""
    with seen.page.expect_download() as got:
        seen.page.locator("#csv").click()
    lines = Path(got.value.path()).read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + seen.page.locator("#choice tr[data-place]").count()
    assert lines[1].startswith('"Alpha')


@pytest.mark.drill
@pytest.mark.parametrize("width", [400, 900, 1400])
def test_nothing_moves_while_the_page_loads(report_page: Path, visit: Visiting, width: int) -> None:
    """The first screen keeps its place while scripts start, and nothing scrolls sideways."""
    before = """window.shifts = 0;
    const sum = (list) => list.getEntries().forEach((entry) => { window.shifts += entry.value; });
    new PerformanceObserver(sum).observe({ type: "layout-shift", buffered: true });"""
    with visit(report_page, before=before, viewport={"width": width, "height": 800}) as seen:
        seen.wait("document.getElementById('tip')")
        seen.page.wait_for_timeout(300)
        assert seen.page.evaluate("window.shifts") < 1e-3
        assert seen.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.drill
@pytest.mark.parametrize("width", [400, 1400])
def test_names_of_rows_stay_in_their_column_and_in_sight(
    everything: Any, tmp_path: Path, visit: Visiting, width: int
) -> None:
    """All unfolded, on a screen and in print, a name ends within its cell; it stays when the matrix scrolls."""
    lines = everything.content.table.lines
    named = [replace(x, formulation="rotating_frame_of_a_body", own_equations=x.engine == "alpha") for x in lines]
    content = replace(everything.content, table=replace(everything.content.table, lines=named))
    path = replace(everything, content=content).write(tmp_path / "report.html")
    heads = "[...document.querySelectorAll('#choice tbody th[scope=row]')].filter((head) => head.offsetParent)"
    ends = f"""{heads}.map((head) => {{
      const text = document.createRange();
      text.selectNodeContents(head);
      return Math.max(...[...text.getClientRects()].map((part) => part.right)) - head.getBoundingClientRect().right;
    }})"""
    with visit(path, viewport={"width": width, "height": 800}) as seen:
        seen.page.evaluate("document.querySelectorAll('#choice [aria-expanded=false]').forEach((fold) => fold.click())")
        assert max(seen.page.evaluate(ends)) <= 0
        seen.page.evaluate("document.getElementById('choice').style.width = '3000px'")
        seen.page.evaluate("document.querySelector('.choice').scrollLeft = 500")
        seen.page.evaluate("window.edge = document.querySelector('.choice').getBoundingClientRect().left")
        assert seen.page.evaluate(f"{heads}.every((head) => Math.abs(head.getBoundingClientRect().left - edge) < 2)")
        seen.page.evaluate("document.getElementById('choice').style.width = ''")
        seen.page.emulate_media(media="print")
        assert max(seen.page.evaluate(ends)) <= 0
