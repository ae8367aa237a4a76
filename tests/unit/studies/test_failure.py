"""Kinds of failure, by trajectories that were made to show each."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from placed_balls import run_of

from proofroll.core.dataset import BETWEEN
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.running.case import Result, Status
from proofroll.studies.failure import LOST_PHASE, Yardstick, meanings, run_outcome

SCENE = load_scene("sphere_in_cylinder")
TIMES = np.linspace(0.0, 3 * SCENE.elements[0].natural_time, 25)
DONE = Result(Status.DONE, "reached the end")
LATE = (np.arange(len(TIMES)) >= 12)[:, None]


@cache
def true() -> Any:
    """The truth, computed when the first test needs it."""
    return truth(SCENE, TIMES)


def p_WB() -> Any:
    """Its places [m]."""
    return true()["p_WB"].to_numpy()[:, 0]


def v_WB() -> Any:
    """Its velocities [m/s]."""
    return true()["v_WB"].to_numpy()[:, 0]


def run(p: Any = None, v: Any = None, w: Any = None, upto: int = 25) -> Any:
    """A trajectory of these states, or of the truth's."""
    given = {"p_WB": p, "v_WB": v, "w_WB": w}
    states = (true()[name].to_numpy()[:, 0] if value is None else value for name, value in given.items())
    return run_of(SCENE, TIMES[:upto], *(state[:upto] for state in states))


def drifting(speed: float) -> Any:
    """The truth with a slip along the wall on top."""
    slip = np.array([0.0, 0.0, speed])
    return run(p_WB() + TIMES[:, None] * slip, v_WB() + slip)


def slower(factor: float) -> Any:
    """The truth with its clock going slower."""
    other = truth(SCENE, TIMES * factor)
    return run(*(other[name].to_numpy()[:, 0] for name in ("p_WB", "v_WB", "w_WB")))


def test_the_truth_is_accurate() -> None:
    """A run that is right is stable, accurate and has no failure."""
    outcome = run_outcome(DONE, run(), Yardstick.of(SCENE, true()))
    assert (outcome.stable, outcome.accurate, outcome.failure, outcome.silent) == (True, True, None, False)


@pytest.mark.parametrize(
    ("dataset", "failure", "stable"),
    [
        (lambda: run(p_WB() + LATE * 0.005 * rolling_ball(SCENE).surface.normal(p_WB())), "sank in", False),
        (lambda: run(p_WB() - LATE * 0.005 * rolling_ball(SCENE).surface.normal(p_WB())), "left the surface", False),
        (lambda: run(v=v_WB() * (1 + 0.2 * LATE)), "energy gain", False),
        (lambda: drifting(-0.01), "creep", True),
        (lambda: drifting(-0.2), "creep", False),
        (lambda: slower(0.97), "lost phase", True),
    ],
    ids=["sank", "left", "gain", "creeps a little", "creeps far", "phase"],
)
def test_a_bad_run_that_says_it_is_done(dataset: Callable[[], Any], failure: str, stable: bool) -> None:
    """A run that reached the end and is wrong is a silent failure of the kind that was put into it."""
    outcome = run_outcome(DONE, dataset(), Yardstick.of(SCENE, true()))
    assert (outcome.failure, outcome.stable, outcome.accurate, outcome.silent) == (failure, stable, False, True)


def test_what_is_wrong_between_the_samples_is_seen() -> None:
    """A run that is right on the grid alone holds nothing."""
    known = truth(SCENE, TIMES, between=TIMES[:-1] + 0.4 * np.diff(TIMES))
    liar, yardstick = known.copy(deep=True), Yardstick.of(SCENE, known)
    assert run_outcome(DONE, known, yardstick).accurate
    liar[f"between.{SCENE.deciding}"] += 0.05 * yardstick.scale
    outcome = run_outcome(DONE, liar, yardstick)
    assert (outcome.stable, outcome.accurate, outcome.error) == (True, False, pytest.approx(0.05))


def test_what_is_wrong_between_two_samples_is_dated_there() -> None:
    """A run that is wrong by the whole range within one interval alone fails at the end of that interval."""
    known = truth(SCENE, TIMES, between=TIMES[:-1] + 0.4 * np.diff(TIMES))
    yardstick, liar = Yardstick.of(SCENE, known), known.copy(deep=True)
    liar[f"between.{SCENE.deciding}"][6] += 3 * yardstick.scale
    outcome = run_outcome(DONE, liar, yardstick)
    assert (outcome.stable, outcome.time) == (False, pytest.approx(TIMES[7]))


