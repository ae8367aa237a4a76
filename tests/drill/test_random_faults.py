"""Random faults between a scene file and its truth: none that both routes follow leaves silently."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest

from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll_drill.random_faults import compared, drawn_faults, functions_of, outcome
from proofroll_fuzz.command import seed_of

Values = dict[str, tuple[np.ndarray[tuple[int], np.dtype[np.float64]], float]]
PLACES = np.array([0.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("off", "kind"), [(0.0, "changes nothing"), (5e-9, "within the bar"), (1e-6, "silent"), (np.nan, "changes nothing")]
)
def test_a_value_beyond_its_bars_is_silent(off: float, kind: str) -> None:
    """Ten times both bars are the limit; a value that is not known says nothing."""
    right: Values = {"p_WB": (PLACES, 1e-9)}
    wrong: Values = {"p_WB": (PLACES + np.array([0.0, 0.0, off]), 1e-9)}
    assert compared(right, wrong).kind == kind


def test_another_event_is_silent() -> None:
    """Kinds of events and numbers of samples have no bar."""
    right = {"event_kind": (np.array(["impact"]), 0.0), "time": (PLACES, 0.0)}
    assert compared(right, right).kind == "changes nothing"
    assert compared(right, right | {"event_kind": (np.array(["stick"]), 0.0)}).kind == "silent"
    assert compared(right, right | {"time": (PLACES[:2], 0.0)}).kind == "silent"


@pytest.mark.nightly
def test_a_draw_hangs_on_nothing_that_ran_before() -> None:
    """Functions of a scene are the same ones after this process has read it and found its truth."""
    before = functions_of("bouncing_ball")
    truth(load_scene("bouncing_ball"), PLACES / 10)
    functions_of.cache_clear()
    assert functions_of("bouncing_ball") == before
    assert len(before) > 100


SEEDS = [("2026-11-29", 60), (f"{datetime.now(UTC):%Y-%m-%d}", 30)]


@pytest.mark.drill
@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("seed", "count"), SEEDS, ids=["the same every night", "of tonight"])
def test_random_faults_are_not_silent(seed: str, count: int) -> None:
    """Each is refused, lies within the bar or changes nothing; of those that read the scene the checks see a part."""
    found = [(fault, outcome(fault)) for fault in drawn_faults(seed_of(seed), count)]
    assert len(found) == count
    assert [(fault, end) for fault, end in found if end.kind == "silent" and not fault.reads] == []
