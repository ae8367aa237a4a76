"""One run, as the command line asks for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.answer.question import question_named
from proofroll.studies.cases import single_case
from proofroll.studies.ladder.ladder import Ladder


@pytest.mark.parametrize(
    ("scene", "until"), [("andrews_squeezer", 0.03), ("pendulum", 2.0), ("sphere_in_cylinder", 2.0)]
)
def test_a_run_lasts_two_seconds_or_as_long_as_its_scene(scene: str, until: float) -> None:
    """Without a last time a scene of 0.03 s is not computed for minutes, nor one of 10 s whole."""
    assert single_case(scene, {}, "truth", until=None, every=None, time_limit=60.0).until == until


def test_studies_last_as_long_as_a_run(tmp_path: Path) -> None:
    """An answer and a ladder of a scene of 0.7 s end there, where nobody gives another time."""
    assert question_named("sled", {}).until == 0.7
    assert Ladder("sled", {}, Runner(Store(tmp_path)), engines=("projection",)).until == 0.7
