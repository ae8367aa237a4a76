"""The law check in truths: a fault in shared code ends them, with all values before; without one a line tells."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.columns import Columns
from proofroll.core.dataset import LAWS, truth_message
from proofroll.core.errors import Refused
from proofroll.truth.switched_truth import truth_of
from proofroll_drill.law_faults import FAULTS, SCENES, planted

_BY_WORDS = {fault.words: fault for fault in FAULTS}
IMPACT = 0.1428  # s, at which the thrown ball lands


def test_a_contact_that_closes_early_ends_the_truth_there() -> None:
    """The truth keeps its values before the impact, has none after it, and names law, part and both routes."""
    ball, until = SCENES["grip"]
    with planted(_BY_WORDS["contact closes early"]):
        motion = truth_of(ball(), np.linspace(0.0, until, 21))
    assert motion.end == pytest.approx(IMPACT, abs=1e-3)
    assert len(motion.record.time) == 8  # 0 to 0.14 s
    assert motion.events == ()
    assert "both routes (joint coordinates and bodies) break" in motion.ended
    assert "for contact by 1e-06 of its natural size" in motion.ended
    assert motion.ended.endswith("an error of proofroll; please report it")
    assert not motion.laws


def test_a_fault_from_the_start_is_refused() -> None:
    """A truth of which nothing is known has no values."""
    ball, until = SCENES["grip"]
    with planted(_BY_WORDS["gravity"]), pytest.raises(Refused, match="please report it"):
        truth_of(ball(), np.linspace(0.0, until, 3))


def test_a_truth_says_that_it_holds_all_laws() -> None:
    """The motion and the line of a run have the outcome."""
    ball, until = SCENES["grip"]
    laws = truth_of(ball(), np.linspace(0.0, until / 2, 3)).laws
    assert laws.startswith("holds 12 laws at ")
    line = truth_message(Columns({}, {"route": "one", "second_route": "two", LAWS: laws}))
    assert line == f"one, checked by two; {laws}"
