"""What counts as the cost of a run."""

from __future__ import annotations

import pytest
from nonconforming import Lazy
from tiny import Tiny, TinySettings

from proofroll.core.multi_element import build
from proofroll.core.time_grid import time_grid
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll.running.recording import record
from proofroll.running.time_case import CleanRuns, clean_runs, is_put_off

SCENE = load_scene("sphere_in_cylinder")
SETTINGS = TinySettings()
TIMES = time_grid(0.1, 0.01)


def timed(kind: type[Tiny]) -> CleanRuns:
    """Clean runs of an engine after a run that was recorded."""
    return clean_runs(kind, SCENE, SETTINGS, record(build(kind, SCENE, SETTINGS), SCENE, TIMES))


def test_an_honest_engine_has_a_speed() -> None:
    """Runs that only advance end where the recorded one does, and nothing is to be said of them."""
    found = timed(Tiny)
    assert found.rates
    assert found.remarks == []


def test_what_is_put_off_counts() -> None:
    """Work that an engine leaves to its next sample is part of its cost: it sleeps for two seconds a second there."""
    assert min(timed(Lazy).rates) >= 2.0


class Watched(Tiny):
    """Moves only where it is looked at each time."""

    looked = False

    def advance(self, t: float) -> None:
        """Nothing, unless somebody looks."""
        if self.looked:
            super().advance(t)
        self.t, self.looked = t, False

    def sample(self) -> BallSample:
        """Notes it."""
        self.looked = True
        return super().sample()


def test_a_run_that_nobody_looks_at_is_the_same() -> None:
    """An engine that saves its work where it is not sampled has no speed, and the row says why."""
    found = timed(Watched)
    assert found.rates == []
    assert "no speed is given: the timed run ends at" in found.remarks[0]


@pytest.mark.parametrize(
    ("advancing", "sampling", "usual", "put_off"),
    [
        (1e-3, 1.0, 1e-2, True),  # two hundred samples' work in the last one
        (1.0, 0.9, 1e-2, True),
        (1.0, 0.1, 1e-3, False),  # less than half of the run
        (1e-3, 1.0, 0.5, False),  # every sample is as dear, as that of a closed form
        (1e-5, 1e-2, 1e-4, False),  # too short to tell
    ],
)
def test_a_last_sample_that_does_the_work(advancing: float, sampling: float, usual: float, put_off: bool) -> None:
    """It is one beside which the run and other samples are cheap, in seconds that are no chance."""
    assert is_put_off(advancing, sampling, usual) is put_off
