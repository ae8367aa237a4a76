"""The engine keeps every promise of the protocol, but for what its defaults are known to do."""

import pytest
from proofroll_drake.engine import Drake

from proofroll.conformance import checks

KNOWN = {
    "tolerance_has_an_effect[continuous-default]": "from Drake's default accuracy on the largest step decides, not it",
    "moves_as_the_truth[discrete-default-heavy_top]": "first order at 60 rad/s: at 1e-3 s forces are off by a ninth, "
    "and by half as much at half the step",
}


@pytest.mark.parametrize("check", checks(Drake, KNOWN), ids=lambda check: check.name)
def test_engine(check):
    check()
