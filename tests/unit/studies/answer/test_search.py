"""The search of an engine over its settings, and the answers that are stored."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.core.time_grid import require_whole_steps, time_grid
from proofroll.files.json_data import plain, record
from proofroll.files.scene_file import read_scene_file
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.engine_questions import resolve_with_truth
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.running.timing import Timing
from proofroll.studies.answer import answers
from proofroll.studies.answer import question as question_module
from proofroll.studies.answer.answers import answer, answer_path, engine_answer, kept, stored
from proofroll.studies.answer.judged_run import JudgedRun
from proofroll.studies.answer.question import AnswerQuestion, sampling_of
from proofroll.studies.answer.records import AllowedError, SceneAnswer
from proofroll.studies.answer.search import EngineSearch, SearchesAbreast, searching
from proofroll.studies.answer.setting_search import UNSEARCHED, SettingSearch, State
from proofroll.studies.judging.asked_tolerance import AskedTolerance

QUESTION = AnswerQuestion("double_pendulum", {}, 10.0, 0.1)
BOUND = AllowedError("x", "m", 1e-4, 1.0, 0.0, relative=True)


def setting(preset: str) -> SettingSearch:
    """A setting whose search begins at a sixteenth of the sampling interval."""
    facts = EngineFacts("mujoco", "1", "", {"formulation": "joints", "preset": preset, "dt": 1e-3}, "dt", 2)
    return SettingSearch(f"mujoco[preset={preset}]", facts, 0.1, 10.0, {"x": 1e-4}, {"x": 1.0}, 4)


def searched(search: EngineSearch, error: Callable[[str, float], float], cost: Callable[[str], float]) -> list[Case]:
    """Cases that a search asked for; a run costs ``cost`` of its preset for each step [s]."""
    asked, generator = [], searching(search, QUESTION)
    try:
        case = next(generator)
        while True:
            asked.append(case)
            preset, step = case.engine.settings["preset"], case.engine.settings["dt"]
            off = error(preset, step)
            run = JudgedRun(
                step=step, status=Status.DONE, cost=cost(preset) / step, spent=0.1, reached=10.0, errors={"x": off},
                growth={"x": np.full(2, off)}, times=np.array([5.0, 10.0]), curves={"x": np.full((2, 1), off)},
                true={"x": np.zeros((2, 1))},
            )  # fmt: skip
            case = generator.send(run)
    except StopIteration:
        return asked


def test_what_cannot_be_cheaper_is_not_run_further() -> None:
    """A setting whose bound is above the confirmed choice gets no further run, and is told as dearer."""
    search = EngineSearch("mujoco", [setting("good"), setting("poor")])
    asked = searched(search, lambda preset, step: (4 if preset == "good" else 4e4) * step**2, lambda _: 1e-6)
    assert search.found is search.settings[0]
    assert [item.state for item in search.settings] == [State.HOLDS, State.DEARER]
    assert len([case for case in asked if case.engine.settings["preset"] == "poor"]) == 1


def test_short_runs_are_measured_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A run of some ms may have taken most of its time to start; what is clearly dearer is not measured again."""
    monkeypatch.setattr(answers, "time_in_rounds", lambda tasks, *_, **__: dict.fromkeys(tasks, Timing((5e-4,))))
    settings = []
    for preset, cost in (("fast", 1e-3), ("starts slowly", 9e-3), ("dear", 0.5)):
        item = setting(preset)
        item.runs[1], item.level, item.state = JudgedRun(0.1, Status.DONE, cost=cost), 0, State.HOLDS
        settings.append(item)
    abreast = SearchesAbreast({}, Runner(Store(tmp_path), jobs=1, workers=Workers()))
    speeds = answers._speeds([EngineSearch("mujoco", settings)], QUESTION, abreast)
    assert speeds == {"mujoco[preset=fast,dt=0.1]": 5e-4, "mujoco[preset=starts slowly,dt=0.1]": 5e-4}


def test_each_setting_is_run_before_one_without_a_cost_is_run_again() -> None:
    """A run that ends without a cost bounds nothing; the other settings have their turn before its next step."""
    search = EngineSearch("mujoco", [setting("poor"), setting("good")])
    asked = searched(search, lambda _, step: 4 * step**2, lambda preset: math.inf if preset == "poor" else 1e-6)
    assert [case.engine.settings["preset"] for case in asked[:2]] == ["poor", "good"]


