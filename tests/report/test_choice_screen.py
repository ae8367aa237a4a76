"""The first screen in a browser: the matrix follows the slider, rows and columns unfold, engines are filtered."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browsing import UNDRAWN, Visit

from proofroll.report.page.advice import advice
from proofroll.report.page.choice_matrix import DECADES, FIRST, ChoiceMatrix, ChoiceStudy, choice_matrix
from proofroll.report.page.html import templates

Visiting = Callable[..., AbstractContextManager[Visit]]
SHOWN = """[...document.querySelectorAll('#choice tbody tr')].map((row) =>
  [...row.cells].slice(1).map((cell) => [cell.className, cell.querySelector('a')?.title ?? '']))"""


@pytest.fixture(scope="module")
def seen(report_page: Path, visit: Visiting) -> Iterator[Visit]:
    """The page on a small screen, without its figures."""
    with visit(report_page, before=UNDRAWN, viewport={"width": 900, "height": 600}) as opened:
        yield opened


@pytest.fixture
def matrix(everything: Any) -> ChoiceMatrix:
    """The matrix of the page."""
    found: ChoiceMatrix = everything.content.choice
    return found


def expected(matrix: ChoiceMatrix, decade: int, forces: bool) -> list[list[list[str]]]:
    """Class and title of every cell."""
    cells = [[matrix.cell(row, column, 10.0**-decade, forces) for column in matrix.columns] for row in matrix.rows]
    best = [{at: " best"} for at in matrix.best(10.0**-decade, forces)]
    return [
        [
            [f"cell {cell.state}{best[j].get(i, '')}", cell.title if cell.state != "none" else ""]
            for j, cell in enumerate(row)
        ]
        for i, row in enumerate(cells)
    ]


def test_the_slider_chooses_the_tolerance(seen: Visit, matrix: ChoiceMatrix) -> None:
    """By its keys: each cell and the sentence are those of the matrix at that tolerance; so with forces."""
    slider = seen.page.locator("#tolerance")
    slider.focus()
    for decade in DECADES:
        slider.press("Home")
        for _ in range(decade - DECADES.start):
            slider.press("ArrowRight")
        seen.wait(f"document.getElementById('choice').dataset.at === '{decade - DECADES.start}'")
        assert seen.page.evaluate(SHOWN) == expected(matrix, decade, False)
        assert seen.page.locator("#answer").inner_text() == matrix.answer(10.0**-decade, False)
        assert seen.page.locator("#also").inner_text() == matrix.with_forces(10.0**-decade)
        words = seen.page.locator("#words li").all_text_contents()
        assert words == [item.sentence for item in advice(matrix, 10.0**-decade, False)]
        assert slider.get_attribute("aria-valuetext") == f"1e-{decade}"
    seen.page.get_by_label("forces count, too").check()
    seen.wait(f"document.getElementById('choice').dataset.at === '{2 * len(DECADES) - 1}'")
    assert seen.page.evaluate(SHOWN) == expected(matrix, DECADES.stop - 1, True)
    assert seen.page.locator("#also").inner_text() == "", "the answer itself says it"


@pytest.mark.drill
def test_a_framed_cell_names_its_setting_and_step(report_page: Path, visit: Visiting, matrix: ChoiceMatrix) -> None:
    """As it is written, and again after the slider has moved to another tolerance and with forces."""
    with visit(report_page, before=UNDRAWN) as opened:
        for decade, forces in ((FIRST, False), (FIRST + 1, True)):
            if forces:
                opened.page.get_by_label("forces count, too").check()
                opened.page.locator("#tolerance").press("ArrowRight")
                opened.wait(
                    f"document.getElementById('choice').dataset.at === '{len(DECADES) + decade - DECADES.start}'"
                )
            best = matrix.best(10.0**-decade, forces)
            steps = {
                matrix.step(matrix.rows[at], matrix.cell(matrix.rows[at], column, 10.0**-decade, forces))
                for at, column in zip(best, matrix.columns, strict=True)
                if at is not None
            }
            assert steps - {""}
            assert set(opened.page.locator("#choice td.best small").all_text_contents()) == steps - {""}


def test_a_row_unfolds_to_its_settings(seen: Visit) -> None:
    """Its button shows the settings of that formulation alone, says so, and folds them again."""
    button = seen.page.get_by_role("button", name="alpha fine", exact=True)
    hidden = seen.page.locator("#choice tbody tr[hidden]").count()
    assert hidden > 0
    button.press("Enter")
    assert button.get_attribute("aria-expanded") == "true"
    shown = seen.page.locator("#choice tbody tr[data-of='alpha fine']:not([hidden])")
    assert shown.count() == 2, "matched and default"
    button.press("Enter")
    assert seen.page.locator("#choice tbody tr[hidden]").count() == hidden


def test_an_engine_is_hidden_on_the_whole_page(seen: Visit) -> None:
    """One box takes its rows out of the matrix and of the verdicts, and brings them back."""
    rows = seen.page.locator("[data-engine='alpha']:visible")
    before = rows.count()
    assert before > 2
    box = seen.page.get_by_role("checkbox", name="alpha")
    box.uncheck()
    assert rows.count() == 0
    assert seen.page.locator("[data-engine='beta']:visible").count() > 1
    box.check()
    assert rows.count() == before


def test_the_answer_and_the_frames_are_of_the_chosen_engines(seen: Visit, matrix: ChoiceMatrix) -> None:
    """Without the cheapest engine the next one is framed and named; with all the sentence is the matrix's own."""
    decade = int(seen.page.locator("#tolerance").input_value())
    forces = seen.page.locator("#forces").is_checked()
    others = replace(matrix, rows=[row for row in matrix.rows if row.engine != "alpha"])
    assert others.answer(10.0**-decade, forces) != matrix.answer(10.0**-decade, forces), "alpha was named"
    box = seen.page.get_by_role("checkbox", name="alpha")
    box.uncheck()
    seen.wait("document.getElementById('answer').textContent.includes('This is of')")
    text = seen.page.locator("#answer").inner_text()
    assert text.startswith(others.answer(10.0**-decade, forces))
    framed = seen.page.locator("#choice td.best")
    wanted = [at for at in others.best(10.0**-decade, forces) if at is not None]
    assert framed.count() == len(wanted)
    assert framed.locator("xpath=..").evaluate_all("rows => rows.every((row) => row.dataset.engine !== 'alpha')")
    words = seen.page.locator("#words li").all_text_contents()
    vars(others).update(judged=matrix.judged, unjudged=matrix.unjudged)  # what is judged in a scene hangs on no choice
    sentences = [item.sentence for item in advice(others, 10.0**-decade, forces)]
    assert words[:-1] == sentences[:-1]
    assert not any("alpha" in word for word in words)
    box.check()
    seen.wait("!document.getElementById('answer').textContent.includes('This is of')")
    assert seen.page.locator("#answer").inner_text() == matrix.answer(10.0**-decade, forces)


