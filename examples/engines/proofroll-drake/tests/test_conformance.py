"""The engine keeps every promise of the protocol, but for what its defaults are known to do."""

import pytest
from proofroll_drake.engine import Drake

from proofroll.conformance import checks

KNOWN = {
    "tolerance_has_an_effect[continuous-default]": "from Drake's default accuracy on the largest step decides, not it",
    "moves_as_the_truth[contact-*-falling_rod]": "a foot that sticks creeps at 3e-6 m/s at every step: its contact is "
    "soft, of 1e6 N/m, and friction counts as sticking up to 1e-4 m/s",
}


@pytest.mark.parametrize("check", checks(Drake, KNOWN), ids=lambda check: check.name)
def test_engine(check):
    check()
