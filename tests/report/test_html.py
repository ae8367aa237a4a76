"""The report stands alone, says everything, and lets nothing through that a scene, engine or message smuggles in."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
from folded import texts, whole
from poison import Poison

import proofroll.report.page.html
from proofroll.core.number_format import number
from proofroll.files.json_data import plain
from proofroll.report.comparison.plots import EngineCurve, point_curves
from proofroll.report.labels import symbol
from proofroll.report.page.growing import begun
from proofroll.report.page.html import page
from proofroll.report.page.records import report_content
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import Outcome

COMMAND = "proofroll report invented"


@pytest.mark.drill
def test_page_needs_no_other_file_and_no_network(html: str, parse: Any) -> None:
    """Nothing in the page names another place, and its policy forbids to load from one."""
    assert "http:" not in html
    assert "https:" not in html
    assert "@import" not in html
    assert "default-src 'none'" in html
    for tag, attributes in parse(html).tags:
        assert "src" not in attributes, tag
        assert attributes.get("href", "#").startswith("#"), attributes
        assert tag not in {"link", "iframe", "object", "base"}


@pytest.mark.nightly
def test_an_address_is_the_same_in_a_report_of_more(everything: Any, tmp_path: Path, parse: Any) -> None:
    """With another comparison before it, and without its first row, the ids of a comparison, its rows and runs stay."""
    first = everything.content.comparisons[0]
    other = dataclasses.replace(first, name="other", title="Other")

    def ids(*comparisons: Any) -> set[str]:
        content = dataclasses.replace(everything.content, comparisons=list(comparisons))
        whole = dataclasses.replace(everything, content=content, curves=len(comparisons) * everything.curves)
        text = whole.write(tmp_path / "report.html").read_text(encoding="utf-8")
        found = {attributes.get("id", "") for _, attributes in parse(text).tags}
        return {name for name in found if "invented" in name or "-rows-" in name}

    alone = ids(first)
    assert len(alone) > 50
    assert alone <= ids(other, first)
    runs = [dataclasses.replace(run, row=run.row - 1) for run in first.runs if run.row]
    fewer = dataclasses.replace(first, rows=first.rows[1:], runs=runs)
    assert {name for name in ids(fewer) if "second" in name or "default" in name} <= alone
    assert {run.run_id(row, point) for run, row, point in ((fewer, 0, ""), (fewer, 2, "x"))} == {
        first.run_id(1, ""), first.run_id(3, "x")
    }  # fmt: skip


def test_json_file_is_the_content_and_has_no_nan(written: tuple[dict[str, Any], Path]) -> None:
    """What is returned is what is written, in JSON that every reader accepts."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    content, out = written
    assert json.loads((out / "report.json").read_text(encoding="utf-8"), parse_constant=refuse) == content
    parts = {
        "answers",
        "findings",
        "comparisons",
        "replay",
        "figures",
        "regimes",
        "stability",
        "awaited",
        "left_out",
    }
    assert set(content) == {*parts, "engine_findings", "environment", "date", "format", "table", "names", "provides"}
    assert content["environment"]["command"] == COMMAND
    assert len(content["comparisons"][0]["truths"]) == 2


