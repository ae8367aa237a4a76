"""The engine keeps every promise of the protocol; each formulation in a process of its own."""

import pytest
from proofroll_mjx.engine import Mjx

from proofroll.conformance import checks

KNOWN: dict[str, str] = {}


@pytest.mark.nightly
@pytest.mark.parametrize("check", checks(Mjx, KNOWN, apart=True), ids=lambda check: check.name)
def test_engine(check):
    check()
