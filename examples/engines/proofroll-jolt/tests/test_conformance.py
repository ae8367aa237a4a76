"""The engine keeps every promise of the protocol, but for what its defaults are known to do."""

import pytest
from proofroll_jolt.engine import Jolt

from proofroll.conformance import checks

SPUN = "culverin leaves Jolt's gyroscopic moment off, so that free bodies spin wrongly"
STEP = "1/60 s is long for this motion"
PULLED = "in a step of 1/60 s joints that came apart are pulled together, which moves places and not velocities"
KNOWN = {
    "first_steps_fit_the_scene[*-falling_body]": SPUN,
    "moves_as_the_truth[*-falling_body]": SPUN,
    "velocities_are_the_rates[impulse-default]": PULLED,
    "moves_as_the_truth[impulse-default-slider_crank]": STEP,
    "moves_as_the_truth[impulse-default-double_pendulum]": STEP,
}


@pytest.mark.parametrize("check", checks(Jolt, KNOWN), ids=lambda check: check.name)
def test_engine(check):
    check()
