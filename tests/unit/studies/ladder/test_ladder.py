"""The ladder of models: its rungs, the terms in each, and what is said about them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from hostile import ENTRY_POINTS

from proofroll.core.dataset import BETWEEN, observe
from proofroll.core.engine_abilities import Level
from proofroll.core.errors import InputError
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.report.ladder import LadderContent, ladder_content, rung_table, term_table
from proofroll.report.terminal.screen import WIDEST, console
from proofroll.running.case import Result, Status
from proofroll.running.runner import Runner
from proofroll.running.simulation import simulate
from proofroll.running.store import Store
from proofroll.studies.ladder.ladder import Ladder, ModelAnswer, key_of
from proofroll.studies.ladder.models import LadderModel, switches

UNTIL = 0.2


@pytest.fixture
def climb(tmp_path: Path, install_engines: Callable[[Mapping[str, str]], None]) -> Callable[..., LadderContent]:
    """Studies the engines of ``tests/plugins``; results go to ``tmp_path``."""
    install_engines(ENTRY_POINTS)

    def run(parameters: Mapping[str, float] = {}, **options: Any) -> LadderContent:
        runner = Runner(Store(tmp_path), jobs=1)
        chosen = {"engines": ("laddered",), "until": UNTIL, "rounds": 1} | options
        study = Ladder("sphere_in_cylinder", dict(parameters), runner, **chosen)
        study.run()
        return ladder_content(study)

    return run


@pytest.mark.nightly
def test_a_model_that_is_right_on_the_grid_alone_is_wrong(
    tmp_path: Path, install_engines: Callable[[Mapping[str, str]], None]
) -> None:
    """Its error is that of its samples between those every 0.02 s, where a model is right at these."""
    install_engines(ENTRY_POINTS)
    study = Ladder("sphere_in_cylinder", {}, Runner(Store(tmp_path), jobs=1), engines=("laddered",), until=UNTIL)
    study._run_truths([{}], lambda _: None)
    model, reference = LadderModel("laddered", {}), study.truths[str({})]
    for wrong in (0.0, 0.25):
        run = reference.dataset.copy(deep=True)
        run[f"{BETWEEN}.z"] += wrong
        values = observe(study.scene, run)["z"]
        study.answers[key_of(model)] = ModelAnswer(None, Result(Status.DONE, ""), values, run)
        assert study.error(model, {}) == pytest.approx(wrong, abs=1e-12)


@pytest.mark.nightly
def test_a_model_that_refuses_the_scene_has_no_terms(tmp_path: Path) -> None:
    """It stands on the ladder with its reason; what it would be without a term it cannot have is no question."""
    study = Ladder("sled", {}, Runner(Store(tmp_path)), engines=("exudyn",))
    assert {rung.model.formulation for rung in study.ladder if rung.model} > {"spheres"}
    truth = simulate(study.scene, "truth", until=0.01)
    assert {one.model.formulation for one in switches(study.ladder, study.engines, study.scene, truth)} == {"spheres"}


def error_of(f: float, options: str) -> float:
    """Largest error of z in a run of its own against the truth."""
    runs = [
        simulate(load_scene("sphere_in_cylinder", rolling_resistance=f), engine, until=UNTIL, every=0.02)
        for engine in (f"laddered[{options}]", "truth")
    ]
    return float(abs(runs[0].z - runs[1].z).max())


def check_rungs(content: dict[str, Any]) -> None:
    """Every level has a rung or says that it is empty; errors are those of plain runs, and what fails is a row."""
    rungs = {(rung["level"], rung["variant"]): rung for rung in content["rungs"]}
    assert list(dict.fromkeys(level for level, _ in rungs)) == [level.value for level in Level]
    empty = {level for (level, _), rung in rungs.items() if rung["status"] == "empty"}
    assert empty == {Level.CLOSED_FORM, Level.PROJECTION, Level.CONSTRAINT}
    reduced = rungs[Level.REDUCED, ""]
    assert reduced["error"] == error_of(0.0, "formulation=midpoint")
    assert (reduced["resolution"], reduced["resolution_value"]) == ("dt", 1e-3)
    assert reduced["seconds_per_second"]["value"] > 0
    assert rungs[Level.CONTACT, "wind=gale"]["error"] == pytest.approx(UNTIL**2 / 2 * 5 / 7, rel=0.5)
    assert "no ball rolls in a storm" in rungs[Level.CONTACT, "wind=storm"]["message"]


def check_terms(content: dict[str, Any]) -> None:
    """Each term gets its verdict, by its effect on the quantity and against the truth of the scene with it."""
    terms = {(term["term"], term["formulation"]): term for term in content["terms"]}
    resistance = terms["rolling resistance of contacts", "midpoint"]
    assert resistance["verdict"] == "needed"
    assert resistance["on"]["parameters"] == {"rolling_resistance": 5e-4}
    assert resistance["on"]["error"] == pytest.approx(error_of(5e-4, "formulation=midpoint"), rel=1e-6)
    assert resistance["off"]["error"] > 100 * resistance["on"]["error"]
    second = terms["second stage", "midpoint"]
    assert second["verdict"] == "needed"
    assert second["error_change"] == second["off"]["error"] - second["on"]["error"] > 0
    assert terms["idle work", "midpoint"]["change"] == 0
    assert terms["idle work", "midpoint"]["verdict"] in {"paid for, not needed", "free"}  # a matter of the clock
    assert terms["gale", "heavier"]["verdict"] == "harmful"
    assert terms["storm", "heavier"]["verdict"] == "no answer"
    assert terms["orientation asked", "midpoint"]["verdict"] == "no answer"
    assert terms["orientation asked", "heavier"]["verdict"] == "inherent"


def check_findings(content: dict[str, Any]) -> None:
    """What is missing, harmful or not on the ladder is said in words, and all of it is plain JSON."""
    said = " ".join(content["findings"])
    assert "No engine that was asked has a model of the level closed form, projection DAE, " in said
    assert "gale moves z away from the truth in laddered heavier" in said
    assert "absent is missing" in said
    assert "Not on the ladder (no levels declared): tiny." in said
    json.dumps(content, allow_nan=False)


def check_tables(content: LadderContent) -> None:
    """No line of the tables is wider than the terminal's hundred columns, and none is cut."""
    out = console()
    with out.capture() as captured:
        out.print(rung_table(content))
        out.print(term_table(content))
    lines = captured.get().splitlines()
    assert len(lines) > len(content.rungs) + len(content.terms)
    assert max(map(len, lines)) <= WIDEST
    assert "…" not in captured.get().replace(" … ", "")


