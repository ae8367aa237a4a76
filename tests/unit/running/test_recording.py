from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hostile import GivesUp, HostileSettings, NotANumber, Oracle

from proofroll.core.errors import Diverged
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grid, time_grid
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll.running.recording import record


@pytest.fixture
def sphere() -> Scene:
    """The paper's scene."""
    return load_scene("sphere_in_cylinder")


class Misshapen(Oracle):
    """From 0.1 s on one quantity has a shape of its own."""

    wrong: dict[str, Any] = {"w_WB": np.zeros(2)}  # noqa: RUF012 -- replaced by a subclass, never changed

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        right = super().sample()
        values = {"p_WB": right.p_WB, "v_WB": right.v_WB, "w_WB": right.w_WB, "force": right.force}
        return BallSample(**(values | (self.wrong if self.t >= 0.1 else {})))


def test_record(sphere: Scene) -> None:
    """A run that reaches the end has all samples, no failure and the time spent in advance."""
    recording = record(Oracle.build(sphere, HostileSettings()), sphere, time_grid(0.5, 0.1))
    assert recording.failure is None
    assert recording.dataset["gamma"].to_numpy() == pytest.approx(20 * np.linspace(0, 0.5, 6), abs=1e-12)
    assert recording.wall_seconds > 0


@pytest.mark.parametrize(
    ("kind", "samples", "words"),
    [
        (NotANumber, 2, ["v_WB", "not finite", "0.1 s"]),
        (GivesUp, 2, ["step size fell to nothing at 0.1 s"]),
        (Misshapen, 2, ["w_WB", "(2,) instead of (3,)", "0.1 s"]),
        (type("Five", (Misshapen,), {"wrong": {"q_WB": np.zeros(5)}}), 2, ["q_WB", "(5,) instead of (4,)"]),
        (type("Long", (Misshapen,), {"wrong": {"q_WB": np.array([1.01, 0, 0, 0])}}), 2, ["q_WB has length 1.01 at"]),
        (type("Zero", (Misshapen,), {"wrong": {"q_WB": np.zeros(4)}}), 2, ["q_WB has length 0 at 0.1 s"]),
    ],
)
def test_a_run_that_ends_early(sphere: Scene, kind: Any, samples: int, words: list[str]) -> None:
    """NaN, infinity, a wrong shape or length, or an engine that gives up end the run with a sentence."""
    recording = record(kind.build(sphere, HostileSettings()), sphere, time_grid(0.5, 0.05))
    assert recording.dataset.sizes["time"] == samples
    assert recording.failure is not None
    for word in words:
        assert word in recording.failure
    assert np.all(np.isfinite(recording.dataset["v_WB"]))


def test_nan_at_the_start(sphere: Scene) -> None:
    """An engine that starts with NaN has no trajectory at all."""

    class FromTheStart(Misshapen):
        wrong = {"p_WB": np.full(3, np.nan)}  # noqa: RUF012 -- never changed

        def sample(self) -> BallSample:
            self.t = 1.0
            return super().sample()

    with pytest.raises(Diverged, match="p_WB is not finite"):
        record(FromTheStart.build(sphere, HostileSettings()), sphere, time_grid(0.5, 0.1))


def test_every_sample_is_taken_once_per_advance(sphere: Scene) -> None:
    """The engine is advanced to each time in turn and never asked to go back."""
    asked: list[float] = []

    class Remembers(Oracle):
        def advance(self, t: float) -> None:
            asked.append(t)
            super().advance(t)

    times = time_grid(0.3, 0.1)
    record(Remembers.build(sphere, HostileSettings()), sphere, times)
    assert asked == times[1:].tolist()


def test_an_orientation_that_was_asked_for() -> None:
    """An engine that was asked for the orientation and does not give it has failed, and one sentence says so."""
    asking = load_scene("sphere_in_cylinder", asks=("orientation",))
    recording = record(Oracle.build(asking, HostileSettings()), asking, time_grid(0.1, 0.05))
    assert recording.failure == "the engine does not give the orientation of the bodies"


def test_times_off_the_grid() -> None:
    """Some samples lie strictly between those of the grid, at other parts of each interval, and after whole steps."""
    times = time_grid(1.0, 0.02)
    for step in (None, 1e-3, 2e-3, 1e-4):
        found = off_grid(times, step)
        assert len(found) == 8
        parts = (found - times[np.searchsorted(times, found) - 1]) / 0.02
        assert np.all((parts > 1e-3) & (parts < 1 - 1e-3))
        assert len(np.unique(np.round(parts, 6))) >= 4
        if step is not None:
            assert found / step == pytest.approx(np.round(found / step), abs=1e-6)
    assert off_grid(times, 0.02).size == 0, "no whole step ends between"
    assert set(off_grid(times, 1e-3)) == set(off_grid(times, 2e-3)) == set(off_grid(times, None))
    assert off_grid(times, 0.02 / 7).size == off_grid(times, 0.02 / 13).size == 8, "also where no tenth is a step"
    assert [off_grid(times[:count], None).size for count in (4, 5, 11)] == [0, 1, 2], "few where there are few"


def test_where_nothing_can_lift_the_ball_a_pull_is_no_lift_off(sphere: Scene) -> None:
    """In an upright cylinder a wall that pulls is an engine's error, and its run goes on to show it."""

    class Pulls(Oracle):
        def sample(self) -> BallSample:
            right = super().sample()
            return replace(right, force=-np.asarray(right.force) if self.t > 0.2 else right.force)

    recording = record(Pulls.build(sphere, HostileSettings()), sphere, time_grid(0.5, 0.1))
    assert (recording.failure, recording.ended) == (None, None)
    assert recording.dataset.sizes["time"] == 6
    assert recording.dataset["N"].min() < 0
