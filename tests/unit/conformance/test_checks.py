"""Checks of an engine in a process of their own."""

from __future__ import annotations

from unittest import SkipTest

import pytest

from proofroll.conformance.checks import _run_apart
from proofroll.papers.blajer_2006.reduced import Reduced


@pytest.mark.nightly
def test_a_check_apart_ends_as_it_does_here() -> None:
    """In a process of its own a check passes, fails with its text, or says why there is nothing to look at."""
    _run_apart(Reduced, "samples_are_well_formed[closed_form-matched]")
    with pytest.raises(AssertionError, match="KeyError"):
        _run_apart(Reduced, "no_such_check[closed_form-matched]")
    with pytest.raises(SkipTest, match="there is no fixed step"):
        _run_apart(Reduced, "order_is_as_declared[closed_form-matched]")