def test_what_came_first() -> None:
    """Of two failures the earlier one counts, for the later may be its consequence."""
    later = (np.arange(len(TIMES)) >= 18)[:, None]
    normal = rolling_ball(SCENE).surface.normal(p_WB())
    outcome = run_outcome(
        DONE, run(p_WB() + later * 0.005 * normal, v_WB() * (1 + 0.2 * LATE)), Yardstick.of(SCENE, true())
    )
    assert outcome.failure == "energy gain"
    assert outcome.time == pytest.approx(TIMES[12])


@pytest.mark.parametrize(
    ("status", "message", "failure", "silent"),
    [
        (Status.DIVERGED, "p_WB is not finite (NaN or overflow) at 0.3 s", "diverged", True),
        (Status.DIVERGED, "the engine gave up: velocities are not finite or huge", "diverged", False),
        (Status.DIVERGED, "Newton's method did not converge", "solver gave up", False),
        (Status.CRASHED, "was killed by SIGSEGV", "crashed", False),
        (Status.TIMEOUT, "no result within 8 s", "too slow", False),
        (Status.REFUSED, "needs rolling resistance", "refused", False),
        (Status.WRONG_MODEL, "the engine's model differs from the scene", "wrong model", False),
    ],
)
def test_runs_that_ended_early(status: Status, message: str, failure: str, silent: bool) -> None:
    """A run that ended early is never stable; only a NaN that the engine did not mention is silent."""
    dataset = run(upto=6) if status == Status.DIVERGED else None
    outcome = run_outcome(Result(status, message), dataset, Yardstick.of(SCENE, true()))
    assert (outcome.failure, outcome.silent, outcome.stable, outcome.accurate) == (failure, silent, False, False)


def test_a_friction_that_stands_for_an_unbounded_one_accuses_nobody() -> None:
    """A run whose model has less friction than the true motion needs is one of a different scene, whatever it shows."""
    lines = [{"quantity": "inverse friction", "found": [100.0]}]
    found = run_outcome(replace(DONE, certificate=lines), run(p_WB() + LATE), Yardstick.of(SCENE, true()))
    assert (found.failure, found.silent) == ("wrong model", False)
    assert "a friction of 0.01" in found.message


def test_without_a_truth() -> None:
    """Without a truth a run is judged by what needs none: surface and energy."""
    alone = Yardstick.of(SCENE, None)
    assert run_outcome(DONE, slower(0.5), alone).stable
    assert run_outcome(DONE, run(v=v_WB() * (1 + 0.2 * LATE)), alone).failure == "energy gain"
    assert run_outcome(DONE, slower(0.5), alone).error is None


def test_every_kind_has_a_meaning() -> None:
    """A person finds the definition of every kind."""
    assert all(text and name == name.lower() for name, text in meanings(SCENE).items())


def test_the_natural_time() -> None:
    """It is the period 2π/(√(2/7) V0/c) of z."""
    assert SCENE.elements[0].natural_time == pytest.approx(2 * math.pi / (math.sqrt(2 / 7) * 20.0))


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("after", "failure"), [(1.0, None), (-0.002, None), (-0.2, "reversed")])
def test_resistance_does_not_drive_a_ball_back(after: float, failure: str | None) -> None:
    """A ball that resistance drives back has been reversed; the little that a step goes too far is none."""
    scene = load_scene("sphere_in_cylinder", rolling_resistance=5e-4)
    known = truth(scene, TIMES)
    run = known.assign(v_WB=known["v_WB"] * np.where(LATE[:, None], after, 1.0))
    outcome = run_outcome(DONE, run, Yardstick.of(scene, known))
    assert (outcome.failure, outcome.stable, outcome.silent) == (failure, failure is None, failure is not None)


@pytest.mark.drill
def test_a_path_of_several_components() -> None:
    """Where many components decide, each sample has one error, the largest, in parts of the widest range of one."""
    scene = load_scene("pendulum")
    times = np.linspace(0.0, 1.0, 5)
    true = truth(scene, times)
    yardstick = Yardstick.of(scene, true)
    run = true.copy(deep=True)
    run[scene.deciding][3] += 1.5 * yardstick.scale
    outcome = run_outcome(DONE, run, yardstick)
    assert yardstick.scale == float(np.max(np.ptp(true[scene.deciding].to_numpy(), axis=0)))
    assert (outcome.failure, outcome.time) == (LOST_PHASE, times[3])
    assert outcome.error == pytest.approx(1.5)


def test_no_sample_off_the_grid_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run and a truth without a common time off the grid are held against each other on it alone."""
    nothing = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
    monkeypatch.setattr("proofroll.studies.judging.run_values.off_grid", lambda *_: nothing)
    dataset = run().assign({BETWEEN: 0.0})
    measured = Yardstick.of(SCENE, true().assign({BETWEEN: 0.0}))
    assert measured.off_grid(dataset).tolist() == [0.0] * len(TIMES)
