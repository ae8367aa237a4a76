"""Tables in a browser: they sort, filter and download, and nothing is loaded from anywhere."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from browsing import Visit

Visiting = Callable[..., AbstractContextManager[Visit]]
TABLE = "[aria-label='Verdicts: An invented comparison'] table"


@pytest.fixture
def live(report_page: Path, visit: Visiting) -> Iterator[Visit]:
    """The page with its first table of verdicts enlivened."""
    with visit(report_page, viewport={"width": 1280, "height": 900}) as opened:
        opened.near("#verdicts", f"document.querySelector(`{TABLE}`).closest('.scroll').dataset.sorts === ''")
        yield opened


def column(live: Visit, number: int) -> list[str]:
    """Texts of a column, of the rows that are shown, without what is hidden from a screen reader."""
    return live.page.evaluate(
        """([table, number]) => [...document.querySelectorAll(`${table} tbody tr`)].map((row) => {
          const copy = row.cells[number].cloneNode(true);
          copy.querySelectorAll('[aria-hidden], small').forEach((part) => part.remove());
          return copy.textContent.trim();
        })""",
        [TABLE, number],
    )


def sort(live: Visit, name: str, wanted: str) -> None:
    """Presses Enter on the sign of a column until a screen reader is told that it is sorted so."""
    head = live.page.locator(f"{TABLE} thead th", has_text=name)
    for _ in range(3):
        before = head.get_attribute("aria-sort")
        if before == wanted:
            return
        head.locator(".dt-column-order").press("Enter")
        live.until(lambda before=before: head.get_attribute("aria-sort") != before, what=f"sorted by {name}")
    assert head.get_attribute("aria-sort") == wanted


@pytest.mark.drill
def test_a_table_sorts_by_a_column(live: Visit) -> None:
    """By keys: settings keep their engine, errors sort as numbers, verdicts from best to worst and back."""
    settings = column(live, 0)
    assert settings == ["alpha fine matched", "alpha fine as installed", "beta only", "gamma"]
    sort(live, "worst error", "ascending")
    errors = [float(text) for text in column(live, 3) if text]
    assert errors == sorted(errors)
    assert len(errors) == 3
    assert column(live, 0)[-1] == "gamma", "what has no number comes last"
    sort(live, "worst error", "descending")
    assert column(live, 0)[1:] == ["alpha fine as installed", "beta only", "alpha fine matched"]
    sort(live, "verdict", "ascending")
    verdicts = [text.split()[1].removesuffix("not") for text in column(live, 2)]
    assert verdicts == ["agrees", "incomplete", "differs", "missing"]
    assert live.messages == []


@pytest.mark.nightly
def test_a_reason_goes_with_its_row(live: Visit) -> None:
    """The reason why there is no result stands in the row, in full, and is found by the filter."""
    assert "gamma is not installed here" in live.page.locator(f"{TABLE} tr[data-engine='gamma']").inner_text()
    live.page.get_by_label("Filter: Verdicts: An invented comparison").fill("not installed here")
    live.wait(f'document.querySelectorAll("{TABLE} tbody tr").length === 1')


@pytest.mark.drill
def test_a_table_filters_by_words(live: Visit) -> None:
    """An engine, a verdict: the rows that have it are left; all come back."""
    box = live.page.get_by_label("Filter: Verdicts: An invented comparison")
    for words, found in (("alpha", 2), ("differs", 1), ("alpha matched", 1), ("", 4)):
        box.fill(words)
        live.wait(f'document.querySelectorAll("{TABLE} tbody tr").length === {found}')


@pytest.mark.drill
def test_a_table_downloads_as_csv(live: Visit, tmp_path: Path) -> None:
    """The file has the heads and each row, verdicts in words; it comes from the page itself."""
    with live.page.expect_download() as got:
        live.page.get_by_label("CSV: Verdicts: An invented comparison").click()
    got.value.save_as(tmp_path / "table.csv")
    text = (tmp_path / "table.csv").read_text(encoding="utf-8-sig")
    head, *rows = filter(None, csv.reader(text.splitlines()))
    assert head[:3] == ["setting", "step", "verdict"]
    assert [row[0] for row in rows] == ["alpha fine matched", "alpha fine as installed", "beta only", "gamma"]
    assert all(len(row) == len(head) for row in rows)
    assert rows[1][4].split()[1] == "differs"
    assert rows[1][5].startswith("+ ")
    assert [address for address in live.requested if not address.startswith(("file:", "blob:"))] == []


@pytest.mark.nightly
def test_every_list_sorts_and_downloads(report_page: Path, visit: Visiting) -> None:
    """Each table, a map, too, and one with joined cells; with two rows or more it filters; nothing below moves."""
    with visit(report_page, viewport={"width": 1280, "height": 900}) as opened:
        opened.unfold()
        lists = """[...document.querySelectorAll('.scroll > table')].filter(
          (table) => table.querySelectorAll('tbody tr:not(.group)').length > 0)"""
        opened.page.evaluate(
            f"window.lists = {lists}.map((table) => [table, table.tBodies[0].rows.length, table.closest('.scroll')])"
        )
        many = opened.page.evaluate("lists.length")
        assert many > 20
        room = """JSON.stringify(lists.map(([table, , region]) => [table.tHead.getBoundingClientRect().height,
          region.previousElementSibling.getBoundingClientRect().height]))"""
        before = json.loads(opened.page.evaluate(room))
        for number in range(many):
            opened.page.evaluate(f"lists[{number}][2].dataset.list = {number}")
            opened.near(f"[data-list='{number}']", f"lists[{number}][2].dataset.sorts === ''")
        assert json.loads(opened.page.evaluate(room)) == [pytest.approx(sizes, abs=1) for sizes in before]
        tools = "item[2].previousElementSibling.querySelector"
        assert opened.page.evaluate(f"lists.every((item) => {tools}('button'))")
        filters = f"{tools}('input') !== null"
        rows = "item[0].querySelectorAll('tbody tr').length >= 2"
        assert opened.page.evaluate(f"lists.every((item) => ({filters}) === ({rows}))")
        assert opened.messages == []


@pytest.mark.nightly
def test_what_is_no_ranking_keeps_its_order(report_page: Path, visit: Visiting, tmp_path: Path) -> None:
    """A map offers no sorting, as its text says; it filters, and its file names axis and value of each column."""
    with visit(report_page.parent / "studies.html", viewport={"width": 1280, "height": 900}) as opened:
        opened.page.evaluate("folds.find('study-stability')")
        opened.wait("document.querySelector('.heat') !== null")
        opened.page.evaluate("""['40 d', '– d!', '5'].forEach((text) => {
          const row = document.querySelector('.heat tbody tr:last-child').cloneNode(true);
          row.cells[1].textContent = text;
          document.querySelector('.heat tbody').append(row);
        })""")
        column = "[...document.querySelectorAll('.heat tbody tr:not(.group)')].map((row) => row.cells[1].textContent)"
        texts = opened.page.evaluate(column)
        assert len(texts) == 4
        opened.page.evaluate("location.hash = 'study-stability'")
        opened.near(".heat", "document.querySelector('.heat').closest('.scroll').dataset.sorts === ''")
        opened.page.locator(".heat thead tr:last-child th").nth(1).click()
        assert opened.page.evaluate(column) == texts
        assert opened.page.locator(".heat thead :is(.dt-column-order, [aria-sort], [tabindex])").count() == 0
        assert "no ranking" in opened.page.evaluate("document.querySelector('.heat').closest('section').textContent")
        with opened.page.expect_download() as got:
            opened.page.get_by_label("CSV: Stability map").click()
        got.value.save_as(tmp_path / "map.csv")
    head, *rows = filter(None, csv.reader((tmp_path / "map.csv").read_text(encoding="utf-8-sig").splitlines()))
    assert head[0] == "setting"
    assert all(name.partition(" ")[2] for name in head[1:]), "axis and value"
    assert len(rows) == len(texts)
    assert {len(row) for row in rows} == {len(head)}


@pytest.mark.nightly
def test_a_table_shows_that_it_has_columns_beyond_its_edge(report_page: Path, visit: Visiting) -> None:
    """The edge of a table that is wider than the screen fades until a reader has scrolled to its last column."""
    with visit(report_page, viewport={"width": 400, "height": 900}) as opened:
        region = "document.querySelector(\"[aria-label='Verdicts: An invented comparison']\")"
        opened.near("[aria-label='Verdicts: An invented comparison']", f"{region}.dataset.sorts === ''")
        opened.wait(f"getComputedStyle({region}).maskImage !== 'none'")
        opened.page.evaluate(f"{region}.scrollLeft = {region}.scrollWidth")
        opened.wait(f"getComputedStyle({region}).maskImage === 'none'")
        opened.page.evaluate(f"{region}.scrollLeft = 0")
        opened.wait(f"getComputedStyle({region}).maskImage !== 'none'")
        opened.page.emulate_media(media="print")
        assert opened.page.evaluate(f"getComputedStyle({region}).maskImage") == "none"