def test_a_chosen_scene_is_alone(seen: Visit, matrix: ChoiceMatrix) -> None:
    """Its column, the rows that ran there, its sentence and its advice are left; all come back."""
    for place, column in enumerate(matrix.columns):
        option = seen.page.locator(f"#scene option[value='{place}']")
        if not option.count():
            continue
        seen.page.locator("#scene").select_option(str(place))
        alone = replace(matrix, columns=[replace(column, group=column.name, whole=True)])
        decade = int(seen.page.locator("#tolerance").input_value())
        forces = seen.page.locator("#forces").is_checked()
        seen.wait("document.querySelectorAll('#choice thead th:not(.beside)').length === 2")
        assert seen.page.locator("#answer").inner_text() == alone.answer(10.0**-decade, forces)
        assert seen.page.locator("#choice thead th:visible").count() == 2
        ran = [row.name for row in matrix.rows if not row.setting and row.found.keys() & set(column.studies)]
        shown = seen.page.locator("#choice tbody tr:not([data-of]):visible [data-model]")
        assert [text.strip() for text in shown.all_inner_texts()] == ran
        assert seen.page.locator("#words li:not([hidden])").count() == 1
    seen.page.locator("#scene").select_option("")
    seen.wait("!document.querySelector('#choice .beside')")
    assert seen.page.locator("#answer").inner_text() == matrix.answer(10.0**-decade, forces)


