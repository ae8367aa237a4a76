"""Figures from real runs, and what the paper states of them."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import pytest

from proofroll.figures.definition import Figures
from proofroll.figures.drawing import drawn, inline, looks, picture
from proofroll.figures.judging import judged
from proofroll.figures.reading import load_figures
from proofroll.figures.study import Study, run_figures
from proofroll.report.figures import write_figures
from proofroll.running.runner import Runner
from proofroll.running.store import Store

# The runs that can be made in seconds, and long enough for the first slip past 1.7 s and four swings of z.
RUNS = ("free4", "resisted4")
SHORT = 1.75


def only(whole: Figures, *runs: str, **changes: Any) -> Figures:
    """The file with some of its runs, and with what is said and drawn of those alone."""
    drawn_of = [f for f in whole.figures if f.panels and all(set(panel.runs) <= set(runs) for panel in f.panels)]
    said = [dataclasses.replace(s, runs=[run for run in s.runs if run in runs]) for s in whole.statements]
    kept: dict[str, Any] = {
        "runs": {name: whole.runs[name] for name in runs},
        "figures": [dataclasses.replace(f, until=None) for f in drawn_of],
        "statements": [s for s in said if s.runs and not s.order],
    }
    return dataclasses.replace(whole, **(kept | changes))


@pytest.fixture(scope="module")
def runner(tmp_path_factory: pytest.TempPathFactory) -> Runner:
    """A store of this module's own."""
    return Runner(Store(tmp_path_factory.mktemp("cases")), jobs=2)


@pytest.fixture(scope="module")
def study(runner: Runner) -> Study:
    """The paper's runs at 4 m/s in the paper's method, beside the truth."""
    return run_figures(only(load_figures("paper_figures"), *RUNS, until=SHORT, every=2e-3), runner)


def test_what_the_paper_states_holds(study: Study) -> None:
    """Every statement about the two runs at 4 m/s holds, by the projection method and by the truth alike."""
    entries = judged(study)
    assert len(entries) > 15
    assert [entry["says"] for entry in entries if entry["holds"] is not True] == []
    for entry in entries:
        if entry["of"] not in {"phi", "theta"} and entry["measure"] not in {"variation", "misfit_of_sinusoid"}:
            assert entry["found"] == pytest.approx(entry["truth"], rel=1e-6)


def test_a_wrong_number_does_not_hold(study: Study) -> None:
    """Another last digit, the other bound or the other sign is contradicted by the same runs."""
    stated = {"0.2102": "0.2103", "-160": "-161", "1.293e-4": "1.294e-4"}
    wrong = []
    for item in study.figures.statements:
        if item.stated in stated:
            wrong.append(dataclasses.replace(item, stated=stated[item.stated]))
        elif item.above is not None and item.of != "theta":
            wrong.append(dataclasses.replace(item, above=None, below=item.above))
        elif item.below == 0:
            wrong.append(dataclasses.replace(item, below=None, above=0.0))
    entries = judged(dataclasses.replace(study, figures=dataclasses.replace(study.figures, statements=wrong)))
    assert len(entries) > 8
    assert {entry["holds"] for entry in entries} == {False}


def test_every_axis_has_a_unit(study: Study) -> None:
    """Both axes of each panel are named with a unit, in the figure and in the file."""
    for figure in study.figures.figures:
        with looks():
            axes = drawn(figure, study).axes
        assert len(axes) == len(figure.panels)
        text = picture(figure, study, "svg").decode()
        for item, panel in zip(axes, figure.panels, strict=True):
            for label in (item.get_xlabel(), item.get_ylabel()):
                assert re.search(r" \[(m|s|N|rad|rad/s|–)\]$", label)
                assert f"<!-- {label} -->" in text
            lines = [line for line in item.lines if line.get_marker() == "None" and len(line.get_xdata()) > 2]
            assert len(lines) == len(panel.y) * len(panel.runs)


def test_equal_runs_give_equal_files_in_every_form(study: Study, tmp_path: Path) -> None:
    """SVG, PNG and PDF are what they are called, twice the same, and the JSON names them."""
    first = study.figures.figures[0]
    figures = dataclasses.replace(study.figures, figures=[dataclasses.replace(first, panels=first.panels[:2])])
    small = dataclasses.replace(study, figures=figures)
    content = write_figures(small, {}, tmp_path, ["svg", "png", "pdf"])
    assert content["figures"][0]["files"] == [f"figure3.{form}" for form in ("svg", "png", "pdf")]
    for form, start in {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}.items():
        file = (tmp_path / f"figure3.{form}").read_bytes()
        assert file.startswith(start)
        if form != "png":
            assert file == picture(figures.figures[0], small, form)


def test_figures_of_one_page_share_no_id(study: Study) -> None:
    """Inlined twice, every reference of a figure is to an id of its own."""
    texts = [inline(study.figures.figures[0], study, prefix) for prefix in ("one-", "two-")]
    ids = [set(re.findall(r' id="([^"]*)"', text)) for text in texts]
    assert ids[0]
    assert not ids[0] & ids[1]
    for text, own in zip(texts, ids, strict=True):
        assert set(re.findall(r'(?:href="#|url\(#)([^")]*)', text)) <= own
        assert "http" not in text


def test_past_the_first_slip_by_the_truth(runner: Runner) -> None:
    """Where slip is located its time holds and is marked; what an engine cannot tell is not judged, and says why."""
    whole = load_figures("paper_figures")
    statements = [item for item in whole.statements if item.event == 0]
    angle = next(item for item in whole.statements if item.of == "theta")
    statements.append(dataclasses.replace(angle, runs=["slipping"]))
    figure = next(item for item in whole.figures if item.name == "past_the_first_slip")
    panels = [dataclasses.replace(panel, runs=["slipping"]) for panel in figure.panels]
    panels.append(dataclasses.replace(panels[0], y=["theta"]))
    mine = only(
        whole, "slipping", until=SHORT, every=5e-3, statements=statements,
        figures=[dataclasses.replace(figure, panels=panels)],
    )  # fmt: skip
    study = run_figures(mine, runner, "truth")
    first, second = judged(study)
    assert (first["holds"], second["holds"]) == (True, None)
    assert second["why"] == "truth does not tell theta"
    text = picture(mine.figures[0], study, "svg").decode()
    assert "<!-- 1.720 s -->" in text
    assert "<!-- truth cannot say -->" in text