def test_events_are_looked_for_only_where_they_are_judged() -> None:
    """A case whose tolerance bounds places asks the engine for no events; one that bounds their times does."""
    question = AnswerQuestion("sled", {}, 0.7, 0.01)
    facts = EngineFacts("mujoco", "1", "", {"formulation": "geoms", "preset": "tuned", "dt": 1e-3}, "dt", 1)
    assert question.case(facts, 0.01, 1.0, ["positions"]).without_events
    assert not question.case(facts, 0.01, 1.0, ["positions", "event_times"]).without_events


def test_the_cheaper_setting_is_found_though_its_step_is_finer() -> None:
    """Cost decides, not the step: a setting with dearer steps is not taken for its coarser one."""
    search = EngineSearch("mujoco", [setting("slow"), setting("fast")])
    searched(
        search, lambda preset, step: {"slow": 0.01, "fast": 4.0}[preset] * step**2,
        lambda preset: {"slow": 1e-3, "fast": 1e-6}[preset],
    )  # fmt: skip
    assert search.found is not None
    assert search.found.facts.settings["preset"] == "fast"


def test_an_engine_answers_by_its_search_alone() -> None:
    """The record names the setting with its step, its error, twice the step, and the settings that were searched."""
    search = EngineSearch("mujoco", [setting("good"), setting("poor")])
    searched(search, lambda preset, step: (4 if preset == "good" else 4e4) * step**2, lambda _: 1e-6)
    item = engine_answer(search, [BOUND])
    assert item.spec == "mujoco[preset=good,dt=0.003125]"
    assert item.error == pytest.approx(4 * 0.003125**2)
    assert item.coarser is not None
    assert item.coarser.of_allowed == pytest.approx(4 * 0.00625**2 / 1e-4)
    assert [tried.state for tried in item.settings] == [State.HOLDS, State.DEARER]
    assert engine_answer(EngineSearch("mujoco", [], "lacks loops"), [BOUND]).state is State.CANNOT


@pytest.mark.parametrize(("until", "every"), [(10, 0.1), (5, 0.05), (0.7, 5e-3), (4.4, 0.05), (3.14159, 0.0314159)])
def test_samples_divide_the_duration(until: float, every: float) -> None:
    """A run has 80 to 400 sampling intervals that a person can write down, or a hundred."""
    assert sampling_of("double_pendulum", until) == every