def test_one_tolerance_on_the_first_screen(report_page: Path) -> None:
    """The answer, the slider and the sentences below speak of the same one."""
    text = report_page.read_text(encoding="utf-8")
    first = text[text.index("<header>") : text.index("</header>")]
    assert set(re.findall(r"to (?:<span[^>]*>)?(1e-\d)", first)) == {"1e-4"}


def test_cells_lead_to_their_evidence(seen: Visit) -> None:
    """Each link of the matrix has its target on the page."""
    there: list[bool] = seen.page.evaluate(
        "Promise.all([...document.querySelectorAll('#choice a')].map(async (a) => !!await folds.find(a.hash.slice(1))))"
    )
    assert there
    assert all(there)


def test_the_matrix_is_there_without_a_program(report_page: Path, matrix: ChoiceMatrix) -> None:
    """What is written says what the matrix says at the first tolerance: printed, and read without JavaScript."""
    text = report_page.read_text(encoding="utf-8")
    assert matrix.answer(1e-4, False).split("1e-4")[0] in text
    table = text[text.index('id="choice"') : text.index('id="choices"')]
    for row in matrix.rows:
        for column in matrix.columns:
            cell = matrix.cell(row, column, 1e-4, False)
            assert cell.state == "none" or f'class="cell {cell.state}' in table


def test_small_groups_are_unfolded_and_large_ones_name_their_scenes(everything: Any) -> None:
    """At any width and on paper: a group of two has its scenes as columns, of five four are named and one counted."""
    lines = everything.content.table.lines
    own = [item for item in lines if item.study == "invented"]
    more = [replace(item, study=f"s{n}", group="pair" if n < 2 else "many") for n in range(7) for item in own]
    studies = {f"s{n}": ChoiceStudy(f"Scene {n}", "") for n in range(7)}
    found = choice_matrix(more, studies)
    assert found.unfolded == ["pair"]
    module: Any = templates().get_template("choice.html").module
    html = str(module.matrix(found))
    heads = re.findall(r"<th scope=\"col\"[^>]*>.*?</th>", html, flags=re.DOTALL)
    shown = [re.sub("<[^>]*>", "", head).strip() for head in heads if " hidden" not in head]
    assert shown == ["engine and formulation", "pair s0, s1", "s0", "s1", "many s2, s3, s4, s5 and 1 more"]
    assert 'data-group="pair" title="s0, s1" aria-expanded="true"' in html
    assert 'title="s2, s3, s4, s5, s6" aria-expanded="false"' in html


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
    heads = "[...document.querySelectorAll('#choice tbody th')].filter((head) => head.offsetParent)"
    ends = f"""{heads}.map((head) => {{
      const text = document.createRange();
      text.selectNodeContents(head);
      return Math.max(...[...text.getClientRects()].map((part) => part.right)) - head.getBoundingClientRect().right;
    }})"""
    with visit(path, viewport={"width": width, "height": 800}) as seen:
        seen.wait("document.querySelector('#choose .tools button')")
        seen.page.evaluate("document.querySelectorAll('#choice [aria-expanded=false]').forEach((fold) => fold.click())")
        assert max(seen.page.evaluate(ends)) <= 0
        seen.page.evaluate("document.getElementById('choice').style.width = '3000px'")
        seen.page.evaluate("document.querySelector('.choice').scrollLeft = 500")
        seen.page.evaluate("window.edge = document.querySelector('.choice').getBoundingClientRect().left")
        assert seen.page.evaluate(f"{heads}.every((head) => Math.abs(head.getBoundingClientRect().left - edge) < 2)")
        seen.page.evaluate("document.getElementById('choice').style.width = ''")
        seen.page.emulate_media(media="print")
        assert max(seen.page.evaluate(ends)) <= 0


