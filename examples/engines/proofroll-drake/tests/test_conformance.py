"""The engine keeps every promise of the protocol, but for what its defaults are known to do."""

import pytest
from proofroll_drake.engine import Drake

from proofroll.conformance import checks

KNOWN = {
    "tolerance_has_an_effect[continuous-default]": "from Drake's default accuracy on the largest step decides, not it",
}


@pytest.mark.parametrize("check", checks(Drake, KNOWN), ids=lambda check: check.name)
def test_engine(check):
    check()
