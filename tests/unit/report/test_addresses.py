"""Addresses of the rows of tables on a page."""

from __future__ import annotations

import re

from proofroll.report.pages import addressed

PAGE = """<section id="c3"><div class="scroll" role="group" aria-label="Errors of alpha, dt 1e-3" tabindex="0">
<table><thead><tr><th>observable</th></tr></thead><tbody>
<tr><th scope="row">z <small>m</small></th><td>{z}</td></tr>
<tr class="true"><td>z</td><td>2</td></tr></tbody></table></div></section>
<section id="verdicts"><div class="scroll" role="group" aria-label="Verdicts" tabindex="0"><table>
<tbody data-engine="alpha"><tr class="group"><th>alpha</th></tr><tr><th>default</th><td>1</td></tr></tbody>
<tbody data-engine="beta"><tr><th>default</th></tr><tr id="own"><th>tuned</th></tr></tbody></table></div></section>"""


def test_a_row_has_an_address_and_a_link_to_it() -> None:
    """From section, table, engine and first cell; headings and rows of groups have none, an id of its own is kept."""
    page = addressed(PAGE)
    ids = re.findall(r'<tr[^>]*? ?id="([^"]*)"', page)
    errors, verdicts = "c3.errors-of-alpha-dt-1e-3.z", "verdicts.verdicts"
    assert ids == [errors + "-m", errors, f"{verdicts}.alpha-default", f"{verdicts}.beta-default", "own"]
    assert re.findall(r'class="row" href="#([^"]*)"', page) == ids
    assert re.sub(r'<a class="row"[^>]*></a>| id="[^"]*\.[^"]*"', "", page) == PAGE, "nothing else changes"


def test_an_address_stays_where_results_change() -> None:
    """A row whose numbers are others has the same address; equal rows are counted."""
    first, second = (re.findall('<tr id="([^"]*)"', addressed(PAGE.format(z=z))) for z in (1, 2e-9))
    assert first == second
    twice = re.findall('<tr id="(own|[^"]*)"', addressed(f"{PAGE}{PAGE}"))
    assert len(set(twice)) == len(twice) - 1, "the id of its own alone"
    assert f"{first[0]}-2" in twice


KEYED = """<section id="c"><div class="scroll" role="group" aria-label="Front" tabindex="0"><table><tbody>
<tr><th scope="row">alpha</th><td data-key>1e-3 s</td><td class="n">5</td></tr>
<tr><th scope="row">alpha</th><td data-key>-1e-3 s</td><td class="n">6</td></tr>
<tr><th scope="row">{words} one</th></tr><tr><th scope="row">{words} other</th></tr></tbody></table></div></section>"""


def test_an_address_does_not_hang_on_the_rows_before() -> None:
    """Rows whose first cells are alike differ by their keys, long names by a hash, and signs count."""
    page = addressed(KEYED.format(words="word " * 12))
    ids = re.findall(r'<tr id="([^"]*)"', page)
    assert ids[:2] == ["c.front.alpha-1e-3-s", "c.front.alpha--1e-3-s"]
    words = "c.front." + "-".join(["word"] * 12)
    assert all(re.fullmatch(f"{words}-[0-9a-f]{{8}}", name) for name in ids[2:])
    assert ids[2] != ids[3]
    assert re.findall(r'class="row" href="#([^"]*)"', page) == ids
    alone = addressed(re.sub("<tr>.*?5</td></tr>", "", KEYED.format(words="word " * 12)))
    assert re.findall(r'<tr id="([^"]*)"', alone) == ids[1:]