@pytest.mark.parametrize("width", [400, 900, 1400])
def test_nothing_moves_while_the_page_loads(report_page: Path, visit: Visiting, width: int) -> None:
    """The form has its place before the first script runs, heads of the matrix keep theirs, and nothing shifts."""
    place = "Math.round(document.querySelector('.scroll.choice').getBoundingClientRect().top)"
    # The first node after the matrix is parsed before any script at the end of the page runs.
    before = f"""new MutationObserver((_, watch) => {{
      if (!document.querySelector('#choices')) return;
      watch.disconnect(); window.atFirst = {place};
    }}).observe(document, {{ childList: true, subtree: true }});
    window.shifts = 0;
    const sum = (list) => list.getEntries().forEach((entry) => {{ window.shifts += entry.value; }});
    new PerformanceObserver(sum).observe({{ type: "layout-shift", buffered: true }});"""
    with visit(report_page, before=before, viewport={"width": width, "height": 800}) as seen:
        seen.wait("document.querySelector('.choice').dataset.sorts === ''")
        first, last, shifts = seen.page.evaluate(f"[window.atFirst, {place}, window.shifts]")
    assert abs(last - first) <= 0.02 * 800
    assert shifts < 1e-3


@pytest.mark.parametrize(("width", "columns"), [(400, ["kept", "again"]), (1400, [])])
def test_scenes_are_columns_where_the_screen_has_room(
    everything: Any, tmp_path: Path, visit: Visiting, width: int, columns: list[str]
) -> None:
    """A group of two is unfolded from the start on a wide screen, and folded on one too narrow for its columns."""
    content = everything.content
    first = replace(content.comparisons[0], name="kept")
    named = [replace(x, study=name) for name in ("kept", "again") for x in content.table.lines if x.study == "invented"]
    both = replace(
        content, comparisons=[first, replace(first, name="again")], table=replace(content.table, lines=named)
    )
    page = replace(everything, content=both, curves=2 * everything.curves).write(tmp_path / "report.html")
    with visit(page, before=UNDRAWN, viewport={"width": width, "height": 800}) as seen:
        hidden = seen.page.locator("#choice thead th[data-of][hidden]")
        assert [text.strip() for text in hidden.all_text_contents()] == columns


def test_the_matrix_appears_once_all_its_rows_are_there(report_page: Path, tmp_path: Path, visit: Visiting) -> None:
    """While a page is still read, later rows would widen its columns, and cells would move."""
    text = report_page.read_text(encoding="utf-8")
    part = tmp_path / "report.html"
    part.write_text(text[: text.index("</tr>", text.index("<tbody", text.index('id="choice"')))], encoding="utf-8")
    with visit(part) as seen:
        assert seen.page.locator("#answer").is_visible()
        assert not seen.page.locator("#choice").is_visible()


def test_little_stands_between_the_answer_and_the_matrix(report_page: Path, visit: Visiting) -> None:
    """On a narrow screen the legend and the choices leave room for the matrix: less than 300 px are theirs."""
    with visit(report_page, viewport={"width": 400, "height": 800}) as seen:
        seen.wait("document.querySelector('#choose .tools button')")
        tops = "['.key', '.scroll.choice'].map((name) => document.querySelector(name).getBoundingClientRect().top)"
        above, below = seen.page.evaluate(tops)
    assert below - above < 300


def test_without_scripts_there_is_no_form(report_page: Path, visit: Visiting) -> None:
    """What only a script can answer is not shown where there are none; the matrix is."""
    with visit(report_page, java_script_enabled=False) as seen:
        assert not seen.page.locator("#choose").is_visible()
        assert seen.page.locator("#choice").is_visible()
