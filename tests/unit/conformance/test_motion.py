"""Checks of batches find copies that disturb each other, and pass an engine whose copies do not."""

from __future__ import annotations

import pytest
from batched import Batched, Mixing, Spreading

from proofroll.conformance import checks
from proofroll.conformance.checks import Check
from proofroll.engines.mujoco import Mujoco

_RUNS, _ALONE = "copies_move_as_runs", "a_copy_that_overflows_stays_alone"
_OF = "[joints-matched-double_pendulum]"


def check_of(engine: type, name: str) -> Check:
    """Check of an engine by its name."""
    (found,) = [check for check in checks(engine) if check.name == f"{name}{_OF}"]
    return found


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("name", [_RUNS, _ALONE])
def test_copies_that_move_alone_pass(name: str) -> None:
    """An engine whose copies are runs of their own passes."""
    check_of(Batched, name)()


@pytest.mark.parametrize(
    ("engine", "name", "said"),
    [
        (Mixing, _RUNS, r"copy 1 ends .* from a run of its scene alone"),
        (Spreading, _ALONE, r"copy 0 ends nan from a run of its scene alone"),
    ],
)
def test_copies_that_disturb_each_other_are_found(engine: type, name: str, said: str) -> None:
    """A value of a neighbour shows beside runs alone, and so does what is not finite in every copy."""
    with pytest.raises(AssertionError, match=said):
        check_of(engine, name)()


def test_an_engine_without_batches_has_no_such_check() -> None:
    """An engine that moves no copies together is not asked."""
    assert not [check.name for check in checks(Mujoco) if check.name.startswith((_RUNS, _ALONE))]