def test_every_row_and_every_run_appears(written: tuple[dict[str, Any], Path], html: str, parse: Any) -> None:
    """Every row of the file has its line and every run its evidence, the missing engine too."""
    content = written[0]
    elements = parse(html)
    ids = [attributes["id"] for _, attributes in elements.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    (comparison,) = content["comparisons"]
    assert len(comparison["runs"]) == 8
    for run in comparison["runs"]:
        named = comparison["rows"][run["row"]]["engine"], run["point"]
        assert ".".join(["evidence-invented", *("-".join(re.findall(r"\w+", text)) for text in named)]) in ids
    titles = {attributes.get("title") for tag, attributes in elements.tags if tag == "th"}
    assert {row["engine"] for row in content["comparisons"][0]["rows"]} <= titles
    assert "gamma is not installed here" in elements.text
    assert "a reason for it" in elements.text
    assert "it is coarse" in elements.text


def test_what_is_folded_is_kept_apart(written: tuple[dict[str, Any], Path], html: str) -> None:
    """Of each closed fold the page has a place alone; its text lies compressed, and put back nothing is missing."""
    page = (written[1] / "report.html").read_text(encoding="utf-8")
    kept = texts(page)
    assert (page + "".join(kept)).count("<div data-fold=") == len(kept)
    assert 'aria-label="Certificate of' not in page
    assert html.count('aria-label="Certificate of') == 6
    assert page.count("<tr") < html.count("<tr") / 2
    assert len(page) < len(html)


def test_cells_can_be_read_without_colour(html: str) -> None:
    """Each cell has a sign for the eye and a word for a screen reader."""
    for verdict, sign in (("agrees", "✓"), ("differs", "✗")):
        assert f'<span aria-hidden="true">{sign}</span><span class="vh">{verdict}</span>' in html


@pytest.mark.drill
def test_nothing_that_others_write_becomes_markup(made: tuple[Outcome, Store], parse: Any, unpack: Any) -> None:
    """Poison in every string is shown as text: no element, no handler, no end of a script."""
    poison = Poison()
    content = report_content([made[0]], COMMAND)
    curves = [point_curves(made[0])]
    clean = parse(page(content, curves))
    html = page(poison.content(content), poison.content(curves, names=False))
    elements = parse(html)
    assert elements.text.count("<img src=x") > 100, "the strings are shown, as text"
    assert len(elements.scripts) == len(clean.scripts)
    for tag, attributes in elements.tags:
        assert tag not in {"img", "textarea"}
        assert not any(name.startswith("on") for name in attributes), tag
    assert "<img src=x" in json.loads(unpack(html, "curves"))["rows"][0][0]["name"]


@pytest.mark.drill
def test_a_comparison_that_varies_nothing(made: tuple[Outcome, Store]) -> None:
    """Of a scene as it is nothing is said to vary."""
    for vary, said in (({"speed": [1.0]}, True), ({}, False)):
        comparison = dataclasses.replace(made[0].comparison, vary=vary)
        content = report_content([dataclasses.replace(made[0], comparison=comparison)], COMMAND)
        assert ("; varied:" in page(content, [point_curves(made[0])])) is said


@pytest.mark.drill
def test_numbers_that_are_not_finite_do_not_break_the_page(made: tuple[Outcome, Store], tmp_path: Path) -> None:
    """An infinite error is null in JSON and a sign on the page."""
    outcome, _ = made
    first = outcome.runs[0]
    lost = [dataclasses.replace(judgement, error=math.inf, order=math.nan) for judgement in first.judgements]
    runs = [dataclasses.replace(first, judgements=lost), *outcome.runs[1:]]
    report = begun([dataclasses.replace(outcome, runs=runs)], COMMAND)
    report.write(tmp_path)
    content = report.content
    assert plain(content)["comparisons"][0]["runs"][0]["judgements"][0]["error"] is None
    assert (
        "∞" in whole((tmp_path / "report.html").read_text(encoding="utf-8")).rpartition('<script type="text/plain"')[0]
    )


@pytest.mark.nightly
def test_the_largest_report_we_make_stays_small(made: tuple[Outcome, Store]) -> None:
    """Six points, 24 rows and 201 samples: what the default study has."""
    content = report_content([made[0]], COMMAND)
    comparison, change = content.comparisons[0], dataclasses.replace
    rows, points = 24, [f"p{number}" for number in range(6)]
    row, good = comparison.rows[0], comparison.runs[0]
    worst = {name: change(judgement, point="p0") for name, judgement in row.observables.items()}
    comparison.rows[:] = [change(row, observables=worst)] * rows
    good = change(good, certificate=good.certificate * 14)
    comparison.runs[:] = [change(good, row=row, point=point) for point in points for row in range(rows)]
    assert comparison.evidence
    truths = comparison.evidence.truths
    truths[:] = [change(truths[0], point=point) for point in points]
    curves = point_curves(made[0])[0]
    for observable in curves.observables:  # the longest form that a rounded number has
        observable.engines[:] = [EngineCurve(row, [-1.23e-10] * 201, None, None, None) for row in range(rows)]
    html = page(content, [[change(curves, point=point) for point in points]])
    assert len(html.encode()) < 5e6


def test_curves_are_the_difference_from_the_truth(made: tuple[Outcome, Store]) -> None:
    """Rows keep their numbers, and what an engine does not say is not drawn."""
    entry = point_curves(made[0])[1]
    z = next(observable for observable in entry.observables if observable.name == "z")
    assert entry.point == "speed=4"
    assert [engine.row for engine in z.engines] == [0, 1, 2]
    assert max(abs(value or 0.0) for value in z.engines[1].difference) == pytest.approx(1e-3 * z.scale, rel=0.01)
    normal = next(observable for observable in entry.observables if observable.name == "N")
    assert [engine.row for engine in normal.engines] == [0, 1], "the third row is silent about forces"
    assert normal.engines[0].difference[0] is None, "a reaction at time 0 is the certificate's"


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, "–"),
        (0.0, "0"),
        (5.39e-4, "5.4e-4"),
        (1e-10, "1e-10"),
        (0.25, "0.25"),
        (-3e-12, "-3e-12"),
        (4e12, "4e12"),
        (0.01, "0.01"),
        (0.01 * (1 - 1e-15), "0.01"),
        (9.96e-3, "0.01"),
        (9.94e-3, "9.9e-3"),
        (9.96, "10"),
        (5936, "5900"),
        (1e4, "1e4"),
    ],
)
def test_numbers_are_short(value: float | None, shown: str) -> None:
    """Small numbers all have one form, and what is written alike has the same."""
    assert number(value) == shown


