"""Faults in code that both routes of the truth share are refused by the checks, or change nothing beyond the bar."""

from __future__ import annotations

import pytest

from proofroll_drill.law_faults import FAULTS, SCENES, LawFault, honest, outcome


@pytest.mark.one_in(3)
@pytest.mark.nightly_of("motors", "slide", "plate")
@pytest.mark.drill
@pytest.mark.parametrize("scene", SCENES)
def test_scenes_of_faults_hold_all_laws(scene: str) -> None:
    """Without a fault no law is violated."""
    assert "what is published holds" in honest(scene).attrs["laws"]


# A quarter of the faults, in turns over the files in which they lie, is planted before a change lands.
_CASES = [
    pytest.param(fault, id=fault.words, marks=pytest.mark.nightly if place % 4 else ())
    for place, fault in enumerate(FAULTS)
]


@pytest.mark.one_in(6)
@pytest.mark.drill
@pytest.mark.parametrize("fault", _CASES)
def test_a_shared_fault_is_not_silent(fault: LawFault) -> None:
    """Each one-token fault ends the truth with a reason, or leaves it within its bar."""
    assert not outcome(fault).startswith("silent"), outcome(fault)
