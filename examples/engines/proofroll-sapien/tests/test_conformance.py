"""The engine keeps every promise of the protocol, but for what its friction and its defaults are known to do."""

import pytest
from proofroll_sapien import Sapien

from proofroll.conformance import checks

STEP = "the impact is found at the start of a step, with the normal of that place: of first order in a step of 1/100 s"
KNOWN = {
    "moves_as_the_truth[tgs-default-sled]": "where three feet slide, friction is some degrees off the slip",
    "moves_as_the_truth[tgs-matched-sled]": "where three feet slide, friction is some degrees off the slip",
    "moves_as_the_truth[pgs-default-sled]": "friction is a pyramid",
    "moves_as_the_truth[pgs-matched-sled]": "friction is a pyramid",
    "moves_as_the_truth[tgs-default-two_spheres]": STEP,
    "moves_as_the_truth[pgs-default-two_spheres]": STEP,
}


@pytest.mark.parametrize("check", checks(Sapien, KNOWN), ids=lambda check: check.name)
def test_engine(check):
    check()