@pytest.mark.parametrize("base", [None, 2e-3, 1 / 240, 0.01])
@pytest.mark.parametrize("until", [0.7, 0.053, 1.0, 3.3, 1 / 3, 1e-3])
@pytest.mark.parametrize("asked", [None, 1e-3, 3e-3, 1 / 240])
def test_every_candidate_divides_the_sampling(
    until: float, asked: float | None, base: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Halvings and their checks, a third and a fifth of them, are whole parts of all intervals, the last one, too."""
    file = replace(read_scene_file("double_pendulum"), every=base)
    monkeypatch.setattr(question_module, "read_scene_file", lambda _: file)
    question = AnswerQuestion.of("double_pendulum", {}, until)
    if asked is not None and 4 * asked <= question.until:
        question = question.sampled_for(asked)
        candidates = [4 * asked / divisor for divisor in (1, 2, 3, 4, 5, 6, 10, 32)]
    else:
        candidates = [question.every / divisor for divisor in (1, 2, 3, 4, 5, 6, 10, 32)]
    times = time_grid(question.until, min(question.every, question.until))
    for step in candidates if question.every <= question.until else ():
        require_whole_steps(times, float(f"{step:.12g}"))
    assert until - question.every - 4 * (asked or 0) <= question.until <= until


def test_a_step_that_is_asked_about_has_samples_at_its_double() -> None:
    """Samples are at whole steps of twice and four times the step, and the runs end with such a step."""
    whole = AnswerQuestion.of("double_pendulum", {}, 5.0)
    question = whole.sampled_for(3e-3)
    assert question.until == pytest.approx(4.992)
    assert whole.sampled_for(1e-3).until == 5.0
    for length in (question.until, question.every):
        assert length / 12e-3 == pytest.approx(round(length / 12e-3))
    assert whole.sampled_for(None) == whole
    with pytest.raises(InputError, match="at most a quarter"):
        whole.sampled_for(2.0)


def test_a_changed_program_has_answers_of_its_own(tmp_path: Path) -> None:
    """Answers about an engine that is a program are stored by its content, both of a search and of its own step."""
    program = tmp_path / "rod"
    question = AnswerQuestion.of("pendulum", {}, 1.0)
    asked = AskedTolerance.of(["1e-4"], question.loaded)
    paths = []
    for content in ("first", "second", "first"):
        program.write_text(content)
        program.chmod(0o755)
        engine = f"rod@program:{program}"
        paths += [answer_path(tmp_path, question, asked, [engine])]
        paths += [answer_path(tmp_path, question, asked, [f"{engine}[dt=0.002]"], UNSEARCHED)]
    assert len(set(paths)) == 4
    assert paths[:2] == paths[4:]


@pytest.mark.drill
def test_an_answer_is_true_of_the_engine_and_is_stored(tmp_path: Path) -> None:
    """What is advised holds in a run of its own with other samples; the stored answer is the one that was made."""
    import proofroll

    runner = Runner(Store(tmp_path / "cases"), jobs=1, workers=Workers())
    question = AnswerQuestion.of("double_pendulum", {}, 1.0)
    asked = AskedTolerance.of(["1e-4"], question.loaded)
    (made,) = answer(question, [asked], ["mujoco[preset=tuned]"], runner)
    assert made.taken is not None
    assert made.taken.state is State.HOLDS
    path = answer_path(tmp_path, question, asked)
    assert kept(made, path) == stored(path, SceneAnswer)
    assert record(SceneAnswer, plain(made)).taken == kept(made, path).taken
    every = 3 * (made.taken.step or 0.0)
    until = every * int(1.0 / every)
    run = proofroll.simulate(proofroll.load_scene("double_pendulum"), made.taken.spec, until=until, every=every)
    true = proofroll.simulate(proofroll.load_scene("double_pendulum"), "truth", until=until, every=every)
    (bound,) = [bound for bound in made.bounds if bound.quantity == "p_WB"]
    assert float(np.abs(run["p_WB"].values - true["p_WB"].values).max()) <= bound.allowed


@pytest.mark.nightly
def test_advised_forces_hold_where_they_are_claimed(tmp_path: Path) -> None:
    """At a run of other samples they hold at twice the interval from the event; beside it they are far off."""
    import proofroll

    runner = Runner(Store(tmp_path / "cases"), jobs=1, workers=Workers())
    question = AnswerQuestion.of("slide_to_roll", {})
    asked = AskedTolerance.of(["1e-2"], question.loaded, forces=True)
    (made,) = answer(question, [asked], ["pinocchio[formulation=impulses,preset=default]"], runner)
    assert made.confirmed is not None
    (event,) = made.changes
    (bound,) = [bound for bound in made.bounds if bound.quantity == "F2"]
    every = 0.5 * (made.confirmed.step or 0.0)
    runs = [
        proofroll.simulate(question.loaded, spec, until=made.until, every=every)
        for spec in (f"pinocchio[formulation=impulses,preset=default,dt={every!r}]", "truth")
    ]
    times = runs[0]["time"].to_numpy()
    off = np.abs(runs[0]["F2"].to_numpy() - runs[1]["F2"].to_numpy())
    claimed = (times >= made.every) & (np.abs(times - event) >= 2 * made.every)
    assert off[claimed].max() <= bound.allowed < off[times >= made.every].max()


@pytest.mark.nightly
def test_a_chaotic_motion_is_judged_before_its_horizon(tmp_path: Path) -> None:
    """Runs that are longer than a motion can be known are judged as far as it is, and the answer says how far."""
    runner = Runner(Store(tmp_path / "cases"), jobs=1, workers=Workers())
    question = AnswerQuestion.of("double_pendulum", {"angle": 2.8}, 12.0)
    asked = AskedTolerance.of(["1e-2"], question.loaded)
    (made,) = answer(question, [asked], ["mujoco[preset=tuned]"], runner)
    assert made.taken is not None
    assert 6.0 < made.until < 8.5
    assert "chaotic" in made.beyond
    assert not made.open
    shorter, _ = AnswerQuestion.of("double_pendulum", {}, 1.0).well_posed(
        resolve_with_truth([], runner.workers)[1], runner
    )
    assert not shorter.beyond
