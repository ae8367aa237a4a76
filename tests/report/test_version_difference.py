"""Differences of one case between two versions of an engine."""

from __future__ import annotations

from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.versions.difference import case_difference


def test_a_quantity_that_one_version_alone_gives_is_named(made: tuple[Outcome, Store]) -> None:
    """Lost and gained forces are changes; between runs that give the same quantities there is no such sentence."""
    outcome, _ = made
    fine, silent = (
        next(run for run in outcome.runs if run.row is row) for row in (outcome.comparison.rows[i] for i in (0, 2))
    )
    lost, gained, same = (
        case_difference(outcome, *pair).changed for pair in ((fine, silent), (silent, fine), (fine, fine))
    )
    assert "N is given no more" in lost
    assert "N is given now" in gained
    assert not same
