"""The engine keeps every promise of the protocol; each formulation in a process of its own."""

import pytest
from proofroll_mjx.engine import Mjx

from proofroll.conformance import checks

ORDER = "connects lack the acceleration by velocities, whose error falls faster than the step"
KNOWN = {"order_is_as_declared[f64-matched]": ORDER}


@pytest.mark.nightly
@pytest.mark.parametrize("check", checks(Mjx, KNOWN, apart=True), ids=lambda check: check.name)
def test_engine(check):
    check()