def test_quantities_have_their_symbols() -> None:
    """Greek letters by their names, other names as words."""
    assert [symbol(name) for name in ("gamma", "omega1", "z", "N", "needed_friction")] == [
        "γ", "ω1", "z", "N", "needed friction",
    ]  # fmt: skip


def test_findings_are_written_from_the_data(written: tuple[dict[str, Any], Path]) -> None:
    """The sentences name the right rows."""
    found = written[0]["comparisons"][0]["findings"]
    assert found["answer"].startswith("Of 4 engine settings, 1 agrees with the truth")
    assert found["sentences"][0].startswith("Not expected: gamma at this point missing")


def test_where_runs_were_made_is_told(made: tuple[Outcome, Store], html: str, tmp_path: Path) -> None:
    """Who ran on machines of a cluster is told once for the comparison, with each run, and nowhere where nobody did."""
    outcome, _ = made
    away = [
        dataclasses.replace(run, result=dataclasses.replace(run.result, host="node<7>"))
        for run in outcome.runs
        if run.row.engine == "beta"
    ]
    runs = [run for run in outcome.runs if run.row.engine != "beta"] + away
    begun([dataclasses.replace(outcome, runs=runs)], COMMAND).write(tmp_path)
    shown = whole((tmp_path / "report.html").read_text(encoding="utf-8"))
    line = "Made on machines of a cluster: 2 on node&lt;7&gt;. No speed is measured there."
    assert f"<dt>Elsewhere</dt><dd>An invented comparison: {line}</dd>" in shown
    assert shown.count("<dt>Ran on</dt><dd>node&lt;7&gt;, a machine of a cluster") == len(away) == 2
    assert "<dt>Elsewhere</dt>" not in html
    assert "<dt>Ran on</dt>" not in html


def test_a_comparison_of_which_nothing_is_left_is_still_a_report(made: tuple[Outcome, Store], tmp_path: Path) -> None:
    """Every engine missing: the page says so, and what cannot be said."""
    outcome, _ = made
    lost = [run for run in outcome.runs if run.row.engine == "gamma"]
    report = begun([dataclasses.replace(outcome, runs=lost)], COMMAND)
    report.write(tmp_path)
    content = report.content
    assert content.comparisons[0].evidence
    found = content.comparisons[0].evidence.findings
    assert found.answer.startswith("Of 1 engine setting, 1 gives no result at some points")
    assert "the cheapest" not in found.answer
    assert "gamma is not installed here" in whole((tmp_path / "report.html").read_text(encoding="utf-8"))


def test_no_engine_and_no_scene_is_named_in_the_code_of_the_report() -> None:
    """What is drawn and said comes from the data."""
    folder = Path(proofroll.report.page.html.__file__).parent
    text = "\n".join(file.read_text(encoding="utf-8") for file in folder.rglob("*.*") if file.suffix != ".pyc").lower()
    for name in ("mujoco", "exudyn", "pinocchio", "sphere_in_cylinder", "inclined_plane", "cylinder"):
        assert name not in text
