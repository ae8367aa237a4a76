"""A truth that is ended by its limit of processor time keeps what it has found, and is not stored."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import ended_early
from proofroll.core.pace import PACE
from proofroll.core.truth import truth
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.files.scene_file import load_scene
from proofroll.running.case import EngineFacts, Result, Status
from proofroll.running.identity import resolve
from proofroll.running.run_case import run
from proofroll.running.store import Store
from proofroll.studies.cases import case_of
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check import held_to_laws

TIMES = np.linspace(0.0, 1.0, 101)


@pytest.fixture
def ticking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processor time is a hundredth of a second more at each look."""
    ticks = count()
    monkeypatch.setattr("proofroll.core.pace.time.process_time", lambda: next(ticks) / 100)


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("stopped_fall-parameters1")
@pytest.mark.drill
@pytest.mark.parametrize(
    ("name", "parameters"),
    [("bouncing_ball", {"restitution": 0.8}), ("stopped_fall", {}), ("double_pendulum", {})],
)
@pytest.mark.usefixtures("ticking")
def test_a_limit_keeps_what_came_before(name: str, parameters: dict[str, float]) -> None:
    """A truth that is ended by its limit has the values of the whole one up to there, and says why it ends."""
    scene = load_scene(name, **parameters)
    whole = truth(scene, TIMES)
    for limit in (0.5, 0.25, 0.12, 0.06):
        with PACE.limited(limit):
            cut = truth(scene, TIMES)
        if PACE.over:
            break
    ended = ended_early(cut)
    assert ended is not None
    end, reason = ended
    assert reason == f"its limit of {limit:g} s of processor time was reached"
    assert 0 < len(cut.time) < len(whole.time)
    assert end > cut.time[-1]
    bar = float(cut["positions"].attrs["error_bar"]) + float(whole["positions"].attrs["error_bar"])
    same = np.abs(cut["positions"].to_numpy() - whole["positions"].to_numpy()[: len(cut.time)])
    assert same.max() <= max(bar, 1e-12)


@pytest.mark.drill
@pytest.mark.parametrize("name", ["pendulum_friction", "double_pendulum"])
def test_samples_that_would_take_too_long_are_left_out(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A truth whose samples do not fit in its limit has those that do, with the same values, and says why it ends."""
    scene, times, clock = load_scene(name), TIMES[:61], [0.0]
    whole = truth(scene, times)
    recorded = MaximalCoordinates.recorded

    def slow(route: MaximalCoordinates, times: FloatArray, *others: Any) -> Record:
        clock[0] += 0.12 * len(times)
        return recorded(route, times, *others)

    monkeypatch.setattr("proofroll.core.pace.time.process_time", lambda: clock[0])
    monkeypatch.setattr(MaximalCoordinates, "recorded", slow)
    with PACE.limited(6.0):
        cut = truth(scene, times)
    count, (end, reason) = len(cut.time), ended_early(cut) or (0.0, "")
    assert PACE.over
    assert reason == "its limit of 6 s of processor time was reached"
    assert end > cut.time[-1]
    assert 5 <= count < len(times)
    assert clock[0] <= 6.0
    np.testing.assert_array_equal(cut["positions"], whole["positions"][:count])


@pytest.mark.drill
@pytest.mark.parametrize("begins", [5.3, 5.9])
def test_a_limit_that_ends_the_early_sum_of_rebounds_ends_the_truth(
    begins: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error of the sum is that of a second path: where the limit ends this, the truth ends, too."""
    scene, clock, follow = load_scene("bouncing_ball", restitution=0.5), [0.0], PACE.follow
    whole = truth(scene, 2 * TIMES)

    def begun(route: str, end: float, *, smooth: bool = False) -> None:
        follow(route, end, smooth=smooth)
        clock[0] = begins if route == "early" else 0.0

    def looked() -> float:
        clock[0] += 0.1 * (clock[0] > 0)
        return clock[0]

    monkeypatch.setattr("proofroll.core.pace.time.process_time", looked)
    monkeypatch.setattr(PACE, "follow", begun)
    with PACE.limited(6.0):
        cut = truth(scene, 2 * TIMES)
    count, (end, reason) = len(cut.time), ended_early(cut) or (0.0, "")
    assert (PACE.over, reason) == (True, "its limit of 6 s of processor time was reached")
    assert 0 < count < len(whole.time)
    assert end > cut.time[-1]
    assert float(np.abs(cut["positions"].to_numpy() - whole["positions"].to_numpy()[:count]).max()) <= 1e-12


@pytest.mark.drill
@pytest.mark.usefixtures("ticking")
def test_a_truth_that_was_cut_is_not_stored(tmp_path: Path) -> None:
    """A worker gives what the truth has found, and the next run does not take that for the whole."""
    scene = load_scene("stopped_fall")
    case = case_of("stopped_fall", scene, {}, EngineFacts(**resolve("truth", {})), 1.0, 0.01, time_limit=0.25)
    result = Result.from_dict(run(dataclasses.asdict(case), str(tmp_path / "cut.npz")))
    assert (result.status, result.cut) == (Status.DONE, True)
    assert "its limit of 0.2 s of processor time was reached" in result.message
    store = Store(tmp_path / "cases")
    store.put(case, result, tmp_path / "cut.npz")
    assert (store.has(case), store.get(case)) == (False, None)
    assert ended_early(store.stored(case).dataset) is not None  # for who asked
    store.put(case, dataclasses.replace(result, cut=False))
    assert store.get(case) is not None


CHECKS = {
    "transitions": ("bouncing_ball", {"restitution": 0.7}, held_to_laws, "transition", 4.0),
    "witness of a closed form": ("four_bar", {}, JointCoordinates, "rk4_states", 0.1),
}


@pytest.mark.nightly
@pytest.mark.parametrize("check", CHECKS)
def test_a_check_is_within_the_limit(check: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A truth ends, with its true reason, where its limit ends what it is checked by; what came before is as it was."""
    name, parameters, owner, function, seconds = CHECKS[check]
    scene, times, clock, plain = load_scene(name, **parameters), 2 * TIMES, [0.0], getattr(owner, function)
    whole = truth(scene, times)
    assert ended_early(whole) is None

    def slow(run: Callable[..., Any], *given: Any, **named: Any) -> Any:
        clock[0] += seconds
        return run(*given, **named)

    def slow_states(equations: JointCoordinates, *given: Any) -> Iterator[Any]:
        yield from (slow(lambda state: state, state) for state in plain(equations, *given))

    slowed = {"rk4_states": slow_states}.get(function, partial(slow, plain))
    monkeypatch.setattr("proofroll.core.pace.time.process_time", lambda: clock[0])
    monkeypatch.setattr(owner, function, slowed)
    with PACE.limited(10.0):
        cut = truth(scene, times)
    count, (end, reason) = len(cut.time), ended_early(cut) or (0.0, "")
    assert PACE.over
    assert reason == "its limit of 10 s of processor time was reached"
    assert 0 < count < len(times)
    assert cut.time[-1] < end <= times[count]
    assert clock[0] <= 12.0
    np.testing.assert_array_equal(cut["positions"], whole["positions"][:count])
