"""One run, as the command line asks for it."""

from __future__ import annotations

import pytest

from proofroll.studies.cases import single_case


@pytest.mark.parametrize(
    ("scene", "until"), [("andrews_squeezer", 0.03), ("pendulum", 2.0), ("sphere_in_cylinder", 2.0)]
)
def test_a_run_lasts_two_seconds_or_as_long_as_its_scene(scene: str, until: float) -> None:
    """Without a last time a scene of 0.03 s is not computed for minutes, nor one of 10 s whole."""
    assert single_case(scene, {}, "truth", until=None, every=None, time_limit=60.0).until == until
