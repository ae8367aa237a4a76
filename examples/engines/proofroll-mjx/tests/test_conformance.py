"""The engine keeps every promise of the protocol; each formulation in a process of its own."""

import pytest
from proofroll_mjx.engine import Mjx

from proofroll.conformance import checks

ORDER = "connects lack the acceleration by velocities, whose error falls faster than the step"
AT_START = "connects lack the acceleration by velocities, which loops that move at the start have"
KNOWN = {"order_is_as_declared[f64-matched]": ORDER} | {
    f"first_steps_fit_the_scene[{kind}-matched-{scene}]": AT_START
    for kind in ("f64", "f32")
    for scene in ("slider_crank", "spatial_slider_crank")
}


@pytest.mark.nightly
@pytest.mark.parametrize("check", checks(Mjx, KNOWN, apart=True), ids=lambda check: check.name)
def test_engine(check):
    check()