def check_slip(content: dict[str, Any]) -> None:
    """What is zero for a perfect run is held against zero, and no rung is within a tolerance below round-off."""
    reduced = next(rung for rung in content["rungs"] if rung["level"] == Level.REDUCED)
    assert (content["unit"], reduced["status"]) == ("m/s", "done")
    assert 0 < reduced["error"] < 1e-12  # the reduced equations know no slip
    assert "No rung is within 1e-30 m/s at its own step." in content["findings"]


@pytest.mark.nightly
def test_ladder(climb: Callable[..., LadderContent], tmp_path: Path) -> None:
    """One climb gives rungs, terms, findings and tables; one that asks for another quantity runs nothing again."""
    content = climb(engines=("laddered", "tiny", "absent"))
    check_tables(content)
    for check in (check_rungs, check_terms, check_findings):
        check(plain(content))
    stored = {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.*")}
    assert len(stored) > 10
    check_slip(plain(climb(quantity="slip", tolerance=1e-30)))
    assert {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.*")} == stored


@pytest.mark.parametrize(
    ("options", "advice"),
    [
        ({"quantity": "first_slip"}, "choose one of gamma, z"),
        ({"quantity": "height"}, "choose one of gamma, z"),
        ({"tolerance": 0.0}, "give a positive number"),
        ({"until": 0.0}, "positive"),
        ({"engines": ("adams",)}, "there is no such engine"),
        ({"parameters": {"wheels": 4}}, "there is no such parameter"),
    ],
)
def test_bad_questions(climb: Callable[..., LadderContent], options: dict[str, Any], advice: str) -> None:
    """A question that makes no sense is answered in one line."""
    with pytest.raises(InputError) as caught:
        climb(**options)
    assert advice in str(caught.value)
    assert "\n" not in str(caught.value)
